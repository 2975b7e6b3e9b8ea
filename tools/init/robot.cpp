// SPDX-License-Identifier: Apache-2.0
#include "init/robot.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "calibrate/flat_file.h"
#include "calibrate/foreign.h"
#include "common/failure.h"
#include "init/can_log.h"
#include "init/kalibr.h"
#include "init/nmea2000.h"
#include "init/text_file.h"

namespace wm::init {
namespace {

using tools::Failure;

constexpr double kMountedApart_m = 0.05;  // a tape measure's error; beyond it two files mean different places

std::string format(const char *text, double a, double b = 0, double c = 0) __attribute__((format(printf, 1, 0)));
std::string format(const char *text, double a, double b, double c) {
  char out[200];
  std::snprintf(out, sizeof out, text, a, b, c);
  return out;
}

// "NAME=VALUE"; VALUE is "" without '='.
std::pair<std::string, std::string> pair_of(const std::string &text) {
  const size_t at = text.find('=');
  return at == std::string::npos ? std::pair(text, std::string()) : std::pair(text.substr(0, at), text.substr(at + 1));
}

std::string value_for(const std::vector<std::string> &pairs, const std::string &name, const char *option) {
  std::string out;
  for (const std::string &text : pairs) {
    const auto [key, value] = pair_of(text);
    if (value.empty()) throw Failure(std::string(option) + " " + text + ": NAME=VALUE is needed", tools::kUsage);
    if (key == name) out = value;
  }
  return out;
}

images::Pose parse_mounting(const std::string &name, const std::string &text) {
  std::vector<double> n;
  const char *at = text.data(), *end = at + text.size();
  while (at < end) {
    double value = 0;
    const auto [next, problem] = std::from_chars(at, end, value);
    if (problem != std::errc{} || !std::isfinite(value) || (next < end && *next != ',')) break;
    n.push_back(value);
    at = next + (next < end ? 1 : 0);
  }
  if (at != end || n.size() != 6)
    throw Failure("--mounting " + name + "=" + text +
                      ": six numbers are needed: X,Y,Z in m and ROLL,PITCH,YAW in degrees, as in front=0.2,0,0.4,0,0,0",
                  tools::kUsage);
  const double deg = images::kPi / 180;
  return images::pose_xyz_rpy({n[0], n[1], n[2]}, n[3] * deg, n[4] * deg, n[5] * deg);
}

// base_link on the ground, under the middle of the driven (rear) axle, seen from the URDF's base.
class Ground {
 public:
  explicit Ground(const Urdf &urdf) {
    std::vector<UrdfWheel> wheels = urdf.wheels;
    std::erase_if(wheels, [](const UrdfWheel &w) { return w.radius_m <= 0; });
    if (wheels.size() < 2) return;
    rear_x_ = std::min_element(wheels.begin(), wheels.end(), [](const UrdfWheel &a, const UrdfWheel &b) {
                return a.centre_m.x() < b.centre_m.x();
              })->centre_m.x();
    for (const UrdfWheel &w : wheels) {
      if (w.centre_m.x() > rear_x_ + kSameAxle_m) {
        front_x_ = std::max(front_x_.value_or(w.centre_m.x()), w.centre_m.x());
        continue;
      }
      (w.centre_m.y() > 0 ? left_ : right_) = w;
    }
    found_ = left_.radius_m > 0 && right_.radius_m > 0;
  }

  [[nodiscard]] bool found() const { return found_; }
  [[nodiscard]] double track_m() const { return left_.centre_m.y() - right_.centre_m.y(); }
  [[nodiscard]] double radius_m() const { return 0.5 * (left_.radius_m + right_.radius_m); }
  // What of the driven wheels contradicts itself; "": nothing.
  [[nodiscard]] std::string contradiction() const {
    if (std::abs(left_.radius_m - right_.radius_m) > kSameRadius * radius_m())
      return format("wheels.radius_m: the driven wheels have %.4g and %.4g m in the URDF", left_.radius_m,
                    right_.radius_m) +
             "; their mean is taken, measure both";
    if (left_.link.find("right") != std::string::npos && right_.link.find("left") != std::string::npos)
      return "wheels: " + left_.link + " is on the left side of the URDF (y above 0), " + right_.link +
             " on the right one: is y to the left, or are the counters exchanged?";
    return "";
  }
  [[nodiscard]] std::optional<double> wheelbase_m() const {
    return front_x_ ? std::optional(*front_x_ - rear_x_) : std::nullopt;
  }
  [[nodiscard]] images::Vec3 origin() const {
    return {rear_x_, 0.5 * (left_.centre_m.y() + right_.centre_m.y()),
            0.5 * (left_.centre_m.z() + right_.centre_m.z()) - radius_m()};
  }

