// SPDX-License-Identifier: Apache-2.0
// From observations to rows. Each row has the same few kinds of columns: place, turn, the sensors' states, one point.
#include <cstring>

#include "filters/stereo_ekf/stereo_ekf.hpp"

namespace wm {
namespace {

constexpr double kFarthest_m = 1e6;
constexpr double kFarthest_px = 1e6;
constexpr double kMeaningless_m = 1e5;
constexpr double kNearest_m = 0.05;
constexpr double kUpright = 0.1;  // of the nose's horizontal part, below which there is no heading

wm_innovation record_of(const wm_event &event, wm_residual residual) {
  wm_innovation out;
  std::memset(&out, 0, sizeof out);
  out.t_ns = event.t_ns;
  out.source = event.source;
  out.landmark_id = -1;
  out.residual = (uint8_t)residual;
  out.gate_dof = 1;
  return out;
}

wm_status refuse(record_list records, wm_innovation record, wm_status status) {
  record.verdict = status == WM_NOT_FINITE ? WM_REJECTED_NOT_FINITE : WM_REJECTED_OUT_OF_RANGE;
  records.add(record);
  return status;
}

bool is_sigma(double sigma) { return std::isnan(sigma) || (sigma > 0.0 && sigma < 1e6); }

void put(row_block *block, int row, int column, const mat3 &m) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) block->by[row + i][column + j] = m.m[i][j];
}

}  // namespace

stereo_ekf::past_pose stereo_ekf::look_back(double age_s) const {
  past_pose out;
  const bool rates = constant_velocity();
  const double scale = rates ? 1.0 : filter_.head1(kVelocityScale, 1.0);
  const vec3 bias = rates ? vec3{0, 0, 0} : filter_.head3(kRateBias);
  if (rates) {
    out.v_mps = filter_.head3(kVelocity);
    out.w_radps = filter_.head3(kRates);
  } else {
    out.v_mps = motion_.steady_v_mps();
    out.w_radps = motion_.steady_w_radps();
  }
  out.at = filter_.nominal();
  out.R = filter_.R();
  if (age_s != 0.0) {
    pose3 since = rates ? pose3{age_s * (mean_turn(age_s * out.w_radps) * out.v_mps), turn_by(age_s * out.w_radps)}
                        : motion_.moved_since(age_s);
    out.at.q = normalized(out.at.q * conjugate(since.q));
    out.R = matrix_of(out.at.q);
    out.at.p = out.at.p - out.R * since.p;
  }
  out.v_mps = scale * out.v_mps;
  out.w_radps = out.w_radps - bias;
  return out;
}

// x = B'(R'(l - p) - t), B the camera's turned axes in the body, t its place. A = B' R' is the derivative by l; a turn
// of the vehicle is one of the arm from where it is now.
stereo_ekf::point_view stereo_ekf::view_point(const vec3 &place, const past_pose &past) const {
  point_view out;
  const mat3 B = rig_.R_base_optical * matrix_of(turn_by(filter_.head3(kCameraRotation)));
  const mat3 Bt = transposed(B);
  out.A = Bt * transposed(past.R);
  const vec3 in_body = transposed_times(past.R, place - past.at.p);
  out.x = Bt * (in_body - rig_.place - filter_.head3(kCameraPlace));
  row_block &by = out.by;
  by.rows = 3;
  put(&by, 0, by.add_columns(kPlace, 3), -1.0 * out.A);
  put(&by, 0, by.add_columns(kTurn, 3), out.A * skew(place - filter_.nominal().p));
  if (filter_.at(kCameraRotation) >= 0) put(&by, 0, by.add_columns(filter_.at(kCameraRotation), 3), skew(out.x));
  if (filter_.at(kCameraPlace) >= 0) put(&by, 0, by.add_columns(filter_.at(kCameraPlace), 3), -1.0 * Bt);
  if (filter_.at(kTimeOffset) >= 0) {
    const vec3 d = Bt * (cross(past.w_radps, in_body) + past.v_mps);
    const int column = by.add_columns(filter_.at(kTimeOffset), 1);
    for (int i = 0; i < 3; i++) by.by[i][column] = d[i];
  }
  return out;
}

