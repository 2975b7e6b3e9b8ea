// SPDX-License-Identifier: Apache-2.0
// Each shipped world with pictures becomes a recording that the reader opens: small pictures of a short piece of the
// drive. The same seed gives the same bytes; perfect wheels and gyro give the truth back, also backwards.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/trials.h"
#include "filmed.h"
#include "simulate/write.h"
#include "waymark/recording.h"

using namespace wm::sim;

namespace {

std::string folder;

std::string bytes_of(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

size_t lines_of(const std::string &path) {
  const std::string text = bytes_of(path);
  return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

void write(const Film &film, const std::string &dir) {
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_sensors(film.scenario, film.recording, dir, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_pictures(film, dir, nullptr, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, finish_recording(film.scenario, film.recording, dir, &err), err.text);
}

std::string warnings;

void note(void *, wm_note, const char *text) { warnings += std::string(text) + "\n"; }

void check_world(const char *name, std::initializer_list<const char *> cameras, int width, int height) {
  tearDown(), setUp();  // an empty folder
  Scenario scenario = shipped(name);
  shrink(scenario, cameras, width, height);
  scenario.faults.frames_lost = 0;
  for (PixelCamera &camera : scenario.pixel_cameras) camera.rate_hz = 4;
  const Film film = filmed(scenario, 3);
  TEST_ASSERT_EQUAL(cameras.size(), film.cameras.size());
  write(film, folder + "/a");

  wm_recording *opened = nullptr;
  wm_error err{};
  warnings.clear();
  const std::string a = folder + "/a";
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(a.c_str(), nullptr, note, nullptr, &opened, &err), err.text);
  TEST_ASSERT_EQUAL_STRING("", warnings.c_str());
  wm_recording_close(opened);

  for (const char *camera : cameras) TEST_ASSERT_EQUAL(1 + 4, lines_of(a + "/video/" + camera + ".csv"));
  for (const World::Labels what : film.world->labels)
    TEST_ASSERT_GREATER_THAN_MESSAGE(1, lines_of(a + "/" + label_file(what)), label_file(what));

  write(filmed(scenario, 3), folder + "/b");
  size_t files = 0;
  for (const auto &entry : std::filesystem::recursive_directory_iterator(a)) {
    if (!entry.is_regular_file()) continue;
    files++;
    const std::string other = folder + "/b/" + std::filesystem::relative(entry.path(), a).string();
    TEST_ASSERT_TRUE_MESSAGE(bytes_of(entry.path().string()) == bytes_of(other), other.c_str());
  }
  TEST_ASSERT_GREATER_THAN(5, files);
}

TEST(test_a_corridor_is_a_recording) { check_world("corridor-easy", {"front"}, 160, 90); }
TEST(test_a_seabed_is_a_recording) { check_world("seabed-easy", {"left", "right"}, 160, 120); }
TEST(test_the_other_worlds_are_recordings) {
  if (wm_trials(6, 2) != 6) TEST_IGNORE();
  check_world("corridor-hard", {"front"}, 160, 90);
  check_world("office-easy", {"ceiling"}, 160, 120);
  check_world("hall-easy", {"omni"}, 120, 120);
  check_world("crossing-easy", {"left", "right"}, 160, 120);
}

// Wheel speeds without sign, the gear and the yaw rate, added up.
TEST(test_perfect_sensors_follow_the_truth_also_backwards) {
  Scenario scenario = shipped("corridor-easy");
  make_perfect(scenario);
  const Film film = filmed(scenario, 3);
  const Recording &r = film.recording;
  const State start = r.drive.at(0);
  double x = start.x_m, y = start.y_m, heading = start.heading_rad, speed = 0, rate = 0, backwards_m = 0, worst_m = 0;
  int gear = 1;
  wm_time_ns last_ns = r.clock_start_ns;
  for (const wm_can_frame &f : r.can) {
    const double dt = static_cast<double>(f.t_ns - last_ns) * 1e-9;
    const double middle = heading + 0.5 * rate * dt;
    x += gear * speed * dt * std::cos(middle);
    y += gear * speed * dt * std::sin(middle);
    heading += rate * dt;
    backwards_m += gear < 0 ? speed * dt : 0;
    last_ns = f.t_ns;
    const auto word = [&](int i) { return f.data[i] | f.data[i + 1] << 8; };
    if (f.id == message(Bus_message::wheel_speeds).id) speed = 0.5 * 0.001 * (word(0) + word(2));
    if (f.id == message(Bus_message::yaw_rate).id)
      rate = 0.002 * static_cast<int16_t>(word(0)) * 3.14159265358979 / 180;
    if (f.id == message(Bus_message::gear).id) gear = (f.data[0] & 15) == 15 ? -1 : f.data[0] & 15;
    const State truth = r.drive.at(static_cast<double>(f.t_ns - r.clock_start_ns) * 1e-9);
    worst_m = std::max(worst_m, std::hypot(x - truth.x_m, y - truth.y_m));
  }
  TEST_ASSERT_GREATER_THAN(10, static_cast<int>(backwards_m));
  TEST_ASSERT_DOUBLE_WITHIN(0.005, 0, worst_m);
}

// Twists in the vehicle's axes, added up in space.
TEST(test_perfect_twists_follow_the_truth_under_water) {
  Scenario scenario = shipped("seabed-easy");
  make_perfect(scenario);
  const Film film = filmed(scenario, 3);
  const Recording &r = film.recording;
  TEST_ASSERT_EQUAL(r.truth6.size(), r.motion6.size());
  Eigen::Quaterniond q(r.truth6[0].q_xyzw[3], r.truth6[0].q_xyzw[0], r.truth6[0].q_xyzw[1], r.truth6[0].q_xyzw[2]);
  Eigen::Vector3d p(r.truth6[0].xyz_m);
  double worst_m = 0, worst_rad = 0;
  for (size_t i = 0; i + 1 < r.motion6.size(); i++) {
    const double dt = static_cast<double>(r.motion6[i + 1].t_ns - r.motion6[i].t_ns) * 1e-9;
    const Eigen::Vector3d v(r.motion6[i].v_mps), w(r.motion6[i].w_radps);
    const auto turn = [&](double t) { return Eigen::Quaterniond(Eigen::AngleAxisd(w.norm() * t, w.normalized())); };
    p += (q * turn(0.5 * dt)) * v * dt;
    q = q * turn(dt);
    const Truth6 &truth = r.truth6[i + 1];
    worst_m = std::max(worst_m, (p - Eigen::Vector3d(truth.xyz_m)).norm());
    worst_rad = std::max(worst_rad, q.angularDistance(Eigen::Quaterniond(truth.q_xyzw[3], truth.q_xyzw[0],
                                                                         truth.q_xyzw[1], truth.q_xyzw[2])));
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.005, 0, worst_m);
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 0, worst_rad);
}

// The wheels and the gyro go on as if nothing had happened; the truth jumps.
TEST(test_who_is_carried_does_not_feel_it) {
  Scenario scenario = shipped("corridor-easy");
  make_perfect(scenario);
  scenario.faults.kidnap_at_s = 20;
  scenario.faults.kidnap_forward_s = 15;
  const Film film = filmed(scenario, 3);
  const Drive &drive = film.recording.drive;
  const State before = drive.at(19.9999), after = drive.at(20.0001);
  TEST_ASSERT_GREATER_THAN(3, static_cast<int>(std::hypot(after.x_m - before.x_m, after.y_m - before.y_m)));
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, before.way_m - before.carried_way_m, after.way_m - after.carried_way_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, before.heading_rad - before.carried_heading_rad,
                            after.heading_rad - after.carried_heading_rad);
  for (const wm_can_frame &f : film.recording.can)
    if (f.id == message(Bus_message::wheel_speeds).id) TEST_ASSERT_LESS_THAN(3000, f.data[0] | f.data[1] << 8);
}

TEST(test_drop_outs_and_clock_errors_are_in_the_stamps) {
  Scenario scenario = shipped("corridor-easy");
  make_perfect(scenario);
  scenario.duration_s = 20;
  scenario.faults.camera_dropout = {5, 7};
  scenario.faults.camera_clock_offset_s = 0.010;
  scenario.faults.camera_clock_drift = 1e-4;
  const Film film = filmed(scenario, 3);
  const std::vector<FrameTime> times = frame_times(film, 0);
  TEST_ASSERT_EQUAL(180, times.size());
  for (size_t i = 0; i < times.size(); i++) {
    const FrameTime &t = times[i];
    TEST_ASSERT_FALSE(t.t_s >= 5 && t.t_s < 7);
    TEST_ASSERT_INT64_WITHIN(2, film.recording.clock_start_ns + std::llround(1e9 * (t.t_s * 1.0001 + 0.010)),
                             t.stamp_ns);
    const double late_s = static_cast<double>(t.arrival_ns - film.recording.clock_start_ns) * 1e-9 - t.t_s;
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.0199, late_s);
    TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(0.0601, late_s);
  }
}

TEST(test_an_unknown_camera_is_told_with_the_ones_there_are) {
  Scenario scenario = shipped("corridor-easy");
  PixelCamera camera;
  camera.name = "rear";
  scenario.pixel_cameras = {camera};
  Film film;
  wm_error err{};
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, prepare(scenario, 1, film, &err));
  TEST_ASSERT_EQUAL_STRING("cameras: this world has no camera `rear`; it has front", err.text);
}

}  // namespace

void setUp(void) {
  folder = "simulate_pictures." + std::to_string(getpid());
  std::filesystem::create_directories(folder);
}
void tearDown(void) { std::filesystem::remove_all(folder); }
