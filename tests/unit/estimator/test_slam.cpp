// SPDX-License-Identifier: Apache-2.0
// SLAM in a simulated room whose landmarks nobody measured: it finds them, and absurd input is told, counted and
// survived. Scenarios are GIVEN / WHEN / THEN; all noise is drawn from fixed seeds.
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "events.hpp"
#include "filters/slam/bearing_tracks.hpp"
#include "filters/slam/params.h"
#include "math/arc.hpp"
#include "motion/motion_params.h"
#include "unity.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

constexpr int kCount = 12;
const double kAbsent = std::numeric_limits<double>::quiet_NaN();

const wm_estimator *slam;
wm_motion_params motion;
wm_slam_params params;
wm_setup setup;
wm_sensor sensor;
wm_landmark known[kCount];
double place[kCount][2];
void *state;
wm_random noise;
wm_pose2 truth;
double now_s;
double false_share;  // of sightings that are of nothing
bool hidden, twice, nameless, coded, two_poses;
int fused, rejected, twin;  // twin: 0, or where a second print of the first identity hangs

double gauss(double sigma) { return sigma * wm_random_next_normal(&noise); }

void make_room() {
  slam = wm_estimator_find("slam");
  wm_params_defaults(&wm_motion_params_table, &motion);
  wm_params_defaults(&slam->params, &params);
  for (int i = 0; i < kCount; i++) {
    const wm::sin_cos a = wm::sincos(wm::kTwoPi * i / kCount + 0.1);
    const double radius = i % 2 == 0 ? 5.0 : 3.5;
    place[i][0] = radius * a.cos;
    place[i][1] = radius * a.sin;
    known[i] = {10 + i, {place[i][0], place[i][1], 0}, 0.01, kAbsent, {}, 0};
  }
  sensor = {};
  std::strcpy(sensor.name, "camera");
  sensor.mounting.xyz_m[0] = 0.2;
  sensor.bearing_sigma_rad = 0.01;
  sensor.range_sigma_m = 0.03;
  sensor.max_range_m = INFINITY;
  setup = {};
  setup.motion = &motion;
  setup.wheels = make::no_wheels();
  setup.sensors = &sensor;
  setup.sensor_count = 1;
  setup.landmarks = known;
  setup.landmark_count = kCount;
  setup.start = {WM_TIME_NONE, {2, 0, 0}, {0, 0, 0, 1}, wm::kHalfPi, 0.001, 0.001};
  truth = {2, 0, wm::kHalfPi};
  noise = {42, 1, 0};
  now_s = false_share = 0.0;
  hidden = twice = nameless = coded = two_poses = false;
  fused = rejected = twin = 0;
}

void begin() {
  const char *why = "";
  std::free(state);
  const size_t bytes = slam->state_bytes(&params, &setup, &why);
  TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
  state = aligned_alloc(16, (bytes + 15) / 16 * 16);
  TEST_ASSERT_EQUAL(WM_OK, slam->init(state, &params, &setup));
}

wm_verdict see(const wm_event &e) {
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  TEST_ASSERT_EQUAL(WM_OK, slam->correct(state, &e, out, WM_INNOVATIONS_PER_EVENT_MAX, &count));
  TEST_ASSERT_GREATER_THAN(0, count);
  (out[0].verdict == WM_FUSED ? fused : rejected)++;
  return (wm_verdict)out[0].verdict;
}

wm_marker marker(int32_t id, double x, double y, double z, double yaw_rad) {
  wm_marker m{};
  m.id = id;
  m.p_m[0] = x;
  m.p_m[1] = y;
  m.p_m[2] = z;
  m.yaw_rad = yaw_rad;
  return m;
}

