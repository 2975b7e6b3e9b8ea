// SPDX-License-Identifier: Apache-2.0
// Edge localization over many drives whose pictures went through the detector already, as they were, set down
// elsewhere, begun anywhere. sim/montecarlo/pictures.py makes the drives.
#include "common/failure.h"
#include "common/statistics.h"
#include "montecarlo/engines.h"
#include "montecarlo/reliability.h"

namespace wm::montecarlo {
namespace {

namespace fs = std::filesystem;
using tools::Failure;

struct Row {
  std::string drive;
  Trial trial;
  Outcome outcome;
};

// Folders with an event log, by name; numbers in their order.
std::vector<fs::path> folders_in(const fs::path &folder) {
  std::vector<fs::path> out;
  if (!fs::is_directory(folder)) throw Failure(folder.string() + ": no such folder", tools::kUsage);
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

void print_spread(const char *what, const std::vector<double> &values) {
  std::printf("  %-34s %s\n", what, spread(values).c_str());
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
  std::printf("%s: %zu trials; median, 90 of 100 below, largest\n", name.c_str(), rows.size());
  if (name == "normal") {
    print_spread("mean position error, m", mean);
    print_spread("largest position error, m", most);
    print_spread("mean heading error, deg", heading);
    std::printf("  %-34s mean %8.3f\n", "NEES inside 95 %", tools::mean(nees));
    std::printf("  lost %zu, with a false alarm %zu\n", lost, alarms);
  } else {
    print_spread("until detected, s", detected);
    print_spread("way until it is right, m", way);
    std::printf("  detected within 5 s %zu, right within 20 m %zu, tracking off by > 1 m for > 10 s %zu, covered %zu\n",
                detected5, right20, astray, covered);
  }
}

}  // namespace

void run_edges(const Request &a, const wm_config &config) {
  std::vector<fs::path> folders = folders_in(a.drives_of);
  if (a.drives && folders.size() > *a.drives) folders.resize(*a.drives);
  if (folders.empty())
    throw Failure(a.drives_of + ": no drives (folders with events.wmlog, truth.csv, map/); pictures.py makes them");
  Reliability reliability;
  Looks looks(a.csv);
  for (const std::string &name : kEdgeTrials) {
    if (!a.wants(name)) continue;
    const TrialKind kind = kind_of(name);
    std::vector<Row> rows;
    if (a.each) print_header(kind);
    for (size_t i = 0; i < folders.size(); i++) {
      const EdgeDrive drive(folders[i]);
      const wm_rig &rig = drive.head().rig;
      const double eye_m = rig.camera_count > 0 ? rig.cameras[0].mounting.xyz_m[0] : 0;
      for (const Trial &trial : draw_trials(drive, kind, a.trials_each, eye_m)) {
        rows.push_back({drive.name(), trial, run_trial(drive, config, trial, a.filter_seed)});
        if (a.each) print_row(rows.back());
        if (kind != TrialKind::kAlike) reliability.take(rows.back().outcome);
        looks.add(name, drive.name(), rows.back().outcome);
      }
      show_progress(name.c_str(), i + 1, folders.size());
    }
    end_progress();
    print_summary(name, rows);
  }
  reliability.print();
  if (!a.diagram.empty()) reliability.draw(a.diagram);
}

}  // namespace wm::montecarlo
