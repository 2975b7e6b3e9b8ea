// SPDX-License-Identifier: Apache-2.0
// Joint hypotheses about landmarks that are not seen where they are expected. A: the pose is right, and each of them
// moved or was misread by itself. B: the odometry missed a turn (a wheel slipped, the robot was pushed), so that one
// rigid motion explains a group of sightings; the others moved or were misread. Sightings of different stamps are
// related by odometry. The likelihoods are joint over the group, with the covariances of robot and landmarks
// [Neira2001], and relinearised at the turn that fits.
#ifndef WAYMARK_ESTIMATOR_SLAM_SLIP_SEARCH_HPP
#define WAYMARK_ESTIMATOR_SLAM_SLIP_SEARCH_HPP

#include "filters/relocalize/pose_search.hpp"
#include "filters/slam/joint_state.hpp"

namespace wm {

// The newest sighting of a landmark since the doubt began.
struct slip_sighting {
  observation seen;
  int32_t is_misfit;
  int32_t state;  // the landmark's first one; set before each search
};

// A sighting against its landmark's place in map: the differences along and across the line of sight, both zero as
// expected. By the pose, the landmark, and a missed motion about the anchor: its shift and its turn.
struct slip_rows {
  int index[5];
  double by[2][5], by_missed[2][3];
  double innovation[2], noise[2];
};

struct slip_hypothesis {
  double log_odds;  // B against A, nats
  double turn_rad;  // of the odometry's frame in map
  double turn_sigma_rad;
  wm_time_ns since_ns;  // what joined later stands where the wrong pose put it
  wm_pose2 pose;        // of base_link in map
  double missed[3][3];  // covariance of the missed motion, of that pose
  uint32_t group;       // bits of the sightings that it explains
};

class slip_search {
 public:
  static constexpr int kCapacity = 12;  // sightings; of a further one the oldest leaves

  void begin() {
    clear();
    fitted_ns_ = linked_ns_ = WM_TIME_NONE;
    gaps_ = unused_ = 0;
  }
  // The pose is right now.
  void begin_at(wm_time_ns now_ns, const travelled_pose2 &odometry) {
    clear();
    fit(now_ns, odometry);
  }
  void clear() {
    count_ = misfits_ = 0;
    log_odds_ = 0.0;
    doubted_ns_ = misfit_ns_ = judged_ns_ = convinced_ns_ = WM_TIME_NONE;
  }
  // A known landmark, where it was expected or elsewhere.
  void add(const observation &seen, bool is_misfit, const travelled_pose2 &odometry);
  // Most of the landmarks seen lately misfit, and B is not clearly worse than A.
  bool doubts(wm_time_ns now_ns) const;
  bool doubts_one() const { return count_ == 1; }  // one landmark alone
  // When a landmark last fitted that was on the map at the last such fit: the pose is right. WM_TIME_NONE: never.
  wm_time_ns fitted_ns() const { return fitted_ns_; }
  // When one that was seen before fitted, also one that joined after a gap without any.
  wm_time_ns linked_ns() const { return linked_ns_; }
  // A landmark that was on the map since `joined_ns` fits. False: it joined after the last fit and fits any pose.
  bool links(wm_time_ns joined_ns, wm_time_ns now_ns, const travelled_pose2 &odometry);

  int count() const { return count_; }
  slip_sighting &at(int i) { return sighting_[i]; }
  // Once a stamp, and where two landmarks misfit.
  bool is_due(wm_time_ns now_ns) const;
  slip_hypothesis search(const joint_state &joint, const travelled_pose2 &odometry, bool invariant) const;
  bool is_convincing(wm_time_ns now_ns) const;  // B, by the last search
  // Whether B has been better for a while, by the same turn.
  bool decide(const slip_hypothesis &found, wm_time_ns now_ns);
  // The rows of a sighting from this pose.
  static slip_rows rows_of(const slip_sighting &s, const joint_state &joint, const wm_pose2 &pose,
                           const travelled_pose2 &odometry);

 private:
  // B with one turn: the rows of all sightings, and which of them it explains.
  struct trial {
    double turn_rad;  // of the odometry's frame in map
    wm_pose2 pose;
    slip_rows rows[kCapacity];
    uint32_t group = 0;
    int members = 0;
    double chi2 = 0.0;
  };
  // A way on which no landmark linked the poses: from the last one that did to the first one after it.
  struct gap {
    wm_time_ns from_ns;
    wm_pose2 from, to;  // odometry
    double way_m;
  };
  static constexpr int kGaps = 4;  // of more, the oldest is forgotten
  struct frame {
    double odom_m[2], map_m[2], variance_m2;  // the anchor: where the odometry missed the turn, about
  };
  static frame anchor_of(const gap &g, const joint_state &joint, const travelled_pose2 &odometry);
  void fit(wm_time_ns now_ns, const travelled_pose2 &odometry);
  bool turn_by(const joint_state &joint, const frame &anchor, int i, int j, double *turn_rad) const;
  void add_gap(const travelled_pose2 &odometry);
  slip_hypothesis search_after(const gap &g, const joint_state &joint, const travelled_pose2 &odometry,
                               bool invariant) const;
  void place(const joint_state &joint, const travelled_pose2 &odometry, const frame &anchor, bool invariant,
             trial *out) const;
  void gather(const joint_state &joint, const frame &anchor, trial *out) const;
  double log_density(const joint_state &joint, const frame &anchor, const trial &t, double *turn_rad,
                     double *variance) const;
  double log_likelihood_as_expected(const joint_state &joint, const travelled_pose2 &odometry) const;

  slip_sighting sighting_[kCapacity];
  gap gap_[kGaps];       // since the last fit
  int count_, misfits_;  // sightings kept; misfits since the doubt began
  int gaps_, unused_;    // no padding
  wm_time_ns doubted_ns_, misfit_ns_, judged_ns_, convinced_ns_, fitted_ns_;
  double convinced_rad_, log_odds_;
  wm_time_ns linked_ns_;  // the newest landmark that was seen before and fits
  travelled_pose2 linked_;
};

}  // namespace wm

#endif
