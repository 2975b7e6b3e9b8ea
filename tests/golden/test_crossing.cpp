// SPDX-License-Identifier: Apache-2.0
// The simulated crossing through files, replay and the shipped configurations: perfect sensors lead to the truth, the
// numbers of one drive are pinned, lateness changes nothing, faults do no lasting harm.
#include <unistd.h>
#include <string>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "common/suite.h"
#include "simulate/angle.h"
#include "simulate/simulate.h"
#include "simulate/write.h"

extern "C" {
#include "replay/replay.h"
}

using namespace wm::sim;

namespace {

std::string folder;
Scenario scenario;
Recording made;
wm_run_report report;

constexpr double kGoldenX = 29.100622783, kGoldenY = 31.081818031, kGoldenHeading = 1.571750744;
constexpr uint64_t kGoldenLeft = 590, kGoldenRight = 332;

std::string root() { return std::getenv("WM_SOURCE_DIR"); }
std::string shipped() { return root() + "/config/datasets/crossing-points.yaml"; }

// Simulates seed 1 of the scenario as it is now with three landmarks, writes it, replays it into folder/OUT.
void drive(const std::string &config_path, const char *out) {
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, simulate(scenario, 1, 3, made, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_recording(scenario, made, folder + "/recording", &err), err.text);
  wm_recording *recording = nullptr;
  wm_config config{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_load(config_path.c_str(), &config, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, wm_recording_open((folder + "/recording").c_str(), nullptr, nullptr, nullptr, &recording, &err), err.text);
  const std::string out_dir = folder + "/" + out;
  wm_replay_options options = {};
  options.out_dir = out_dir.c_str();
  options.seed = 1;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_replay_recording(&config, recording, &options, &report, &err), err.text);
  wm_recording_close(recording);
  wm_config_free(&config);
}

struct Row {
  wm_time_ns t_ns;
  double x_m, y_m, heading_rad;
};

// Calls `look` for each row of a run's trajectory with the truth at its time; returns the last row.
Row for_each_pose(const char *out, const std::function<void(const Row &, const State &)> &look) {
  std::ifstream file(folder + "/" + out + "/trajectory.csv");
  std::string line;
  std::getline(file, line);
  Row row{};
  while (std::getline(file, line)) {
    long long t_ns = 0;
    double z = 0, q[4] = {};
    TEST_ASSERT_EQUAL(8, std::sscanf(line.c_str(), "%lld,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &t_ns, &row.x_m, &row.y_m, &z,
                                     &q[0], &q[1], &q[2], &q[3]));
    row.t_ns = t_ns;
    row.heading_rad = 2 * std::atan2(q[2], q[3]);
    look(row, made.drive.at(static_cast<double>(t_ns - made.clock_start_ns) * 1e-9));
  }
  return row;
}

double largest_error_m(const char *out, double from_s = 0) {
  double largest = 0;
  for_each_pose(out, [&](const Row &row, const State &truth) {
    if (static_cast<double>(row.t_ns - made.clock_start_ns) * 1e-9 < from_s) return;
    largest = std::fmax(largest, std::sqrt(std::pow(row.x_m - truth.x_m, 2) + std::pow(row.y_m - truth.y_m, 2)));
  });
  return largest;
}

const wm_source_health &source(const char *name) {
  for (uint32_t i = 0; i < report.health.source_count; i++)
    if (std::strcmp(report.health.sources[i].name, name) == 0) return report.health.sources[i];
  TEST_FAIL_MESSAGE(name);
  return report.health.sources[0];
}

void is_below(double limit, double value, const char *what) {
  char text[160];
  std::snprintf(text, sizeof text, "%s: %g is not below %g", what, value, limit);
  TEST_ASSERT_TRUE_MESSAGE(value < limit, text);
}

// Frames, signs and units from one end to the other: nothing but rounding is left. Dead reckoning that takes its
// sensors for perfect, as they are here.
TEST(test_perfect_sensors_lead_to_the_truth_by_odometry) {
  make_perfect(scenario);
  std::filesystem::create_directories(folder);
  const std::string config = folder + "/trusting.yaml";
  std::ofstream(config) << "format: waymark-config/1\nestimator: odometry\nmotion: {model: speed_yaw_rate, states: "
                           "{wheel_difference_sigma: 0, yaw_rate_bias_sigma_radps: 0}}\n";
  drive(config, "run");
  is_below(0.003, largest_error_m("run"), "odometry with perfect sensors");
  const Row last = for_each_pose("run", [](const Row &row, const State &truth) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0, wrap(row.heading_rad - truth.heading_rad));
  });
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, kPi / 2, last.heading_rad);
}

