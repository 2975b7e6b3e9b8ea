// SPDX-License-Identifier: Apache-2.0
// What a robot has: as asked for, and as the files of a configuration need it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/entry.h"
#include "init/log_evidence.h"
#include "init/proposals.h"
#include "init/tag_layout.h"
#include "init/urdf.h"

namespace wm::init {

// The options of the command line, completed by questions.
struct Wish {
  std::string out;
  std::string motion;  // can, twist, ticks, speeds, steering, none
  std::string dbc, can_log, can_interface;
  std::optional<double> radius_m, ticks_per_turn, track_m, wheelbase_m, steering_ratio;
  bool imu = false, sender_clock = false, gnss = false;
  std::vector<std::string> cameras;       // NAME or NAME=DEVICE
  std::vector<std::string> calibrations;  // files of other programs
  std::vector<std::string> sensors;       // of --sees sightings
  std::string urdf;
  std::vector<std::string> frames;     // NAME=LINK
  std::vector<std::string> mountings;  // NAME=X,Y,Z,ROLL,PITCH,YAW
  std::string sees;                    // tags, sightings, signs, edges, lines, points, nothing
  std::string tag_layout, landmarks, map;
  std::string tag_family;
  std::optional<double> tag_size_m;
  std::vector<std::string> streams;  // CSVs of the log's drive
  bool yes = false, force = false;
};

// A number of the robot: an option, or else a question. Bounds as calibration.yaml's.
struct WishedNumber {
  const char *option, *about;
  double least, most;
  std::optional<double> Wish::*value;
};
inline constexpr WishedNumber kNumbers[] = {
    {"--wheel-radius", "radius of the driven wheels in m", 0.001, 10, &Wish::radius_m},
    {"--ticks", "counts of one turn of a wheel", 1, 1e9, &Wish::ticks_per_turn},
    {"--track", "track in m: from the left wheel's middle to the right one's", 0.001, 100, &Wish::track_m},
    {"--wheelbase", "wheelbase in m: from the rear axle to the front one", 0.001, 100, &Wish::wheelbase_m},
    {"--steering-ratio", "steering wheel's angle over the road wheels'", 0.001, 1000, &Wish::steering_ratio},
    {"--tag-size", "edge of the printed black square in m", 0.001, 10, &Wish::tag_size_m},
};

constexpr double kMapSigma_m = 0.02;        // of tags put up by a tape measure or a field's drawing
constexpr double kBearingSigma_rad = 0.01;  // half a degree: a camera's or a laser's landmark
constexpr double kRangeSigma_m = 0.05;      // of an ultrasonic or laser sensor at some metres

struct RobotCamera {
  calibrate::Entry entry;
  std::string device;
  std::string mounted_by;         // where the mounting comes from, for a comment
  std::optional<double> shift_s;  // Kalibr's timeshift_cam_imu
};
struct RobotSensor {
  std::string name;
  images::Pose mounting = images::Pose::Identity();
  std::string mounted_by;
};

struct Robot {
  Wish wish;
  std::optional<Dbc> dbc;
  std::string dbc_text;  // of NMEA 2000, where no file is given
  std::vector<Candidate> candidates, signals;
  LogFacts log;
  std::optional<Urdf> urdf;
  std::vector<RobotCamera> cameras;
  std::vector<RobotSensor> sensors;
  std::optional<RobotSensor> imu, gnss;  // with a known mounting
  std::optional<TagLayout> tags;
  std::map<std::string, std::string> wheels_by;  // key of calibration.yaml's `wheels` -> file of its value
  std::vector<std::string> guesses;              // for people: value, reason, how to check it
  std::vector<std::string> unknown;              // what no file and no answer gave, and how to find it

  [[nodiscard]] bool binds(unsigned quantity) const;
  // Whether speeds come, and nothing from which the robot's turn follows.
  [[nodiscard]] bool lacks_turn() const;
};

// Reads the files of the wish. Throws tools::Failure.
void read_can(Robot &robot);
void read_geometry(Robot &robot);
void read_maps(Robot &robot);
// Guesses and unknowns that follow from all of it together; for a robot that is complete.
void name_defaults(Robot &robot);
// Numbers that the motion needs and the wish lacks, as names of options.
std::vector<std::string> missing_numbers(const Robot &robot);

}  // namespace wm::init
