// SPDX-License-Identifier: Apache-2.0
#include "simulate/write.h"

#include <cerrno>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "math/elementary.hpp"
#include "simulate/angle.h"
#include "simulate/bus.h"

namespace wm::sim {
namespace {

// printf into a file; remembers that something failed until close().
class File {
 public:
  File(const std::string &path) : path_(path), file_(std::fopen(path.c_str(), "w")) {
    if (!file_) error_ = errno;
  }
  File(const File &) = delete;
  File &operator=(const File &) = delete;
  ~File() {
    if (file_) std::fclose(file_);
  }
  template <class... Args>
  void print(const char *format, Args... args) {
    if (file_ && std::fprintf(file_, format, args...) < 0) error_ = errno;
  }
  void text(const std::string &text) { print("%s", text.c_str()); }
  wm_status close(wm_error *err) {
    if (file_ && std::fclose(file_) != 0) error_ = errno;
    file_ = nullptr;
    if (error_ == 0) return WM_OK;
    return wm_fail(err, WM_IO, "%s: can't write: %s", path_.c_str(), std::strerror(error_));
  }

 private:
  std::string path_;
  FILE *file_;
  int error_ = 0;
};

double degrees(double rad) { return rad * 180 / kPi; }

// A YAML scalar in double quotes.
std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' || c == '\t' ? ' ' : c;
  }
  return out + "\"";
}

// The files of a recording with pictures that are there, as `streams` lists them.
std::string streams(const Scenario &sc, const Recording &r) {
  if (!sc.world.pictured())
    return "can.log, vehicle.dbc, can-signals.yaml, calibration.yaml, landmarks.csv, sightings.csv, truth.csv, "
           "truth-landmarks.csv";
  std::string text = r.motion6.empty() ? "can.log, vehicle.dbc, can-signals.yaml" : "motion6.csv";
  text += ", calibration.yaml";
  if (!r.map.empty()) text += ", landmarks.csv";
  for (const std::string &stream : r.picture_streams) text += ", " + stream;
  text += ", truth.csv";
  if (!r.landmarks.empty()) text += ", truth-landmarks.csv";
  return text;
}

// No steering: two driven wheels.
bool turns_on_the_spot(const Scenario &sc) { return sc.world.kind == "office" || sc.world.kind == "hall"; }

wm_status write_recording_yaml(const Scenario &sc, const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.print("format: waymark-recording/1\nname: %s\n", quoted(sc.name).c_str());
  if (!sc.about.empty()) f.print("about: %s\n", quoted(sc.about).c_str());
  if (sc.world.pictured())
    f.print("source: waymark simulate, %s, %s, seed %" PRIu64 "\n", sc.world.kind.c_str(),
            sc.world.hard ? "hard" : "easy", r.seed);
  else
    f.print("source: waymark simulate, seed %" PRIu64 ", %zu landmarks\n", r.seed, r.map.size());
  f.print("licence: CC0-1.0\nduration_s: %.3f\n", r.duration_s);
  f.print("streams: [%s]\n", streams(sc, r).c_str());
  if (!r.motion6.empty()) {
    f.print("vehicle:\n  kind: underwater\n  initial_pose: {x_m: %.6f, y_m: %.6f, z_m: %.6f, ", r.start.p_m[0],
            r.start.p_m[1], r.start.p_m[2]);
    f.print("qx: %.9f, qy: %.9f, qz: %.9f, qw: %.9f}\n", r.start.q_xyzw[0], r.start.q_xyzw[1], r.start.q_xyzw[2],
            r.start.q_xyzw[3]);
    return f.close(err);
  }
  if (turns_on_the_spot(sc))
    f.print("vehicle:\n  kind: differential\n  track_m: %.6g\n", sc.robot.wheels.track_m);
  else
    f.print("vehicle:\n  kind: car-like\n  wheelbase_m: %.6g\n  track_m: %.6g\n", sc.robot.wheels.wheelbase_m,
            sc.robot.wheels.track_m);
  f.print("  initial_pose: {x_m: %.6f, y_m: %.6f, heading_rad: %.6f, sigma_xy_m: %.6g, sigma_heading_rad: %.6g}\n",
          r.start.p_m[0], r.start.p_m[1], r.start.heading_rad, r.start.sigma_xy_m, r.start.sigma_heading_rad);
  return f.close(err);
}

wm_status write_calibration(const Scenario &sc, const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text(r.camera_calibration);
  if (!r.motion6.empty()) return f.close(err);
  if (!r.sensors.empty()) f.text("sensors:\n");
  for (size_t i = 0; i < r.sensors.size(); i++) {
    const wm_sensor &s = r.sensors[i];
    f.print("  %s:\n    mounting: {xyz_m: [%.6g, %.6g, %.6g], rpy_deg: [0, 0, %.9g]}\n", s.name, s.mounting.xyz_m[0],
            s.mounting.xyz_m[1], s.mounting.xyz_m[2], degrees(s.mounting.rpy_rad[2]));
    if (s.bearing_sigma_rad > 0) f.print("    bearing_sigma_rad: %.6g\n", s.bearing_sigma_rad);
  }
  const wm_wheels &w = sc.robot.wheels;
  f.print("wheels:\n  radius_m: %.6g\n  ticks_per_turn: %.6g\n  track_m: %.6g\n", w.radius_m, w.ticks_per_turn,
          w.track_m);
  if (!turns_on_the_spot(sc)) f.print("  wheelbase_m: %.6g\n", w.wheelbase_m);
  if (w.steering_table_count > 0) {
    f.text("  steering_table:\n    actuator_mm: [");
    for (uint32_t i = 0; i < w.steering_table_count; i++) f.print("%s%.6g", i ? ", " : "", 1000 * w.actuator_m[i]);
    f.text("]\n    road_wheel_rad: [");
    for (uint32_t i = 0; i < w.steering_table_count; i++) f.print("%s%.9g", i ? ", " : "", w.road_wheel_rad[i]);
    f.text("]\n");
  }
  return f.close(err);
}