row_verdict stereo_ekf::fuse_rows(const row_block &block, const wm_residual *kinds, const wm_innovation &blank,
                                  record_list records) {
  const row_verdict verdict = filter_.fuse(block, limits());
  for (int k = 0; k < block.rows; k++) {
    wm_innovation r = blank;
    r.residual = (uint8_t)kinds[k];
    r.observed = block.observed[k];
    r.expected = block.observed[k] - verdict.innovation[k];
    r.variance = verdict.variance[k];
    r.nis = verdict.nis[k];
    r.gate = params_.gate_hard;
    r.verdict = verdict.fused ? WM_FUSED : WM_REJECTED_GATE;
    records.add(r);
  }
  if (verdict.fused) fused_ns_ = now_ns_;
  // Without points in the state a correction is cheap to apply, and the next rows are taken about the better estimate.
  const vec3 turned = filter_.pending(kTurn);
  if (filter_.point_count() == 0 || dot(turned, turned) > square(0.01)) filter_.settle();
  return verdict;
}

// Rows of one point in the left, the right or both pictures. Paper, system 3, four numbers a point.
bool stereo_ekf::fuse_point(const wm_stereo &seen, const vec3 &place, double place_sigma_m, int slot,
                            const wm_innovation &blank, record_list records, row_verdict *verdict) {
  const past_pose past = look_back(filter_.head1(kTimeOffset, 0.0));
  filter_.set_turn_rate(past.w_radps);
  point_view view = view_point(place, past);
  if (!(view.x.z > kNearest_m)) return false;
  if (slot >= 0) put(&view.by, 0, view.by.add_columns(filter_.point_state(slot), 3), view.A);
  double px[4], by[4][3];
  rig_.see(view.x, px, by);
  const double observed[4] = {seen.left_px[0], seen.left_px[1], seen.right_px[0], seen.right_px[1]};
  row_block block;
  block.columns = view.by.columns;
  std::memcpy(block.index, view.by.index, sizeof block.index);
  wm_residual kinds[kRank];
  for (int k = 0; k < 4; k++) {
    if (std::isnan(observed[k])) continue;
    const int row = block.rows++;
    kinds[row] = WM_RESIDUAL_PIXEL;
    for (int c = 0; c < block.columns; c++)
      block.by[row][c] = by[k][0] * view.by.by[0][c] + by[k][1] * view.by.by[1][c] + by[k][2] * view.by.by[2][c];
    block.observed[row] = observed[k];
    block.innovation[row] = observed[k] - px[k];
    const double slope = by[k][0] * by[k][0] + by[k][1] * by[k][1] + by[k][2] * by[k][2];
    block.noise[row] = square(sigma_px_[k]) + square(place_sigma_m) * slope;
  }
  *verdict = fuse_rows(block, kinds, blank, records);
  return true;
}

wm_status stereo_ekf::fuse_stereo(const wm_event &event, record_list records) {
  if (!rig_.there) return WM_UNSUPPORTED;
  const wm_stereo &s = event.as.stereo;
  wm_innovation blank = record_of(event, WM_RESIDUAL_PIXEL);
  blank.landmark_id = s.id;
  const double px[4] = {s.left_px[0], s.left_px[1], s.right_px[0], s.right_px[1]};
  const bool left = !std::isnan(px[0]), right = !std::isnan(px[2]);
  if ((!left && !right) || std::isnan(px[1]) == left || std::isnan(px[3]) == right)
    return refuse(records, blank, WM_NOT_FINITE);
  for (const double value : px) {
    if (std::isinf(value)) return refuse(records, blank, WM_NOT_FINITE);
    if (std::fabs(value) > kFarthest_px) return refuse(records, blank, WM_OUT_OF_RANGE);
  }
  if (s.id < 0) return refuse(records, blank, WM_OUT_OF_RANGE);
  const wm_status status = check_time(event.t_ns);
  if (status != WM_OK) return status;
  move_to(event.t_ns);
  begin_picture(event.t_ns);
  const auto drop = [&](wm_verdict verdict) {
    blank.verdict = (uint8_t)verdict;
    records.add(blank);
    return WM_OK;
  };

  const int known = find_landmark(s.id);
  if (known >= 0) {
    const wm_landmark &landmark = setup_->landmarks[known];
    keep_clue(s, landmark, event.t_ns);
    if (state_ == WM_STATE_SEARCHING) {
      drop(WM_REJECTED_SEARCHING);
      search(event.t_ns - wm_ns_from_seconds(params_.recover_window_s));
      return WM_OK;
    }
    row_verdict verdict;
    const int slot = slot_of_known(known);
    const bool possible = slot >= 0
                              ? fuse_point(s, filter_.point(slot), 0.0, slot, blank, records, &verdict)
                              : fuse_point(s, vec_of(landmark.p_m), map_sigma(landmark), -1, blank, records, &verdict);
    if (!possible) drop(WM_REJECTED_OUT_OF_RANGE);
    note(event.t_ns, s.id, !possible || !verdict.fused ? 1.0 : verdict.doubtful ? 0.8 : 0.0);
    return WM_OK;
  }
  if (params_.points_max == 0) return drop(WM_REJECTED_UNKNOWN_ID);
  if (state_ == WM_STATE_SEARCHING) return drop(WM_REJECTED_SEARCHING);
  const int slot = find_slot(s.id);
  if (slot < 0) {
    add_point(s, blank, records);
    return WM_OK;
  }
  row_verdict verdict;
  const bool possible = fuse_point(s, filter_.point(slot), 0.0, slot, blank, records, &verdict);
  if (!possible) drop(WM_REJECTED_OUT_OF_RANGE);
  if (possible && verdict.fused) {
    info()[slot].seen_ns = event.t_ns;
    info()[slot].unseen = 0;
  } else {
    contradict_point(slot, s, blank, records);
  }
  return WM_OK;
}

