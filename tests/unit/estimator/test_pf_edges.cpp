// SPDX-License-Identifier: Apache-2.0
// pf_edges in a small drawn building: the particle filter's step, its published moments, a start that is not known.
#include "edge_building.hpp"
#include "filters/pf_edges/params.h"

namespace {

using namespace edge_building;

constexpr int kCount = 200;

wm_pf_edges_params &own() { return *reinterpret_cast<wm_pf_edges_params *>(params.data()); }

TEST(forwards_and_backwards_it_stays_on_the_way) {
  for (const int weight : {PF_EDGES_PRODUCT, PF_EDGES_SUM}) {
    own().weight = weight;
    drive d;
    TEST_ASSERT_LESS_THAN_DOUBLE(0.2, d.go(10, 1.0, 0.0));
    TEST_ASSERT_LESS_THAN_DOUBLE(0.2, d.go(9, -1.0, 0.0));
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  }
}

// GIVEN a drive THEN the published pose and covariance are the particles' moments, the heading's on the circle, and the
// weights sum up to 1.
TEST(its_pose_is_its_particles_mean) {
  drive d;
  d.go(8, 1.0, 0.0);
  wm_particle all[kCount];
  TEST_ASSERT_EQUAL(kCount, ops->particles(d.state.get(), all, kCount));
  double weight = 0, x = 0, y = 0, sine = 0, cosine = 0, xx = 0, yy = 0;
  for (const wm_particle &p : all) {
    weight += p.weight;
    x += p.weight * p.x_m;
    y += p.weight * p.y_m;
    sine += p.weight * std::sin(p.heading_rad);
    cosine += p.weight * std::cos(p.heading_rad);
  }
  for (const wm_particle &p : all) {
    xx += p.weight * (p.x_m - x) * (p.x_m - x);
    yy += p.weight * (p.y_m - y) * (p.y_m - y);
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, weight);
  const wm_estimate e = d.estimate();
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, x, e.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, y, e.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, std::atan2(sine, cosine), e.heading_rad);
  const double least = 1.6e-5;  // a pixel's rounding
  TEST_ASSERT_DOUBLE_WITHIN(1e-3 * (xx + least), xx + least, e.covariance[wm_cov_index(0, 0)]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3 * (yy + least), yy + least, e.covariance[wm_cov_index(1, 1)]);
}

// GIVEN a start that is not known THEN the particles stand all over the drivable floor, and the state is searching;
// GIVEN 5000 of them WHEN the robot drives THEN they come together.
TEST(without_a_start_the_particles_stand_everywhere) {
  without_a_start();
  own().particles = 5000;
  drive d;
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, d.published_state());
  std::vector<wm_particle> all(5000);
  ops->particles(d.state.get(), all.data(), all.size());
  int south = 0;
  for (const wm_particle &p : all) {
    TEST_ASSERT_TRUE(inside(p.x_m, p.y_m));
    south += p.y_m < 3;
  }
  // 30 m2 of the 30 + 2.5 * 8 m2 of floor lie below y = 3.
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 30.0 / 50.0, south / 5000.0);
  d.go(12, 0.8, 0.0);
  d.go(12, -0.8, 0.0);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
}

// GIVEN a robot that stands THEN no motion noise moves its particles apart.
TEST(at_rest_it_gets_no_less_sure) {
  drive d;
  d.go(3, 0.5, 0.0);
  const double before = d.estimate().covariance[0];
  d.go(3, 0.0, 0.0);
  TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(1.01 * before, d.estimate().covariance[0]);
}

TEST(a_missing_map_is_said) {
  const char *why = nullptr;
  setup.map = nullptr;
  TEST_ASSERT_EQUAL(0, ops->state_bytes(params.data(), &setup, &why));
  TEST_ASSERT_NOT_NULL(std::strstr(why, "no map"));
}

}  // namespace

void setUp(void) { draw("pf_edges"); }
