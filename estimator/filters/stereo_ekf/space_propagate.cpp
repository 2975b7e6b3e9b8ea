// SPDX-License-Identifier: Apache-2.0
// Prediction in space: the pose moved by a twist, and its covariance.
#include <cstring>

#include "filters/stereo_ekf/space_filter.hpp"

namespace wm {
namespace {

void add_block(double out[kMovers][3], int row, const mat3 &m) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out[row + i][j] += m.m[i][j];
}

// R diag(v) R'.
mat3 turned_diagonal(const mat3 &R, const double v[3]) {
  mat3 out;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      out.m[i][j] = 0.0;
      for (int k = 0; k < 3; k++) out.m[i][j] += R.m[i][k] * R.m[j][k] * v[k];
    }
  return out;
}

// Integral of exp(-t / tau) over dt: what a rate of 1 moves until then. tau 0: the rate stays.
double reach_of(double tau_s, double dt_s) { return tau_s > 0.0 ? tau_s * (1.0 - exp(-dt_s / tau_s)) : dt_s; }

// Variance of the integral of a rate's process noise, and its covariance with the rate at the end.
// Random walk of density q: q dt^3/3 and q dt^2/2. Gauss-Markov process of sigma s, with e = exp(-dt / tau):
// 2 s^2 tau (dt - 2 tau (1 - e) + tau (1 - e^2) / 2) and s^2 tau (1 - e)^2. Both pairs are positive for every dt.
struct integrated_noise {
  double variance, with_rate;
};
integrated_noise integrated_noise_of(const head_model &m, double dt_s) {
  if (!(m.tau_s > 0.0)) return {square(m.walk) * dt_s * dt_s * dt_s / 3.0, 0.5 * square(m.walk) * dt_s * dt_s};
  const double s2 = square(m.sigma), a = dt_s / m.tau_s, gone = 1.0 - exp(-a);
  // Below a = 0.01 cancellation costs the closed form more than truncation the series (a^2 / 10 of it).
  const double sum = a < 0.01 ? a * a * a * (1.0 / 3 - 0.25 * a) : a - 2.0 * gone + 0.5 * gone * (2.0 - gone);
  return {2.0 * s2 * square(m.tau_s) * sum, s2 * m.tau_s * square(gone)};
}

}  // namespace

// The twist of a step in map axes; the states of velocity and rates fade on the way where they are Gauss-Markov.
struct space_filter::step {
  double dt_s;
  vec3 turn;   // rotation vector of the step, body axes
  mat3 mean;   // mean rotation on the way, body to map
  vec3 way;    // in map axes
  mat3 swing;  // skew(way)
  mat3 then;   // axes of the body at the last picture, in the map
};

// F's rows of the pose beside the identity, block by block: the derivative of the moved pose by `width` states.
struct space_filter::transition {
  static constexpr int kBlocks = 7;  // the turns, and up to five states of the motion
  struct block {
    int state, width;
    double by[kMovers][3];
  } blocks[kBlocks];
  int count = 0;

  block &add(int state, int width) {
    block &b = blocks[count++];
    std::memset(&b, 0, sizeof b);
    b.state = state;
    b.width = width;
    return b;
  }
};

space_filter::step space_filter::step_of(const body_stretch &s) const {
  const bool has_rates = at_[kRates] >= 0;
  const double reach_s = has_rates ? reach_of(models_[kRates].tau_s, s.dt_s) : s.dt_s;
  const vec3 v = has_rates ? head3(kVelocity) : velocity_of(s.v_mps);
  const vec3 w = has_rates ? head3(kRates) : rates_of(s.w_radps);
  step out;
  out.dt_s = s.dt_s;
  out.turn = reach_s * w;
  out.mean = r_ * mean_turn(out.turn);
  out.way = (has_rates ? reach_of(models_[kVelocity].tau_s, s.dt_s) : s.dt_s) * (out.mean * v);
  out.swing = skew(out.way);
  out.then = r_ * transposed(matrix_of(moved_.q));
  return out;
}