// The derivative of something that depends on where an arm of the body is in map: `by`, rows by its place.
void stereo_ekf::add_place(row_block *block, const past_pose &past, const vec3 &arm, const double (*by)[3],
                           int rows) const {
  const vec3 lever = past.at.p + past.R * arm - filter_.nominal().p;
  const mat3 turned = -1.0 * skew(lever);  // a turn dr moves the arm's end by dr x lever
  const int place = block->add_columns(kPlace, 3), turn = block->add_columns(kTurn, 3);
  for (int k = 0; k < rows; k++)
    for (int j = 0; j < 3; j++) {
      block->by[k][place + j] = by[k][j];
      block->by[k][turn + j] = by[k][0] * turned.m[0][j] + by[k][1] * turned.m[1][j] + by[k][2] * turned.m[2][j];
    }
}

// Acoustic range to a beacon, and the azimuth of a landmark in the sensor's axes.
wm_status stereo_ekf::fuse_sighting(const wm_event &event, record_list records) {
  const wm_sighting &s = event.as.sighting;
  const bool has_bearing = !std::isnan(s.bearing_rad), has_range = !std::isnan(s.range_m);
  wm_innovation blank = record_of(event, has_range ? WM_RESIDUAL_RANGE : WM_RESIDUAL_BEARING);
  blank.sensor = s.sensor;
  blank.landmark_id = s.landmark_id;
  if ((!has_bearing && !has_range) || std::isinf(s.bearing_rad) || std::isinf(s.range_m))
    return refuse(records, blank, WM_NOT_FINITE);
  if (s.sensor >= setup_->sensor_count || (has_bearing && std::fabs(s.bearing_rad) > 100.0) ||
      (has_range && !(s.range_m >= 0.0 && s.range_m < kFarthest_m)) || !is_sigma(s.bearing_sigma_rad) ||
      !is_sigma(s.range_sigma_m))
    return refuse(records, blank, WM_OUT_OF_RANGE);
  const wm_status status = check_time(event.t_ns);
  if (status != WM_OK) return status;
  move_to(event.t_ns);
  const auto drop = [&](wm_verdict verdict) {
    blank.verdict = (uint8_t)verdict;
    records.add(blank);
    return WM_OK;
  };
  const int known = s.landmark_id >= 0 ? find_landmark(s.landmark_id) : -1;
  if (known < 0) return drop(s.landmark_id >= 0 ? WM_REJECTED_UNKNOWN_ID : WM_REJECTED_NO_ASSOCIATION);
  if (state_ == WM_STATE_SEARCHING) return drop(WM_REJECTED_SEARCHING);
  const wm_sensor &sensor = setup_->sensors[s.sensor];
  if (has_range && s.range_m > sensor.max_range_m) return drop(WM_REJECTED_OUT_OF_RANGE);

  const past_pose past = look_back(0.0);
  const vec3 arm = vec_of(sensor.mounting.xyz_m);
  const int slot = has_range ? slot_of_known(known) : -1;
  const vec3 target = slot >= 0 ? filter_.point(slot) : vec_of(setup_->landmarks[known].p_m);
  const vec3 to = target - past.at.p - past.R * arm;
  const double distance = length(to);
  if (!(distance > kNearest_m)) return drop(WM_REJECTED_SINGULAR);
  const double map = slot >= 0 ? 0.0 : map_sigma(setup_->landmarks[known]);
  double by[2][3];
  row_block block;
  wm_residual kinds[2];
  if (has_range) {
    const int row = block.rows++;
    const double sigma = finite(s.range_sigma_m)        ? s.range_sigma_m
                         : finite(sensor.range_sigma_m) ? sensor.range_sigma_m
                                                        : params_.range_m;
    for (int j = 0; j < 3; j++) by[row][j] = -to[j] / distance;
    kinds[row] = WM_RESIDUAL_RANGE;
    block.observed[row] = s.range_m;
    block.innovation[row] = s.range_m - distance - filter_.head1(kRangeBias, 0.0);
    block.noise[row] = square(sigma) + square(map);
  }
  mat3 turn_by_row = {};
  if (has_bearing) {
    // In the sensor's axes; its azimuth turns with the body about the axis that is up there.
    const mat3 S = matrix_of_rpy(sensor.mounting.rpy_rad);
    const vec3 x = transposed_times(S, transposed_times(past.R, to));
    const double q = x.x * x.x + x.y * x.y;
    if (!(q > square(kNearest_m))) return drop(WM_REJECTED_SINGULAR);
    const int row = block.rows++;
    const double sigma = finite(s.bearing_sigma_rad)        ? s.bearing_sigma_rad
                         : finite(sensor.bearing_sigma_rad) ? sensor.bearing_sigma_rad
                                                            : params_.bearing_rad;
    const vec3 in_map = past.R * (S * vec3{-x.y / q, x.x / q, 0.0});
    for (int j = 0; j < 3; j++) by[row][j] = -in_map[j];
    // dx = S' R' (to x dr): the azimuth's change is (to x dr) . in_map = dr . (in_map x to); the arm's own is below.
    const vec3 turned = cross(in_map, to);
    for (int j = 0; j < 3; j++) turn_by_row.m[row][j] = turned[j];
    kinds[row] = WM_RESIDUAL_BEARING;
    block.observed[row] = s.bearing_rad;
    block.innovation[row] = wrap(s.bearing_rad - atan2(x.y, x.x) - filter_.head1(kBearingBias, 0.0));
    block.noise[row] = square(sigma) + square(map) / q;
  }
  add_place(&block, past, arm, by, block.rows);
  for (int k = 0; k < block.rows; k++)
    for (int j = 0; j < 3; j++) block.by[k][3 + j] += turn_by_row.m[k][j];
  if (has_range && filter_.at(kRangeBias) >= 0) block.by[0][block.add_columns(filter_.at(kRangeBias), 1)] = 1.0;
  if (has_bearing && filter_.at(kBearingBias) >= 0)
    block.by[block.rows - 1][block.add_columns(filter_.at(kBearingBias), 1)] = 1.0;
  if (slot >= 0) {
    const int column = block.add_columns(filter_.point_state(slot), 3);
    for (int k = 0; k < block.rows; k++)
      for (int j = 0; j < 3; j++) block.by[k][column + j] = -by[k][j];
  }
  const row_verdict verdict = fuse_rows(block, kinds, blank, records);
  note(event.t_ns, s.landmark_id, !verdict.fused ? 1.0 : verdict.doubtful ? 0.8 : 0.0);
  return WM_OK;
}

