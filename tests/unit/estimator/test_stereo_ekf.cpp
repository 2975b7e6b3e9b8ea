// SPDX-License-Identifier: Apache-2.0
// stereo_ekf through the contract: a made scene, exact truth, every attitude.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "events.hpp"
#include "filters/stereo_ekf/consensus.hpp"
#include "math/rotation.hpp"
#include "unity.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

using namespace wm;

namespace {

constexpr double kFocal = 420, kBaseline_m = 0.3, kCu = 320, kCv = 240;
const double kAbsent = std::nan("");

// A vehicle among points on all sides; its camera looks ahead.
struct scene {
  std::vector<char> motion, params;
  std::vector<wm_landmark> points;
  std::vector<wm_landmark> map;
  wm_rig rig;
  wm_sensor sensor;
  wm_setup setup;
  void *state = nullptr;
  size_t bytes = 0;
  const wm_estimator *ekf = wm_estimator_find("stereo_ekf");
  placed truth = {{0, 0, 0}, kNoTurn};
  double t_s = 0;
  uint64_t draws = 0;
  double noise_v = 0.02, noise_w = 0.003;

  explicit scene(int count = 400) {
    motion.resize(wm_motion_params_table.bytes);
    wm_params_defaults(&wm_motion_params_table, motion.data());
    params.resize(ekf->params.bytes);
    wm_params_defaults(&ekf->params, params.data());
    set("noise.pixel_px", 0.5);
    set("noise.v_mps", 0.02);
    set("noise.w_radps", 0.003);
    for (int i = 0; i < count; i++) {
      const auto draw = [i](uint64_t k) { return wm_random_normal(11, k, static_cast<uint64_t>(i)); };
      const vec3 direction = {draw(0), draw(1), draw(2)};
      const double far = 2.5 + 2.0 * wm_random_uniform(11, 9, static_cast<uint64_t>(i));
      const vec3 p = (far / length(direction)) * direction;
      points.push_back({i + 1, {p.x, p.y, p.z}, 0.001, kAbsent, {}, 0});
    }
    map = points;
    wm_rig_init(&rig);
    rig.camera_count = 2;
    rig.cameras[0].width_px = rig.cameras[1].width_px = 640;
    rig.cameras[0].height_px = rig.cameras[1].height_px = 480;
    rig.stereo = {0, 1, kBaseline_m, {kFocal, kFocal, kCu, kCv}, {0.5, 0.5, 0.5, 0.5}};
    sensor = {};
    std::strcpy(sensor.name, "acoustic");
    sensor.bearing_sigma_rad = kAbsent;
    sensor.range_sigma_m = 0.05;
    sensor.max_range_m = 1000;
    setup = {};
    setup.wheels = {kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, 0, {}, {}};
    setup.start = {WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0, 0.01, 0.01};
    setup.seed = 1;
  }
  ~scene() { free(state); }
  scene(const scene &) = delete;
  scene &operator=(const scene &) = delete;

  void set(const char *key, double value) {
    for (size_t i = 0; i < ekf->params.count; i++) {
      const wm_param &p = ekf->params.params[i];
      if (std::strcmp(p.key, key) != 0) continue;
      const auto whole = static_cast<int32_t>(value);
      if (p.type == WM_PARAM_F64)
        std::memcpy(&params[p.offset], &value, sizeof value);
      else
        std::memcpy(&params[p.offset], &whole, sizeof whole);
      return;
    }
    TEST_FAIL_MESSAGE(key);
  }
  void begin() {
    setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
    setup.sensors = &sensor;
    setup.sensor_count = 1;
    setup.landmarks = map.data();
    setup.landmark_count = map.size();
    setup.rig = &rig;
    const char *why = "";
    bytes = ekf->state_bytes(params.data(), &setup, &why);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
    state = aligned_alloc(16, (bytes + 15) / 16 * 16);
    TEST_ASSERT_EQUAL(WM_OK, ekf->init(state, params.data(), &setup));
  }

