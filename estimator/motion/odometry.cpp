// SPDX-License-Identifier: Apache-2.0
// Dead reckoning in odom, with a short memory, for publishing between what is fused and now.
#include <cstring>

#include "math/se2.hpp"
#include "math/se3.hpp"
#include "motion/front_end.hpp"
#include "motion/spatial.hpp"

struct wm_odometry {
  static constexpr uint32_t kPoints = 256;                     // a power of two
  static constexpr wm_time_ns kSpacing_ns = 4 * WM_NS_PER_MS;  // so the ring is at least a second long

  wm::motion_front_end front;
  wm_motion_calibration calibration;
  wm_odom_point head;  // at the last event
  wm_odom_point ring[kPoints];
  uint64_t count;
  uint64_t points_before_gap;  // points at the beginning of a gap, until a count gives its distance; 0: no gap
  // Only where twists in space come: their history, and the pose that they add up to since the first one.
  wm::spatial_source source;
  wm::spatial_history spatial;
  wm_time_ns spatial_ns;  // of that pose; WM_TIME_NONE: none came
  wm::pose3 pose_odom_base;
};

namespace {

void carry_point(wm_odom_point &point, double dt_s, const wm::motion_twist &twist, const wm::motion_noise &noise) {
  const wm::arc a = wm::make_arc(twist.v * dt_s, twist.u * dt_s, twist.w * dt_s);
  point.pose_odom_base = wm::compose(point.pose_odom_base, {a.x_m, a.y_m, a.turn_rad});
  point.v_mps = twist.v;
  point.side_mps = twist.u;
  point.w_radps = twist.w;
  point.along_var_m2 += noise.distance_m2;
  point.across_var_m2 += noise.lateral_m2;
  point.heading_var_rad2 += noise.rotation_rad2;
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

// Where the motion is unknown, at `fused` and since, its noise begins at `fused`, whose variance it makes larger. By
// the difference of two points it would begin with the silence.
void begin_unknown_at(const wm_odometry *self, const wm_estimate &fused, const wm_odom_point &from, wm_time_ns t_ns,
                      wm_odom_point *to) {
  const double position_m2 = fused.covariance[wm_cov_index(0, 0)] + fused.covariance[wm_cov_index(1, 1)];
  wm_odom_point point = from;
  bool unknown = fused.t_ns >= self->head.t_ns;
  self->front.walk(fused.t_ns, t_ns, self->calibration, position_m2,
                   [&](const wm::motion_segment &piece, const wm::motion_twist &twist, const wm::motion_noise &noise) {
                     unknown = unknown && piece.input.stale;
                     carry_point(point, piece.dt_s, twist, noise);
                   });
  if (!unknown) return;
  to->along_var_m2 = point.along_var_m2;
  to->across_var_m2 = point.across_var_m2;
}

double growth(double from, double to) { return to > from ? to - from : 0.0; }

// Heading of the body's x axis seen from above.
double heading_of(const wm::quat &q) {
  const wm::mat3 R = wm::matrix_of(q);
  return wm::atan2(R.m[1][0], R.m[0][0]);
}

// The body at a time, as seen from where it stands at the newest twist in space.
struct spatial_point {
  wm::pose3 pose;
  wm::spatial_twist twist;
  double walk_s3;  // spatial_piece, since the newest twist
};

void feed_spatial(wm_odometry *self, const wm_event &event) {
  const bool quantities = event.kind == WM_EVENT_QUANTITIES;
  if (!quantities && event.kind != WM_EVENT_TWIST6) return;
  wm::spatial_twist twist = {};
  const bool changes = self->source.take(event, &twist);
  // Of quantities, only an IMU's rates beside twists in space.
  if (!changes || (quantities && !(self->source.rates_are_fresh() && self->source.is_held()))) return;
  if (!self->spatial.feed(event.t_ns, twist)) return;
  if (self->spatial_ns != WM_TIME_NONE)
    self->spatial.advance(self->spatial_ns, event.t_ns, [self](const wm::spatial_piece &piece, wm_time_ns) {
      const wm::pose3 step = wm::motion_of(piece.twist.v, piece.twist.w, piece.dt_s);
      self->pose_odom_base = wm::compose(self->pose_odom_base, step);
    });
  self->spatial_ns = event.t_ns;
}

// False: no twists in space, or older than they are remembered.
bool spatial_at(const wm_odometry *self, wm_time_ns t_ns, spatial_point *out) {
  if (self->spatial_ns == WM_TIME_NONE) return false;
  *out = {wm::kNoMotion, self->spatial.sample(0).twist, 0.0};
  if (t_ns > self->spatial_ns) {
    self->spatial.walk(self->spatial_ns, t_ns, [out](const wm::spatial_piece &piece, wm_time_ns) {
      out->pose = wm::compose(out->pose, wm::motion_of(piece.twist.v, piece.twist.w, piece.dt_s));
      out->twist = piece.twist;
      out->walk_s3 += piece.walk_s3;
    });
    return true;
  }
  wm::pose3 since;
  if (!self->spatial.moved_since(wm_seconds_between(t_ns, self->spatial_ns), &since, &out->twist)) return false;
  out->pose = wm::between(since, wm::kNoMotion);
  return true;
}

// Moves mean, covariance and twist of an estimate in space by the motion between two points `dt_s` apart.
void carry_spatial(const wm_motion_params &params, const spatial_point &from, const spatial_point &to, double dt_s,
                   wm_estimate *out) {
  const wm::pose3 start = {wm::vec_of(out->pose_map_base.p_m), wm::quat_of(out->pose_map_base.q_xyzw)};
  wm::matrix<6> by_start, covariance;
  const wm::pose3 end = wm::compose(start, wm::between(from.pose, to.pose), &by_start, nullptr);
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) covariance(i, j) = out->covariance[wm_cov_index(i, j)];
  covariance = wm::transformed(by_start, covariance);
  const double walk_s3 = growth(from.walk_s3, to.walk_s3), white_s = growth(0.0, dt_s);
  const double place_m2 = wm::square(params.noise_speed_mps) * white_s + wm::square(params.noise_hold_mps2) * walk_s3;
  const double rotation_rad2 = wm::square(wm::rate_noise_of(params, wm::kKindMeasured).yaw_rate_radps) * white_s +
                               wm::square(params.noise_hold_radps2) * walk_s3;
  for (int i = 0; i < 6; i++) {
    covariance(i, i) += i < 3 ? place_m2 : rotation_rad2;
    for (int j = 0; j <= i; j++)
      out->covariance[wm_cov_index(i, j)] = out->covariance[wm_cov_index(j, i)] = covariance(i, j);
  }
  for (int i = 0; i < 3; i++) {
    out->pose_map_base.p_m[i] = end.p[i];
    out->pose_map_base.q_xyzw[i] = end.q.v[i];
    out->v_mps[i] = to.twist.v[i];
    out->w_radps[i] = to.twist.w[i];
  }
  out->pose_map_base.q_xyzw[3] = end.q.w;
  out->heading_rad = heading_of(end.q);
}

// The same of an estimate in the plane. `turns`: the way is in the robot's axes, and turns with the heading.
void carry_planar(const wm_odom_point &from, const wm_odom_point &to, wm_estimate *out, bool turns = true) {
  const wm_pose2 step = wm::between(from.pose_odom_base, to.pose_odom_base);
  const wm_pose2 start = {out->pose_map_base.p_m[0], out->pose_map_base.p_m[1], out->heading_rad};
  wm::matrix<3> by_start, covariance, noise;
  const wm_pose2 end = wm::compose(start, step, &by_start, nullptr);
  if (!turns) by_start(0, 2) = by_start(1, 2) = 0.0;
  const int index[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) covariance(i, j) = out->covariance[wm_cov_index(index[i], index[j])];
  // Along and across the chord; a rotation spread evenly over the path moves its end by half of it in the mean.
  const double along = growth(from.along_var_m2, to.along_var_m2);
  const double turn = growth(from.heading_var_rad2, to.heading_var_rad2);
  const double across = growth(from.across_var_m2, to.across_var_m2);
  const double dx = end.x_m - start.x_m, dy = end.y_m - start.y_m;
  const wm::sin_cos h = wm::sincos(start.heading_rad + 0.5 * step.heading_rad);
  const double xx = along * h.cos * h.cos + across * h.sin * h.sin + turn * dy * dy / 3.0;
  const double xy = (along - across) * h.cos * h.sin - turn * dx * dy / 3.0;
  const double yy = along * h.sin * h.sin + across * h.cos * h.cos + turn * dx * dx / 3.0;
  const double xt = -0.5 * dy * turn, yt = 0.5 * dx * turn;
  noise << xx, xy, xt, xy, yy, yt, xt, yt, turn;
  covariance = wm::transformed(by_start, covariance) + noise;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out->covariance[wm_cov_index(index[i], index[j])] = covariance(i, j);

  out->pose_map_base.p_m[0] = end.x_m;
  out->pose_map_base.p_m[1] = end.y_m;
  out->heading_rad = end.heading_rad;
  const wm::sin_cos half = wm::sincos(0.5 * end.heading_rad);
  out->pose_map_base.q_xyzw[0] = out->pose_map_base.q_xyzw[1] = 0.0;
  out->pose_map_base.q_xyzw[2] = half.sin;
  out->pose_map_base.q_xyzw[3] = half.cos;
  out->v_mps[0] = to.v_mps;
  out->v_mps[1] = to.side_mps;
  out->w_radps[2] = to.w_radps;
}

// Without motion data the estimate's own velocity holds and walks; odom stays where it is. In the plane it is one of
// the map's axes, which does not turn with the heading.
void carry_by_own_velocity(const wm_motion_params &params, const wm_estimate *fused, wm_time_ns t_ns, wm_estimate *out,
                           wm_odom_point *odom) {
  const double dt_s = wm_seconds_between(fused->t_ns, t_ns), walked_s3 = growth(0.0, dt_s * dt_s * dt_s / 3.0);
  wm_odom_point from{}, to{};
  to.t_ns = t_ns;
  wm::motion_twist twist{};
  twist.v = fused->v_mps[0], twist.u = fused->v_mps[1], twist.w = fused->w_radps[2];
  wm::motion_noise noise{};
  noise.distance_m2 = noise.lateral_m2 = wm::square(params.velocity_speed_walk) * walked_s3;
  noise.rotation_rad2 = wm::square(params.velocity_turn_walk) * walked_s3;
  carry_point(to, dt_s, twist, noise);
  *out = *fused;
  out->t_ns = t_ns;
  carry_planar(from, to, out, fused->dof == 6);
  if (odom) *odom = {t_ns, {}, twist.v, twist.u, twist.w, 0.0, 0.0, 0.0};
}

}  // namespace

