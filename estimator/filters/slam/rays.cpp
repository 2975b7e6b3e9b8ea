// SPDX-License-Identifier: Apache-2.0
// Landmarks seen by bearings alone, in the state from their first sighting on: as a ray from a clone of that pose, with
// the azimuth there and the inverse of the distance (J. Civera, A. J. Davison, J. M. M. Montiel, "Inverse depth
// parametrization for monocular SLAM", T-RO 24(5), 2008). The bearing is nearly linear in these, however little is
// known of the distance, so a far landmark holds the heading at once. When the distance is known the ray becomes a
// place.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOneNumber = 6.635 / 9.210;  // 99 % of chi2 with one degree of freedom against two
constexpr double kLeast = 1e-3;               // inverse distances below are at infinity, 1/m
constexpr int kMisfits = 6;                   // in a row: the ray was not that landmark's

}  // namespace

void slam::begin_ray(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past) {
  bearing_tracks::track *track = tracks_.begin(id, s.sensor);
  track->first_ns = track->last_ns = joint_.now_ns();
  const int clone = keep_clone(s.sensor, past, joint_.now_ns());
  tracks_.add(track, clone, s.bearing_rad, r.bearing_sigma_rad, 1);
  const int state = ray_state(*track), lasting = lend(s.sensor, id, joint_.now_ns());
  joint_row row;
  double variance = square(r.bearing_sigma_rad);
  if (lasting >= 0 && lasting_bearing_offset_ >= 0)
    row.add(lasting + lasting_bearing_offset_, -params_.lasting_bearing_rad);
  else
    variance += square(params_.lasting_bearing_rad);
  const double noise[1][3] = {{variance, 0, 0}};
  joint_.assign(state, 1, &row, noise, &s.bearing_rad);
  const double middle = 0.5 / params_.line_near_m;
  joint_.forget(state + 1, middle, square(0.5 * middle));
  track->misfits = 0;
}

void slam::end_ray(bearing_tracks::track *track) {
  for (int k = 0; k < 2; k++) joint_.forget(ray_state(*track) + k, 0.0, 0.0);
  bearing_tracks::end(track);
}

