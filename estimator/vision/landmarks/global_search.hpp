// SPDX-License-Identifier: Apache-2.0
// Search of a whole picture for known landmarks, without a pose: some landmarks a picture in turn, each at every
// azimuth, distance and slant, by correlation of small templates on the panorama. A hypothesis is a pose of the robot
// in the plane; a match at full resolution verifies it.
#ifndef WAYMARK_ESTIMATOR_VISION_GLOBAL_SEARCH_HPP
#define WAYMARK_ESTIMATOR_VISION_GLOBAL_SEARCH_HPP

#include "vision/landmarks/guess.hpp"
#include "waymark/internal/image/panorama.hpp"

namespace wm {

// Hypothesis of a landmark's place relative to the camera.
struct place_hypothesis {
  int landmark;        // index of the appearance
  double azimuth_rad;  // in base_link's axes
  double distance_m;   // on the floor
  double slant_rad;    // between its normal and the line of sight, at least 0: the side is unknown
  double likeness;     // normalised correlation, minus a penalty for further places of one landmark
};

struct global_search {
  static constexpr int kPlaces = 16;  // twice as many as are verified in a picture
  panorama around;
  int next;   // landmark that is searched next
  int count;  // of places, the best first
  place_hypothesis places[kPlaces];

  // Announces a landmark of this size and height; before the panorama is planned.
  void need(const mounted_camera &camera, double width_m, double height_m, double z_m);
  // Searches for the next landmarks in turn until `compare_max` places have been compared; `around` has taken the
  // picture. Returns the number of comparisons.
  int search(const mounted_camera &camera, const appearance *known, int known_count, double range_max_m,
             double tilt_rad, int compare_max);

 private:
  int search_one(const mounted_camera &camera, const appearance *known, int which, double range_max_m, double tilt_rad);
  void insert(const place_hypothesis &place);
};

// The pose in the plane from which a landmark has this azimuth, distance and (signed) slant, with covariance by the
// sigmas; `distance_sigma` is relative.
camera_guess guess_from(const mounted_camera &camera, const appearance &what, double azimuth_rad, double distance_m,
                        double slant_rad, double distance_sigma, double slant_sigma_rad, double azimuth_sigma_rad);

}  // namespace wm

#endif
