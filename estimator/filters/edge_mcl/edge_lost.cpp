// SPDX-License-Identifier: Apache-2.0
// Lost or not, and relocalization.
#include "filters/core/recovery.hpp"
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// Log odds of being lost: lost above (73 %), found below (5 %); below the third (1 %) the calibration is remembered;
// below the fourth (0.4 %) nothing is suspicious; suspicious above the fifth (12 %). The hysteresis was chosen on 43
// rendered drives (docs/consistency.md); not swept one by one.
constexpr double kLostLogOdds = 1.0, kFoundLogOdds = -3.0, kTrustedLogOdds = -4.5, kNominalLogOdds = -5.5;
constexpr double kSuspiciousLogOdds = -2.0;
constexpr double kSame_m = 0.3,
                 kSame_rad = 0.15;  // an adopted pose nearer than this to the tracked one is no jump; not swept
constexpr double kFoundSigma_m = 0.1,
                 kFoundSigma_rad = 0.03;  // of a pose that the search found: its grid's half step, aligned; not swept
// While lost the pose follows odometry; its covariance grows by this up to the sigma, so that it does not freeze. Not
// swept.
constexpr double kDriftSigma_m = 0.1, kDrift_m2ps = 0.002, kDrift_rad2ps = 0.0002;
constexpr int kKeyframesSuspicious = 4, kKeyframesIdle = 10;  // of 0.4 m, from which on the map is searched
// Budgets of a scan, as divisors of search.poses: the alias sweep when all is nominal and otherwise; the idle search;
// weighing of hypotheses. And how many of these are weighed while suspicious, at most. Not swept.
constexpr int kAliasNominal = 4, kAliasOtherwise = 2, kIdle = 8, kWeighingShare = 4, kWeighedMax = 6;
constexpr int kPosesMin = place_search::kAligningCost + place_search::kWeighingCost;
static_assert(kPosesMin <= EDGE_MCL_SEARCH_POSES_LEAST && hypotheses::kPosesMin <= EDGE_MCL_SEARCH_POSES_LEAST);
// A hypothesis is adopted with this probability, this fraction explained, and so much more of it than the tracked pose.
// The margin keeps two poses of a corridor from taking turns. Not swept.
constexpr double kAdoptProbability = 0.95, kAdoptExplained = 0.6, kAdoptMargin = 0.15;
// An aliased pose is offered as a searched one, too, at these odds, or, while suspicious, where it explains so much
// more. Not swept.
constexpr double kAliasOdds = 0.01, kAliasMargin = 0.4;
// Sigma of a tracked place beyond which the descents along its most open axis need not reach the true one, m. By one
// second of swapped bytes on corridor-a (tests/contract/accuracy.py); not swept.
constexpr double kSurePlace_m = 0.5;
constexpr double kNotKidnapped =
    7.0;                          // log prior odds of the tracked pose: 1 kidnapping in 1100 windows of 6 m; not swept
constexpr double kNoPose = -1e3;  // the same where there is no tracked pose

constexpr double kFoundCovariance[3][3] = {{kFoundSigma_m * kFoundSigma_m, 0, 0},
                                           {0, kFoundSigma_m *kFoundSigma_m, 0},
                                           {0, 0, kFoundSigma_rad *kFoundSigma_rad}};

}  // namespace

// Odds of all hypotheses but the tracked one. While searching there is no tracked pose to hold them against.
double edge_mcl::lost_log_odds() const {
  const double elsewhere = life_.searching() ? 0.0 : others_.searched_odds();
  return log(exp(fit_.log_odds()) + others_.aliased_odds() + elsewhere) + landmark_log_bayes();
}

void edge_mcl::update_lost(const normal_equations &scan, double dt_s) {
  if (scan.seen < fit_evidence::kPointsMin) return;
  const double way = filter_.travelled_m() + filter_.turned_rad() - watched_m_;
  watched_m_ += way;
  update_state(fit_.add(scan, dt_s, way));
  update_suspicion();
  if (life_.tracking() && lost_log_odds() < kTrustedLogOdds) {
    rollback_.remember(filter_, filter_.now_ns());
    fit_.learn(scan, dt_s);
  }
  if (!life_.tracking() && filter_.variance(kX) < square(kDriftSigma_m))
    filter_.inflate_pose(kDrift_m2ps * dt_s, kDrift_rad2ps * dt_s);
}

