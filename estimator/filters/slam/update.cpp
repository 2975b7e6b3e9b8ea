// SPDX-License-Identifier: Apache-2.0
// From the rows of an observation to its update, or to a new landmark.
#include <utility>

#include "filters/slam/slam.hpp"

namespace wm {

// Each picture's stamp has an error of its own, the same for all that is seen in it.
void slam::begin_picture(int sensor, wm_time_ns t_ns) {
  if (stamp_state_[sensor] < 0 || picture_ns_[sensor] == t_ns) return;
  picture_ns_[sensor] = t_ns;
  joint_.forget(stamp_state_[sensor], 0.0, square(params_.sensor_stamp_sigma_s));
}

past_pose slam::look_back(int sensor) const {
  const int slot = slots_.at(sensor, kTimeOffset), stamp = stamp_state_[sensor];
  const double offset_s = slot < 0 ? 0.0 : joint_.value(slot), stamp_error_s = stamp < 0 ? 0.0 : joint_.value(stamp);
  past_pose out = pose_before(joint_, offset_s + stamp_error_s);
  out.stamp_slot = stamp;
  return out;
}

sensor_errors slam::errors_of(int sensor) const {
  return slots_.errors(sensor, [this](int slot) { return joint_.value(slot); });
}

wm_pose2 slam::sensor_pose(int sensor, const past_pose &past) const {
  const mounted_sensor &m = sensor_[sensor];
  const sensor_errors e = errors_of(sensor);
  return compose(past.pose, {m.x_m + e[kMountX], m.y_m + e[kMountY], m.yaw_rad + e[kYaw]});
}

// P_tt and P_rt are those of the landmark's place in base_link.
slam::relative_place slam::relative_place_of(const context &at, int landmark) const {
  const wm_pose2 from = sensor_pose(at.sensor, at.past), place = pose_of(landmark);
  const double dx = place.x_m - from.x_m, dy = place.y_m - from.y_m, distance2 = dx * dx + dy * dy;
  if (!(distance2 > square(kOnSensor_m))) return {std::sqrt(distance2), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const double distance = std::sqrt(distance2), along[2] = {dx / distance, dy / distance};
  const int state = joint_.landmark_state(landmark);
  joint_row r, t, heading;
  heading.add(kHeading, 1.0);
  for (int k = 0; k < 2; k++) {
    const double across = k == 0 ? -along[1] : along[0];
    const int own = k == 0 ? kX : kY;
    r.add(state + k, along[k]);
    r.add(own, -along[k]);
    t.add(state + k, across);
    t.add(own, -across);
  }
  t.add(kHeading, -distance);
  return {distance,
          joint_.variance_of(r),
          joint_.variance_of(t),
          joint_.covariance_of(r, t),
          joint_.variance_of(heading),
          joint_.covariance_of(heading, r),
          joint_.covariance_of(heading, t)};
}

// The states of this sensor's time-correlated error on this landmark, decayed to now. -1: none is carried.
int slam::lend(const context &at) {
  const int64_t key = static_cast<int64_t>(at.id) * kSlamSensors + at.sensor;
  const double tau_s = sightings().correlated_tau_s, taus_s[] = {tau_s, tau_s};
  return errors_.lend(&joint_, key, error_.width, taus_s, 0.0, joint_.now_ns());
}

// Completes the rows by the landmark's own derivatives; S and the NIS of all rows together.
innovation slam::prepare(int landmark, landmark_rows *v) {
  const int state = joint_.landmark_state(landmark);
  for (int i = 0; i < v->count; i++)
    for (int k = 0; k < 3; k++) v->row[i].add(state + k, v->by_landmark[i][k]);  // 0 beyond the landmark's width
  return joint_.prepare(v->row, v->innovation, v->noise, v->count);
}

// Fuses what passed the gate and writes the records: WM_FUSED, WM_REJECTED_GATE or WM_REJECTED_NUMERIC.
wm_verdict slam::fuse_rows(const context &at, const landmark_rows &v, const gate_result &g, innovation *block,
                           int unknown) {
  record_list records = at.records;
  double variance[3], added[3];
  for (int i = 0; i < v.count; i++) {
    variance[i] = block->s[i][i];
    added[i] = v.noise[i] * (g.noise_scale - 1.0);
  }
  wm_verdict verdict = g.passed ? WM_FUSED : WM_REJECTED_GATE;
  const joint_state::scope now = scope_now();
  const joint_state::scope which =
      unknown >= 0 && now == joint_state::scope::all ? joint_state::scope::directions : now;
  if (!(block->determinant > 0.0) || (g.passed && !joint_.fuse(std::move(*block), added, which, unknown)))
    verdict = WM_REJECTED_NUMERIC;
  for (int i = 0; i < v.count; i++) {
    wm_innovation record = at.record;
    record.residual = static_cast<uint8_t>(v.kind[i]);
    record.observed = v.observed[i];
    record.expected = v.expected[i];
    put_gate(g, v.count, variance[i], verdict, &record);
    records.add(record);
  }
  return verdict;
}

// A new landmark [FengND, "new marker"]: 0 = H_x dx + H_l dl + v, so dl = -H_l^-1 (H_x dx + v), and P_ll = G_x P G_x' +
// G_z R G_z' with all cross terms. `inverse`: H_l^-1.
int slam::join(const context &at, const landmark_rows &v, const double inverse[3][3], const double place[3],
               double heading_variance) {
  joint_row rows[3];
  double noise[3][3] = {};
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < v.count; i++) {
      rows[k].add(v.row[i], -inverse[k][i]);
      for (int l = 0; l < 3; l++) noise[k][l] += inverse[k][i] * v.noise[i] * inverse[l][i];
    }
  noise[2][2] += heading_variance;
  life_.fused(joint_.now_ns());
  return note_landmark(at.id, joint_.add_landmark(rows, noise, place), at.sensor);
}

}  // namespace wm
