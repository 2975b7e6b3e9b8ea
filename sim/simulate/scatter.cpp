// SPDX-License-Identifier: Apache-2.0
#include "simulate/scatter.h"

#include <algorithm>
#include <cmath>

#include "simulate/angle.h"
#include "simulate/motion.h"
#include "simulate/random.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

wm_landmark landmark_at(const Scatter &s, size_t number, const Eigen::Vector3d &p, double yaw_rad) {
  wm_landmark l{};
  l.id = s.first_id + static_cast<int32_t>(number);
  for (int i = 0; i < 3; i++) l.p_m[i] = p[i];
  l.yaw_rad = yaw_rad;
  return l;
}

double between(const double range[2], double share) { return range[0] + share * (range[1] - range[0]); }

uint64_t seed_of(const Scenario &sc, const Recording &r) { return sc.scatter.seed ? sc.scatter.seed : r.seed; }

// Beside the way, not nearer to it anywhere than the least distance, and apart from one another.
wm_status beside_the_way(const Scenario &sc, const Recording &r, std::vector<wm_landmark> &out, wm_error *err) {
  const Scatter &s = sc.scatter;
  const Random random(seed_of(sc, r));
  const bool turned = std::any_of(sc.sensors.begin(), sc.sensors.end(),
                                  [](const Sensor &sensor) { return sensor.kind == Sensor::Kind::markers; });
  std::vector<State> way;  // all of it: a recording that ends early is of the same world
  for (double t_s = 0; t_s <= r.drive.whole_s(); t_s += 0.25)
    if (const State at = r.drive.at(t_s); way.empty() || std::fabs(at.way_m - way.back().way_m) > 0.05)
      way.push_back(at);
  const auto near = [](double x, double y, const auto &q, double distance) {
    const double dx = q[0] - x, dy = q[1] - y;
    return dx * dx + dy * dy < distance * distance;
  };
  for (uint64_t i = 0; out.size() < static_cast<size_t>(s.count); i++) {
    if (i > 2000 + 200 * static_cast<uint64_t>(s.count))
      return wm_fail(
          err, WM_BAD_CONFIG,
          "world.scatter: room was found for %zu of %d landmarks only; give a wider aside_m or a smaller apart_m",
          out.size(), s.count);
    const auto draw = [&](uint64_t k) { return random.uniform(Stream::landmark_place, i, k); };
    const State &at = way[static_cast<size_t>(draw(0) * static_cast<double>(way.size()))];
    const double aside = (draw(1) < 0.5 ? -1 : 1) * between(s.aside_m, draw(2));
    const auto h = wm::sincos(at.heading_rad);
    const double x = at.x_m - h.sin * aside, y = at.y_m + h.cos * aside;
    const bool fits =
        std::none_of(way.begin(), way.end(),
                     [&](const State &w) {
                       const double p[2] = {w.x_m, w.y_m};
                       return near(x, y, p, s.aside_m[0]);
                     }) &&
        std::none_of(out.begin(), out.end(), [&](const wm_landmark &l) { return near(x, y, l.p_m, s.apart_m); });
    if (!fits) continue;
    out.push_back(landmark_at(s, out.size(), {x, y, between(s.height_m, draw(3))},
                              turned ? wrap(2 * kPi * draw(4)) : static_cast<double>(NAN)));
  }
  return WM_OK;
}

// Anywhere in the left picture at some time of the swim: `count` of them at times spread over it, or each half second
// as many as are missing to `per_view` in both pictures, thinned out to that mean in the end. With a seed of their own
// they are those of that seed's swim.
wm_status before_the_pair(const Scenario &sc, const Recording &swim, std::vector<wm_landmark> &out, wm_error *err) {
  const Scatter &s = sc.scatter;
  Recording r;
  r.seed = seed_of(sc, swim);
  r.path = r.seed == swim.seed || !sc.knots.empty() ? swim.path : swum_path(sc.rounds, r.seed);
  r.duration_s = swim.duration_s;
  const Random random(r.seed);
  const auto sensor = std::find_if(sc.sensors.begin(), sc.sensors.end(),
                                   [](const Sensor &one) { return one.kind == Sensor::Kind::stereo; });
  if (sensor == sc.sensors.end())
    return wm_fail(err, WM_BAD_CONFIG, "world.scatter: points are drawn before a sensor of kind stereo; there is none");
  const StereoPair pair = StereoPair::drawn(*sensor, sc.errors, r.seed);
  const auto draw = [&](uint64_t i, uint64_t k) { return random.uniform(Stream::landmark_place, i, k); };
  uint64_t drawn = 0;
  const auto add = [&](double t_s) {
    const uint64_t i = drawn++;
    out.push_back(landmark_at(s, out.size(),
                              pair.point(true_pose(r, t_s), (pair.width_px - 1) * draw(i, 0),
                                         (pair.height_px - 1) * draw(i, 1), between(s.ahead_m, draw(i, 2))),
                              static_cast<double>(NAN)));
  };
  for (uint64_t i = 0; i < static_cast<uint64_t>(s.count); i++)
    add(r.duration_s * (static_cast<double>(i) + draw(i, 3)) / s.count);
  if (s.per_view == 0) return WM_OK;
  const auto seen_at = [&](const Eigen::Isometry3d &T, const wm_landmark &l) {
    double left[2], right[2];
    pair.see(T, Eigen::Vector3d(l.p_m), left, right);
    return !std::isnan(left[0]) && !std::isnan(right[0]);
  };
  const auto count_at = [&](const Eigen::Isometry3d &T) {
    return std::count_if(out.begin(), out.end(), [&](const wm_landmark &l) { return seen_at(T, l); });
  };
  for (double t_s = 0; t_s <= r.duration_s; t_s += 0.5) {
    const Eigen::Isometry3d T = true_pose(r, t_s);
    auto there = count_at(T);
    for (int tries = 0; there < s.per_view && tries < 100 * s.per_view; tries++) {
      add(t_s);
      if (seen_at(T, out.back()))
        there++;
      else
        out.pop_back();
    }
    if (there < s.per_view)
      return wm_fail(err, WM_BAD_CONFIG,
                     "world.scatter: ahead_m is outside the stereo pair's field of view or beyond its range_m");
  }
  // Each is seen from elsewhere, too: by now there are more. Some go, so that the mean is right.
  double sum = 0, views = 0;
  for (double t_s = 0; t_s <= r.duration_s; t_s += 0.5, views++)
    sum += static_cast<double>(count_at(true_pose(r, t_s)));
  const double keep = s.per_view * views / sum;
  std::vector<wm_landmark> kept;
  for (uint64_t i = 0; i < out.size(); i++) {
    if (draw(i, 4) >= keep) continue;
    kept.push_back(out[i]);
    kept.back().id = s.first_id + static_cast<int32_t>(kept.size()) - 1;
  }
  out = std::move(kept);
  return WM_OK;
}

}  // namespace

wm_status scatter_landmarks(const Scenario &sc, const Recording &r, std::vector<wm_landmark> &out, wm_error *err) {
  out.clear();
  if (sc.scatter.count == 0 && sc.scatter.per_view == 0) return WM_OK;
  if (sc.swims()) return before_the_pair(sc, r, out, err);
  if (sc.scatter.per_view > 0)
    return wm_fail(err, WM_BAD_CONFIG, "world.scatter.per_view: is for a vehicle with a stereo pair; give `count`");
  return beside_the_way(sc, r, out, err);
}

}  // namespace wm::sim