void edge_mcl::update_state(double log_bayes_factor) {
  const double odds = lost_log_odds();
  if (life_.tracking() && log_bayes_factor < 0.0 && odds < kTrustedLogOdds) search_.mark();
  if (life_.tracking() && odds > kLostLogOdds) {
    lose();
  } else if (!life_.tracking() && odds < kFoundLogOdds) {
    life_.confirmed();
    tentative_ = false;
  } else if (odds > kLostLogOdds) {
    if (tentative_) refuted_ns_ = filter_.now_ns();
    tentative_ = false;
  }
}

// Suspicious: the search looks at recent keyframes only, since the scans last fitted, or since an alias began to be
// likelier (E. S. Page, "Continuous inspection schemes", 1954).
void edge_mcl::update_suspicion() {
  const double odds = lost_log_odds();
  if (suspicious_ && odds < kTrustedLogOdds) suspicious_ = false;
  if (suspicious_ || !(odds > kSuspiciousLogOdds)) return;
  suspicious_ = true;
  map_searched_ = false;
  if (fit_.log_odds() > kSuspiciousLogOdds)
    search_.begin_at_mark();
  else
    search_.begin_ago(others_.likelier_for_m());
}

// Motion sensors were silent: keyframes from before and after the gap have no known relation.
void edge_mcl::on_motion_gap() {
  search_.clear();
  odometry_.clear();
  others_.carry(filter_.pose(), filter_.odom());
  others_.drop_searched(filter_.pose());
  suspicious_ = tentative_ = true;
  map_searched_ = false;
  if (life_.tracking()) life_.lose(filter_.now_ns());
  if (fit_.log_odds() < 0.0) fit_.set_log_odds(0.0);
}

// A wrong pose pulls the calibration after it.
void edge_mcl::lose() {
  life_.lose(filter_.now_ns());
  rollback_.restore(&filter_);
  if (has_landmarks_) landmarks_.release(&filter_);
  forget_walls();
}

// Aliases of the tracked pose are swept for while it is trusted: with a small budget while all is nominal, with more,
// by a new sweep, as soon as it is not. While suspicious they are carried on and weighed only; the search has the
// budget.
void edge_mcl::update_aliases(double dt_s) {
  const double way = filter_.travelled_m() - aliases_m_;
  aliases_m_ += way;
  const bool sure = life_.tracking() && !suspicious_, nominal = fit_.log_odds() < kNominalLogOdds;
  if (nominal_ && !nominal) others_.restart_sweep();
  nominal_ = nominal;
  const int share = params_.search_poses / (nominal ? kAliasNominal : kAliasOtherwise);
  const int poses = share > hypotheses::kPosesMin ? share : hypotheses::kPosesMin;
  others_.update_aliased(map_, search_.field(), scan_, way, fit_.mean_explained(), sure ? kKidnapped_per_s * dt_s : 0.0,
                         sure ? poses : 0);
  if (life_.searching()) return;
  constexpr double kNoError[kMountingAll] = {};
  const auto offer = [&](const hypothesis &alias) { others_.offer(alias.pose, alias.explained, kNoError); };
  for (int i = 0; i < others_.aliased(); i++)
    if (others_.alias(i).odds > kAliasOdds) offer(others_.alias(i));
  const int best = others_.best_aliased();
  if (suspicious_ && best >= 0 && others_.alias(best).explained > kAliasMargin &&
      others_.searched() < hypotheses::kSearchedMax / 2)
    offer(others_.alias(best));
}

