// SPDX-License-Identifier: Apache-2.0
#include "simulate/write.h"

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "simulate/angle.h"
#include "simulate/bus.h"
#include "simulate/motion.h"
#include "waymark/internal/math/elementary.hpp"

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

// A field of a CSV; empty for what is absent.
std::string number(double value, int digits) {
  if (std::isnan(value)) return "";
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

// A YAML scalar in double quotes.
std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' || c == '\t' ? ' ' : c;
  }
  return out + "\"";
}

// A file of features is there when a sensor could have given a row, even where none did.
bool any(const Scenario &sc, std::initializer_list<Sensor::Kind> kinds) {
  return std::any_of(sc.sensors.begin(), sc.sensors.end(),
                     [&](const Sensor &s) { return std::find(kinds.begin(), kinds.end(), s.kind) != kinds.end(); });
}
bool has_sightings(const Scenario &sc) {
  return !sc.cameras.empty() || any(sc, {Sensor::Kind::landmarks, Sensor::Kind::compass});
}
bool has_markers(const Scenario &sc) { return any(sc, {Sensor::Kind::markers}); }
bool has_edges(const Scenario &sc) { return any(sc, {Sensor::Kind::edges}); }
bool has_stereo(const Scenario &sc) { return any(sc, {Sensor::Kind::stereo}); }
bool has_fixes(const Scenario &sc) { return any(sc, {Sensor::Kind::gnss, Sensor::Kind::depth}); }
// A world of features whose map is known has a file even for no landmark at all.
bool has_map(const Scenario &sc, const Recording &r) {
  return !r.map.empty() || (!sc.world.pictured() && sc.mapped == Mapped::all);
}
bool has_landmarks(const Scenario &sc, const Recording &r) { return !r.landmarks.empty() || has_map(sc, r); }

bool has_twists(const Scenario &sc, const Recording &r) {
  return sc.motion.measured && r.motion6.empty() && (sc.robot.commanded || sc.motion.twist_hz > 0);
}

// The files that are there, as `streams` of recording.yaml lists them.
std::string streams(const Scenario &sc, const Recording &r) {
  std::string text = !r.motion6.empty()   ? "motion6.csv, "
                     : has_twists(sc, r)  ? "motion.csv, "
                     : sc.motion.measured ? "can.log, vehicle.dbc, can-signals.yaml, "
                                          : "";
  if (!r.imu.empty()) text += "imu.csv, ";
  text += "calibration.yaml";
  if (has_map(sc, r)) text += ", landmarks.csv";
  if (has_sightings(sc)) text += ", sightings.csv";
  if (has_markers(sc)) text += ", markers.csv";
  if (has_edges(sc)) text += ", points.csv";
  if (has_stereo(sc)) text += ", stereo.csv";
  if (has_fixes(sc)) text += ", gnss.csv";
  for (const std::string &stream : r.picture_streams) text += ", " + stream;
  text += ", truth.csv";
  if (has_landmarks(sc, r)) text += ", truth-landmarks.csv";
  return text;
}

// No steering: two driven wheels.
bool turns_on_the_spot(const Scenario &sc) { return sc.robot.differential; }

