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
#include "worlds/path6.h"
#include "worlds/plan.h"

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

// A drive that obeys commanded twists, in place of wheels that are counted.
struct Actuators {
  double control_hz = 10, publish_hz = 30;                 // commands; rows of motion.csv, each the newest command
  double speed_step_mps = 0.001, turn_step_radps = 0.001;  // rounding of the published rows
  double dead_s = 0, dead_jitter_s = 0;                    // a command acts so much later; the jitter is uniform, added
  double response_s = 0;                                   // time constant of the first-order response
  double acceleration_mps2 = 0, turn_acceleration_radps2 = 0;  // largest; 0: no limit
  double friction_mps = 0;                 // a standing wheel starts above this, and stops below half
  double speed_scale = 1, turn_scale = 1;  // true over commanded
};

// What the base can do, and what measures its motion beside or in place of the bus.
struct Motion {
  enum class Base { rolling, holonomic, skid_steer };
  Base base = Base::rolling;
  double crab_rad = 0, crab_m = 6;  // holonomic: heading against the way, a sine of the way with this period
  double track_scale = 1;           // skid_steer: effective track over wheels.track_m
  double twist_hz = 0;              // above 0: motion.csv has measured twists, in place of the bus
  // White noise of the twist per sqrt(s): constant, and relative to the component.
  double speed_noise_mps = 0, side_noise_mps = 0, turn_noise_radps = 0;
  double speed_noise = 0, side_noise = 0, turn_noise = 0;
  double log_hz = 50;     // six degrees of freedom: rows of motion6.csv
  bool log_rates = true;  // ... with rates of its own; else they are 0 there
  double imu_hz = 0;      // above 0: imu.csv
  // Accelerometer: noise of a sample; a constant error of each axis; an even shaking; bumps of that size, so many per s
  double accelerometer_noise_mps2 = 0, accelerometer_bias_mps2 = 0, vibration_mps2 = 0, bump_mps2 = 0, bumps_hz = 0;
  bool measured = true;  // false: neither bus nor twist, as of a tag that is carried
  bool is_there() const { return base != Base::rolling || twist_hz > 0 || imu_hz > 0 || !measured; }
};

struct Robot {
  wm_wheels wheels = {};      // as in calibration.yaml; the true ones differ by what `errors` draws
  bool sends_speeds = false;  // the bus gives the wheels' speeds, without sign, instead of rolling counts
  bool differential = false;  // two driven wheels, no steering
  bool commanded = false;     // motion.csv has commands; nothing measures the motion
  Actuators actuators;
  std::optional<Footprint> body;  // corridor, office, hall; else the world's usual one
};

// Landmarks that the seed draws, in a world of features alone.
struct Scatter {
  int count = 0;                   // so many in all; or
  int per_view = 0;                // six degrees of freedom: so many before the stereo pair at any time
  int32_t first_id = 1;            // their ids follow one another from here
  double aside_m[2] = {1, 4};      // wheels: distance from the way, to either side
  double height_m[2] = {0, 0};     // wheels: z
  double apart_m = 0.5;            // wheels: from one another
  double ahead_m[2] = {1.5, 4.5};  // six degrees of freedom: distance from the stereo pair when it comes by
  uint64_t seed = 0;               // draws places and appearances, for several drives past the same; 0: the drive's own
};

// Which of the landmarks landmarks.csv has; the others are SLAM's to find.
enum class Mapped { all, listed, none };

// A way under water that the seed draws: rounds of about one radius, heading along the way, rolling and pitching.
struct Rounds {
  double duration_s = 0;  // 0: none
  double radius_m = 3, height_m = 3, rounds = 2;
  double wobble_m = 0.3;   // how the radius wanders; the height wanders half as much
  double tilt_rad = 0.05;  // standard deviation of roll and pitch
};

// Coded markers: AprilTags, MR codes, or both by turns.
enum class Markers { tags, mr, both };