// A position, or (without x and y) a depth.
wm_status stereo_ekf::fuse_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  // Depth alone comes without x and y, or with a sigma that makes them meaningless.
  const bool depth_only =
      finite(p.p_m[2]) && ((std::isnan(p.p_m[0]) && std::isnan(p.p_m[1])) || p.sigma_xy_m >= kMeaningless_m);
  wm_innovation blank = record_of(event, depth_only ? WM_RESIDUAL_Z : WM_RESIDUAL_X);
  const bool has_z = finite(p.p_m[2]) && finite(p.sigma_z_m);
  if (depth_only ? !finite(p.sigma_z_m) : !finite(p.p_m[0]) || !finite(p.p_m[1]) || !finite(p.sigma_xy_m))
    return refuse(records, blank, WM_NOT_FINITE);
  for (int i = depth_only ? 2 : 0; i < (has_z ? 3 : 2); i++) {
    const double sigma = i == 2 ? p.sigma_z_m : p.sigma_xy_m;
    if (std::fabs(p.p_m[i]) > 1e7 || !(sigma > 0.0 && sigma < 1e6)) return refuse(records, blank, WM_OUT_OF_RANGE);
  }
  const wm_status status = check_time(event.t_ns);
  if (status != WM_OK) return status;
  move_to(event.t_ns);
  if (state_ == WM_STATE_SEARCHING) {
    blank.verdict = WM_REJECTED_SEARCHING;
    records.add(blank);
    return WM_OK;
  }
  static constexpr wm_residual kKinds[3] = {WM_RESIDUAL_X, WM_RESIDUAL_Y, WM_RESIDUAL_Z};
  row_block block;
  double by[3][3] = {};
  wm_residual kinds[3] = {};
  for (int i = depth_only ? 2 : 0; i < (has_z ? 3 : 2); i++) {
    const int row = block.rows++;
    by[row][i] = 1.0;
    kinds[row] = kKinds[i];
    block.observed[row] = p.p_m[i];
    block.innovation[row] = p.p_m[i] - filter_.nominal().p[i];
    block.noise[row] = square(i == 2 ? p.sigma_z_m : p.sigma_xy_m);
  }
  add_place(&block, look_back(0.0), {0, 0, 0}, by, block.rows);
  const row_verdict verdict = fuse_rows(block, kinds, blank, records);
  note(event.t_ns, depth_only ? -3 : -2, !verdict.fused ? 1.0 : verdict.doubtful ? 0.8 : 0.0);
  return WM_OK;
}

