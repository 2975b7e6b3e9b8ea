// SPDX-License-Identifier: Apache-2.0
#include "simulate/route.h"

#include <algorithm>
#include <cmath>

#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

constexpr double kPieceMax_m = 0.25;

// A ramp of the form 3u^2 - 2u^3 has its largest slope, 1.5 (v1 - v0) / duration, in the middle.
double ramp_s(double v0, double v1, double acceleration) { return 1.5 * std::fabs(v1 - v0) / acceleration; }
double ramp_m(double v0, double v1, double acceleration) { return 0.5 * (v0 + v1) * ramp_s(v0, v1, acceleration); }

// The speed that a ramp of `way` metres reaches from v0.
double reach(double v0, double way, double acceleration) { return std::sqrt(v0 * v0 + way * acceleration / 0.75); }

// Nodes and weights of 5-point Gauss-Legendre on [-1, 1]; Abramowitz and Stegun, table 25.4.
constexpr double kNode[5] = {0, 0.538469310105683091, -0.538469310105683091, 0.906179845938663993,
                             -0.906179845938663993};
constexpr double kWeight[5] = {0.568888888888888889, 0.478628670499366468, 0.478628670499366468, 0.236926885056189088,
                               0.236926885056189088};

double leg_m(const Leg &leg) {
  switch (leg.kind) {
    case Leg::Kind::stand: return 0;
    case Leg::Kind::straight: return leg.length_m;
    case Leg::Kind::turn: return std::fabs(leg.turn_rad) * leg.radius_m + leg.ease_m;
  }
  return 0;
}

int leg_sign(const Leg &leg) { return leg.kind == Leg::Kind::stand ? 0 : leg.reverse ? -1 : 1; }

}  // namespace

void Drive::end_of(const Piece &p, double along, double &x, double &y, double &heading) {
  const auto turned = [&](double s) { return p.sign * (p.curvature * s + 0.5 * p.slope * s * s); };
  double cx = 0, cy = 0;
  for (int i = 0; i < 5; i++) {
    const double h = p.heading_rad + turned(0.5 * along * (1 + kNode[i]));
    cx += kWeight[i] * wm::cos(h);
    cy += kWeight[i] * wm::sin(h);
  }
  x = p.x_m + p.sign * 0.5 * along * cx;
  y = p.y_m + p.sign * 0.5 * along * cy;
  heading = p.heading_rad + turned(along);
}

void Drive::add_path(double length, int sign, double curvature0, double curvature1) {
  if (length <= 0) return;
  const int parts = static_cast<int>(std::ceil(length / kPieceMax_m));
  const double slope = (curvature1 - curvature0) / length;
  for (int i = 0; i < parts; i++) {
    Piece next{};
    next.length_m = length / parts;
    next.sign = sign;
    next.slope = slope;
    next.curvature = curvature0 + slope * length * i / parts;
    if (pieces_.empty()) {
      next.x_m = start_.x_m, next.y_m = start_.y_m, next.heading_rad = start_.heading_rad;
    } else {
      const Piece &last = pieces_.back();
      next.start_m = last.start_m + last.length_m;
      next.way_m = last.way_m + last.sign * last.length_m;
      end_of(last, last.length_m, next.x_m, next.y_m, next.heading_rad);
    }
    pieces_.push_back(next);
  }
}

void Drive::add_ramp(double duration, double v0, double v1) {
  if (duration <= 0) return;
  ramps_.push_back({duration_s_, duration, planned_m_, v0, v1});
  duration_s_ += duration;
  planned_m_ += 0.5 * (v0 + v1) * duration;
}

