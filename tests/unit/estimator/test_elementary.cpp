// SPDX-License-Identifier: Apache-2.0
// Our own elementary functions and random numbers, held against the C library and the paper's own vectors.
#include <cfloat>

#include "common/suite.h"
#include "common/trials.h"
#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "waymark/random.h"

namespace {

constexpr int kSamples = 200000;
// Of those that are held against a long double: on 64-bit ARM that has 128 bits, in software.
const int kTruths = (int)wm_trials(kSamples, 20000);
// Where a long double is a double (32-bit ARM), the truth is itself rounded.
constexpr double kTruthOff_ulp = LDBL_MANT_DIG > DBL_MANT_DIG ? 0.0 : 0.55;

// Distance in units of the last place of the (long double) truth rounded to double.
double ulps(double got, long double truth) {
  const double near = (double)truth;
  const double spacing = std::nextafter(std::fabs(near), INFINITY) - std::fabs(near);
  return (double)(fabsl((long double)got - truth) / spacing) - kTruthOff_ulp;
}

double uniform(uint64_t index, double low, double high) { return low + (high - low) * wm_random_uniform(7, 1, index); }

template <class Ours, class Theirs>
double worst(double low, double high, Ours ours, Theirs theirs) {
  double most = 0.0;
  for (int i = 0; i < kTruths; i++) {
    const double x = uniform((uint64_t)i, low, high);
    const double off = ulps(ours(x), theirs((long double)x));
    if (off > most) most = off;
  }
  return most;
}

TEST(test_sine_and_cosine_are_within_two_ulp) {
  const auto s = [](double x) { return wm::sin(x); };
  const auto c = [](double x) { return wm::cos(x); };
  const auto sl = [](long double x) { return sinl(x); };
  const auto cl = [](long double x) { return cosl(x); };
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, worst(-0.8, 0.8, s, sl));
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, worst(-3.2, 3.2, c, cl));
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, worst(-1e5, 1e5, s, sl));
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, worst(-1e6, 1e6, c, cl));
}

TEST(test_arctangent_is_within_two_ulp_all_round) {
  double most = 0.0;
  for (int i = 0; i < kTruths; i++) {
    const double x = uniform(2 * (uint64_t)i, -10, 10), y = uniform(2 * (uint64_t)i + 1, -10, 10);
    const double off = ulps(wm::atan2(y, x), atan2l((long double)y, (long double)x));
    if (off > most) most = off;
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, most);
}

TEST(test_exponential_and_logarithm_are_within_two_ulp) {
  const auto el = [](long double x) { return expl(x); };
  const auto ll = [](long double x) { return logl(x); };
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, worst(
                                        -1, 1, [](double x) { return wm::exp(x); }, el));
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, worst(
                                        -700, 700, [](double x) { return wm::exp(x); }, el));
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, worst(
                                        1e-3, 4, [](double x) { return wm::log(x); }, ll));
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, worst(
                                        1, 1e9, [](double x) { return wm::log(x); }, ll));
}

TEST(test_corners) {
  TEST_ASSERT_EQUAL_DOUBLE(0.0, wm::atan2(0.0, 0.0));
  TEST_ASSERT_EQUAL_DOUBLE(wm::kPi, wm::atan2(0.0, -1.0));
  TEST_ASSERT_EQUAL_DOUBLE(-wm::kHalfPi, wm::atan2(-2.0, 0.0));
  TEST_ASSERT_EQUAL_DOUBLE(wm::kPi / 4, wm::atan2(INFINITY, INFINITY));
  TEST_ASSERT_EQUAL_DOUBLE(wm::kPi / 4, wm::atan2(1.5e308, 1.5e308));
  TEST_ASSERT_DOUBLE_IS_NAN(wm::atan2(NAN, 1.0));
  TEST_ASSERT_DOUBLE_IS_NAN(wm::sin(INFINITY));
  TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, wm::sin(1e300));
  TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, wm::cos(3e10));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, wm::exp(-1000.0));
  TEST_ASSERT_DOUBLE_IS_INF(wm::exp(1000.0));
  TEST_ASSERT_DOUBLE_IS_NAN(wm::log(-1.0));
  TEST_ASSERT_DOUBLE_IS_NEG_INF(wm::log(0.0));
  TEST_ASSERT_EQUAL_DOUBLE(1.0, wm::exp(0.0));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, wm::log(1.0));
}

