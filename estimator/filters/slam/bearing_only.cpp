// SPDX-License-Identifier: Apache-2.0
// Landmarks seen by bearings alone. Either clones of past poses wait in the state until the lines of sight cross
// (track_bearing), or the landmark is in the state from its first sighting on (begin_ray): as a ray from a clone of
// that pose, with the azimuth there and the inverse of the distance [Civera2008]. The bearing is nearly linear in these
// at any distance, so a far landmark corrects the heading at once. When its distance is known the ray becomes a place.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kLeastInverse_1pm = 1e-3;  // inverse distance, 1/m: 1 km stands for infinity
constexpr double kLeastView2 = 1e-6;        // squared, of a ray scaled by the inverse distance: the landmark is here
constexpr double kLeastDistance_m = 0.05;   // nearer, a landmark has no direction
// Of many rays (sees_many). The bearing is the product of the inverse distance and of the way. Linearised where the
// start's value is a multiple of the true one, it states the way as many times too well, and too short. So a ray
// corrects directions alone until its inverse distance is known to this share, and iterates for it. Shares of 0.05 and
// 0.1: loops-lines, 7 seeds, 0.030 and 0.031 m (0.096 without).
constexpr double kKnownShare = 0.05;
constexpr int kIterations = 2;
// Sigma of a ray's bearing beyond which no linear update holds, and no gate: it begins anew. It is wide where a line
// seen once returns metres on, which is often another one of that number. hall-a: 0.0060 to 0.0065 m from 0.15 to 0.7
// (0.104 without); mrclam-slam-bearings has none.
constexpr double kLinear_rad = 0.35;
// A ray's inverse distance at its start, as shares of 1/near_m: two sigmas below 1/near_m, and hardly above infinity.
// Far is where it is safe to begin: the way then has too little weight, and not too much. [Civera2008] has 0.1 and 0.5
// per metre. Means of 0.1, 0.3, 0.5 by bearings alone: mrclam, 7 drives, 0.43, 0.61, 1.06 m; loops-lines, 6 seeds,
// alike.
constexpr double kStartMean = 0.1, kStartSigma = 0.45;
constexpr int kMaxMisfits = 6;  // in a row: the ray was not that landmark's; not swept

}  // namespace

// The sensor's pose in map at the sighting, as a clone in the state. All bearings of a picture share one.
int slam::keep_clone(const context &at, unsigned exact) {
  const wm_time_ns now = joint_.now_ns();
  const int there = tracks_.find_clone(at.sensor, now);
  if (there >= 0) return there;
  const wm_pose2 pose = sensor_pose(at.sensor, at.past);
  const int clone = tracks_.take_clone(at.sensor, now, pose.x_m, pose.y_m);
  const double lever_x = pose.x_m - at.past.pose.x_m, lever_y = pose.y_m - at.past.pose.y_m;
  const sin_cos h = sincos(at.past.pose.heading_rad);
  // By x, y, heading of base_link, the mounting's yaw, x and y.
  const double by[3][6] = {{1, 0, -lever_y, 0, h.cos, -h.sin}, {0, 1, lever_x, 0, h.sin, h.cos}, {0, 0, 1, 1, 0, 0}};
  joint_row rows[3];
  for (int k = 0; k < 3; k++) {
    add_past_pose(&rows[k], by[k], at.past, slots_.at(at.sensor, kTimeOffset, exact));
    rows[k].add(slots_.at(at.sensor, kYaw, exact), by[k][3]);
    rows[k].add(slots_.at(at.sensor, kMountX), by[k][4]);
    rows[k].add(slots_.at(at.sensor, kMountY), by[k][5]);
  }
  const double none[3][3] = {}, values[3] = {pose.x_m, pose.y_m, pose.heading_rad};
  joint_.assign(clone_state(clone), 3, rows, none, values);
  return clone;
}

void slam::forget_lines() {
  for (int state = first_ray_; state < first_clone_ + 3 * joint_.layout().clones; state++)
    joint_.forget(state, 0.0, 0.0);
  forget_tracks();
}

