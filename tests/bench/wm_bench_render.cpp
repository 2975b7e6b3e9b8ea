// SPDX-License-Identifier: Apache-2.0
// How fast the renderer is in a corridor at 1280x720, and what quality costs. wm_bench_render [PNG] also keeps a
// picture.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <vector>

#include "images/video.h"
#include "render/sensor.h"
#include "render_corridor.h"
#include "timing.h"

using namespace wm::images;
using namespace wm::render;

namespace {

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Of all threads: what a shared machine doesn't stretch.
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Shot shot_of(uint64_t frame, int64_t exposure_ns) {
  Shot shot;
  shot.frame = frame;
  shot.t_ns = static_cast<int64_t>(frame) * 100000000;
  shot.exposure_ns = exposure_ns;
  shot.T_map_base = [](double t_ns) { return pose_xyz_rpy({1 + 1.0e-9 * t_ns, 0.1, 0}, 0, 0, 0.2e-9 * t_ns - 0.05); };
  return shot;
}

// Median seconds a frame.
double measure(const char *name, const Scene &scene, const Camera &camera, const Quality &quality, int64_t exposure_ns,
               int frames) {
  std::string error;
  auto renderer = Renderer::make(scene, camera, quality, 1, false, error);
  if (!renderer) return std::fprintf(stderr, "%s\n", error.c_str()), 0;
  Image image;
  std::vector<double> times, cpu;
  renderer->render(shot_of(0, exposure_ns), image);
  if (bench::is_short()) frames = 1;
  for (int i = 1; i <= frames; i++) {
    const double begin = seconds(), cpu_begin = cpu_seconds();
    renderer->render(shot_of(static_cast<uint64_t>(i), exposure_ns), image);
    times.push_back(seconds() - begin), cpu.push_back(cpu_seconds() - cpu_begin);
  }
  const double t = bench::median(times);
  std::printf("%-44s %7.1f ms  %6.1f frames/s  %7.1f ms of processor\n", name, 1e3 * t, 1 / t,
              1e3 * bench::median(cpu));
  std::fflush(stdout);
  return t;
}

}  // namespace

int main(int argc, char **argv) {
  std::string error;
  Scene glossy, matt, peopled;
  const double begin = seconds();
  if (!build_corridor(glossy, 0.04, false, error)) return std::fprintf(stderr, "%s\n", error.c_str()), 1;
  std::printf("%-44s %7.1f ms  (%zu triangles)\n", "corridor: textures, split, light, tree", 1e3 * (seconds() - begin),
              glossy.triangle_count());
  if (!build_corridor(matt, 0, false, error) || !build_corridor(peopled, 0.04, true, error)) return 1;

  Camera camera = corridor_camera();
  Quality one{.samples = 1}, four{.samples = 4};
  measure("1 sample, glossy floor", glossy, camera, one, 5000000, 9);
  measure("4 samples, blur, glossy floor", glossy, camera, four, 5000000, 5);
  measure("1 sample, matt floor", matt, camera, one, 5000000, 9);
  Quality sharp = one;
  sharp.psf_sigma_px = 0;
  measure("1 sample, glossy, no point spread", glossy, camera, sharp, 5000000, 9);
  Quality alone = one;
  alone.threads = 1;
  measure("1 sample, glossy, one thread", glossy, camera, alone, 5000000, 5);
  measure("1 sample, glossy, a person", peopled, camera, one, 5000000, 9);
  camera.readout_ns = 20000000;
  measure("1 sample, glossy, rolling shutter", glossy, camera, one, 5000000, 9);
  camera.readout_ns = 0;

  auto renderer = Renderer::make(peopled, camera, four, 1, false, error);
  Image image;
  renderer->render(shot_of(20, 5000000), image);
  Sensor sensor(SensorModel{}, 1, camera.width, camera.height, {639.5, 359.5});
  Picture8 picture;
  std::vector<double> develop, compress;
  AutoExposure gain(0.18, 0.3, 0.01, 1);
  Jpeg jpeg;
  for (int i = 0; i < bench::rounds(9); i++) {
    const double start = seconds();
    const Exposure exposure{.gain = gain.next(image, static_cast<uint64_t>(i))};
    sensor.develop(image, exposure, static_cast<uint64_t>(i), picture);
    const double middle = seconds();
    jpeg.compress(picture, 75, error);
    develop.push_back(middle - start), compress.push_back(seconds() - middle);
  }
  std::printf("%-44s %7.1f ms\n", "sensor: exposure, noise, curve", 1e3 * bench::median(develop));
  std::printf("%-44s %7.1f ms  (%zu kB)\n", "JPEG of quality 75", 1e3 * bench::median(compress), jpeg.size() / 1000);
  if (argc > 1) {
    auto coloured = Renderer::make(peopled, camera, four, 1, true, error);
    coloured->render(shot_of(20, 5000000), image);
    sensor.develop(image, {.gain = gain.next(image, 9)}, 0, picture);
    if (!write_png(argv[1], picture, error)) return std::fprintf(stderr, "%s\n", error.c_str()), 1;
  }
  return 0;
}
