// SPDX-License-Identifier: Apache-2.0
// waymark reference: the reference trajectory of a run over a raster map; also by `waymark replay --reference`.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

#include "common/edge_points.h"
#include "common/failure.h"
#include "common/program.h"
#include "common/run_folder.h"
#include "reference/smoother.h"
#include "waymark/map.h"

namespace {

using namespace wm::tools;
namespace fs = std::filesystem;

struct Arguments {
  std::string run, recording, map;
  double reach_m = 4;
  SmootherOptions smoother;
};

constexpr size_t kPointsMost = 90;  // of a picture, evenly chosen
constexpr double kEdgeReach_m = 0.5;

Eigen::Vector3d odom_at(const std::vector<PublishedRow> &rows, int64_t t_ns) {
  const auto after =
      std::lower_bound(rows.begin(), rows.end(), t_ns, [](const PublishedRow &row, int64_t t) { return row.t_ns < t; });
  if (after == rows.begin()) return rows.front().odom;
  if (after == rows.end()) return rows.back().odom;
  const PublishedRow &a = *(after - 1), &b = *after;
  const double s = b.t_ns > a.t_ns ? static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns) : 0;
  Eigen::Vector3d d = b.odom - a.odom;
  d.z() = wrap(d.z());
  return a.odom + s * d;
}

std::vector<SmootherStep> steps_of(const Arguments &a, const std::vector<PublishedRow> &rows) {
  std::vector<SmootherStep> out;
  for (const EdgePoints &seen : load_edge_points(a.run)) {
    SmootherStep step{seen.t_ns, odom_at(rows, seen.t_ns), {}};
    for (const Eigen::Vector2d &p : seen.points)
      if (p.norm() < a.reach_m + 1) step.points.push_back(p);
    if (step.points.size() > kPointsMost) {
      std::vector<Eigen::Vector2d> kept;
      for (size_t i = 0; i < kPointsMost; i++) kept.push_back(step.points[i * step.points.size() / kPointsMost]);
      step.points = kept;
    }
    if (!step.odom.allFinite()) continue;
    if (!out.empty() && step.t_ns <= out.back().t_ns) {  // another camera of the same instant
      out.back().points.insert(out.back().points.end(), step.points.begin(), step.points.end());
      continue;
    }
    out.push_back(std::move(step));
  }
  return out;
}

int run(const Arguments &a) {
  const fs::path map_file = a.map.empty() ? fs::path(a.recording) / "map/map.yaml" : fs::path(a.map);
  wm_error error{};
  wm_map *loaded = nullptr;
  if (wm_map_load(map_file.c_str(), nullptr, nullptr, &loaded, &error) != WM_OK) throw Failure(error.text, kUsage);
  const std::unique_ptr<wm_map, void (*)(wm_map *)> map(loaded, wm_map_free);
  const wm_raster *raster = wm_map_raster(map.get());
  if (raster->edges == nullptr)
    throw Failure(map_file.string() + ": has no layer of edges; waymark map make makes it", kUsage);

  const Published published = load_published(a.run);
  const std::vector<SmootherStep> steps = steps_of(a, published.rows);
  if (steps.size() < 10)
    throw Failure(a.run + ": " + std::to_string(steps.size()) +
                  " pictures with edge points in its events.wmlog; nothing to make a reference of");
  const PublishedRow &first = published.rows.front();
  const Eigen::Vector3d start(first.pose.p_m.x(), first.pose.p_m.y(), heading_rad(first.pose.q));
  const EdgeField field(*raster, kEdgeReach_m);
  const Reference reference = smooth(steps, field, start, a.smoother, [](int pass, double moved_m) {
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\rpass %d: moved by %.4f m ", pass, moved_m);
  });
  if (isatty(STDERR_FILENO)) std::fputc('\n', stderr);

  const fs::path file = fs::path(a.run) / "reference.csv";
  std::ofstream out(file);
  out << "t_ns,x_m,y_m,z_m,qx,qy,qz,qw\n";
  for (size_t k = 0; k < steps.size(); k++) {
    char line[200];
    const Eigen::Vector3d &p = reference.poses[k];
    std::snprintf(line, sizeof line, "%lld,%.6f,%.6f,0,0,0,%.12f,%.12f\n", static_cast<long long>(steps[k].t_ns), p.x(),
                  p.y(), std::sin(p.z() / 2), std::cos(p.z() / 2));
    out << line;
  }
  out.close();
  if (!out) throw Failure(file.string() + ": could not be written");
  std::printf(
      "%s: %zu poses, %d passes, the last one moved them by %.4f m in the mean; %.1f %% of the points lie on edges of "
      "the map\n",
      file.c_str(), steps.size(), reference.passes, reference.moved_m, 100 * reference.explained);
  return kDone;
}

}  // namespace

int main(int argc, char **argv) {
  Arguments a;
  wm::cli::App app(
      "The reference trajectory of a run over a raster map: all of the drive looked at as a whole, by a particle "
      "filter that keeps its ancestry (Abramov et al. 2019). Truth is not used.",
      "waymark reference");
  app.add_option("RUN", a.run, "folder that a run with edges wrote; reference.csv is written into it")->required();
  app.add_option("REC", a.recording, "folder of its recording, with the map")->required();
  app.add_option("--map", a.map, "a map.yaml instead of the recording's");
  app.add_option("--range", a.reach_m, "points farther from the camera than this, m, are left out")
      ->check(wm::cli::range(0.5, 50.0))
      ->capture_default_str();
  app.add_option("--particles", a.smoother.particles)->check(wm::cli::range(50, 20000))->capture_default_str();
  app.add_option("--passes", a.smoother.passes_max, "at most so many")
      ->check(wm::cli::range(1, 100))
      ->capture_default_str();
  app.add_option("--seed", a.smoother.seed)->capture_default_str();
  app.footer(
      "examples:\n"
      "  waymark replay recordings/corridor --config config/datasets/corridor.yaml --out runs/corridor --reference\n"
      "  waymark reference runs/corridor recordings/corridor\n"
      "  waymark eval runs/corridor recordings/corridor --reference\n"
      "The mounting and the stamps are taken as calibration.yaml states them.");
  return run_program(app, argc, argv, [&] { return run(a); });
}
