// SPDX-License-Identifier: Apache-2.0
#include "init/questions.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <iostream>

#include "common/failure.h"
#include "common/number.h"
#include "init/text_file.h"

namespace wm::init {
namespace {

using tools::Failure;

struct Choice {
  const char *name, *about;
};
const std::vector<Choice> kMotions{
    {"can", "a CAN bus, described by a DBC file"},
    {"twist", "another program sends speeds and turn rate over LCM (any drive)"},
    {"ticks", "another program sends the counts of two wheels over LCM"},
    {"speeds", "another program sends the speeds of two wheels over LCM; the turn comes from an IMU"},
    {"steering", "another program sends speed and steering angle over LCM"},
    {"none", "its motion is not measured"},
};
const std::vector<Choice> kSensors{
    {"tags", "AprilTags, ArUco or MR codes, by a camera"},
    {"sightings", "landmarks at known places, by a program or sensor of yours (bearing, range)"},
    {"signs", "flat signs whose pictures are on the map, by a camera"},
    {"edges", "the edges of a floor plan, by a camera that sees the floor"},
    {"lines", "upright lines all around, by a camera that looks up"},
    {"points", "points in two cameras, in six degrees of freedom"},
    {"nothing", "none of these; GNSS or odometry alone"},
};

std::string ask(const std::string &question, const std::string &otherwise, const char *option) {
  std::printf("%s%s: ", question.c_str(), otherwise.empty() ? "" : (" [" + otherwise + "]").c_str());
  std::fflush(stdout);
  std::string line;
  if (!std::getline(std::cin, line))
    throw Failure("no answer to '" + question + "'; give " + option + ", or --yes for all defaults", tools::kUsage);
  const std::vector<std::string> words = split(line);
  std::string out;
  for (const std::string &word : words) out += (out.empty() ? "" : " ") + word;
  return out.empty() ? otherwise : out;
}

std::string choose_one(const std::string &question, const std::vector<Choice> &choices, const char *otherwise,
                       const char *option) {
  for (const Choice &one : choices) std::printf("  %-10s %s\n", one.name, one.about);
  while (true) {
    std::string answer = ask(question, otherwise, option);
    for (const Choice &one : choices)
      if (answer == one.name) return answer;
    std::printf("'%s' is none of these.\n", answer.c_str());
  }
}

bool yes_no(const std::string &question, const char *option) {
  const std::string answer = ask(question + " (y/n)", "n", option);
  return !answer.empty() && (answer[0] == 'y' || answer[0] == 'Y');
}

void ask_file(std::string &out, const std::string &question, const char *option, bool needed) {
  while (out.empty()) {
    const std::string answer = ask(question, needed ? "" : "none", option);
    if (!needed && answer == "none") return;
    if (std::filesystem::is_regular_file(answer))
      out = answer;
    else
      std::printf("'%s' is not a file.\n", answer.c_str());
  }
}

bool by_camera(const std::string &sees) { return sees != "sightings" && sees != "nothing"; }

void ask_cameras(Wish &wish) {
  if (!by_camera(wish.sees)) return;
  while (wish.calibrations.empty()) {
    std::string file;
    ask_file(file, "The camera's calibration (Kalibr camchain, ROS camera_info, OpenCV, OCamCalib)", "--calibration",
             true);
    wish.calibrations.push_back(file);
  }
  if (wish.cameras.empty()) {
    const std::string name = ask("The camera's name", "front", "--camera");
    wish.cameras.push_back(name + "=" + ask("Its device", "/dev/video0", "--camera"));
  }
}

void ask_maps(Wish &wish) {
  if (wish.sees == "tags") {
    if (wish.tag_layout.empty() && wish.landmarks.empty())
      ask_file(wish.tag_layout, "Their places, as WPILib's JSON (none: they are found while driving)", "--tag-layout",
               false);
    if (wish.tag_family.empty()) wish.tag_family = ask("Their family", "tag36h11", "--tag-family");
  }
  if ((wish.sees == "sightings" || wish.sees == "signs") && wish.landmarks.empty())
    ask_file(wish.landmarks, "Their places, landmarks.csv (id,x_m,y_m,z_m,sigma_m)", "--landmarks", true);
  if (wish.sees == "edges") ask_file(wish.map, "The plan, map.yaml of `waymark map make`", "--map", true);
  if (wish.sees == "sightings" && wish.sensors.empty())
    wish.sensors.push_back(ask("The sensor's name", "front", "--sensor"));
}

}  // namespace

void ask_robot(Wish &wish) {
  const bool may_ask = !wish.yes;
  if (wish.motion.empty() && !(wish.dbc.empty() && wish.can_log.empty())) wish.motion = "can";
  if (wish.motion.empty() && !may_ask)
    throw Failure("--motion is missing: can (with --dbc FILE), twist, ticks, speeds, steering or none", tools::kUsage);
  if (wish.motion.empty()) wish.motion = choose_one("How is the robot's motion measured?", kMotions, "can", "--motion");
  if (wish.motion != "can" && (!wish.dbc.empty() || !wish.can_log.empty()))
    throw Failure("--dbc and --can-log go with --motion can", tools::kUsage);
  if (may_ask && wish.motion == "can") {
    if (wish.can_log.empty()) ask_file(wish.dbc, "The bus' DBC file", "--dbc", true);
    ask_file(wish.can_log, "A log of a drive by `candump -l`, which shows what moves with what", "--can-log", false);
    if (wish.can_interface.empty()) wish.can_interface = ask("The CAN interface", "can0", "--can");
  }
  if (may_ask && wish.motion != "can" && !wish.imu)
    wish.imu = yes_no("Does another program send an IMU's gyro over LCM?", "--imu");
  if (may_ask && wish.urdf.empty())
    ask_file(wish.urdf, "A URDF of the robot, for the places of its sensors", "--urdf", false);
  if (wish.sees.empty() && !wish.tag_layout.empty()) wish.sees = "tags";
  if (wish.sees.empty() && !may_ask) wish.sees = "nothing";
  if (wish.sees.empty()) wish.sees = choose_one("What does the robot see?", kSensors, "nothing", "--sees");
  if (may_ask) {
    ask_cameras(wish);
    ask_maps(wish);
    if (!wish.gnss) wish.gnss = yes_no("Does it have GNSS (another program sends positions over LCM)?", "--gnss");
  }
  if (wish.sees == "sightings" && wish.sensors.empty()) wish.sensors.emplace_back("front");
  if (by_camera(wish.sees) && wish.calibrations.empty())
    throw Failure("--sees " + wish.sees + " needs a camera: --camera NAME=DEVICE and --calibration FILE",
                  tools::kUsage);
  if ((wish.sees == "sightings" || wish.sees == "signs") && wish.landmarks.empty())
    throw Failure("--sees " + wish.sees + " needs the landmarks' places: --landmarks FILE", tools::kUsage);
  if (wish.sees == "edges" && wish.map.empty())
    throw Failure("--sees edges needs the plan: --map map.yaml (`waymark map make` makes one of a picture)",
                  tools::kUsage);
}

void ask_numbers(Robot &robot) {
  Wish &w = robot.wish;
  if (w.sees == "tags" && !w.tag_size_m) {
    if (w.yes)
      throw Failure("--tag-size is missing: edge of the printed black square in m (docs/markers.md)", tools::kUsage);
  }
  std::vector<std::string> missing = missing_numbers(robot);
  if (w.sees == "tags" && !w.tag_size_m) missing.emplace_back("--tag-size");
  if (missing.empty()) return;
  std::string all;
  for (const std::string &one : missing) all += (all.empty() ? "" : ", ") + one;
  if (w.yes) throw Failure("this motion needs numbers that no file had: " + all, tools::kUsage);
  for (const WishedNumber &number : kNumbers) {
    if (std::find(missing.begin(), missing.end(), number.option) == missing.end()) continue;
    std::optional<double> &out = w.*number.value;
    while (!out) {
      std::string question = number.about;
      question[0] = static_cast<char>(std::toupper(question[0]));
      const std::string answer = ask(question, "", number.option);
      const std::optional<double> value = tools::number_of<double>(answer);
      if (value && *value >= number.least && *value <= number.most)
        out = value;
      else
        std::printf("'%s' is not a number from %g to %g.\n", answer.c_str(), number.least, number.most);
    }
  }
}

}  // namespace wm::init