wm_status write_can(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  for (const wm_can_frame &c : r.can) {
    f.print("(%" PRId64 ".%06" PRId64 ") %s %03X#", c.t_ns / WM_NS_PER_S, c.t_ns % WM_NS_PER_S / WM_NS_PER_US, c.iface,
            c.id);
    for (int i = 0; i < c.length; i++) f.print("%02X", c.data[i]);
    f.text("\n");
  }
  return f.close(err);
}

wm_status write_sightings(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,sensor,id,bearing_rad,range_m,arrival_ns\n");
  for (const Sighting &s : r.sightings)
    f.print("%" PRId64 ",%s,%d,%.9f,,%" PRId64 "\n", s.t_ns, r.sensors[s.sensor].name, s.id, s.bearing_rad,
            s.arrival_ns);
  return f.close(err);
}

wm_status write_landmarks(const std::vector<wm_landmark> &landmarks, const std::string &path, wm_error *err) {
  File f(path);
  const bool markers = !landmarks.empty() && !std::isnan(landmarks[0].yaw_rad);
  f.print("id,x_m,y_m,z_m,sigma_m%s\n", markers ? ",yaw_rad" : "");
  for (const wm_landmark &l : landmarks) {
    f.print("%d,%.6f,%.6f,%.6f,%.6g", l.id, l.p_m[0], l.p_m[1], l.p_m[2], l.sigma_m);
    if (markers) f.print(",%.6f", l.yaw_rad);
    f.text("\n");
  }
  return f.close(err);
}

wm_status write_truth(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,x_m,y_m,z_m,qx,qy,qz,qw\n");
  for (const Truth &t : r.truth) {
    const double half = 0.5 * wrap(t.state.heading_rad);
    f.print("%" PRId64 ",%.6f,%.6f,0,0,0,%.9f,%.9f\n", t.t_ns, t.state.x_m, t.state.y_m, wm::sin(half), wm::cos(half));
  }
  return f.close(err);
}

wm_status write_motion6(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,vx_mps,vy_mps,vz_mps,wx_radps,wy_radps,wz_radps\n");
  for (const Twist6 &m : r.motion6)
    f.print("%" PRId64 ",%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", m.t_ns, m.v_mps[0], m.v_mps[1], m.v_mps[2], m.w_radps[0],
            m.w_radps[1], m.w_radps[2]);
  return f.close(err);
}

wm_status write_truth6(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,x_m,y_m,z_m,qx,qy,qz,qw\n");
  for (const Truth6 &t : r.truth6)
    f.print("%" PRId64 ",%.6f,%.6f,%.6f,%.9f,%.9f,%.9f,%.9f\n", t.t_ns, t.xyz_m[0], t.xyz_m[1], t.xyz_m[2], t.q_xyzw[0],
            t.q_xyzw[1], t.q_xyzw[2], t.q_xyzw[3]);
  return f.close(err);
}

wm_status write_text(const std::string &text, const std::string &path, wm_error *err) {
  File f(path);
  f.text(text);
  return f.close(err);
}

}  // namespace

wm_status write_sensors(const Scenario &sc, const Recording &r, const std::string &dir, wm_error *err) {
  std::error_code made;
  std::filesystem::create_directories(dir, made);
  if (made) return wm_fail(err, WM_IO, "%s: can't make this folder: %s", dir.c_str(), made.message().c_str());
  const auto in = [&](const char *name) { return dir + "/" + name; };
  std::filesystem::remove(in("recording.yaml"), made);  // until the new one is whole, there is none
  const bool six = !r.motion6.empty(), all = !sc.world.pictured();
  const Messages sent = messages_of(sc);
  wm_status status = WM_OK;
  if (six) {
    status = write_motion6(r, in("motion6.csv"), err);
  } else {
    status = write_text(dbc_text(sent), in("vehicle.dbc"), err);
    if (status == WM_OK) status = write_text(can_signals_text(sent), in("can-signals.yaml"), err);
    if (status == WM_OK) status = write_can(r, in("can.log"), err);
  }
  if (status == WM_OK) status = write_calibration(sc, r, in("calibration.yaml"), err);
  if (status == WM_OK && (all || !r.map.empty())) status = write_landmarks(r.map, in("landmarks.csv"), err);
  if (status == WM_OK && all) status = write_sightings(r, in("sightings.csv"), err);
  if (status == WM_OK) status = six ? write_truth6(r, in("truth.csv"), err) : write_truth(r, in("truth.csv"), err);
  if (status == WM_OK && (all || !r.landmarks.empty()))
    status = write_landmarks(r.landmarks, in("truth-landmarks.csv"), err);
  return status;
}

wm_status finish_recording(const Scenario &sc, const Recording &r, const std::string &dir, wm_error *err) {
  return write_recording_yaml(sc, r, dir + "/recording.yaml", err);
}

wm_status write_recording(const Scenario &sc, const Recording &r, const std::string &dir, wm_error *err) {
  const wm_status status = write_sensors(sc, r, dir, err);
  return status == WM_OK ? finish_recording(sc, r, dir, err) : status;
}

}  // namespace wm::sim
