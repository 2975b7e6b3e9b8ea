// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include "common/failure.h"
#include "common/statistics.h"
#include "montecarlo/engines.h"

namespace wm::montecarlo {

void show_progress(const char *what, uint64_t done, uint64_t all) {
  if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%s: %" PRIu64 " of %" PRIu64 " drives ", what, done, all);
}
void end_progress() {
  if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%60s\r", "");
}

std::string spread(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return "    -      -      -";
  char text[80];
  std::snprintf(text, sizeof text, "%6.3f %6.3f %6.3f", tools::percentile(values, 50), tools::percentile(values, 90),
                *std::max_element(values.begin(), values.end()));
  return text;
}

Looks::Looks(const std::string &file) : name_(file) {
  if (file.empty()) return;
  file_.open(file);
  file_ << "trial,drive,t_s,way_m,error_m,error_deg,nees,lost_probability,explained,points,tracking,covered\n";
  if (!file_) throw tools::Failure(file + ": could not be written");
}

void Looks::add(const std::string &trial, const std::string &drive, const Outcome &outcome) {
  if (!file_.is_open()) return;
  for (const Sample &s : outcome.samples) {
    char line[240];
    std::snprintf(line, sizeof line, "%s,%s,%.2f,%.2f,%.4f,%.3f,%.3f,%.6f,%.3f,%u,%d,%d\n", trial.c_str(),
                  drive.c_str(), s.t_s, s.way_m, s.error_m, s.error_rad * 57.29578, s.nees, s.lost_probability,
                  s.explained, s.points, static_cast<int>(s.tracking), static_cast<int>(s.covered));
    file_ << line;
  }
  if (!file_.flush()) throw tools::Failure(name_ + ": could not be written");
}

}  // namespace wm::montecarlo