 private:
  static constexpr double kSameAxle_m = 0.02;
  static constexpr double kSameRadius = 0.02;  // tyres of one kind differ by less
  bool found_ = false;
  double rear_x_ = 0;
  std::optional<double> front_x_;
  UrdfWheel left_, right_;
};

// Mountings: by --mounting, else by Kalibr's chain from an IMU or a first camera that is mounted, else by the URDF.
class Mountings {
 public:
  explicit Mountings(Robot &robot) : robot_(robot) {
    if (!robot.urdf) return;
    const Ground ground(*robot.urdf);
    if (!ground.found()) {
      robot.guesses.push_back("base_link: the URDF's " + robot.urdf->base +
                              ", since the URDF has no two driven wheels with a radius; it must be on the ground, "
                              "under the middle of the driven (rear) axle");
      return;
    }
    shift_.translation() = -ground.origin();
    Wish &w = robot.wish;
    wheel("track_m", w.track_m, ground.track_m());
    wheel("radius_m", w.radius_m, ground.radius_m());
    wheel("wheelbase_m", w.wheelbase_m, ground.wheelbase_m());
    if (const std::string said = ground.contradiction(); !said.empty()) robot.guesses.push_back(said);
    if (ground.origin().norm() > 1e-3)
      robot.guesses.push_back(
          format("base_link: on the ground between the driven (rear) wheels, at (%.3f, %.3f, %.3f) m in the URDF's ",
                 ground.origin().x(), ground.origin().y(), ground.origin().z()) +
          robot.urdf->base + "; poses are of this point");
  }

  std::optional<images::Pose> of(const std::string &name, std::string &by, bool is_camera = false) const {
    if (const std::string text = value_for(robot_.wish.mountings, name, "--mounting"); !text.empty()) {
      by = "given";
      return parse_mounting(name, text);
    }
    if (!robot_.urdf) return std::nullopt;
    std::string link = value_for(robot_.wish.frames, name, "--frame");
    if (!link.empty() && !robot_.urdf->links.contains(link)) {
      std::string known;
      for (const auto &[one, pose] : robot_.urdf->links) known += (known.empty() ? "" : ", ") + one;
      throw Failure(
          robot_.wish.urdf + ": there is no link '" + link + "' (--frame " + name + "=" + link + "); it has " + known,
          tools::kUsage);
    }
    if (link.empty()) link = robot_.urdf->link_of(name, is_camera, robot_.wish.cameras.size() == 1);
    if (link.empty()) return std::nullopt;
    const auto moving = robot_.urdf->moving.find(link);
    if (moving != robot_.urdf->moving.end())
      robot_.guesses.push_back("mounting of " + name + ": where " + link + " is while " + moving->second +
                               ", which moves, is at its 0; poses are wrong while it isn't");
    by = "link " + link + " of " + std::filesystem::path(robot_.wish.urdf).filename().string();
    return shift_ * robot_.urdf->body(link);
  }

 private:
  void wheel(const char *key, std::optional<double> &value, const std::optional<double> &by_urdf) {
    if (value || !by_urdf) return;
    value = by_urdf;
    robot_.wheels_by[key] = std::filesystem::path(robot_.wish.urdf).filename().string();
    robot_.guesses.push_back(std::string("wheels.") + key + format(" %.4g: by the wheels of the URDF", *value) +
                             "; measure it on the loaded robot");
  }

