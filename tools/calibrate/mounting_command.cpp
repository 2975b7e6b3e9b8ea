// SPDX-License-Identifier: Apache-2.0
// waymark calibrate mounting: where the camera really sits, from a drive with a map.
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "calibrate/commands.h"
#include "calibrate/mounting.h"
#include "common/event_log.h"
#include "common/failure.h"
#include "common/run_folder.h"
#include "common/scratch_folder.h"
#include "waymark/map.h"
#include "waymark/motion.h"
extern "C" {
#include "config/config.h"
}

namespace wm::calibrate {
namespace {

namespace fs = std::filesystem;
using tools::Failure;

struct MountingArguments {
  std::string recording, config, run, camera, map;
};

constexpr double kDegree = std::numbers::pi / 180;

// What is good enough to be written down: what it is in, and how sure it must be.
struct Kind {
  const char *name, *unit, *needs;
  double factor, sigma_max;
  bool mounting;
};
constexpr Kind kKinds[kMountingErrors] = {
    {"pitch", "deg", "edges at different distances", 1 / kDegree, 0.1, true},
    {"roll", "deg", "edges to the left and to the right", 1 / kDegree, 0.15, true},
    {"yaw", "deg", "a straight way forwards and back", 1 / kDegree, 0.15, true},
    {"height", "m", "edges near by, and the wheels' true radius", 1, 0.01, true},
    {"time offset", "ms", "turns, and starting and stopping", 1e3, 8, false},
    {"edge offset", "m", "walls on both sides", 1, 0.01, false},
    {"speed scale", "%", "a longer way", 100, 0.5, false},
    {"yaw rate bias", "mrad/s", "a longer drive", 1e3, 1, false}};

// `waymark replay` of the recording into `folder`.
void replay(const MountingArguments &a, const std::string &folder) {
  const std::string program = (fs::read_symlink("/proc/self/exe").parent_path() / "waymark").string();
  const pid_t child = fork();
  if (child == 0) {
    if (std::freopen("/dev/null", "w", stdout) == nullptr) _exit(127);
    if (a.map.empty())
      execl(program.c_str(), "waymark", "replay", a.recording.c_str(), "--config", a.config.c_str(), "--out",
            folder.c_str(), static_cast<char *>(nullptr));
    else
      execl(program.c_str(), "waymark", "replay", a.recording.c_str(), "--config", a.config.c_str(), "--out",
            folder.c_str(), "--map", a.map.c_str(), static_cast<char *>(nullptr));
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw Failure("waymark replay " + a.recording + " failed; its messages are above");
}

int choose_camera(const MountingArguments &a, const wm_rig &rig) {
  if (rig.camera_count == 0) throw Failure(a.recording + ": calibration.yaml has no camera", tools::kUsage);
  if (a.camera.empty() && rig.camera_count == 1) return 0;
  const int found = a.camera.empty() ? -1 : wm_rig_find_camera(&rig, a.camera.c_str());
  if (found >= 0) return found;
  std::string names;
  for (uint32_t i = 0; i < rig.camera_count; i++) names += std::string(i > 0 ? ", " : "") + rig.cameras[i].name;
  throw Failure("--camera: which? There are " + names, tools::kUsage);
}

// The run's scans with the poses that it gave them, and what the sensors alone said.
std::vector<MountingScan> scans_of(tools::EventLog &log, int camera, const tools::Trajectory &trajectory) {
  const wm_log_head &head = log.head();
  wm_error error{};
  wm_config config{};
  if (wm_config_parse_logged(head.config_text, head.config_length, head.config_path, &config, &error) != WM_OK)
    throw Failure(error.text);
  const std::unique_ptr<wm_config, void (*)(wm_config *)> owned(&config, wm_config_free);
  const std::unique_ptr<void, void (*)(void *)> memory(std::calloc(1, wm_odometry_bytes()), std::free);
  auto *odometry = static_cast<wm_odometry *>(memory.get());
  if (wm_odometry_init(odometry, config.motion, &head.wheels) != WM_OK) throw Failure("no odometry from these sensors");
  std::vector<MountingScan> out;
  while (const wm_event *next = log.next()) {
    const wm_event &event = *next;
    if (wm_event_is_motion(&event)) (void)wm_odometry_feed(odometry, &event);
    if (event.kind != WM_EVENT_POINTS || event.as.points.count < 8) continue;
    if (event.as.points.camera >= 0 && event.as.points.camera != camera) continue;
    wm_odom_point point{};
    const auto pose = tools::pose_at(trajectory.poses, event.t_ns, tools::kMaxGapNs);
    if (!pose || wm_odometry_at(odometry, event.t_ns, &point) != WM_OK) continue;
    if (pose->state != WM_STATE_TRACKING || (!out.empty() && event.t_ns <= out.back().t_ns)) continue;
    const wm_pose2 &o = point.pose_odom_base;
    MountingScan scan;
    scan.t_ns = event.t_ns;
    scan.points = event.as.points;
    scan.start = {pose->p_m.x(), pose->p_m.y(), tools::heading_rad(pose->q)};
    scan.odom = {o.x_m, o.y_m, o.heading_rad};
    scan.v_mps = point.v_mps;
    scan.w_radps = point.w_radps;
    out.push_back(scan);
  }
  return out;
}

// The believed mounting with what was found: a small turn about the axes of floor_camera (left, ahead, up).
wm_mounting mended(const wm_mounting &believed, const Mounting &found) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  const double *rpy = believed.rpy_rad;
  const Eigen::Matrix3d is = (AngleAxisd(rpy[2], Vector3d::UnitZ()) * AngleAxisd(rpy[1], Vector3d::UnitY()) *
                              AngleAxisd(rpy[0], Vector3d::UnitX()))
                                 .toRotationMatrix();
  const Vector3d ahead(std::cos(rpy[2]), std::sin(rpy[2]), 0), left(-std::sin(rpy[2]), std::cos(rpy[2]), 0);
  const Vector3d turn = found.value[kMountingPitch] * left + found.value[kMountingRoll] * ahead +
                        found.value[kMountingYaw] * Vector3d::UnitZ();
  const double angle = turn.norm();
  const Vector3d axis = angle > 0 ? Vector3d(turn / angle) : Vector3d(Vector3d::UnitZ());
  const Eigen::Matrix3d r = AngleAxisd(angle, axis).toRotationMatrix() * is;
  wm_mounting out = believed;
  out.xyz_m[2] += found.value[kMountingHeight];
  out.rpy_rad[0] = std::atan2(r(2, 1), r(2, 2));
  out.rpy_rad[1] = std::asin(-r(2, 0));
  out.rpy_rad[2] = std::atan2(r(1, 0), r(0, 0));
  return out;
}

int report(const Mounting &found, const wm_camera &camera) {
  const wm_mounting is = mended(camera.mounting, found);
  const double believed[kMountingErrors] = {camera.mounting.rpy_rad[1], camera.mounting.rpy_rad[0],
                                            camera.mounting.rpy_rad[2], camera.mounting.xyz_m[2]};
  const double really[kMountingErrors] = {is.rpy_rad[1], is.rpy_rad[0], is.rpy_rad[2], is.xyz_m[2]};
  std::printf("%s, from %d pictures: %.0f %% of the points lie on the map's lines, %.1f mm off\n\n", camera.name,
              found.scans, 100 * found.explained, 1e3 * found.rms_m);
  std::printf("%-14s %10s %10s %9s %10s\n", "", "before", "off by", "+-", "found");
  bool all_known = true;
  for (size_t i = 0; i < kMountingErrors; i++) {
    const Kind &k = kKinds[i];
    const double value = k.factor * found.value[i], sigma = k.factor * found.sigma[i];
    const bool known = sigma <= k.sigma_max;
    if (k.mounting)
      std::printf("%-14s %10.3f %10.3f %9.3f %10.3f %-6s", k.name, k.factor * believed[i], value, sigma,
                  k.factor * really[i], k.unit);
    else
      std::printf("%-14s %10s %10.3f %9.3f %10s %-6s", k.name, "", value, sigma, "", k.unit);
    if (!known)
      std::printf(" not known well enough (%g): it takes %s", k.sigma_max, k.needs);
    else if (std::fabs(value) < 2 * sigma)
      std::printf(" as before");
    std::printf("\n");
    all_known = all_known && (known || !k.mounting);
  }
  const bool fits = found.explained > 0.5 && found.moved < 0.5;
  if (!fits)
    std::printf("\nnot to be used: %s\n", found.explained > 0.5
                                              ? "the estimate does not converge; check the map's resolution"
                                              : "the edges in the pictures do not fit the map; was the pose lost?");
  else if (all_known)
    std::printf("\ngood. For calibration.yaml, %s:\n", camera.name);
  else
    std::printf("\nusable where it is known. For calibration.yaml, %s:\n", camera.name);
  if (fits)
    std::printf("    mounting: {xyz_m: [%.4f, %.4f, %.4f], rpy_deg: [%.3f, %.3f, %.3f]}\n", is.xyz_m[0], is.xyz_m[1],
                is.xyz_m[2], is.rpy_rad[0] / kDegree, is.rpy_rad[1] / kDegree, is.rpy_rad[2] / kDegree);
  if (fits && std::fabs(found.value[kTimeOffset]) > 2 * found.sigma[kTimeOffset])
    std::printf("its pictures are %.1f ms %s than their stamps\n", 1e3 * std::fabs(found.value[kTimeOffset]),
                found.value[kTimeOffset] > 0 ? "older" : "younger");
  return fits && all_known ? tools::kDone : tools::kFailed;
}

int run(const MountingArguments &a) {
  std::optional<tools::ScratchFolder> replayed;
  if (a.run.empty()) {
    if (a.config.empty()) throw Failure("give --config FILE, or --run FOLDER of a replay", tools::kUsage);
    replay(a, replayed.emplace("waymark-mounting").path());
  }
  const fs::path folder = replayed ? replayed->path() : fs::path(a.run);
  wm_error error{};
  tools::EventLog log(folder);
  const fs::path map_file = a.map.empty() ? fs::path(a.recording) / "map/map.yaml" : fs::path(a.map);
  wm_map *loaded = nullptr;
  if (wm_map_load(map_file.c_str(), nullptr, nullptr, &loaded, &error) != WM_OK)
    throw Failure(error.text, tools::kUsage);
  const std::unique_ptr<wm_map, void (*)(wm_map *)> map(loaded, wm_map_free);
  const wm_rig &rig = log.head().rig;
  const int camera = choose_camera(a, rig);
  const std::vector<MountingScan> scans = scans_of(log, camera, tools::load_trajectory(folder));
  return report(find_mounting(scans, *wm_map_raster(map.get()), rig.cameras[camera]), rig.cameras[camera]);
}

}  // namespace

std::function<int()> mounting_command(wm::cli::App &app) {
  const auto a = std::make_shared<MountingArguments>();
  app.add_option("REC", a->recording, "recording of a drive, with video, motion and a map")->required();
  app.add_option("--config", a->config, "configuration to localize with, such as config/datasets/corridor.yaml");
  app.add_option("--run", a->run, "a replay of it that there is already, instead of --config");
  app.add_option("--camera", a->camera, "which, where there are several");
  app.add_option("--map", a->map, "a map.yaml instead of the recording's");
  app.footer(
      "example: waymark calibrate mounting recordings/drive --config config/datasets/corridor.yaml\n"
      "The drive should have turns, straight ways forwards and back, and edges on both sides. Exit code: 0 good, 1 "
      "not\n"
      "known well enough or failed, 2 usage.");
  return [a] { return run(*a); };
}

}  // namespace wm::calibrate
