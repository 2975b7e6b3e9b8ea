// SPDX-License-Identifier: Apache-2.0
// Coded markers as a sensor reads them: place in levelled axes, noise, and which of two poses.
#ifndef WAYMARK_ESTIMATOR_AID_TAG_HPP
#define WAYMARK_ESTIMATOR_AID_TAG_HPP

#include "sensors/shared_params.hpp"
#include "sensors/sighting.hpp"

namespace wm {

// A marker in levelled axes along the sensor's yaw.
struct tag_reading {
  double level[3], along[2];  // place; unit vector towards it on the floor
  double nominal[3];          // the place by the camera's roll and pitch of calibration.yaml
  double yaw_rad, z_m;        // its direction; its height in base_link
  double noise[3];            // variances along, across, of the heading
  double z_noise;             // of its height
  double floor_m, length_m;   // distance on the floor and along the line of sight
  bool has_heading;           // false: ambiguous, or not accurate enough
};

// `second`: by the second pose that its corners fit.
tag_reading read_tag(const wm_marker &m, bool second, const mounted_sensor &sensor, const sensor_errors &errors,
                     const wm_sighting_params &sightings, const wm_marker_params &params);

// A marker seen nearly face on has two poses, which differ in its heading [Schweighofer2006]. The one that fits the map
// clearly better is taken; else the place alone, since the wrong one would fit a picture after the other. nis(reading):
// of place and heading; 0 of a marker that is not on the map.
template <class Nis>
tag_reading choose_pose(const wm_marker &m, const tag_reading &first, const tag_reading &second,
                        const wm_marker_params &params, Nis nis) {
  constexpr double kClearlyBetter_nis = 9.0;  // one is 90 times as likely
  const double first_nis = nis(first), second_nis = nis(second);
  tag_reading r = second_nis < first_nis ? second : first;
  const bool is_clear = std::fabs(second_nis - first_nis) > kClearlyBetter_nis;
  r.has_heading = !(m.yaw_sigma_rad > params.heading_most_rad) && is_clear;
  return r;
}

}  // namespace wm

#endif