size_t wm_odometry_bytes(void) { return sizeof(wm_odometry); }

wm_status wm_odometry_init(wm_odometry *self, const wm_motion_params *params, const wm_wheels *wheels) {
  std::memset(static_cast<void *>(self), 0, sizeof *self);
  self->front.init(params, wheels);
  self->calibration = wm::kNeutralCalibration;
  self->head.t_ns = self->spatial_ns = WM_TIME_NONE;
  // A twist in space holds as long as a planar one.
  const double after_s = wm::motion_history::kOverdueS;
  self->source.init(params->hold_max_s, {params->standstill_speed_mps, params->standstill_yaw_rate_radps});
  self->spatial.init({after_s, params->hold_max_s, false, params->limits_mps2, params->limits_radps2});
  self->pose_odom_base = wm::kNoMotion;
  return WM_OK;
}

void wm_odometry_calibrate(wm_odometry *self, const wm_motion_calibration *calibration) {
  self->calibration = *calibration;
  self->front.take_commands(calibration->value[WM_TURN_SLOWDOWN] != 0.0);
}

wm_status wm_odometry_feed(wm_odometry *self, const wm_event *event) {
  const wm_status status = self->front.check(*event);
  if (status != WM_OK) return status;
  if (self->front.is_overdue(event->t_ns) && self->points_before_gap == 0) self->points_before_gap = self->count;
  self->front.feed(*event);
  feed_spatial(self, *event);
  wm_odom_point &head = self->head;
  self->front.advance(event->t_ns, self->calibration,
                      [&head](const wm::motion_segment &piece, const wm::motion_twist &twist,
                              const wm::motion_noise &noise) { carry_point(head, piece.dt_s, twist, noise); });
  head.t_ns = event->t_ns;
  if (self->front.counts_wrapped()) self->points_before_gap = 0;
  if (self->points_before_gap > 0 && self->front.counted()) {
    // The counted distance is spread over the gap: a pose fused within it moves by the rest.
    if (self->count - self->points_before_gap < wm_odometry::kPoints) self->count = self->points_before_gap;
    self->points_before_gap = 0;
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
                     [out](const wm::motion_segment &piece, const wm::motion_twist &twist,
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
  if (fused->t_ns == WM_TIME_NONE) return WM_NOT_FOUND;  // nothing was fused yet
  if (self->front.model() == WM_MOTION_CONSTANT_VELOCITY) {
    carry_by_own_velocity(self->front.params(), fused, t_ns, out, odom);
    return WM_OK;
  }
  wm_odom_point from, to;
  wm_status status = wm_odometry_at(self, fused->t_ns, &from);
  if (status == WM_OK) status = wm_odometry_at(self, t_ns, &to);
  if (status != WM_OK) return status;
  if (self->front.is_overdue(fused->t_ns)) begin_unknown_at(self, *fused, from, t_ns, &to);
  *out = *fused;
  out->t_ns = t_ns;
  if (odom) *odom = to;
  spatial_point spatial_from, spatial_to;
  if (fused->dof != 6 || !spatial_at(self, fused->t_ns, &spatial_from) || !spatial_at(self, t_ns, &spatial_to)) {
    carry_planar(from, to, out);
    return WM_OK;
  }
  carry_spatial(self->front.params(), spatial_from, spatial_to, wm_seconds_between(fused->t_ns, t_ns), out);
  if (odom) {  // projected to the plane, so that map and odom move alike for a vehicle that swims sideways or pitches
    const wm::pose3 pose = wm::compose(self->pose_odom_base, spatial_to.pose);
    odom->pose_odom_base = {pose.p.x, pose.p.y, heading_of(pose.q)};
  }
  return WM_OK;
}

wm_pose2 wm_odometry_jump(const wm_pose2 *map_before, const wm_pose2 *odom_before, const wm_pose2 *map_now,
                          const wm_pose2 *odom_now) {
  return wm::between(wm::compose(*map_before, wm::between(*odom_before, *odom_now)), *map_now);
}
