// SPDX-License-Identifier: Apache-2.0
#include "filters/core/noise_adaption.hpp"

#include <cmath>
#include <cstring>
#include <type_traits>

namespace wm {
namespace {

// Log of kMostFactor. Its inverse is the least one of positions: receivers state sigmas that are four times too large,
// too. Others are at least 1. A motion's noise that is too large costs little, whereas calibration states absorb what
// the innovations lack: lowered, it gave a NEES inside 95 % of 0.91 instead of 1.00 (mrclam-d6-r4). White noise of
// sightings is small beside their time-correlated errors.
constexpr double kLogMost = 2.772588722239781;
// Time constant of a factor, s. With 300 the prior pulls more: NEES inside 95 % 0.83 instead of 0.88 in the unit test.
constexpr double kTau_s = 1000.0, kForgetEvery_s = 1.0;
// Over which positions' innovations are summed up: longer than a receiver smooths, shorter than its errors last. Flat
// from 5 to 20 over simulated receivers of eight kinds.
constexpr double kSum_s = 10.0;
// A larger NIS counts as this much: the 99 % quantile of one degree of freedom. A larger innovation, in sigmas, counts
// as kMost. Neither was swept.
constexpr double kNisMost = 6.6, kMost = 3.0;
// Of the prior's sigma of log factors: that of the lasting error is beside the one of the stated sigma. Flat from 0.5
// to 1 over the same receivers.
constexpr double kLastingPrior = 0.7;
// A heading's sigma above which a pose's derivatives are not linear in it, where positions correct it; for kSum_s at
// most, since some robots' heading is never known better.
constexpr double kLinear_rad = 0.07;
constexpr double kLeastVariance = 1e-9;  // of a row's information on the factors; less is not used
constexpr int kNewtonSteps = 4;

// As list() names the factors.
const char *const kNames[noise_adaption::kFactors] = {"noise.way_factor",     "noise.turn_factor",
                                                      "noise.bearing_factor", "noise.range_factor",
                                                      "noise.place_factor",   "noise.lasting_factor"};

// loop(size), of a block whose size the compiler knows: its loops are unrolled.
template <class Loop>
void over_block(int size, Loop loop) {
  if (size == noise_adaption::kPose)
    loop(std::integral_constant<int, noise_adaption::kPose>{});
  else
    loop(std::integral_constant<int, noise_adaption::kBlock>{});
}

}  // namespace

void noise_adaption::init(double log_sigma) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  log_sigma_ = log_sigma;
  block_ = kPose;
  used_ = 1 << kWay | 1 << kTurn;
  restart(true);
}

void noise_adaption::clear() {
  double lasting[kFactors][2];
  for (int k = 0; k < kFactors; k++)
    for (int i = 0; i < 2; i++) lasting[k][i] = variance_by_[k][kPose + i][kPose + i];
  std::memset(variance_by_, 0, sizeof variance_by_);
  std::memset(mean_by_, 0, sizeof mean_by_);
  for (int k = kPlace; k <= kLasting; k++)
    for (int i = 0; i < 2; i++) variance_by_[k][kPose + i][kPose + i] = lasting[k][i];
  std::memset(sums_, 0, sizeof sums_);
  summed_ns_ = WM_TIME_NONE;
}

bool noise_adaption::waits(double heading_variance, wm_time_ns t_ns) {
  if (began_ns_ == WM_TIME_NONE) began_ns_ = t_ns;
  if (heading_variance <= square(kLinear_rad) || wm_seconds_between(began_ns_, t_ns) > kSum_s) return false;
  clear();
  return true;
}

void noise_adaption::restart(bool and_factors) {
  clear();
  began_ns_ = WM_TIME_NONE;
  if (!and_factors) return;
  forgotten_ns_ = WM_TIME_NONE;
  std::memset(covariance_, 0, sizeof covariance_);
  for (int k = 0; k < kFactors; k++) {
    log_[k] = 0.0;
    scale_[k] = 1.0;
    covariance_[k][k] = prior(k);
  }
}

void noise_adaption::list(calibration_list *out) const {
  for (int k = 0; k < kFactors && is_on(); k++) {
    if (!is_used(k)) continue;
    out->add(kNames[k], scale(k), scale(k) * std::sqrt(covariance_[k][k]));
    if (scale(k) > 0.99 * kMostFactor) out->alarm(WM_ALARM_NOISE, scale(k));
  }
}

