// SPDX-License-Identifier: Apache-2.0
// A scenario: a world, a robot, its route, its errors and faults. What is drawn by the seed (which wheel is larger,
// where the map is wrong) is not in here: a scenario says only how large such errors are. docs/simulate.md has the
// keys.
#pragma once

#include <cstdint>
#include <optional>
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
  wm_wheels wheels = {};      // as calibration.yaml says; the true ones differ by what `errors` draws
  bool sends_speeds = false;  // the bus gives the wheels' speeds, without sign, instead of rolling counts
};

// What is rendered: a maker of worlds, which draws building, landmarks, cameras and route by the seed.
struct WorldKind {
  std::string kind;  // crossing, corridor, office, hall, seabed; empty: features only
  bool hard = false;
  bool markers_on_walls = false;  // office
  bool pictured() const { return !kind.empty(); }
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

// What a scenario changes of the world's camera of this name; what is absent stays.
struct PixelCamera {
  std::string name;
  std::string model;
  int width = 0, height = 0;  // given without intrinsics: these are scaled
  std::vector<double> intrinsics, distortion;
  std::optional<double> field_of_view_rad, rate_hz, exposure_s, readout_s;
  std::vector<double> xyz_m, rpy_rad;  // of the mounting
  std::optional<bool> colour;
};

// How pictures are made, of all cameras.
struct Pictures {
  int samples = 2;            // rays a pixel
  double psf_sigma_px = 0.5;  // the lens' point spread
  int jpeg_quality = 60;
  bool lossless = false;                     // grey bytes instead of JPEG
  double latency_s = 0.02;                   // arrival after the middle of the exposure
  double latency_jitter_s = 0.04;            // uniform, added
  double shot = 1.0 / 20000, read = 0.0008;  // variance of a white pixel's shot noise, deviation of the read noise
  double vignetting = 0.3;                   // light that is missing in the corners
  double response_power = 0.55;              // grey = light^power, with a shoulder
  double brightness = 0.26;                  // mean signal that the exposure aims at
  double gain_drift = 0.004;                 // wandering of the gain a frame, relative
  double noise_scale = 1;                    // 0: none
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
  double slip = 0;                  // of each wheel, wandering; relative
  double camera_mounting_rad = 0;   // cameras with pixels: each axis
  double camera_mounting_m = 0;     // each axis
  double camera_intrinsics = 0;     // each number, relative
  double frame_stamp_jitter_s = 0;  // each picture
  double speed = 0;                 // six degrees of freedom: scale of the velocity, relative
  double speed_noise_mps = 0;       // each axis and sample
};

// A stretch of time, from the start of the recording.
struct Span {
  double from_s = 0, to_s = 0;  // empty when to_s <= from_s
  bool holds(double t_s) const { return t_s >= from_s && t_s < to_s; }
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
  double frames_lost = 0;                                      // fraction of the pictures
  double camera_clock_drift = 0;                               // of the cameras' clock, relative
  Span camera_dropout;                                         // no pictures
  Span frozen_picture;                                         // the last picture again and again
  Span lights_off;
  double lights_left = 0.02;                     // what is left of the light then
  Span wheel_slip;                               // one wheel turns more (or less) than it rolls
  int wheel_slip_wheel = 0;                      // 0 left, 1 right
  double wheel_slip_share = 0;                   // relative
  double kidnap_at_s = 0, kidnap_forward_s = 0;  // carried to where it would be so much later; 0: not
};

struct Scenario {
  std::string name, about;
  uint64_t seed = 1;
  double clock_start_s = 0;  // first stamp of the recording's clock
  double duration_s = 0;     // the recording ends then; 0: with the drive
  WorldKind world;
  std::vector<wm_landmark> landmarks;  // true places
  Robot robot;
  std::vector<Camera> cameras;
  std::vector<PixelCamera> pixel_cameras;
  Pictures pictures;
  Route route;  // without legs: the world's own
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
