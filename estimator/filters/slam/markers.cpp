// SPDX-License-Identifier: Apache-2.0
// Coded markers: place and heading of a marker from one observation [FengND, observation], as distance, direction and
// heading, since a camera's errors belong to these.
#include <utility>

#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kClutter_m = 10.0;      // a misread code lies anywhere on a square of this side, as in landmark_ekf
constexpr double kNoDirection_m = 0.05;  // a marker nearer to the camera's axis than this has no direction
// A marker's height (fuse_height):
constexpr double kAlike = 10.0;             // observations a tenth of a second apart with one error; not swept
constexpr double kLeastInformation = 0.01;  // share of the tilt's variance that a row must be worth its O(n^2)
constexpr double kHeightGate_nis = 9.0;     // three sigmas

}  // namespace

wm_status slam::fuse_marker(const wm_event &event, record_list records) {
  const wm_marker &m = event.as.marker;
  context at{m.sensor, m.id, {}, record_of(event, WM_RESIDUAL_X), records};
  at.record.sensor = m.sensor;
  at.record.landmark_id = m.id;
  wm_status status = check_marker(m, setup_->sensor_count);
  if (status != WM_OK) return refuse(records, at.record, status);
  status = begin_observation(event.t_ns);
  if (status != WM_OK) return status;
  if (m.id < 0) return reject(records, at.record, WM_REJECTED_NO_ASSOCIATION);
  if (finite(m.bloom_px)) bloom_px_[m.sensor] = m.bloom_px;
  take_headings();
  note_range(m.sensor, true);

  tag_reading r = read_marker(m, false);
  if (r.length_m > sensor_[m.sensor].max_range_m) return reject(records, at.record, WM_REJECTED_OUT_OF_RANGE);
  const int landmark = find_landmark(m.id);
  if (is_ambiguous(m.id, landmark, m.sensor)) return reject(records, at.record, WM_REJECTED_NO_ASSOCIATION);
  begin_picture(m.sensor, event.t_ns);
  at.past = look_back(m.sensor);
  if (landmark >= 0 && map_is_held()) {
    note(landmark).level = !finite(m.yaw_sigma_rad);
    const bool fits = keep_observation(landmark, at, observation_of(m, r));
    if (relocalize()) return reject(records, at.record, WM_REJECTED_SEARCHING);
    if (!fits && life_.tracking()) return reject(records, at.record, WM_REJECTED_GATE);
  }
  if (life_.searching()) return reject(records, at.record, WM_REJECTED_SEARCHING);
  if (m.poses == 2)
    r = choose_pose(m, r, read_marker(m, true), markers_,
                    [&](const tag_reading &one) { return landmark < 0 ? 0.0 : marker_nis(at, landmark, one); });
  if (landmark >= 0) {
    fuse_known_marker(at, m, r, landmark);
    return WM_OK;
  }
  const bool frozen = params_.map == WM_SLAM_MAP_FROZEN;
  const wm_verdict verdict = frozen          ? WM_REJECTED_UNKNOWN_ID
                             : map_is_held() ? WM_REJECTED_SEARCHING
                                             : join_marker(at, r);
  return reject(records, at.record, verdict);
}

// The rows of a marker of the map. Where the pose is vague, the second derivatives count as noise [Athans1968]. With
// the heading's error h, and the errors r along and t across the line of sight at distance d, which are linear in the
// state, a marker is seen h w beside its expected place along the sight, w = t + h d / 2, and -h r across. Their mean
// squares are P_hh P_ww + 2 P_hw^2 and P_hh P_rr + 2 P_hr^2. A place alone that is vague bends nothing. Below the
// marker's own noise they change no pose and are left out.
void slam::expect_known_marker(const context &at, const tag_reading &r, int landmark, int count, landmark_rows *out) {
  expect_marker(at, r, pose_of(landmark), lend(at), out);
  out->count = count;
  const relative_place place = relative_place_of(at, landmark);
  if (!(place.distance_m > kOnSensor_m)) return;
  const double hh = place.heading_rad2, d = place.distance_m;
  const double hw = place.heading_across + 0.5 * d * hh;
  const double ww = place.across_m2 + d * place.heading_across + 0.25 * d * d * hh;
  const double bent[2] = {hh * ww + 2.0 * square(hw), hh * place.along_m2 + 2.0 * square(place.heading_along)};
  for (int k = 0; k < 2; k++)
    if (bent[k] > out->noise[k]) out->noise[k] += bent[k];
}

// NIS of all three numbers of a known marker.
double slam::marker_nis(const context &at, int landmark, const tag_reading &r) {
  landmark_rows v;
  expect_known_marker(at, r, landmark, 3, &v);
  innovation block = prepare(landmark, &v);
  return block.nis;
}

