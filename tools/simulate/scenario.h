// SPDX-License-Identifier: Apache-2.0
// A scenario: a world, a robot, its route, its errors and faults. What is drawn by the seed (which wheel is larger,
// where the map is wrong) is not in here: a scenario says only how large such errors are. docs/simulate.md has the
// keys.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/estimator.h"
#include "waymark/status.h"

namespace wm::sim {

struct Leg {
  enum class Kind { stand, straight, turn };
  Kind kind = Kind::stand;
  double stand_s = 0;    // stand
  double length_m = 0;   // straight
  double turn_rad = 0;   // turn: change of heading, positive to the left
  double radius_m = 0;   // turn: smallest radius, of base_link's path
  double ease_m = 0;     // turn: length over which the wheel is turned in, and out again (clothoids)
  double speed_mps = 0;  // at most
  bool reverse = false;  // backwards
};

struct Route {
  double x_m = 0, y_m = 0, heading_rad = 0;  // start of base_link in map
  double acceleration_mps2 = 1;              // largest
  int laps = 1;                              // the legs are driven so many times, one after another
  std::vector<Leg> legs;
};

struct Robot {
  wm_wheels wheels = {};  // as calibration.yaml says; the true ones differ by what `errors` draws
};

// A camera with a landmark detector behind it: features only, no pixels.
struct Camera {
  std::string name;
  double xyz_m[3] = {0, 0, 0};   // in base_link
  double yaw_rad = 0;            // direction of view in base_link
  double field_of_view_rad = 0;  // whole angle
  double range_m = 0;            // farther landmarks are not recognised
  double rate_hz = 10;
  double phase_s = 0;  // first frame after the start of the recording
  double bearing_sigma_rad = 0;
  double outlier_fraction = 0;  // of the sightings: anything in the field of view instead
  double latency_s = 0;         // arrival after the middle of the exposure
  double latency_jitter_s = 0;  // uniform, added
};

struct Bus {
  double wheels_hz = 50, yaw_rate_hz = 100, steering_hz = 50, gear_hz = 10;
  double stamp_jitter_s = 0;  // standard deviation of the stamps
};

// Standard deviations of normal draws, one draw a run where it is a constant.
struct Errors {
  double wheel_radius = 0;          // relative, each wheel
  double track = 0;                 // relative
  double yaw_rate_bias_radps = 0;   // at the start
  double yaw_rate_bias_walk = 0;    // rad/s per sqrt(s)
  double yaw_rate_noise_radps = 0;  // each sample
  double steering_offset_rad = 0;   // of the table's angles
  double landmark_m = 0;            // each coordinate of the map, x and y
  double camera_yaw_rad = 0;        // each camera's mounting
  double start_xy_m = 0, start_heading_rad = 0;
};

// Things that go wrong on request; all off by default.
struct Faults {
  double can_lost = 0, can_duplicated = 0, can_reordered = 0;  // fractions of the frames
  double sightings_lost = 0, sightings_duplicated = 0;         // fractions of the sightings
  double frames_late = 0, frames_late_s = 0;                   // this fraction of camera frames arrives so much later
  double camera_clock_offset_s = 0;                            // added to the stamps of all sightings
  int dead_encoder = -1;                                       // 0 left, 1 right: its count stands still
  double dead_encoder_from_s = 0;
  double start_x_m = 0, start_y_m = 0, start_heading_rad = 0;  // added to the start pose that the recording states
};

struct Scenario {
  std::string name, about;
  uint64_t seed = 1;
  double clock_start_s = 0;            // first stamp of the recording's clock
  std::vector<wm_landmark> landmarks;  // true places
  Robot robot;
  std::vector<Camera> cameras;
  Route route;
  Bus bus;
  Errors errors;
  Faults faults;
};

// Reads a scenario. Any mistake stops with file, line, key and what is allowed. Allocates; desk only.
wm_status load_scenario(const std::string &path, Scenario &out, wm_error *err);
wm_status parse_scenario(const std::string &text, const std::string &path, Scenario &out, wm_error *err);

// The same drive with perfect sensors, map and start: what proves frames, signs and units.
void make_perfect(Scenario &scenario);

}  // namespace wm::sim
