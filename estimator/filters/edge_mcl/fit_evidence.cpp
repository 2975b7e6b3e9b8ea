// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/fit_evidence.hpp"

namespace wm {
namespace {

constexpr double kKnownLogOdds = -4.0, kUnknownLogOdds = 6.0;  // of a given pose, 2 %; of none, 99.8 %; not swept
constexpr double kLeastLogOdds = -6.0;  // 0.25 %: keeps a kidnapping noticeable within two or three scans
// Scans at least so far apart are independent evidence. Chosen with the numbers below.
constexpr double kIndependent_s = 0.5, kIndependent_m = 0.2;
constexpr double kUsual_s = 10.0, kMean_s = 60.0;             // time constants of the means; not swept
constexpr double kStartShortfall = 0.1, kStartBeyond = 0.05;  // fractions of points, before a scan; not swept
// Numbers of the test, chosen on 43 corridor-easy and corridor-hard drives (docs/consistency.md), judged on others; not
// swept one by one.
constexpr double kGain = 8.0;        // nats per unit of the explained fraction
constexpr double kShortfalls = 4.0;  // mean shortfalls by which a scan may fall below the usual
constexpr double kHidden = 0.9;      // weight of an unexplained point on this side of the map's edges
constexpr double kScanMax = 1.0;     // nats of a scan at most, besides points beyond edges: one obstacle hides much
constexpr double kReflection = 0.5;  // weight of a reflection, half of what it has where poses are compared

}  // namespace

void fit_evidence::init(const wm_edge_mcl_params &params) {
  lost_explained_ = params.lost_explained;
  lost_margin_ = params.lost_margin;
  lost_beyond_ = params.lost_beyond_weight;
  mean_explained_ = true_share_ = params.lost_explained;
  false_points_ = kFalsePoints;
  averaged_s_ = 0.0;
  mean_shortfall_ = kStartShortfall;
  mean_beyond_ = kStartBeyond;
}

void fit_evidence::reset(bool known) {
  explained_ = lost_explained_;
  odds_.reset(known ? kKnownLogOdds : kUnknownLogOdds);
}

double fit_evidence::explained_by(const normal_equations &scan) const {
  return (scan.explained + kReflection * reflection_weight(scan.seen) * scan.reflected) / scan.seen;
}

// gain x (threshold - explained), where points on this side of the map's edges count a little less, and points beyond
// them, less their usual fraction, lost.beyond_weight times. The two sides of a beam model (S. Thrun, W. Burgard, D.
// Fox, "Probabilistic Robotics", 2005, 6.3).
double fit_evidence::log_bayes_factor(const normal_equations &scan, double explained) const {
  const double edges = expected_edges(scan.seen);
  const double own = usual(scan.seen) - edges * (lost_margin_ + kShortfalls * mean_shortfall_);
  const double threshold = larger(own, edges * lost_explained_);
  const double beyond = (double)scan.beyond / scan.seen, rest = 1.0 - explained - beyond;
  const double misfit = beyond + kHidden * (rest > 0.0 ? rest : 0.0);
  const double factor = kGain * (threshold - 1.0 + misfit), unusual = beyond - kShortfalls * mean_beyond_;
  return (factor < kScanMax ? factor : kScanMax) + (unusual > 0.0 ? kGain * (lost_beyond_ - 1.0) * unusual : 0.0);
}

double fit_evidence::add(const normal_equations &scan, double dt_s, double way) {
  const double explained = explained_by(scan);
  double fresh = dt_s / kIndependent_s < way / kIndependent_m ? dt_s / kIndependent_s : way / kIndependent_m;
  if (fresh > 1.0) fresh = 1.0;
  explained_ += fresh * (explained - explained_);
  const double factor = fresh * log_bayes_factor(scan, explained);
  // Unclamped until the hazard of being carried off is in.
  odds_.reset(odds_.value() + factor);
  odds_.add_hazard(kKidnapped_per_s * dt_s);
  if (!(odds_.value() > kLeastLogOdds)) odds_.set(kLeastLogOdds);
  return factor;
}

void fit_evidence::learn(const normal_equations &scan, double dt_s) {
  const double explained = explained_by(scan);
  const double fresh = dt_s < kUsual_s ? dt_s / kUsual_s : 1.0;
  true_share_ += fresh * (explained - true_share_);
  false_points_ += fresh * (scan.seen * (1.0 - explained) - false_points_);
  averaged_s_ = averaged_s_ + dt_s < kMean_s ? averaged_s_ + dt_s : kMean_s;
  if (!(averaged_s_ > 0.0)) return;
  const double weight = dt_s / averaged_s_, lack = (usual(scan.seen) - explained) / expected_edges(scan.seen);
  mean_explained_ += weight * (explained - mean_explained_);
  mean_beyond_ += weight * ((double)scan.beyond / scan.seen - mean_beyond_);
  mean_shortfall_ += weight * ((lack > 0.0 ? lack : 0.0) - mean_shortfall_);
}

}  // namespace wm
