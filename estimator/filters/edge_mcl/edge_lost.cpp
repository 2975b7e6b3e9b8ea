// SPDX-License-Identifier: Apache-2.0
// Is the robot where the filter says? And if not, where?
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOddsMax = 6.0;
constexpr double kLostOdds = 1.0, kFoundOdds = -3.0, kTrustedOdds = -4.5, kEasyOdds = -5.5, kMemory_s = 2.0,
                 kUsual_s = 10.0, kExpected_s = 60.0;
constexpr double kApart_m = 0.3, kApart_rad = 0.15;
constexpr double kFoundSigma_m = 0.1, kFoundSigma_rad = 0.03;
constexpr double kFresh_s = 0.5, kFresh_m = 0.2;  // scans further apart speak each for itself
constexpr double kWander_m = 0.1, kLoosened_m2ps = 0.002, kLoosened_rad2ps = 0.0002;
constexpr double kDoubtOdds = -2.0;
// Held against other places an image speaks for one's own as an edge does; of itself it says less.
constexpr double kImageSpeaks = 0.5;
constexpr int kFewKeyframes = 4, kManyKeyframes = 10;  // 0.4 m each
constexpr int kAtEase = 4, kNotAtEase = 2;             // a scan's work through it is what a sweep for look-alikes has
constexpr int kLeisure = 8, kWeighedInDoubt = 6, kWeighingShare = 4;
constexpr int kPosesLeast = place_search::kAligningCost + place_search::kWeighingCost;
static_assert(kPosesLeast <= EDGE_MCL_SEARCH_POSES_LEAST && lookalikes::kPosesLeast <= EDGE_MCL_SEARCH_POSES_LEAST);
constexpr double kBetter = 0.15, kMuchBetter = 0.4, kRival = 0.01;
constexpr double kCarriedOff = 7.0;  // odds that nobody has carried it off in the last metres, logarithm of
constexpr double kNowhere = -1e3;

bool near(const wm_pose2 &a, const wm_pose2 &b) {
  const wm_pose2 way = between(a, b);
  return square(way.x_m) + square(way.y_m) < square(kApart_m) && std::fabs(way.heading_rad) < kApart_rad;
}

}  // namespace

// What a scan says of being lost, as the logarithm of the odds: by the share of its points that the map explains from
// the pose, and by where the others are.
double edge_mcl::speaks_for_lost(const normal_equations &scan, double explained) const {
  // Every scan holds some points that are no edge of the map, wherever it was taken: where few are seen, in the dark,
  // they are most of them. And places differ in how much of them a map explains, and drives in how often it is less:
  // what is usual here, and by what scans fall short of it, set the bar.
  const double own_bar = usual_ - params_.lost_below - params_.lost_spread * shortfall_;
  const double bar = can_be_edges(scan.seen) * (own_bar > params_.lost_explained ? own_bar : params_.lost_explained);
  // On this side of the map's edges may stand what the map doesn't have, or the floor may change; one such thing hides
  // all behind it, so that all of the points together say little. But nobody sees through a wall.
  const double through = (double)scan.through / scan.seen, rest = 1.0 - explained - through;
  const double misfit = through + params_.lost_hidden * (rest > 0.0 ? rest : 0.0);
  const double said = params_.lost_gain * (bar - 1.0 + misfit);
  const double unusual = through - params_.lost_spread * usual_through_;
  return (said < params_.lost_most ? said : params_.lost_most) +
         (unusual > 0.0 ? params_.lost_gain * (params_.lost_through - 1.0) * unusual : 0.0);
}

