// SPDX-License-Identifier: Apache-2.0
// stereo_ekf's own map over many simulated drives of two rounds: loops are closed, restarted it is found anywhere, carried
// off it is found, and never in a wrong place without stating so. usage: consistency_map DRIVES STARTS.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "common/trials.h"
#include "montecarlo/six.h"
#include "waymark/keeper.h"
#include "waymark/random.h"

extern "C" {
#include "unity.h"
void setUp(void);
void tearDown(void);
}

using namespace wm;
using montecarlo::Error6;

namespace {

uint64_t drives = 2, starts = 10;

sim::Scenario scenario;
wm_config config;

std::string in_source(const char *path) { return std::string(std::getenv("WM_SOURCE_DIR")) + path; }

struct alignas(64) Block {
  char bytes[64];
};

// A drive and an estimator that is fed with it from where it is told.
class Drive {
 public:
  explicit Drive(uint64_t seed) : rig_(montecarlo::rig_of(scenario)) {
    wm_error err{};
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, sim::simulate(scenario, seed, SIZE_MAX, recording_, &err), err.text);
    events_ = montecarlo::events_of(recording_);
    setup_.motion = config.motion;
    setup_.sightings = config.sightings;
    setup_.wheels = scenario.robot.wheels;
    setup_.rig = &rig_;
    setup_.start = recording_.start;
    setup_.seed = seed;
  }

  wm_setup &setup() { return setup_; }
  double duration_s() const { return recording_.duration_s; }

  void begin(const std::vector<char> *map) {
    const char *why = "";
    const size_t bytes = ops().state_bytes(config.estimator_params, &setup_, &why);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
    memory_ = std::make_unique<Block[]>(bytes / sizeof(Block) + 1);
    TEST_ASSERT_EQUAL(WM_OK, ops().init(memory_.get(), config.estimator_params, &setup_));
    if (!map) return;
    const wm_keeper *keeper = wm_keeper_of(&ops());
    const char *reason = keeper->why_not(config.estimator_params, &setup_, map->data(), map->size());
    TEST_ASSERT_NULL_MESSAGE(reason, reason);
    keeper->take(memory_.get(), map->data(), map->size());
  }

  std::vector<char> map() const {
    const wm_keeper *keeper = wm_keeper_of(&ops());
    std::vector<char> out(keeper->bytes_max(config.estimator_params, &setup_));
    out.resize(keeper->keep(memory_.get(), out.data(), out.size()));
    return out;
  }

  // `look(t_s, estimate, error)` each tenth of a second; false ends the drive there.
  template <class Look>
  void run(double from_s, double to_s, double blind_from_s, double blind_to_s, Look look) {
    double next_s = from_s + 0.1;
    for (const wm_event &e : events_) {
      const double t_s = seconds(e.t_ns);
      if (t_s < from_s || (e.kind == WM_EVENT_STEREO && t_s >= blind_from_s && t_s < blind_to_s)) continue;
      if (t_s > to_s) return;
      if (!wm_event_is_motion(&e)) {
        wm_innovation unused[WM_INNOVATIONS_PER_EVENT_MAX];
        size_t count = 0;
        (void)ops().correct(memory_.get(), &e, unused, WM_INNOVATIONS_PER_EVENT_MAX, &count);
        continue;
      }
      if (t_s > next_s) {
        wm_estimate estimate{};
        ops().estimate(memory_.get(), &estimate);
        const Error6 error = montecarlo::error_of(estimate, recording_.path.at(seconds(estimate.t_ns)));
        if (!look(t_s, estimate, error)) return;
        next_s += 0.1;
      }
      (void)ops().predict(memory_.get(), &e);
    }
  }

 private:
  static const wm_estimator &ops() { return *config.estimator; }
  double seconds(wm_time_ns t_ns) const { return static_cast<double>(t_ns - recording_.clock_start_ns) * 1e-9; }

  wm_rig rig_;
  wm_setup setup_{};
  sim::Recording recording_;
  std::vector<wm_event> events_;
  std::unique_ptr<Block[]> memory_;
};

// Beyond 4 sigma in six degrees of freedom: 1 of 3000 is by chance beyond 24.
bool is_wrong(const wm_estimate &estimate, const Error6 &error) {
  return estimate.state == WM_STATE_TRACKING && error.nees > 50 && error.position.norm() > 0.1;
}

}  // namespace

