// SPDX-License-Identifier: Apache-2.0
// stereo_ekf's own map over many simulated drives of two rounds: loops are closed, restarted it is found anywhere,
// carried off it is found, and never in a wrong place without stating so. usage: consistency_map DRIVES STARTS.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "common/suite.h"
#include "common/trials.h"
#include "montecarlo/six.h"
#include "waymark/keeper.h"
#include "waymark/random.h"

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

// A drive, and an estimator that takes its events from a given time on.
class Drive {
 public:
  // Way, noise and errors are the seed's, the points and what they look like another one's where that is given.
  explicit Drive(uint64_t seed, uint64_t points_seed = 0) : rig_(montecarlo::rig_of(scenario)) {
    wm_error err{};
    sim::Scenario past = scenario;
    past.scatter.seed = points_seed;
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, sim::simulate(past, seed, SIZE_MAX, recording_, &err), err.text);
    events_ = montecarlo::events_of(recording_);
    setup_ = montecarlo::setup_of(scenario, config, recording_, &rig_);
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

  // Points in the first picture from a time on.
  size_t points_at(double t_s) const {
    size_t count = 0;
    for (const wm_event &e : events_)
      count += e.kind == WM_EVENT_STEREO && seconds(e.t_ns) >= t_s && seconds(e.t_ns) < t_s + 0.0999;
    return count;
  }

  // From and to these times of the drive, with stamps that are later by `later_s`; meanwhile no picture shows anything.
  struct Part {
    double from_s = 0, to_s = 1e9, blind_from_s = 0, blind_to_s = 0, later_s = 0;
  };
  // `look(t_s, estimate, error)` each tenth of a second; false ends the drive there.
  template <class Look>
  void run(const Part &part, Look look) {
    double next_s = part.from_s + 0.1;
    const auto later_ns = static_cast<wm_time_ns>(1e9 * part.later_s);
    for (wm_event e : events_) {
      const double t_s = seconds(e.t_ns);
      if (t_s < part.from_s || (e.kind == WM_EVENT_STEREO && t_s >= part.blind_from_s && t_s < part.blind_to_s))
        continue;
      if (t_s > part.to_s) return;
      e.t_ns += later_ns;
      if (!wm_event_is_motion(&e)) {
        wm_innovation unused[WM_INNOVATIONS_PER_EVENT_MAX];
        size_t count = 0;
        (void)ops().correct(memory_.get(), &e, unused, WM_INNOVATIONS_PER_EVENT_MAX, &count);
        continue;
      }
      if (t_s > next_s) {
        wm_estimate estimate{};
        ops().estimate(memory_.get(), &estimate);
        const Error6 error = montecarlo::error_of(estimate, recording_.path.at(seconds(estimate.t_ns - later_ns)));
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

const double kAbsent = std::nan("");
const wm_start kUnknown = {
    WM_TIME_NONE, {kAbsent, kAbsent, kAbsent}, {kAbsent, kAbsent, kAbsent, kAbsent}, kAbsent, kAbsent, kAbsent};

std::vector<char> map_after(Drive &drive) {
  drive.begin(nullptr);
  drive.run({}, [](double, const wm_estimate &, const Error6 &) { return true; });
  return drive.map();
}

}  // namespace

void setUp(void) {
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, sim::load_scenario(in_source("/config/worlds/seabed-rounds.yaml"), scenario, &err),
                            err.text);
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, wm_config_load(in_source("/config/datasets/seabed-rounds.yaml").c_str(), &config, &err), err.text);
}
void tearDown(void) { wm_config_free(&config); }

// GIVEN two rounds WHEN the second one comes to points of the first THEN the error is that of the first round, and the
// covariance states it.
TEST(test_a_loop_is_closed) {
  if (drives == 0) TEST_IGNORE();
  uint64_t inside = 0, all = 0;
  double nees = 0;
  for (uint64_t seed = 1; seed <= drives; seed++) {
    Drive drive(seed);
    drive.begin(nullptr);
    double sum_m2 = 0, count = 0, before_m = 0, worst = 0;
    const double closed_s = 0.6 * drive.duration_s();
    drive.run({}, [&](double t_s, const wm_estimate &, const Error6 &error) {
      if (t_s < 0.48 * drive.duration_s()) before_m = error.position.norm();
      worst = std::max(worst, error.nees);
      all++;
      nees += error.nees;
      inside += error.nees < 16.8;
      if (t_s < closed_s) return true;
      sum_m2 += error.position.squaredNorm();
      count += 1;
      return true;
    });
    std::printf("seed %llu: before the closure %.4f m, after it RMS %.4f m, NEES/6 worst %.2f, map %zu bytes\n",
                (unsigned long long)seed, before_m, std::sqrt(sum_m2 / count), worst / 6, drive.map().size());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.015, std::sqrt(sum_m2 / count));
  }
  const double share = static_cast<double>(inside) / static_cast<double>(all);
  nees /= 6 * static_cast<double>(all);
  std::printf("NEES/6 mean %.3f, NEES below its 99 %% quantile in %.2f %% of the steps\n", nees, 100 * share);
  TEST_ASSERT_LESS_THAN_DOUBLE(drives < 5 ? 2 : 1.25, nees);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.95, share);
}

