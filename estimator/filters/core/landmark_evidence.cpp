// SPDX-License-Identifier: Apache-2.0
#include "filters/core/landmark_evidence.hpp"

#include <cmath>

#include "math/elementary.hpp"

// Constants without another source were chosen on drawn crossings (waymark-montecarlo --trials, seeds 1 to 100, easy
// and hard) and not swept one by one.
namespace wm {
namespace {

constexpr double kFalseShare = 0.2;                  // of detections, when nothing is known of the detector
constexpr double kMinBayes = -4.0, kMaxBayes = 8.0;  // nats a landmark: so that a change is noticed in seconds
constexpr double kFullWeight_s = 0.3;  // observations nearer in time share their errors, and count in part
constexpr double kMemory_s = 3.0;      // time constant of forgetting a landmark's L
// Probabilities that a landmark has moved, or that something beside it is taken for it, each time from the same place:
// before it was confirmed, after, and once it contradicted others that fit.
constexpr double kMoved = 0.035, kConfirmedMoved = 0.002, kKnownMoved = 0.9;
constexpr double kMeanGain = 0.1;      // of the running mean of normalised innovations; white ones: sigma 0.23
constexpr double kMeanOutlier = 10.0;  // sigmas; beyond, an innovation does not enter that mean
constexpr double kBiased = 1.2;        // sigmas: five times the mean's own
constexpr double kBetter = 0.6;        // of that bias, at most, for the landmarks that fit
constexpr double kRecent_s = 1.0;
constexpr int kProvenAfter = 12;  // observations
// Misfits are alike within kAlike_rad, and this much more for each second between them (a robot that turns and drives).
constexpr double kAlike_rad = 0.2, kAlikeDrift_radps = 0.1, kAlike_s = 6.0;
constexpr double kAlikeWeight = 2.0;     // of an alike misfit within kSeldom_s
constexpr double kSeldom_s = 0.5;        // identities that are misread now and then are alike, too:
constexpr double kSeldomWeight = 0.5;    // longer apart, misfits weigh less
constexpr double kPositionWrong = 0.05;  // probability that a position is wrong by multipath, which passes with ...
constexpr double kPositionWrong_s = 5.0;
constexpr double kKidnapped = -5.0;                  // log prior of a kidnapped robot, once the pose is proven
constexpr int kEnough = 3;                           // landmarks; two fit some pose near by in any case
constexpr double kFitting = -1.5, kSurelyNot = 6.9;  // nats

}  // namespace

double landmark_evidence::log_bayes_factor(double density, double clutter_volume) {
  return -log((1.0 - kFalseShare) * density * clutter_volume + kFalseShare);
}
double landmark_evidence::max_log_bayes_factor() { return -log(kFalseShare); }

// The factor by which a landmark divides the odds of being lost.
double landmark_evidence::likelihood_kept(double log_bayes, double moved) {
  return (1.0 - moved) * exp(-log_bayes) + moved;
}

// The source of this key; the one not seen for longest is replaced.
landmark_evidence::source &landmark_evidence::source_of(int key, wm_time_ns t_ns, double angle_rad, bool *known) {
  int at = 0, oldest = 0;
  for (; at < count_ && source_[at].key != key; at++)
    if (source_[at].t_ns < source_[oldest].t_ns) oldest = at;
  *known = at < count_;
  if (!*known) at = count_ < kSources ? count_++ : oldest;
  source &s = source_[at];
  if (!*known) s = {key, 0.0, 1.0, 0.0, angle_rad, 0.0, t_ns, WM_TIME_NONE};
  return s;
}

// A misfit confirmed by the previous one of this landmark counts more than one alone, which does not count at all. One
// that lies elsewhere cancels the previous one: false detections scatter.
double landmark_evidence::scatter_checked(source &s, double log_bayes, double angle_rad, double dt, bool known) {
  const double near_rad = kAlike_rad + kAlikeDrift_radps * dt;
  const double apart_rad = std::fabs(wrap(angle_rad - s.angle_rad));
  s.angle_rad = angle_rad;
  if (!known || dt > kAlike_s) return finite(angle_rad) ? 0.0 : log_bayes;
  if (apart_rad <= near_rad) return log_bayes * (dt < kSeldom_s ? kAlikeWeight : kSeldomWeight);
  if (!(apart_rad > near_rad)) return log_bayes;  // no angle
  const double previous = s.log_bayes > 0.0 ? s.log_bayes / s.fresh : 0.0;
  return -(log_bayes < previous ? log_bayes : previous);
}

void landmark_evidence::note(wm_time_ns t_ns, int key, double log_bayes, double angle_rad, double normalised,
                             landmark_record *record) {
  bool known;
  source &s = source_of(key, t_ns, angle_rad, &known);
  const double dt = wm_seconds_between(s.t_ns, t_ns);
  if (known && dt > 0.0) {  // several of one stamp weigh alike
    s.log_bayes *= exp(-dt / kMemory_s);
    s.fresh = dt < kFullWeight_s ? dt / kFullWeight_s : 1.0;
  }
  s.t_ns = t_ns;
  if (std::fabs(normalised) < kMeanOutlier) s.mean += kMeanGain * (normalised - s.mean);
  if (log_bayes > 0.0) log_bayes = scatter_checked(s, log_bayes, angle_rad, dt, known);
  s.log_bayes += s.fresh * log_bayes;
  if (s.log_bayes < kMinBayes) s.log_bayes = kMinBayes;
  if (s.log_bayes > kMaxBayes) s.log_bayes = kMaxBayes;
  if (s.log_bayes <= 0.0) s.bad_since_ns = WM_TIME_NONE;
  if (s.log_bayes > 0.0 && s.bad_since_ns == WM_TIME_NONE) s.bad_since_ns = t_ns;
  if (record) {
    if (s.log_bayes <= kFitting) record->confirmed = 1;
    s.moved = record->moved ? kKnownMoved : record->confirmed ? kConfirmedMoved : kMoved;
  } else {
    const double bad_s = s.bad_since_ns == WM_TIME_NONE ? 0.0 : wm_seconds_between(s.bad_since_ns, t_ns);
    s.moved = kPositionWrong * exp(-bad_s / kPositionWrong_s);
  }
  sum(t_ns);
}

// One logarithm of the product rather than one a landmark: terms lie between m and exp(4), so that 24 of them neither
// overflow nor vanish.
double landmark_evidence::log_of_sources(wm_time_ns t_ns, double *best_out) const {
  double product = 1.0, best = 1.0;
  for (int i = 0; i < count_; i++) {
    const source &s = source_[i];
    const double left = s.t_ns == t_ns ? 1.0 : exp(-wm_seconds_between(s.t_ns, t_ns) / kMemory_s);
    const double kept = likelihood_kept(s.log_bayes * left, s.moved);
    product *= kept;
    if (s.key >= 0 && kept > best) best = kept;
  }
  if (best_out) *best_out = best;
  return log(product / best);  // without the landmark that fits best
}

void landmark_evidence::sum(wm_time_ns t_ns) {
  double best;
  odds_.set(prior_ - log_of_sources(t_ns, &best));
  observed_++;
  if (contradicted()) contradicted_once_ = true;
  if (!proven_ && observed_ >= kProvenAfter && (contradicted_once_ ? log_odds() : log_odds() - log(best)) < kTrusted) {
    proven_ = true;
    prior_ = kKidnapped;
  }
  if (fits())
    doubted_since_ns_ = WM_TIME_NONE;
  else if (doubted_since_ns_ == WM_TIME_NONE)
    doubted_since_ns_ = t_ns;
}

bool landmark_evidence::biased(int key, wm_time_ns t_ns) const {
  double own = 0.0;
  for (int i = 0; i < count_; i++)
    if (source_[i].key == key) own = std::fabs(source_[i].mean);
  if (own < kBiased || log_odds() > kTrusted) return false;
  int better = 0;
  for (int i = 0; i < count_; i++)
    better += wm_seconds_between(source_[i].t_ns, t_ns) < kRecent_s && source_[i].log_bayes < kFitting &&
              std::fabs(source_[i].mean) < kBetter * own;
  return better >= kEnough;
}

bool landmark_evidence::moved(int key) const {
  double others = prior_;
  int fitting = 0;
  bool contradicts = false;
  for (int i = 0; i < count_; i++) {
    const source &s = source_[i];
    if (s.key == key) {
      contradicts = s.log_bayes > kSurelyNot;
      continue;
    }
    others -= log(likelihood_kept(s.log_bayes, s.moved));
    fitting += s.log_bayes < kFitting;
  }
  return contradicts && fitting >= kEnough && others < kTrusted;
}

}  // namespace wm