  double noise() { return wm_random_normal(12, 1, draws++); }
  wm_status take(const wm_event &e, wm_innovation *records = nullptr) {
    wm_innovation own[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t count = 0;
    return ekf->correct(state, &e, records ? records : own, WM_INNOVATIONS_PER_EVENT_MAX, &count);
  }
  // Truth and filter go on by dt with a twist that holds.
  void swim(double dt_s, const vec3 &v, const vec3 &w) {
    wm_event e = make::empty(t_s, WM_EVENT_TWIST6);
    for (int i = 0; i < 3; i++) {
      e.as.twist6.v_mps[i] = v[i] + noise_v * noise();
      e.as.twist6.w_radps[i] = w[i] + noise_w * noise();
    }
    TEST_ASSERT_EQUAL(WM_OK, ekf->predict(state, &e));
    truth.p = truth.p + matrix_of(truth.q) * (dt_s * (mean_turn(dt_s * w) * v));
    truth.q = normalized(truth.q * turn_by(dt_s * w));
    t_s += dt_s;
  }
  bool pixels(const wm_landmark &l, double px[4]) const {
    const vec3 b = transposed_times(matrix_of(truth.q), vec_of(l.p_m) - truth.p);
    const vec3 x = {-b.y, -b.z, b.x};
    if (x.z < 0.5) return false;
    for (int side = 0; side < 2; side++) {
      px[2 * side] = kCu + kFocal * (x.x - side * kBaseline_m) / x.z;
      px[2 * side + 1] = kCv + kFocal * x.y / x.z;
      if (px[2 * side] < 0 || px[2 * side] > 639 || px[2 * side + 1] < 0 || px[2 * side + 1] > 479) return false;
    }
    return true;
  }
  wm_event seen(const wm_landmark &l, const double px[4]) const {
    wm_event e = make::empty(t_s, WM_EVENT_STEREO);
    e.as.stereo = {l.id, {px[0], px[1]}, {px[2], px[3]}};
    return e;
  }
  // What the pair sees now; returns how many points.
  int look() {
    int count = 0;
    for (const wm_landmark &l : points) {
      double px[4];
      if (!pixels(l, px)) continue;
      for (double &value : px) value += 0.5 * noise();
      TEST_ASSERT_EQUAL(WM_OK, take(seen(l, px)));
      count++;
    }
    return count;
  }
  wm_estimate estimate() const {
    wm_estimate e;
    ekf->estimate(state, &e);
    return e;
  }
  double place_error() const { return length(vec_of(estimate().pose_map_base.p_m) - truth.p); }
  double turn_error() const { return length(turn_of(conjugate(quat_of(estimate().pose_map_base.q_xyzw)) * truth.q)); }
};

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

void assert_sound(const wm_estimate &e) {
  const double *q = e.pose_map_base.q_xyzw;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  double p[6][6], inverse[6][6];
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) {
      p[i][j] = e.covariance[wm_cov_index(i, j)];
      const double mirrored = e.covariance[wm_cov_index(j, i)];
      TEST_ASSERT_EQUAL_MEMORY(&mirrored, &p[i][j], sizeof mirrored);
    }
  TEST_ASSERT_TRUE_MESSAGE(invert6(p, inverse), "the covariance is not positive");
}

}  // namespace

void setUp(void) {}
void tearDown(void) {}