void slam::forget_tracks() {
  const bool rays = params_.line_method == WM_SLAM_LINE_INVERSE_DISTANCE;
  const int clones = joint_.layout().clones;
  tracks_.clear(clones, rays ? clones : bearing_tracks::kTracks);
}

// ---- clones that wait for parallax ----

// WM_REJECTED_SEARCHING: the bearing is kept until the parallax suffices. Pictures too near to the last clone have
// none.
wm_verdict slam::track_bearing(const context &at, const line_bearing &seen) {
  const wm_time_ns now = joint_.now_ns();
  bearing_tracks::track *track = tracks_.find(at.id, at.sensor);
  if (!track) track = tracks_.begin(at.id, at.sensor, now);
  if (!track) return WM_REJECTED_SEARCHING;
  track->last_ns = now;
  const int newest = tracks_.newest_clone(at.sensor);
  if (newest >= 0 && tracks_.find_clone(at.sensor, now) < 0) {
    const wm_pose2 here = sensor_pose(at.sensor, at.past);
    const int state = clone_state(newest);
    const double dx = here.x_m - joint_.value(state), dy = here.y_m - joint_.value(state + 1);
    if (dx * dx + dy * dy < square(params_.line_step_m)) return WM_REJECTED_SEARCHING;
  }
  const double sigma = std::sqrt(square(seen.sigma_rad) + square(seen.correlated_rad));
  const int clone = keep_clone(at, seen.exact);
  tracks_.add(track, clone, seen.bearing_rad, sigma, params_.line_poses);
  if (track->count < 3 || !join_line(at, *track)) return WM_REJECTED_SEARCHING;
  bearing_tracks::end(track);
  life_.fused(now);
  return WM_FUSED;
}

bool slam::join_line(const context &at, const bearing_tracks::track &track) {
  line_bundle bundle;
  bundle.count = track.count;
  const auto state_of = [&](int input) { return clone_state(track.clone[input / 3]) + input % 3; };
  for (int i = 0; i < track.count; i++) {
    const int state = clone_state(track.clone[i]);
    bundle.pose[i] = {joint_.value(state), joint_.value(state + 1), joint_.value(state + 2)};
    bundle.azimuth_rad[i] = track.azimuth_rad[i];
    bundle.sigma_rad[i] = track.sigma_rad[i];
  }
  for (int i = 0; i < 3 * track.count; i++)
    for (int j = 0; j < 3 * track.count; j++)
      bundle.pose_covariance[i][j] = joint_.covariance(state_of(i), state_of(j));
  const line_landmark line = find_line(bundle, params_.line_method == WM_SLAM_LINE_UNSCENTED);
  if (!line.solved || line.parallax_rad < params_.line_parallax_rad || line.misfit > sightings().gate_soft)
    return false;
  joint_row rows[3];
  double noise[3][3] = {};
  for (int r = 0; r < 2; r++) {
    for (int j = 0; j < 3 * track.count; j++) rows[r].add(state_of(j), line.by_pose[r][j]);
    for (int c = 0; c < 2; c++) noise[r][c] = line.noise[r][c];
  }
  // Its variance seen from the last pose: the poses' common error is not the landmark's.
  joint_row relative[2] = {rows[0], rows[1]};
  for (int r = 0; r < 2; r++) relative[r].add(state_of(3 * track.count - 3 + r), -1.0);
  const double variance = joint_.variance_of(relative[0]) + joint_.variance_of(relative[1]) + noise[0][0] + noise[1][1];
  if (variance > square(params_.line_sigma_rel * line.distance_m) || !make_room()) return false;
  noise[2][2] = square(kPi);
  const double place[3] = {line.place_m[0], line.place_m[1], 0.0};
  const int landmark = note_landmark(at.id, joint_.add_landmark(rows, noise, place), at.sensor);
  note(landmark).first_ns = track.first_ns;
  return true;
}

