// SPDX-License-Identifier: Apache-2.0
// Dead reckoning in odom, with a short memory, for publishing between what is fused and now.
#include <cstring>

#include "math/arc.hpp"
#include "math/rotation.hpp"
#include "motion/front_end.hpp"

namespace {

// Where a twist in space began to hold, in an odometry's frame of its own.
struct space_point {
  wm_time_ns t_ns;
  wm::vec3 p;
  wm::quat q;
  wm::vec3 v_mps, w_radps;
};

}  // namespace

struct wm_odometry {
  static constexpr uint32_t kPoints = 256;                     // a power of two
  static constexpr wm_time_ns kSpacing_ns = 4 * WM_NS_PER_MS;  // so the ring is at least a second long

  wm::motion_front_end front;
  wm_motion_calibration calibration;
  wm_odom_point head;  // at the last event
  wm_odom_point ring[kPoints];
  uint64_t count;
  uint64_t before_silence;     // points when the inputs fell silent, until a count tells the way since; 0: they didn't
  space_point space[kPoints];  // only where twists in space come
  uint64_t space_count;
};

namespace {

void carry_point(wm_odom_point &point, double dt_s, const wm::motion_twist &twist, const wm::motion_noise &noise) {
  const wm::arc a = wm::make_arc(twist.v * dt_s, twist.w * dt_s);
  point.pose_odom_base = wm::compose(point.pose_odom_base, {a.x_m, a.y_m, a.turn_rad});
  point.v_mps = twist.v;
  point.w_radps = twist.w;
  point.along_var_m2 += noise.way_m2;
  point.across_var_m2 += noise.side_m2;
  point.heading_var_rad2 += noise.turn_rad2;
}

wm_odom_point interpolate(const wm_odom_point &a, const wm_odom_point &b, wm_time_ns t_ns) {
  const double share = wm_seconds_between(a.t_ns, t_ns) / wm_seconds_between(a.t_ns, b.t_ns);
  wm_odom_point out = b;  // the twist between two points is stored with the later one
  out.t_ns = t_ns;
  out.pose_odom_base =
      wm::compose(a.pose_odom_base, wm::part_of(wm::between(a.pose_odom_base, b.pose_odom_base), share));
  out.along_var_m2 = a.along_var_m2 + share * (b.along_var_m2 - a.along_var_m2);
  out.across_var_m2 = a.across_var_m2 + share * (b.across_var_m2 - a.across_var_m2);
  out.heading_var_rad2 = a.heading_var_rad2 + share * (b.heading_var_rad2 - a.heading_var_rad2);
  return out;
}

space_point carried(const space_point &from, wm_time_ns t_ns) {
  const double dt_s = wm_seconds_between(from.t_ns, t_ns);
  space_point out = from;
  out.t_ns = t_ns;
  out.p = from.p + wm::matrix_of(from.q) * (dt_s * (wm::mean_turn(dt_s * from.w_radps) * from.v_mps));
  out.q = wm::normalized(from.q * wm::turn_by(dt_s * from.w_radps));
  return out;
}

void feed_space(wm_odometry *self, const wm_event &event) {
  const uint64_t n = self->space_count;
  space_point now = {event.t_ns, {0, 0, 0}, wm::kNoTurn, {}, {}};
  if (n > 0) now = carried(self->space[(n - 1) % wm_odometry::kPoints], event.t_ns);
  now.v_mps = wm::vec_of(event.as.twist6.v_mps);
  now.w_radps = wm::vec_of(event.as.twist6.w_radps);
  self->space[n % wm_odometry::kPoints] = now;
  self->space_count = n + 1;
}

bool space_at(const wm_odometry *self, wm_time_ns t_ns, space_point *out) {
  const uint64_t n = self->space_count, oldest = n > wm_odometry::kPoints ? n - wm_odometry::kPoints : 0;
  for (uint64_t i = n; i > oldest; i--) {
    const space_point &point = self->space[(i - 1) % wm_odometry::kPoints];
    if (point.t_ns > t_ns) continue;
    *out = carried(point, t_ns);
    return true;
  }
  return false;
}

// p' = p + R D, R' = R T: dp' = dp - R (D x r), r' = T' r, with r in the body's axes; and noise on the way.
void carry_space(const wm_odometry *self, const space_point &from, const space_point &to, wm_estimate *out) {
  const wm::quat start = wm::quat_of(out->pose_map_base.q_xyzw);
  const wm::mat3 R = wm::matrix_of(start);
  const wm::vec3 moved = wm::transposed_times(wm::matrix_of(from.q), to.p - from.p);
  const wm::quat turned = wm::normalized(wm::conjugate(from.q) * to.q);
  const wm::vec3 place = wm::vec_of(out->pose_map_base.p_m) + R * moved;
  const wm::quat q = wm::normalized(start * turned);
  const wm::mat3 lever = -1.0 * (R * wm::skew(moved)), turn = wm::transposed(wm::matrix_of(turned));
  double f[6][6] = {}, half[6][6], carried_cov[6][6];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      f[i][j] = i == j;
      f[i][3 + j] = lever.m[i][j];
      f[3 + i][3 + j] = turn.m[i][j];
    }
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) {
      half[i][j] = 0.0;
      for (int k = 0; k < 6; k++) half[i][j] += f[i][k] * out->covariance[wm_cov_index(k, j)];
    }
  for (int i = 0; i < 6; i++)
    for (int j = i; j < 6; j++) {
      carried_cov[i][j] = 0.0;
      for (int k = 0; k < 6; k++) carried_cov[i][j] += half[i][k] * f[j][k];
    }
  const double dt_s = wm_seconds_between(from.t_ns, to.t_ns);
  const wm_motion_params &params = self->front.params();
  const double grown[2] = {wm::square(params.noise_speed_mps) * dt_s, wm::square(params.noise_yaw_rate_radps) * dt_s};
  for (int i = 0; i < 6; i++)
    for (int j = i; j < 6; j++) {
      if (i == j && dt_s > 0.0) carried_cov[i][i] += grown[i / 3];
      out->covariance[wm_cov_index(i, j)] = out->covariance[wm_cov_index(j, i)] = carried_cov[i][j];
    }
  for (int i = 0; i < 3; i++) {
    out->pose_map_base.p_m[i] = place[i];
    out->pose_map_base.q_xyzw[i] = q.v[i];
    out->v_mps[i] = to.v_mps[i];
    out->w_radps[i] = to.w_radps[i];
  }
  out->pose_map_base.q_xyzw[3] = q.w;
  const wm::mat3 end = wm::matrix_of(q);
  out->heading_rad = wm::atan2(end.m[1][0], end.m[0][0]);
}

