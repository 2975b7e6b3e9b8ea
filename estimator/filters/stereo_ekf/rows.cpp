// SPDX-License-Identifier: Apache-2.0
// The mathematics of the observations: the state at the time of measurement, and the rows with their derivatives.
// An error of the rotation is dr in map axes, R_true = Exp(dr) R; it displaces the end of a lever l by dr x l.
#include <cstring>

#include "filters/stereo_ekf/stereo_ekf.hpp"

namespace wm {
namespace {

// Nearer than this, a direction or a pixel has no useful derivative. Far below every recording's distances; not swept.
constexpr double kNearest_m = 0.05;
// Horizontal part of the unit vector ahead, below which a heading has no useful derivative: 84 degrees up or down.
constexpr double kLevelMin = 0.1;

void put(row_block *block, int row, int column, const mat3 &m) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) block->by[row + i][column + j] = m.m[i][j];
}

double first_finite(double a, double b, double otherwise) { return finite(a) ? a : finite(b) ? b : otherwise; }

}  // namespace

stereo_ekf::past_pose stereo_ekf::state_before(double age_s) const {
  past_pose out;
  const bool rates = constant_velocity();
  out.v_mps = rates ? filter_.head3(kVelocity) : filter_.velocity_of(motion_.steady_v_mps());
  out.w_radps = rates ? filter_.head3(kRates) : filter_.rates_of(motion_.steady_w_radps());
  out.at = filter_.nominal();
  out.R = filter_.R();
  if (age_s != 0.0) {
    const pose3 since = rates
                            ? pose3{age_s * (mean_turn(age_s * out.w_radps) * out.v_mps), turn_by(age_s * out.w_radps)}
                            : motion_.moved_since(age_s);
    out.at.q = normalized(out.at.q * conjugate(since.q));
    out.R = matrix_of(out.at.q);
    out.at.p = out.at.p - out.R * since.p;
  }
  return out;
}

stereo_ekf::past_pose stereo_ekf::state_at_picture() const { return state_before(filter_.head1(kTimeOffset, 0.0)); }

// The pair with the states of its focal lengths and its principal point.
stereo_rig stereo_ekf::rig() const {
  stereo_rig out = rig_;
  if (const int focal = filter_.at(kCameraFocal); focal >= 0) {
    out.fu *= filter_.head(focal);
    out.fv *= filter_.head(focal + 1);
  }
  if (const int centre = filter_.at(kCameraCentre); centre >= 0) {
    out.cu += filter_.head(centre);
    out.cv += filter_.head(centre + 1);
  }
  return out;
}

// Derivatives of a place in the left camera that four pixels give, x = (b (u - c_u) / d, z (v - c_v) / f_v, f_u b / d),
// by those states: with the sign of view_point(), whose derivatives are at a fixed place.
void stereo_ekf::add_lens_columns(const vec3 &x, row_block *out) const {
  const stereo_rig used = rig();
  if (const int focal = filter_.at(kCameraFocal); focal >= 0) {
    const int column = out->add_columns(focal, 2);
    out->by[1][column] = -x.y / filter_.head(focal);
    out->by[2][column] = -x.z / filter_.head(focal);
    out->by[1][column + 1] = x.y / filter_.head(focal + 1);
  }
  if (const int centre = filter_.at(kCameraCentre); centre >= 0) {
    const int column = out->add_columns(centre, 2);
    out->by[0][column] = x.z / used.fu;
    out->by[1][column + 1] = x.z / used.fv;
  }
}

mat3 stereo_ekf::camera_axes() const {
  return rig_.R_base_optical * matrix_of(turn_by(filter_.head3(kCameraRotation)));
}

vec3 stereo_ekf::in_camera(const vec3 &place, const past_pose &past) const {
  const vec3 in_body = transposed_times(past.R, place - past.at.p);
  return transposed_times(camera_axes(), in_body - rig_.place - filter_.head3(kCameraPlace));
}

