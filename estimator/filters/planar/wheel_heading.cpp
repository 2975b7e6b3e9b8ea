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

// Innovations in a window: 4 m. Slip lasts for longer: a tyre's load in a bend, a wet stretch. 8 m learn half as fast.
constexpr int kWindow = 8;
// Each window moves the logarithm of the walk by its normalised sum's square against kWhite. White sums have 1. Slip's
// count as kMostSquare at most: it raises the walk from the least to the most in six windows. The least lies five steps
// below 0, where 2 % of the windows of white innovations are above it. The most is 0.01 per sqrt(m) by the default.
constexpr double kWhite = 1.5, kMostSquare = 9.0, kStep = 0.3, kLeastLog = -1.5, kMostLog = 6.9;

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
  log_walk_ = kLeastLog;
  sum_ = 0.0;
  in_window_ = 0;
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
  const double walk = log_walk_ > 0.0 ? walk_ * exp(log_walk_) : walk_;
  filter.carry_state(difference_, {}, 0.0, square(walk) * 0.5 * driven_m);
}

bool wheel_heading::fuse_gyro_heading(planar_filter &filter, const motion_front_end &front) {
  planar_row row;
  row.add(kHeading, 1.0);
  row.add(heading_, -1.0);
  const double variance = filter.variance_of(row);
  const double apart = wrap(filter.value(heading_) - filter.value(kHeading)), noise = rounding_rad2(filter, front);
  note_innovation(apart / std::sqrt(variance + noise));
  if (square(apart) > kSlip_nis * (variance + noise)) return false;
  return filter.update(row, apart, noise);
}

void wheel_heading::note_innovation(double normalised) {
  sum_ += normalised;
  if (++in_window_ < kWindow) return;
  const double square_of_sum = sum_ * sum_ / kWindow;
  log_walk_ += kStep * ((square_of_sum < kMostSquare ? square_of_sum : kMostSquare) / kWhite - 1.0);
  log_walk_ = log_walk_ < kLeastLog ? kLeastLog : log_walk_ > kMostLog ? kMostLog : log_walk_;
  sum_ = 0.0;
  in_window_ = 0;
}

}  // namespace wm
