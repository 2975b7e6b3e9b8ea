// SPDX-License-Identifier: Apache-2.0
#include "init/files.h"

#include <cmath>
#include <cstdio>
#include <fstream>

#include "common/failure.h"
#include "init/text_file.h"
#include "waymark/event.h"

namespace wm::init {
namespace {

constexpr int kLateness_ms = 300;  // exposure, transfer and detection; merge.horizon_ms is its limit

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", std::abs(value) < 1e-9 ? 0.0 : value);
  return text;
}

// YAML in quotes where a plain word would not do.
std::string quoted(const std::string &text) {
  const bool plain = !text.empty() && text.find_first_of(":#{}[],&*!|>'\"%@` \t") == std::string::npos;
  if (plain) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

std::string calibration_text(const Robot &robot) {
  const Wish &w = robot.wish;
  std::string out =
      "# base_link: x forward, y left, z up, on the ground under the middle of the driven (rear) axle. A tape measure "
      "will do: the\n"
      "# filter finds the rest. All keys: docs/recording-format.md.\n";
  std::string wheels;
  const auto wheel = [&](const char *key, const std::optional<double> &value, const char *about) {
    if (!value) return;
    const auto by = robot.wheels_by.find(key);
    wheels += std::string("  ") + key + ": " + number(*value) + "   # " + about +
              (by == robot.wheels_by.end() ? "" : "; by " + one_line(by->second)) + "\n";
  };
  wheel("radius_m", w.radius_m, "under load");
  wheel("ticks_per_turn", w.ticks_per_turn, "counts of one turn of the wheel, behind the gearbox");
  wheel("track_m", w.track_m, "between the wheels' middles");
  wheel("wheelbase_m", w.wheelbase_m, "from the rear axle to the front one");
  wheel("steering_ratio", w.steering_ratio, "steering wheel's angle over the road wheels'");
  if (!wheels.empty()) out += "wheels:\n" + wheels;
  if (!robot.cameras.empty()) {
    std::vector<calibrate::Entry> entries;
    for (const RobotCamera &camera : robot.cameras) entries.push_back(camera.entry);
    out += calibrate::calibration_yaml(entries);
  }
  if (w.sees == "points" && robot.cameras.size() >= 2) {
    const auto place = [&](size_t i) { return robot.cameras[i].entry.camera.T_base_camera.translation(); };
    out += "stereo:\n  left: " + robot.cameras[0].entry.name + "\n  right: " + robot.cameras[1].entry.name +
           "\n  baseline_m: " + number((place(0) - place(1)).norm()) + "\n";
  }
  if (!robot.sensors.empty()) {
    out += "sensors:\n";
    for (const RobotSensor &sensor : robot.sensors)
      out += "  " + sensor.name + ":" +
             (sensor.mounted_by.empty() ? "   # its place is to be measured" : "   # " + one_line(sensor.mounted_by)) +
             "\n    mounting: " + calibrate::mounting_yaml(sensor.mounting) +
             "\n    bearing_sigma_rad: " + number(kBearingSigma_rad) + "\n    range_sigma_m: " + number(kRangeSigma_m) +
             "\n";
  }
  if (w.sees == "tags") {
    out += "markers: {family: " + w.tag_family + ", size_m: " + number(w.tag_size_m.value_or(0)) +
           "}   # docs/markers.md: what is measured of each family\n";
  }
  if (robot.imu)
    out += "imu: {mounting: " + calibrate::mounting_yaml(robot.imu->mounting) + "}   # " +
           one_line(robot.imu->mounted_by) + "\n";
  if (robot.gnss && (w.gnss || robot.binds(WM_CAN_LATITUDE)))
    out += "gnss: {mounting: " + calibrate::mounting_yaml(robot.gnss->mounting) + "}   # the antenna; " +
           one_line(robot.gnss->mounted_by) + "\n";
  return out;
}

std::string devices_text(const Robot &robot) {
  const Wish &w = robot.wish;
  std::string out;
  if (w.motion == "can")
    out +=
        "  can:\n    - {interface: " + quoted(w.can_interface) + "}   # brought up by systemd-networkd or `ip link`\n";
  std::string lcm;
  const std::string clock = w.sender_clock ? ", clock: sender" : "";
  const auto stream = [&](const std::string &name, const char *about) {
    lcm += "    - {stream: " + name + clock + "}   # " + about + "\n";
  };
  if (w.motion == "twist") stream("motion", "motion_t: speed forwards and to the left, turn rate");
  if (w.motion == "ticks") stream("ticks", "ticks_t: counts of the left and the right wheel");
  if (w.motion == "speeds") stream("speeds", "speeds_t: speeds of the left and the right wheel");
  if (w.motion == "steering") stream("steering", "steering_t: speed and the road wheels' angle");
  if (w.imu) stream("imu", "imu_t: gyro and accelerometer");
  if (w.gnss && !robot.binds(WM_CAN_LATITUDE)) stream("gnss", "gnss_t: positions in the map's axes");
  if (!lcm.empty()) out += "  lcm:   # other programs send these (docs/motion-sources.md)\n" + lcm;
  if (w.sees == "sightings") out += "  sightings: lcm   # observations_t of a program of yours (docs/live.md)\n";
  if (!robot.cameras.empty()) out += "  cameras:\n";
  for (const RobotCamera &camera : robot.cameras) {
    out += "    - {name: " + camera.entry.name + ", device: " + quoted(camera.device);
    if (camera.shift_s && *camera.shift_s < 0) out += ", latency_ms: " + number(-1000 * *camera.shift_s);
    out += "}   # better a name that lasts: /dev/v4l/by-id/...";
    if (camera.shift_s && *camera.shift_s < 0) out += " Latency: Kalibr's timeshift_cam_imu";
    out += "\n";
  }
  return out.empty() ? "" : "\ndevices:\n" + out;
}

struct Sight {
  const char *sees, *estimator, *detector, *source, *about;
};
const Sight kSights[] = {
    {"tags", "slam", "apriltag", "apriltag",
     "coded markers at unknown places: the map is made while driving (docs/markers.md)"},
    {"sightings", "landmark_ekf", "", "sightings", "landmarks at known places, seen by bearing or range"},
    {"signs", "landmark_ekf", "landmarks", "landmarks",
     "flat landmarks whose pictures the map has (docs/landmarks.md)"},
    {"edges", "edge_mcl", "edges", "edges", "edges of a floor plan (docs/edges.md)"},
    {"lines", "slam", "lines", "lines", "upright lines at unknown places (docs/lines.md)"},
    {"points", "stereo_ekf", "stereo", "stereo", "points in the pictures of a stereo pair (docs/stereo.md)"},
    {"nothing", "odometry", "", "", "nothing but its motion"},
};

Sight sight_of(const Robot &robot) {
  for (Sight one : kSights)
    if (robot.wish.sees == one.sees) {
      if (robot.tags || (robot.wish.sees == "tags" && !robot.wish.landmarks.empty())) {
        one.estimator = "landmark_ekf";
        one.about = "coded markers at known places (landmarks.csv)";
      }
      if (robot.wish.sees == "nothing" && (robot.wish.gnss || robot.binds(WM_CAN_LATITUDE))) {
        one.estimator = "landmark_ekf";
        one.about = "positions of a GNSS receiver";
      }
      return one;
    }
  throw tools::Failure("--sees " + robot.wish.sees + ": is unknown", tools::kUsage);
}

std::string config_text(const Robot &robot) {
  const Wish &w = robot.wish;
  const Sight sight = sight_of(robot);
  const bool gnss = w.gnss || robot.binds(WM_CAN_LATITUDE), is_slam = std::string(sight.estimator) == "slam";
  std::string out = "# Made by `waymark init`: " + std::string(sight.about) +
                    ".\n"
                    "# Every key, its unit and default: docs/config.md. Noises and calibration states have defaults "
                    "that suit wheels on a normal\n"
                    "# floor; after a drive, `waymark suggest` finds better ones.\n"
                    "format: waymark-config/1\n"
                    "estimator: " +
                    sight.estimator +
                    "\n\n"
                    "calibration: calibration.yaml\n";
  if (w.motion == "can") out += "dbc: vehicle.dbc\ncan_signals: can-signals.yaml\n";
  if (robot.tags)
    out += "landmarks: landmarks.csv\n";
  else if (!w.landmarks.empty())
    out += "landmarks: " + quoted(std::filesystem::absolute(w.landmarks).lexically_normal().string()) + "\n";
  if (!w.map.empty()) out += "map: " + quoted(std::filesystem::absolute(w.map).lexically_normal().string()) + "\n";
  out += devices_text(robot);
  if (*sight.detector != '\0') out += "\nvision:\n  " + std::string(sight.detector) + ": {}\n";
  std::string sources;
  if (*sight.source != '\0')
    sources += "  - {name: " + std::string(sight.source) + ", lateness_max_ms: " + std::to_string(kLateness_ms) +
               "}   # pictures take their time; late ones are fused all the same\n";
  if (gnss) sources += "  - {name: gnss, lateness_max_ms: " + std::to_string(kLateness_ms) + "}\n";
  if (!sources.empty()) out += "\nsources:\n" + sources;
  if (w.motion == "twist")
    out += "\nmotion: {twist: measured}   # commands: where the rows are what a controller asked for\n";
  if (robot.lacks_turn() && std::string(sight.estimator) != "odometry")
    out += "\nmotion: {model: constant_velocity}   # nothing measures the turn: what is observed moves the pose\n";
  if (is_slam || std::string(sight.estimator) == "odometry" || std::string(sight.estimator) == "stereo_ekf")
    out += "\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}   # the map begins where the robot stands\n";
  out += "\n# A restart continues where the last run ended.\nstart: {saved_pose: pose.yaml" +
         std::string(is_slam ? ", saved_map: map.wmmap" : "") + "}\n";
  return out;
}

std::string recording_text(const Robot &robot) {
  std::string out =
      "# The drive that `waymark init` was given. Its calibration, DBC and signals are those beside robot.yaml.\n"
      "format: waymark-recording/1\nname: first-drive\nstreams: [";
  std::string streams;
  if (!robot.wish.can_log.empty()) streams = "can.log";
  for (const std::string &path : robot.wish.streams)
    streams += (streams.empty() ? "" : ", ") + std::filesystem::path(path).filename().string();
  return out + streams + "]\n";
}

}  // namespace

std::vector<File> robot_files(const Robot &robot) {
  const Wish &w = robot.wish;
  std::vector<File> out{{"robot.yaml", config_text(robot), "",
                         std::string("estimator ") + sight_of(robot).estimator + ": " + sight_of(robot).about},
                        {"calibration.yaml", calibration_text(robot), "", "wheels, cameras, mountings"}};
  if (robot.dbc) {
    out.push_back({"can-signals.yaml",
                   can_signals_yaml(*robot.dbc, robot.candidates, robot.signals,
                                    w.can_log.empty() ? "" : std::filesystem::path(w.can_log).filename().string()),
                   "", std::to_string(robot.signals.size()) + " quantities from CAN"});
    out.push_back({"vehicle.dbc", robot.dbc_text, w.dbc, w.dbc.empty() ? "groups of NMEA 2000" : "a copy"});
  }
  if (robot.tags)
    out.push_back({"landmarks.csv", landmarks_csv(*robot.tags, kMapSigma_m), "",
                   std::to_string(robot.tags->tags.size()) + " tags"});
  if (!w.can_log.empty() || !w.streams.empty()) {
    out.push_back({"first-drive/recording.yaml", recording_text(robot), "", "the drive as a recording"});
    if (!w.can_log.empty()) out.push_back({"first-drive/can.log", "", w.can_log, "a copy"});
    for (const std::string &path : w.streams)
      out.push_back({"first-drive/" + std::filesystem::path(path).filename().string(), "", path, "a copy"});
  }
  return out;
}

void write_files(const std::string &folder, const std::vector<File> &files, bool force) {
  namespace fs = std::filesystem;
  const fs::path to = folder;
  for (const File &file : files) {
    if (!force && fs::exists(to / file.name))
      throw tools::Failure(
          (to / file.name).string() + ": exists already and is not overwritten; name another folder, or give --force",
          tools::kUsage);
    if (!file.from.empty() && !fs::is_regular_file(file.from))
      throw tools::Failure(file.from + ": cannot be read", tools::kUsage);
  }
  try {
    for (const File &file : files) {
      fs::create_directories((to / file.name).parent_path());
      if (!file.from.empty()) {
        if (fs::exists(to / file.name) && fs::equivalent(to / file.name, file.from)) continue;
        fs::copy_file(file.from, to / file.name, fs::copy_options::overwrite_existing);
        fs::permissions(to / file.name, fs::perms::owner_write, fs::perm_options::add);
        continue;
      }
      std::ofstream out(to / file.name);
      out << file.text;
      out.close();
      if (!out) throw tools::Failure((to / file.name).string() + ": could not be written");
    }
  } catch (const fs::filesystem_error &problem) {
    throw tools::Failure(problem.path1().string() + ": could not be written: " + problem.code().message());
  }
}

}  // namespace wm::init