// dp' = dp - D x dr + ..., dr' = dr + ..., D the way in map axes: motion leaves the invariant error as it is, but for
// noise and the sensors' states. Rates that are wrong by b in an even turn rotate the end by b dt, and displace it by
// half of that times the way.
void space_filter::transition_of(const step &s, const body_stretch &twist, transition *f) const {
  add_sensor_blocks(s, twist, f);
  // The motion since the last picture: the same in that picture's axes.
  const mat3 back = transposed(s.then);
  if (movers() == kMovers)
    for (int i = 0; i < f->count; i++) {
      transition::block &b = f->blocks[i];
      for (int part = 0; part < kPose6; part += 3) {
        mat3 rows;
        std::memcpy(&rows, b.by[part], sizeof rows);
        add_block(b.by, kPose6 + part, back * rows);
      }
    }
  add_block(f->add(kTurn, 3).by, kPlace, -1.0 * s.swing);
  if (movers() == kMovers)
    add_block(f->add(at_[kMovedTurn], 3).by, kPose6 + kPlace, -1.0 * skew(transposed_times(s.then, s.way)));
}

void space_filter::add_sensor_blocks(const step &s, const body_stretch &twist, transition *f) const {
  const auto add_turning = [&](int state, const mat3 &turn) -> transition::block & {
    transition::block &b = f->add(state, 3);
    add_block(b.by, kTurn, turn);
    add_block(b.by, kPlace, -0.5 * (s.swing * turn));
    return b;
  };
  if (at_[kRates] >= 0) {
    add_block(f->add(at_[kVelocity], 3).by, kPlace, reach_of(models_[kVelocity].tau_s, s.dt_s) * s.mean);
    add_turning(at_[kRates], reach_of(models_[kRates].tau_s, s.dt_s) * s.mean);
    return;
  }
  if (at_[kRateBias] >= 0) add_turning(at_[kRateBias], -s.dt_s * s.mean);
  if (at_[kVelocityScale] >= 0) {
    const vec3 by = (1.0 / head1(kVelocityScale, 1.0)) * s.way;
    transition::block &b = f->add(at_[kVelocityScale], 1);
    for (int i = 0; i < 3; i++) b.by[kPlace + i][0] = by[i];
  }
  if (at_[kRateScale] >= 0) {
    const vec3 turn = s.mean * (s.dt_s / head1(kRateScale, 1.0) * (rates_of(twist.w_radps) + head3(kRateBias)));
    const vec3 place = -0.5 * (s.swing * turn);
    transition::block &b = f->add(at_[kRateScale], 1);
    for (int i = 0; i < 3; i++) {
      b.by[kTurn + i][0] = turn[i];
      b.by[kPlace + i][0] = place[i];
    }
  }
  const mat3 direction = -s.dt_s * (s.mean * skew(velocity_of(twist.v_mps)));
  if (at_[kTwistAxes] >= 0)
    add_block(add_turning(at_[kTwistAxes], -s.dt_s * (s.mean * skew(twist.w_radps))).by, kPlace, direction);
  if (at_[kVelocityDirection] >= 0) add_block(f->add(at_[kVelocityDirection], 3).by, kPlace, direction);
}

// P' = F P F' + Q.
void space_filter::move(const transition &f, const double noise[kMovers][kMovers]) {
  constexpr int kMost = 1 + 3 * transition::kBlocks;
  const double nothing[kMovers] = {};  // is pending
  jacobian_row<kMost> by[kMovers];
  for (int i = 0; i < movers(); i++) {
    by[i].add(i, 1.0);
    for (int b = 0; b < f.count; b++)
      for (int k = 0; k < f.blocks[b].width; k++) by[i].add(f.blocks[b].state + k, f.blocks[b].by[i][k]);
  }
  state_.assign_rows(kPlace, movers(), by, noise[0], kMovers, nothing);
}

// White noise along the step: a rotation error made evenly on the way displaces the end by half the way on average,
// with a third of its square.
void space_filter::add_motion_noise(const step &s, const body_stretch &twist, double noise[kMovers][kMovers]) const {
  const mat3 place = turned_diagonal(s.mean, twist.place_m2), turn = turned_diagonal(s.mean, twist.turn_rad2);
  const mat3 cross_noise = -0.5 * (s.swing * turn);
  const mat3 lever_noise = (1.0 / 3) * (s.swing * (turn * transposed(s.swing)));
  add_noise(kPlace, kPlace, place + lever_noise, s.then, noise);
  add_noise(kPlace, kTurn, cross_noise, s.then, noise);
  add_noise(kTurn, kPlace, transposed(cross_noise), s.then, noise);
  add_noise(kTurn, kTurn, turn, s.then, noise);
}