TEST(test_perfect_sensors_lead_to_the_truth_by_landmarks) {
  make_perfect(scenario);
  scenario.faults.start_x_m = 0.5;  // so that it is the bearings that lead there
  scenario.faults.start_heading_rad = 0.05;
  scenario.errors.start_xy_m = 0.5;
  scenario.errors.start_heading_rad = 0.05;
  drive(shipped(), "run");
  is_below(0.01, largest_error_m("run", 20), "landmarks with perfect sensors, after 20 s");
}

// One drive, pinned: a change of these numbers is a change of the filter, to be looked at and told.
TEST(test_the_numbers_of_one_drive) {
  drive(shipped(), "run");
  const Row last = for_each_pose("run", [](const Row &, const State &) {});
  std::printf("ends at %.9f %.9f %.9f, %llu poses; left %llu of %llu, right %llu of %llu\n", last.x_m, last.y_m,
              last.heading_rad, static_cast<unsigned long long>(report.poses),
              static_cast<unsigned long long>(source("sightings:left").fused),
              static_cast<unsigned long long>(source("sightings:left").received),
              static_cast<unsigned long long>(source("sightings:right").fused),
              static_cast<unsigned long long>(source("sightings:right").received));
  TEST_ASSERT_DOUBLE_WITHIN(1e-7, kGoldenX, last.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-7, kGoldenY, last.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-8, kGoldenHeading, last.heading_rad);
  TEST_ASSERT_EQUAL_UINT64(1943, report.poses);
  TEST_ASSERT_EQUAL_UINT64(8159, source("can").fused);
  TEST_ASSERT_EQUAL_UINT64(613, source("sightings:left").received);
  TEST_ASSERT_EQUAL_UINT64(kGoldenLeft, source("sightings:left").fused);
  TEST_ASSERT_EQUAL_UINT64(357, source("sightings:right").received);
  TEST_ASSERT_EQUAL_UINT64(kGoldenRight, source("sightings:right").fused);
  TEST_ASSERT_EQUAL_UINT64(0, source("sightings:left").late + source("sightings:right").late);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, report.health.state);
}

std::string bytes_of(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A frame that comes up to 280 ms late is fused where it belongs: the fused poses are those of frames in order, to the
// bit.
TEST(test_lateness_changes_nothing) {
  for (Camera &camera : scenario.cameras) camera.latency_s = 0;
  drive(shipped(), "fresh");
  for (Camera &camera : scenario.cameras) camera.latency_s = 0.15, camera.latency_jitter_s = 0.13;
  drive(shipped(), "late");
  const std::string fresh = bytes_of(folder + "/fresh/trajectory.csv");
  TEST_ASSERT_GREATER_THAN(100000, fresh.size());
  TEST_ASSERT_TRUE(fresh == bytes_of(folder + "/late/trajectory.csv"));
  TEST_ASSERT_EQUAL_UINT64(0, source("sightings:left").late);
}

TEST(test_frames_that_are_too_late_are_counted) {
  scenario.faults.frames_late = 0.2;
  scenario.faults.frames_late_s = 0.2;  // 350 ms where the configuration allows 300
  drive(shipped(), "run");
  const uint64_t late = source("sightings:left").late + source("sightings:right").late;
  TEST_ASSERT_UINT64_WITHIN(80, 194, late);
  is_below(0.15, largest_error_m("run"), "with a fifth of the frames too late");
}

TEST(test_lost_and_repeated_data_do_no_harm) {
  scenario.faults.can_lost = 0.02;
  scenario.faults.can_duplicated = 0.02;
  scenario.faults.sightings_lost = 0.3;
  scenario.faults.sightings_duplicated = 0.2;
  drive(shipped(), "run");
  TEST_ASSERT_TRUE(source("can").lost > 100);
  TEST_ASSERT_TRUE(source("sightings:left").duplicates > 50);
  is_below(0.15, largest_error_m("run"), "with lost and repeated data");
}

TEST(test_a_dead_encoder_is_noticed_and_survived) {
  scenario.faults.dead_encoder = 0;
  scenario.faults.dead_encoder_from_s = 12;
  drive(shipped(), "run");
  TEST_ASSERT_TRUE(report.health.motion_health & WM_MOTION_HEALTH_ENCODER_LEFT_DEAD);
  is_below(1, largest_error_m("run"), "with the left encoder dead, until it is noticed");
  is_below(0.3, largest_error_m("run", 20), "with the left encoder dead, 8 s later");
}

TEST(test_a_start_told_wrongly_is_mended) {
  scenario.faults.start_x_m = 6;
  scenario.faults.start_y_m = -4;
  scenario.faults.start_heading_rad = 1;
  drive(shipped(), "run");
  is_below(0.3, largest_error_m("run", 25), "after 25 s, started 7 m off");
}

}  // namespace

void setUp(void) {
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, load_scenario(root() + "/config/worlds/crossing.yaml", scenario, &err), err.text);
  folder = std::filesystem::temp_directory_path() / ("wm-crossing-" + std::to_string(getpid()));
}
void tearDown(void) { std::filesystem::remove_all(folder); }
