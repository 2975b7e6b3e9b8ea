// SPDX-License-Identifier: Apache-2.0
// Motion of a stereo pair between two successive pictures, by the tracks that both show: visual odometry.
//
// A track's pixel drifts (it is a random walk along the track), so that successive pictures carry nearly all of its
// information and no place of the point is estimated. Its disparity does not drift and is filtered over the track: far
// points are inverse depths, never places. One robust fit of six numbers per picture [GemanMcClure1987] separates what
// moves by itself, and tracks that slipped, before anything is fused.
#ifndef WAYMARK_ESTIMATOR_STEREO_EKF_PICTURE_MOTION_HPP
#define WAYMARK_ESTIMATOR_STEREO_EKF_PICTURE_MOTION_HPP

#include <cstdint>

#include "math/eigen.hpp"
#include "waymark/internal/math/rotation.hpp"

namespace wm {

// The pair as it is mounted on the body.
struct pair_view {
  double fu, fv, cu, cv, baseline_m;
  double sigma_px;
  mat3 axes;   // of the left camera in the body
  vec3 place;  // of the left camera in the body
};

// The error of a predicted motion (dp, dr) by the tracks: R_true = Exp(dr) R, p_true = p + dp, in axes of
// the body at the earlier picture.
struct motion_error {
  double value[6];
  double covariance[6][6];
};

class picture_motion {
 public:
  static constexpr int kTracks = 256;

  void clear() { tracks_ = seen_ = rows_ = side_ = 0; }
  // A point of the present picture. False: its track was cut too often, or there is no room.
  bool add(int32_t id, double u, double disparity, double v);

  // Fits the motion since the earlier picture about `moved`, its prediction with the covariance `prior`. False: too few
  // tracks.
  bool fit(const pair_view &pair, const pose3 &moved, const matrix<6> &prior, motion_error *out);
  // Counts the tracks that the last fit cut.
  void count_misses();
  // The present picture becomes the earlier one; `moved`, the motion since that one, carries the depths on.
  void close(const pair_view &pair, const pose3 &moved);

 private:
  struct track {
    double u, v;
    double disparity, variance;  // filtered, of `disparity` in px^2
    int32_t id, misses;
  };
  struct view {
    double u, v, disparity;
    int32_t id, earlier;  // index of the same track in the earlier picture; -1: none
  };
  // A track's three rows, whitened.
  struct fit_row {
    double left[3], by[3][6];
    double weight;
    int64_t earlier;  // index of its track; of 64 bits: no padding, so that states compare by bytes
  };

  bool make_row(const pair_view &pair, const pose3 &moved, const view &now, fit_row *out) const;
  int make_rows(const pair_view &pair, const pose3 &moved);
  double misfit(const fit_row &row, const vector<6> &x) const;
  double median_misfit(int count, const vector<6> &x);
  void sum_up(int count, matrix<6> *information, vector<6> *weighted) const;
  bool iterate(int count, const matrix<6> &prior, vector<6> *x);

  track *tracks() { return track_[side_]; }
  const track *tracks() const { return track_[side_]; }

  track track_[2][kTracks];
  view view_[kTracks];
  fit_row row_[kTracks];
  double sorted_[kTracks];
  int32_t tracks_, seen_, rows_, side_;
};

}  // namespace wm

#endif
