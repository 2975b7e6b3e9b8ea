// SPDX-License-Identifier: Apache-2.0
// waymark-montecarlo SCENARIO --config F: consistency and efficiency of an estimator over many seeds.
#include <unistd.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "common/failure.h"
#include "common/program.h"
#include "montecarlo/montecarlo.h"
#include "montecarlo/results.h"
#include "simulate/angle.h"

namespace {

using wm::montecarlo::Band;
using wm::montecarlo::band_of;
using wm::montecarlo::Drives;
using wm::montecarlo::Statistics;

double degrees(double rad) { return rad * 180 / wm::sim::kPi; }

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

bool write_steps(const std::string &path, const std::vector<Statistics> &all) {
  FILE *f = std::fopen(path.c_str(), "w");
  if (!f) return false;
  std::fprintf(
      f, "landmarks,t_s,position_rms_m,bound_position_m,heading_rms_rad,bound_heading_rad,nees_per_dof,nis_per_dof\n");
  for (const Statistics &s : all)
    for (const wm::montecarlo::Step &p : s.steps) {
      const double n = static_cast<double>(p.runs ? p.runs : 1);
      std::fprintf(f, "%zu,%.1f,%.6f,%.6f,%.6f,%.6f,%.4f,", s.landmarks, p.t_s, std::sqrt(p.position_sq_m2 / n),
                   std::sqrt(p.bound_position_sq_m2 / n), std::sqrt(p.heading_sq_rad2 / n),
                   std::sqrt(p.bound_heading_sq_rad2 / n), p.nees / (3 * n));
      if (p.nis_dof) std::fprintf(f, "%.4f", p.nis / static_cast<double>(p.nis_dof));
      std::fprintf(f, "\n");
    }
  return std::fclose(f) == 0;
}

bool write_steps_six(const std::string &path, const wm::montecarlo::Statistics6 &s) {
  std::FILE *f = std::fopen(path.c_str(), "w");
  if (!f) return false;
  static const char *const kNames[6] = {"along_m", "across_m", "up_m", "roll_rad", "pitch_rad", "yaw_rad"};
  std::fprintf(f, "t_s,nees_per_dof");
  for (const char *name : kNames) std::fprintf(f, ",%s,sigma_%s,bound_%s", name, name, name);
  std::fprintf(f, "\n");
  for (const wm::montecarlo::Step6 &p : s.steps) {
    const double n = static_cast<double>(p.runs ? p.runs : 1), bounds = static_cast<double>(s.bounds ? s.bounds : 1);
    std::fprintf(f, "%.1f,%.4f", p.t_s, p.nees / (6 * n));
    for (int i = 0; i < 6; i++)
      std::fprintf(f, ",%.6f,%.6f,%.6f", std::sqrt(p.error_sq[i] / n), std::sqrt(p.variance[i] / n),
                   std::sqrt(p.bound[i] / bounds));
    std::fprintf(f, "\n");
  }
  return std::fclose(f) == 0;
}

struct Arguments {
  std::string scenario, config, csv, out;
  uint64_t seeds = 200, first = 1;
  wm::montecarlo::Options6 six;
  std::optional<int> laps;
  std::vector<size_t> landmarks = {0, 1, 2, 3};
};

void parse(wm::cli::App *app, Arguments *a) {
  app->description(
      "Runs an estimator over many simulated drives and prints, beside each figure, the Cramer-Rao bound.\n"
      "Efficiency is the bound divided by the figure; 1 is the best possible.");
  app->add_option("SCENARIO", a->scenario, "scenario file (YAML)")->required();
  app->add_option("--config", a->config, "configuration of the estimator")->required();
  app->add_option("--seeds", a->seeds, "number of drives")->check(wm::cli::range(1, 1000000))->capture_default_str();
  app->add_option("--first-seed", a->first, "the first one's seed")->capture_default_str();
  app->add_option("--landmarks", a->landmarks, "how many of the scenario's landmarks, a list")->delimiter(',');
  app->add_option("--laps", a->laps, "instead of the route's laps")->check(wm::cli::range(1, 1000));
  app->add_option("--settled", a->six.settled_s, "six degrees of freedom: figures from so many seconds on")
      ->capture_default_str();
  app->add_option("--until", a->six.until_s, "six degrees of freedom: ... to so many");
  app->add_option("--blind-from", a->six.blind_from_s,
                  "six degrees of freedom: no picture shows anything from here, s");
  app->add_option("--blind-to", a->six.blind_to_s, "... to here");
  app->add_option("--points-seen", a->six.points_per_picture,
                  "six degrees of freedom: only so many points of each pair of pictures");
  app->add_option("--bounds", a->six.bounds,
                  "six degrees of freedom: compute the bound of so many drives, the first ones");
  app->add_option("--csv", a->csv, "writes the figures of each step of 0.1 s here");
  app->add_option("--out", a->out, "writes each drive's figures into this folder, for waymark compare BEFORE AFTER");
  app->footer(
      "example: waymark-montecarlo config/worlds/crossing.yaml --config config/datasets/crossing-points.yaml --seeds "
      "200\n"
      "         waymark-montecarlo WORLD --config F --out before; after a change: --out after; waymark compare before "
      "after\n"
      "docs/consistency.md defines each figure. Exit code: 0 done, 1 failed, 2 usage or configuration.");
}

// The rows of --out, where it is given.
wm_status write_drives(const Arguments &a, const std::vector<Drives> &all, wm_error *err) {
  return a.out.empty() ? WM_OK : write_results(a.out, std::filesystem::path(a.config).stem(), all, err);
}

wm_status run_all(const Arguments &a, const wm::sim::Scenario &scenario, const wm_config &config, wm_error *err) {
  std::printf("%s, %s of %s, %" PRIu64 " drives\n\n", scenario.name.c_str(), config.estimator->name, a.config.c_str(),
              a.seeds);
  print_header();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  std::vector<Statistics> all;
  for (const size_t landmarks : a.landmarks) {
    const auto progress = [&](uint64_t done) {
      if (terminal)
        std::fprintf(stderr, "\r%zu landmarks: %" PRIu64 " of %" PRIu64 " drives ", landmarks, done, a.seeds);
    };
    Statistics statistics;
    const wm_status status =
        wm::montecarlo::run(scenario, config, landmarks, a.first, a.seeds, progress, statistics, err);
    if (terminal) std::fprintf(stderr, "\r%60s\r", "");
    if (status != WM_OK) return status;
    print_row(statistics);
    std::fflush(stdout);
    all.push_back(std::move(statistics));
  }
  print_counts(all);
  if (!a.csv.empty() && !write_steps(a.csv, all)) return wm_fail(err, WM_IO, "%s: can't write", a.csv.c_str());
  std::vector<Drives> drives;
  for (const Statistics &s : all)
    drives.push_back({scenario.name + ", " + std::to_string(s.landmarks) + " landmarks", s.each, 3});
  return write_drives(a, drives, err);
}

// Six degrees of freedom: the bound where it is asked for, each run's own error, and the points found.
wm_status run_and_print_six(const Arguments &a, const wm::sim::Scenario &scenario, const wm_config &config,
                            wm_error *err) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto progress = [&](uint64_t done) {
    if (terminal) std::fprintf(stderr, "\r%" PRIu64 " of %" PRIu64 " drives ", done, a.seeds);
  };
  wm::montecarlo::Statistics6 s;
  wm::montecarlo::Options6 options = a.six;
  options.first_seed = a.first;
  options.seeds = a.seeds;
  const wm_status status = wm::montecarlo::run_six(scenario, config, options, progress, s, err);
  if (terminal) std::fprintf(stderr, "\r%60s\r", "");
  if (status != WM_OK) return status;
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
  if (!a.csv.empty() && !write_steps_six(a.csv, s)) return wm_fail(err, WM_IO, "%s: can't write", a.csv.c_str());
  return write_drives(a, {{scenario.name, s.each, 6}}, err);
}

wm_status load_and_run(const Arguments &a, wm_error *err) {
  wm::sim::Scenario scenario;
  if (const wm_status s = wm::sim::load_scenario(a.scenario, scenario, err); s != WM_OK) return s;
  if (a.laps) scenario.route.laps = *a.laps;
  wm_config config{};
  wm_status status = wm_config_load(a.config.c_str(), &config, err);
  std::fputs(config.warnings, stderr);
  if (status == WM_OK)
    status = scenario.swims() ? run_and_print_six(a, scenario, config, err) : run_all(a, scenario, config, err);
  wm_config_free(&config);
  return status;
}

}  // namespace

int main(int argc, char **argv) {
  wm::cli::App app("", "waymark-montecarlo");
  Arguments arguments;
  parse(&app, &arguments);
  return wm::tools::run_program(app, argc, argv, [&arguments] {
    wm_error err{};
    wm::tools::need_ok(load_and_run(arguments, &err), err);
    return wm::tools::kDone;
  });
}
