// SPDX-License-Identifier: Apache-2.0
#include "filters/core/wheel_check.hpp"

#include <cmath>
#include <cstring>

namespace wm {
namespace {

// Prior of the speed's error on each axis: of a robot at walking pace that stands, or is pushed, m/s.
constexpr double kOff_mps = 0.5;
// Time constants of the sums: a hole is reported within 3 s. Where positions come often, the last second decides.
constexpr double kWindow_s = 2.0, kLate_s = 1.0;
// The scale of innovations follows what no error of the speed explains, over so many of them: a minute of positions. It
// is known as by some more of them than a window has.
constexpr double kScaleFrom = 300.0, kScaleCount = 30.0;
constexpr double kMost = 5.0;     // sigmas: a larger innovation counts as this, an outlier is no evidence of a speed
constexpr double kApart_s = 0.2;  // observations nearer in time share their errors
// Log odds that wheels have begun to lie in a window: one in 3000, once in an hour. They are taken to from an even
// chance on; while they are, both are as probable until the evidence is for one of them.
constexpr double kRate = -8.0, kBegins_nats = -kRate, kEnds_nats = 0.0;
// So long no more than chance explains was there before: a pose that is wrong from its start is no fault of the wheels.
constexpr double kFitted_s = 5.0, kChance_nats = 2.0;
constexpr double kForgotten_s = 10.0;  // without evidence for so long it holds no more
// Of the faster one's speed: the robot, or the wheels, stand or nearly. That of the robot is the less sure one.
constexpr double kRobotStands = 0.6, kWheelsStand = 0.4;
// Of a wheel that spins, by the gyro: log odds at first, the rate at which it begins, and the most that a comparison
// counts for, nats. It holds from 88 % on, and no longer at 12 %.
constexpr double kSpinHazard_per_s = 1e-4, kSpinMost = 4.0, kSpinHolds = 2.0;

double clipped(double value, double most) { return value > most ? most : value < -most ? -most : value; }

}  // namespace

void wheel_check::init() {
  *this = {};
  scale2_ = 1.0;
  weighed_ns_ = WM_TIME_NONE;
  spin_.reset(kRate);
}

void wheel_check::restart() {
  std::memset(by_, 0, sizeof by_);
  added_m2_ = 0.0;
  window_ = late_ = {};
  raw_[0] = raw_[1] = fitted_s_ = 0.0;
}

void wheel_check::sums::fade(double left) {
  count *= left;
  squares *= left;
  for (double &p : products) p *= left;
  for (double &b : information) b *= left;
}

void wheel_check::sums::add(double weight, double z, const double shift[kAxes]) {
  count += weight;
  squares += weight * square(z);
  for (int i = 0; i < kAxes; i++) products[i] += weight * z * shift[i];
  information[0] += weight * square(shift[0]);
  information[1] += weight * shift[0] * shift[1];
  information[2] += weight * square(shift[1]);
}

double wheel_check::sums::explained(double prior) const {
  const double a = information[0] + prior, cross = information[1], b = information[2] + prior;
  return (b * square(products[0]) - 2.0 * cross * products[0] * products[1] + a * square(products[1])) /
         (a * b - square(cross));
}

// By log(1 + x) <= x, and a determinant that is not below the prior's.
double wheel_check::sums::nats_at_most(double scale2) const {
  const double by = explained(scale2 / square(kOff_mps)), left = squares > by ? squares - by : 0.0;
  return 0.5 * (count + kScaleCount) * by / (left + kScaleCount * scale2);
}

// Student's t, of innovations with a common scale.
double wheel_check::sums::nats(double scale2) const {
  const double prior = scale2 / square(kOff_mps), stated = kScaleCount * scale2;
  const auto factor = [&](double explained, double determinant) {
    const double left = squares > explained ? squares - explained : 0.0;
    return 0.5 * (count + kScaleCount) * log((squares + stated) / (left + stated)) - 0.5 * log(determinant);
  };
  const double a = information[0] + prior, cross = information[1], b = information[2] + prior;
  const double determinant = a * b - square(cross);
  const double forwards = factor(square(products[0]) / a, a / prior);
  const double sideways = factor(explained(prior), determinant / square(prior));
  return larger(forwards, sideways);
}

void wheel_check::move(const sin_cos &heading, double dt_s, double wheel_mps, double noise_m2) {
  by_[0][0] += heading.cos * dt_s;
  by_[0][1] += heading.sin * dt_s;
  by_[1][0] -= heading.sin * dt_s;
  by_[1][1] += heading.cos * dt_s;
  added_m2_ += noise_m2;
  wheel_mps_ += dt_s / (dt_s + kLate_s) * (wheel_mps - wheel_mps_);
  for (int k = 0; k < kAlternatives; k++) lasted_s_[k] += (health() / kFirst >> k & 1u) != 0 ? dt_s : 0.0;
  unsupported_s_ += dt_s;
  uncompared_s_ += dt_s;
  if (unsupported_s_ > kForgotten_s) off_ = 0;
  if (uncompared_s_ > kForgotten_s) spins_ = 0;
}

void wheel_check::fade_correlated(double left) {
  for (double(&by)[kBlock] : by_)
    for (int i = noise_adaption::kPose; i < kBlock; i++) by[i] *= left;
}

void wheel_check::update(const noise_adaption::row &r) {
  double left2 = 0.0, before2 = 0.0;
  for (double(&by)[kBlock] : by_) {
    double shift = 0.0;
    for (int i = 0; i < kBlock; i++) shift += r.by[i] * by[i];
    before2 += square(by[0]) + square(by[1]);
    for (int i = 0; i < kBlock; i++) by[i] -= r.gain[i] * shift;
    left2 += square(by[0]) + square(by[1]);
  }
  if (left2 < before2) added_m2_ *= left2 / before2;
}

double wheel_check::weigh(const noise_adaption::row *rows, int count, wm_time_ns t_ns) {
  const double dt_s = weighed_ns_ == WM_TIME_NONE ? kWindow_s : wm_seconds_between(weighed_ns_, t_ns);
  const double weight = dt_s < kApart_s ? dt_s / kApart_s : 1.0;
  weighed_ns_ = t_ns;
  window_.fade(exp(-dt_s / kWindow_s));
  const double late = exp(-dt_s / kLate_s);
  late_.fade(late);
  for (double &r : raw_) r *= late;
  for (int k = 0; k < count; k++) {
    const noise_adaption::row &r = rows[k];
    const double rolling = r.variance - added_m2_ * (square(r.by[0]) + square(r.by[1]));
    const double sigma = std::sqrt(rolling > r.own ? rolling : r.own);
    if (!(sigma > 0.0)) continue;
    const double sigmas = r.innovation / sigma, z = clipped(sigmas, kMost);
    double shift[kAxes] = {};
    for (int i = 0; i < kAxes; i++) {
      for (int j = 0; j < kBlock; j++) shift[i] += r.by[j] * by_[i][j];
      shift[i] /= sigma;
    }
    window_.add(weight, z, shift);
    late_.add(weight, z, shift);
    for (int i = 0; i < kAxes; i++) raw_[i] += weight * sigmas * shift[i];
    const double unexplained2 = square(z - off_mps_[0] * shift[0] - off_mps_[1] * shift[1]);
    scale2_ += weight / kScaleFrom * (unexplained2 - scale2_);
    if (scale2_ < 1.0) scale2_ = 1.0;
  }
  const double prior = scale2_ / square(kOff_mps), a = late_.information[0] + prior, cross = late_.information[1];
  const double b = late_.information[2] + prior, determinant = a * b - square(cross);
  off_mps_[0] = (b * raw_[0] - cross * raw_[1]) / determinant;
  off_mps_[1] = (a * raw_[1] - cross * raw_[0]) / determinant;
  const double most = larger(window_.nats_at_most(scale2_), late_.nats_at_most(scale2_));
  if (most < kChance_nats) fitted_s_ += dt_s < kWindow_s ? dt_s : kWindow_s;
  if (off_ == 0 && most < kBegins_nats) return 0.0;
  return decide(larger(window_.nats(scale2_), late_.nats(scale2_)));
}

double wheel_check::decide(double found) {
  const bool begins = found > kBegins_nats && fitted_s_ > kFitted_s, held = off_ != 0;
  if (begins) unsupported_s_ = 0.0;
  off_ = 0;
  if (!begins && !(held && found > kEnds_nats)) return 0.0;
  const double robot_mps2 = square(wheel_mps_ + off_mps_[0]) + square(off_mps_[1]), wheels_mps2 = square(wheel_mps_);
  off_ = robot_mps2 < square(kRobotStands) * wheels_mps2   ? WM_MOTION_HEALTH_WHEELS_SPIN
         : wheels_mps2 < square(kWheelsStand) * robot_mps2 ? WM_MOTION_HEALTH_PUSHED
                                                           : WM_MOTION_HEALTH_LIFTED;
  if (held) return 0.0;
  double place_s2 = 0.0;
  for (const double(&by)[kBlock] : by_) place_s2 += square(by[0]) + square(by[1]);
  const double added_m2 = 0.5 * square(kOff_mps) * place_s2;
  added_m2_ += added_m2;
  return added_m2;
}

void wheel_check::weigh_turn(double apart_rad, double variance_rad2, double spinning_rad, double dt_s) {
  const double wider = 1.0 + square(spinning_rad) / variance_rad2, nis = square(apart_rad) / variance_rad2;
  uncompared_s_ = 0.0;
  spin_.add_hazard(kSpinHazard_per_s * dt_s);
  spin_.add(clipped(0.5 * (nis * (1.0 - 1.0 / wider) - log(wider)), kSpinMost));
  if (spin_.value() > kSpinHolds) spins_ = 1;
  if (spin_.value() < -kSpinHolds) spins_ = 0;
}

void wheel_check::list(calibration_list *out) const {
  static const char *const kNames[kAlternatives] = {"wheels_spin_s", "one_wheel_spins_s", "pushed_s", "lifted_s"};
  for (int k = 0; k < kAlternatives; k++)
    if (lasted_s_[k] > 0.0) out->add("motion", kNames[k], lasted_s_[k], 0.0);
}

}  // namespace wm