wm_status Drive::plan(const Route &route, Drive &out, wm_error *err) {
  out = Drive{};
  out.start_ = {};
  out.start_.x_m = route.x_m;
  out.start_.y_m = route.y_m;
  out.start_.heading_rad = route.heading_rad;
  std::vector<Leg> legs;
  for (int lap = 0; lap < route.laps; lap++) legs.insert(legs.end(), route.legs.begin(), route.legs.end());

  // The path.
  for (size_t i = 0; i < legs.size(); i++) {
    const Leg &leg = legs[i];
    if (leg.kind == Leg::Kind::straight) out.add_path(leg.length_m, leg_sign(leg), 0, 0);
    if (leg.kind != Leg::Kind::turn) continue;
    const double arc_m = std::fabs(leg.turn_rad) * leg.radius_m - leg.ease_m;
    if (arc_m < 0)
      return wm_fail(err, WM_BAD_CONFIG,
                     "route.legs: leg %zu: ease_m %g is longer than this turn allows; at most |turn| * radius_m = %g m",
                     i % route.legs.size() + 1, leg.ease_m, arc_m + leg.ease_m);
    // Seen from the vehicle: backwards with the wheel to the left turns to the right.
    const double curvature = (leg.turn_rad < 0 ? -1 : 1) * leg_sign(leg) / leg.radius_m;
    out.add_path(leg.ease_m, leg_sign(leg), 0, curvature);
    out.add_path(arc_m, leg_sign(leg), curvature, curvature);
    out.add_path(leg.ease_m, leg_sign(leg), curvature, 0);
  }
  out.length_m_ = out.pieces_.empty() ? 0 : out.pieces_.back().start_m + out.pieces_.back().length_m;

  // The speed where one leg ends and the next begins: what both allow and what can be reached and braked from.
  const double a = route.acceleration_mps2;
  std::vector<double> joint(legs.size() + 1, 0.0);
  for (size_t i = 1; i < legs.size(); i++)
    if (leg_sign(legs[i - 1]) != 0 && leg_sign(legs[i - 1]) == leg_sign(legs[i]))
      joint[i] = std::min(legs[i - 1].speed_mps, legs[i].speed_mps);
  for (size_t i = 0; i < legs.size(); i++) joint[i + 1] = std::min(joint[i + 1], reach(joint[i], leg_m(legs[i]), a));
  for (size_t i = legs.size(); i-- > 0;) joint[i] = std::min(joint[i], reach(joint[i + 1], leg_m(legs[i]), a));

  for (size_t i = 0; i < legs.size(); i++) {
    const Leg &leg = legs[i];
    if (leg.kind == Leg::Kind::stand) {
      out.add_ramp(leg.stand_s, 0, 0);
      continue;
    }
    const double length = leg_m(leg), v0 = joint[i], v1 = joint[i + 1];
    // The top speed that leaves room for both ramps: 0.75 (2 v^2 - v0^2 - v1^2) / a = length.
    const double top = std::min(leg.speed_mps, std::sqrt(0.5 * (v0 * v0 + v1 * v1 + length * a / 0.75)));
    const double cruise_m = length - ramp_m(v0, top, a) - ramp_m(top, v1, a);
    out.add_ramp(ramp_s(v0, top, a), v0, top);
    out.add_ramp(std::max(cruise_m, 0.0) / top, top, top);
    out.add_ramp(ramp_s(top, v1, a), top, v1);
  }
  out.planned_s_ = out.duration_s_;
  return WM_OK;
}

Drive Drive::sampled(const std::vector<State> &states, double step_s) {
  Drive out;
  out.samples_ = states;
  out.step_s_ = step_s;
  out.planned_s_ = out.duration_s_ = step_s * static_cast<double>(states.size() - 1);
  for (size_t i = 1; i < states.size(); i++) out.length_m_ += std::fabs(states[i].way_m - states[i - 1].way_m);
  return out;
}

State Drive::between_samples(double t_s) const {
  const double at = std::clamp(t_s / step_s_, 0.0, static_cast<double>(samples_.size() - 1));
  const size_t i = std::min(static_cast<size_t>(at), samples_.size() - 2);
  const double u = at - static_cast<double>(i);
  const State &a = samples_[i], &b = samples_[i + 1];
  const auto mean = [&](double State::*of) { return a.*of + u * (b.*of - a.*of); };
  State s{};
  s.x_m = mean(&State::x_m);
  s.y_m = mean(&State::y_m);
  s.heading_rad = mean(&State::heading_rad);
  s.way_m = mean(&State::way_m);
  const bool stands = t_s < 0 || t_s > planned_s_;
  s.speed_mps = stands ? 0 : mean(&State::speed_mps);
  s.yaw_rate_radps = stands ? 0 : mean(&State::yaw_rate_radps);
  s.side_mps = stands ? 0 : mean(&State::side_mps);
  s.curvature_1pm = a.curvature_1pm;
  return s;
}