double growth(double from, double to) { return to > from ? to - from : 0.0; }

}  // namespace

size_t wm_odometry_bytes(void) { return sizeof(wm_odometry); }

wm_status wm_odometry_init(wm_odometry *self, const wm_motion_params *params, const wm_wheels *wheels) {
  std::memset(static_cast<void *>(self), 0, sizeof *self);
  self->front.init(params, wheels);
  self->calibration = wm::kNeutralCalibration;
  self->head.t_ns = WM_TIME_NONE;
  return WM_OK;
}

void wm_odometry_calibrate(wm_odometry *self, const wm_motion_calibration *calibration) {
  self->calibration = *calibration;
}

wm_status wm_odometry_feed(wm_odometry *self, const wm_event *event) {
  const wm_status status = self->front.check(*event);
  if (status != WM_OK) return status;
  if (self->front.is_overdue(event->t_ns) && self->before_silence == 0) self->before_silence = self->count;
  self->front.feed(*event);
  if (event->kind == WM_EVENT_TWIST6) feed_space(self, *event);
  wm_odom_point &head = self->head;
  self->front.advance(event->t_ns, self->calibration,
                      [&head](const wm::motion_stretch &piece, const wm::motion_twist &twist,
                              const wm::motion_noise &noise) { carry_point(head, piece.dt_s, twist, noise); });
  head.t_ns = event->t_ns;
  if (self->before_silence > 0 && self->front.counted()) {
    // The way of the silence is spread over it: a pose that was fused within it is carried on by what is left.
    if (self->count - self->before_silence < wm_odometry::kPoints) self->count = self->before_silence;
    self->before_silence = 0;
  }
  const uint64_t n = self->count;
  if (n == 0 || head.t_ns - self->ring[(n - 1) % wm_odometry::kPoints].t_ns >= wm_odometry::kSpacing_ns) {
    self->ring[n % wm_odometry::kPoints] = head;
    self->count = n + 1;
  }
  return WM_OK;
}

wm_time_ns wm_odometry_newest_ns(const wm_odometry *self) { return self->front.newest_ns(); }