// x = B'(R'(l - p) - t), B the camera's rotated axes in the body, t its place; A = B' R'.
stereo_ekf::point_view stereo_ekf::view_point(const vec3 &place, const past_pose &past) const {
  point_view out;
  const mat3 Bt = transposed(camera_axes());
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

// Up to four rows, two a picture that shows the point. [BorisovND].
bool stereo_ekf::point_rows(const wm_stereo &seen, const vec3 &place, double place_sigma_m, int slot,
                            const past_pose &past, row_block *out) const {
  point_view view = view_point(place, past);
  if (!(view.x.z > kNearest_m)) return false;
  if (slot >= 0) put(&view.by, 0, view.by.add_columns(filter_.point_state(slot), 3), view.A);
  const int focal_state = filter_.at(kCameraFocal), centre_state = filter_.at(kCameraCentre);
  const int focal = focal_state >= 0 ? view.by.add_columns(focal_state, 2) : -1;
  const int centre = centre_state >= 0 ? view.by.add_columns(centre_state, 2) : -1;
  double px[4], by[4][3];
  const stereo_rig used = rig();
  used.see(view.x, px, by);
  const double observed[4] = {seen.left_px[0], seen.left_px[1], seen.right_px[0], seen.right_px[1]};
  out->columns = view.by.columns;
  out->without_room = view.by.without_room;
  std::memcpy(out->index, view.by.index, sizeof out->index);
  for (int k = 0; k < 4; k++) {
    if (std::isnan(observed[k])) continue;
    const double slope = by[k][0] * by[k][0] + by[k][1] * by[k][1] + by[k][2] * by[k][2];
    const int row = out->add_row(WM_RESIDUAL_PIXEL, observed[k], observed[k] - px[k],
                                 square(sigma_px_[k]) + square(place_sigma_m) * slope);
    for (int c = 0; c < out->columns; c++)
      out->by[row][c] = by[k][0] * view.by.by[0][c] + by[k][1] * view.by.by[1][c] + by[k][2] * view.by.by[2][c];
    const int axis = k & 1;  // across, down
    if (focal >= 0)
      out->by[row][focal + axis] = (px[k] - (axis ? used.cv : used.cu)) / filter_.head(focal_state + axis);
    if (centre >= 0) out->by[row][centre + axis] = 1.0;
  }
  return true;
}

// Specific force at rest, R'g z + bias; R_true = Exp(dr) R changes it by g R'(z x dr).
row_block stereo_ekf::gravity_rows(const vec3 &force, const double variance[3]) const {
  row_block out;
  const mat3 Rt = transposed(filter_.R());
  const vec3 up = kGravity_mps2 * (Rt * vec3{0, 0, 1}), bias = filter_.head3(kForceBias);
  const mat3 by_turn = kGravity_mps2 * (Rt * skew(vec3{0, 0, 1}));
  const int turn = out.add_columns(kTurn, 3), own = out.add_columns(filter_.at(kForceBias), 3);
  for (int i = 0; i < 3; i++) {
    const int row = out.add_row(WM_RESIDUAL_X, force[i], force[i] - up[i] - bias[i], variance[i]);
    for (int j = 0; j < 3; j++) out.by[row][turn + j] = by_turn.m[i][j];
    out.by[row][own + i] = 1.0;
  }
  return out;
}

// Columns of the pose: `by_end`, derivatives by the end of `arm` (in the body) in map; `by_turn`, by a rotation of the
// body about that end.
void stereo_ekf::add_pose_columns(row_block *block, const past_pose &past, const vec3 &arm, const double (*by_end)[3],
                                  const double (*by_turn)[3]) const {
  const mat3 lever = -1.0 * skew(past.at.p + past.R * arm - filter_.nominal().p);
  const int place = block->add_columns(kPlace, 3), turn = block->add_columns(kTurn, 3);
  for (int k = 0; k < block->rows; k++)
    for (int j = 0; j < 3; j++) {
      block->by[k][place + j] = by_end[k][j];
      block->by[k][turn + j] =
          by_end[k][0] * lever.m[0][j] + by_end[k][1] * lever.m[1][j] + by_end[k][2] * lever.m[2][j] + by_turn[k][j];
    }
}

void stereo_ekf::add_bias_column(row_block *block, int row, head_state which) const {
  if (filter_.at(which) >= 0) block->by[row][block->add_columns(filter_.at(which), 1)] = 1.0;
}

// Acoustic range to a beacon, and the azimuth of a landmark in the sensor's axes. False: too near to the sensor or to
// its vertical axis.
bool stereo_ekf::sighting_rows(const wm_sighting &s, int landmark, int slot, row_block *out) const {
  const wm_sensor &sensor = setup_->sensors[s.sensor];
  const wm_landmark &known = setup_->landmarks[landmark];
  const past_pose past = state_before(0.0);
  const vec3 arm = vec_of(sensor.mounting.xyz_m);
  const vec3 target = slot >= 0 ? filter_.point(slot) : vec_of(known.p_m);
  const vec3 to = target - past.at.p - past.R * arm;
  const double distance = length(to), map = slot >= 0 ? 0.0 : map_sigma(known);
  if (!(distance > kNearest_m)) return false;
  double by_end[2][3] = {}, by_turn[2][3] = {};
  if (!std::isnan(s.range_m)) {
    const double sigma = first_finite(s.range_sigma_m, sensor.range_sigma_m, setup_->sightings->range_sigma_default_m);
    const int row = out->add_row(WM_RESIDUAL_RANGE, s.range_m, s.range_m - distance - filter_.head1(kRangeBias, 0.0),
                                 square(sigma) + square(map));
    for (int j = 0; j < 3; j++) by_end[row][j] = -to[j] / distance;
  }
  if (!std::isnan(s.bearing_rad)) {
    const mat3 S = matrix_of_rpy(sensor.mounting.rpy_rad);
    const vec3 x = transposed_times(S, transposed_times(past.R, to));
    const double q = x.x * x.x + x.y * x.y;
    if (!(q > square(kNearest_m))) return false;
    const double sigma =
        first_finite(s.bearing_sigma_rad, sensor.bearing_sigma_rad, setup_->sightings->bearing_sigma_default_rad);
    const int row = out->add_row(WM_RESIDUAL_BEARING, s.bearing_rad,
                                 wrap(s.bearing_rad - atan2(x.y, x.x) - filter_.head1(kBearingBias, 0.0)),
                                 square(sigma) + square(map) / q);
    // The azimuth's gradient in map axes, g. A rotation dr changes x by S'R'(to x dr), the azimuth by dr . (g x to).
    const vec3 gradient = past.R * (S * vec3{-x.y / q, x.x / q, 0.0}), turned = cross(gradient, to);
    for (int j = 0; j < 3; j++) {
      by_end[row][j] = -gradient[j];
      by_turn[row][j] = turned[j];
    }
  }
  add_pose_columns(out, past, arm, by_end, by_turn);
  if (!std::isnan(s.range_m)) add_bias_column(out, 0, kRangeBias);
  if (!std::isnan(s.bearing_rad)) add_bias_column(out, out->rows - 1, kBearingBias);
  if (slot < 0) return true;
  const int column = out->add_columns(filter_.point_state(slot), 3);
  for (int k = 0; k < out->rows; k++)
    for (int j = 0; j < 3; j++) out->by[k][column + j] = -by_end[k][j];
  return true;
}

void stereo_ekf::depth_rows(const wm_position &p, row_block *out) const {
  const double by_end[1][3] = {{0.0, 0.0, 1.0}}, by_turn[1][3] = {};
  (void)out->add_row(WM_RESIDUAL_Z, p.p_m[2], p.p_m[2] - filter_.nominal().p.z, square(p.sigma_z_m));
  add_pose_columns(out, state_before(0.0), {0, 0, 0}, by_end, by_turn);
}

// Coordinates below `last` of a receiver's position: of the antenna a time offset ago, with the receiver's lasting
// error.
void stereo_ekf::position_rows(const wm_position &p, int last, row_block *out) const {
  static constexpr wm_residual kKinds[3] = {WM_RESIDUAL_X, WM_RESIDUAL_Y, WM_RESIDUAL_Z};
  const past_pose past = state_before(filter_.head1(kReceiverOffset, 0.0));
  const vec3 error = filter_.head3(kReceiverError), arm = antenna_m_ + filter_.head3(kAntenna);
  const vec3 place = past.at.p + past.R * arm;
  double by_end[3][3] = {}, lasting_m[3] = {};
  const double by_turn[3][3] = {};
  for (int i = 0; i < last && i < 3; i++) {
    const double stated_m = i == 2 ? p.sigma_z_m : p.sigma_xy_m;
    lasting_m[i] = receiver_.sigma_m() * stated_m / p.sigma_xy_m;
    const int row = out->add_row(kKinds[i], p.p_m[i], p.p_m[i] - place[i] - lasting_m[i] * error[i],
                                 square(white_sigma_m(stated_m, gnss_)));
    by_end[row][i] = 1.0;
  }
  add_pose_columns(out, past, arm, by_end, by_turn);
  if (const int state = filter_.at(kReceiverError); state >= 0)
    for (int i = 0, first = out->add_columns(state, 3); i < last; i++) out->by[i][first + i] = lasting_m[i];
  if (const int state = filter_.at(kAntenna); state >= 0)
    for (int i = 0, first = out->add_columns(state, 3); i < last; i++)
      for (int j = 0; j < 3; j++) out->by[i][first + j] = past.R.m[i][j];
  if (const int state = filter_.at(kReceiverOffset); state >= 0) {
    const vec3 in_body = filter_.velocity_of(motion_.v_mps()) + cross(filter_.rates_of(motion_.w_radps()), arm);
    const vec3 v_mps = past.R * in_body;
    for (int i = 0, column = out->add_columns(state, 1); i < last; i++) out->by[i][column] = -v_mps[i];
  }
}

// Azimuth of the x axis ahead, n: dr rotates it by dr x n. False while it points up or down.
bool stereo_ekf::heading_rows(const wm_heading &h, row_block *out) const {
  const mat3 &R = filter_.R();
  const vec3 nose = {R.m[0][0], R.m[1][0], R.m[2][0]};
  const double level2 = nose.x * nose.x + nose.y * nose.y;
  if (!(level2 > square(kLevelMin))) return false;
  out->add_row(WM_RESIDUAL_HEADING, h.heading_rad,
               wrap(h.heading_rad - atan2(nose.y, nose.x) - filter_.head1(kBearingBias, 0.0)), square(h.sigma_rad));
  const int turn = out->add_columns(kTurn, 3);
  out->by[0][turn] = -nose.x * nose.z / level2;
  out->by[0][turn + 1] = -nose.y * nose.z / level2;
  out->by[0][turn + 2] = 1.0;
  add_bias_column(out, 0, kBearingBias);
  return true;
}

namespace {

// Three derivatives of a row, from a column on; -1: none.
void put_row(const double by[3], int row, int column, row_block *out) {
  for (int j = 0; column >= 0 && j < 3; j++) out->by[row][column + j] = by[j];
}

}  // namespace

// A measured velocity (v - r x v)/s + lag dv/dt or measured rates (w - r x w)/s + b + lag dw/dt, by the states v, s, w,
// b, lag and r, the rotation of the twist's axes (and of the velocity's direction): a measured twist that is ahead of
// the vehicle's had its present value a lag ago.
row_block stereo_ekf::twist_rows(head_state which, const vec3 &measured, const vec3 &slope_per_s, const vec3 &variance,
                                 uint32_t axes) const {
  const bool velocity = which == kVelocity;
  const int lag_state = velocity ? kVelocityLag : kRateLag, scale_state = velocity ? kVelocityScale : kRateScale;
  const vec3 now = measured - filter_.head1(lag_state, 0.0) * slope_per_s, state = filter_.head3(which);
  const double scale = filter_.head1(scale_state, 1.0);
  const vec3 bias = velocity ? vec3{0, 0, 0} : filter_.head3(kRateBias);
  row_block out;
  const auto columns_of = [&](int cause, int width) {
    return filter_.at(cause) >= 0 ? out.add_columns(filter_.at(cause), width) : -1;
  };
  const int first = columns_of(which, 3), lag = columns_of(lag_state, 1);
  const int by_scale = columns_of(scale_state, 1), by_bias = velocity ? -1 : columns_of(kRateBias, 3);
  const int by_axes = columns_of(kTwistAxes, 3), by_direction = velocity ? columns_of(kVelocityDirection, 3) : -1;
  const vec3 turned = filter_.head3(kTwistAxes) + (velocity ? filter_.head3(kVelocityDirection) : vec3{0, 0, 0});
  const vec3 seen = (1.0 / scale) * (state - cross(turned, state));
  const mat3 by_state = (1.0 / scale) * (kIdentity3 + -1.0 * skew(turned)), by_turn = (1.0 / scale) * skew(state);
  for (int i = 0; i < 3; i++) {
    if (!(axes & (1u << i))) continue;
    const int row = out.add_row(WM_RESIDUAL_X, now[i], now[i] - (seen[i] + bias[i]), variance[i]);
    put_row(by_state.m[i], row, first, &out);
    put_row(by_turn.m[i], row, by_axes, &out);
    put_row(by_turn.m[i], row, by_direction, &out);
    if (lag >= 0) out.by[row][lag] = slope_per_s[i];
    if (by_scale >= 0) out.by[row][by_scale] = -seen[i] / scale;
    if (by_bias >= 0) out.by[row][by_bias + i] = 1.0;
  }
  return out;
}

}  // namespace wm
