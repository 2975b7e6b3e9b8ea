// SPDX-License-Identifier: Apache-2.0
// The own map's parts: places in a triangle and their derivatives, points that look alike, agreement by chance, the
// ring of key frames.
#include <cmath>
#include <cstring>
#include <vector>

#include "filters/stereo_ekf/own_map.hpp"
#include "unity.h"
#include "waymark/random.h"

namespace {

using namespace wm;

const frame_triangle kTriangle = {{{1.0, 2.0, 0.5}, {1.8, 2.1, 0.4}, {1.3, 2.9, 0.7}}};

void fill(uint64_t seed, uint64_t out[kAppearanceWords]) {
  for (uint64_t i = 0; i < kAppearanceWords; i++)
    out[i] = static_cast<uint64_t>(wm_random_uniform(seed, 1, i) * 4294967296.0) << 32 |
             static_cast<uint64_t>(wm_random_uniform(seed, 2, i) * 4294967296.0);
}

struct memory {
  std::vector<own_frame> frames;
  std::vector<own_point> points;
  std::vector<vec3> places;
  own_map map;
  explicit memory(int count)
      : frames(static_cast<size_t>(count)), points(frames.size() * own_map::kPointsOfFrame), places(points.size()) {
    map.init(count, frames.data(), points.data(), places.data());
  }
  void add(int frame, uint64_t seed, const vec3 &at) {
    own_point point{};
    fill(seed, point.appearance);
    point.at = at;
    TEST_ASSERT_TRUE(map.add(frame, point));
  }
};

}  // namespace

void setUp() {}
void tearDown() {}

static void coordinates_give_the_place_back_and_their_derivatives() {
  for (const vec3 &place : {vec3{1.5, 2.2, 1.4}, vec3{-3.0, 4.0, -2.0}, vec3{1.0, 2.0, 0.5}}) {
    const vec3 at = in_triangle(kTriangle, place), again = out_of_triangle(kTriangle, at);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, length(again - place));
    mat3 by[3];
    corner_derivatives(kTriangle, at, by);
    for (int corner = 0; corner < 3; corner++)
      for (int axis = 0; axis < 3; axis++) {
        frame_triangle moved = kTriangle;
        moved.corner[corner][axis] += 1e-7;
        const vec3 change = 1e7 * (out_of_triangle(moved, at) - place);
        for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-4, change[i], by[corner].m[i][axis]);
      }
  }
}

static void a_point_is_found_by_its_looks_within_reach() {
  memory m(2);
  m.map.begin(1, 5);
  m.add(1, 11, {0.1, 0.1, 0.0});
  m.add(1, 12, {0.9, 0.1, 0.0});
  m.add(1, 13, {0.1, 0.9, 0.0});
  m.map.place_points([](int) { return kTriangle; });
  uint64_t seen[kAppearanceWords];
  const double everywhere[2] = {1e9, 1e9}, near[2] = {0.1, 0.1};
  const vec3 there = out_of_triangle(kTriangle, {0.9, 0.1, 0.0});
  for (int wrong : {0, 40, 64}) {
    fill(12, seen);
    for (int bit = 0; bit < wrong; bit++) seen[bit % 4] ^= UINT64_C(1) << bit / 4;
    const int found = m.map.find(seen, {0, 0, 0}, everywhere);
    TEST_ASSERT_EQUAL(1, own_map::frame_of(found));
    TEST_ASSERT_EQUAL(1, own_map::index_of(found));
    TEST_ASSERT_EQUAL(found, m.map.find(seen, there, near));
    TEST_ASSERT_EQUAL(-1, m.map.find(seen, {0, 0, 0}, near));
  }
  seen[0] ^= UINT64_C(1) << 60;
  TEST_ASSERT_EQUAL(-1, m.map.find(seen, {0, 0, 0}, everywhere));  // 65 bits
  fill(12, seen);
  m.add(1, 12, {0.5, 0.5, 0.0});  // another one that looks the same
  m.map.place_points([](int) { return kTriangle; });
  TEST_ASSERT_EQUAL(-1, m.map.find(seen, {0, 0, 0}, everywhere));
  TEST_ASSERT_GREATER_OR_EQUAL(0, m.map.find(seen, there, near));
}

static void the_ring_gives_up_what_was_not_seen_for_longest() {
  memory m(3);
  TEST_ASSERT_EQUAL(0, m.map.frames());
  for (int f = 0; f < 3; f++) {
    TEST_ASSERT_EQUAL(f, m.map.oldest());
    m.map.begin(f, 100 + f);
  }
  m.map.frame(0).used_ns = 200;
  TEST_ASSERT_EQUAL(1, m.map.oldest());
  for (int i = 0; i < own_map::kPointsOfFrame; i++) m.add(1, 1, {0, 0, 0});
  TEST_ASSERT_FALSE(m.map.add(1, own_point{}));
  m.map.remove(1);
  TEST_ASSERT_EQUAL(2, m.map.frames());
  TEST_ASSERT_EQUAL(0, m.map.points_of(1));
  TEST_ASSERT_EQUAL(1, m.map.oldest());
}

// Chernoff's bound is above the binomial tail, and not by far.
static void agreement_by_chance_is_bounded() {
  for (const int count : {12, 40, 110})
    for (int agreeing = 4; agreeing <= count; agreeing++) {
      const double share = 0.1;
      double tail = 0.0;
      const int others = count - 3;
      for (int k = agreeing - 3; k <= others; k++)
        tail += std::exp(std::lgamma(others + 1.0) - std::lgamma(k + 1.0) - std::lgamma(others - k + 1.0) +
                         k * std::log(share) + (others - k) * std::log(1 - share));
      const double exact = std::log(tail * count * (count - 1.0) * (count - 2.0) / 6);
      const double bound = log_by_chance(agreeing, count, share);
      TEST_ASSERT_TRUE(bound > exact - 1e-6);
      if (agreeing - 3 > 0.3 * others) TEST_ASSERT_TRUE(bound < exact + 4.0);
    }
  TEST_ASSERT_EQUAL_DOUBLE(0.0, log_by_chance(3, 3, 0.1));
}

int main() {
  UNITY_BEGIN();
  RUN_TEST(coordinates_give_the_place_back_and_their_derivatives);
  RUN_TEST(a_point_is_found_by_its_looks_within_reach);
  RUN_TEST(the_ring_gives_up_what_was_not_seen_for_longest);
  RUN_TEST(agreement_by_chance_is_bounded);
  return UNITY_END();
}
