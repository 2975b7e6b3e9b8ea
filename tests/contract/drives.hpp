// SPDX-License-Identifier: Apache-2.0
// Small drives and dives for the test of the parameters: events with errors of every kind that estimators model. All
// noise is by number; nothing here is the estimators' own code.
#pragma once

#include <vector>

#include "waymark/estimator.h"

namespace drives {

enum class motion { twist, ticks, ticks_and_gyro, speed_and_gyro, steering, sideways };

// What the robot's sensors give.
enum sees : unsigned {
  kBearings = 1u << 0,
  kRanges = 1u << 1,
  kElevations = 1u << 2,
  kNameless = 1u << 3,  // half of the sightings come without identity
  kPositions = 1u << 4,
  kHeadings = 1u << 5,
  kMarkers = 1u << 6,
  kPoints = 1u << 7,
  kRenamed = 1u << 8,  // a landmark that was out of view comes back under another number
};

// What happens to it.
enum happens : unsigned {
  kCarriedOff = 1u << 0,   // at half of the time
  kNoStart = 1u << 1,      // the start pose is not known
  kSilence = 1u << 2,      // motion sensors fall silent for 0.6 s and for 3 s
  kOutliers = 1u << 3,     // every 13th observation is of something else
  kOneMoved = 1u << 4,     // a landmark is moved at a third of the time
  kDepth = 1u << 5,        // the front sensor measures depth
  kNoMap = 1u << 6,        // no landmarks are known
  kBlind = 1u << 7,        // nothing is seen for a quarter of the time
  kReflections = 1u << 8,  // edges before the walls, an obstacle
  kFewBeacons = 1u << 9,   // only two landmarks are seen
  kWrongStart = 1u << 10,  // the start pose is metres off
  kGlitches = 1u << 11,    // single samples of the motion that no robot can follow
  kImu = 1u << 12,         // dives: rates and specific force besides the twists
  kReceiver = 1u << 13,    // dives: positions of a receiver, which is late and loses its best solution half way
  kMarked = 1u << 14,      // dives: the beacons are coded markers
};

// A robot, its place and what its sensors gave. Not to be copied: the setup points into it.
class scene {
 public:
  scene(motion by, unsigned sees, unsigned happens, double seconds);
  scene(const scene &) = delete;
  scene &operator=(const scene &) = delete;

  // With the parameters of this setup.
  const wm_setup &setup(const wm_setup &params);
  const std::vector<wm_event> &events() const { return events_; }

 protected:
  scene() = default;
  static constexpr int kLandmarks = 10, kMapWidth = 240, kMapHeight = 200;
  struct truth {
    double x_m, y_m, heading_rad, v_mps, w_radps, left_m, right_m, roll_rad, pitch_rad;
  };
  void begin(unsigned happens);
  void make_place(unsigned happens);
  void drive(unsigned happens, double seconds);
  const truth &at(double t_s) const;
  double normal() { return noise(++draws_); }
  static double noise(uint64_t number);
  void add_motion(motion by, double t_s, bool glitch);
  void add_sightings(unsigned sees, unsigned happens, double t_s, double seconds);
  void add_sighting(unsigned sees, int sensor, int landmark, double t_s, bool wrong);
  void add_marker(int sensor, int landmark, const double level_m[3], double yaw_rad, double t_s, bool wrong);
  void add_scan(unsigned happens, double t_s);
  wm_event *add(wm_event_kind kind, double t_s);

  std::vector<truth> path_;
  std::vector<wm_event> events_;
  std::vector<uint8_t> edges_, drivable_;
  std::vector<wm_landmark> landmarks_;
  double place_m_[kLandmarks][3];
  wm_sensor sensors_[2] = {};
  wm_rig rig_;
  wm_raster map_ = {};
  wm_setup setup_ = {};
  uint64_t draws_ = 0;
  int seen_ = 0;
};

// A vehicle in the water: a twist in its own frame, points of the floor in a stereo pair, ranges and bearings to
// beacons, depth, position and heading.
class dive : public scene {
 public:
  dive(unsigned happens, double seconds);

 private:
  struct placed {
    double p[3], R[3][3];
  };
  placed swim(double t_s, bool carried) const;
  void add_picture(const placed &vehicle, double t_s, unsigned happens);
  void add_beacons(const placed &vehicle, double t_s, bool marked);
  void add_imu(double t_s);
};

}  // namespace drives