// GIVEN 20 s without pictures, in the first round or in the second THEN the way's end is known to 0.10 m.
TEST(test_20_s_without_pictures) {
  for (uint64_t seed = 1; seed <= drives; seed++)
    for (const double from_s : {40.0, 110.0}) {
      Drive drive(seed);
      drive.begin(nullptr);
      double worst_m = 0, end_m = 0, nees = 0;
      drive.run({0, 1e9, from_s, from_s + 20}, [&](double, const wm_estimate &, const Error6 &error) {
        worst_m = std::max(worst_m, end_m = error.position.norm());
        nees = std::max(nees, error.nees);
        return true;
      });
      std::printf("seed %llu, blind from %.0f s: at most %.4f m, at the end %.4f m, NEES/6 at most %.2f\n",
                  (unsigned long long)seed, from_s, worst_m, end_m, nees / 6);
      TEST_ASSERT_LESS_THAN_DOUBLE(0.10, worst_m);
      TEST_ASSERT_LESS_THAN_DOUBLE(50, nees);
    }
}

// A drive of two rounds leaves a map. Another drive past the same points, with a way, noise and errors of its own,
// begins anywhere on it without a start: anywhere that a picture shows some of the points, since the way may leave
// them.
TEST(test_restarted_anywhere_it_is_found) {
  uint64_t right = 0, wrong = 0, tried = 0;
  constexpr size_t kOnTheMap = 12;
  double latest_s = 0, worst_m = 0, worst_deg = 0;
  for (uint64_t seed = 1; tried < starts; seed++) {
    Drive before(seed), drive(5000 + seed, seed);
    const std::vector<char> map = map_after(before);
    TEST_ASSERT_GREATER_THAN(0, map.size());
    for (uint64_t i = 0, draw = 0; i < 10 && tried < starts; i++, tried++) {
      double from_s = 0;
      do {
        TEST_ASSERT_LESS_THAN_UINT64(1000, draw);
        from_s = 5 + wm_random_uniform(seed, 77, draw++) * (drive.duration_s() - 15);
      } while (drive.points_at(from_s) < kOnTheMap);
      drive.setup().start = kUnknown;
      drive.begin(&map);
      double found_s = -1;
      bool is_wrongly = false;
      drive.run({from_s, from_s + 8}, [&](double t_s, const wm_estimate &estimate, const Error6 &error) {
        if (estimate.state == WM_STATE_SEARCHING) return true;
        is_wrongly = is_wrongly || is_wrong(estimate, error);
        const double off_m = error.position.norm(), off_deg = error.rotation.norm() * 180 / M_PI;
        if (found_s < 0 && off_m < 0.1 && off_deg < 2) found_s = t_s - from_s;
        if (found_s >= 0) worst_m = std::max(worst_m, off_m), worst_deg = std::max(worst_deg, off_deg);
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
  std::printf(
      "%llu starts: %llu right within 5 s (latest %.1f s), then at most %.4f m and %.3f deg off, "
      "%llu confidently wrong\n",
      (unsigned long long)tried, (unsigned long long)right, latest_s, worst_m, worst_deg, (unsigned long long)wrong);
  TEST_ASSERT_EQUAL_UINT64(tried, right);
  TEST_ASSERT_EQUAL_UINT64(0, wrong);
}

// GIVEN a vehicle that was carried to another place of its map while it stood THEN it is found there; until then
// nothing shows it that its pose is wrong.
TEST(test_carried_off_it_is_found) {
  for (uint64_t seed = 1; seed <= drives; seed++) {
    Drive drive(seed);
    drive.begin(nullptr);
    drive.run({0, 110}, [](double, const wm_estimate &, const Error6 &) { return true; });
    double found_s = -1, worst_after_m = 0, nees = 0;
    drive.run({40, 60, 0, 0, 75}, [&](double t_s, const wm_estimate &, const Error6 &error) {
      if (found_s < 0 && error.position.norm() < 0.1) found_s = t_s - 40;
      if (found_s < 0) return true;
      worst_after_m = std::max(worst_after_m, error.position.norm());
      nees = std::max(nees, error.nees);
      return true;
    });
    std::printf("seed %llu: carried off, found after %.1f s, then at most %.4f m, NEES/6 %.2f\n",
                (unsigned long long)seed, found_s, worst_after_m, nees / 6);
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0, found_s);
    TEST_ASSERT_LESS_THAN_DOUBLE(5, found_s);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_after_m);  // 3 sigma of a pose by the points of one picture
    TEST_ASSERT_LESS_THAN_DOUBLE(36, nees);             // 1 of 500 000 is beyond
  }
}

// GIVEN the map of another place, whose points look like sixteen sorts as this one's do THEN no pose is found in it.
TEST(test_on_the_map_of_another_place_nothing_is_found) {
  for (const double alike : {0.1, 1.0}) {
    for (sim::Sensor &sensor : scenario.sensors) sensor.alike_fraction = alike;
    Drive there(1000);
    const std::vector<char> map = map_after(there);
    for (uint64_t seed = 1; seed <= drives; seed++) {
      Drive drive(seed);
      drive.setup().start = kUnknown;
      drive.begin(&map);
      drive.run({10, 40}, [&](double, const wm_estimate &estimate, const Error6 &) {
        TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, estimate.state);
        return true;
      });
    }
  }
}

// GIVEN an image that was cut, or whose bytes were changed WHEN it is checked THEN it is refused with a reason, or the
// drive that continues on it has finite numbers.
TEST(test_a_damaged_map_is_refused_or_harmless) {
  Drive drive(1);
  drive.begin(nullptr);
  drive.run({0, 30}, [](double, const wm_estimate &, const Error6 &) { return true; });
  const std::vector<char> good = drive.map();
  const wm_keeper *keeper = wm_keeper_of(config.estimator);
  const auto why_not = [&](const std::vector<char> &image) {
    return keeper->why_not(config.estimator_params, &drive.setup(), image.data(), image.size());
  };
  TEST_ASSERT_NULL(why_not(good));
  for (size_t bytes = 0; bytes < good.size(); bytes += 101)
    TEST_ASSERT_NOT_NULL(why_not({good.begin(), good.begin() + static_cast<long>(bytes)}));
  std::vector<char> longer = good;
  longer.push_back(0);
  TEST_ASSERT_EQUAL_STRING("it is truncated", why_not(longer));
  uint64_t refused = 0;
  const uint64_t mutants = wm_trials(200, 50);
  for (uint64_t k = 0; k < mutants; k++) {
    std::vector<char> image = good;
    const double where = wm_random_uniform(3, 1, k), what = wm_random_uniform(3, 2, k);
    const auto at = static_cast<size_t>(where * static_cast<double>(k % 4 == 0 ? 200 : image.size() - 8));
    const double values[] = {std::nan(""), HUGE_VAL, -1e300, 1e300, 0.0, -1.0};
    std::memcpy(&image[at / 8 * 8], &values[static_cast<size_t>(what * 6)], sizeof values[0]);
    if (why_not(image)) {
      refused++;
      continue;
    }
    drive.setup().start = kUnknown;
    drive.begin(&image);
    drive.run({10, 12}, [](double, const wm_estimate &estimate, const Error6 &) {
      TEST_ASSERT_DOUBLE_IS_DETERMINATE(estimate.pose_map_base.p_m[0]);
      return true;
    });
  }
  std::printf("%llu of %llu mutants refused\n", (unsigned long long)refused, (unsigned long long)mutants);
  TEST_ASSERT_GREATER_THAN_UINT64(mutants / 3, refused);
}

int suite_begin(int argc, char **argv) {
  if (argc > 1) drives = std::strtoull(argv[1], nullptr, 10);
  if (argc > 2) starts = std::strtoull(argv[2], nullptr, 10);
  drives = wm_trials(drives, 1);
  starts = wm_trials(starts, 1);
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // each drive as it ends
  return SUITE_RUNS;
}