// F = I but for the heading's column.
void noise_adaption::move(double x_m, double y_m, double along_m2, double across_m2, double turn_rad2) {
  if (!is_on()) return;
  const double by[2] = {-y_m, x_m};
  for (int k = 0; k < kFactors; k++) {
    if (!is_used(k)) continue;
    double(&d)[kBlock][kBlock] = variance_by_[k];
    over_block(block_, [&](auto size) {
      for (int r = 0; r < 2; r++)
#pragma GCC unroll 5
        for (int j = 0; j < decltype(size)::value; j++) d[r][j] += by[r] * d[2][j];
      for (int r = 0; r < 2; r++)
#pragma GCC unroll 5
        for (int j = 0; j < decltype(size)::value; j++) d[j][r] += by[r] * d[j][2];
    });
    for (int r = 0; r < 2; r++) mean_by_[k][r] += by[r] * mean_by_[k][2];
  }
  const double way2 = square(x_m) + square(y_m);
  const double xx = way2 > 0.0 ? square(x_m) / way2 : 0.5, xy = way2 > 0.0 ? x_m * y_m / way2 : 0.0;
  double(&way)[kBlock][kBlock] = variance_by_[kWay];
  way[0][0] += xx * along_m2 + (1.0 - xx) * across_m2;
  way[1][1] += (1.0 - xx) * along_m2 + xx * across_m2;
  way[0][1] += xy * (along_m2 - across_m2);
  way[1][0] = way[0][1];
  variance_by_[kTurn][2][2] += turn_rad2;
}

void noise_adaption::begin_correlated(double variance_m2) {
  block_ = kBlock;
  used_ |= 1 << kPlace | 1 << kLasting;
  for (int i = kPose; i < kBlock; i++) {
    variance_by_[kPlace][i][i] = variance_by_[kLasting][i][i] = 0.0;
    add_lasting(i, variance_m2);
  }
}

void noise_adaption::add_lasting(int axis, double variance_m2) {
  variance_by_[kLasting][axis][axis] += variance_m2;
  if (understates()) variance_by_[kPlace][axis][axis] += variance_m2;
}

void noise_adaption::fade_correlated(double left, double added_m2) {
  for (int k = 0; k < kFactors; k++)
    for (int i = kPose; i < kBlock; i++) {
      for (int j = 0; j < kBlock; j++) {
        variance_by_[k][i][j] *= left;
        variance_by_[k][j][i] *= left;
      }
      mean_by_[k][i] *= left;
    }
  for (int i = kPose; i < kBlock; i++) add_lasting(i, added_m2);
}

// The derivatives of an update with the gain K = P h / s, s = h' P h + r, by a log factor: D <- (I - K h') D (I - K
// h')'
// + K K' dr, and of the mean m <- (I - K h') m + dK innovation, dK = (D h - K ds) / s.
void noise_adaption::update(const row &r) {
  if (!is_on() || !(r.variance > 0.0)) return;
  if (r.kind < kFactors) used_ |= 1 << r.kind;
  const double sigma = std::sqrt(r.variance);
  double dh[kFactors][kBlock], ds[kFactors];
  evidence one{1.0, r.innovation / sigma, {}, {}};
  for (int k = 0; k < kFactors; k++) {
    if (!is_used(k)) continue;
    one.by[k] = derivatives(r, k, dh[k], &ds[k]) / sigma;
    const double part = ds[k] / r.variance;
    one.share[k] = part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
  }
  for (int k = 0; k < kFactors; k++)
    if (is_used(k)) follow(r, k, dh[k], ds[k], one.by[k] * sigma);
  if (r.kind == kPlace) sums_[r.number % kSums].add(one);
  one.share[kLasting] = one.by[kLasting] = 0.0;
  if (r.kind < kFactors) learn(one);
}

void noise_adaption::turn(double sine, double cosine) {
  if (!is_on()) return;
  for (int k = 0; k < kFactors; k++) {
    if (!is_used(k)) continue;
    double(&d)[kBlock][kBlock] = variance_by_[k];
    for (int x = 0; x < block_; x += kPose) {  // the pose's place; the time-correlated error
      const int y = x + 1;
      for (int j = 0; j < block_; j++) {
        const double before = d[x][j];
        d[x][j] = cosine * before - sine * d[y][j];
        d[y][j] = sine * before + cosine * d[y][j];
      }
      for (int j = 0; j < block_; j++) {
        const double before = d[j][x];
        d[j][x] = cosine * before - sine * d[j][y];
        d[j][y] = sine * before + cosine * d[j][y];
      }
    }
  }
}

void noise_adaption::evidence::add(const evidence &one) {
  count += one.count;
  innovations += one.innovations;
  for (int k = 0; k < kFactors; k++) {
    share[k] += one.share[k];
    by[k] += one.by[k];
  }
}

// Independent innovations of n rows have a sum with the variance n, in sigmas.
void noise_adaption::learn(const evidence &of) {
  if (of.count == 0.0) return;
  const double scale = 1.0 / std::sqrt(of.count);
  double share[kFactors], by[kFactors];
  for (int k = 0; k < kFactors; k++) {
    share[k] = of.share[k] / of.count;
    by[k] = of.by[k] * scale;
  }
  learn_variance(share, square(of.innovations * scale));
  learn_mean(by, of.innovations * scale);
}