TEST(test_wrap_goes_to_the_half_open_interval) {
  TEST_ASSERT_EQUAL_DOUBLE(wm::kPi, wm::wrap(-wm::kPi));
  TEST_ASSERT_EQUAL_DOUBLE(wm::kPi, wm::wrap(wm::kPi));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -3.0, wm::wrap(-3.0 + 2 * wm::kTwoPi));
  for (int i = 0; i < 1000; i++) {
    const double a = uniform((uint64_t)i, -100, 100), w = wm::wrap(a);
    TEST_ASSERT_TRUE(w > -wm::kPi && w <= wm::kPi);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, sin(a) - sin(w));
  }
}

// Known answers of Philox4x32-10 from the authors' distribution: all zero, and all ones.
TEST(test_random_blocks_are_philox) {
  uint32_t out[4];
  wm_random_block(0, 0, 0, out);
  const uint32_t zeros[4] = {0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u};
  TEST_ASSERT_EQUAL_HEX32_ARRAY(zeros, out, 4);
  wm_random_block(UINT64_MAX, UINT64_MAX, UINT64_MAX, out);
  const uint32_t ones[4] = {0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu};
  TEST_ASSERT_EQUAL_HEX32_ARRAY(ones, out, 4);
}

TEST(test_normal_numbers_have_mean_0_variance_1_and_their_tails) {
  double sum = 0, squares = 0;
  int beyond_2 = 0;
  for (uint64_t i = 0; i < (uint64_t)kSamples; i++) {
    const double x = wm_random_normal(3, 9, i);
    sum += x;
    squares += x * x;
    beyond_2 += std::fabs(x) > 2.0;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0, sum / kSamples);
  TEST_ASSERT_DOUBLE_WITHIN(0.015, 1.0, squares / kSamples);
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.0455, (double)beyond_2 / kSamples);
}

// The derivatives of an arc, on both sides of the switch to the series and far from it.
TEST(test_arc_and_its_derivatives) {
  const double turns[] = {0.0, 1e-9, -0.00999999, 0.01000001, -0.3, 1.0, 3.0};
  for (double turn : turns) {
    const double way = 1.7, h = 1e-6;
    const wm::arc a = wm::make_arc(way, turn);
    const wm::arc p = wm::make_arc(way, turn + h), m = wm::make_arc(way, turn - h), w = wm::make_arc(way + h, turn);
    TEST_ASSERT_DOUBLE_WITHIN(3e-9, (p.x_m - m.x_m) / (2 * h), a.x_by_turn);
    TEST_ASSERT_DOUBLE_WITHIN(3e-9, (p.y_m - m.y_m) / (2 * h), a.y_by_turn);
    TEST_ASSERT_DOUBLE_WITHIN(3e-9, (w.x_m - a.x_m) / h, a.x_by_way);
    TEST_ASSERT_DOUBLE_WITHIN(3e-9, (w.y_m - a.y_m) / h, a.y_by_way);
    if (turn != 0.0) {
      TEST_ASSERT_DOUBLE_WITHIN(3e-9, way * sin(turn) / turn, a.x_m);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, way * 2 * sin(turn / 2) * sin(turn / 2) / turn, a.y_m);
    }
  }
}

TEST(test_parts_of_a_motion_make_the_whole) {
  const wm_pose2 whole = {0.8, -0.3, 0.9};
  const wm_pose2 part = wm::part_of(whole, 0.3), rest = wm::part_of(whole, 0.7);
  const wm_pose2 again = wm::compose(part, rest);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole.x_m, again.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole.y_m, again.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole.heading_rad, again.heading_rad);
  const wm_pose2 back = wm::between(part, wm::compose(part, rest));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, rest.x_m, back.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, rest.heading_rad, back.heading_rad);
}

}  // namespace
