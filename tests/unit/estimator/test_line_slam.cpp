// SPDX-License-Identifier: Apache-2.0
// Line SLAM among lies: six of ten sightings are of nothing or of another line than they say. What is published is the
// pose, the map, and how many were refused.
#include "filters/slam/params.h"
#include "sensors/sighting.hpp"
#include "world.hpp"

namespace {

using namespace world;

constexpr int kLines = 16, kGhosts = 12;
constexpr double kSigma = 0.003;

wm_slam_params params;
double place[kLines][2];
// What moves along with the robot, or a reflection: an azimuth that drifts, for a while.
struct ghost {
  int32_t id;
  double azimuth_rad, rate_radps, until_s;
} ghosts[kGhosts];
int32_t next_ghost;
int taken, refused, waiting, told, lies;
double renumbered_s;  // all lines are lost for 2 s and come back under other numbers so often; 0: never
double moved_m;       // then each second one is another, so far beside it
double jolt_rad;      // after 30 s the robot is turned by so much, and no wheel tells
bool is_stated;       // each sighting has its own sigma
double lasting_rad;   // sigma of a line's error that is drawn anew every 2 s
int shuffle;          // each look begins with another line, so many on; 0: always in order

double uniform(double from, double to) { return from + (to - from) * wm_random_next_uniform(&noise); }

void begin(int method, bool rejoin = false, int clones = 24, bool wheels = false, bool stated = false) {
  prepare("slam", &params, make::sensor("omni", kSigma, NAN), 7);
  params.line_clones = clones;
  params.line_method = method;
  params.line_near_m = 1;
  params.line_parallax_rad = 0.2;
  params.line_step_m = 0.1;
  params.line_rejoin = rejoin;
  make::sightings.states.sigma[WM_SENSOR_ROW_kTimeOffset] = wheels ? 0.03 : 0.0;
  renumbered_s = moved_m = jolt_rad = lasting_rad = 0.0;
  is_stated = stated;
  if (stated) make::sightings.correlated_slots = 16, make::sightings.correlated_bearing_rad = -1.0;
  shuffle = 0;
  for (int i = 0; i < kLines; i++) {
    const wm::sin_cos a = wm::sincos(wm::kTwoPi * i / kLines + 0.1);
    const double radius = i % 2 == 0 ? 5.5 : 3.5;
    place[i][0] = radius * a.cos;
    place[i][1] = radius * a.sin;
  }
  for (ghost &g : ghosts) g.until_s = -1;
  next_ghost = 1000;
  taken = refused = waiting = told = lies = 0;
  sensor.mounting.rpy_rad[1] = -wm::kHalfPi;  // looks up: bearings are azimuths
  if (wheels) {
    setup.wheels.radius_m = 0.1;
    setup.wheels.ticks_per_turn = 2048;
    setup.wheels.track_m = 0.44;
    motion.noise_ticks_per_sqrt_m = 0.001;
  }
  start_at({2, 0, wm::kHalfPi}, 0.001, 0.001);
  world::begin();
}

void say(double t_s, int32_t id, double bearing) {
  wm_event e = make::sighting(t_s, id, wm::wrap(bearing), kAbsent);
  if (is_stated) e.as.sighting.bearing_sigma_rad = kSigma;
  feed(e);
  told++;
  if (count == 0) return;
  taken += records[0].verdict == WM_FUSED;
  refused += records[0].verdict == WM_REJECTED_GATE;
  waiting += records[0].verdict == WM_REJECTED_SEARCHING;
}

void lie(double t_s, int which) {
  lies++;
  if (which % 2 == 0) {  // a line's number, another direction
    say(t_s, 10 + which % kLines, uniform(-wm::kPi, wm::kPi));
    return;
  }
  ghost &g = ghosts[which % kGhosts];
  if (t_s > g.until_s) g = {next_ghost++, uniform(-wm::kPi, wm::kPi), gauss(0.2), t_s + uniform(0.5, 4)};
  say(t_s, g.id, g.azimuth_rad + g.rate_radps * (g.until_s - t_s) + gauss(kSigma));
}

struct outcome {
  double largest_m, largest_rad, nees;
  int landmarks, right;
};

// Circles of 2 m, a look ten times a second; `lies_of_ten` of ten sightings are lies.
outcome drive(double seconds, int lies_of_ten) {
  outcome out{};
  truth = {2, 0, wm::kHalfPi};
  now_s = 0.0;
  double nees = 0;
  int steps = 0;
  double error[kLines] = {};
  for (int step = 0; 0.02 * step < seconds; step++) {
    const double t_s = 0.02 * step, v = 0.5, w = 0.25;
    feed(make::twist(t_s, v + gauss(0.01), w + gauss(0.005)));
    const int epoch = renumbered_s > 0.0 ? static_cast<int>(t_s / renumbered_s) : 0;
    const bool dark = epoch > 0 && t_s - epoch * renumbered_s < 2.0;
    for (int i = 0; lasting_rad > 0.0 && step % 100 == 0 && i < kLines; i++) error[i] = gauss(lasting_rad);
    for (int k = 0; step % 5 == 0 && !dark && k < kLines; k++) {
      const int i = (k + shuffle * (step / 5)) % kLines;
      const double beside = epoch > 0 && i % 2 == 0 ? moved_m : 0.0;
      say(t_s, 10 + i + 100 * epoch, view_of(place[i][0] + beside, place[i][1]).bearing_rad + gauss(kSigma) + error[i]);
      // So many lies that they are their share of all.
      for (int twice = 0; twice < 2; twice++)
        if (uniform(0, 2) < lies_of_ten / (10.0 - lies_of_ten)) lie(t_s, static_cast<int>(uniform(0, 1000)));
    }
    go_on(v, w, 0.02);
    if (step == 1500) truth.heading_rad = wm::wrap(truth.heading_rad + jolt_rad);
    if (step % 50 != 49) continue;
    out.largest_m = std::fmax(out.largest_m, off());
    out.largest_rad = std::fmax(out.largest_rad, heading_off());
    nees += wm::square(heading_off()) / estimate().covariance[wm_cov_index(5, 5)];
    steps++;
  }
  out.nees = nees / steps;
  out.landmarks = static_cast<int>(map().size());
  for (const mapped &m : map())
    for (const auto &p : place)
      if (std::fabs(m.landmark.p_m[0] - p[0]) < 0.3 && std::fabs(m.landmark.p_m[1] - p[1]) < 0.3) {
        out.right++;
        break;
      }
  std::printf(
      "%d of 10 lies: %d told, %d lies, %d fused, %d refused, %d waiting; pose within %.3f m, %.2f deg; %d of %d "
      "landmarks are lines\n",
      lies_of_ten, told, lies, taken, refused, waiting, out.largest_m, out.largest_rad * 180 / M_PI, out.right,
      out.landmarks);
  return out;
}

TEST(test_honest_sightings) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    begin(method);
    const outcome o = drive(50, 0);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.15, o.largest_m);
    TEST_ASSERT_EQUAL(kLines, o.right);
    TEST_ASSERT_LESS_THAN(told / 50, refused);
  }
}