// ---- rays ----

// WM_REJECTED_SEARCHING: there is no place for another ray.
wm_verdict slam::begin_ray(const context &at, const line_bearing &seen) {
  bearing_tracks::track *track = tracks_.begin(at.id, at.sensor, joint_.now_ns());
  if (!track) return WM_REJECTED_SEARCHING;
  const int clone = keep_clone(at, seen.exact);
  tracks_.add(track, clone, seen.bearing_rad, seen.sigma_rad, 1);
  const int state = ray_state(*track), error_state = lend(at);
  joint_row row;
  double variance = square(seen.sigma_rad);
  if (error_state >= 0 && error_.bearing >= 0)
    row.add(error_state + error_.bearing, -seen.correlated_rad);
  else
    variance += square(seen.correlated_rad);
  const double noise[1][3] = {{variance, 0, 0}};
  joint_.assign(state, 1, &row, noise, &seen.bearing_rad);
  const double nearest = 1.0 / params_.line_near_m;
  joint_.forget(state + 1, kStartMean * nearest, square(kStartSigma * nearest));
  return WM_FUSED;
}

void slam::end_ray(bearing_tracks::track *track) {
  for (int k = 0; k < 2; k++) joint_.forget(ray_state(*track) + k, 0.0, 0.0);
  bearing_tracks::end(track);
}

// The landmark's ray, NULL where it has none. One not seen for long ends: its bearing is too far from linear by then.
bearing_tracks::track *slam::current_ray(const context &at) {
  bearing_tracks::track *track = tracks_.find(at.id, at.sensor);
  if (!track || wm_seconds_between(track->last_ns, joint_.now_ns()) <= params_.line_patience_s) return track;
  end_ray(track);
  return nullptr;
}

// With a the anchor seen from the sensor, u the ray's direction and i its inverse distance, the landmark lies along
// v = i a + u: bearing = atan2(v) - heading [Civera2008]. Linearised about `inverse` of the inverse distance.
wm_verdict slam::expect_ray(const context &at, const bearing_tracks::track &track, const line_bearing &seen,
                            double inverse, landmark_rows *out) {
  const int state = ray_state(track), anchor = clone_state(track.clone[0]);
  const sin_cos ray = sincos(joint_.value(anchor + 2) + joint_.value(state));
  const wm_pose2 from = sensor_pose(at.sensor, at.past);
  const double ax = joint_.value(anchor) - from.x_m, ay = joint_.value(anchor + 1) - from.y_m;
  const double vx = inverse * ax + ray.cos, vy = inverse * ay + ray.sin, q = vx * vx + vy * vy;
  if (!(q > kLeastView2)) return WM_REJECTED_SINGULAR;
  const double gx = -vy / q, gy = vx / q, turn = gy * ray.cos - gx * ray.sin;
  const double lever_x = from.x_m - at.past.pose.x_m, lever_y = from.y_m - at.past.pose.y_m;
  const double by[3] = {-inverse * gx, -inverse * gy, inverse * (gx * lever_y - gy * lever_x) - 1.0};
  const sin_cos h = sincos(at.past.pose.heading_rad);
  joint_row &row = out->row[0];
  add_past_pose(&row, by, at.past, slots_.at(at.sensor, kTimeOffset, seen.exact));
  row.add(slots_.at(at.sensor, kYaw, seen.exact), -1.0);
  row.add(slots_.at(at.sensor, kMountX), by[0] * h.cos + by[1] * h.sin);
  row.add(slots_.at(at.sensor, kMountY), by[1] * h.cos - by[0] * h.sin);
  row.add(anchor, inverse * gx);
  row.add(anchor + 1, inverse * gy);
  row.add(anchor + 2, turn);
  row.add(state, turn);
  const double by_inverse = gx * ax + gy * ay;
  joint_.add_at(&row, state + 1, by_inverse, inverse);
  out->count = 1;
  out->kind[0] = WM_RESIDUAL_BEARING;
  out->noise[0] = square(seen.sigma_rad);
  double expected = atan2(vy, vx) - from.heading_rad + by_inverse * (joint_.value(state + 1) - inverse);
  if (const int error_state = lend(at); error_state >= 0 && error_.bearing >= 0) {
    row.add(error_state + error_.bearing, seen.correlated_rad);
    expected += seen.correlated_rad * joint_.value(error_state + error_.bearing);
  } else {
    out->noise[0] += square(seen.correlated_rad);
  }
  out->observed[0] = seen.bearing_rad;
  out->expected[0] = wrap(expected);
  out->innovation[0] = wrap(seen.bearing_rad - expected);
  return WM_FUSED;
}