// Drives a circle of 2 m and looks around five times a second.
void drive(double seconds, bool range = true) {
  const double v = 0.5, w = 0.25, until = now_s + seconds;
  for (int step = 0; now_s < until; step++) {
    const wm_event e = make::twist(now_s, v + gauss(0.02), w + gauss(0.01));
    TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
    if (step % 10 == 0 && !hidden) {
      const wm_pose2 eye = wm::compose(truth, {0.2, 0, 0});
      for (int k = 0; k < kCount + (twin > 0); k++) {
        const int i = k % kCount, at = k < kCount ? k : twin;
        const double dx = place[at][0] - eye.x_m, dy = place[at][1] - eye.y_m;
        const double bearing = wm::wrap(wm::atan2(dy, dx) - truth.heading_rad), distance = std::sqrt(dx * dx + dy * dy);
        if (std::fabs(bearing) > 1.2) continue;
        const bool wrong = wm_random_next_uniform(&noise) < false_share;
        const double b = wrong ? gauss(0.7) : bearing + gauss(0.01);
        const double r = wrong ? 1.0 + 5.0 * wm_random_next_uniform(&noise) : distance + gauss(0.03);
        if (coded) {
          wm_event seen = make::empty(now_s, WM_EVENT_MARKER);
          seen.as.marker =
              marker(10 + i, r * wm::cos(b), r * wm::sin(b), 2.2, wm::wrap(0.5 * i - truth.heading_rad + gauss(0.01)));
          if (two_poses) {  // the wrong one first, turned to the other side of the line of sight
            wm_marker &m = seen.as.marker;
            m.poses = 2;
            std::memcpy(m.other_p_m, m.p_m, sizeof m.p_m);
            m.other_yaw_rad = m.yaw_rad;
            m.yaw_rad = wm::wrap(m.yaw_rad + (bearing > 0 ? 0.4 : -0.4));
          }
          see(seen);
          if (twice) see(seen);
          continue;
        }
        see(make::sighting(now_s, nameless ? -1 : 10 + i, b, range ? r : kAbsent));
        if (twice) see(make::sighting(now_s, nameless ? -1 : 10 + i, b, range ? r : kAbsent));
      }
    }
    const double dt = 0.02;
    const wm::arc a = wm::make_arc(v * dt, w * dt);
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
    now_s += dt;
  }
  const wm_event e = make::twist(now_s, v, w);
  TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
}

double off() {
  wm_estimate e;
  slam->estimate(state, &e);
  const double dx = e.pose_map_base.p_m[0] - truth.x_m, dy = e.pose_map_base.p_m[1] - truth.y_m;
  return std::sqrt(dx * dx + dy * dy);
}

double sigma() {
  wm_estimate e;
  slam->estimate(state, &e);
  return std::sqrt(e.covariance[0] + e.covariance[wm_cov_index(1, 1)]);
}

double counted(const char *name) {
  wm_calibration_value values[64];
  const size_t n = slam->calibration(state, values, 64);
  for (size_t i = 0; i < n; i++)
    if (std::strcmp(values[i].name, name) == 0) return values[i].value;
  return -1.0;
}

// Largest distance between a landmark found and the true place that its id (or, without ids, its neighbourhood) names.
double worst_landmark(size_t *found) {
  wm_landmark l[64];
  double covariance[64][4], worst = 0.0;
  *found = slam->landmarks(state, l, covariance, 64);
  for (size_t i = 0; i < *found; i++) {
    double least = 1e300;
    for (int k = 0; k < kCount; k++) {
      if (!nameless && l[i].id != 10 + k) continue;
      const double dx = l[i].p_m[0] - place[k][0], dy = l[i].p_m[1] - place[k][1];
      least = std::fmin(least, std::sqrt(dx * dx + dy * dy));
    }
    TEST_ASSERT_TRUE(covariance[i][0] > 0.0 && covariance[i][2] > 0.0);
    worst = std::fmax(worst, least);
  }
  return worst;
}

void test_landmarks_are_found_by_bearing_and_range(void) {
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

void test_landmarks_are_found_by_bearings_alone_whatever_the_method(void) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_LINEAR, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    make_room();
    params.line_clones = 20;
    params.line_method = method;
    begin();
    drive(60, false);
    size_t found;
    TEST_ASSERT_LESS_THAN_DOUBLE(0.3, worst_landmark(&found));
    TEST_ASSERT_GREATER_OR_EQUAL(kCount - 1, found);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
  }
}

