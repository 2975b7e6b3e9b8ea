// SPDX-License-Identifier: Apache-2.0
// Is the pose right, or is it a landmark that moved, or a misread code? Each landmark seen lately is a witness. What
// was seen of it is weighed under two hypotheses: pose and landmark are right (then the innovation is normal, but for a
// share of false detections that are anything), or one of both is wrong (then it is anything). That a pose is wrong
// makes all witnesses speak against it, that a landmark moved only that one; so with L the logarithm of how much better
// a witness is explained by "anything", and m the probability that a landmark has moved,
//   odds of being lost = prior / product over the witnesses of ((1 - m) exp(-L) + m).
// No witness alone can say more than 1/m, and of those that fit the best has no say: one landmark fits some pose near
// by, and the filter's pose follows it. What was seen long ago is forgotten.
#ifndef WAYMARK_ESTIMATOR_WITNESSES_HPP
#define WAYMARK_ESTIMATOR_WITNESSES_HPP

#include <cstdint>

#include "waymark/time.h"

namespace wm {

// Who is no landmark: its key.
inline constexpr int kPositionWitness = -2, kHeadingWitness = -3;

// A landmark as it proved itself on this drive; kept by who knows the map.
struct landmark_record {
  uint8_t confirmed;  // fitted for a while: it is hardly the one that moved
  uint8_t moved;      // contradicts while others fit
};

class witnesses {
 public:
  // A pose that was set, found or stated is not proven yet: how likely it is wrong, as logarithm of the odds.
  void begin(double log_prior) {
    count_ = noted_ = 0;
    prior_ = odds_ = log_prior;
    doubted_since_ns_ = WM_TIME_NONE;
    proven_ = contradicted_once_ = false;
  }

  // Another pose explains what was seen since then, and this one none of it: what fitted before says nothing any more.
  void contradict(wm_time_ns since_ns) {
    begin(kElsewhere);
    doubted_since_ns_ = since_ns;
  }

  // The logarithm of how much better "anything" explains an innovation than "right": its density if right (the joint
  // one of all its numbers), `room` the volume in which anything may lie. Bounded above by the share of false ones.
  static double against(double density, double room);
  static double against_all();  // of an observation that can't be: the bound

  // `angle_rad`: the bearing's innovation, NaN where it has none. False detections are here and there, what is seen of
  // a landmark that isn't where it is expected stays where it is: a misfit counts if it lies by the one before, and
  // takes back what was said if it doesn't. `record`: the landmark's, null for others. `normalised`: that innovation
  // over its sigma.
  void note(wm_time_ns t_ns, int key, double against, double angle_rad, double normalised, landmark_record *record);
  // Its innovations are of one sign all the time, those of others are not: it pulls, and each time not far enough to be
  // refused for that.
  bool biased(int key, wm_time_ns t_ns) const;

  double log_odds() const { return odds_; }
  double probability() const;
  bool contradicted() const { return odds_ > kLost; }
  bool fits() const { return odds_ < kFound; }
  // More than one misread code, less than proof: the pose is less sure than its covariance says.
  bool doubtful() const { return odds_ > kDoubt; }
  // It was well explained once since begin().
  bool proven() const { return proven_; }
  // Since when there is doubt without end; none: WM_TIME_NONE.
  wm_time_ns doubted_since_ns() const { return doubted_since_ns_; }
  // That landmark `key` has moved: it contradicts, and at least three others fit, which make the pose sure without it.
  bool moved(int key) const;

 private:
  struct witness {
    int key;
    double against;    // L
    double fresh;      // what an observation of the newest stamp counts
    double moved;      // m
    double angle_rad;  // of the last misfit
    double mean;       // of the last normalised innovations
    wm_time_ns t_ns, bad_since_ns;
  };
  static constexpr int kWitnesses = 24;
  static constexpr double kLost = 1.0, kElsewhere = 3.0, kFound = -2.0, kDoubt = -2.5, kTrusted = -4.0;

  static double says(double against, double moved);
  void sum(wm_time_ns t_ns);

  witness witness_[kWitnesses];
  int count_, noted_;
  double prior_, odds_;
  bool proven_;
  bool contradicted_once_;  // since begin()
  wm_time_ns doubted_since_ns_;
};

}  // namespace wm

#endif