TEST(test_six_of_ten_are_lies) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    begin(method);
    const outcome o = drive(50, 6);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.55 * told, lies);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.65 * told, lies);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.25, o.largest_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(4 * M_PI / 180, o.largest_rad);
    TEST_ASSERT_GREATER_OR_EQUAL(kLines / 2, o.right);
    TEST_ASSERT_GREATER_THAN(lies / 50, refused);
  }
}

// GIVEN lines that are all lost at times and come back under other numbers THEN the map does not double; but lines that
// stand beside the lost ones are others.
TEST(test_lost_lines_are_found_again) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    for (bool rejoin : {false, true}) {
      begin(method, rejoin);
      renumbered_s = 25;
      const outcome o = drive(75, 0);
      TEST_ASSERT_LESS_THAN_DOUBLE(0.2, o.largest_m);
      TEST_ASSERT_EQUAL(o.landmarks, o.right);
      if (rejoin)
        TEST_ASSERT_LESS_OR_EQUAL(kLines + 2, o.landmarks);
      else
        TEST_ASSERT_GREATER_OR_EQUAL(2 * kLines, o.landmarks);
    }
    begin(method, true);
    renumbered_s = 40;
    moved_m = 0.25;
    TEST_ASSERT_INT_WITHIN(1, kLines + kLines / 2, drive(75, 0).landmarks);
  }
}