void test_coded_markers_give_place_and_heading_at_once(void) {
  coded = true;
  params.markers = 1;
  params.marker_heading_sigma_rad = 0.01;
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  wm_landmark l[kCount];
  double covariance[kCount][4];
  slam->landmarks(state, l, covariance, kCount);
  for (const wm_landmark &m : l) {
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, wm::wrap(m.yaw_rad - 0.5 * (m.id - 10)));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.2, m.p_m[2]);
  }
}

void test_absurd_markers_are_refused_and_change_nothing(void) {
  params.markers = 1;
  begin();
  drive(1);
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  for (double bad : {kAbsent, HUGE_VAL, 1e9}) {
    wm_event e = make::empty(now_s, WM_EVENT_MARKER);
    e.as.marker = marker(3, bad, 0, 1, 0);
    TEST_ASSERT_EQUAL(std::isfinite(bad) ? WM_OUT_OF_RANGE : WM_NOT_FINITE, slam->correct(state, &e, out, 8, &count));
    e.as.marker = marker(3, 1, 0, 1, bad);
    TEST_ASSERT_EQUAL(std::isfinite(bad) ? WM_OUT_OF_RANGE : WM_NOT_FINITE, slam->correct(state, &e, out, 8, &count));
  }
  wm_event e = make::empty(now_s, WM_EVENT_MARKER);
  e.as.marker = marker(3, 1, 0, 1, 0);
  e.as.marker.sensor = 7;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, slam->correct(state, &e, out, 8, &count));
  e.as.marker = marker(-1, 1, 0, 1, 0);
  TEST_ASSERT_EQUAL(WM_REJECTED_NO_ASSOCIATION, see(e));
}

void test_of_two_poses_the_one_is_taken_that_fits_the_map(void) {
  coded = true;
  params.markers = 1;
  params.marker_heading_sigma_rad = 0.01;
  begin();
  drive(20);
  two_poses = true;
  rejected = 0;
  drive(20);
  TEST_ASSERT_EQUAL(0, rejected);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  wm_landmark l[kCount];
  double covariance[kCount][4];
  TEST_ASSERT_EQUAL(kCount, slam->landmarks(state, l, covariance, kCount));
  for (const wm_landmark &m : l) TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, wm::wrap(m.yaw_rad - 0.5 * (m.id - 10)));
}

void test_markers_with_two_poses_from_the_start_have_a_place_and_no_heading(void) {
  coded = two_poses = true;
  params.markers = 1;
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  wm_landmark l[kCount];
  double covariance[kCount][4];
  slam->landmarks(state, l, covariance, kCount);
  for (const auto &c : covariance) TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, c[3]);
}

