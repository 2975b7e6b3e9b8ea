// SPDX-License-Identifier: Apache-2.0
// Consistency and efficiency of an estimator over many simulated drives, on the plane and in space.
#include "common/program.h"
#include "montecarlo/engines.h"
#include "montecarlo/results.h"
#include "simulate/angle.h"

namespace wm::montecarlo {
namespace {

double degrees(double rad) { return rad * 180 / sim::kPi; }

void print_header() {
  std::printf(
      "          |   position at the end   |    whole way    |   heading at the end  |    NEES/dof    |    NIS/dof\n"
      "landmarks |  RMS m  bound m   eff.  |  RMS m    eff.  |  RMS deg  bound  eff. |  mean  in band |  mean  in "
      "band\n"
      "----------+-------------------------+-----------------+-----------------------+----------------+---------------"
      "\n");
}

double ratio(double bound, double value) { return value > 0 ? bound / value : 0; }

void print_row(const Statistics &s) {
  const double pe = s.position_end_m(), pr = s.position_rms_m(), he = s.heading_end_rad();
  std::printf("%9zu | %6.3f %8.3f %7.2f | %6.3f %8.2f | %8.3f %6.3f %5.2f | %5.2f %6.1f %% |", s.landmarks, pe,
              s.bound_position_end_m(), ratio(s.bound_position_end_m(), pe), pr, ratio(s.bound_position_rms_m(), pr),
              degrees(he), degrees(s.bound_heading_end_rad()), ratio(s.bound_heading_end_rad(), he), s.nees_mean(),
              100 * s.nees_inside(band_of(s.runs)));
  if (s.fused > 0)
    std::printf(" %5.2f %6.1f %%\n", s.nis_mean(), 100 * s.nis_inside(band_of(s.runs)));
  else
    std::printf("     -        -\n");
}

void print_counts(const std::vector<Statistics> &all) {
  const Band band = band_of(all.empty() ? 0 : all[0].runs);
  std::printf("\nIn band: share of the 0.1 s steps whose mean over the drives lies in [%.2f, %.2f].\n", band.low,
              band.high);
  for (const Statistics &s : all)
    std::printf("%zu landmarks: %" PRIu64 " drives, %" PRIu64 " lost; sightings: %" PRIu64 " fused, %" PRIu64
                " rejected; outliers were %" PRIu64 "\n",
                s.landmarks, s.runs, s.lost, s.fused, s.rejected, s.outliers);
}

void write_steps(const std::string &path, const std::vector<Statistics> &all) {
  std::FILE *f = std::fopen(path.c_str(), "w");
  if (!f) throw tools::Failure(path + ": can't write");
  std::fprintf(
      f, "landmarks,t_s,position_rms_m,bound_position_m,heading_rms_rad,bound_heading_rad,nees_per_dof,nis_per_dof\n");
  for (const Statistics &s : all)
    for (const Step &p : s.steps) {
      const double n = static_cast<double>(p.runs ? p.runs : 1);
      std::fprintf(f, "%zu,%.1f,%.6f,%.6f,%.6f,%.6f,%.4f,", s.landmarks, p.t_s, std::sqrt(p.position_sq_m2 / n),
                   std::sqrt(p.bound_position_sq_m2 / n), std::sqrt(p.heading_sq_rad2 / n),
                   std::sqrt(p.bound_heading_sq_rad2 / n), p.nees / (3 * n));
      if (p.nis_dof) std::fprintf(f, "%.4f", p.nis / static_cast<double>(p.nis_dof));
      std::fprintf(f, "\n");
    }
  if (std::fclose(f) != 0) throw tools::Failure(path + ": can't write");
}

void write_steps_six(const std::string &path, const Statistics6 &s) {
  std::FILE *f = std::fopen(path.c_str(), "w");
  if (!f) throw tools::Failure(path + ": can't write");
  static const char *const kNames[6] = {"along_m", "across_m", "up_m", "roll_rad", "pitch_rad", "yaw_rad"};
  std::fprintf(f, "t_s,nees_per_dof");
  for (const char *name : kNames) std::fprintf(f, ",%s,sigma_%s,bound_%s", name, name, name);
  std::fprintf(f, "\n");
  for (const Step6 &p : s.steps) {
    const double n = static_cast<double>(p.runs ? p.runs : 1), bounds = static_cast<double>(s.bounds ? s.bounds : 1);
    std::fprintf(f, "%.1f,%.4f", p.t_s, p.nees / (6 * n));
    for (int i = 0; i < 6; i++)
      std::fprintf(f, ",%.6f,%.6f,%.6f", std::sqrt(p.error_sq[i] / n), std::sqrt(p.variance[i] / n),
                   std::sqrt(p.bound[i] / bounds));
    std::fprintf(f, "\n");
  }
  if (std::fclose(f) != 0) throw tools::Failure(path + ": can't write");
}

// The rows of --out, where it is given.
void write_drives(const Request &a, const std::vector<Drives> &all) {
  wm_error err{};
  if (!a.out.empty()) tools::need_ok(write_results(a.out, std::filesystem::path(a.config).stem(), all, &err), err);
}

}  // namespace

void run_planar(const Request &a, const sim::Scenario &scenario, const wm_config &config) {
  const uint64_t seeds = a.drives.value_or(200);
  wm_error err{};
  std::printf("%s, %s of %s, %" PRIu64 " drives\n\n", scenario.name.c_str(), config.estimator->name, a.config.c_str(),
              seeds);
  print_header();
  std::vector<Statistics> all;
  for (const size_t landmarks : a.landmarks) {
    const std::string what = std::to_string(landmarks) + " landmarks";
    const auto progress = [&](uint64_t done) { show_progress(what.c_str(), done, seeds); };
    Statistics statistics;
    const wm_status status = run(scenario, config, landmarks, a.first_seed, seeds, progress, statistics, &err);
    end_progress();
    tools::need_ok(status, err);
    print_row(statistics);
    std::fflush(stdout);
    all.push_back(std::move(statistics));
  }
  print_counts(all);
  if (!a.csv.empty()) write_steps(a.csv, all);
  std::vector<Drives> drives;
  for (const Statistics &s : all)
    drives.push_back({scenario.name + ", " + std::to_string(s.landmarks) + " landmarks", s.each, 3});
  write_drives(a, drives);
}

// Six degrees of freedom: the bound where it is asked for, each run's own error, and the points found.
void run_in_space(const Request &a, const sim::Scenario &scenario, const wm_config &config) {
  Statistics6 s;
  Options6 options = a.six;
  options.first_seed = a.first_seed;
  options.seeds = a.drives.value_or(200);
  wm_error err{};
  const auto progress = [&](uint64_t done) { show_progress("in space", done, options.seeds); };
  const wm_status status = run_six(scenario, config, options, progress, s, &err);
  end_progress();
  tools::need_ok(status, err);
  std::vector<double> rms, largest, turned, beyond;
  for (const auto &run : s.each) {
    rms.push_back(run.position_rms_m);
    largest.push_back(run.position_max_m);
    turned.push_back(degrees(run.rotation_rms_rad));
    beyond.push_back(run.beyond_s);
  }
  const auto print = [](const char *what, std::vector<double> v) {
    std::sort(v.begin(), v.end());
    std::printf("%-36s median %8.4f  p95 %8.4f  worst %8.4f\n", what, v[v.size() / 2], v[(v.size() - 1) * 95 / 100],
                v.back());
  };
  const Band band = band_of(s.runs);
  std::printf("%s, %s of %s, %" PRIu64 " drives, each from %.3g s on\n\n", scenario.name.c_str(),
              config.estimator->name, a.config.c_str(), s.runs, a.six.settled_s);
  print("position RMS of a drive, m", rms);
  print("largest position error of a drive, m", largest);
  print("rotation RMS of a drive, deg", turned);
  print("longest time beyond 5 sigma, s", beyond);
  std::printf("NEES/6: mean %.3f, %.1f %% of the 0.1 s steps in [%.2f, %.2f]\n", s.nees_mean(),
              100 * s.nees_inside(band), band.low, band.high);
  if (s.bounds > 0)
    std::printf("RMS over the bound of %" PRIu64 " drives: position %.3f, rotation %.3f\n", s.bounds,
                s.position_over_bound(options.settled_s, options.until_s),
                s.rotation_over_bound(options.settled_s, options.until_s));
  std::printf("observations: %" PRIu64 " fused, %" PRIu64 " not; wrong matches made: %" PRIu64 "\n", s.fused,
              s.rejected, s.outliers);
  if (s.points > 0)
    std::printf("points: %" PRIu64 " found, mean error %.4f m, wrong %.2f %%\n", s.points,
                s.point_error_sum_m / static_cast<double>(s.points),
                100 * static_cast<double>(s.wrong_points) / static_cast<double>(s.points));
  if (!a.csv.empty()) write_steps_six(a.csv, s);
  write_drives(a, {{scenario.name, s.each, 6}});
}

}  // namespace wm::montecarlo