void Drive::cut(double duration_s) { duration_s_ = std::min(duration_s_, duration_s); }

wm_status Drive::carry(double at_s, double forward_s, wm_error *err) {
  if (at_s + forward_s >= duration_s_)
    return wm_fail(err, WM_BAD_CONFIG, "faults.kidnap: at_s + forward_s is %g s, but the drive ends after %g s",
                   at_s + forward_s, duration_s_);
  const State from = driven(at_s), to = driven(at_s + forward_s);
  carry_way_m_ = to.way_m - from.way_m;
  carry_heading_rad_ = to.heading_rad - from.heading_rad;
  carry_at_s_ = at_s;
  carry_forward_s_ = forward_s;
  duration_s_ -= forward_s;
  return WM_OK;
}

State Drive::at(double t_s) const {
  if (carry_forward_s_ <= 0 || t_s < carry_at_s_) return driven(t_s);
  State s = driven(t_s + carry_forward_s_);
  s.carried_way_m = carry_way_m_;
  s.carried_heading_rad = carry_heading_rad_;
  return s;
}

double Drive::path_m(double t_s, double *speed_mps) const {
  const double t = std::clamp(t_s, 0.0, planned_s_);
  *speed_mps = 0;
  if (ramps_.empty()) {
    double sum = 0;
    for (size_t i = 1; i < samples_.size() && step_s_ * static_cast<double>(i) <= t; i++)
      sum += std::fabs(samples_[i].way_m - samples_[i - 1].way_m);
    return sum;
  }
  auto ramp = std::upper_bound(ramps_.begin(), ramps_.end(), t, [](double v, const Ramp &r) { return v < r.start_s; });
  ramp = ramp == ramps_.begin() ? ramp : ramp - 1;
  const double u = std::clamp((t - ramp->start_s) / ramp->duration_s, 0.0, 1.0), dv = ramp->v1 - ramp->v0;
  *speed_mps = t_s < 0 || t_s > planned_s_ ? 0 : ramp->v0 + dv * (3 * u * u - 2 * u * u * u);
  return ramp->start_m + ramp->duration_s * (ramp->v0 * u + dv * (u * u * u - 0.5 * u * u * u * u));
}

double Drive::length_m() const {
  double ignored;
  if (duration_s_ >= planned_s_) return length_m_;
  if (carry_forward_s_ <= 0 || duration_s_ < carry_at_s_) return path_m(duration_s_, &ignored);
  return path_m(duration_s_ + carry_forward_s_, &ignored) - path_m(carry_at_s_ + carry_forward_s_, &ignored) +
         path_m(carry_at_s_, &ignored);
}

State Drive::driven(double t_s) const {
  if (!samples_.empty()) return between_samples(t_s);
  double speed;
  const double path = path_m(t_s, &speed);
  if (pieces_.empty()) return start_;
  auto piece =
      std::upper_bound(pieces_.begin(), pieces_.end(), path, [](double v, const Piece &p) { return v < p.start_m; });
  piece = piece == pieces_.begin() ? piece : piece - 1;
  const double along = std::clamp(path - piece->start_m, 0.0, piece->length_m);
  State s{};
  end_of(*piece, along, s.x_m, s.y_m, s.heading_rad);
  s.way_m = piece->way_m + piece->sign * along;
  s.curvature_1pm = piece->curvature + piece->slope * along;
  s.speed_mps = piece->sign * speed;
  s.yaw_rate_radps = s.speed_mps * s.curvature_1pm;
  return s;
}

}  // namespace wm::sim