wm_status write_recording_yaml(const Scenario &sc, const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.print("format: waymark-recording/1\nname: %s\n", quoted(sc.name).c_str());
  if (!sc.about.empty()) f.print("about: %s\n", quoted(sc.about).c_str());
  if (sc.world.pictured())
    f.print("source: waymark simulate, %s, %s, seed %" PRIu64 "\n", sc.world.kind.c_str(),
            sc.world.hard ? "hard" : "easy", r.seed);
  else
    f.print("source: waymark simulate, seed %" PRIu64 ", %zu landmarks\n", r.seed, r.landmarks.size());
  f.print("licence: CC0-1.0\nduration_s: %.3f\n", r.duration_s);
  f.print("streams: [%s]\n", streams(sc, r).c_str());
  if (!r.motion6.empty()) {
    f.print("vehicle:\n  kind: underwater\n  initial_pose: {x_m: %.6f, y_m: %.6f, z_m: %.6f, ", r.start.p_m[0],
            r.start.p_m[1], r.start.p_m[2]);
    f.print("qx: %.9f, qy: %.9f, qz: %.9f, qw: %.9f, ", r.start.q_xyzw[0], r.start.q_xyzw[1], r.start.q_xyzw[2],
            r.start.q_xyzw[3]);
    f.print("sigma_xy_m: %.6g, sigma_heading_rad: %.6g}\n", r.start.sigma_xy_m, r.start.sigma_heading_rad);
    return f.close(err);
  }
  if (sc.motion.base == Motion::Base::holonomic)
    f.text("vehicle:\n  kind: holonomic\n");
  else if (turns_on_the_spot(sc))
    f.print("vehicle:\n  kind: differential\n  track_m: %.6g\n", sc.robot.wheels.track_m);
  else
    f.print("vehicle:\n  kind: car-like\n  wheelbase_m: %.6g\n  track_m: %.6g\n", sc.robot.wheels.wheelbase_m,
            sc.robot.wheels.track_m);
  f.print("  initial_pose: {x_m: %.6f, y_m: %.6f, heading_rad: %.6f, sigma_xy_m: %.6g, sigma_heading_rad: %.6g}\n",
          r.start.p_m[0], r.start.p_m[1], r.start.heading_rad, r.start.sigma_xy_m, r.start.sigma_heading_rad);
  return f.close(err);
}

// The stereo pair of a world of features, as two cameras without distortion.
void print_pair(File &f, const Sensor &s) {
  const char *const names[] = {"left", "right"};
  const double nowhere[3] = {0, 0, 0}, to_right[3] = {0, -s.baseline_m, 0};
  const Eigen::Isometry3d T_base_right = pose_of(s.xyz_m, s.rpy_rad) * pose_of(to_right, nowhere);
  const Eigen::Vector3d right = T_base_right.translation();
  f.text("cameras:\n");
  for (int i = 0; i < 2; i++) {
    f.print("  %s:\n    model: pinhole-radtan\n    size: [%d, %d]\n", names[i], s.size_px[0], s.size_px[1]);
    f.print("    intrinsics: [%.9g, %.9g, %.9g, %.9g]\n    distortion: [0, 0, 0, 0]\n", s.focal_px, s.focal_px,
            s.centre_px[0], s.centre_px[1]);
    f.print("    mounting: {xyz_m: [%.6g, %.6g, %.6g], ", i ? right.x() : s.xyz_m[0], i ? right.y() : s.xyz_m[1],
            i ? right.z() : s.xyz_m[2]);
    f.print("rpy_deg: [%.9g, %.9g, %.9g]}\n    readout_ns: 0\n", degrees(s.rpy_rad[0]), degrees(s.rpy_rad[1]),
            degrees(s.rpy_rad[2]));
  }
  f.print("stereo:\n  left: left\n  right: right\n  baseline_m: %.6g\n  rectified: [%.9g, %.9g, %.9g, %.9g]\n",
          s.baseline_m, s.focal_px, s.focal_px, s.centre_px[0], s.centre_px[1]);
}

