// SPDX-License-Identifier: Apache-2.0
// stereo_ekf through the contract: a made scene, exact truth, every attitude.
#include <algorithm>
#include <memory>
#include <vector>

#include "filters/stereo_ekf/params.h"
#include "stereo_scene.hpp"

using namespace wm;

namespace {

// Where the filter has a point; NaN where it doesn't have it.
vec3 place_of(const scene &s, int32_t id) {
  std::vector<wm_landmark> listed(256);
  listed.resize(s.ekf->landmarks(s.state, listed.data(), nullptr, listed.size()));
  for (const wm_landmark &l : listed)
    if (l.id == id) return vec_of(l.p_m);
  return {kAbsent, kAbsent, kAbsent};
}

// A point in view, far enough from the right picture's left edge to be matched wrongly there.
wm_landmark one_to_mistake(const scene &s) {
  double px[4];
  for (const wm_landmark &l : s.points)
    if (s.pixels(l, px) && px[2] > 300 && px[0] < 560) return l;
  TEST_FAIL_MESSAGE("no such point");
  return {};
}

void begin_slam(scene *s) {
  s->set("slam.points", 100);
  s->set("slam.keep_unseen_steps", 3);
  s->set("slam.keep_outside_s", 1000);
  s->map.clear();
  s->begin();
}

}  // namespace

TEST(test_a_start_that_is_wrong_by_20_m_or_unknown_is_found) {
  for (int kind = 0; kind < 3; kind++) {
    scene s;
    s.setup.start.p_m[0] = 12;
    s.setup.start.p_m[1] = -16;
    if (kind == 1) s.setup.start.sigma_xy_m = 20;  // honest about it
    if (kind == 2) s.without_a_start();
    s.truth = {{0.3, -0.2, 0.1}, turn_by({0.4, kind == 2 ? -2.5 : 0.1, 0.3})};
    s.begin();
    TEST_ASSERT_EQUAL(kind == 0 ? WM_STATE_DEAD_RECKONING : WM_STATE_SEARCHING, s.estimate().state);
    for (int i = 0; i < 20; i++) {
      s.swim(0.1, {0.1, 0, 0}, {0, 0.1, 0.1});
      s.look();
    }
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, s.estimate().state);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.01, s.place_error());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.005, s.turn_error());
    TEST_ASSERT_GREATER_THAN_UINT32(1, s.estimate().resets);
  }
}

// Full rolls, loops over the nose, upside down: about each axis and about odd ones.
TEST(test_no_attitude_is_singular) {
  const vec3 turns[] = {{1.5, 0, 0}, {0, 1.5, 0}, {0, 0, 1.5}, {0.9, -0.7, 0.5}};
  for (const vec3 &w : turns)
    for (const double known : {1.0, 0.0}) {
      scene s;
      s.set("slam.points", known > 0 ? 0 : 100);
      if (known == 0.0) s.map.clear();
      s.begin();
      for (int i = 0; i < 100; i++) {
        if (i % 5 == 0) {
          TEST_ASSERT_GREATER_THAN(3, s.look());
          TEST_ASSERT_LESS_THAN_DOUBLE(0.03, s.place_error());
          TEST_ASSERT_LESS_THAN_DOUBLE(0.03, s.turn_error());
        }
        s.swim(0.05, {0.1, 0.05, 0.02}, w);
        assert_sound(s.estimate());
      }
    }
}

TEST(test_a_day_without_drift_of_norm_or_symmetry) {
  scene s(60);
  s.set("slam.points", 20);
  s.map.resize(30);
  s.begin();
  for (int i = 0; i < 432000; i++) {  // 24 hours at 5 Hz
    const double a = 0.2 * i;
    s.swim(0.2, {0.2 * std::cos(0.01 * a), 0, 0}, {0.3, 0.2 * std::sin(0.003 * a), 0.4});
    if (i % 400 == 0) s.truth.p = {0, 0, 0};  // it drifts in still water; only the filter's soundness is judged
    if (i % 50 == 0) s.look();
    if (i % 1000 == 0) assert_sound(s.estimate());
  }
}