// What is rendered: a maker of worlds, which draws building, landmarks, cameras and route by the seed.
struct WorldKind {
  std::string kind;  // crossing, corridor, office, hall, seabed; empty: features only
  bool hard = false;
  bool markers_on_walls = false;    // office
  uint64_t seed = 0;                // of the world and the way through it; 0: the drive's
  double rounds = 1.05;             // seabed: of the vehicle's way
  Markers markers = Markers::tags;  // office
  std::string plan;         // corridor, office, hall: the file of a building of one's own; empty: drawn by the seed
  double ceiling_m = 2.6;   // of a ROS map or a picture
  double resolution_m = 0;  // of a plan that is a picture: metres of a pixel
  double tag_m = 0.2;       // corridor: black square of the tags among `landmarks`
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

// A rectangle on the map.
struct Area {
  double x0_m, y0_m, x1_m, y1_m;
  bool holds(double x_m, double y_m) const { return x_m >= x0_m && x_m <= x1_m && y_m >= y0_m && y_m <= y1_m; }
};

// A sensor that gives features, or a position or a direction.
struct Sensor {
  enum class Kind { landmarks, markers, edges, stereo, gnss, depth, compass };
  Kind kind = Kind::landmarks;
  std::string name;
  std::string camera;                                   // worlds with pictures: whose pictures it looks at
  bool beside_pictures = false;                         // given also where there are pictures
  bool noisy = true;                                    // gnss and depth: false measures exactly, sigmas as stated
  double xyz_m[3] = {0, 0, 0}, rpy_rad[3] = {0, 0, 0};  // mounting in base_link
  double rate_hz = 10, phase_s = 0;
  double field_of_view_rad = 6.283185307179586, range_m = 1e5;  // what lies outside is not seen
  int32_t ids[2] = {0, INT32_MAX};                              // only these landmarks are seen
  std::vector<Area> areas;  // it speaks while base_link is in one of these; none: everywhere
  bool gives_bearing = false, gives_range = false, range_is_depth = false;
  double bearing_sigma_rad = 0, range_sigma_m = 0, heading_sigma_rad = 0;
  double range_sigma = 0;                            // relative, added
  double outlier_fraction = 0, missed_fraction = 0;  // of what is seen
  double outlier_m = 0;                              // ranges: an outlier is up to so much too long; gnss: off
  double latency_s = 0, latency_jitter_s = 0;        // arrival; the jitter is uniform and added
  // stereo: a rectified pair, its left camera at xyz_m. sigma_px: of each coordinate, of edges, too
  double sigma_px = 0, focal_px = 420, centre_px[2] = {319.5, 239.5}, baseline_m = 0.3;
  int size_px[2] = {640, 480};
  double one_side_fraction = 0;  // only one of both pictures has the point
  // As a tracker sees it: a point has an appearance and, when it comes back, another number.
  bool tracks = false;
  double appearance_noise = 0;  // share of an appearance's bits that are wrong, drawn for each look
  double alike_fraction = 0;    // share of the points that look like one of sixteen others
  // gnss and depth
  double sigma_xy_m = 0, sigma_z_m = 0;
  double stated_xy_m = 0;              // gnss: the sigma that the receiver states; 0: sigma_xy_m
  double wander_m = 0, wander_s = 30;  // gnss: each axis wanders so much, with this correlation time
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
  bool none = false;          // all but the pictures
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
  double tilt_rad = 0;              // robot's roll and pitch, wandering; in features' elevations alone
  double start_xy_m = 0, start_heading_rad = 0;
  double start_within_m = 0;        // start place: anywhere so near, each place as likely
  double compass_rad = 0;           // each compass' deviation
  double slip = 0;                  // of each wheel, wandering; relative
  double camera_mounting_rad = 0;   // cameras with pixels: each axis
  double camera_mounting_m = 0;     // each axis
  double camera_intrinsics = 0;     // each number, relative
  double frame_stamp_jitter_s = 0;  // each picture
  double speed = 0;                 // six degrees of freedom: scale of the velocity, relative
  double speed_noise_mps = 0;       // each axis and sample
  double side = 0, turn = 0;        // scales of a measured twist's sideways speed and turn rate, relative
  double rotation_center_m = 0;     // skid_steer: place of the centre of rotation ahead of base_link
  double wheel_noise_sqrtm = 0;     // each counted wheel, m per sqrt(m): uneven floor
};

// A stretch of time, from the start of the recording.
struct Span {
  double from_s = 0, to_s = 0;  // empty when to_s <= from_s
  bool holds(double t_s) const { return t_s >= from_s && t_s < to_s; }
};

// Wheels that turn otherwise than they roll: by a share of the way, and by a speed on top of it.
struct Slip : Span {
  int wheel = 0;     // 0 left, 1 right, 2 both
  double share = 0;  // relative; -1: it stands
  double added_mps = 0;
};

// A sensor that repeats its last value: all axes, or one.
struct Stuck : Span {
  int axis = -1;  // 0 x, 1 y, 2 z; -1: all
  bool holds(double t_s, int of_axis) const { return Span::holds(t_s) && (axis < 0 || axis == of_axis); }
};

// Things that go wrong on request; all off by default.
struct Faults {
  double can_lost = 0, can_duplicated = 0, can_reordered = 0;  // fractions of the frames
  double can_late = 0, can_late_s = 0;                         // this fraction is received so much later
  double sightings_lost = 0, sightings_duplicated = 0;         // fractions of the sightings
  double sightings_misread = 0;                                // fraction of the sightings: another landmark's id
  double sightings_false = 0;                                  // fraction of all: nothing stands there, added
  int64_t landmarks_moved = 0;                                 // so many of the map stand elsewhere by now ...
  double landmarks_moved_m = 0;                                // ... so far from where they were measured
  double frames_late = 0, frames_late_s = 0;                   // this fraction of camera frames arrives so much later
  double camera_clock_offset_s = 0;                            // added to the stamps of all sightings
  int dead_encoder = -1;                                       // 0 left, 1 right: its count stands still
  double dead_encoder_from_s = 0;
  double start_x_m = 0, start_y_m = 0, start_heading_rad = 0;  // added to the start pose that the recording states
  double frames_duplicated = 0, frames_reordered = 0;          // fractions of the pictures
  double frames_lost = 0;                                      // fraction of the pictures
  double camera_clock_drift = 0;                               // of the cameras' clock, relative
  Span camera_dropout;                                         // no pictures
  Span frozen_picture;                                         // the last picture again and again
  Span lights_off;
  double lights_left = 0.02;  // what is left of the light then
  std::vector<Slip> wheel_slip;
  double kidnap_at_s = 0, kidnap_forward_s = 0;  // carried to where it would be so much later; 0: not
  Stuck gyro_stuck, accelerometer_stuck;         // imu.csv repeats the last rates, the last specific force
};

struct Scenario {
  std::string name, about;
  uint64_t seed = 1;
  double clock_start_s = 0;  // first stamp of the recording's clock
  double duration_s = 0;     // the recording ends then; 0: with the drive
  WorldKind world;
  std::vector<wm_landmark> landmarks;  // true places; sigma_m: of the place on the map, 0: errors.landmark_m
  Scatter scatter;
  Mapped mapped = Mapped::all;
  Robot robot;
  Motion motion;
  std::vector<Camera> cameras;
  std::vector<Sensor> sensors;
  std::vector<PixelCamera> pixel_cameras;
  Pictures pictures;
  Route route;               // without legs: the world's own
  std::vector<Knot6> knots;  // six degrees of freedom: the way, or
  Rounds rounds;             // drawn by the seed
  bool swims() const { return !knots.empty() || rounds.duration_s > 0; }
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