void slam::follow_ray(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                      record_list records) {
  const wm_time_ns now = joint_.now_ns();
  blank.verdict = WM_FUSED;
  blank.expected = blank.observed;
  bearing_tracks::track *track = tracks_.find(id, s.sensor);
  if (track && wm_seconds_between(track->last_ns, now) > params_.line_patience_s) {
    end_ray(track);
    track = nullptr;
  }
  if (!track) {
    begin_ray(id, s, r, past);
    records.add(blank);
    return;
  }
  const int state = ray_state(*track), anchor = clone_state(track->clone[0]);
  const double inverse = joint_.value(state + 1);
  const sin_cos ray = sincos(joint_.value(anchor + 2) + joint_.value(state));
  const wm_pose2 from = sensor_pose(s.sensor, past);
  const double ax = joint_.value(anchor) - from.x_m, ay = joint_.value(anchor + 1) - from.y_m;
  const double vx = inverse * ax + ray.cos, vy = inverse * ay + ray.sin, q = vx * vx + vy * vy;
  if (!(q > 1e-6)) {
    blank.verdict = WM_REJECTED_SINGULAR;
    records.add(blank);
    return;
  }
  const double gx = -vy / q, gy = vx / q, turn = gy * ray.cos - gx * ray.sin;
  const double lever_x = from.x_m - past.pose.x_m, lever_y = from.y_m - past.pose.y_m;
  const double by[3] = {-inverse * gx, -inverse * gy, inverse * (gx * lever_y - gy * lever_x) - 1.0};
  const sin_cos h = sincos(past.pose.heading_rad);
  joint_row row;
  add_past_pose(&row, by, past, slots_.at(s.sensor, kTimeOffset));
  row.add(slots_.at(s.sensor, kYaw), -1.0);
  row.add(slots_.at(s.sensor, kMountX), by[0] * h.cos + by[1] * h.sin);
  row.add(slots_.at(s.sensor, kMountY), by[1] * h.cos - by[0] * h.sin);
  row.add(anchor, inverse * gx);
  row.add(anchor + 1, inverse * gy);
  row.add(anchor + 2, turn);
  row.add(state, turn);
  row.add(state + 1, gx * ax + gy * ay);
  double noise = square(r.bearing_sigma_rad);
  double expected = atan2(vy, vx) - from.heading_rad;
  const int lasting = lend(s.sensor, id, now);
  if (lasting >= 0 && lasting_bearing_offset_ >= 0) {
    row.add(lasting + lasting_bearing_offset_, params_.lasting_bearing_rad);
    expected += params_.lasting_bearing_rad * joint_.value(lasting + lasting_bearing_offset_);
  } else {
    noise += square(params_.lasting_bearing_rad);
  }
  const double innovation = wrap(s.bearing_rad - expected);
  joint_state::innovation_block block;
  joint_.prepare(&row, &innovation, &noise, 1, &block);
  const double soft = params_.gate_soft * kOneNumber;
  blank.expected = wrap(expected);
  blank.variance = block.s[0][0];
  blank.nis = block.nis;
  blank.gate = params_.gate_hard * kOneNumber;
  blank.gate_dof = 1;
  const bool fits = block.nis <= blank.gate;
  const double more = block.nis > soft ? noise * (block.nis / soft - 1.0) : 0.0;
  const bool fused = fits && joint_.fuse(block, &more, joint_state::scope::all);
  const bool failed = fits || !(block.determinant > 0.0);
  blank.verdict = fused ? WM_FUSED : failed ? WM_REJECTED_NUMERIC : WM_REJECTED_GATE;
  records.add(blank);
  note_turn(fits, innovation, false, track->last_ns);
  if (!fused) {
    if (++track->misfits >= kMisfits) end_ray(track);
    return;
  }
  if (joint_.value(state + 1) < kLeast) joint_.set_value(state + 1, kLeast);
  track->misfits = 0;
  track->last_ns = fused_ns_ = now;
  settle_ray(track, from);
}

// A ray whose end is known becomes a place: where the distance's error is small against how much it bends the bearing
// (Civera's index of linearity, with the sine of the parallax required besides).
void slam::settle_ray(bearing_tracks::track *track, const wm_pose2 &from) {
  const int state = ray_state(*track), anchor = clone_state(track->clone[0]);
  const double distance = 1.0 / joint_.value(state + 1);
  const sin_cos ray = sincos(joint_.value(anchor + 2) + joint_.value(state));
  const double place[3] = {joint_.value(anchor) + distance * ray.cos, joint_.value(anchor + 1) + distance * ray.sin,
                           0.0};
  const double dx = place[0] - from.x_m, dy = place[1] - from.y_m, here = std::sqrt(dx * dx + dy * dy);
  if (!(here > 0.05)) return;
  const double parallax = (ray.cos * dy - ray.sin * dx) / here;  // its sine
  const double sigma = std::sqrt(joint_.variance(state + 1)) * square(distance);
  if (std::fabs(parallax) < params_.line_parallax_rad || sigma > params_.line_sigma_rel * here || !make_room()) return;
  joint_row rows[3];
  rows[0].add(anchor, 1.0);
  rows[1].add(anchor + 1, 1.0);
  for (int k = 0; k < 2; k++) {
    const double across = distance * (k == 0 ? -ray.sin : ray.cos);
    rows[k].add(anchor + 2, across);
    rows[k].add(state, across);
    rows[k].add(state + 1, -square(distance) * (k == 0 ? ray.cos : ray.sin));
  }
  const double none[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, square(kPi)}};
  note_line(*track, joint_.add_landmark(rows, none, place));
  end_ray(track);
}

}  // namespace wm