TEST(test_points_leave_when_unseen_and_are_found_again) {
  scene s;
  s.set("slam.points", 100);
  s.set("slam.keep_unseen_steps", 3);
  s.set("slam.keep_outside_s", 5);
  s.set("gate.soft", 20);  // so that no point is refused by the noise of its rows
  s.map.clear();
  s.begin();
  const int seen = s.look();
  s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  const auto count = [&] { return static_cast<int>(s.ekf->landmarks(s.state, nullptr, nullptr, 0)); };
  TEST_ASSERT_EQUAL(seen, count());
  // One of them is not seen any more although it should be: three pictures of grace.
  std::vector<wm_landmark> all = s.points;
  const int32_t gone = [&] {
    wm_landmark first;
    s.ekf->landmarks(s.state, &first, nullptr, 1);
    return first.id;
  }();
  std::erase_if(s.points, [gone](const wm_landmark &l) { return l.id == gone; });
  for (int i = 0; i < 6; i++) {
    TEST_ASSERT_EQUAL(i < 5 ? seen : seen - 1, count());  // a picture ends when time goes on
    s.look();
    s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  }
  s.points = all;
  // Turned away for less than 5 s they stay, and coming back adds no new ones; for longer they go.
  for (int i = 0; i < 8; i++) s.swim(0.1, {0, 0, 0}, {0, 0, 3.9});
  s.points.clear();
  s.look();
  wm_event looked = make::empty(s.t_s, WM_EVENT_LOOKED);
  TEST_ASSERT_EQUAL(WM_OK, s.take(looked));
  s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  TEST_ASSERT_EQUAL(seen - 1, count());
  for (int i = 0; i < 60; i++) {
    s.swim(0.1, {0, 0, 0}, {0, 0, 0});
    looked = make::empty(s.t_s, WM_EVENT_LOOKED);
    TEST_ASSERT_EQUAL(WM_OK, s.take(looked));
  }
  s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  TEST_ASSERT_EQUAL(0, count());
}

// A point begun by a wrong match stands anywhere, and all that is seen of it does not fit. It must not keep its number
// only because the wrong place is out of view.
TEST(test_a_point_begun_by_a_wrong_match_begins_again) {
  scene s;
  begin_slam(&s);
  const wm_landmark point = one_to_mistake(s);
  const auto others = [&](const wm_landmark &l) { return l.id != point.id; };
  double px[4];
  s.pixels(point, px);
  px[0] += 1.0;
  px[2] -= 250;  // something else's
  const std::vector<wm_landmark> all = s.points;
  std::erase_if(s.points, [&](const wm_landmark &l) { return !others(l); });
  s.look();
  s.points = all;
  TEST_ASSERT_EQUAL(WM_OK, s.take(s.seen(point, px)));
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, length(place_of(s, point.id) - vec_of(point.p_m)));
  s.swim(0.1, {0.1, 0, 0}, {0, 0, 0});
  s.look();
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, length(place_of(s, point.id) - vec_of(point.p_m)));
}

// What several pictures agree about is not given up for one that doesn't; for more than keep_unseen_steps it is, be the
// place where it was thought in view or not.
TEST(test_a_point_that_does_not_fit_any_more_leaves) {
  scene s;
  begin_slam(&s);
  wm_landmark point = one_to_mistake(s);
  for (int i = 0; i < 5; i++) {
    s.look();
    s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  }
  for (int i = 0; i < 10; i++) s.swim(0.1, {0, 0, 0}, {0, 0, 1.5});
  const vec3 before = place_of(s, point.id);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, length(before - vec_of(point.p_m)));
  double px[4];
  TEST_ASSERT_FALSE(s.pixels(point, px));
  const vec3 there = s.truth.p + matrix_of(s.truth.q) * vec3{3.0, 0.2, 0.1};  // it has been carried into view
  for (int i = 0; i < 3; i++) point.p_m[i] = there[i];
  std::erase_if(s.points, [&](const wm_landmark &l) { return l.id == point.id; });
  s.points.push_back(point);
  for (int i = 0; i < 6; i++) {
    const double off = length(place_of(s, point.id) - there);
    if (i < 4) TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, off);
    if (i == 5) TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off);
    s.look();
    s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  }
}

