// SPDX-License-Identifier: Apache-2.0
// `waymark detect`: what the detector of edges sees in a recording's pictures, for `waymark eval --detector edges`.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "common/failure.h"
#include "config/config.h"
#include "detect/polylines.h"
#include "waymark/recording.h"
#include "waymark/video.h"

namespace {

namespace fs = std::filesystem;
using wm::tools::Failure;

struct Arguments {
  std::string recording, config, out;
  int every = 1;
};

struct Freer {
  void operator()(void *p) const { std::free(p); }
};

void detect_camera(const Arguments &a, const wm_vision_config &vision, const wm_rig &rig, int32_t index) {
  const wm_camera &camera = rig.cameras[index];
  const wm_view view = {&rig, &index, nullptr, 0, nullptr, 0, nullptr, 0};
  wm_error err;
  const char *why = nullptr;
  wm::mounted_camera mounted;
  const size_t bytes = vision.detector->state_bytes(vision.params, &view, &why);
  if (bytes == 0 || wm::mounted_camera_init(&mounted, camera))
    throw Failure(std::string(camera.name) + ": " + (why ? why : "this camera can't be used"));
  const std::unique_ptr<void, Freer> state(std::aligned_alloc(64, (bytes + 63) / 64 * 64));
  if (!state || vision.detector->init(state.get(), vision.params, &view) != WM_OK)
    throw Failure(std::string(camera.name) + ": the detector can't start");
  wm_video *opened = nullptr;
  if (wm_video_open(a.recording.c_str(), &camera, index, nullptr, nullptr, &opened, &err) != WM_OK)
    throw Failure(err.text);
  const std::unique_ptr<wm_video, decltype(&wm_video_close)> video(opened, wm_video_close);
  const fs::path file = fs::path(a.out) / "detections" / (std::string(camera.name) + "-edges.csv");
  fs::create_directories(file.parent_path());
  std::ofstream csv(file);
  csv << "frame,polyline,u_px,v_px\n" << std::fixed;
  csv.precision(3);
  const auto events = std::make_unique<wm_event[]>(2);
  wm_frame frame;
  size_t frames = 0;
  while (wm_video_peek(video.get(), &frame, &err) == WM_OK) {
    if (frame.number % static_cast<uint64_t>(a.every) != 0) {
      if (wm_video_skip(video.get(), &err) != WM_OK) break;
      continue;
    }
    if (wm_video_next(video.get(), &frame, &err) != WM_OK) break;
    size_t count = 0, line = 0;
    if (vision.detector->detect(state.get(), &frame, nullptr, events.get(), 2, &count) != WM_OK) continue;
    frames++;
    if (count > 0)
      for (const auto &points : wm::tools::join_points(events[0].as.points, mounted)) {
        for (const wm::pixel &p : points) csv << frame.number << ',' << line << ',' << p.u << ',' << p.v << '\n';
        line++;
      }
    if (line == 0) csv << frame.number << ",,,\n";
  }
  if (!csv.flush()) throw Failure(file.string() + ": can't be written");
  std::cout << file.string() << ": " << frames << " pictures\n";
}

void detect(const Arguments &a) {
  wm_error err;
  wm_config config;
  if (wm_config_load(a.config.c_str(), &config, &err) != WM_OK) throw Failure(err.text);
  std::fputs(config.warnings, stderr);
  const std::unique_ptr<wm_config, decltype(&wm_config_free)> config_closer(&config, wm_config_free);
  wm_recording *opened = nullptr;
  if (wm_recording_open(a.recording.c_str(), &config.overrides, nullptr, nullptr, &opened, &err) != WM_OK)
    throw Failure(err.text);
  const std::unique_ptr<wm_recording, decltype(&wm_recording_close)> recording(opened, wm_recording_close);
  const wm_rig &rig = *wm_site_rig(wm_recording_site(recording.get()));
  size_t done = 0;
  for (size_t i = 0; i < config.vision_count; i++) {
    if (!(config.vision[i].detector->gives & WM_EVENT_BIT(WM_EVENT_POINTS))) continue;
    for (uint32_t c = 0; c < rig.camera_count; c++) {
      if (!wm_video_there(a.recording.c_str(), rig.cameras[c].name)) continue;
      detect_camera(a, config.vision[i], rig, static_cast<int32_t>(c));
      done++;
    }
  }
  if (done == 0)
    throw Failure(a.config + ": vision: no detector of edges, or no pictures in " + a.recording +
                  "; `vision: {edges: {}}` names one");
}

}  // namespace

int main(int argc, char **argv) {
  CLI::App app("Writes what the detector of edges sees in a recording's pictures, for `waymark eval --detector edges`.",
               "waymark detect");
  Arguments a;
  app.add_option("recording", a.recording, "folder of the recording")->required();
  app.add_option("--config", a.config, "configuration with `vision: {edges: ...}`")->required();
  app.add_option("--out", a.out, "folder: detections/CAMERA-edges.csv is written there")->required();
  app.add_option("--every", a.every, "only each N-th picture")->check(CLI::Range(1, 1000000));
  app.footer(
      "example: waymark detect REC --config config/corridor.yaml --out out/detected --every 10\n"
      "Exit code: 0 done, 1 the work failed, 2 usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError &e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    detect(a);
  } catch (const std::exception &e) {
    std::cerr << "waymark: " << e.what() << '\n';
    return 1;
  }
  return 0;
}