// GIVEN more lines in view than rays (as in a hall after the lights failed: all are new) THEN those that have a ray
// keep it until they are places, and the others follow: all lines come onto the map.
TEST(test_more_lines_than_rays) {
  begin(WM_SLAM_LINE_INVERSE_DISTANCE, false, kLines / 2);
  shuffle = 7;
  const outcome o = drive(50, 0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, o.largest_m);
  TEST_ASSERT_LESS_THAN_DOUBLE(2 * M_PI / 180, o.largest_rad);
  TEST_ASSERT_EQUAL(kLines, o.right);
}

// GIVEN wheel counts whose stamps scatter and which are 15 ms old at each picture WHEN the robot turns to and fro THEN
// the offset of the camera's clock is not that age.
TEST(test_the_time_offset_is_not_the_counts_age) {
  constexpr double kTrack_m = 0.44, kPerTick_m = wm::kTwoPi * 0.1 / 2048;
  double offset_s = 0.0;
  for (uint64_t trial = 0; trial < 4; trial++) {
    begin(WM_SLAM_LINE_INVERSE_DISTANCE, true, 24, true);
    noise = {11, trial, 0};
    truth = {2, 0, wm::kHalfPi};
    double rolled_m[2] = {};
    for (int step = 0; step < 50 * 40; step++) {
      const double t_s = 0.02 * step, v = 0.3, w = 0.6 * wm::cos(0.6 * t_s);
      feed(make::quantities(t_s + uniform(-0.003, 0.003),
                            {{WM_Q_WHEEL_TICKS_LEFT, std::floor(rolled_m[0] / kPerTick_m)},
                             {WM_Q_WHEEL_TICKS_RIGHT, std::floor(rolled_m[1] / kPerTick_m)}}));
      const wm::arc seen = wm::make_arc(0.015 * v, 0.015 * w);
      const wm_pose2 from = wm::compose(truth, {seen.x_m, seen.y_m, seen.turn_rad});
      for (int i = 0; step % 5 == 0 && i < kLines; i++)
        say(t_s + 0.015, 10 + i, view_of(place[i][0], place[i][1], from).bearing_rad + gauss(kSigma));
      go_on(v, w, 0.02);
      for (int side = 0; side < 2; side++) rolled_m[side] += 0.02 * (v + (side == 0 ? -0.5 : 0.5) * kTrack_m * w);
    }
    offset_s += 0.25 * value_of("omni.time_offset_s");
  }
  std::printf("time offset %.1f ms\n", 1e3 * offset_s);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.009, offset_s);  // 15.6 ms by the twist of the last count, 6.2 by the steady one
}

// GIVEN bearings that state the sigma of one picture, while an edge is found beside its place for two seconds THEN it
// is no noise of single pictures: few are refused, and the pose is right (240 of 16000 and 0.13 m without).
TEST(test_errors_that_last_though_a_sigma_is_stated) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    begin(method, false, 24, false, true);
    lasting_rad = kSigma;
    const outcome o = drive(100, 0);
    TEST_ASSERT_LESS_THAN(told / 1000, refused);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.08, o.largest_m);
    TEST_ASSERT_EQUAL(kLines, o.right);
  }
}

// A bearing's error that lasts: by default as large as its sigma and a landmark's breadth at that distance. An edge
// that states its sigma has no breadth; where a motion with covariances and ranges state all errors, there is none.
TEST(test_the_error_that_lasts_of_a_bearing) {
  wm_sighting_params p;
  wm_params_defaults(&wm_sighting_params_table, &p);
  wm::sighting_reading r{};
  r.bearing_sigma_rad = 0.003;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::hypot(0.003, 0.02 / 4.0), wm::correlated_bearing(p, r, 4.0));
  r.complete = true;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.003, wm::correlated_bearing(p, r, 4.0));
  r.independent = true;
  TEST_ASSERT_EQUAL_DOUBLE(0.0, wm::correlated_bearing(p, r, 4.0));
  p.correlated_bearing_rad = 0.001;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.001, wm::correlated_bearing(p, r, 4.0));
}

// GIVEN lines that are well known WHEN the robot is turned, and no wheel tells THEN a second later it knows, and the
// lines stay where they are.
TEST(test_a_robot_that_is_turned_by_hand_keeps_its_map) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    begin(method);
    jolt_rad = 0.12;
    const outcome o = drive(60, 0);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.2, o.largest_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.5 * M_PI / 180, o.largest_rad);
    TEST_ASSERT_EQUAL(kLines, o.landmarks);
    TEST_ASSERT_EQUAL(kLines, o.right);
    TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(1, counted(WM_COUNTER_ROTATION_OUTLIERS));
  }
}

}  // namespace