void test_landmarks_without_identity_are_told_apart(void) {
  nameless = true;
  params.associate_unknown = 1;
  params.associate_near_m = 2.0;
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

void test_a_landmark_seen_twice_in_a_frame_without_identity_is_fused_once(void) {
  nameless = twice = true;
  params.associate_unknown = 1;
  params.associate_near_m = 2.0;
  begin();
  drive(40);
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_EQUAL(kCount, found);  // the second sighting made no second landmark
  TEST_ASSERT_GREATER_THAN(fused / 2, rejected);
}

void test_the_same_identity_twice_in_a_frame_at_two_places_keeps_one(void) {
  begin();
  drive(30);
  const double before = off();
  for (int i = 0; i < 100; i++) {  // a copy of the code hangs elsewhere
    drive(0.2);
    see(make::sighting(now_s, 10, 0.9, 1.5));
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, before);
}

wm_state published_state() {
  wm_estimate e;
  slam->estimate(state, &e);
  return (wm_state)e.state;
}

void test_a_marker_seen_twice_in_a_picture_is_fused_once_and_told(void) {
  coded = twice = true;
  params.markers = 1;
  begin();
  drive(40);
  TEST_ASSERT_EQUAL(fused, rejected);
  TEST_ASSERT_EQUAL_DOUBLE(rejected, counted("map.doubled"));
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
}

void test_two_markers_of_one_identity_are_told_and_left_alone(void) {
  coded = true;
  params.markers = 1;
  begin();
  drive(30);
  const double before[2] = {place[0][0], place[0][1]};
  for (int turn = 1; turn <= 3; turn++) {
    place[0][0] = before[0] + (turn % 2 ? 1.5 : 0.0);
    drive(40);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  }
  TEST_ASSERT_EQUAL_DOUBLE(2, counted("map.moved"));
  TEST_ASSERT_GREATER_THAN_DOUBLE(10, counted("map.doubled"));
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_EQUAL(kCount - 1, found);
}

void test_two_markers_of_one_identity_on_opposite_sides_spoil_nothing(void) {
  coded = true;
  params.markers = 1;
  twin = 6;  // opposite
  begin();
  for (int turn = 0; turn < 8; turn++) {
    drive(20);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(10, counted("map.doubled"));
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount - 1, found);
}

void test_a_marker_that_moved_is_told_on_a_frozen_map_too(void) {
  coded = true;
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  place[0][0] += 1.5;
  begin();
  drive(60);
  TEST_ASSERT_EQUAL_DOUBLE(1, counted("map.moved"));
  TEST_ASSERT_EQUAL_DOUBLE(kCount, counted("map.landmarks"));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
}

void test_half_a_minute_without_markers_is_said_and_mended(void) {
  coded = true;
  params.markers = 1;
  begin();
  drive(30);
  const double sure = sigma();
  hidden = true;
  drive(30);
  TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, published_state());
  TEST_ASSERT_GREATER_THAN_DOUBLE(2.0 * sure, sigma());
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0 * sigma(), off());
  hidden = false;
  drive(5);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

void test_a_landmark_that_moved_leaves_is_counted_and_joins_anew(void) {
  begin();
  drive(30);
  TEST_ASSERT_EQUAL_DOUBLE(0, counted("map.moved"));
  for (auto &p : place) {
    p[0] += 1.5;
    break;
  }
  drive(40);
  TEST_ASSERT_EQUAL_DOUBLE(1, counted("map.moved"));
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
}

void test_most_sightings_false_are_survived(void) {
  begin();
  drive(30);
  false_share = 0.6;
  drive(30);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
  TEST_ASSERT_GREATER_THAN(100, rejected);
}

void test_half_a_minute_without_landmarks_is_said_and_mended(void) {
  begin();
  drive(30);
  const double sure = sigma();
  hidden = true;
  drive(30);
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, e.state);
  TEST_ASSERT_GREATER_THAN_DOUBLE(2.0 * sure, sigma());
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0 * sigma(), off());
  hidden = false;
  drive(10);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

void test_a_misread_code_after_a_while_without_landmarks_waits_for_a_second_one(void) {
  begin();
  drive(30);
  hidden = true;
  drive(30);
  const double before = off();
  const double dx = place[0][0] - truth.x_m, dy = place[0][1] - truth.y_m;
  const double bearing = wm::wrap(wm::atan2(dy, dx) - truth.heading_rad), range = std::sqrt(dx * dx + dy * dy) - 0.2;
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see(make::sighting(now_s, 10, bearing + 0.15, range)));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, before, off());
  hidden = false;
  drive(10);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

void test_a_misread_code_does_not_keep_its_landmark_away(void) {
  begin();
  see(make::sighting(now_s, 10, 2.5, 1.0));  // the first that is seen of it
  drive(30);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_EQUAL_DOUBLE(0, counted("map.moved"));
}

void test_landmarks_that_are_never_seen_again_leave(void) {
  begin();
  drive(20);
  for (int i = 0; i < 30; i++) see(make::sighting(now_s, 1000 + i, 0.02 * i, 3.0));
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_LESS_OR_EQUAL(kCount, found);  // seen once is not a landmark yet
  const double joined = counted("map.landmarks");
  drive(20);
  TEST_ASSERT_EQUAL_DOUBLE(joined - 30, counted("map.landmarks"));
  TEST_ASSERT_GREATER_OR_EQUAL(30, counted("map.left"));
}

