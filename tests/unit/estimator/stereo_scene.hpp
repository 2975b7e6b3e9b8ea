// SPDX-License-Identifier: Apache-2.0
// A scene for tests of stereo_ekf through the contract: points on all sides of a vehicle, exact truth, every attitude.
#pragma once

#include <vector>

#include "common/suite.h"
#include "math/eigen.hpp"
#include "motion/motion_params.h"
#include "space_events.hpp"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

using namespace wm;

constexpr double kFocal = 420, kBaseline_m = 0.3, kCu = 320, kCv = 240;
const double kAbsent = std::nan("");

// A vehicle among points on all sides; its camera looks ahead.
struct scene {
  std::vector<char> motion, params;
  std::vector<wm_landmark> points;
  std::vector<wm_landmark> map;
  wm_rig rig;
  wm_sensor sensor;
  wm_sighting_params sightings;
  wm_setup setup;
  void *state = nullptr;
  size_t bytes = 0;
  const wm_estimator *ekf = wm_estimator_find("stereo_ekf");
  pose3 truth = {{0, 0, 0}, kNoTurn};
  vec3 start_of_step = {0, 0, 0};  // of the last swim()
  double t_s = 0;
  uint64_t draws = 0;
  double noise_v = 0.02, noise_w = 0.003;
  double log_scale = 1.0;  // of the measured velocity: what it has to be multiplied by
  vec3 gyro_bias = {0, 0, 0};

  explicit scene(int count = 400) {
    motion.resize(wm_motion_params_table.bytes);
    wm_params_defaults(&wm_motion_params_table, motion.data());
    wm_params_defaults(&wm_sighting_params_table, &sightings);
    params.resize(ekf->params.bytes);
    wm_params_defaults(&ekf->params, params.data());
    set("noise.pixel_px", 0.5);
    set("noise.v_mps", 0.02);
    set("noise.w_radps", 0.003);
    // What is exact here is no state; a test switches on what it examines.
    for (const char *off : {"states.rate_bias_sigma_radps", "states.velocity_scale_sigma", "states.rate_scale_sigma",
                            "states.twist_axes_sigma_rad", "states.velocity_direction_sigma_rad",
                            "states.time_offset_sigma_s", "states.range_bias_sigma_m", "increments.on", "slam.points",
                            "states.bearing_bias_sigma_rad", "states.camera_rotation_sigma_rad"})
      set(off, 0);
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
  // As the assembly chooses for a recording without any stream of motion.
  void without_motion() {
    const int32_t model = WM_MOTION_CONSTANT_VELOCITY;
    std::memcpy(&motion[offsetof(wm_motion_params, model)], &model, sizeof model);
  }
  void without_a_start() {
    setup.start = {WM_TIME_NONE, {kAbsent, kAbsent, kAbsent}, {kAbsent, kAbsent, kAbsent, kAbsent}, kAbsent, kAbsent,
                   kAbsent};
  }
  void begin() {
    setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
    setup.sightings = &sightings;
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
    say_twist(v, w);
    start_of_step = truth.p;
    truth.p = truth.p + matrix_of(truth.q) * (dt_s * (mean_turn(dt_s * w) * v));
    truth.q = normalized(truth.q * turn_by(dt_s * w));
    t_s += dt_s;
  }
  void say_twist(const vec3 &v, const vec3 &w) {
    if (reinterpret_cast<const wm_motion_params *>(motion.data())->model == WM_MOTION_CONSTANT_VELOCITY) return;
    const auto noisy = [this](const vec3 &x, double sigma) {
      const vec3 random = {noise(), noise(), noise()};
      return x + sigma * random;
    };
    tell(make::log6(t_s, noisy((1 / log_scale) * v, noise_v), noisy(w + gyro_bias, noise_w)));
  }
  // Motion, which must be taken.
  void tell(const wm_event &e) { TEST_ASSERT_EQUAL(WM_OK, ekf->predict(state, &e)); }
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
    e.as.stereo = {l.id, {px[0], px[1]}, {px[2], px[3]}, {}};
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
  // Normalised error squared of the place, over its three degrees.
  double nees() const {
    const wm_estimate at = estimate();
    vector<3> off, whole;
    matrix<3> p, root;
    for (int i = 0; i < 3; i++) {
      off(i) = whole(i) = truth.p[i] - at.pose_map_base.p_m[i];
      for (int j = 0; j < 3; j++) p(i, j) = at.covariance[wm_cov_index(i, j)];
    }
    TEST_ASSERT_TRUE(cholesky<3>(p, &root));
    substitute<3>(root, &whole);
    return off.dot(whole) / 3;
  }
  // NaN: not listed.
  wm_calibration_value calibrated(const char *name) const {
    wm_calibration_value values[64];
    const size_t count = ekf->calibration(state, values, 64);
    for (size_t i = 0; i < count; i++)
      if (std::strcmp(values[i].name, name) == 0) return values[i];
    wm_calibration_value none{};
    none.value = none.sigma = kAbsent;
    return none;
  }
  std::vector<char> copy() const { return {static_cast<char *>(state), static_cast<char *>(state) + bytes}; }
  // A point that the pair sees now, the last of them.
  const wm_landmark &in_view() const {
    const wm_landmark *shown = nullptr;
    double px[4];
    for (const wm_landmark &l : points)
      if (pixels(l, px)) shown = &l;
    TEST_ASSERT_NOT_NULL(shown);
    return *shown;
  }
  double place_error() const { return length(vec_of(estimate().pose_map_base.p_m) - truth.p); }
  double turn_error() const { return length(turn_of(conjugate(quat_of(estimate().pose_map_base.q_xyzw)) * truth.q)); }
};

inline void assert_sound(const wm_estimate &e) {
  const double *q = e.pose_map_base.q_xyzw;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  double p[6][6];
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) {
      p[i][j] = e.covariance[wm_cov_index(i, j)];
      const double mirrored = e.covariance[wm_cov_index(j, i)];
      TEST_ASSERT_EQUAL_MEMORY(&mirrored, &p[i][j], sizeof mirrored);
    }
  matrix<6> root;
  TEST_ASSERT_TRUE_MESSAGE(cholesky<6>(map(p), &root), "the covariance is not positive");
}

}  // namespace