// For the search of the pose.
slam::planar_observation slam::observation_of(const wm_marker &m, const tag_reading &r) const {
  return {.bearing_rad = r.floor_m > kNoDirection_m ? atan2(r.along[1], r.along[0]) : std::nan(""),
          .range_m = r.floor_m / errors_of(m.sensor)[kRangeScale],
          .heading_rad = r.has_heading ? wrap(sensor_[m.sensor].yaw_rad + r.yaw_rad) : std::nan(""),
          .bearing_sigma_rad = std::sqrt(r.noise[1]) / larger(r.floor_m, kNoDirection_m),
          .range_sigma_m = std::sqrt(r.noise[0]),
          .heading_sigma_rad = std::sqrt(r.noise[2])};
}

// The rows along and across the line of sight and of the heading. The line of sight is the measured one: u is the
// landmark in the sensor's frame, a' u its component along a, with a the unit vector along or across.
// `error_state`: of the time-correlated errors along and of the heading; -1: they count as noise.
void slam::expect_marker(const context &at, const tag_reading &r, const wm_pose2 &place, int error_state,
                         landmark_rows *out) const {
  static constexpr wm_residual kKinds[3] = {WM_RESIDUAL_X, WM_RESIDUAL_Y, WM_RESIDUAL_HEADING};
  const sensor_errors errors = errors_of(at.sensor);
  const wm_pose2 from = sensor_pose(at.sensor, at.past);
  const sin_cos h = sincos(from.heading_rad), base = sincos(at.past.pose.heading_rad);
  const double dx = place.x_m - from.x_m, dy = place.y_m - from.y_m;
  const double u[2] = {h.cos * dx + h.sin * dy, h.cos * dy - h.sin * dx};
  const double lever_x = from.x_m - at.past.pose.x_m, lever_y = from.y_m - at.past.pose.y_m;
  const auto slot = [&](sensor_state state) { return slots_.at(at.sensor, state); };
  out->count = 3;
  double by_age[3];  // per s that the picture is older than its stamp
  for (int k = 0; k < 2; k++) {
    const double a[2] = {k == 0 ? r.along[0] : -r.along[1], k == 0 ? r.along[1] : r.along[0]};
    const double scale = k == 0 ? errors[kRangeScale] : 1.0;
    // By the place: a' R(-heading).
    const double g[2] = {scale * (a[0] * h.cos - a[1] * h.sin), scale * (a[0] * h.sin + a[1] * h.cos)};
    const double turn = scale * (a[0] * u[1] - a[1] * u[0]);
    const double by[3] = {-g[0], -g[1], turn + g[0] * lever_y - g[1] * lever_x};
    const double component = a[0] * u[0] + a[1] * u[1];
    joint_row &row = out->row[k];
    add_past_pose(&row, by, at.past, slot(kTimeOffset));
    by_age[k] = product(by, at.past.stamp_by);
    row.add(slot(kYaw), turn);
    row.add(slot(kMountX), -g[0] * base.cos - g[1] * base.sin);
    row.add(slot(kMountY), g[0] * base.sin - g[1] * base.cos);
    if (k == 0) row.add(slot(kRangeScale), component);
    row.add(slot(kRoll), a[1] * r.nominal[2]);
    row.add(slot(kPitch), -a[0] * r.nominal[2]);
    out->by_landmark[k][0] = g[0];
    out->by_landmark[k][1] = g[1];
    out->by_landmark[k][2] = 0.0;
    out->observed[k] = a[0] * r.level[0] + a[1] * r.level[1];
    out->expected[k] = scale * component;
    out->innovation[k] = out->observed[k] - out->expected[k];
  }
  const double by[3] = {0.0, 0.0, -1.0};
  add_past_pose(&out->row[2], by, at.past, slot(kTimeOffset));
  by_age[2] = product(by, at.past.stamp_by);
  out->row[2].add(slot(kYaw), -1.0);
  out->by_landmark[2][0] = out->by_landmark[2][1] = 0.0;
  out->by_landmark[2][2] = 1.0;
  out->observed[2] = wrap(r.yaw_rad);
  out->expected[2] = wrap(place.heading_rad - from.heading_rad);
  out->innovation[2] = wrap(out->observed[2] - out->expected[2]);
  for (int k = 0; k < 3; k++) {
    out->kind[k] = kKinds[k];
    out->noise[k] = r.noise[k] + square(by_age[k] * markers_.stamp_sigma_s);
  }
  if (error_state >= 0 && markers_.correlated > 0.0) carry_marker_errors(r, error_state, out);
}

