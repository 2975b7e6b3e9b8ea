// SPDX-License-Identifier: Apache-2.0
// What stereo_ekf's own map costs on the estimator's thread: the simulated drive of two rounds, each call timed on this
// thread's own clock, with the map and without, and begun on the finished map without a start.
// usage: wm_bench_own_map [WORLDS CONFIG]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "montecarlo/six.h"
#include "timing.h"
#include "waymark/keeper.h"

namespace {

using namespace wm;

struct alignas(64) Block {
  char bytes[64];
};

struct Bench {
  sim::Scenario scenario;
  wm_config config{};
  sim::Recording recording;
  std::vector<wm_event> events;
  wm_rig rig{};
  wm_setup setup{};
  std::unique_ptr<Block[]> memory;
  size_t bytes = 0;

  bool load(const char *world, const char *file) {
    wm_error err{};
    if (sim::load_scenario(world, scenario, &err) != WM_OK || wm_config_load(file, &config, &err) != WM_OK ||
        sim::simulate(scenario, 1, SIZE_MAX, recording, &err) != WM_OK) {
      std::fprintf(stderr, "%s\n", err.text);
      return false;
    }
    rig = montecarlo::rig_of(scenario);
    events = montecarlo::events_of(recording);
    setup = montecarlo::setup_of(scenario, config, recording, &rig);
    return true;
  }

  void set_frames(int32_t frames) {
    const wm_param_table &table = config.estimator->params;
    for (size_t i = 0; i < table.count; i++)
      if (std::string("slam.key_frames") == table.params[i].key)
        *reinterpret_cast<int32_t *>(static_cast<char *>(config.estimator_params) + table.params[i].offset) = frames;
  }

  void begin() {
    const char *why = "";
    bytes = config.estimator->state_bytes(config.estimator_params, &setup, &why);
    memory = std::make_unique<Block[]>(bytes / sizeof(Block) + 1);
    (void)config.estimator->init(memory.get(), config.estimator_params, &setup);
  }

  // Microseconds of each cycle (all events of one stamp) of a part of the drive.
  std::vector<double> run(double from_s, double to_s) {
    std::vector<double> cycles;
    wm_time_ns at_ns = WM_TIME_NONE;
    for (const wm_event &e : events) {
      const double t_s = static_cast<double>(e.t_ns - recording.clock_start_ns) * 1e-9;
      if (t_s < from_s || t_s > to_s) continue;
      wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      if (e.t_ns != at_ns) cycles.push_back(0.0);
      at_ns = e.t_ns;
      const double begin = bench::thread_us();
      if (wm_event_is_motion(&e))
        (void)config.estimator->predict(memory.get(), &e);
      else
        (void)config.estimator->correct(memory.get(), &e, records, WM_INNOVATIONS_PER_EVENT_MAX, &count);
      cycles.back() += bench::thread_us() - begin;
    }
    return cycles;
  }
};

void print(const char *title, size_t bytes, std::vector<double> cycles) {
  std::sort(cycles.begin(), cycles.end());
  const size_t n = cycles.size();
  std::printf(
      "%-44s %5.2f MB, cycles of a stamp: median %6.0f us, 99 %% %6.0f us, 99.9 %% %6.0f us, longest %6.0f us\n", title,
      static_cast<double>(bytes) * 1e-6, cycles[n / 2], cycles[n * 99 / 100], cycles[n * 999 / 1000], cycles.back());
}

}  // namespace

int main(int argc, char **argv) {
  Bench bench;
  if (!bench.load(argc > 2 ? argv[1] : "config/worlds/seabed-rounds.yaml",
                  argc > 2 ? argv[2] : "config/datasets/seabed-rounds.yaml"))
    return 1;
  const double again_s = bench::is_short() ? 3 : 40, to_s = bench::is_short() ? 6 : INFINITY;
  for (const int32_t frames : {0, 40, 200}) {
    if (bench::is_short() && frames == 200) continue;
    bench.set_frames(frames);
    bench.begin();
    const std::vector<double> cycles = bench.run(0, to_s);
    print((std::to_string(frames) + " key frames, two rounds").c_str(), bench.bytes, cycles);
    if (frames == 0) continue;
    const wm_keeper *keeper = wm_keeper_of(bench.config.estimator);
    std::vector<char> map(keeper->bytes_max(bench.config.estimator_params, &bench.setup));
    map.resize(keeper->keep(bench.memory.get(), map.data(), map.size()));
    if (map.empty()) return std::fprintf(stderr, "no map was kept: not what was meant to be measured\n"), 1;
    const wm_start start = bench.setup.start;
    const double none = std::nan("");
    bench.setup.start = {WM_TIME_NONE, {none, none, none}, {none, none, none, none}, none, none, none};
    bench.begin();
    keeper->take(bench.memory.get(), map.data(), map.size());
    print((std::to_string(frames) + " key frames, begun without a start").c_str(), bench.bytes,
          bench.run(again_s, to_s));
    bench.setup.start = start;
  }
  wm_config_free(&bench.config);
  return 0;
}
