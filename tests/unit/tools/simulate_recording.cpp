// SPDX-License-Identifier: Apache-2.0
// The recording that the simulator writes is opened by drivers/recording, and what is read says what was true: frames,
// signs, units, stamps and arrivals from one end to the other.
#include <unistd.h>
#include <vector>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "shipped.h"
#include "simulate/angle.h"
#include "simulate/write.h"
#include "waymark/recording.h"

using namespace wm::sim;

namespace {

std::string folder;
Scenario scenario;
Recording made;
wm_recording *opened;

void count_warning(void *context, wm_note, const char *text) {
  (void)text;
  ++*static_cast<int *>(context);
}

void write_and_open(bool perfect) {
  wm_error err{};
  if (perfect) make_perfect(scenario);
  made = driven(scenario, 1, 3);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_recording(scenario, made, folder, &err), err.text);
  int warnings = 0;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(folder.c_str(), nullptr, count_warning, &warnings, &opened, &err),
                            err.text);
  TEST_ASSERT_EQUAL(0, warnings);
}

std::vector<wm_event> events_of(wm_source *source) {
  std::vector<wm_event> events;
  wm_event e{};
  wm_error err{};
  wm_status status;
  while ((status = source->ops->next(source, &e, &err)) == WM_OK) events.push_back(e);
  TEST_ASSERT_EQUAL_MESSAGE(WM_END, status, err.text);
  TEST_ASSERT_EQUAL_MESSAGE(0, source->counts.malformed, source->counts.first_problem);
  TEST_ASSERT_EQUAL(events.size(), source->counts.received);
  return events;
}

TEST(test_what_was_known_beforehand_is_read_back) {
  write_and_open(false);
  TEST_ASSERT_EQUAL_STRING("crossing", wm_recording_name(opened));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, made.drive.duration_s(), wm_recording_duration_s(opened));
  const wm_wheels *w = wm_site_wheels(wm_recording_site(opened));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.25, w->radius_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1024, w->ticks_per_turn);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.2, w->track_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.8, w->wheelbase_m);
  TEST_ASSERT_EQUAL(9, w->steering_table_count);
  for (int i = 0; i < 9; i++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, scenario.robot.wheels.actuator_m[i], w->actuator_m[i]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, scenario.robot.wheels.road_wheel_rad[i], w->road_wheel_rad[i]);
  }
  size_t count = 0;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(opened), &count);
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_EQUAL_STRING("right", sensors[1].name);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -50 * kPi / 180, sensors[1].mounting.rpy_rad[2]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.4, sensors[1].mounting.xyz_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.3 * kPi / 180, sensors[0].bearing_sigma_rad);
  const wm_landmark *landmarks = wm_site_landmarks(wm_recording_site(opened), &count);
  TEST_ASSERT_EQUAL(3, count);
  for (size_t i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL(made.map[i].id, landmarks[i].id);
    for (int axis = 0; axis < 3; axis++) TEST_ASSERT_DOUBLE_WITHIN(1e-6, made.map[i].p_m[axis], landmarks[i].p_m[axis]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.02, landmarks[i].sigma_m);
  }
  const wm_start *start = wm_site_start(wm_recording_site(opened));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, made.start.p_m[0], start->p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, made.start.heading_rad, start->heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.03, start->sigma_xy_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.5 * kPi / 180, start->sigma_heading_rad);
}

TEST(test_bearings_are_those_of_truth) {
  write_and_open(true);
  size_t sources = 0, seen = 0;
  wm_source *const *all = wm_recording_sources(opened, &sources);
  size_t sensor_count = 0;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(opened), &sensor_count);
  size_t landmark_count = 0;
  const wm_landmark *landmarks = wm_site_landmarks(wm_recording_site(opened), &landmark_count);
  for (size_t i = 0; i < sources; i++) {
    if (std::strncmp(all[i]->name, "sightings:", 10) != 0) continue;
    for (const wm_event &e : events_of(all[i])) {
      const wm_sighting &s = e.as.sighting;
      TEST_ASSERT_LESS_THAN(sensor_count, s.sensor);
      const wm_mounting &mounting = sensors[s.sensor].mounting;
      const State at = made.drive.at(static_cast<double>(e.t_ns - made.clock_start_ns) * 1e-9);
      const double x =
          at.x_m + mounting.xyz_m[0] * std::cos(at.heading_rad) - mounting.xyz_m[1] * std::sin(at.heading_rad);
      const double y =
          at.y_m + mounting.xyz_m[0] * std::sin(at.heading_rad) + mounting.xyz_m[1] * std::cos(at.heading_rad);
      const wm_landmark *l = landmarks;
      while (l->id != s.landmark_id) l++;
      const double wanted = wrap(std::atan2(l->p_m[1] - y, l->p_m[0] - x) - at.heading_rad - mounting.rpy_rad[2]);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, wrap(s.bearing_rad - wanted));
      TEST_ASSERT_DOUBLE_IS_NAN(s.range_m);
      TEST_ASSERT_EQUAL_INT64(150000000, e.arrival_ns - e.t_ns);
      seen++;
    }
  }
  TEST_ASSERT_EQUAL(made.sightings.size(), seen);
}