// D h, the derivative of the innovation's variance, and of the expectation, by a log factor.
double noise_adaption::derivatives(const row &r, int k, double dh[kBlock], double *ds) const {
  double by = 0.0;
  *ds = r.kind == k ? r.own : 0.0;
  for (int i = 0; i < block_; i++) {
    double sum = 0.0;
    over_block(block_, [&](auto size) {
#pragma GCC unroll 5
      for (int j = 0; j < decltype(size)::value; j++) sum += variance_by_[k][i][j] * r.by[j];
    });
    dh[i] = sum;
    *ds += r.by[i] * dh[i];
    by += r.by[i] * mean_by_[k][i];
  }
  return by;
}

void noise_adaption::follow(const row &r, int k, const double dh[kBlock], double ds, double by) {
  for (int i = 0; i < block_; i++) {
    mean_by_[k][i] += (dh[i] - r.gain[i] * ds) / r.variance * r.innovation - r.gain[i] * by;
    over_block(block_, [&](auto size) {
#pragma GCC unroll 5
      for (int j = 0; j < decltype(size)::value; j++)
        variance_by_[k][i][j] += r.gain[i] * r.gain[j] * ds - r.gain[i] * dh[j] - dh[i] * r.gain[j];
    });
  }
}

// The NIS has the expectation exp(u), u = share' (true - applied log factors). Maximum a posteriori of u, whose prior
// has the mean u0 and the variance q: u = u0 + q/2 (nis exp(-u) - 1), concave, by Newton from the left; then a Kalman
// update with the Fisher information 1/2.
void noise_adaption::learn_variance(const double share[kFactors], double nis) {
  double gain[kFactors], u0 = 0.0, q = 0.0;
  for (int k = 0; k < kFactors; k++) {
    gain[k] = 0.0;
    for (int l = 0; l < kFactors; l++) gain[k] += covariance_[k][l] * share[l];
    q += share[k] * gain[k];
    u0 += share[k] * beyond(k);
  }
  if (!(q > kLeastVariance)) return;
  const double clipped = nis < kNisMost ? nis : kNisMost;
  double u = u0;
  for (int i = 0; i < kNewtonSteps; i++) {
    const double left = 0.5 * q * clipped * exp(-u);
    u -= (u - u0 - left + 0.5 * q) / (1.0 + left);
  }
  correct(gain, (u - u0) / q, 1.0 / (q + 2.0));
}

// The innovation's mean is by' (true - applied log factors), in sigmas.
void noise_adaption::learn_mean(const double by[kFactors], double normalised) {
  double gain[kFactors], q = 0.0;
  for (int k = 0; k < kFactors; k++) {
    gain[k] = 0.0;
    for (int l = 0; l < kFactors; l++) gain[k] += covariance_[k][l] * by[l];
    q += by[k] * gain[k];
    normalised -= by[k] * beyond(k);
  }
  if (!(q > kLeastVariance)) return;
  const double clipped = normalised > kMost ? kMost : normalised < -kMost ? -kMost : normalised;
  correct(gain, clipped / (q + 1.0), 1.0 / (q + 1.0));
}

double noise_adaption::prior(int k) const { return square(k == kLasting ? kLastingPrior * log_sigma_ : log_sigma_); }

double noise_adaption::applied(int k) const { return k < kPlace && log_[k] < 0.0 ? 0.0 : log_[k]; }

void noise_adaption::correct(const double gain[kFactors], double step, double weight) {
  for (int k = 0; k < kFactors; k++) {
    const double to = log_[k] + gain[k] * step;
    log_[k] = to > kLogMost ? kLogMost : to < -kLogMost ? -kLogMost : to;
    scale_[k] = exp(applied(k));
    for (int l = 0; l < kFactors; l++) covariance_[k][l] -= weight * gain[k] * gain[l];
  }
}

void noise_adaption::pass(wm_time_ns t_ns) {
  if (!is_on()) return;
  if (summed_ns_ == WM_TIME_NONE) summed_ns_ = t_ns;
  if (wm_seconds_between(summed_ns_, t_ns) >= kSum_s) {
    summed_ns_ = t_ns;
    for (evidence &of : sums_) {
      learn(of);
      of = {};
    }
    // Else a correction of the other factors by single innovations moves this one.
    for (int k = 0; k < kLasting; k++) covariance_[k][kLasting] = covariance_[kLasting][k] = 0.0;
  }
  if (forgotten_ns_ == WM_TIME_NONE) forgotten_ns_ = t_ns;
  const double dt_s = wm_seconds_between(forgotten_ns_, t_ns);
  if (dt_s < kForgetEvery_s) return;
  forgotten_ns_ = t_ns;
  forget(dt_s);
}

void noise_adaption::forget(double dt_s) {
  const double left = exp(-dt_s / kTau_s);
  for (int k = 0; k < kFactors; k++) {
    log_[k] *= left;
    scale_[k] = exp(applied(k));
    for (int l = 0; l < kFactors; l++) covariance_[k][l] *= square(left);
    covariance_[k][k] += prior(k) * (1.0 - square(left));
  }
}

}  // namespace wm
