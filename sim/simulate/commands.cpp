// SPDX-License-Identifier: Apache-2.0
#include "simulate/commands.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "simulate/angle.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

constexpr double kStep_s = 0.001;  // of the drive's differential equation
constexpr int kStepsASample = 5;   // of the truth: 0.005 s
// Of the controller: natural frequency and damping of the distance to the way, and the gain along it. A robot with a
// delay of half a second is still damped.
constexpr double kOmega_radps = 0.7, kDamping = 0.8, kAlong_1ps = 0.4;
constexpr double kSlowest_mps = 0.1;  // below this speed the distance is corrected more slowly

struct Twist {
  double v = 0, w = 0;
};

// [Kanayama1990], with gains that give the same time constants at every speed.
Twist follow(const State &wanted, const State &now) {
  const double c = wm::cos(now.heading_rad), s = wm::sin(now.heading_rad);
  const double dx = wanted.x_m - now.x_m, dy = wanted.y_m - now.y_m;
  const double along = c * dx + s * dy, aside = c * dy - s * dx;
  const double turn = wm::sin(wanted.heading_rad - now.heading_rad), v = wanted.speed_mps;
  if (v == 0) return {};
  const double divisor = std::copysign(std::max(std::fabs(v), kSlowest_mps), v);
  return {v * wm::cos(wanted.heading_rad - now.heading_rad) + kAlong_1ps * along,
          wanted.yaw_rate_radps + kOmega_radps * kOmega_radps * aside / divisor + 2 * kDamping * kOmega_radps * turn};
}

// The drive's inside: dead time, slew rates, a first-order response of speed and turn rate, and static friction of
// each wheel.
class Actuated {
 public:
  Actuated(const Actuators &a, double track_m) : a_(a), track_m_(track_m) {}

  void command(double acts_s, const Twist &twist) {
    // A change never overtakes the one before.
    waiting_.push_back({waiting_.empty() ? acts_s : std::max(acts_s, waiting_.back().t_s), twist.v, twist.w});
  }
  Twist step(double t_s) {
    while (!waiting_.empty() && waiting_.front().t_s <= t_s) {
      asked_ = {waiting_.front().v_mps, waiting_.front().w_radps};
      waiting_.pop_front();
    }
    slewed_.v = slew(slewed_.v, a_.speed_scale * asked_.v, a_.acceleration_mps2);
    slewed_.w = slew(slewed_.w, a_.turn_scale * asked_.w, a_.turn_acceleration_radps2);
    const double share = a_.response_s > 0 ? 1 - wm::exp(-kStep_s / a_.response_s) : 1;
    smooth_.v += share * (slewed_.v - smooth_.v);
    smooth_.w += share * (slewed_.w - smooth_.w);
    const double half_m = 0.5 * track_m_;
    const double left = rolls(0, smooth_.v - half_m * smooth_.w), right = rolls(1, smooth_.v + half_m * smooth_.w);
    return {0.5 * (left + right), (right - left) / track_m_};
  }

 private:
  static double slew(double from, double to, double rate) {
    return rate > 0 ? std::clamp(to, from - rate * kStep_s, from + rate * kStep_s) : to;
  }
  // A wheel that stands starts above friction_mps and stops below half of it (static and Coulomb friction).
  double rolls(int side, double rim_mps) {
    bool &moves = moves_[side];
    moves = std::fabs(rim_mps) > (moves ? 0.5 : 1) * a_.friction_mps;
    return moves ? rim_mps : 0;
  }

  const Actuators &a_;
  double track_m_;
  std::deque<Command> waiting_;
  Twist asked_, slewed_, smooth_;
  bool moves_[2] = {false, false};
};

double rounded(double value, double step) { return step > 0 ? step * std::round(value / step) : value; }

void advance(const Twist &twist, State &s) {
  const double middle = s.heading_rad + 0.5 * twist.w * kStep_s;
  s.x_m += twist.v * kStep_s * wm::cos(middle);
  s.y_m += twist.v * kStep_s * wm::sin(middle);
  s.heading_rad += twist.w * kStep_s;
  s.way_m += twist.v * kStep_s;
  s.speed_mps = twist.v;
  s.yaw_rate_radps = twist.w;
  s.curvature_1pm = twist.v != 0 ? twist.w / twist.v : 0;
}

}  // namespace

Drive obey(const Scenario &sc, const Random &random, const Drive &planned, std::vector<Command> &published) {
  const Actuators &a = sc.robot.actuators;
  Actuated drive(a, sc.robot.wheels.track_m);
  State now = planned.at(0);
  now.speed_mps = now.yaw_rate_radps = 0;
  std::vector<State> driven = {now};
  Twist twist;
  const auto steps = static_cast<uint64_t>(std::ceil(planned.duration_s() / (kStepsASample * kStep_s))) * kStepsASample;
  uint64_t commands = 0, rows = 0;
  for (uint64_t k = 0; k < steps; k++) {
    const double t_s = static_cast<double>(k) * kStep_s;
    if (t_s >= static_cast<double>(commands) / a.control_hz) {
      twist = follow(planned.at(t_s), now);
      drive.command(t_s + a.dead_s + a.dead_jitter_s * random.uniform(Stream::command_delay, commands), twist);
      commands++;
    }
    if (t_s >= static_cast<double>(rows) / a.publish_hz) {
      published.push_back({t_s, rounded(twist.v, a.speed_step_mps), rounded(twist.w, a.turn_step_radps)});
      rows++;
    }
    advance(drive.step(t_s), now);
    if ((k + 1) % kStepsASample == 0) driven.push_back(now);
  }
  return Drive::sampled(driven, kStepsASample * kStep_s);
}

}  // namespace wm::sim
