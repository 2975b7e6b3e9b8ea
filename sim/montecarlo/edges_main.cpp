// SPDX-License-Identifier: Apache-2.0
// waymark-montecarlo-edges DRIVES --config F: edge localization over many drives whose pictures went through the
// detector already, as they were, set down elsewhere, begun anywhere. sim/montecarlo/pictures.py makes the drives.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "common/failure.h"
#include "common/program.h"
#include "common/statistics.h"
#include "montecarlo/reliability.h"
#include "montecarlo/trial.h"

namespace {

using namespace wm::montecarlo;
using wm::tools::Failure;
namespace fs = std::filesystem;

struct Arguments {
  std::string folder, config, scans, diagram;
  std::vector<std::string> kinds = {"normal", "kidnap", "start", "alike"};
  int drives = 100000, each = 1;
  uint64_t seed = 1;
  bool quiet = false;
};

struct Row {
  std::string drive;
  Trial trial;
  Outcome outcome;
};

// Folders with an event log, by name; numbers in their order.
std::vector<fs::path> folders_in(const fs::path &folder) {
  std::vector<fs::path> out;
  if (!fs::is_directory(folder)) throw Failure(folder.string() + ": no such folder", wm::tools::kUsage);
  for (const auto &entry : fs::directory_iterator(folder))
    if (fs::exists(entry.path() / "events.wmlog") && fs::exists(entry.path() / "truth.csv"))
      out.push_back(entry.path());
  std::sort(out.begin(), out.end(), [](const fs::path &a, const fs::path &b) {
    const std::string x = a.filename(), y = b.filename();
    return x.size() != y.size() ? x.size() < y.size() : x < y;
  });
  return out;
}

TrialKind kind_of(const std::string &name) {
  if (name == "kidnap") return TrialKind::kKidnap;
  if (name == "start") return TrialKind::kStart;
  return name == "alike" ? TrialKind::kAlike : TrialKind::kNormal;
}

void spread(const char *what, const char *unit, std::vector<double> v) {
  std::erase_if(v, [](double x) { return !std::isfinite(x); });
  if (v.empty()) return;
  std::printf("  %-34s median %8.3f, 90 of 100 below %8.3f, largest %8.3f %s\n", what, wm::tools::percentile(v, 50),
              wm::tools::percentile(v, 90), *std::max_element(v.begin(), v.end()), unit);
}

double value(const std::optional<double> &v) { return v ? *v : std::nan(""); }

void print_row(const Row &row) {
  const Outcome &o = row.outcome;
  if (row.trial.kind == TrialKind::kNormal) {
    std::printf("%8s | %7.4f %7.3f | %7.3f | %5.3f | %4s | %d\n", row.drive.c_str(), o.position_mean_m(),
                o.position_max_m(), o.heading_mean_deg(), o.nees_inside(), o.lost() ? "lost" : "", o.false_alarms());
  } else {
    const auto cut_s = [](int64_t t) { return t == INT64_MIN ? 0.0 : std::fmod(1e-9 * static_cast<double>(t), 1000); };
    std::printf("%8s | %6.1f %6.1f | %6.2f | %6.2f | %6.1f | %5.2f\n", row.drive.c_str(), cut_s(row.trial.cut_ns),
                cut_s(row.trial.on_ns), value(o.detected_after_s()), value(o.right_after_m()), o.astray_s(),
                o.covered());
  }
  std::fflush(stdout);
}

void print_header(TrialKind kind) {
  if (kind == TrialKind::kNormal)
    std::printf("   drive |  mean m   max m | heading |  NEES |      | false alarms\n");
  else
    std::printf("   drive |  cut s   on s | lost s | right m | astray s | covered\n");
}

void print_summary(const std::string &name, const std::vector<Row> &rows) {
  std::vector<double> mean, most, heading, nees, detected, way;
  size_t lost = 0, alarms = 0, detected5 = 0, right20 = 0, astray = 0, covered = 0;
  for (const Row &r : rows) {
    const Outcome &o = r.outcome;
    mean.push_back(o.position_mean_m());
    most.push_back(o.position_max_m());
    heading.push_back(o.heading_mean_deg());
    nees.push_back(o.nees_inside());
    detected.push_back(value(o.detected_after_s()));
    way.push_back(value(o.right_after_m()));
    lost += o.lost();
    alarms += o.false_alarms() > 0;
    detected5 += detected.back() <= 5;
    right20 += way.back() <= 20;
    astray += o.astray_s() > 10;
    covered += o.covered() >= 0.95;
  }
  std::printf("%s: %zu trials\n", name.c_str(), rows.size());
  if (name == "normal") {
    spread("mean position error", "m", mean);
    spread("largest position error", "m", most);
    spread("mean heading error", "deg", heading);
    std::printf("  %-34s mean %8.3f\n", "NEES inside 95 %", wm::tools::mean(nees));
    std::printf("  lost %zu, with a false alarm %zu\n", lost, alarms);
  } else {
    spread("until detected", "s", detected);
    spread("way until it is right", "m", way);
    std::printf("  detected within 5 s %zu, right within 20 m %zu, tracking off by > 1 m for > 10 s %zu, covered %zu\n",
                detected5, right20, astray, covered);
  }
}

void write_scans(const std::string &file, const std::string &kind, const std::vector<Row> &rows, bool first) {
  std::ofstream out(file, first ? std::ios::trunc : std::ios::app);
  if (first) out << "kind,drive,t_s,way_m,error_m,error_deg,nees,lost_probability,explained,points,tracking,covered\n";
  for (const Row &r : rows)
    for (const Sample &s : r.outcome.samples) {
      char line[240];
      std::snprintf(line, sizeof line, "%s,%s,%.2f,%.2f,%.4f,%.3f,%.3f,%.5f,%.3f,%u,%d,%d\n", kind.c_str(),
                    r.drive.c_str(), s.t_s, s.way_m, s.error_m, s.error_rad * 57.29578, s.nees, s.lost_probability,
                    s.explained, s.points, static_cast<int>(s.tracking), static_cast<int>(s.covered));
      out << line;
    }
  if (!out) throw Failure(file + ": could not be written");
}

int run(const Arguments &a) {
  std::vector<fs::path> folders = folders_in(a.folder);
  if (folders.size() > static_cast<size_t>(a.drives)) folders.resize(static_cast<size_t>(a.drives));
  if (folders.empty())
    throw Failure(a.folder + ": no drives (folders with events.wmlog, truth.csv, map/); pictures.py makes them");
  wm_config config{};
  wm_error error{};
  if (wm_config_load(a.config.c_str(), &config, &error) != WM_OK) throw Failure(error.text, wm::tools::kUsage);
  std::fputs(config.warnings, stderr);
  Reliability reliability;
  bool first = true;
  for (const std::string &name : a.kinds) {
    const TrialKind kind = kind_of(name);
    std::vector<Row> rows;
    if (!a.quiet) print_header(kind);
    for (size_t i = 0; i < folders.size(); i++) {
      if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%s: %zu of %zu ", name.c_str(), i + 1, folders.size());
      const EdgeDrive drive(folders[i]);
      const wm_rig &rig = drive.head().rig;
      const double eye_m = rig.camera_count > 0 ? rig.cameras[0].mounting.xyz_m[0] : 0;
      for (const Trial &trial : draw_trials(drive, kind, a.each, eye_m)) {
        rows.push_back({drive.name(), trial, run_trial(drive, config, trial, a.seed)});
        if (!a.quiet) print_row(rows.back());
      }
    }
    for (const Row &r : rows)
      if (kind != TrialKind::kAlike) reliability.take(r.outcome);
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%40s\r", "");
    print_summary(name, rows);
    if (!a.scans.empty()) write_scans(a.scans, name, rows, first);
    first = false;
  }
  wm_config_free(&config);
  reliability.print();
  if (!a.diagram.empty()) reliability.draw(a.diagram);
  return wm::tools::kDone;
}

}  // namespace

