// SPDX-License-Identifier: Apache-2.0
// Is the pose wrong, or has a landmark moved, or was an identity misread? Each landmark seen lately gives a log Bayes
// factor L: how much better an anywhere-uniform density explains its innovations than the expected normal density with
// a share of false detections. A wrong pose contradicts all landmarks; a moved landmark contradicts one. With m the
// probability that a landmark has moved,
//   odds of being lost = prior / product over the landmarks of ((1 - m) exp(-L) + m).
// So one landmark contributes log(1/m) at most. Of the landmarks that fit, the best one is left out: the pose can
// always be shifted to fit one landmark. Contributions decay with time.
#ifndef WAYMARK_ESTIMATOR_CORE_LANDMARK_EVIDENCE_HPP
#define WAYMARK_ESTIMATOR_CORE_LANDMARK_EVIDENCE_HPP

#include <cstdint>

#include "filters/core/evidence.hpp"
#include "waymark/time.h"

namespace wm {

// Keys of sources that are no landmark; kNoKey: no evidence of the pose.
inline constexpr int kPositionKey = -2, kHeadingKey = -3, kLocalizerKey = -4, kNoKey = -5;

// What this drive has shown of a landmark; kept by the filter, one a landmark of the map.
struct landmark_record {
  uint8_t confirmed;  // it fitted for a while, so it has hardly moved
  uint8_t moved;      // it contradicts while others fit
};

class landmark_evidence {
 public:
  // A pose that was set, found or stated is not proven yet: the log odds that it is wrong.
  void begin(double log_prior) {
    count_ = observed_ = 0;
    prior_ = log_prior;
    odds_.reset(log_prior);
    doubted_since_ns_ = WM_TIME_NONE;
    proven_ = contradicted_once_ = false;
  }

  // Another pose explains the observations since then and this pose none of them: earlier fits no longer count.
  void contradict(wm_time_ns since_ns) {
    begin(kElsewhere);
    doubted_since_ns_ = since_ns;
  }

  // One observation's log Bayes factor of "anywhere" against "as expected". `density`: of the innovation as expected
  // (joint over its components); `clutter_volume`: where a false detection may lie, in the same units. Bounded above.
  static double log_bayes_factor(double density, double clutter_volume);
  static double max_log_bayes_factor();  // of an observation that is impossible from this pose

  // Adds one observation. `angle_rad`: the bearing's innovation, NaN where there is none. False detections scatter; a
  // landmark that is not where it is expected stays where it is. So a misfit near the previous one counts, and a misfit
  // elsewhere cancels it. `normalised`: that innovation over its sigma. `record`: of the landmark, null for others.
  void note(wm_time_ns t_ns, int key, double log_bayes, double angle_rad, double normalised, landmark_record *record);
  // Without observations the contributions decay, too.
  void forget(wm_time_ns t_ns) { odds_.set(prior_ - log_of_sources(t_ns, nullptr)); }
  // Its innovations have one sign all the time and those of others do not: it pulls the pose without being gated.
  bool biased(int key, wm_time_ns t_ns) const;

  double log_odds() const { return odds_.value(); }
  double probability() const { return odds_.probability(); }  // of being lost
  bool contradicted() const { return odds_.value() > kLost; }
  bool fits() const { return odds_.value() < kFound; }
  // More than one misread identity and less than proof: the covariance is too small.
  bool doubtful() const { return odds_.value() > kDoubt; }
  // The pose was well explained at least once since begin().
  bool proven() const { return proven_; }
  // Start of the present doubt; WM_TIME_NONE without doubt.
  wm_time_ns doubted_since_ns() const { return doubted_since_ns_; }
  // Landmark `key` has moved: it contradicts, and at least three others fit and make the pose sure without it.
  bool moved(int key) const;

 private:
  struct source {
    int64_t key;       // of 64 bits for lack of padding: the same events must give the same bytes
    double log_bayes;  // L
    double fresh;      // weight of one observation of the newest stamp
    double moved;      // m
    double angle_rad;  // of the last misfit
    double mean;       // running mean of the normalised innovations
    wm_time_ns t_ns, bad_since_ns;
  };
  static constexpr int kSources = 24;  // landmarks seen in the last seconds; not swept
  // Thresholds on the log odds: 1 is 73 % lost, 3 is 95 %, -2 is 12 %, -2.5 is 8 %, -4 is 2 %. Chosen with the prior of
  // 8 % on the drawn crossings (waymark-montecarlo --trials, seeds 1 to 100); not swept one by one.
  static constexpr double kLost = 1.0, kElsewhere = 3.0, kFound = -2.0, kDoubt = -2.5, kTrusted = -4.0;

  source &source_of(int key, wm_time_ns t_ns, double angle_rad, bool *known);
  static double scatter_checked(source &s, double log_bayes, double angle_rad, double dt, bool known);
  static double likelihood_kept(double log_bayes, double moved);
  double log_of_sources(wm_time_ns t_ns, double *best) const;
  void sum(wm_time_ns t_ns);

  source source_[kSources];
  int count_, observed_;
  double prior_;
  evidence odds_;
  bool proven_;
  bool contradicted_once_;  // since begin()
  wm_time_ns doubted_since_ns_;
};

}  // namespace wm

#endif