// Heading of the nose: atan2 of its horizontal part; none while it points up or down.
wm_status stereo_ekf::fuse_heading(const wm_event &event, record_list records) {
  const wm_heading &h = event.as.heading;
  wm_innovation blank = record_of(event, WM_RESIDUAL_HEADING);
  blank.observed = h.heading_rad;
  if (!finite(h.heading_rad) || !finite(h.sigma_rad)) return refuse(records, blank, WM_NOT_FINITE);
  if (std::fabs(h.heading_rad) > 100.0 || !(h.sigma_rad > 0.0 && h.sigma_rad < 100.0))
    return refuse(records, blank, WM_OUT_OF_RANGE);
  const wm_status status = check_time(event.t_ns);
  if (status != WM_OK) return status;
  move_to(event.t_ns);
  const mat3 &R = filter_.R();
  const vec3 nose = {R.m[0][0], R.m[1][0], R.m[2][0]};
  const double level2 = nose.x * nose.x + nose.y * nose.y;
  if (state_ == WM_STATE_SEARCHING || !(level2 > square(kUpright))) {
    blank.verdict = state_ == WM_STATE_SEARCHING ? WM_REJECTED_SEARCHING : WM_REJECTED_SINGULAR;
    records.add(blank);
    return WM_OK;
  }
  row_block block;
  block.rows = 1;
  const int turn = block.add_columns(kTurn, 3);
  // dr turns the nose by dr x nose.
  block.by[0][turn] = -nose.x * nose.z / level2;
  block.by[0][turn + 1] = -nose.y * nose.z / level2;
  block.by[0][turn + 2] = 1.0;
  if (filter_.at(kBearingBias) >= 0) block.by[0][block.add_columns(filter_.at(kBearingBias), 1)] = 1.0;
  block.observed[0] = h.heading_rad;
  block.innovation[0] = wrap(h.heading_rad - atan2(nose.y, nose.x) - filter_.head1(kBearingBias, 0.0));
  block.noise[0] = square(h.sigma_rad);
  const wm_residual kind = WM_RESIDUAL_HEADING;
  const row_verdict verdict = fuse_rows(block, &kind, blank, records);
  note(event.t_ns, -4, !verdict.fused ? 1.0 : verdict.doubtful ? 0.8 : 0.0);
  return WM_OK;
}

}  // namespace wm
