// SPDX-License-Identifier: Apache-2.0
// Coded markers: place and heading of the print from one sighting. Paper, system 2, observation, as distance, direction
// and heading, because these are what a camera's errors belong to.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kFarthest_m = 1e4;
constexpr double kThreeNumbers = 11.345 / 9.210;  // 99 % of chi2 with three degrees of freedom against two
constexpr double kClutter_m = 10.0;               // a misread code lies anywhere on a square of this side
constexpr double kUnder_m = 0.05;                 // a marker nearer to the camera's axis than this has no direction
constexpr double kPlain = 9.0;                    // of two poses one is 90 times as likely

double first_number(double a, double b) { return finite(a) ? a : b; }
double zero_if_absent(double a) { return std::isnan(a) ? 0.0 : a; }

wm_status check_marker(const wm_marker &m, size_t sensors) {
  const bool two = m.poses == 2;
  const double numbers[] = {m.p_m[0],
                            m.p_m[1],
                            m.p_m[2],
                            two ? m.other_p_m[0] : 0.0,
                            two ? m.other_p_m[1] : 0.0,
                            two ? m.other_p_m[2] : 0.0,
                            zero_if_absent(m.along_sigma_m)};
  const double angles[] = {m.yaw_rad, two ? m.other_yaw_rad : 0.0, zero_if_absent(m.yaw_sigma_rad),
                           zero_if_absent(m.edge_shift_px)};
  for (double n : numbers)
    if (!finite(n)) return WM_NOT_FINITE;
  for (double a : angles)
    if (!finite(a)) return WM_NOT_FINITE;
  if (m.sensor >= sensors || m.along_sigma_m <= 0.0 || m.yaw_sigma_rad <= 0.0) return WM_OUT_OF_RANGE;
  for (double n : numbers)
    if (std::fabs(n) > kFarthest_m) return WM_OUT_OF_RANGE;
  for (double a : angles)
    if (std::fabs(a) > 100.0) return WM_OUT_OF_RANGE;
  return WM_OK;
}

}  // namespace

// Levelled: along the sensor's yaw, on the floor. axis is (Ry(pitch) Rx(roll))', its columns are the sensor's axes.
slam::marker_reading slam::read_marker(const wm_marker &m, const double p_m[3], double yaw_rad) const {
  const mounted_sensor &sensor = sensor_[m.sensor];
  marker_reading r;
  double *level = r.level, *told = r.told;
  for (int i = 0; i < 3; i++)
    told[i] = sensor.axis[0][i] * p_m[0] + sensor.axis[1][i] * p_m[1] + sensor.axis[2][i] * p_m[2];
  // What is left of the camera's tilt, small turns about the levelled axes ahead and to the left.
  const sensor_errors errors = errors_of(m.sensor);
  const double roll = errors[kRoll], pitch = errors[kPitch];
  level[0] = told[0] + pitch * told[2];
  level[1] = told[1] - roll * told[2];
  level[2] = told[2] + roll * told[1] - pitch * told[0];
  const double floor_m = std::sqrt(level[0] * level[0] + level[1] * level[1]);
  r.length_m = std::sqrt(level[0] * level[0] + level[1] * level[1] + level[2] * level[2]);
  r.along[0] = floor_m > 1e-6 ? level[0] / floor_m : 1.0;
  r.along[1] = floor_m > 1e-6 ? level[1] / floor_m : 0.0;
  r.yaw_rad = yaw_rad;
  const double across = params_.bearing_sigma_factor *
                        first_number(sensor.bearing_sigma_rad, params_.bearing_sigma_default_rad) * floor_m;
  const double range = params_.range_sigma_factor * first_number(sensor.range_sigma_m, params_.range_sigma_default_m);
  const double least = square(params_.marker_sigma_m) + square(params_.marker_sigma_rel * r.length_m);
  // The line of sight's share that lies on the floor.
  const double along_sigma_m = zero_if_absent(m.along_sigma_m);
  const double along = r.length_m > 1e-6 ? params_.range_sigma_factor * along_sigma_m * floor_m / r.length_m : 0.0;
  r.noise[0] = least + square(range) + square(along);
  r.noise[1] = least + square(across);
  r.noise[2] = square(first_number(m.yaw_sigma_rad, params_.marker_heading_sigma_rad));
  const double up = r.length_m > 1e-6 ? params_.range_sigma_factor * along_sigma_m * level[2] / r.length_m : 0.0;
  r.z_noise = least + square(across) + square(up);
  r.z_m = sensor.z_m + level[2];
  r.turned = true;
  return r;
}

