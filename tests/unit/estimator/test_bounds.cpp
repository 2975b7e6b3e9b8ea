// SPDX-License-Identifier: Apache-2.0
// Bounds of a pose for a stated risk, against probabilities by numeric integration.
#include <vector>

#include "common/suite.h"
#include "filters/core/evidence.hpp"
#include "waymark/bounds.h"

namespace {

constexpr double kDof = 10.0, kRisk = 1e-4;

wm_estimate estimate_of(double sigma_x_m, double sigma_y_m, double sigma_rad, double lost) {
  wm_estimate e = {};
  e.state = WM_STATE_TRACKING;
  e.cause_source = -1;
  e.covariance[wm_cov_index(0, 0)] = sigma_x_m * sigma_x_m;
  e.covariance[wm_cov_index(1, 1)] = sigma_y_m * sigma_y_m;
  e.covariance[wm_cov_index(5, 5)] = sigma_rad * sigma_rad;
  e.lost_probability = lost;
  return e;
}

const double kFloor = wm::probability_of(wm::kMinLogOdds);

wm_bound bound_of(const wm_estimate &e, const std::vector<wm_other_pose> &others = {}, double risk = kRisk,
                  double untested = 0.0, double limit_m = 0.0, double limit_rad = 0.0, int without_motion = 0) {
  const wm_integrity integrity = {risk, limit_m, limit_rad, without_motion};
  wm_bound out;
  wm_bound_of(&e, untested, &integrity, others.data(), others.size(), &out);
  return out;
}

// Of two axes with these sigmas, Student's or (dof 0) Gaussian: the probability that the error about (off, 0) is
// farther than r from (0, 0). The density is integrated over the circle's inside, by Simpson's rule in polar
// coordinates about (0, 0).
double share_beyond(double r, double sx, double sy, double off, double dof) {
  const int rings = 2000, angles = 720;
  double inside = 0.0;
  for (int i = 0; i <= rings; i++) {
    const double radius = r * i / rings;
    double ring = 0.0;
    for (int k = 0; k < angles; k++) {
      const double angle = 2.0 * M_PI * k / angles;
      const double x = (radius * std::cos(angle) - off) / sx, y = radius * std::sin(angle) / sy, q = x * x + y * y;
      ring += dof > 0.0 ? std::pow(1.0 + q / dof, -0.5 * dof - 1.0) : std::exp(-0.5 * q);
    }
    const double weight = i == 0 || i == rings ? 1.0 : i % 2 ? 4.0 : 2.0;
    inside += weight * radius * ring / angles / (sx * sy);
  }
  return 1.0 - inside * r / rings / 3.0;
}

TEST(the_bound_of_an_estimate_is_exceeded_with_the_stated_risk) {
  for (const double risk : {1e-2, 1e-3, 1e-4}) {
    const wm_bound b = bound_of(estimate_of(0.3, 0.3, 0.01, kFloor), {}, risk);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * risk, risk, share_beyond(b.horizontal_m, 0.3, 0.3, 0.0, kDof));
  }
}

TEST(an_ellipse_has_the_bound_of_its_largest_axis) {
  // Hoyt's: between a line, at a tenth of the risk less, and a circle.
  for (const double across : {0.02, 0.1, 0.2, 0.3}) {
    const wm_bound b = bound_of(estimate_of(0.3, across, 0.01, kFloor));
    const double share = share_beyond(b.horizontal_m, 0.3, across, 0.0, kDof);
    TEST_ASSERT_TRUE(share <= 1.001 * kRisk && share > 0.2 * kRisk);
    TEST_ASSERT_TRUE(share_beyond(b.horizontal_m, 0.3, across, 0.0, 0.0) < kRisk);
  }
  wm_estimate turned = estimate_of(0.2, 0.2, 0.01, kFloor);  // axes of 0.3 and 0.1 m at 45 degrees
  turned.covariance[wm_cov_index(0, 0)] = turned.covariance[wm_cov_index(1, 1)] = 0.05;
  turned.covariance[wm_cov_index(0, 1)] = turned.covariance[wm_cov_index(1, 0)] = 0.04;
  const double straight_m = bound_of(estimate_of(0.3, 0.1, 0.01, kFloor)).horizontal_m;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, straight_m, bound_of(turned).horizontal_m);
}

TEST(the_bound_is_beyond_that_of_a_gaussian) {
  const double rayleigh = std::sqrt(-2.0 * std::log(kRisk));
  const wm_bound b = bound_of(estimate_of(1.0, 1.0, 1e-3, kFloor));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, kRisk, share_beyond(rayleigh, 1.0, 1.0, 0.0, 0.0));
  TEST_ASSERT_TRUE(b.horizontal_m > 1.6 * rayleigh && b.horizontal_m < 1.8 * rayleigh);
}

TEST(the_bound_covers_a_known_other_pose) {
  const wm_estimate e = estimate_of(0.3, 0.3, 0.01, kFloor + 1e-3);
  const wm_bound b = bound_of(e, {{2.0, 0.5, 0.2, 0.02, 1e-3}});
  const double share = (1.0 - 1e-3) * share_beyond(b.horizontal_m, 0.3, 0.3, 0.0, kDof) +
                       1e-3 * share_beyond(b.horizontal_m, 0.2, 0.2, 2.0, kDof);
  TEST_ASSERT_TRUE(b.horizontal_m > 2.0 && share <= kRisk && share > 0.1 * kRisk);
  TEST_ASSERT_TRUE(b.heading_rad > 0.5 && b.heading_rad < 0.6 && b.usable);
}