// Iterated for the inverse distance alone, of which the derivatives by the places are multiples.
wm_verdict slam::prepare_ray(const context &at, const bearing_tracks::track &track, const line_bearing &seen,
                             landmark_rows *v, innovation *block) {
  const int state = ray_state(track) + 1;
  double inverse = joint_.value(state);
  for (int step = 0;; step++) {
    *v = {};
    const wm_verdict possible = expect_ray(at, track, seen, inverse, v);
    if (possible != WM_FUSED) return possible;
    *block = joint_.prepare(v->row, v->innovation, v->noise, 1);
    if (step == kIterations || !sees_many()) return WM_FUSED;
    inverse = larger(joint_.value(state) + joint_.change_of(state, *block), kLeastInverse_1pm);
  }
}

wm_status slam::follow_ray(const context &at, bearing_tracks::track *track, const line_bearing &seen) {
  const wm_pose2 from = sensor_pose(at.sensor, at.past);
  landmark_rows v;
  innovation block;
  const wm_verdict possible = prepare_ray(at, *track, seen, &v, &block);
  if (possible != WM_FUSED) return reject(at.records, at.record, possible);
  if (block.s[0][0] > square(kLinear_rad)) {
    end_ray(track);
    return reject(at.records, at.record, begin_ray(at, seen));
  }
  if (waits_for_another(at, seen, v, block)) return WM_OK;
  const gate_result g = gate(block.nis, 1, gates());
  const int inverse = ray_state(*track) + 1;
  const bool is_known = !sees_many() || joint_.variance(inverse) < square(kKnownShare * joint_.value(inverse));
  const wm_verdict verdict = fuse_rows(at, v, g, &block, is_known ? -1 : inverse);
  note_rotation(g.passed, v.innovation[0], picture_outliers::kBearings, track->last_ns);
  if (verdict != WM_FUSED) {
    if (++track->misfits >= kMaxMisfits) end_ray(track);
    return WM_OK;
  }
  if (joint_.value(inverse) < kLeastInverse_1pm) joint_.set_value(inverse, kLeastInverse_1pm);
  track->misfits = 0;
  track->last_ns = joint_.now_ns();
  life_.fused(track->last_ns);
  settle_ray(at, from, track);
  return WM_OK;
}

// A ray becomes a place where the distance's error is small against how much it bends the bearing: the index of
// linearity of [Civera2008], with the sine of the parallax required besides.
void slam::settle_ray(const context &at, const wm_pose2 &from, bearing_tracks::track *track) {
  const int state = ray_state(*track), anchor = clone_state(track->clone[0]);
  const double distance = 1.0 / joint_.value(state + 1);
  const sin_cos ray = sincos(joint_.value(anchor + 2) + joint_.value(state));
  const double place[3] = {joint_.value(anchor) + distance * ray.cos, joint_.value(anchor + 1) + distance * ray.sin,
                           0.0};
  const double dx = place[0] - from.x_m, dy = place[1] - from.y_m, here = std::sqrt(dx * dx + dy * dy);
  if (!(here > kLeastDistance_m)) return;
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
  const int landmark = note_landmark(at.id, joint_.add_landmark(rows, none, place), at.sensor);
  note(landmark).first_ns = track->first_ns;
  end_ray(track);
}

}  // namespace wm