// Dead reckoning by hand from what the bus says, counts for the way and the yaw rate for the heading: ends where the
// drive ends. No estimator in between.
TEST(test_counts_and_yaw_rate_lead_to_the_end) {
  write_and_open(true);
  size_t sources = 0;
  wm_source *const *all = wm_recording_sources(opened, &sources);
  TEST_ASSERT_EQUAL_STRING("can", all[0]->name);
  const double metres_per_tick = 2 * kPi * 0.25 / 1024;
  double rate = 0, heading = 0, x = 0, y = 0, ticks = NAN;
  wm_time_ns rate_since = 0;
  uint32_t quantities = 0;
  for (const wm_event &e : events_of(all[0])) {
    double left = NAN, right = NAN;
    for (int i = 0; i < e.as.quantities.count; i++) {
      const double value = e.as.quantities.value[i];
      quantities |= 1u << e.as.quantities.id[i];
      if (e.as.quantities.id[i] == WM_Q_YAW_RATE) {
        if (rate_since) heading += rate * static_cast<double>(e.t_ns - rate_since) * 1e-9;
        rate = value;
        rate_since = e.t_ns;
      }
      if (e.as.quantities.id[i] == WM_Q_WHEEL_TICKS_LEFT) left = value;
      if (e.as.quantities.id[i] == WM_Q_WHEEL_TICKS_RIGHT) right = value;
      if (e.as.quantities.id[i] == WM_Q_STEERING_ACTUATOR) {
        const State at = made.drive.at(static_cast<double>(e.t_ns - made.clock_start_ns) * 1e-9);
        const double straight_m = 0.058;  // of the table
        if (std::fabs(at.curvature_1pm) < 1e-12) TEST_ASSERT_DOUBLE_WITHIN(1.1e-5, straight_m, value);
        if (at.curvature_1pm > 0.02) TEST_ASSERT_GREATER_THAN_DOUBLE(straight_m, value);  // to the left
      }
    }
    if (std::isnan(left)) continue;
    const double now = 0.5 * (left + right);
    if (!std::isnan(ticks)) {
      // The heading in the middle of the 20 ms that these counts cover.
      const double mid = heading + rate * (static_cast<double>(e.t_ns - rate_since) * 1e-9 - 0.01);
      x += (now - ticks) * metres_per_tick * std::cos(mid);
      y += (now - ticks) * metres_per_tick * std::sin(mid);
    }
    ticks = now;
  }
  const State end = made.drive.at(1e9);
  TEST_ASSERT_EQUAL_HEX32(wm_recording_quantities(opened), quantities);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, end.heading_rad, heading);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, end.x_m, x);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, end.y_m, y);
}

TEST(test_truth_is_the_drive) {
  write_and_open(false);
  std::ifstream file(folder + "/truth.csv");
  std::string line;
  std::getline(file, line);
  TEST_ASSERT_EQUAL_STRING("t_ns,x_m,y_m,z_m,qx,qy,qz,qw", line.c_str());
  size_t rows = 0;
  while (std::getline(file, line)) {
    long long t_ns = 0;
    double x = 0, y = 0, z = 0, q[4] = {};
    TEST_ASSERT_EQUAL(8, std::sscanf(line.c_str(), "%lld,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &t_ns, &x, &y, &z, &q[0], &q[1],
                                     &q[2], &q[3]));
    const State at = made.drive.at(static_cast<double>(t_ns - made.clock_start_ns) * 1e-9);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, at.x_m, x);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, at.y_m, y);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0, wrap(2 * std::atan2(q[2], q[3]) - at.heading_rad));
    rows++;
  }
  TEST_ASSERT_EQUAL(made.truth.size(), rows);
}

std::string bytes_of(const std::filesystem::path &path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(test_the_same_seed_gives_the_same_bytes) {
  write_and_open(false);
  const std::string second = folder + "-again";
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_recording(scenario, driven(scenario, 1, 3), second, &err), err.text);
  size_t files = 0;
  for (const auto &entry : std::filesystem::directory_iterator(folder)) {
    const std::string bytes = bytes_of(entry.path());
    TEST_ASSERT_TRUE(!bytes.empty());
    TEST_ASSERT_TRUE(bytes == bytes_of(second / entry.path().filename()));
    files++;
  }
  TEST_ASSERT_EQUAL(9, files);
  std::filesystem::remove_all(second);
}

TEST(test_a_folder_that_cannot_be_made_is_named) {
  wm_error err{};
  TEST_ASSERT_EQUAL(WM_IO, write_recording(scenario, driven(scenario, 1, 3), "/proc/no/such", &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, "/proc/no/such"), err.text);
}

}  // namespace

void setUp(void) {
  load_shipped("crossing", scenario);
  folder = std::filesystem::temp_directory_path() / ("wm-simulate-" + std::to_string(getpid()));
  opened = nullptr;
}
void tearDown(void) {
  wm_recording_close(opened);
  std::filesystem::remove_all(folder);
}