int main(int argc, char **argv) {
  Arguments a;
  wm::cli::App app(
      "Edge localization over many drives from their event logs: tracking, set down elsewhere while driving, started "
      "anywhere, set down where it looks the same.",
      "waymark-montecarlo-edges");
  app.add_option("DRIVES", a.folder, "folder of drives, made by sim/montecarlo/pictures.py")->required();
  app.add_option("--config", a.config, "configuration of the estimator")->required();
  app.add_option("--trials", a.kinds, "which: normal, kidnap, start, alike")
      ->delimiter(',')
      ->check(wm::cli::one_of({"normal", "kidnap", "start", "alike"}));
  app.add_option("--drives", a.drives, "at most so many drives")->check(wm::cli::range(1, 100000));
  app.add_option("--each", a.each, "trials a drive, of kidnap and start")->check(wm::cli::range(1, 100));
  app.add_option("--seed", a.seed, "of the filter")->capture_default_str();
  app.add_option("--scans", a.scans, "writes what was judged, a row each 0.1 s, here (CSV)");
  app.add_option("--diagram", a.diagram, "writes the reliability diagram of the probability of being lost here (SVG)");
  app.add_flag("--quiet", a.quiet, "the summaries alone");
  app.footer("docs/consistency.md defines each figure. Exit code: 0 done, 1 failed, 2 usage or configuration.");
  return wm::tools::run_program(app, argc, argv, [&] { return run(a); });
}
