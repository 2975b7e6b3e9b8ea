// SPDX-License-Identifier: Apache-2.0
// Coded markers of the map in space.
#include "stereo_scene.hpp"

namespace {

constexpr double kAcross_rad = 0.004, kAlong_m = 0.02;

// A vehicle that rolls and pitches on its way, with a camera that looks aslant. Twelve markers are all around.
struct diver : scene {
  explicit diver(uint64_t seed) : scene(12) {
    draws = 1000000 * seed;
    sensor.mounting = {{0.3, 0.1, -0.1}, {0.1, 0.4, -0.2}};
    sensor.bearing_sigma_rad = kAcross_rad;
    sensor.range_sigma_m = kAlong_m;
    setup.start.sigma_xy_m = setup.start.sigma_heading_rad = 0.05;
    begin();
  }
  wm_event marker(const wm_landmark &l, double wrong_m = 0.0) {
    const vec3 mount = vec_of(sensor.mounting.xyz_m), place = vec_of(l.p_m);
    const vec3 body = transposed_times(matrix_of(truth.q), place - truth.p);
    const vec3 seen = transposed_times(matrix_of_rpy(sensor.mounting.rpy_rad), body - mount);
    const double distance = length(seen);
    const vec3 sight = (1.0 / distance) * seen;
    const vec3 random = {noise(), noise(), noise()};
    const double along = dot(random, sight);
    const vec3 error = kAlong_m * along * sight + kAcross_rad * distance * (random - along * sight);
    wm_event e = make::empty(t_s, WM_EVENT_MARKER);
    e.as.marker = {0, 1, l.id, {}, 0.0, {}, 0.0, kAbsent, kAbsent, kAbsent};
    for (int i = 0; i < 3; i++) e.as.marker.p_m[i] = seen[i] + error[i] + (i == 1 ? wrong_m : 0.0);
    return e;
  }
  void dive(double seconds, bool sees) {
    const int steps = static_cast<int>(std::lround(seconds / 0.1));
    for (int i = 0; i < steps; i++) {
      swim(0.1, {0.3 * std::cos(0.4 * t_s), 0.2 * std::sin(0.5 * t_s), 0.1 * std::sin(0.3 * t_s)},
           {0.1 * std::sin(0.7 * t_s), 0.1 * std::cos(0.6 * t_s), 0.2});
      if (sees && i % 2 == 1)
        for (int k = 0; k < 2; k++) TEST_ASSERT_EQUAL(WM_OK, take(marker(map[static_cast<size_t>((i + 5 * k) % 12)])));
    }
  }
  vec3 off() const { return vec_of(estimate().pose_map_base.p_m) - truth.p; }
};

// GIVEN 20 drives of 20 s WHEN two of twelve markers are seen five times a second THEN the place is known to 2 cm, and
// the mean NEES of x and y is that of 2 degrees of freedom.
TEST(markers_hold_the_pose) {
  double nees = 0, square_m2 = 0;
  for (uint64_t seed = 1; seed <= 20; seed++) {
    diver d(seed);
    d.dive(20, true);
    const wm_estimate e = d.estimate();
    const vec3 off = d.off();
    const double *c = e.covariance;
    const double xx = c[wm_cov_index(0, 0)], xy = c[wm_cov_index(0, 1)], yy = c[wm_cov_index(1, 1)];
    nees += (yy * off.x * off.x - 2 * xy * off.x * off.y + xx * off.y * off.y) / (xx * yy - xy * xy) / 20;
    square_m2 += dot(off, off) / 20;
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.02, std::sqrt(square_m2));
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, nees);  // chi2 of 40 over 20: 99.9 % lie in 1.0 to 3.7
  TEST_ASSERT_LESS_THAN_DOUBLE(3.7, nees);
}

// The best estimator without markers is dead reckoning.
TEST(dead_reckoning_is_worse) {
  diver with(3), without(3);
  with.dive(20, true);
  without.dive(20, false);
  TEST_ASSERT_LESS_THAN_DOUBLE(length(without.off()), length(with.off()));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1 * without.estimate().covariance[0], with.estimate().covariance[0]);
}

TEST(a_record_tells_each_component) {
  diver d(1);
  wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX] = {};
  d.dive(0.2, false);
  TEST_ASSERT_EQUAL(WM_OK, d.take(d.marker(d.map[0]), records));
  // The sensor is 0.33 m from the vehicle's origin.
  const double far = length(vec_of(d.map[0].p_m) - d.truth.p);
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL(WM_FUSED, records[i].verdict);
    TEST_ASSERT_EQUAL(WM_RESIDUAL_X + i, records[i].residual);
    TEST_ASSERT_EQUAL(d.map[0].id, records[i].landmark_id);
    TEST_ASSERT_DOUBLE_WITHIN(0.4, i == 0 ? far : 0.0, records[i].expected);
  }
}

TEST(what_fits_nothing_is_refused) {
  diver d(1);
  d.dive(2, true);
  wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX] = {};
  TEST_ASSERT_EQUAL(WM_OK, d.take(d.marker(d.map[0], 1.0), records));
  TEST_ASSERT_TRUE(records[0].verdict == WM_REJECTED_GATE || records[1].verdict == WM_REJECTED_GATE ||
                   records[2].verdict == WM_REJECTED_GATE);
  wm_event e = d.marker(d.map[0]);
  e.as.marker.id = 4711;
  TEST_ASSERT_EQUAL(WM_OK, d.take(e, records));
  TEST_ASSERT_EQUAL(WM_REJECTED_UNKNOWN_ID, records[0].verdict);
  e = d.marker(d.map[0]);
  e.as.marker.p_m[2] = kAbsent;
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, d.take(e, records));
  TEST_ASSERT_EQUAL(WM_REJECTED_NOT_FINITE, records[0].verdict);
  e = d.marker(d.map[0]);
  for (double &p : e.as.marker.p_m) p = 0.0;
  TEST_ASSERT_EQUAL(WM_OK, d.take(e, records));
  TEST_ASSERT_EQUAL(WM_REJECTED_SINGULAR, records[0].verdict);
}

}  // namespace