wm_status slam::fuse_marker(const wm_event &event, record_list records) {
  const wm_marker &m = event.as.marker;
  wm_innovation blank{};
  blank.t_ns = event.t_ns;
  blank.source = event.source;
  blank.sensor = m.sensor;
  blank.landmark_id = m.id;
  blank.residual = WM_RESIDUAL_X;
  const auto drop = [&](wm_verdict verdict) {
    blank.verdict = (uint8_t)verdict;
    records.add(blank);
    return WM_OK;
  };
  wm_status status = check_marker(m, setup_->sensor_count);
  if (status != WM_OK) {
    drop(status == WM_NOT_FINITE ? WM_REJECTED_NOT_FINITE : WM_REJECTED_OUT_OF_RANGE);
    return status;
  }
  status = joint_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  joint_.move_to(event.t_ns);
  begin_look(event.t_ns);
  look_after(event.t_ns);
  if (!params_.markers) return drop(WM_REJECTED_BY_CONFIG);
  if (m.id < 0) return drop(WM_REJECTED_NO_ASSOCIATION);
  if (finite(m.edge_shift_px)) edge_shift_px_[m.sensor] = m.edge_shift_px;

  marker_reading r = read_marker(m, m.p_m, m.yaw_rad);
  if (r.length_m > sensor_[m.sensor].max_range_m) return drop(WM_REJECTED_OUT_OF_RANGE);
  const int landmark = find_landmark(m.id);
  if (doubled(m.id, landmark, m.sensor)) return drop(WM_REJECTED_NO_ASSOCIATION);
  const bool two = m.poses == 2;
  const bool sure = !(m.yaw_sigma_rad > params_.marker_heading_most_rad);
  r.turned = !two && sure;
  if (state_ == WM_STATE_SEARCHING && (landmark < 0 || !find_start(landmark, m, r, two)))
    return drop(WM_REJECTED_SEARCHING);
  begin_picture(m.sensor, event.t_ns);
  const past_pose past = look_back(m.sensor);
  if (landmark >= 0 && map_is_held()) {
    keep_observation(landmark, m.sensor, past, sighted_of(m, r));
    if (relocalize()) return drop(WM_REJECTED_SEARCHING);
  }
  if (two) {
    // Seen nearly face on a print has two poses, which differ in its heading. The filter tells them apart where it
    // knows better; where not, the place alone is taken: the same side would be the wrong one sighting after sighting.
    const marker_reading other = read_marker(m, m.other_p_m, m.other_yaw_rad);
    const double nis = landmark < 0 ? 0.0 : marker_nis(landmark, m, r, past);
    const double other_nis = landmark < 0 ? 0.0 : marker_nis(landmark, m, other, past);
    if (other_nis < nis) r = other;
    r.turned = sure && std::fabs(other_nis - nis) > kPlain;
  }
  if (landmark >= 0)
    fuse_known_marker(landmark, m, r, past, blank, records);
  else if (params_.map == WM_SLAM_MAP_FROZEN)
    drop(WM_REJECTED_UNKNOWN_ID);
  else if (map_is_held())
    drop(WM_REJECTED_SEARCHING);
  else
    join_marker(m, r, past, blank, records);
  return WM_OK;
}