wm_status wm_odometry_at(const wm_odometry *self, wm_time_ns t_ns, wm_odom_point *out) {
  if (self->count == 0 || self->front.newest_ns() == WM_TIME_NONE) return WM_NOT_FOUND;
  if (t_ns >= self->head.t_ns) {
    *out = self->head;
    self->front.walk(self->head.t_ns, t_ns, self->calibration,
                     [out](const wm::motion_stretch &piece, const wm::motion_twist &twist,
                           const wm::motion_noise &noise) { carry_point(*out, piece.dt_s, twist, noise); });
    out->t_ns = t_ns;
    return WM_OK;
  }
  const uint64_t oldest = self->count > wm_odometry::kPoints ? self->count - wm_odometry::kPoints : 0;
  const wm_odom_point *later = &self->head;
  for (uint64_t i = self->count; i > oldest; i--) {
    const wm_odom_point *point = &self->ring[(i - 1) % wm_odometry::kPoints];
    if (point->t_ns == t_ns) {
      *out = *point;
      return WM_OK;
    }
    if (point->t_ns < t_ns) {
      *out = interpolate(*point, *later, t_ns);
      return WM_OK;
    }
    later = point;
  }
  return WM_NOT_FOUND;
}

wm_status wm_odometry_carry(const wm_odometry *self, const wm_estimate *fused, wm_time_ns t_ns, wm_estimate *out,
                            wm_odom_point *odom) {
  wm_odom_point from, to;
  wm_status status = wm_odometry_at(self, fused->t_ns, &from);
  if (status == WM_OK) status = wm_odometry_at(self, t_ns, &to);
  if (status != WM_OK) return status;
  space_point space_from, space_to;
  if (fused->dof == 6 && space_at(self, fused->t_ns, &space_from) && space_at(self, t_ns, &space_to)) {
    *out = *fused;
    out->t_ns = t_ns;
    carry_space(self, space_from, space_to, out);
    if (odom) {
      // Seen from above: so that map and odom move alike for a vehicle that swims sideways or noses up.
      const wm::mat3 R = wm::matrix_of(space_to.q);
      *odom = to;
      odom->pose_odom_base = {space_to.p.x, space_to.p.y, wm::atan2(R.m[1][0], R.m[0][0])};
    }
    return WM_OK;
  }
  const wm_pose2 step = wm::between(from.pose_odom_base, to.pose_odom_base);
  const wm_pose2 start = {fused->pose_map_base.p_m[0], fused->pose_map_base.p_m[1], fused->heading_rad};
  const wm_pose2 end = wm::compose(start, step);
  const double dx = end.x_m - start.x_m, dy = end.y_m - start.y_m;

  *out = *fused;
  out->t_ns = t_ns;
  out->pose_map_base.p_m[0] = end.x_m;
  out->pose_map_base.p_m[1] = end.y_m;
  out->heading_rad = end.heading_rad;
  const wm::sin_cos half = wm::sincos(0.5 * end.heading_rad);
  out->pose_map_base.q_xyzw[0] = out->pose_map_base.q_xyzw[1] = 0.0;
  out->pose_map_base.q_xyzw[2] = half.sin;
  out->pose_map_base.q_xyzw[3] = half.cos;
  out->v_mps[0] = to.v_mps;
  out->w_radps[2] = to.w_radps;

  // F = [1 0 -dy; 0 1 dx; 0 0 1]: a heading error at the start swings the way (paper, system 1, F).
  const double *p = fused->covariance;
  double xx = p[wm_cov_index(0, 0)], xy = p[wm_cov_index(0, 1)], yy = p[wm_cov_index(1, 1)];
  double xt = p[wm_cov_index(0, 5)], yt = p[wm_cov_index(1, 5)], tt = p[wm_cov_index(5, 5)];
  xx += -2.0 * dy * xt + dy * dy * tt;
  xy += dx * xt - dy * yt - dx * dy * tt;
  yy += 2.0 * dx * yt + dx * dx * tt;
  xt += -dy * tt;
  yt += dx * tt;
  // Noise on the way: along and across the chord; a turn made evenly on the way swings what is left of it.
  const double along = growth(from.along_var_m2, to.along_var_m2);
  const double turn = growth(from.heading_var_rad2, to.heading_var_rad2);
  const double across = growth(from.across_var_m2, to.across_var_m2);
  const wm::sin_cos h = wm::sincos(start.heading_rad + 0.5 * step.heading_rad);
  xx += along * h.cos * h.cos + across * h.sin * h.sin + turn * dy * dy / 3.0;
  xy += (along - across) * h.cos * h.sin - turn * dx * dy / 3.0;
  yy += along * h.sin * h.sin + across * h.cos * h.cos + turn * dx * dx / 3.0;
  xt += -0.5 * dy * turn;
  yt += 0.5 * dx * turn;
  tt += turn;
  const int index[3] = {0, 1, 5};
  const double planar[3][3] = {{xx, xy, xt}, {xy, yy, yt}, {xt, yt, tt}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out->covariance[wm_cov_index(index[i], index[j])] = planar[i][j];
  if (odom) *odom = to;
  return WM_OK;
}