// The search brings hypotheses, with a small budget while nothing is suspicious; the keyframes of the last metres weigh
// them.
void edge_mcl::relocalize() {
  others_.carry(filter_.pose(), filter_.odom());
  if (search_.keyframes() < (suspicious_ ? kKeyframesSuspicious : kKeyframesIdle)) return;
  int poses = params_.search_poses;
  if (!suspicious_) poses = poses / kIdle > kPosesMin ? poses / kIdle : kPosesMin;
  const int affordable = poses / kWeighingShare / place_search::kWeighingCost;
  const int weighed = !suspicious_ || affordable < 1 ? 1 : affordable < kWeighedMax ? affordable : kWeighedMax;
  if (search_.step(map_, poses - weighed * place_search::kWeighingCost, filter_.odom())) {
    others_.offer(search_);
    map_searched_ = true;
  }
  const bool tracking = life_.tracking();
  const double own_prior = tracking ? kNotKidnapped : life_.searching() && !tentative_ ? kNoPose : 0.0;
  // The tracked pose was corrected by the filter all along: it explains at least what it does now.
  const double own_least = tracking ? fit_.explained() : 0.0;
  // While lost, keyframes of few points count like others: the tracked pose has no advantage to defend.
  const double information = tracking ? search_.information() : (double)search_.keyframes();
  others_.weigh(map_, &search_, own_prior, own_least, information, weighed);
  decide();
}

// Adopts the best hypothesis, or begins to trust the tracked pose again. While lost, or unsure of its place, not before
// the whole map has been searched: the true pose may not be in the list yet.
void edge_mcl::decide() {
  const int best = others_.best();
  const hypothesis &there = others_[best];
  if (!there.weighed || there.probability < kAdoptProbability || there.explained < kAdoptExplained) return;
  const bool tracking = life_.tracking();
  const double margin = life_.searching() ? 0.0 : kAdoptMargin;
  const bool sure = tracking && filter_.variance(kX) + filter_.variance(kY) < square(kSurePlace_m);
  if (best > 0 && (sure || map_searched_) && there.explained >= others_[0].explained + margin) {
    adopt(best);
  } else if (best == 0 && !tracking && !tentative_) {
    fit_.set_log_odds(0.0);
    others_.forget_aliased_odds();
    tentative_ = true;
  }
}

void edge_mcl::adopt(int hypothesis) {
  const wm_pose2 pose = others_[hypothesis].pose;
  begin_tentative(pose);
  others_.adopt(hypothesis);
  others_.forget_aliased_odds();
  filter_.set_pose(pose, kFoundCovariance);
}

// The robot is taken to be there; later data confirm it.
void edge_mcl::begin_tentative(const wm_pose2 &pose) {
  if (life_.tracking()) lose();
  fit_.set_log_odds(0.0);
  landmark_fit_.begin(kFoundWrong);
  // Landmarks that contradicted the pose before have not moved.
  for (size_t i = 0; has_landmarks_ && i < setup_->landmark_count; i++) records_[i] = {};
  suspicious_ = tentative_ = true;
  if (!same_pose(wm_pose2{}, between(filter_.pose(), pose), kSame_m, kSame_rad)) life_.jumped();
  odometry_.clear();
}

// Moments of all hypotheses about the published pose; while lost, the rest of the probability is spread over the map.
void edge_mcl::add_hypotheses_spread(wm_estimate *out) const {
  const int at[3] = {0, 1, 5};
  const wm_pose2 pose = {out->pose_map_base.p_m[0], out->pose_map_base.p_m[1], out->heading_rad};
  double rest = 1.0;
  for (int i = 0; i < others_.searched(); i++) {
    const hypothesis &h = others_[i];
    rest -= h.probability;
    if (i == 0) continue;
    const double d[3] = {h.pose.x_m - pose.x_m, h.pose.y_m - pose.y_m, wrap(h.pose.heading_rad - pose.heading_rad)};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) out->covariance[wm_cov_index(at[r], at[c])] += h.probability * d[r] * d[c];
  }
  if (life_.tracking()) return;
  if (!tentative_) rest = 1.0;
  const wm_raster &map = map_.raster();
  const double width = map.width_px * map.resolution_m, height = map.height_px * map.resolution_m;
  const double anywhere = rest * (square(width) + square(height)) / 12.0;
  out->covariance[wm_cov_index(0, 0)] += anywhere;
  out->covariance[wm_cov_index(1, 1)] += anywhere;
  out->covariance[wm_cov_index(5, 5)] += rest * square(kPi) / 3.0;
}

}  // namespace wm
