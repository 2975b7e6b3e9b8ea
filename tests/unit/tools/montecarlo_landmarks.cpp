// SPDX-License-Identifier: Apache-2.0
// The trials by landmarks, a few drives: each trial changes the drive as its name states, and is judged by it.
#include <set>
#include <string>

#include "common/suite.h"
#include "montecarlo/landmark_trials.h"

using namespace wm::montecarlo;

namespace {

wm::sim::Scenario scenario;
wm_config config;

const LandmarkTrial &trial(const char *name) {
  for (const LandmarkTrial &o : landmark_trials())
    if (std::strcmp(o.name, name) == 0) return o;
  TEST_FAIL_MESSAGE(name);
  return landmark_trials()[0];
}

TEST(test_as_driven_it_is_right_all_the_time) {
  for (uint64_t seed = 1; seed <= 3; seed++) {
    LandmarkWorld world(scenario, seed);
    const LandmarkOutcome o = run_landmark_trial(world, config, trial("as-driven"));
    TEST_ASSERT_EQUAL(seed, o.seed);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.001, o.rms_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.15, o.rms_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(1, o.rms_deg);
    TEST_ASSERT_EQUAL_DOUBLE(0, o.wrong_s);
    TEST_ASSERT_EQUAL(0, o.moved_seen);
    TEST_ASSERT_FALSE(o.detected_after_s.has_value());
    // A look each tenth of a second of a drive of half a minute.
    TEST_ASSERT_GREATER_THAN(250, o.outcome.samples.size());
    TEST_ASSERT_GREATER_THAN_DOUBLE(25, o.outcome.samples.back().t_s);
  }
}

TEST(test_started_anywhere_it_finds_itself) {
  LandmarkWorld world(scenario, 2);
  const LandmarkOutcome o = run_landmark_trial(world, config, trial("start"));
  TEST_ASSERT_FALSE(o.outcome.samples.front().tracking);
  TEST_ASSERT_TRUE(o.right_after_s.has_value());
  TEST_ASSERT_TRUE(o.outcome.samples.back().tracking);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, o.outcome.samples.back().error_m);
}

TEST(test_carried_off_it_is_elsewhere_and_says_so) {
  LandmarkWorld world(scenario, 3);
  double at_s = NAN;
  const wm::sim::Recording carried = world.drive(trial("kidnap"), &at_s);
  const wm::sim::Recording &driven = world.as_driven();
  const auto apart = [&](double t_s) {
    const wm::sim::State a = driven.drive.at(t_s), b = carried.drive.at(t_s);
    return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  };
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, apart(at_s - 0.1));
  TEST_ASSERT_GREATER_THAN_DOUBLE(3, apart(at_s + 0.1));
  TEST_ASSERT_TRUE(run_landmark_trial(world, config, trial("kidnap")).detected_after_s.has_value());
}

TEST(test_only_so_many_landmarks) {
  LandmarkWorld world(scenario, 4);
  double at_s = NAN;
  const wm::sim::Recording two = world.drive(trial("two"), &at_s);
  TEST_ASSERT_EQUAL(2, two.map.size());
  std::set<int32_t> ids;
  for (const wm::sim::Sighting &s : two.sightings) ids.insert(s.id);
  TEST_ASSERT_EQUAL(2, ids.size());
}

TEST(test_what_moved_is_seen) {
  LandmarkWorld world(scenario, 5);
  double at_s = NAN;
  TEST_ASSERT_EQUAL(1, world.drive(trial("moved"), &at_s).moved.size());
  const LandmarkOutcome o = run_landmark_trial(world, config, trial("moved"));
  TEST_ASSERT_TRUE(o.moved_seen > 0);
  // The world is the same one afterwards.
  TEST_ASSERT_EQUAL(0, run_landmark_trial(world, config, trial("as-driven")).moved_seen);
}

}  // namespace

int suite_begin(int, char **) {
  const std::string root = std::getenv("WM_SOURCE_DIR");
  wm_error err{};
  if (wm::sim::load_scenario(root + "/config/worlds/crossing-drawn.yaml", scenario, &err) != WM_OK ||
      wm_config_load((root + "/config/datasets/crossing-cameras.yaml").c_str(), &config, &err) != WM_OK) {
    std::fprintf(stderr, "%s\n", err.text);
    return 1;
  }
  return SUITE_RUNS;
}

void suite_end() { wm_config_free(&config); }
