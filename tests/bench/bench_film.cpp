// SPDX-License-Identifier: Apache-2.0
// How fast a recording's pictures are made, whole: `waymark simulate config/worlds/corridor-easy.yaml` at 1280x720 with
// one sample a pixel: rendered, developed, labelled, pressed as JPEG and written. wm_bench_film [SCENARIO]. Exits with
// 1 where this machine could not make 10 pictures a second if it had nothing else to do.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <thread>

#include "simulate/film.h"

using namespace wm;

namespace {

const bool is_short = std::getenv("WM_BENCH_SHORT") != nullptr;  // does it work at all?
constexpr double kLimitHz = 10;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
// Of all threads: what a shared machine doesn't stretch.
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

int main(int argc, char **argv) {
  sim::Scenario scenario;
  sim::Film film;
  wm_error err{};
  if (sim::load_scenario(argc > 1 ? argv[1] : "config/worlds/corridor-easy.yaml", scenario, &err) != WM_OK)
    return std::fprintf(stderr, "%s\n", err.text), 1;
  scenario.duration_s = is_short ? 0.6 : 4;
  scenario.pictures.samples = 1;
  if (sim::prepare(scenario, scenario.seed, film, &err) != WM_OK) return std::fprintf(stderr, "%s\n", err.text), 1;

  const std::filesystem::path dir =
      std::filesystem::temp_directory_path() / ("wm_bench_film." + std::to_string(getpid()));
  // The first pictures make the camera's tables and warm the caches.
  size_t pictures = 0;
  double begin_s = 0, cpu_begin_s = 0;
  const auto progress = [&](size_t done, size_t total) {
    if (done == 4) begin_s = seconds(), cpu_begin_s = cpu_seconds();
    pictures = total - 4;
  };
  const wm_status written = sim::write_pictures(film, dir.string(), progress, &err);
  const double took_s = (seconds() - begin_s) / static_cast<double>(pictures),
               cpu_s = (cpu_seconds() - cpu_begin_s) / static_cast<double>(pictures);
  std::error_code problem;
  std::filesystem::remove_all(dir, problem);
  if (written != WM_OK) return std::fprintf(stderr, "%s\n", err.text), 1;

  const double cores = std::max(1u, std::thread::hardware_concurrency()), idle_hz = cores / cpu_s;
  std::printf("corridor-easy, 1 sample, whole: %d x %d, %zu pictures\n", film.cameras[0].truth.width,
              film.cameras[0].truth.height, pictures);
  std::printf("%-44s %7.1f ms  %6.1f frames/s  %7.1f ms of processor\n", "render, sensor, labels, JPEG, file",
              1e3 * took_s, 1 / took_s, 1e3 * cpu_s);
  std::printf("%-44s %16.1f frames/s  limit %.0f: %s\n", "with all of this machine's cores at most", idle_hz, kLimitHz,
              idle_hz >= kLimitHz ? "met" : "missed");
  return idle_hz >= kLimitHz || is_short ? 0 : 1;
}