// The odds of being lost: each scan speaks, scans of one moment or of one place together no more than once; and out of
// the blue somebody lifts the robot.
void edge_mcl::watch(const normal_equations &scan, double dt_s) {
  const int seen = scan.seen;
  if (seen < 8) return;
  const double explained = (scan.explained + kImageSpeaks * image_counts(seen) * scan.before) / seen;
  const double way = filter_.travelled_m() + filter_.turned_rad() - watched_m_;
  watched_m_ += way;
  double fresh = dt_s / kFresh_s < way / kFresh_m ? dt_s / kFresh_s : way / kFresh_m;
  if (fresh > 1.0) fresh = 1.0;
  explained_ += fresh * (explained - explained_);
  const double said = fresh * speaks_for_lost(scan, explained);
  lost_odds_ += said;
  // p := p + (1 - p) rate dt
  const double p = 1.0 / (1.0 + exp(-lost_odds_)), blue = p + (1.0 - p) * params_.lost_per_s * dt_s;
  lost_odds_ = log(blue / (1.0 - blue));
  if (!(lost_odds_ < kOddsMax)) lost_odds_ = kOddsMax;
  if (!(lost_odds_ > -kOddsMax)) lost_odds_ = -kOddsMax;

  const double odds = odds_lost();
  if (state_ == WM_STATE_TRACKING && said < 0.0 && odds < kTrustedOdds) search_.mark();
  if (state_ == WM_STATE_TRACKING && odds > kLostOdds) {
    state_ = WM_STATE_LOST;
    restore_calibration();
  } else if (state_ != WM_STATE_TRACKING && odds < kFoundOdds) {
    state_ = WM_STATE_TRACKING;
    relocalizations_++;
    on_trial_ = false;
  } else if (on_trial_ && odds > kLostOdds) {
    on_trial_ = false;
  }
  if (!in_doubt_ && odds > kDoubtOdds) {
    in_doubt_ = true;
    swept_ = false;
    if (lost_odds_ > kDoubtOdds)
      search_.begin_at_mark();
    else
      search_.begin_ago(alike_.likelier_for_m());
  } else if (in_doubt_ && odds < kTrustedOdds) {
    in_doubt_ = false;
  }
  if (state_ == WM_STATE_TRACKING && odds < kTrustedOdds) {
    remember_calibration();
    const double many = can_be_edges(seen);
    usual_ += dt_s / kUsual_s * (explained - many * usual_);
    expected_s_ = expected_s_ + dt_s < kExpected_s ? expected_s_ + dt_s : kExpected_s;
    if (expected_s_ > 0.0) {
      const double lack = usual_ - explained / many;
      expected_ += dt_s / expected_s_ * (explained - expected_);
      usual_through_ += dt_s / expected_s_ * ((double)scan.through / seen - usual_through_);
      shortfall_ += dt_s / expected_s_ * ((lack > 0.0 ? lack : 0.0) - shortfall_);
    }
  }
  // Its own place stays one of those that are possible, so it is not left to wander to what happens to fit.
  if (state_ != WM_STATE_TRACKING && filter_.variance(kX) < square(kWander_m))
    filter_.inflate_pose(kLoosened_m2ps * dt_s, kLoosened_rad2ps * dt_s);
}

double edge_mcl::odds_lost() const {
  const double elsewhere = state_ == WM_STATE_TRACKING ? others_.odds_elsewhere() : 0.0;
  return log(exp(lost_odds_) + alike_.odds() + elsewhere);
}

// Motion sensors were silent. Scans from before can't be put together with those from now on, and whether the next
// scans fit must show soon.
void edge_mcl::doubt_motion() {
  search_.clear();
  others_.clear(filter_.pose(), filter_.odom());
  in_doubt_ = on_trial_ = true;
  swept_ = false;
  if (state_ == WM_STATE_TRACKING) state_ = WM_STATE_LOST;
  if (lost_odds_ < 0.0) lost_odds_ = 0.0;
}

void edge_mcl::remember_calibration() {
  const wm_time_ns now = filter_.now_ns();
  if (remembered_ns_ != WM_TIME_NONE && wm_seconds_between(remembered_ns_, now) < kMemory_s) return;
  remembered_ns_ = now;
  memory_[0] = memory_[1];
  for (int i = kPoseStates; i < filter_.states(); i++) {
    memory_[1].value[i] = filter_.value(i);
    memory_[1].variance[i] = filter_.variance(i);
  }
}

void edge_mcl::restore_calibration() {
  for (int i = kPoseStates; i < filter_.states(); i++) filter_.forget(i, memory_[0].value[i], memory_[0].variance[i]);
}

// Which places look as the one that is tracked? They are looked for at leisure while what is seen is what was to be
// expected; with half of a scan's work, and with a sweep of that scan's own, as soon as it isn't: if somebody has just
// set the robot down elsewhere, it is now that it shows. In doubt the search needs the work: they are carried on.
void edge_mcl::look_for_lookalikes(double dt_s) {
  const double way = filter_.travelled_m() - alike_m_;
  alike_m_ += way;
  alike_.carry(filter_.odom());
  const bool sure = state_ == WM_STATE_TRACKING && !in_doubt_, at_ease = lost_odds_ < kEasyOdds;
  if (at_ease_ && !at_ease) alike_.begin_again();
  at_ease_ = at_ease;
  const int share = params_.search_poses / (at_ease ? kAtEase : kNotAtEase);
  const int poses = share > lookalikes::kPosesLeast ? share : lookalikes::kPosesLeast;
  alike_.look(map_, search_.field(), lined_, filter_.pose(), way, expected_, sure ? params_.lost_per_s * dt_s : 0.0,
              sure ? poses : 0);
  // A sweep at leisure over what the last metres looked like takes a while. What has become likely among those that
  // look the same is weighed by it at once; in doubt also what explains much more.
  constexpr double kNoError[kSlackMost] = {};
  for (int i = 0; state_ != WM_STATE_SEARCHING && i < alike_.count(); i++)
    if (alike_[i].weight > kRival) others_.offer(alike_[i].pose, alike_[i].explained, kNoError);
  const int best = alike_.best();
  if (in_doubt_ && state_ != WM_STATE_SEARCHING && best >= 0 && alike_[best].explained > kMuchBetter &&
      others_.count() < hypotheses::kMost / 2)
    others_.offer(alike_[best].pose, alike_[best].explained, kNoError);
}

