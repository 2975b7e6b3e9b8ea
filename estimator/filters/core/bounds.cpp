// SPDX-License-Identifier: Apache-2.0
#include "waymark/bounds.h"

#include <cmath>
#include <limits>

#include "filters/core/evidence.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
// The error of an estimate over its sigma is Student's: of a Gaussian whose sigma is itself known to a factor. With so
// many degrees of freedom no share of the poses of a thousand simulated drives of 15 worlds is beyond what it says
// (docs/usable.md).
constexpr double kDof = 10.0;
// A heading with a larger bound is not known, where the configuration has no limit; a longer drive is no advice.
constexpr double kVague_rad = 20.0 * kPi / 180.0, kLongestDrive_m = 100.0;

// The sigmas that an error on two axes exceeds with this probability; on one axis it does so less often.
double ratio_of(double share) { return share < 1.0 ? std::sqrt(kDof * (exp(-2.0 / kDof * log(share)) - 1.0)) : 0.0; }

// Along one axis of the pose: how far off other poses are, and their sigmas.
using member = double wm_other_pose::*;
struct mixture {
  const wm_other_pose *others;
  size_t count;
  double sigma, anywhere;  // of the estimate; probability of a pose that is not known
  member distance, own_sigma;
};

// Where the others together have more than nine tenths of the risk that is left, each of them gets an equal share of
// these, and the estimate's own error the rest: the risk in all. Student's bound for a tenth of 1e-4 is 1.3 times as
// large.
double bound_of(const mixture &of, double risk) {
  if (!(of.anywhere < risk)) return kUnbounded;
  const double left = (risk - of.anywhere) / (1.0 - of.anywhere), most = 0.9 * left;
  double known = 0.0;
  for (size_t i = 0; i < of.count; i++) known += of.others[i].probability;
  if (!(known > most)) return of.sigma * ratio_of(left - known);
  double bound = of.sigma * ratio_of(left - most);
  for (size_t i = 0; i < of.count; i++) {
    const wm_other_pose &o = of.others[i];
    const double share = most / (static_cast<double>(of.count) * o.probability);
    if (share < 1.0) bound = larger(bound, o.*of.distance + o.*of.own_sigma * ratio_of(share));
  }
  return bound;
}

double sigma_of_position(const wm_estimate &e) {
  const double *p = e.covariance;
  const double a = p[wm_cov_index(0, 0)], b = p[wm_cov_index(0, 1)], c = p[wm_cov_index(1, 1)];
  return std::sqrt(0.5 * (a + c) + std::sqrt(square(0.5 * (a - c)) + square(b)));
}

// Between two places that are known as well as this one, a straight drive of this length gives the heading that sigma.
double drive_for(const wm_estimate &e, double sigma_rad) {
  const double way_m = std::sqrt(2.0) * sigma_of_position(e) / sigma_rad;
  return way_m < kLongestDrive_m ? way_m : std::numeric_limits<double>::quiet_NaN();
}

// Of either of two independent ones.
double both(double a, double b) { return a + b - a * b; }

double or_none(double limit) { return limit > 0.0 ? limit : kUnbounded; }

// What the estimate's own probability of being wrong has above its floor, which says only that nothing contradicts, and
// that no other pose explains.
double wrong_elsewhere(const wm_estimate &e, const wm_other_pose *others, size_t count) {
  double known = probability_of(kMinLogOdds);
  for (size_t i = 0; i < count; i++) known += others[i].probability;
  return larger(e.lost_probability - known, 0.0);
}

uint8_t why_not(const wm_estimate &e, const wm_bound &bound, double wrong, double untested, bool without_heading) {
  if (e.state == WM_STATE_SEARCHING) return WM_UNUSABLE_NO_POSE;
  if (!finite(e.lost_probability)) return WM_UNUSABLE_UNMONITORED;
  if (!(wrong < bound.risk)) return WM_UNUSABLE_DOUBT;
  if (!(both(wrong, untested) < bound.risk)) return WM_UNUSABLE_UNTESTED;
  if (!finite(bound.horizontal_m) || bound.horizontal_m > bound.limit_m) return WM_UNUSABLE_POSITION;
  const bool has_heading = without_heading || finite(bound.heading_rad);
  return !has_heading || bound.heading_rad > bound.limit_rad ? WM_UNUSABLE_HEADING : WM_UNUSABLE_NOT;
}

}  // namespace
}  // namespace wm

wm_other_pose wm_other_pose_of(const wm_estimate *estimate, const wm_hypothesis *hypothesis) {
  const double *p = hypothesis->covariance;
  const double x_m = hypothesis->x_m - estimate->pose_map_base.p_m[0];
  const double y_m = hypothesis->y_m - estimate->pose_map_base.p_m[1];
  wm_other_pose out = {};
  out.distance_m = std::sqrt(wm::square(x_m) + wm::square(y_m));
  out.turn_rad = std::fabs(wm::wrap(hypothesis->heading_rad - estimate->heading_rad));
  out.sigma_m = std::sqrt(0.5 * (p[0] + p[2]) + std::sqrt(wm::square(0.5 * (p[0] - p[2])) + wm::square(p[1])));
  out.sigma_rad = std::sqrt(p[5]);
  out.probability = hypothesis->weight;
  return out;
}

void wm_bound_of(const wm_estimate *estimate, double untested, const wm_integrity *integrity,
                 const wm_other_pose *others, size_t count, wm_bound *out) {
  using namespace wm;
  const wm_estimate &e = *estimate;
  *out = {};
  out->t_ns = e.t_ns;
  out->risk = integrity->risk;
  out->limit_m = or_none(integrity->limit_m);
  out->limit_rad = or_none(integrity->limit_rad);
  out->cause = e.cause;
  out->cause_source = e.cause_source;
  const double wrong = wrong_elsewhere(e, others, count), anywhere = both(wrong, untested);
  const bool has_pose = e.state != WM_STATE_SEARCHING && std::isfinite(e.lost_probability);
  const auto bound = [&](double sigma, member distance, member own_sigma) {
    return has_pose && std::isfinite(sigma) ? bound_of({others, count, sigma, anywhere, distance, own_sigma}, out->risk)
                                            : kUnbounded;
  };
  out->horizontal_m = bound(sigma_of_position(e), &wm_other_pose::distance_m, &wm_other_pose::sigma_m);
  out->heading_rad =
      bound(std::sqrt(e.covariance[wm_cov_index(5, 5)]), &wm_other_pose::turn_rad, &wm_other_pose::sigma_rad);
  if (out->heading_rad > kPi) out->heading_rad = kUnbounded;
  out->why = why_not(e, *out, wrong, untested, integrity->without_motion != 0);
  out->usable = out->why == WM_UNUSABLE_NOT;
  const double wanted_rad = std::isfinite(out->limit_rad) ? out->limit_rad : kVague_rad;
  if (out->heading_rad > wanted_rad && std::isfinite(out->horizontal_m))
    out->heading_after_m = integrity->without_motion ? std::numeric_limits<double>::quiet_NaN()
                                                     : drive_for(e, wanted_rad / ratio_of(out->risk));
}