// The time-correlated share of the errors along and of the heading is a state of this sensor and marker.
void slam::carry_marker_errors(const tag_reading &r, int error_state, landmark_rows *out) const {
  for (int k = 0; k < 3; k += 2) {
    const int state = error_state + k / 2;
    const double size = markers_.correlated * std::sqrt(r.noise[k]), error = size * joint_.value(state);
    out->row[k].add(state, size);
    out->noise[k] -= square(size);
    out->expected[k] += error;
    out->innovation[k] = k == 2 ? wrap(out->innovation[k] - error) : out->innovation[k] - error;
  }
}

void slam::fuse_known_marker(const context &at, const wm_marker &m, const tag_reading &r, int landmark) {
  landmark_rows v;
  expect_known_marker(at, r, landmark, r.has_heading ? 3 : 2, &v);
  innovation block = prepare(landmark, &v);
  const gate_result g = gate(block.nis, v.count, gates());
  const double volume = square(kClutter_m) * (r.has_heading ? kTwoPi : 1.0);
  const double log_bayes = g.passed ? landmark_evidence::log_bayes_factor(block.density(), volume)
                                    : landmark_evidence::max_log_bayes_factor();
  if (weigh_slip(landmark, at, observation_of(m, r), g.passed) ||
      !weigh(landmark, g.passed, log_bayes, std::nan(""), std::nan("")))
    return (void)reject(at.records, at.record, WM_REJECTED_SEARCHING);
  const wm_verdict verdict = fuse_rows(at, v, g, &block);
  landmark_note &marker = note(landmark);
  if (r.has_heading) note_rotation(g.passed, v.innovation[2], picture_outliers::kMarkers, marker.last_ns);
  if (!g.passed) return note_misfit(landmark, true);
  if (verdict != WM_FUSED) return;
  const bool may_change = !map_is_held();
  if (!marker.surveyed && may_change) marker.z_m += (r.z_m - marker.z_m) / (marker.seen + 1.0);
  note_fused(landmark, at.sensor);
  if (may_change) fuse_height(landmark, at.sensor, r);
}

wm_verdict slam::join_marker(const context &at, const tag_reading &r) {
  if (!make_room()) return WM_REJECTED_NO_ASSOCIATION;
  const double scale = errors_of(at.sensor)[kRangeScale];
  const wm_pose2 there = compose(sensor_pose(at.sensor, at.past), {r.level[0] / scale, r.level[1] / scale, r.yaw_rad});
  landmark_rows v;
  expect_marker(at, r, there, lend(at), &v);
  // The block by the landmark: a rotation times the scale, and 1.
  const double(*h)[3] = v.by_landmark;
  const double determinant = h[0][0] * h[1][1] - h[0][1] * h[1][0];
  const double inverse[3][3] = {{h[1][1] / determinant, -h[0][1] / determinant, 0},
                                {-h[1][0] / determinant, h[0][0] / determinant, 0},
                                {0, 0, 1}};
  const double place[3] = {there.x_m, there.y_m, there.heading_rad};
  const int landmark = join(at, v, inverse, place, r.has_heading ? 0.0 : square(kPi));
  note(landmark).z_m = r.z_m;
  fuse_height(landmark, at.sensor, r);
  return WM_FUSED;
}

// A tilted camera sees a marker at a height that depends on its distance and side. The height is no state: it is
// unknown and the same each time, so each observation is compared with the mean of those before, z - mean z = pitch (x
// - mean x) - roll (y - mean y). Its noise (1 + 1/n) sigma^2 is independent of theirs (Helmert's transform of a
// regression with a constant). One row more, O(n^2); none once it carries little information.
void slam::fuse_height(int landmark, int sensor, const tag_reading &r) {
  const int roll = slots_.at(sensor, kRoll), pitch = slots_.at(sensor, kPitch);
  landmark_note &marker = note(landmark);
  if (roll < 0) return;
  // The means are in one camera's axes: the first one that saw the marker.
  if (marker.tilt_sensor < 0) marker.tilt_sensor = sensor;
  if (marker.tilt_sensor != sensor) return;
  const double *mean = marker.mean_m;
  if (marker.means > 0.0) {
    const double by_pitch = r.nominal[0] - mean[0], by_roll = mean[1] - r.nominal[1];
    joint_row row;
    row.add(pitch, by_pitch);
    row.add(roll, by_roll);
    const double expected = by_pitch * joint_.value(pitch) + by_roll * joint_.value(roll);
    const double difference = r.nominal[2] - mean[2] - expected;
    const double noise = kAlike * (1.0 + 1.0 / marker.means) * r.z_noise;
    if (joint_.variance_of(row) > kLeastInformation * noise) {
      innovation block = joint_.prepare(&row, &difference, &noise, 1);
      if (block.nis < kHeightGate_nis) (void)joint_.fuse(std::move(block), nullptr, scope_now());
    }
  }
  marker.means += 1.0;
  for (int i = 0; i < 3; i++) marker.mean_m[i] += (r.nominal[i] - mean[i]) / marker.means;
}

}  // namespace wm
