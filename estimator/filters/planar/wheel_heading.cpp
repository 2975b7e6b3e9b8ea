// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/wheel_heading.hpp"

#include "filters/planar/planar_filter.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

// Distance between two such measurements: short, so that the gyro's noise in between is small, and many counts long, so
// that their rounding is independent. Not swept.
constexpr double kFuseEvery_m = 0.5;
// A slip is a difference above four sigma; less is within the noise of the ticks.
constexpr double kSlip_nis = 16.0;
// Three sigma of two roundings, one at each end.
constexpr double kTurn_nis = 2.0 * 9.0;
constexpr uint32_t kNotTrusted =
    WM_MOTION_HEALTH_ENCODER_LEFT_DEAD | WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD | WM_MOTION_HEALTH_COUNTER_FROZEN;

double track_m(const planar_filter &filter, const motion_front_end &front) {
  return front.wheels().track_m * filter.calibration().value[kTrackScale];
}

// Each of the two counts is rounded to a tick, evenly: a twelfth of its square.
double rounding_rad2(const planar_filter &filter, const motion_front_end &front) {
  const double tick_m = kTwoPi * front.wheels().radius_m / front.wheels().ticks_per_turn;
  return square(tick_m / track_m(filter, front)) / 6.0;
}

}  // namespace

void wheel_heading::init(planar_filter &filter, const wm_motion_states &states) {
  heading_ = difference_ = -1;
  running_ = false;
  if (count_states(states) == 0) return;
  walk_ = states.wheel_difference_walk;
  difference_ = filter.add_state(0.0, states.wheel_difference_sigma);
  heading_ = filter.add_state(0.0, 0.0);
}

void wheel_heading::update(planar_filter &filter, const motion_front_end &front) {
  if (heading_ < 0 || !(front.wheels().track_m > 0.0)) return;
  if (front.model() != WM_MOTION_SPEED_YAW_RATE || (front.health() & kNotTrusted) ||
      filter.before_start(filter.now_ns())) {
    running_ = false;
    return;
  }
  if (front.counts_wrapped()) running_ = false;
  double distance_m[2];
  if (!front.wheel_distances(distance_m)) return;
  if (running_) {
    const double left = distance_m[0] - distance_m_[0], right = distance_m[1] - distance_m_[1];
    if (std::fabs(left) + std::fabs(right) < 2.0 * kFuseEvery_m) return;
    propagate(filter, front, left, right);
    running_ = fuse_gyro_heading(filter, front);
  }
  if (!running_) filter.copy_state(heading_, kHeading, rounding_rad2(filter, front));
  running_ = true;
  distance_m_[0] = distance_m[0];
  distance_m_[1] = distance_m[1];
}

// turn = ((1 + e_r) r - (1 + e_l) l) / b = k (r - l + d (r + l)/2) / b, k the speed's scale: scale and track act on the
// turn alone, d on the distance alone. A turn within the rounding has no derivative by scale and track: it is the noise
// that the next measurement contains, and a derivative correlated with it would find a scale in it.
void wheel_heading::propagate(planar_filter &filter, const motion_front_end &front, double left_m, double right_m) {
  const wm_motion_calibration &c = filter.calibration();
  const double track = track_m(filter, front), middle_m = 0.5 * (left_m + right_m);
  const double turn = c.value[kSpeedScale] * (right_m - left_m + filter.value(difference_) * middle_m) / track;
  planar_row by;
  if (square(turn) > kTurn_nis * rounding_rad2(filter, front)) {
    by.add(filter.motion_state(kSpeedScale), turn / c.value[kSpeedScale]);
    by.add(filter.motion_state(kTrackScale), -turn / c.value[kTrackScale]);
  }
  by.add(difference_, c.value[kSpeedScale] * middle_m / track);
  const double driven_m = std::fabs(left_m) + std::fabs(right_m);
  filter.carry_state(heading_, by, turn, square(front.params().noise_ticks_per_sqrt_m / track) * driven_m);
  filter.carry_state(difference_, {}, 0.0, square(walk_) * 0.5 * driven_m);
}

bool wheel_heading::fuse_gyro_heading(planar_filter &filter, const motion_front_end &front) {
  planar_row row;
  row.add(kHeading, 1.0);
  row.add(heading_, -1.0);
  projection projected;
  filter.project(row, &projected);
  const double apart = wrap(filter.value(heading_) - filter.value(kHeading)), noise = rounding_rad2(filter, front);
  if (square(apart) > kSlip_nis * (projected.variance + noise)) return false;
  return filter.update(projected, apart, noise);
}

}  // namespace wm