// With everything else known exactly, a row's variance is the square of its derivative by the pictures' time offset:
// against pixels of the pose a little earlier. Then pictures that are late are found to be.
TEST(test_pictures_that_are_late) {
  const double sigma_s = 0.02;
  const vec3 twists[][2] = {{{0.5, 0, 0}, {0, 0, 0}},
                            {{0, 0.5, 0}, {0, 0, 0}},
                            {{0, 0, 0.5}, {0, 0, 0}},
                            {{0, 0, 0}, {0.4, 0, 0}},
                            {{0, 0, 0}, {0, 0.4, 0}},
                            {{0, 0, 0}, {0, 0, 0.4}},
                            {{0.4, 0.1, -0.2}, {0.3, -0.2, 0.4}}};
  for (const auto &[v, w] : twists) {
    scene s;
    s.set("states.time_offset_sigma_s", sigma_s);
    s.set("noise.pixel_px", 0.001);
    s.set("noise.v_mps", 1e-7);
    s.set("noise.w_radps", 1e-7);
    s.noise_v = s.noise_w = 0;
    for (wm_landmark &l : s.map) l.sigma_m = 1e-7;
    s.setup.start.sigma_xy_m = s.setup.start.sigma_heading_rad = 1e-7;
    s.begin();
    for (int i = 0; i < 40; i++) {
      s.swim(0.1, v, w);
      TEST_ASSERT_EQUAL(WM_OK, s.take(make::empty(s.t_s, WM_EVENT_LOOKED)));
    }
    const pose3 now = s.truth;
    double here[4], earlier[4];
    const wm_landmark *shown = &s.in_view();
    s.pixels(*shown, here);
    const double step_s = 1e-5;
    s.truth.p = now.p - matrix_of(now.q) * (step_s * v);
    s.truth.q = normalized(now.q * turn_by(-step_s * w));
    s.pixels(*shown, earlier);
    s.truth = now;
    for (const int only : {0, 2}) {  // of the left picture, then of the right one: the first row of each
      const bool left = only == 0;
      double px[4] = {left ? here[0] : kAbsent, left ? here[1] : kAbsent, left ? kAbsent : here[2],
                      left ? kAbsent : here[3]};
      const std::vector<char> copy = s.copy();
      wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
      TEST_ASSERT_EQUAL(WM_OK, s.take(s.seen(*shown, px), records));
      const double slope = (earlier[only] - here[only]) / step_s;
      TEST_ASSERT_DOUBLE_WITHIN(0.01 * std::fabs(slope) * sigma_s + 0.01, std::fabs(slope) * sigma_s,
                                std::sqrt(records[0].variance));
      std::memcpy(s.state, copy.data(), s.bytes);
    }
  }
}

struct offset_found {
  double mean_s, mean_error_s, nees;
};

// Eight drives whose pictures are `late_s` older than their stamps, with gyros of some noise; the twist swings so far.
offset_found find_offset(double late_s, double swing_radps) {
  offset_found out = {0, 0, 0};
  const int drives = 8;
  for (int drive = 0; drive < drives; drive++) {
    scene s;
    s.draws = static_cast<uint64_t>(drive) << 32;
    s.set("states.time_offset_sigma_s", 0.02);
    s.set("noise.w_radps", 0.005);
    s.noise_w = 0.005;
    s.begin();
    for (int i = 0; i < 500; i++) {
      const vec3 v = {0.1, 0, 0};
      const vec3 w = {0.1 + swing_radps * std::cos(0.014 * i), 0, 0.2 + swing_radps * std::sin(0.02 * i)};
      s.swim(0.02, v, w);
      if (i % 5 != 4) continue;
      const pose3 now = s.truth;
      s.truth.p = now.p - matrix_of(now.q) * (late_s * (mean_turn(-late_s * w) * v));
      s.truth.q = normalized(now.q * turn_by(-late_s * w));
      s.look();
      s.truth = now;
    }
    const wm_calibration_value offset = s.calibrated("stereo.time_offset_s");
    out.mean_s += offset.value / drives;
    out.mean_error_s += (offset.value - late_s) / drives;
    out.nees += square((offset.value - late_s) / offset.sigma) / drives;
  }
  return out;
}