// Along and across the line of sight, and the heading: expected from `place` (x, y, heading in map). Rows by the state
// without the landmark; those by the landmark apart.
void slam::see_marker(int sensor, const marker_reading &r, const past_pose &past, const double place[3], int lasting,
                      marker_view *out) const {
  const sensor_errors errors = errors_of(sensor);
  const wm_pose2 from = sensor_pose(sensor, past);
  const sin_cos h = sincos(from.heading_rad), base = sincos(past.pose.heading_rad);
  const double dx = place[0] - from.x_m, dy = place[1] - from.y_m;
  const double u[2] = {h.cos * dx + h.sin * dy, h.cos * dy - h.sin * dx};
  const double lever_x = from.x_m - past.pose.x_m, lever_y = from.y_m - past.pose.y_m;
  const auto slot = [&](sensor_state state) { return slots_.at(sensor, state); };
  double by_age[3];  // per s that the picture is older than its stamp says
  for (int k = 0; k < 2; k++) {
    const double a[2] = {k == 0 ? r.along[0] : -r.along[1], k == 0 ? r.along[1] : r.along[0]};
    const double scale = k == 0 ? errors[kRangeScale] : 1.0;
    // By the place: a' R(-heading).
    const double g[2] = {scale * (a[0] * h.cos - a[1] * h.sin), scale * (a[0] * h.sin + a[1] * h.cos)};
    const double turn = scale * (a[0] * u[1] - a[1] * u[0]);
    const double by[3] = {-g[0], -g[1], turn + g[0] * lever_y - g[1] * lever_x};
    const double plain = a[0] * u[0] + a[1] * u[1];
    out->row[k].count = out->row[k].missing = 0;
    add_past_pose(&out->row[k], by, past, slot(kTimeOffset));
    by_age[k] = by[0] * past.age_by[0] + by[1] * past.age_by[1] + by[2] * past.age_by[2];
    out->row[k].add(slot(kYaw), turn);
    out->row[k].add(slot(kMountX), -g[0] * base.cos - g[1] * base.sin);
    out->row[k].add(slot(kMountY), g[0] * base.sin - g[1] * base.cos);
    if (k == 0) out->row[k].add(slot(kRangeScale), plain);
    out->row[k].add(slot(kRoll), a[1] * r.told[2]);
    out->row[k].add(slot(kPitch), -a[0] * r.told[2]);
    out->by_landmark[k][0] = g[0];
    out->by_landmark[k][1] = g[1];
    out->by_landmark[k][2] = 0.0;
    out->observed[k] = a[0] * r.level[0] + a[1] * r.level[1];
    out->expected[k] = scale * plain;
    out->innovation[k] = out->observed[k] - out->expected[k];
  }
  const double by[3] = {0.0, 0.0, -1.0};
  out->row[2].count = out->row[2].missing = 0;
  add_past_pose(&out->row[2], by, past, slot(kTimeOffset));
  by_age[2] = by[2] * past.age_by[2];
  out->row[2].add(slot(kYaw), -1.0);
  out->by_landmark[2][0] = out->by_landmark[2][1] = 0.0;
  out->by_landmark[2][2] = 1.0;
  out->observed[2] = wrap(r.yaw_rad);
  out->expected[2] = wrap(place[2] - from.heading_rad);
  out->innovation[2] = wrap(out->observed[2] - out->expected[2]);

  for (int k = 0; k < 3; k++) {
    const double moved = by_age[k] * params_.marker_stamp_sigma_s;
    out->noise[k] = r.noise[k] + square(moved);
  }
  // What lasts of the errors along and in heading is a state of this sensor and marker.
  if (lasting < 0 || !(params_.marker_lasting > 0.0)) return;
  for (int k = 0; k < 3; k += 2) {
    const int state = lasting + k / 2;
    const double size = params_.marker_lasting * std::sqrt(r.noise[k]), error = size * joint_.value(state);
    out->row[k].add(state, size);
    out->noise[k] -= square(size);
    out->expected[k] += error;
    out->innovation[k] = k == 2 ? wrap(out->innovation[k] - error) : out->innovation[k] - error;
  }
}

// How badly a known marker's sighting fits.
double slam::marker_nis(int landmark, const wm_marker &m, const marker_reading &r, const past_pose &past) {
  const int state = joint_.landmark_state(landmark);
  const double place[3] = {joint_.value(state), joint_.value(state + 1), joint_.value(state + 2)};
  marker_view v;
  see_marker(m.sensor, r, past, place, lend(m.sensor, m.id, joint_.now_ns()), &v);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) v.row[i].add(state + k, v.by_landmark[i][k]);
  joint_state::innovation_block block;
  joint_.prepare(v.row, v.innovation, v.noise, 3, &block);
  return block.nis;
}