wm_status write_calibration(const Scenario &sc, const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text(r.camera_calibration);
  for (const Sensor &s : sc.sensors) {
    if (s.kind != Sensor::Kind::stereo || sc.world.pictured()) continue;
    print_pair(f, s);
    if (s.sigma_px > 0)
      f.print("  sigma_px: [%.6g, %.6g, %.6g, %.6g]\n", s.sigma_px, s.sigma_px, s.sigma_px, s.sigma_px);
  }
  if (!r.sensors.empty()) f.text("sensors:\n");
  for (const wm_sensor &s : r.sensors) {
    const double *rpy = s.mounting.rpy_rad;
    f.print("  %s:\n    mounting: {xyz_m: [%.6g, %.6g, %.6g], rpy_deg: [%.9g, %.9g, %.9g]}\n", s.name,
            s.mounting.xyz_m[0], s.mounting.xyz_m[1], s.mounting.xyz_m[2], degrees(rpy[0]), degrees(rpy[1]),
            degrees(rpy[2]));
    if (s.bearing_sigma_rad > 0) f.print("    bearing_sigma_rad: %.6g\n", s.bearing_sigma_rad);
    if (s.range_sigma_m > 0) f.print("    range_sigma_m: %.6g\n", s.range_sigma_m);
    if (s.range_is_depth) f.text("    range_is: depth\n");
  }
  bool has_antenna = false;
  for (const Sensor &s : sc.sensors)
    if (s.kind == Sensor::Kind::gnss && !std::exchange(has_antenna, true))
      f.print("gnss: {mounting: {xyz_m: [%.6g, %.6g, %.6g]}}\n", s.xyz_m[0], s.xyz_m[1], s.xyz_m[2]);
  if (!r.motion6.empty()) {
    const double v = sc.errors.speed_noise_mps, w = sc.errors.yaw_rate_noise_radps;
    if (v > 0 && w > 0)
      f.print("motion6: {sigma_v_mps: [%.6g, %.6g, %.6g], sigma_w_radps: [%.6g, %.6g, %.6g]}\n", v, v, v, w, w, w);
    return f.close(err);
  }
  if (has_twists(sc, r) || !sc.motion.measured) return f.close(err);
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
    f.print("%" PRId64 ",%s,%d,%s,%s,%" PRId64 "\n", s.t_ns, r.sensors[s.sensor].name, s.id,
            number(s.bearing_rad, 9).c_str(), number(s.range_m, 6).c_str(), s.arrival_ns);
  return f.close(err);
}

wm_status write_markers(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,sensor,id,x_m,y_m,z_m,yaw_rad,arrival_ns\n");
  for (const MarkerSeen &m : r.markers)
    f.print("%" PRId64 ",%s,%d,%.6f,%.6f,%.6f,%.9f,%" PRId64 "\n", m.t_ns, r.sensors[m.sensor].name, m.id, m.p_m[0],
            m.p_m[1], m.p_m[2], m.yaw_rad, m.arrival_ns);
  return f.close(err);
}

wm_status write_edges(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,x_m,y_m,arrival_ns\n");
  for (const EdgesSeen &seen : r.edges)
    for (const Eigen::Vector2d &p : seen.points_m)
      f.print("%" PRId64 ",%.4f,%.4f,%" PRId64 "\n", seen.t_ns, p.x(), p.y(), seen.arrival_ns);
  return f.close(err);
}

wm_status write_stereo(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  const auto looks = [](const StereoSeen &p) { return p.appearance[0] != 0; };
  const bool appearances = std::any_of(r.stereo.begin(), r.stereo.end(), looks);
  f.print("t_ns,id,ul_px,vl_px,ur_px,vr_px%s,arrival_ns\n", appearances ? ",appearance" : "");
  for (const StereoSeen &p : r.stereo) {
    f.print("%" PRId64 ",%d,%s,%s,%s,%s", p.t_ns, p.id, number(p.left_px[0], 4).c_str(),
            number(p.left_px[1], 4).c_str(), number(p.right_px[0], 4).c_str(), number(p.right_px[1], 4).c_str());
    if (appearances)
      f.print(",%016" PRIx64 "%016" PRIx64 "%016" PRIx64 "%016" PRIx64, p.appearance[0], p.appearance[1],
              p.appearance[2], p.appearance[3]);
    f.print(",%" PRId64 "\n", p.arrival_ns);
  }
  return f.close(err);
}

wm_status write_fixes(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m,arrival_ns\n");
  for (const Fix &p : r.fixes)
    f.print("%" PRId64 ",%.6f,%.6f,%.6f,%.6g,%.6g,%" PRId64 "\n", p.t_ns, p.p_m[0], p.p_m[1], p.p_m[2], p.sigma_xy_m,
            p.sigma_z_m, p.arrival_ns);
  return f.close(err);
}

