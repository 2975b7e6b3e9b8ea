// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/witnesses.hpp"

#include <cmath>

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kFalse = 0.2;                // share of detections that are anything, as far as anybody knows
constexpr double kLeast = -4.0, kMost = 8.0;  // of a witness: so that a change is noticed
constexpr double kApart_s = 0.3;              // observations nearer in time share their errors, and count in part
constexpr double kMemory_s = 3.0;
// That a landmark has moved, or that something by it looks like it: from the same place it does so each time.
constexpr double kMoved = 0.035, kConfirmedMoved = 0.002, kKnownMoved = 0.9;
constexpr double kMeanOf = 0.1, kAnyway = 10.0;  // sigma of the mean of white ones: 0.23
constexpr double kBiased = 1.2, kLately_s = 1.0;
constexpr int kProof = 12;  // observations
constexpr double kAlike_rad = 0.2, kAlikeDrift_radps = 0.1, kAlike_s = 6.0;
constexpr double kAlikeSays = 2.0, kSeldom_s = 0.5, kSeldomSays = 0.5;  // codes misread now and then are alike, too
constexpr double kPositionWrong = 0.05, kPositionWrong_s = 5.0;         // reflections pass
constexpr double kOddsMost = 6.0, kOddsLeast = -9.0;
constexpr double kCarriedOff = -5.0;  // the prior, once the pose is proven: somebody lifts the robot
constexpr int kEnough = 3;            // two fit some pose near by, whatever they say
constexpr double kFits = -1.5, kSurely = 6.9;

}  // namespace

double witnesses::against(double density, double room) { return -log((1.0 - kFalse) * density * room + kFalse); }
double witnesses::against_all() { return -log(kFalse); }

// What a witness adds to the logarithm of the odds of being lost.
double witnesses::says(double against, double moved) { return -log((1.0 - moved) * exp(-against) + moved); }

void witnesses::note(wm_time_ns t_ns, int key, double against, double angle_rad, double normalised,
                     landmark_record *record) {
  int at = 0, oldest = 0;
  for (; at < count_ && witness_[at].key != key; at++)
    if (witness_[at].t_ns < witness_[oldest].t_ns) oldest = at;
  const bool known = at < count_;
  if (!known) at = count_ < kWitnesses ? count_++ : oldest;
  witness &w = witness_[at];
  if (!known) w = {key, 0.0, 1.0, 0.0, angle_rad, 0.0, t_ns, WM_TIME_NONE};
  const double dt = wm_seconds_between(w.t_ns, t_ns);
  if (known && dt > 0.0) {  // several of one stamp count alike
    w.against *= exp(-dt / kMemory_s);
    w.fresh = dt < kApart_s ? dt / kApart_s : 1.0;
  }
  w.t_ns = t_ns;
  if (std::fabs(normalised) < kAnyway) w.mean += kMeanOf * (normalised - w.mean);
  if (against > 0.0) {
    // Detections of nothing scatter: a misfit by the one before says more than one alone, which says nothing yet; one
    // that lies elsewhere takes back what was said.
    const double near_rad = kAlike_rad + kAlikeDrift_radps * dt;
    const double apart_rad = std::fabs(wrap(angle_rad - w.angle_rad));
    w.angle_rad = angle_rad;
    if (!known || dt > kAlike_s) {
      against = finite(angle_rad) ? 0.0 : against;
    } else if (apart_rad <= near_rad) {
      against *= dt < kSeldom_s ? kAlikeSays : kSeldomSays;
    } else if (apart_rad > near_rad) {
      const double said = w.against > 0.0 ? w.against / w.fresh : 0.0;
      against = -(against < said ? against : said);
    }
  }
  w.against += w.fresh * against;
  if (w.against < kLeast) w.against = kLeast;
  if (w.against > kMost) w.against = kMost;
  if (w.against <= 0.0) w.bad_since_ns = WM_TIME_NONE;
  if (w.against > 0.0 && w.bad_since_ns == WM_TIME_NONE) w.bad_since_ns = t_ns;
  if (record) {
    if (w.against <= kFits) record->confirmed = 1;
    w.moved = record->moved ? kKnownMoved : record->confirmed ? kConfirmedMoved : kMoved;
  } else {
    const double bad_s = w.bad_since_ns == WM_TIME_NONE ? 0.0 : wm_seconds_between(w.bad_since_ns, t_ns);
    w.moved = kPositionWrong * exp(-bad_s / kPositionWrong_s);
  }
  sum(t_ns);
}

void witnesses::sum(wm_time_ns t_ns) {
  odds_ = prior_;
  double best = 0.0;
  for (int i = 0; i < count_; i++) {
    const witness &w = witness_[i];
    const double said = says(w.against * exp(-wm_seconds_between(w.t_ns, t_ns) / kMemory_s), w.moved);
    odds_ += said;
    if (w.key >= 0 && said < best) best = said;
  }
  odds_ -= best;  // one landmark fits some pose near by, whatever it says: the pose follows it
  if (odds_ > kOddsMost) odds_ = kOddsMost;
  if (odds_ < kOddsLeast) odds_ = kOddsLeast;
  noted_++;
  if (odds_ > kLost) contradicted_once_ = true;
  if ((contradicted_once_ ? odds_ : odds_ + best) < kTrusted && noted_ >= kProof) {
    proven_ = true;
    prior_ = kCarriedOff;
  }
  if (odds_ < kFound)
    doubted_since_ns_ = WM_TIME_NONE;
  else if (doubted_since_ns_ == WM_TIME_NONE)
    doubted_since_ns_ = t_ns;
}

double witnesses::probability() const { return 1.0 / (1.0 + exp(-odds_)); }

bool witnesses::biased(int key, wm_time_ns t_ns) const {
  double own = 0.0;
  for (int i = 0; i < count_; i++)
    if (witness_[i].key == key) own = std::fabs(witness_[i].mean);
  if (own < kBiased || odds_ > kTrusted) return false;
  int better = 0;
  for (int i = 0; i < count_; i++)
    better += wm_seconds_between(witness_[i].t_ns, t_ns) < kLately_s && witness_[i].against < kFits &&
              std::fabs(witness_[i].mean) < 0.6 * own;
  return better >= kEnough;
}

bool witnesses::moved(int key) const {
  double others = prior_;
  int fitting = 0;
  bool contradicts = false;
  for (int i = 0; i < count_; i++) {
    const witness &w = witness_[i];
    if (w.key == key) {
      contradicts = w.against > kSurely;
      continue;
    }
    others += says(w.against, w.moved);
    fitting += w.against < kFits;
  }
  return contradicts && fitting >= kEnough && others < kTrusted;
}

}  // namespace wm