void test_a_start_that_is_wrong_by_20_m_or_unknown_is_found(void) {
  for (int kind = 0; kind < 3; kind++) {
    scene s;
    s.setup.start.p_m[0] = 12;
    s.setup.start.p_m[1] = -16;
    if (kind == 1) s.setup.start.sigma_xy_m = 20;  // honest about it
    if (kind == 2)                                 // nothing known at all
      s.setup.start = {
          WM_TIME_NONE, {kAbsent, kAbsent, kAbsent}, {kAbsent, kAbsent, kAbsent, kAbsent}, kAbsent, kAbsent, kAbsent};
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
void test_no_attitude_is_singular(void) {
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

void test_a_day_without_drift_of_norm_or_symmetry(void) {
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

void test_points_leave_when_unseen_and_are_found_again(void) {
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
void test_a_point_begun_by_a_wrong_match_begins_again(void) {
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
void test_a_point_that_does_not_fit_any_more_leaves(void) {
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
void test_pictures_that_are_late(void) {
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
    const placed now = s.truth;
    double here[4], earlier[4];
    const wm_landmark *shown = nullptr;
    for (const wm_landmark &l : s.points)
      if (s.pixels(l, here)) shown = &l;
    TEST_ASSERT_NOT_NULL(shown);
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
      std::vector<char> copy(static_cast<char *>(s.state), static_cast<char *>(s.state) + s.bytes);
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
      const placed now = s.truth;
      s.truth.p = now.p - matrix_of(now.q) * (late_s * (mean_turn(-late_s * w) * v));
      s.truth.q = normalized(now.q * turn_by(-late_s * w));
      s.look();
      s.truth = now;
    }
    wm_calibration_value offset;
    TEST_ASSERT_EQUAL(1, s.ekf->calibration(s.state, &offset, 1));
    TEST_ASSERT_EQUAL_STRING("stereo.time_offset_s", offset.name);
    out.mean_s += offset.value / drives;
    out.mean_error_s += (offset.value - late_s) / drives;
    out.nees += square((offset.value - late_s) / offset.sigma) / drives;
  }
  return out;
}

// A twist that swings tells when the pictures were taken, to a millisecond. One that is even does not: a lag is a pose
// that is off. Then the offset must stay what was known of it.
void test_the_time_of_pictures_is_told_by_a_twist_that_swings_alone(void) {
  for (const double late_s : {0.0, 0.02, -0.02}) {
    const offset_found swinging = find_offset(late_s, 0.3);
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.0, swinging.mean_error_s);
    TEST_ASSERT_LESS_THAN_DOUBLE(2.0, swinging.nees);
    const offset_found even = find_offset(late_s, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0, even.mean_s);
    TEST_ASSERT_LESS_THAN_DOUBLE(2.0, even.nees);
  }
}

void test_a_wrong_match_is_refused_and_one_picture_is_enough(void) {
  scene s;
  s.begin();
  for (int i = 0; i < 5; i++) {
    s.look();
    s.swim(0.1, {0.1, 0, 0}, {0, 0, 0.1});
  }
  s.look();
  double px[4];
  const wm_landmark *shown = nullptr;
  for (const wm_landmark &l : s.points)
    if (s.pixels(l, px)) shown = &l;
  TEST_ASSERT_NOT_NULL(shown);
  s.pixels(*shown, px);
  const wm_estimate before = s.estimate();
  wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
  px[3] += 15;  // the rows disagree
  wm_event e = s.seen(*shown, px);
  s.take(e, records);
  for (int k = 0; k < 4; k++) TEST_ASSERT_EQUAL(WM_REJECTED_GATE, records[k].verdict);
  TEST_ASSERT_EQUAL_MEMORY(
      &before,
      [&] {
        static wm_estimate after;
        after = s.estimate();
        return &after;
      }(),
      sizeof before);
  s.pixels(*shown, px);
  e = s.seen(*shown, px);
  e.as.stereo.right_px[0] = e.as.stereo.right_px[1] = kAbsent;
  TEST_ASSERT_EQUAL(WM_OK, s.take(e, records));
  TEST_ASSERT_EQUAL(WM_FUSED, records[1].verdict);
  TEST_ASSERT_LESS_THAN_DOUBLE(before.covariance[7], s.estimate().covariance[7]);
}

void test_ranges_depth_and_heading_are_rows_too(void) {
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
    wm_event e = make::empty(s.t_s, WM_EVENT_SIGHTING);
    const wm_landmark &l = s.map[static_cast<size_t>(i % 3)];
    e.as.sighting = {0,       l.id,    kAbsent, length(vec_of(l.p_m) - s.truth.p) + 0.05 * s.noise(),
                     kAbsent, kAbsent, kAbsent, kAbsent};
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

void test_nonsense_in_pixels_is_refused(void) {
  scene s;
  s.set("slam.points", 10);
  s.begin();
  s.look();
  s.swim(0.1, {0, 0, 0}, {0, 0, 0});
  std::vector<char> before(static_cast<char *>(s.state), static_cast<char *>(s.state) + s.bytes);
  const double bad[][4] = {{kAbsent, kAbsent, kAbsent, kAbsent},
                           {kAbsent, 1, 2, 3},
                           {1, 2, 3, kAbsent},
                           {HUGE_VAL, 1, 2, 3},
                           {1, 2, 1e9, 3}};
  for (const auto &px : bad) {
    const wm_event e = s.seen(s.points[0], px);
    TEST_ASSERT_EQUAL(px[2] == 1e9 ? WM_OUT_OF_RANGE : WM_NOT_FINITE, s.take(e));
    TEST_ASSERT_EQUAL_MEMORY(before.data(), s.state, s.bytes);
  }
  wm_event e = s.seen(s.points[0], bad[4]);
  e.as.stereo.right_px[0] = 2;
  e.as.stereo.id = -1;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, s.take(e));
  TEST_ASSERT_EQUAL_MEMORY(before.data(), s.state, s.bytes);
}

void test_a_copy_with_points_goes_on_alike(void) {
  scene s;
  s.set("slam.points", 60);
  s.map.resize(200);
  s.begin();
  for (int i = 0; i < 10; i++) {
    s.look();
    s.swim(0.1, {0.2, 0, 0}, {0, 0, 0.4});
  }
  void *copy = aligned_alloc(16, (s.bytes + 15) / 16 * 16);
  std::memcpy(copy, s.state, s.bytes);
  wm_event e = make::empty(s.t_s, WM_EVENT_TWIST6);
  double px[4];
  for (void *state : {s.state, copy}) {
    TEST_ASSERT_EQUAL(WM_OK, s.ekf->predict(state, &e));
    for (const wm_landmark &l : s.points) {
      if (!s.pixels(l, px)) continue;
      wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      const wm_event point = s.seen(l, px);
      TEST_ASSERT_EQUAL(WM_OK, s.ekf->correct(state, &point, records, WM_INNOVATIONS_PER_EVENT_MAX, &count));
    }
  }
  TEST_ASSERT_EQUAL_MEMORY(s.state, copy, s.bytes);
  free(copy);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_a_start_that_is_wrong_by_20_m_or_unknown_is_found);
  RUN_TEST(test_no_attitude_is_singular);
  RUN_TEST(test_a_day_without_drift_of_norm_or_symmetry);
  RUN_TEST(test_points_leave_when_unseen_and_are_found_again);
  RUN_TEST(test_a_point_begun_by_a_wrong_match_begins_again);
  RUN_TEST(test_a_point_that_does_not_fit_any_more_leaves);
  RUN_TEST(test_pictures_that_are_late);
  RUN_TEST(test_the_time_of_pictures_is_told_by_a_twist_that_swings_alone);
  RUN_TEST(test_a_wrong_match_is_refused_and_one_picture_is_enough);
  RUN_TEST(test_ranges_depth_and_heading_are_rows_too);
  RUN_TEST(test_nonsense_in_pixels_is_refused);
  RUN_TEST(test_a_copy_with_points_goes_on_alike);
  return UNITY_END();
}
