// SPDX-License-Identifier: Apache-2.0
// A scenario and a seed become what the robot's sensors said, and the truth. All in memory; write.h makes a recording.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "simulate/bus.h"
#include "simulate/commands.h"
#include "simulate/route.h"
#include "simulate/scenario.h"
#include "waymark/can.h"
#include "worlds/path6.h"

namespace wm::sim {

inline constexpr double kTruth_hz = 50;  // of truth.csv

inline wm_time_ns to_ns(double s) { return static_cast<wm_time_ns>(std::llround(s * 1e9)); }

// `sensor` is an index into Recording::sensors; `outlier` is for statistics only and not written.
struct Sighting {
  wm_time_ns t_ns, arrival_ns;
  uint16_t sensor;
  int32_t id;
  double bearing_rad, range_m;  // NaN where it has none
  bool outlier;
  double elevation_rad = std::numeric_limits<double>::quiet_NaN();        // above the sensor's xy plane; not written
  double elevation_sigma_rad = std::numeric_limits<double>::quiet_NaN();  // NaN: no elevation
};

struct MarkerSeen {
  wm_time_ns t_ns, arrival_ns;
  uint16_t sensor;
  int32_t id;
  double p_m[3], yaw_rad;  // in the sensor's frame
  bool outlier;
};

struct StereoSeen {
  wm_time_ns t_ns, arrival_ns;
  uint16_t sensor;
  int32_t id;
  double left_px[2], right_px[2];  // NaN where that picture hasn't got it
  bool outlier;
  uint64_t appearance[4] = {};
};

// Points of edges on the floor in one picture, in base_link; rows of points.csv.
struct EdgesSeen {
  wm_time_ns t_ns, arrival_ns;
  uint16_t sensor;  // into Scenario::sensors
  std::vector<Eigen::Vector2d> points_m;
};

// A row of gnss.csv. A depth sensor's row knows nothing of x and y: sigma_xy_m is kNoIdea_m.
inline constexpr double kNoIdea_m = 1e6;
struct Fix {
  wm_time_ns t_ns, arrival_ns;
  uint16_t sensor;  // into Scenario::sensors
  double p_m[3], sigma_xy_m, sigma_z_m;
  bool outlier;
};

// A compass looks at this landmark, so far to the north (+y) that a place makes no difference.
inline constexpr int32_t kNorthId = 1000000;
inline constexpr double kNorth_m = 1e7;

struct Truth {
  wm_time_ns t_ns;
  State state;
};

// Six degrees of freedom: a pose, and the twist that a speed log and gyros say.
struct Truth6 {
  wm_time_ns t_ns;
  double xyz_m[3], q_xyzw[4];
};
struct Twist6 {
  wm_time_ns t_ns;
  double v_mps[3], w_radps[3];
};

// A row of imu.csv, in axes of base_link.
struct ImuRow {
  wm_time_ns t_ns;
  double w_radps[3], a_mps2[3];
};

// What the seed drew: for tests and for the bound, never for an estimator.
struct Drawn {
  double wheel_radius[2];  // relative, left and right
  double track;            // relative
  double yaw_rate_bias_radps;
  double steering_offset_rad;
  std::vector<double> camera_yaw_rad;
  double rotation_center_m;
};

struct Recording {
  uint64_t seed;
  Drive drive;  // the truth at any time since clock_start_ns
  wm_time_ns clock_start_ns;
  std::vector<wm_can_frame> can;    // by arrival
  std::vector<Command> commands;    // rows of motion.csv: of robot.commands, or measured twists; in place of `can`
  std::vector<Sighting> sightings;  // by arrival, as all that follows
  std::vector<MarkerSeen> markers;
  std::vector<EdgesSeen> edges;
  std::vector<StereoSeen> stereo;
  std::vector<Fix> fixes;
  std::vector<wm_sensor> sensors;      // as in calibration.yaml
  std::vector<wm_landmark> map;        // with its errors
  std::vector<wm_landmark> landmarks;  // true
  std::vector<int32_t> moved;          // those of the map that stand elsewhere by now
  std::vector<Truth> truth;
  double duration_s, length_m;
  Path6 path;  // six degrees of freedom: instead of the drive
  std::vector<Truth6> truth6;
  std::vector<Twist6> motion6;
  std::vector<ImuRow> imu;
  std::string camera_calibration;            // text of calibration.yaml on cameras with pixels
  std::vector<std::string> picture_streams;  // files of pictures, map and labels, for recording.yaml
  wm_start start;                            // as recording.yaml says
  Drawn drawn;
};

// What the robot's bus carries.
Messages messages_of(const Scenario &scenario);

// `landmarks`: how many of the scenario's landmarks are there, the first ones; more than it has means all.
// The same scenario, seed and number give the same recording; sensors draw independently, so that what the wheels say
// doesn't change with the landmarks. WM_BAD_CONFIG when the route can't be driven.
wm_status simulate(const Scenario &scenario, uint64_t seed, size_t landmarks, Recording &out, wm_error *err);

// What the sensors say, added to a recording that has its motion, `landmarks` and `map`: `cameras` of a world of
// features, and the `sensors` that need no pictures. Lists all in `sensors`. simulate() has done it for features.
void observe(const Scenario &scenario, Recording &recording);
void list_sensors(const Scenario &scenario, Recording &recording);
// The lists sorted by arrival, after `faults` have lost, doubled and delayed some of them.
void settle(const Scenario &scenario, Recording &recording);

// Moves `faults.landmarks_moved` of them, drawn by the seed: on the map each stays where it was measured.
void move_landmarks(const Scenario &scenario, Recording &recording);
// Makes the recording's map wrong by each landmark's sigma_m (0: `errors.landmark_m`) on each of the first `axes` axes,
// and states that in it.
void misplace(const Scenario &scenario, uint64_t axes, Recording &recording);

// The same for a vehicle with six degrees of freedom on `path`: motion6 instead of CAN.
void simulate_six(const Scenario &scenario, uint64_t seed, const Path6 &path, Recording &out);

}  // namespace wm::sim
