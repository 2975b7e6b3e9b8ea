// SPDX-License-Identifier: Apache-2.0
// The pictures of a drive: what a scenario's cameras see of its world, as videos with stamps, and the labels that
// detectors are judged by.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "images/pictures.h"
#include "render/render.h"
#include "simulate/random.h"
#include "simulate/simulate.h"
#include "worlds/world.h"

namespace wm::sim {

struct FilmCamera {
  std::string name;
  images::Camera believed;  // as in calibration.yaml
  images::Camera truth;     // as it is: mounting and intrinsics off by what the seed drew
  double rate_hz = 10, exposure_s = 0.008;
  bool colour = false;
};

// A scenario with a world that has a kind, made ready: world drawn, cameras set up, sensors' data simulated.
struct Film {
  Scenario scenario;
  std::unique_ptr<World> world;
  Recording recording;
  std::vector<FilmCamera> cameras;
};

// Draws the world by `seed` (takes 1 to 5 s), sets up the cameras and simulates all but the pictures. WM_BAD_CONFIG
// when the scenario doesn't fit the world: an unknown camera, a route that can't be driven.
wm_status prepare(const Scenario &scenario, uint64_t seed, Film &out, wm_error *err);

// Simulates all but the pictures once more, with `film.scenario` as it is now, in the same world with the same cameras:
// for another seed's errors, or other faults.
wm_status record(uint64_t seed, Film &film, wm_error *err);

// What the scenario's `sensors` say, with what those that look at pictures would find in them: what the labels show, by
// the believed calibration, with noise, outliers and misses. Without pictures all of them; beside pictures only those
// that say so. Some ms a picture. WM_BAD_CONFIG where a sensor doesn't fit the world.
wm_status observe_pictures(Film &film, wm_error *err);

// One picture's times: when it is taken, what its stamp says, when it arrives.
struct FrameTime {
  uint64_t number;  // of the trigger; lost ones count
  double t_s;       // middle of the exposure, from the start
  wm_time_ns stamp_ns, arrival_ns;
  bool again;  // the picture before, once more
};
// The pictures of a camera that arrive, in the order of the video.
std::vector<FrameTime> frame_times(const Film &film, size_t camera);

// Where base_link is; t_ns from the start of the recording.
std::function<images::Pose(double t_ns)> motion_of(const Recording &recording);

// The picture that the camera takes at t_s; its exposure fits the light.
wm_status take_picture(const Film &film, size_t camera, double t_s, images::Picture8 &out, wm_error *err);
// `count` small pictures, spread over the drive and the cameras, in columns of `columns`.
wm_status contact_sheet(const Film &film, int count, int columns, int cell_width, images::Picture8 &out, wm_error *err);

// Told after each picture; for people who wait.
using Progress = std::function<void(size_t done, size_t total)>;
// Writes video/, labels/, map/ and landmarks/ into the recording's folder, which is there.
wm_status write_pictures(const Film &film, const std::string &dir, const Progress &progress, wm_error *err);
// landmarks/ alone, in worlds whose landmarks are signs and the like: appearance.csv, and a picture of each as somebody
// would take it who stands before it.
wm_status write_appearances(const Film &film, const std::string &dir, wm_error *err);
// map/ alone, where the world has one.
wm_status write_map(const Film &film, const std::string &dir, wm_error *err);

}  // namespace wm::sim