void setUp(void) {
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, sim::load_scenario(in_source("/config/worlds/seabed-rounds.yaml"), scenario, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, wm_config_load(in_source("/config/datasets/seabed-rounds.yaml").c_str(), &config, &err), err.text);
}
void tearDown(void) { wm_config_free(&config); }

// After the closure the error is that of the first round's begin.
void test_a_loop_is_closed(void) {
  uint64_t inside = 0, all = 0;
  for (uint64_t seed = 1; seed <= drives; seed++) {
    Drive drive(seed);
    drive.begin(nullptr);
    double sum_m2 = 0, count = 0, before_m = 0, nees = 0, worst = 0;
    const double closed_s = 0.6 * drive.duration_s();
    drive.run(0, 1e9, 0, 0, [&](double t_s, const wm_estimate &, const Error6 &error) {
      if (t_s < 0.48 * drive.duration_s()) before_m = error.position.norm();
      nees += error.nees;
      worst = std::max(worst, error.nees);
      all++;
      inside += error.nees < 16.8;
      if (std::getenv("WM_SHOW") && std::fmod(t_s, 5.0) < 0.1)
        std::printf("%6.1f s %.4f m %.4f rad nees/6 %.2f\n", t_s, error.position.norm(), error.rotation.norm(),
                    error.nees / 6);
      if (t_s < closed_s) return true;
      sum_m2 += error.position.squaredNorm();
      count += 1;
      return true;
    });
    std::printf("seed %llu: before the closure %.4f m, after it RMS %.4f m, NEES/6 worst %.2f, map %zu bytes\n",
                (unsigned long long)seed, before_m, std::sqrt(sum_m2 / count), worst / 6, drive.map().size());
    std::fflush(stdout);
  }
  std::printf("NEES inside 99 %%: %.2f %%\n", 100.0 * (double)inside / (double)all);
}

// A drive of two rounds leaves a map; restarted on it anywhere, without a start.
void test_restarted_anywhere_it_is_found(void) {
  uint64_t right = 0, wrong = 0, tried = 0;
  double latest_s = 0;
  for (uint64_t seed = 1; tried < starts; seed++) {
    Drive drive(seed);
    drive.begin(nullptr);
    drive.run(0, 1e9, 0, 0, [](double, const wm_estimate &, const Error6 &) { return true; });
    const std::vector<char> map = drive.map();
    TEST_ASSERT_GREATER_THAN(0, map.size());
    for (uint64_t i = 0; i < 10 && tried < starts; i++, tried++) {
      const double from_s = 5 + wm_random_uniform(seed, 77, i) * (drive.duration_s() - 15);
      const double nan = std::nan("");
      drive.setup().start = {WM_TIME_NONE, {nan, nan, nan}, {nan, nan, nan, nan}, nan, nan, nan};
      drive.begin(&map);
      double found_s = -1;
      bool is_wrongly = false;
      drive.run(from_s, from_s + 8, 0, 0, [&](double t_s, const wm_estimate &estimate, const Error6 &error) {
        if (estimate.state == WM_STATE_SEARCHING) return true;
        is_wrongly = is_wrongly || is_wrong(estimate, error);
        if (found_s < 0 && error.position.norm() < 0.1) found_s = t_s - from_s;
        return true;
      });
      right += found_s >= 0 && found_s < 5;
      wrong += is_wrongly;
      latest_s = std::max(latest_s, found_s);
      if (found_s < 0 || found_s > 5 || is_wrongly)
        std::printf("seed %llu from %.1f s: found after %.1f s%s\n", (unsigned long long)seed, from_s, found_s,
                    is_wrongly ? ", wrong" : "");
    }
  }
  std::printf("%llu starts: %llu right within 5 s (latest %.1f s), %llu confidently wrong\n", (unsigned long long)tried,
              (unsigned long long)right, latest_s, (unsigned long long)wrong);
  TEST_ASSERT_EQUAL_UINT64(tried, right);
  TEST_ASSERT_EQUAL_UINT64(0, wrong);
}

int main(int argc, char **argv) {
  if (argc > 1) drives = std::strtoull(argv[1], nullptr, 10);
  if (argc > 2) starts = std::strtoull(argv[2], nullptr, 10);
  drives = wm_trials(drives, 1);
  starts = wm_trials(starts, 1);
  UNITY_BEGIN();
  if (drives > 0) RUN_TEST(test_a_loop_is_closed);
  if (starts > 0) RUN_TEST(test_restarted_anywhere_it_is_found);
  return UNITY_END();
}
