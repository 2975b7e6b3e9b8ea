// SPDX-License-Identifier: Apache-2.0
#include "map/triangulate.h"

#include <algorithm>
#include <cmath>

namespace wm::tools {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kAgrees_rad = 0.0175;
constexpr double kParallax_rad = 0.02;  // less between two bearings says little of the distance
constexpr int kPairs = 400;
constexpr int kRounds = 12;
constexpr double kBounded = 3.0;  // sigmas at which a residual's weight has fallen to a quarter
constexpr double kFits = 4.0;
constexpr double kFarthest_m = 1000;

// Of each sensor, in this order; behind them x and y of each landmark.
enum { kYaw, kPitch, kRoll, kX, kY, kScale, kLate, kEach };

Matrix3d turn(const Vector3d &rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

using Parameters = Eigen::Matrix<double, kEach, 1>;

double expected(const BearingSensor &sensor, const Parameters &off, const TakenBearing &b, const Vector3d &place_m) {
  Pose pose = b.pose;
  pose.p_m.head<2>() -= off[kLate] * b.twist_mps;
  pose.q = Eigen::AngleAxisd(-off[kLate] * b.turn_radps, Vector3d::UnitZ()) * pose.q;
  BearingSensor turned = sensor;
  turned.rpy_rad += Vector3d(off[kRoll], off[kPitch], off[kYaw]);
  turned.xyz_m += Vector3d(off[kX], off[kY], 0);
  return bearing_to(turned, pose, place_m) * (1 + off[kScale]);
}

// The line of sight over the floor: where it begins, its direction in map.
void line_of(const BearingSensor &sensor, const TakenBearing &b, Vector2d *from, Vector2d *along) {
  const Matrix3d in_map = b.pose.q.toRotationMatrix();
  *from = (b.pose.p_m + in_map * sensor.xyz_m).head<2>();
  const double angle = heading_rad(b.pose.q) + sensor.rpy_rad.z() + b.bearing_rad;
  *along = {std::cos(angle), std::sin(angle)};
}

double cross(const Vector2d &a, const Vector2d &b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

double bearing_to(const BearingSensor &sensor, const Pose &pose, const Vector3d &place_m) {
  const Vector3d in_base = pose.q.inverse() * (place_m - pose.p_m) - sensor.xyz_m;
  const Vector3d seen = turn(sensor.rpy_rad).transpose() * in_base;
  return std::atan2(seen.y(), seen.x());
}

SurveyedPlace agreed_place(const std::vector<BearingSensor> &sensors, const std::vector<TakenBearing *> &bearings,
                           double z_m) {
  SurveyedPlace best{};
  size_t most = 0;
  uint32_t dice = 1;
  const auto draw = [&dice, &bearings] {
    dice = dice * 1664525u + 1013904223u;
    return (dice >> 8) % bearings.size();
  };
  for (int n = 0; n < kPairs && bearings.size() >= 2; n++) {
    const TakenBearing &one = *bearings[draw()], &other = *bearings[draw()];
    Vector2d a, u, b, v;
    line_of(sensors[one.sensor], one, &a, &u);
    line_of(sensors[other.sensor], other, &b, &v);
    const double sine = cross(u, v);
    if (std::fabs(sine) < kParallax_rad) continue;
    const double ahead = cross(b - a, v) / sine;
    if (!(ahead > 0 && ahead < kFarthest_m) || !(cross(b - a, u) / sine > 0)) continue;
    const Vector2d place = a + ahead * u;
    size_t agreeing = 0;
    for (const TakenBearing *t : bearings)
      agreeing +=
          std::fabs(wrap(bearing_to(sensors[t->sensor], t->pose, {place.x(), place.y(), z_m}) - t->bearing_rad)) <
          kAgrees_rad;
    if (agreeing <= most) continue;
    most = agreeing;
    best.p_m = {place.x(), place.y(), z_m};
    best.found = agreeing >= 3;
  }
  return best;
}

void triangulate(const std::vector<BearingSensor> &sensors, const SurveyPriors &priors,
                 std::vector<TakenBearing> &bearings, std::vector<SurveyedPlace> &places) {
  const auto first = static_cast<Eigen::Index>(kEach * sensors.size());
  const Eigen::Index n = first + 2 * static_cast<Eigen::Index>(places.size());
  std::vector<Parameters> off(sensors.size(), Parameters::Zero());
  Parameters sigma;
  sigma << priors.yaw_rad, priors.tilt_rad, priors.tilt_rad, priors.place_m, priors.place_m, priors.angle_scale,
      priors.late_s;
  Eigen::MatrixXd normal;
  for (int round = 0; round <= kRounds; round++) {
    normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (size_t s = 0; s < sensors.size(); s++)
      for (Eigen::Index k = 0; k < kEach; k++) {
        const Eigen::Index at = kEach * static_cast<Eigen::Index>(s) + k;
        normal(at, at) += 1 / (sigma[k] * sigma[k]);
        right[at] -= off[s][k] / (sigma[k] * sigma[k]);
      }
    double squares = 0, count = 0;
    for (TakenBearing &b : bearings) {
      const SurveyedPlace &place = places[b.landmark];
      if (!place.found) continue;
      const BearingSensor &sensor = sensors[b.sensor];
      const double told = expected(sensor, off[b.sensor], b, place.p_m);
      b.residual_rad = wrap(b.bearing_rad - told);
      const double distance = std::max(0.3, (place.p_m - b.pose.p_m).head<2>().norm());
      b.expected_sigma_rad = std::hypot(b.sigma_rad, std::hypot(priors.pose_m / distance, priors.pose_rad));
      const double in_sigmas = b.residual_rad / b.expected_sigma_rad;
      b.fits = std::fabs(in_sigmas) < kFits;
      if (b.fits) squares += in_sigmas * in_sigmas, count++;
      const double trust = 1 / (1 + in_sigmas * in_sigmas / (kBounded * kBounded));
      // At first all that lies within a degree counts alike: the mounting may be off by more than a bearing's sigma.
      const double weight = round < 3 ? (std::fabs(b.residual_rad) < kAgrees_rad ? 1 / (0.005 * 0.005) : 0)
                                      : trust * trust / (b.expected_sigma_rad * b.expected_sigma_rad);
      Eigen::Matrix<double, kEach + 2, 1> row;
      constexpr double kStep = 1e-6;
      for (Eigen::Index k = 0; k < kEach; k++) {
        Parameters moved = off[b.sensor];
        moved[k] += kStep;
        row[k] = wrap(expected(sensor, moved, b, place.p_m) - told) / kStep;
      }
      for (Eigen::Index k = 0; k < 2; k++) {
        Vector3d moved = place.p_m;
        moved[k] += kStep;
        row[kEach + k] = wrap(expected(sensor, off[b.sensor], b, moved) - told) / kStep;
      }
      const auto index = [&](Eigen::Index k) {
        return k < kEach ? kEach * static_cast<Eigen::Index>(b.sensor) + k
                         : first + 2 * static_cast<Eigen::Index>(b.landmark) + k - kEach;
      };
      for (Eigen::Index i = 0; i < kEach + 2; i++) {
        right[index(i)] += weight * row[i] * b.residual_rad;
        for (Eigen::Index j = 0; j < kEach + 2; j++) normal(index(i), index(j)) += weight * row[i] * row[j];
      }
    }
    for (Eigen::Index i = first; i < n; i++) normal(i, i) += 1e-9;  // of landmarks that were not found
    if (round < kRounds) {
      const Eigen::VectorXd move = normal.ldlt().solve(right);
      for (size_t s = 0; s < sensors.size(); s++) off[s] += move.segment<kEach>(kEach * static_cast<Eigen::Index>(s));
      for (size_t i = 0; i < places.size(); i++)
        places[i].p_m.head<2>() += move.segment<2>(first + 2 * static_cast<Eigen::Index>(i));
      continue;
    }
    const double larger = std::max(1.0, squares / std::max(1.0, count - 2.0 * static_cast<double>(places.size())));
    const Eigen::MatrixXd covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(n, n)) * larger;
    for (size_t i = 0; i < places.size(); i++) {
      const Eigen::Index at = first + 2 * static_cast<Eigen::Index>(i);
      places[i].covariance = covariance.block<2, 2>(at, at);
      places[i].found = places[i].found && places[i].covariance.trace() < 4 && places[i].p_m.allFinite();
    }
  }
}

}  // namespace wm::tools