// A block of the pose's noise in map axes, and the same of the motion since the last picture.
void space_filter::add_noise(int row, int column, const mat3 &block, const mat3 &then,
                             double noise[kMovers][kMovers]) const {
  const mat3 crossed = block * then, own = transposed(then) * crossed;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      noise[row + i][column + j] += block.m[i][j];
      noise[row + i][kPose6 + column + j] += crossed.m[i][j];
      noise[kPose6 + row + i][kPose6 + column + j] += own.m[i][j];
    }
}

void space_filter::propagate(const body_stretch &twist) {
  settle();
  check_priors(twist.dt_s);
  if (!(twist.dt_s > 0.0)) return;
  const double place_before = pose_variance(kPlace), turn_before = pose_variance(kTurn);
  const step s = step_of(twist);
  transition f;
  transition_of(s, twist, &f);
  double noise[kMovers][kMovers] = {};
  add_motion_noise(s, twist, noise);
  const integrated_noise of_velocity = integrated_noise_of(models_[kVelocity], s.dt_s),
                         of_rates = integrated_noise_of(models_[kRates], s.dt_s);
  if (at_[kRates] >= 0) {
    add_noise(kPlace, kPlace, of_velocity.variance * kIdentity3, s.then, noise);
    add_noise(kTurn, kTurn, of_rates.variance * kIdentity3, s.then, noise);
  }
  move(f, noise);
  walk(s.dt_s);
  if (at_[kRates] >= 0) {
    add_with_rate(kVelocity, kPlace, of_velocity.with_rate, s);
    add_with_rate(kRates, kTurn, of_rates.with_rate, s);
  }
  bound_pose(kPlace, 3.0 * square(kUnknownPlace_m), place_before);
  bound_pose(kTurn, 3.0 * square(kUnknownTurn_rad), turn_before);
  moved_.p = moved_.p + transposed_times(s.then, s.way);
  moved_.q = normalized(moved_.q * turn_by(s.turn));
  pose_.p = pose_.p + s.way;
  pose_.q = normalized(pose_.q * turn_by(s.turn));
  r_ = matrix_of(pose_.q);
}

double space_filter::pose_variance(int state) const {
  return variance(state) + variance(state + 1) + variance(state + 2);
}

// The sum of three variances grows to `limit` at most, that of an unknown pose; a start less certain keeps its own.
// P' = D P D scales the three rows and columns alike, and so stays positive.
void space_filter::bound_pose(int state, double limit, double before) {
  if (before > limit) limit = before;
  const double now = pose_variance(state);
  if (!(now > limit)) return;
  state_.scale(state, 3, std::sqrt(limit / now));
}

// The covariance of what a rate's process noise has moved with that rate.
void space_filter::add_with_rate(int which, int into, double with_rate, const step &s) {
  const mat3 mean = transposed(s.then) * s.mean;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      state_.add_covariance(into + i, at_[which] + j, with_rate * s.mean.m[i][j]);
      if (movers() == kMovers) state_.add_covariance(kPose6 + into + i, at_[which] + j, with_rate * mean.m[i][j]);
    }
}

void space_filter::walk(double dt_s) {
  for (int k = 0; k < kHeadStates; k++) {
    if (at_[k] < 0) continue;
    const bool fades = models_[k].tau_s > 0.0;
    const double left = fades ? exp(-dt_s / models_[k].tau_s) : 1.0;
    const double added = fades ? (1.0 - left * left) * square(models_[k].sigma) : square(models_[k].walk) * dt_s;
    for (int i = at_[k]; i < at_[k] + kHeadSpecs[k].width; i++) {
      if (fades) {
        state_.fade(i, left, 0.0);
        head_[i] = kHeadSpecs[k].neutral + left * (head_[i] - kHeadSpecs[k].neutral);
      }
      state_.add_variance(i, added);
    }
  }
}

}  // namespace wm