void test_a_full_map_goes_on_with_what_it_has(void) {
  params.landmark_capacity = 6;
  begin();
  drive(40);
  TEST_ASSERT_LESS_OR_EQUAL(6, counted("map.landmarks"));
  TEST_ASSERT_GREATER_THAN(0, counted("map.no_room"));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
}

void test_a_saved_map_frozen_or_extended_needs_no_first_lap(void) {
  for (int map : {WM_SLAM_MAP_FROZEN, WM_SLAM_MAP_EXTEND}) {
    make_room();
    params.map = map;
    setup.landmark_count = kCount / 2;
    setup.start.sigma_xy_m = 0.3;
    setup.start.sigma_heading_rad = 0.2;
    truth.x_m += 0.2;
    truth.heading_rad += 0.1;
    begin();
    drive(30);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
    TEST_ASSERT_EQUAL_DOUBLE(map == WM_SLAM_MAP_FROZEN ? kCount / 2 : kCount, counted("map.landmarks"));
    wm_landmark l[64];
    double covariance[64][4];
    slam->landmarks(state, l, covariance, 64);
    if (map == WM_SLAM_MAP_FROZEN) TEST_ASSERT_EQUAL_DOUBLE(known[0].p_m[0], l[0].p_m[0]);
  }
}

void test_started_lost_on_a_map_of_markers_it_finds_itself(void) {
  coded = true;
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = kAbsent;
  begin();
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, e.state);
  false_share = 0.3;  // wrong ones don't agree
  drive(3);
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
  false_share = 0.0;
  drive(3);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

// Standing at {2, 0} and looking along y: marker number `i` as it is seen from there, so much too far and turned too
// much.
wm_verdict see_from_start(int i, double far_m, double turned_rad) {
  const double ahead = place[i][1] - 0.2, left = 2.0 - place[i][0];
  const double distance = std::sqrt(ahead * ahead + left * left), share = (distance + far_m) / distance;
  wm_event seen = make::empty(now_s, WM_EVENT_MARKER);
  seen.as.marker = marker(10 + i, share * ahead, share * left, 0, wm::wrap(0.5 * i - wm::kHalfPi + turned_rad));
  seen.as.marker.yaw_sigma_rad = 0.15;
  return see(seen);
}

void start_lost_before_markers() {
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = kAbsent;
  begin();
  const wm_event e = make::twist(now_s, 0, 0);
  TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
}

// How small prints are turned is hardly seen, where they are is.
void test_started_lost_it_finds_itself_by_the_places_of_two_markers_whose_turns_disagree(void) {
  start_lost_before_markers();
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(1, 0, 0.2));
  TEST_ASSERT_EQUAL(WM_FUSED, see_from_start(3, 0, -0.2));
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

void test_started_lost_two_markers_are_not_believed_that_are_not_as_far_apart_as_on_the_map(void) {
  start_lost_before_markers();
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(1, 0, 0));
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(3, 0.6, 0));
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, e.state);
}

void test_a_map_with_nan_loses_those_landmarks_alone(void) {
  params.map = WM_SLAM_MAP_EXTEND;
  known[3].p_m[1] = kAbsent;
  known[5].sigma_m = kAbsent;
  begin();
  TEST_ASSERT_EQUAL_DOUBLE(kCount - 1, counted("map.landmarks"));
  drive(30);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_EQUAL_DOUBLE(kCount, counted("map.landmarks"));
}

