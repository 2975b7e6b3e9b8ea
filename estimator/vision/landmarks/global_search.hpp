// SPDX-License-Identifier: Apache-2.0
// Where in all of a picture known landmarks might be, without a pose: some landmarks a picture in turn, each at every
// azimuth, distance and slant, by the correlation of small templates on the panorama. A place of one landmark is a pose
// of the robot in the plane; whether it is right, a look at full resolution has to say.
#ifndef WAYMARK_ESTIMATOR_VISION_GLOBAL_SEARCH_HPP
#define WAYMARK_ESTIMATOR_VISION_GLOBAL_SEARCH_HPP

#include "image/panorama.hpp"
#include "vision/landmarks/guess.hpp"

namespace wm {

// Where a landmark might be, seen from the camera.
struct place_hypothesis {
  int landmark;        // which appearance
  double azimuth_rad;  // in base_link's axes
  double distance_m;   // on the floor
  double slant_rad;    // between its normal and the line of sight; on which side isn't known, so at least 0
  double likeness;     // normalised correlation; less for the second and third of one landmark
};

struct global_search {
  static constexpr int kPlaces = 16;
  panorama round;
  int next;   // landmark whose turn it is
  int count;  // of places, the most alike first
  place_hypothesis places[kPlaces];

  // That a landmark of this size and height will be searched for; before the panorama is planned.
  void need(const mounted_camera &camera, double width_m, double height_m, double z_m);
  // Searches for the next landmarks in turn until so many places have been compared; `round` has taken the picture.
  // Returns how many places were.
  int search(const mounted_camera &camera, const appearance *known, int known_count, double range_max_m,
             double facing_min, double tilt_rad, int compare_max);
};

// The pose in the plane from which a landmark is at that azimuth, distance and (signed) slant, as a guess with these
// sigmas: of the distance in parts of it, of the slant, of the azimuth.
camera_guess guess_from(const mounted_camera &camera, const appearance &what, double azimuth_rad, double distance_m,
                        double slant_rad, double distance_sigma, double slant_sigma_rad, double azimuth_sigma_rad);

}  // namespace wm

#endif
