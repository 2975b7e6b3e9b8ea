// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "init/robot.h"

namespace wm::init {
namespace {

std::string plain_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

void name_motion(Robot &robot) {
  Wish &w = robot.wish;
  const auto has = [&](unsigned first, unsigned last) {
    for (unsigned q = first; q <= last; q++)
      if (robot.binds(q)) return true;
    return false;
  };
  if (w.motion == "none")
    robot.unknown.emplace_back("motion: the pose is predicted by constant velocity; wheels or an IMU would improve it");
  if (w.motion == "speeds" && !w.imu)
    robot.unknown.emplace_back("turn rate: two wheels' speeds have none here; give --imu, or --motion ticks or twist");
  if (robot.lacks_turn() && (w.sees != "nothing" || w.gnss || robot.binds(WM_CAN_LATITUDE)))
    robot.guesses.emplace_back(
        "motion.model constant_velocity: the speed is not used, since nothing measures the turn; with a turn rate (an "
        "IMU by --imu, or a signal) leave the line out");
  if (w.motion != "can") return;
  if (w.can_interface.empty()) {
    w.can_interface = "can0";
    robot.guesses.emplace_back("CAN interface can0: the first one; `ip link` lists them, --can names another one");
  }
  const bool ticks = robot.binds(WM_Q_WHEEL_TICKS_LEFT);
  const bool speed = ticks || has(WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_VEHICLE_SPEED);
  const bool steering =
      robot.binds(WM_Q_STEERING_WHEEL) || robot.binds(WM_Q_ROAD_WHEEL) || robot.binds(WM_Q_STEERING_ACTUATOR);
  if (!speed) robot.unknown.emplace_back("speed: no signal of the DBC is bound to it; add one to can-signals.yaml");
  if (!ticks && !w.imu && !robot.binds(WM_Q_YAW_RATE) && !steering)
    robot.unknown.emplace_back(
        "turn rate: no signal of the DBC is bound to it; add one to can-signals.yaml, or give --imu");
  if (steering && !w.wheelbase_m && robot.binds(WM_Q_YAW_RATE))
    robot.unknown.emplace_back("wheels.wheelbase_m: the turn rate is the yaw rate's alone; give --wheelbase");
  if (w.can_log.empty())
    robot.unknown.emplace_back(
        "signs of the signals: a DBC has none; give --can-log with a drive, or check each by hand");
}

void name_cameras(Robot &robot) {
  for (size_t i = 0; i < robot.cameras.size(); i++) {
    RobotCamera &camera = robot.cameras[i];
    if (camera.device.empty()) {
      camera.device = "/dev/video" + std::to_string(2 * i);
      robot.guesses.push_back("device of camera " + camera.entry.name + ": " + camera.device +
                              ", in the order of the cameras (each has two nodes); `v4l2-ctl --list-devices` lists "
                              "them, --camera NAME=DEVICE names another one");
    }
    if (!camera.shift_s || *camera.shift_s == 0) continue;
    if (*camera.shift_s < 0)
      robot.guesses.push_back(
          "latency of camera " + camera.entry.name + ": " + plain_number(-1000 * *camera.shift_s) +
          " ms, by Kalibr's timeshift_cam_imu; it holds for the driver that Kalibr's recording was made with");
    else
      robot.unknown.push_back("time offset of camera " + camera.entry.name +
                              ": Kalibr's timeshift_cam_imu has its stamps " + plain_number(1000 * *camera.shift_s) +
                              " ms before the pictures; a latency can't be negative, and 0 is taken");
  }
}

}  // namespace

void name_defaults(Robot &robot) {
  Wish &w = robot.wish;
  name_motion(robot);
  name_cameras(robot);
  if (w.sees == "tags" && w.tag_family.empty()) {
    w.tag_family = "tag36h11";
    robot.guesses.emplace_back(
        "markers.family tag36h11: the most frequent one; `waymark detect` of a picture shows what it finds, "
        "--tag-family names another one");
  }
  if (robot.tags)
    robot.guesses.push_back(
        "sigma_m " + plain_number(kMapSigma_m) +
        " of each tag in landmarks.csv: put up by a tape measure; `waymark map survey` measures it");
  for (const RobotSensor &sensor : robot.sensors)
    robot.guesses.push_back("noise of sensor " + sensor.name + ": " + plain_number(kBearingSigma_rad) + " rad, " +
                            plain_number(kRangeSigma_m) +
                            " m, of a usual camera or laser; `waymark suggest` finds it in a drive");
}

}  // namespace wm::init