// A twist that swings tells when the pictures were taken, to a millisecond. One that is even does not: a lag is a pose
// that is off. Then the offset must stay what was known of it.
TEST(test_the_time_of_pictures_is_told_by_a_twist_that_swings_alone) {
  for (const double late_s : {0.0, 0.02, -0.02}) {
    const offset_found swinging = find_offset(late_s, 0.3);
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.0, swinging.mean_error_s);
    TEST_ASSERT_LESS_THAN_DOUBLE(2.0, swinging.nees);
    const offset_found even = find_offset(late_s, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0, even.mean_s);
    TEST_ASSERT_LESS_THAN_DOUBLE(2.0, even.nees);
  }
}

// A log that reads too little and gyros with a bias are calibrated whether the twist is an input or an observation.
TEST(test_scale_and_bias_of_the_twist_are_found_in_both_predictions) {
  for (const int prediction : {WM_PREDICT_TWIST, WM_PREDICT_CONSTANT_VELOCITY}) {
    scene s;
    s.set("prediction", prediction);
    s.set("states.velocity_scale_sigma", 0.1);
    s.set("states.rate_bias_sigma_radps", 0.05);
    s.log_scale = 1.08;
    s.gyro_bias = {0.01, -0.02, 0.03};
    s.begin();
    for (int i = 0; i < 400; i++) {
      const double side = i / 20 % 2 ? -1.0 : 1.0;
      s.swim(0.05, {0.5 * side, 0.1 * side, 0}, {0.1 * side, 0, 0.3});
      s.look();
    }
    const std::pair<const char *, double> truth[] = {{"motion.velocity_scale", s.log_scale},
                                                     {"motion.rate_bias_x_radps", s.gyro_bias.x},
                                                     {"motion.rate_bias_y_radps", s.gyro_bias.y},
                                                     {"motion.rate_bias_z_radps", s.gyro_bias.z}};
    for (const auto &[name, value] : truth) {
      const wm_calibration_value got = s.calibrated(name);
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.5 * got.sigma, value, got.value, name);
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(std::strstr(name, "scale") ? 0.03 : 0.005, got.sigma, name);
    }
  }
}

TEST(test_ranges_depth_and_heading_are_rows_too) {
  scene s;
  s.map = {{1, {10, 0, -2}, 0.001, kAbsent, {}, 0},
           {2, {-3, 9, 1}, 0.001, kAbsent, {}, 0},
           {3, {-4, -8, 4}, 0.001, kAbsent, {}, 0}};
  s.setup.start.sigma_xy_m = 1;
  s.setup.start.sigma_heading_rad = 0.1;
  s.truth = {{0.6, -0.7, 0.5}, turn_by({0, 0, 0.08})};
  s.begin();
  for (int i = 0; i < 100; i++) {
    s.swim(0.1, {0.3, 0, 0}, {0, 0, 0.3});
    const wm_landmark &l = s.map[static_cast<size_t>(i % 3)];
    wm_event e = make::sighting(s.t_s, l.id, kAbsent, length(vec_of(l.p_m) - s.truth.p) + 0.05 * s.noise());
    TEST_ASSERT_EQUAL(WM_OK, s.take(e));
    e = make::empty(s.t_s, WM_EVENT_POSITION);
    e.as.position = {{kAbsent, kAbsent, s.truth.p.z + 0.02 * s.noise()}, kAbsent, 0.02};
    TEST_ASSERT_EQUAL(WM_OK, s.take(e));
    const mat3 R = matrix_of(s.truth.q);
    TEST_ASSERT_EQUAL(WM_OK, s.take(make::heading(s.t_s, std::atan2(R.m[1][0], R.m[0][0]) + 0.02 * s.noise(), 0.02)));
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, s.place_error());
  const mat3 R = matrix_of(s.truth.q);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.0,
                            std::remainder(s.estimate().heading_rad - std::atan2(R.m[1][0], R.m[0][0]), kTwoPi));
  // The nose points up: a heading says nothing, and is told so.
  wm_event up = make::empty(s.t_s, WM_EVENT_SET_POSE);
  const quat q = turn_by({0, -kHalfPi, 0});
  up.as.set_pose = {{{0, 0, 0}, {q.v.x, q.v.y, q.v.z, q.w}}, 0.1, 0.1};
  TEST_ASSERT_EQUAL(WM_OK, s.take(up));
  wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
  TEST_ASSERT_EQUAL(WM_OK, s.take(make::heading(s.t_s, 1.0, 0.02), records));
  TEST_ASSERT_EQUAL(WM_REJECTED_SINGULAR, records[0].verdict);
}

