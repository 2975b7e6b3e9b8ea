// SPDX-License-Identifier: Apache-2.0
// Landmarks that are seen by bearings alone and wait for parallax: for each the bearings from a few poses of the past
// (clones in the state), and from them the landmark's place with its joint distribution.
#ifndef WAYMARK_ESTIMATOR_SLAM_BEARING_TRACKS_HPP
#define WAYMARK_ESTIMATOR_SLAM_BEARING_TRACKS_HPP

#include "filters/slam/joint_state.hpp"

namespace wm {

inline constexpr int kLinePoses = 8;  // capacity of a start: find_line costs their cube

// Lines of sight from poses (x, y, heading of the sensor), with their covariance.
struct line_bundle {
  int count;
  wm_pose2 pose[kLinePoses];
  double azimuth_rad[kLinePoses], sigma_rad[kLinePoses];
  double pose_covariance[3 * kLinePoses][3 * kLinePoses];
};

// A landmark found from a bundle: its place, its derivative by each pose's x, y, heading, and the covariance that
// the derivative does not explain (azimuths' noise, remainder of the transform).
struct line_landmark {
  bool solved;  // the lines cross, ahead of every pose
  double place_m[2];
  double by_pose[2][3 * kLinePoses];
  double noise[2][2];
  double parallax_rad;  // largest angle between two of the lines at the landmark
  double distance_m;    // from the last pose
  double misfit;        // mean squared angle by which the lines miss it, in units of its variance
};

// [LinesND], initialisation: each pose gives one homogeneous equation, the singular vector of the smallest singular
// value is the place; its distribution by the unscented transform over (poses 2..k relative to the first,
// azimuths 1..k), or by one linearisation. Beyond the source: the poses' joint covariance is used whole, the result
// stays correlated with each of them, and the place must lie ahead along each azimuth.
line_landmark find_line(const line_bundle &bundle, bool unscented);

// Which bearings wait for which landmark. Plain memory.
class bearing_tracks {
 public:
  static constexpr int kTracks = 128;  // capacity; a hall shows 60 to 70 lines
  struct track {
    int32_t id;  // -1: free
    int sensor, count, misfits;
    wm_time_ns first_ns, last_ns;
    int clone[kLinePoses];
    double azimuth_rad[kLinePoses], sigma_rad[kLinePoses];
  };

  // At most so many clones and tracks.
  void clear(int clones, int tracks);
  int index(const track &t) const { return static_cast<int>(&t - track_); }
  track *find(int32_t id, int sensor);
  // A free track; else the one not observed for longest, NULL where all are in view.
  track *begin(int32_t id, int sensor, wm_time_ns t_ns);
  static void end(track *t) { t->id = -1; }
  // Full (`most`): the bearing taken nearest to its neighbour leaves, so that the others are far apart.
  void add(track *t, int clone, double azimuth_rad, double sigma_rad, int most);
  // A clone to overwrite, for a sensor at (x, y): one without tracks, else the one nearest to another, which leaves its
  // tracks.
  int take_clone(int sensor, wm_time_ns t_ns, double x_m, double y_m);
  // The clone of this sensor at this stamp, -1 where there is none.
  int find_clone(int sensor, wm_time_ns t_ns) const;
  // The sensor's newest clone, -1 where there is none.
  int newest_clone(int sensor) const;
  static constexpr int kClones = 40;  // capacity: bounds 120 states

 private:
  static void remove(track *t, int which);
  double apart2(int a, int b) const;
  track track_[kTracks];
  int clones_, tracks_;
  wm_time_ns clone_ns_[kClones];
  int clone_sensor_[kClones];
  double clone_m_[kClones][2];  // where it was taken, for take_clone alone
};

}  // namespace wm

#endif