wm_status write_landmarks(const std::vector<wm_landmark> &landmarks, const std::string &path, wm_error *err) {
  File f(path);
  const bool markers =
      std::any_of(landmarks.begin(), landmarks.end(), [](const wm_landmark &l) { return !std::isnan(l.yaw_rad); });
  f.print("id,x_m,y_m,z_m,sigma_m%s\n", markers ? ",yaw_rad" : "");
  for (const wm_landmark &l : landmarks) {
    f.print("%d,%.6f,%.6f,%.6f,%.6g", l.id, l.p_m[0], l.p_m[1], l.p_m[2], l.sigma_m);
    if (markers) f.print(",%s", number(l.yaw_rad, 6).c_str());
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

wm_status write_commands(const Scenario &sc, const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  const bool sideways = sc.motion.base == Motion::Base::holonomic;
  f.print("t_ns,v_mps,%sw_radps\n", sideways ? "vy_mps," : "");
  for (const Command &c : r.commands) {
    f.print("%" PRId64 ",%.6f,", r.clock_start_ns + static_cast<wm_time_ns>(std::llround(c.t_s * 1e9)), c.v_mps);
    if (sideways) f.print("%.6f,", c.side_mps);
    f.print("%.6f\n", c.w_radps);
  }
  return f.close(err);
}

wm_status write_imu(const Recording &r, const std::string &path, wm_error *err) {
  File f(path);
  f.text("t_ns,wx_radps,wy_radps,wz_radps,ax_mps2,ay_mps2,az_mps2\n");
  for (const ImuRow &m : r.imu)
    f.print("%" PRId64 ",%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", m.t_ns, m.w_radps[0], m.w_radps[1], m.w_radps[2],
            m.a_mps2[0], m.a_mps2[1], m.a_mps2[2]);
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
  if (made) return wm_fail(err, WM_IO, "%s: cannot create this folder: %s", dir.c_str(), made.message().c_str());
  const auto in = [&](const char *name) { return dir + "/" + name; };
  std::filesystem::remove(in("recording.yaml"), made);  // until the new one is whole, there is none
  const bool six = !r.motion6.empty();
  const Messages sent = messages_of(sc);
  wm_status status = WM_OK;
  if (six) {
    status = write_motion6(r, in("motion6.csv"), err);
  } else if (has_twists(sc, r)) {
    status = write_commands(sc, r, in("motion.csv"), err);
  } else if (sc.motion.measured) {
    status = write_text(dbc_text(sent), in("vehicle.dbc"), err);
    if (status == WM_OK) status = write_text(can_signals_text(sent), in("can-signals.yaml"), err);
    if (status == WM_OK) status = write_can(r, in("can.log"), err);
  }
  if (status == WM_OK && !r.imu.empty()) status = write_imu(r, in("imu.csv"), err);
  if (status == WM_OK) status = write_calibration(sc, r, in("calibration.yaml"), err);
  if (status == WM_OK && has_map(sc, r)) status = write_landmarks(r.map, in("landmarks.csv"), err);
  if (status == WM_OK && has_sightings(sc)) status = write_sightings(r, in("sightings.csv"), err);
  if (status == WM_OK && has_markers(sc)) status = write_markers(r, in("markers.csv"), err);
  if (status == WM_OK && has_edges(sc)) status = write_edges(r, in("points.csv"), err);
  if (status == WM_OK && has_stereo(sc)) status = write_stereo(r, in("stereo.csv"), err);
  if (status == WM_OK && has_fixes(sc)) status = write_fixes(r, in("gnss.csv"), err);
  if (status == WM_OK) status = six ? write_truth6(r, in("truth.csv"), err) : write_truth(r, in("truth.csv"), err);
  if (status == WM_OK && has_landmarks(sc, r)) status = write_landmarks(r.landmarks, in("truth-landmarks.csv"), err);
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