  Robot &robot_;
  images::Pose shift_ = images::Pose::Identity();
};

std::string unmounted(const std::string &kind, const std::string &name) {
  return "mounting of " + kind + " " + name + ": taken as 0; measure it, or give --urdf or --mounting " + name +
         "=X,Y,Z,ROLL,PITCH,YAW";
}

struct Imported {
  calibrate::Entry entry;
  std::optional<ChainCamera> chain;
  std::string file;
};

std::vector<Imported> import_all(const Wish &wish) {
  std::vector<Imported> out;
  for (const std::string &file : wish.calibrations) {
    std::vector<calibrate::ForeignCamera> cameras = calibrate::read_foreign(file, {});
    std::vector<ChainCamera> chain;
    const std::string text = read_text(file);
    if (!text.starts_with('#') || text.find("polynomial") == std::string::npos)
      chain = read_chain(calibrate::FlatFile::parse(text, file));
    for (calibrate::ForeignCamera &camera : cameras) {
      Imported one{.entry = {}, .chain = std::nullopt, .file = file};
      const auto place =
          std::find_if(chain.begin(), chain.end(), [&](const ChainCamera &c) { return c.name == camera.name; });
      if (place != chain.end()) {
        one.chain = *place;
        camera.notes.clear();  // what they leave out is taken here
      }
      one.entry = calibrate::import_camera(camera, camera.name.empty() ? "camera" : camera.name, "auto", file);
      out.push_back(one);
    }
  }
  return out;
}

// The camera's calibration: by its name, else in the order of both lists.
Imported take(std::vector<Imported> &imported, const std::string &name, const std::vector<std::string> &wanted) {
  auto place = std::find_if(imported.begin(), imported.end(), [&](const Imported &i) { return i.entry.name == name; });
  if (place == imported.end())
    place = std::find_if(imported.begin(), imported.end(), [&](const Imported &i) {
      return std::none_of(wanted.begin(), wanted.end(),
                          [&](const std::string &w) { return pair_of(w).first == i.entry.name; });
    });
  if (place == imported.end())
    throw Failure("camera " + name +
                      " has no calibration: --calibration FILE of Kalibr, ROS, OpenCV or OCamCalib; `waymark calibrate "
                      "camera` makes one from pictures of a chessboard",
                  tools::kUsage);
  Imported out = *place;
  imported.erase(place);
  return out;
}

void mount(Robot &robot, const Mountings &mountings, std::vector<Imported> &of_camera) {
  std::string imu_by;
  const std::optional<images::Pose> imu = mountings.of("imu", imu_by);
  std::optional<images::Pose> first;  // optical frame of the chain's first camera
  for (size_t i = 0; i < robot.cameras.size(); i++) {
    RobotCamera &camera = robot.cameras[i];
    const std::optional<ChainCamera> &chain = of_camera[i].chain;
    const std::string file = std::filesystem::path(of_camera[i].file).filename().string();
    std::optional<images::Pose> own = mountings.of(camera.entry.name, camera.mounted_by, true), by_chain;
    const bool given = own && camera.mounted_by == "given";
    if (chain && chain->in_imu && imu) {
      by_chain = *imu * *chain->in_imu;
      if (!given) camera.mounted_by = file + "'s T_cam_imu, and the IMU's place: " + imu_by;
    } else if (chain && chain->in_first && first) {
      by_chain = *first * *chain->in_first;
      if (!given) camera.mounted_by = file + "'s T_cn_cnm1 from the first camera";
    }
    if (by_chain && !given) {
      const images::Pose body = *by_chain * images::T_body_optical().inverse();
      if (own && (own->translation() - body.translation()).norm() > kMountedApart_m)
        robot.guesses.push_back(
            "mounting of camera " + camera.entry.name + ": of the calibration, since it is measured; the URDF's is " +
            format("%.2f m away; measure which is right", (own->translation() - body.translation()).norm()));
      own = body;
    }
    if (own) {
      camera.entry.camera.T_base_camera = *own;
      camera.entry.mounted = true;
      if (!first) first = *own * images::T_body_optical();
      camera.entry.remark += "; mounting: " + one_line(camera.mounted_by);
    } else {
      robot.unknown.push_back(unmounted("camera", camera.entry.name));
    }
    if (chain) camera.shift_s = chain->shift_s;
  }
  std::string gnss_by;
  if (const auto antenna = mountings.of("gnss", gnss_by)) robot.gnss = RobotSensor{"gnss", *antenna, gnss_by};
  if (robot.wish.imu && imu) robot.imu = RobotSensor{"imu", *imu, imu_by};
  if (robot.wish.imu && !imu)
    robot.guesses.emplace_back(
        "mounting of the IMU: axes of base_link (x ahead, y left, z up), since no file has it; a turn to the left must "
        "be positive in imu.csv's wz_radps, else give --mounting imu=X,Y,Z,ROLL,PITCH,YAW or --urdf");
}

}  // namespace

bool Robot::binds(unsigned quantity) const {
  return std::any_of(signals.begin(), signals.end(), [&](const Candidate &c) { return c.quantity == quantity; });
}

bool Robot::lacks_turn() const {
  if (wish.imu) return false;
  if (wish.motion == "speeds") return true;
  const auto is_turn = [](const Candidate &c) {
    return c.quantity == WM_Q_WHEEL_TICKS_LEFT || c.quantity == WM_Q_YAW_RATE || c.quantity == WM_Q_STEERING_WHEEL ||
           c.quantity == WM_Q_ROAD_WHEEL || c.quantity == WM_Q_STEERING_ACTUATOR;
  };
  const auto is_speed = [](const Candidate &c) {
    return c.quantity >= WM_Q_WHEEL_SPEED_FRONT_LEFT && c.quantity <= WM_Q_VEHICLE_SPEED;
  };
  return std::any_of(signals.begin(), signals.end(), is_speed) && std::none_of(signals.begin(), signals.end(), is_turn);
}

static void read_nmea2000(Robot &robot) {
  const Wish &wish = robot.wish;
  Nmea2000 found;
  if (!wish.can_log.empty()) {
    const auto survey = survey_log(wish.can_log);
    uint64_t malformed = 0;
    if (survey->frames == 0) (void)each_frame(wish.can_log, malformed, [](const wm_can_frame &) {});  // throws
    found = nmea2000_of(*survey);
  }
  if (found.dbc_text.empty())
    throw Failure("motion over CAN needs the bus' DBC file: --dbc FILE" +
                      (wish.can_log.empty() ? "" : "; " + wish.can_log + " has none of the groups of NMEA 2000"),
                  tools::kUsage);
  robot.dbc_text = found.dbc_text;
  robot.dbc = parse_dbc(found.dbc_text, "NMEA 2000");
  robot.candidates = found.candidates;
  robot.unknown = found.notes;
}

void read_can(Robot &robot) {
  const Wish &wish = robot.wish;
  if (wish.motion != "can") return;
  if (wish.dbc.empty()) {
    read_nmea2000(robot);
  } else {
    robot.dbc = read_dbc(wish.dbc);
    robot.candidates = name_candidates(*robot.dbc);
  }
  if (!wish.can_log.empty()) robot.log = weigh_by_log(*robot.dbc, wish.can_log, robot.candidates);
  robot.signals = choose(robot.candidates);
  for (const std::string &note : robot.log.notes) robot.unknown.push_back(note);
  if (robot.signals.empty())
    throw Failure(robot.dbc->path.string() + ": none of its " + std::to_string(robot.dbc->signals.size()) +
                  " signals looks like a wheel's speed or count, a speed, a yaw rate or a steering angle" +
                  (wish.can_log.empty() ? "" : " that moves in " + wish.can_log) +
                  "; write can-signals.yaml by hand (docs/can.md)");
}

void read_geometry(Robot &robot) {
  Wish &wish = robot.wish;
  if (!wish.urdf.empty()) robot.urdf = read_urdf(wish.urdf);
  if (robot.urdf) robot.guesses.insert(robot.guesses.end(), robot.urdf->notes.begin(), robot.urdf->notes.end());
  if (robot.log.track_m > 0 && !wish.track_m) {
    wish.track_m = std::round(robot.log.track_m * 100) / 100;
    robot.wheels_by["track_m"] = std::filesystem::path(wish.can_log).filename().string();
    robot.guesses.push_back(
        format("wheels.track_m %.2f", *wish.track_m) +
        ": difference of the wheels' speeds over the yaw rate in the log; measure it between the wheels' middles");
  }
  const Mountings mountings(robot);
  std::vector<Imported> imported = import_all(wish), of_camera;
  if (wish.cameras.empty())
    for (const Imported &one : imported) wish.cameras.push_back(one.entry.name);
  for (const std::string &text : wish.cameras) {
    const auto [name, device] = pair_of(text);
    of_camera.push_back(take(imported, name, wish.cameras));
    RobotCamera camera{.entry = of_camera.back().entry, .device = device, .mounted_by = {}, .shift_s = {}};
    const std::string &calibrated = camera.entry.name;
    if (calibrated != name)
      robot.guesses.push_back("calibration of camera " + name + ": " + calibrated + " of " + of_camera.back().file +
                              ", by the order of the files; `waymark detect` shows whether its markers and lines fit");
    camera.entry.name = name;
    robot.cameras.push_back(camera);
  }
  mount(robot, mountings, of_camera);
  for (const std::string &name : wish.sensors) {
    RobotSensor sensor{.name = name, .mounting = images::Pose::Identity(), .mounted_by = {}};
    if (const auto pose = mountings.of(name, sensor.mounted_by))
      sensor.mounting = *pose;
    else
      robot.unknown.push_back(unmounted("sensor", name));
    robot.sensors.push_back(sensor);
  }
}

void read_maps(Robot &robot) {
  if (!robot.wish.tag_layout.empty()) robot.tags = read_tag_layout(robot.wish.tag_layout);
}

std::vector<std::string> missing_numbers(const Robot &robot) {
  const Wish &w = robot.wish;
  std::vector<std::string> out;
  const bool ticks = w.motion == "ticks" || robot.binds(WM_Q_WHEEL_TICKS_LEFT);
  const bool turn = w.imu || robot.binds(WM_Q_YAW_RATE);
  const bool steering = w.motion == "steering" || (!turn && !ticks && robot.binds(WM_Q_STEERING_WHEEL));
  if (ticks && !w.radius_m) out.emplace_back("--wheel-radius");
  if (ticks && !w.ticks_per_turn) out.emplace_back("--ticks");
  if (ticks && !w.track_m) out.emplace_back("--track");
  if (steering && !w.wheelbase_m) out.emplace_back("--wheelbase");
  if (steering && w.motion == "can" && !w.steering_ratio) out.emplace_back("--steering-ratio");
  return out;
}

}  // namespace wm::init