// Where else could it be? Sweeps over the map bring places, at leisure while there is no doubt; what the last metres
// say of each decides.
void edge_mcl::ponder() {
  others_.carry(filter_.pose(), filter_.odom());
  if (search_.keyframes() < (in_doubt_ ? kFewKeyframes : kManyKeyframes)) return;
  // A scan's work is bounded: what weighing may need is set aside, the rest is the search's.
  int poses = params_.search_poses;
  if (!in_doubt_) poses = poses / kLeisure > kPosesLeast ? poses / kLeisure : kPosesLeast;
  const int affordable = poses / kWeighingShare / place_search::kWeighingCost;
  const int weighed = !in_doubt_ || affordable < 1 ? 1 : affordable < kWeighedInDoubt ? affordable : kWeighedInDoubt;
  if (search_.step(map_, poses - weighed * place_search::kWeighingCost, filter_.odom())) {
    others_.offer(search_);
    swept_ = true;
  }
  const double own_prior = state_ == WM_STATE_SEARCHING && !on_trial_ ? kNowhere
                           : state_ == WM_STATE_TRACKING              ? kCarriedOff
                                                                      : 0.0;
  // One's own place explains at least what it explains now: it has been corrected all along, the others have not.
  const double own_least = state_ == WM_STATE_TRACKING ? explained_ : 0.0;
  const double telling = state_ == WM_STATE_TRACKING ? search_.telling() : (double)search_.keyframes();
  others_.weigh(map_, &search_, own_prior, own_least, telling, weighed);
  const int best = others_.best();
  const hypothesis &there = others_[best];
  const bool sure = there.weighed && there.share >= params_.search_share && there.explained >= params_.search_explained;
  // Lost: until all of the map has been looked at, the true place may be none of those that are known.
  const bool known = state_ == WM_STATE_TRACKING || swept_;
  if (best > 0 && sure && known &&
      there.explained >= others_[0].explained + (state_ == WM_STATE_SEARCHING ? 0.0 : kBetter)) {
    take_place(best);
  } else if (best == 0 && sure && state_ != WM_STATE_TRACKING && !on_trial_) {
    lost_odds_ = 0.0;
    alike_.forget_odds();
    on_trial_ = true;
  }
}

void edge_mcl::take_place(int hypothesis) {
  const double covariance[3][3] = {
      {square(kFoundSigma_m), 0, 0}, {0, square(kFoundSigma_m), 0}, {0, 0, square(kFoundSigma_rad)}};
  const wm_pose2 pose = others_[hypothesis].pose;
  if (state_ == WM_STATE_TRACKING) {
    state_ = WM_STATE_LOST;
    restore_calibration();
  }
  lost_odds_ = 0.0;
  in_doubt_ = on_trial_ = true;
  if (!near(filter_.pose(), pose)) resets_++;
  others_.adopt(hypothesis);
  alike_.forget_odds();
  filter_.set_pose(pose, covariance);
}

// The covariance of all that is possible about the pose that is given out: the places with their probabilities; while
// lost, what is left may be anywhere in the map.
void edge_mcl::spread_over_hypotheses(wm_estimate *out) const {
  const int at[3] = {0, 1, 5};
  const wm_pose2 pose = {out->pose_map_base.p_m[0], out->pose_map_base.p_m[1], out->heading_rad};
  double rest = 1.0;
  for (int i = 0; i < others_.count(); i++) {
    const hypothesis &h = others_[i];
    rest -= h.share;
    if (i == 0) continue;
    const double d[3] = {h.pose.x_m - pose.x_m, h.pose.y_m - pose.y_m, wrap(h.pose.heading_rad - pose.heading_rad)};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) out->covariance[wm_cov_index(at[r], at[c])] += h.share * d[r] * d[c];
  }
  if (state_ == WM_STATE_TRACKING) return;
  if (!on_trial_) rest = 1.0;
  const wm_raster &map = map_.raster();
  const double width = map.width_px * map.resolution_m, height = map.height_px * map.resolution_m;
  const double anywhere = rest * (square(width) + square(height)) / 12.0;
  out->covariance[wm_cov_index(0, 0)] += anywhere;
  out->covariance[wm_cov_index(1, 1)] += anywhere;
  out->covariance[wm_cov_index(5, 5)] += rest * square(kPi) / 3.0;
}

}  // namespace wm