void slam::fuse_known_marker(int landmark, const wm_marker &m, const marker_reading &r, const past_pose &past,
                             wm_innovation blank, record_list records) {
  static constexpr wm_residual kKinds[3] = {WM_RESIDUAL_X, WM_RESIDUAL_Y, WM_RESIDUAL_HEADING};
  const int state = joint_.landmark_state(landmark);
  const double place[3] = {joint_.value(state), joint_.value(state + 1), joint_.value(state + 2)};
  const int count = r.turned ? 3 : 2;
  marker_view v;
  see_marker(m.sensor, r, past, place, lend(m.sensor, m.id, joint_.now_ns()), &v);
  for (int i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) v.row[i].add(state + k, v.by_landmark[i][k]);
  joint_state::innovation_block block;
  joint_.prepare(v.row, v.innovation, v.noise, count, &block);
  const double scale = r.turned ? kThreeNumbers : 1.0;
  const double hard = params_.gate_hard * scale, soft = params_.gate_soft * scale;
  if (!weigh(landmark, block, block.nis <= hard, square(kClutter_m) * (r.turned ? kTwoPi : 1.0), std::nan(""))) {
    blank.verdict = WM_REJECTED_SEARCHING;
    records.add(blank);
    return;
  }
  const bool fits = block.nis <= hard;
  double variance[3];
  for (int i = 0; i < count; i++) variance[i] = block.s[i][i];
  const double weaker = block.nis > soft ? block.nis / soft - 1.0 : 0.0;
  const double more[3] = {v.noise[0] * weaker, v.noise[1] * weaker, v.noise[2] * weaker};
  const bool failed = !(block.determinant > 0.0) || (fits && !joint_.fuse(block, more, scope_now()));
  for (int i = 0; i < count; i++) {
    wm_innovation record = blank;
    record.residual = (uint8_t)kKinds[i];
    record.observed = v.observed[i];
    record.expected = v.expected[i];
    record.variance = variance[i];
    record.nis = block.nis;
    record.gate = hard;
    record.gate_dof = (uint8_t)count;
    record.verdict = failed ? WM_REJECTED_NUMERIC : fits ? WM_FUSED : WM_REJECTED_GATE;
    records.add(record);
  }
  if (r.turned) note_turn(fits, v.innovation[2], true, notes()[landmark].last_ns);
  if (!fits) return misfit(landmark, true);
  if (failed) return;
  landmark_note &note = notes()[landmark];
  if (!note.surveyed && !map_is_held()) note.z_m += (r.z_m - note.z_m) / (note.seen + 1.0);
  note_fused(landmark, m.sensor);
  if (!map_is_held()) level_camera(landmark, m.sensor, r);
}

slam::sighted slam::sighted_of(const wm_marker &m, const marker_reading &r) const {
  const double floor_m = std::sqrt(square(r.level[0]) + square(r.level[1]));
  return {floor_m > kUnder_m ? atan2(r.along[1], r.along[0]) : std::nan(""),
          floor_m / errors_of(m.sensor)[kRangeScale],
          r.turned ? wrap(sensor_[m.sensor].yaw_rad + r.yaw_rad) : std::nan(""),
          std::sqrt(r.noise[1]) / larger(floor_m, kUnder_m),
          std::sqrt(r.noise[0]),
          std::sqrt(r.noise[2])};
}

// Paper, system 2, new marker: P_aa = G_x P G_x' + G_z R G_z' with all cross terms.
void slam::join_marker(const wm_marker &m, const marker_reading &r, const past_pose &past, wm_innovation blank,
                       record_list records) {
  const wm_pose2 from = sensor_pose(m.sensor, past);
  const double scale = errors_of(m.sensor)[kRangeScale];
  const wm_pose2 there = compose(from, {r.level[0] / scale, r.level[1] / scale, r.yaw_rad});
  const double place[3] = {there.x_m, there.y_m, there.heading_rad};
  blank.verdict = make_room() ? WM_FUSED : WM_REJECTED_NO_ASSOCIATION;
  records.add(blank);
  if (blank.verdict != WM_FUSED) return;
  marker_view v;
  see_marker(m.sensor, r, past, place, lend(m.sensor, m.id, joint_.now_ns()), &v);
  // The block by the landmark is a turn times the scale, and 1.
  const double(*g)[3] = v.by_landmark;
  const double determinant = g[0][0] * g[1][1] - g[0][1] * g[1][0];
  const double inverse[3][3] = {{g[1][1] / determinant, -g[0][1] / determinant, 0},
                                {-g[1][0] / determinant, g[0][0] / determinant, 0},
                                {0, 0, 1}};
  joint_row rows[3];
  double noise[3][3] = {};
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 3; i++) {
      if (inverse[k][i] != 0.0) rows[k].add(v.row[i], -inverse[k][i]);
      for (int l = 0; l < 3; l++) noise[k][l] += inverse[k][i] * v.noise[i] * inverse[l][i];
    }
  if (!r.turned) noise[2][2] += square(kPi);
  const int landmark = note_landmark(m.id, joint_.add_landmark(rows, noise, place), m.sensor, joint_.now_ns());
  notes()[landmark].z_m = r.z_m;
  level_camera(landmark, m.sensor, r);
  fused_ns_ = joint_.now_ns();
}

}  // namespace wm