// Lines from a row of poses to one place: found, with the true derivative by each pose.
void test_a_line_is_found_and_keeps_its_ties_to_every_pose(void) {
  const double want[2] = {4.0, 3.0};
  for (bool unscented : {false, true}) {
    wm::line_bundle b{};
    b.count = 5;
    for (int i = 0; i < b.count; i++) {
      b.pose[i] = {1 + 0.3 * i, 2.0 - 0.2 * i, 0.1 * i};
      b.azimuth_rad[i] = wm::wrap(wm::atan2(want[1] - b.pose[i].y_m, want[0] - b.pose[i].x_m) - b.pose[i].heading_rad);
      b.sigma_rad[i] = 0.002;
      for (int k = 0; k < 3; k++) b.pose_covariance[3 * i + k][3 * i + k] = 1e-6;
    }
    const wm::line_landmark l = wm::find_line(b, unscented);
    TEST_ASSERT_TRUE(l.solved);
    for (int k = 0; k < 2; k++) TEST_ASSERT_DOUBLE_WITHIN(0.01, want[k], l.place_m[k]);
    // All poses moved alike move the place alike; turned about the first, they turn it.
    for (int k = 0; k < 2; k++)
      for (int c = 0; c < 2; c++) {
        double sum = 0.0;
        for (int i = 0; i < b.count; i++) sum += l.by_pose[k][3 * i + c];
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, k == c ? 1.0 : 0.0, sum);
      }
    TEST_ASSERT_TRUE(l.noise[0][0] > 0.0 && l.noise[1][1] > 0.0);
    b.azimuth_rad[2] += 3.0;  // behind the pose
    TEST_ASSERT_FALSE(wm::find_line(b, unscented).solved);
  }
}

}  // namespace

void setUp(void) { make_room(); }
void tearDown(void) {
  std::free(state);
  state = nullptr;
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_landmarks_are_found_by_bearing_and_range);
  RUN_TEST(test_landmarks_are_found_by_bearings_alone_whatever_the_method);
  RUN_TEST(test_coded_markers_give_place_and_heading_at_once);
  RUN_TEST(test_absurd_markers_are_refused_and_change_nothing);
  RUN_TEST(test_of_two_poses_the_one_is_taken_that_fits_the_map);
  RUN_TEST(test_markers_with_two_poses_from_the_start_have_a_place_and_no_heading);
  RUN_TEST(test_landmarks_without_identity_are_told_apart);
  RUN_TEST(test_a_landmark_seen_twice_in_a_frame_without_identity_is_fused_once);
  RUN_TEST(test_the_same_identity_twice_in_a_frame_at_two_places_keeps_one);
  RUN_TEST(test_a_marker_seen_twice_in_a_picture_is_fused_once_and_told);
  RUN_TEST(test_two_markers_of_one_identity_are_told_and_left_alone);
  RUN_TEST(test_two_markers_of_one_identity_on_opposite_sides_spoil_nothing);
  RUN_TEST(test_a_marker_that_moved_is_told_on_a_frozen_map_too);
  RUN_TEST(test_half_a_minute_without_markers_is_said_and_mended);
  RUN_TEST(test_a_landmark_that_moved_leaves_is_counted_and_joins_anew);
  RUN_TEST(test_most_sightings_false_are_survived);
  RUN_TEST(test_half_a_minute_without_landmarks_is_said_and_mended);
  RUN_TEST(test_a_misread_code_after_a_while_without_landmarks_waits_for_a_second_one);
  RUN_TEST(test_a_misread_code_does_not_keep_its_landmark_away);
  RUN_TEST(test_landmarks_that_are_never_seen_again_leave);
  RUN_TEST(test_a_full_map_goes_on_with_what_it_has);
  RUN_TEST(test_a_saved_map_frozen_or_extended_needs_no_first_lap);
  RUN_TEST(test_started_lost_on_a_map_of_markers_it_finds_itself);
  RUN_TEST(test_started_lost_it_finds_itself_by_the_places_of_two_markers_whose_turns_disagree);
  RUN_TEST(test_started_lost_two_markers_are_not_believed_that_are_not_as_far_apart_as_on_the_map);
  RUN_TEST(test_a_map_with_nan_loses_those_landmarks_alone);
  RUN_TEST(test_a_line_is_found_and_keeps_its_ties_to_every_pose);
  return UNITY_END();
}