// A vehicle without cameras among four anchors, each 10 cm off on the map: the ranges' errors go on alike.
TEST(test_a_beacons_error_on_the_map_is_not_averaged_away) {
  scene s;
  s.set("slam.points", 250);
  s.rig.stereo.left = s.rig.stereo.right = -1;
  s.points.clear();
  s.map.clear();
  for (int i = 0; i < 4; i++) {
    const vec3 p = {12 * std::cos(1.6 * i), 12 * std::sin(1.6 * i), i % 2 ? 4.0 : -1.0};
    s.points.push_back({i + 1, {p.x, p.y, p.z}, 0.1, kAbsent, {}, 0});
    s.map.push_back(
        {i + 1, {p.x + 0.1 * s.noise(), p.y + 0.1 * s.noise(), p.z + 0.1 * s.noise()}, 0.1, kAbsent, {}, 0});
  }
  s.setup.start.sigma_xy_m = 1;
  s.begin();
  double worst = 0;
  for (int i = 0; i < 600; i++) {
    s.swim(0.1, {0.5, 0, 0}, {0, 0, 0.2});
    const wm_landmark &at = s.points[static_cast<size_t>(i % 4)];
    const double range_m = length(vec_of(at.p_m) - s.truth.p) + 0.05 * s.noise();
    TEST_ASSERT_EQUAL(WM_OK, s.take(make::sighting(s.t_s, at.id, kAbsent, range_m)));
    if (i < 100) continue;
    const wm_estimate e = s.estimate();
    const double off_m = std::hypot(e.pose_map_base.p_m[0] - s.truth.p.x, e.pose_map_base.p_m[1] - s.truth.p.y);
    worst = std::max(worst, off_m / std::sqrt(e.covariance[0] + e.covariance[7]));
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(2.5, worst);
}

TEST(test_a_copy_with_points_goes_on_alike) {
  scene s;
  s.set("slam.points", 60);
  s.map.resize(200);
  s.begin();
  for (int i = 0; i < 10; i++) {
    s.look();
    s.swim(0.1, {0.2, 0, 0}, {0, 0, 0.4});
  }
  const std::unique_ptr<void, void (*)(void *)> copy(aligned_alloc(16, (s.bytes + 15) / 16 * 16), free);
  std::memcpy(copy.get(), s.state, s.bytes);
  void *const first = s.state;
  for (void *state : {first, copy.get()}) {
    s.state = state;
    s.tell(make::log6(s.t_s, {0, 0, 0}));
    double px[4];
    for (const wm_landmark &l : s.points)
      if (s.pixels(l, px)) TEST_ASSERT_EQUAL(WM_OK, s.take(s.seen(l, px)));
  }
  s.state = first;
  TEST_ASSERT_EQUAL_MEMORY(s.state, copy.get(), s.bytes);
}