TEST(without_weight_another_pose_moves_nothing) {
  const wm_bound alone = bound_of(estimate_of(0.3, 0.3, 0.01, kFloor));
  const wm_bound beside = bound_of(estimate_of(0.3, 0.3, 0.01, kFloor), {{5.0, 1.0, 0.2, 0.02, 0.0}});
  TEST_ASSERT_EQUAL_DOUBLE(alone.horizontal_m, beside.horizontal_m);
  TEST_ASSERT_EQUAL_DOUBLE(alone.heading_rad, beside.heading_rad);
}

TEST(a_pose_that_may_be_anywhere_has_no_bound) {
  const wm_bound b = bound_of(estimate_of(0.3, 0.3, 0.01, kFloor + 1.01 * kRisk));
  TEST_ASSERT_EQUAL_DOUBLE(static_cast<double>(INFINITY), b.horizontal_m);
  TEST_ASSERT_EQUAL_DOUBLE(static_cast<double>(INFINITY), b.heading_rad);
  TEST_ASSERT_FALSE(b.usable);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_DOUBT, b.why);
  TEST_ASSERT_TRUE(std::isfinite(bound_of(estimate_of(0.3, 0.3, 0.01, kFloor + 0.99 * kRisk)).horizontal_m));
}

TEST(a_bound_is_monotone_in_each_number) {
  struct {
    double sigma_m, sigma_rad, lost, distance_m, turn_rad, own_m, own_rad, p, untested, risk;
  } at = {0.3, 0.02, kFloor, 1.0, 0.3, 0.2, 0.02, 3e-4, 0.0, kRisk};
  double *const rising[] = {&at.sigma_m, &at.sigma_rad, &at.distance_m, &at.turn_rad, &at.own_m,
                            &at.own_rad, &at.p,         &at.lost,       &at.untested};
  const double step[] = {0.1, 0.01, 0.5, 0.2, 0.1, 0.01, 2e-4, 1e-5, 1e-5};
  const auto now = [&at] {
    return bound_of(estimate_of(at.sigma_m, 0.1, at.sigma_rad, at.lost + at.p),
                    {{at.distance_m, at.turn_rad, at.own_m, at.own_rad, at.p}}, at.risk, at.untested);
  };
  for (size_t i = 0; i < sizeof step / sizeof step[0]; i++) {
    const double before = *rising[i];
    wm_bound last = now();
    for (int k = 0; k < 5; k++) {
      *rising[i] += step[i];
      const wm_bound next = now();
      TEST_ASSERT_TRUE(next.horizontal_m >= last.horizontal_m && next.heading_rad >= last.heading_rad);
      last = next;
    }
    *rising[i] = before;
  }
  wm_bound last = now();
  for (int k = 0; k < 8; k++) {
    at.risk *= 1.5;
    const wm_bound next = now();
    TEST_ASSERT_TRUE(next.horizontal_m <= last.horizontal_m && next.heading_rad <= last.heading_rad);
    last = next;
  }
}

TEST(what_is_not_usable_says_why) {
  const wm_estimate good = estimate_of(0.1, 0.1, 0.02, kFloor);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_NOT, bound_of(good).why);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_UNTESTED, bound_of(good, {}, kRisk, 0.08).why);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_POSITION, bound_of(good, {}, kRisk, 0.0, 0.5).why);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_NOT, bound_of(good, {}, kRisk, 0.0, 0.8).why);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_HEADING, bound_of(good, {}, kRisk, 0.0, 0.8, 0.1).why);
  wm_estimate e = good;
  e.lost_probability = std::nan("");
  TEST_ASSERT_EQUAL(WM_UNUSABLE_UNMONITORED, bound_of(e).why);
  e = good;
  e.state = WM_STATE_SEARCHING;
  TEST_ASSERT_EQUAL(WM_UNUSABLE_NO_POSE, bound_of(e).why);
  e = good;
  e.covariance[0] = static_cast<double>(INFINITY);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_POSITION, bound_of(e).why);
  TEST_ASSERT_FALSE(bound_of(e).usable);
}

TEST(an_unknown_heading_says_how_far_to_drive) {
  TEST_ASSERT_EQUAL_DOUBLE(0.0, bound_of(estimate_of(0.02, 0.02, 0.02, kFloor)).heading_after_m);
  const wm_bound b = bound_of(estimate_of(0.02, 0.02, 1.8, kFloor), {}, kRisk, 0.0, 0.0, 0.1);
  TEST_ASSERT_EQUAL_DOUBLE(static_cast<double>(INFINITY), b.heading_rad);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_HEADING, b.why);
  // Two places of that sigma, so far apart, give a heading whose bound is the limit.
  const double sigma_rad = std::sqrt(2.0) * 0.02 / b.heading_after_m;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, bound_of(estimate_of(0.02, 0.02, sigma_rad, kFloor)).heading_rad);
  TEST_ASSERT_TRUE(std::isnan(bound_of(estimate_of(50.0, 50.0, 1.8, kFloor)).heading_after_m));
}

// Without motion data a drive shows no heading; a pose without one is usable, unless the configuration limits it.
TEST(a_carried_tag_needs_no_heading) {
  const wm_estimate tag = estimate_of(0.02, 0.02, 1.8, kFloor);
  const wm_bound b = bound_of(tag, {}, kRisk, 0.0, 0.5, 0.0, 1);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_NOT, b.why);
  TEST_ASSERT_EQUAL_DOUBLE(static_cast<double>(INFINITY), b.heading_rad);
  TEST_ASSERT_TRUE(std::isnan(b.heading_after_m));
  TEST_ASSERT_EQUAL(WM_UNUSABLE_HEADING, bound_of(tag, {}, kRisk, 0.0, 0.5, 0.1, 1).why);
  TEST_ASSERT_EQUAL(WM_UNUSABLE_HEADING, bound_of(tag, {}, kRisk, 0.0, 0.5).why);
}

}  // namespace
