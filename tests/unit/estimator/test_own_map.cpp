// SPDX-License-Identifier: Apache-2.0
// The own map's parts: places in a triangle and their derivatives, points that look alike, agreement by chance, the
// ring of key frames.
#include <vector>

#include "common/suite.h"
#include "filters/stereo_ekf/map_search.hpp"
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

TEST(coordinates_give_the_place_back_and_their_derivatives) {
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

TEST(a_point_is_found_by_its_looks_within_reach) {
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

// Frames that are out of reach are left out as a whole: what is found is what comparing all points finds.
TEST(near_points_are_those_of_all_frames) {
  constexpr int kFrames = 12, kPoints = 8;
  memory m(kFrames);
  const auto draw = [](uint64_t stream, uint64_t i) { return 10.0 * wm_random_uniform(5, stream, i) - 5.0; };
  for (int f = 0; f < kFrames; f++) {
    m.map.begin(f, f);
    for (int i = 0; i < kPoints; i++) {
      const auto k = static_cast<uint64_t>(f * kPoints + i);
      m.add(f, k, {draw(1, k), draw(2, k), draw(3, k)});
    }
  }
  m.map.place_points([](int) { return kTriangle; });
  double reach[kFrames];
  for (double &r : reach) r = 2.0;
  int near = 0;
  for (uint64_t k = 0; k < kFrames * kPoints; k++) {
    uint64_t seen[kAppearanceWords];
    fill(k, seen);
    const vec3 at = {draw(4, k), draw(5, k), draw(6, k)};
    const auto frame = static_cast<int>(k) / kPoints, point = static_cast<int>(k) % kPoints;
    const bool is_near = length(m.map.place_of(frame, point) - at) < 2.0;
    near += is_near;
    TEST_ASSERT_EQUAL(is_near, m.map.find(seen, at, reach) >= 0);
    TEST_ASSERT_GREATER_OR_EQUAL(0, m.map.find(seen, m.map.place_of(frame, point), reach));
  }
  TEST_ASSERT_GREATER_THAN(0, near);
}

// A search of the whole map ends with the pose at which its points were seen, and no cycle of it compares more pairs
// than those of a frame beyond the bound.
TEST(a_search_is_spread_over_cycles) {
  constexpr int kFrames = 20;
  memory m(kFrames);
  uint64_t next = 0;
  for (int f = 0; f < kFrames; f++) {
    m.map.begin(f, f);
    for (int i = 0; i < own_map::kPointsOfFrame; i++, next++)
      m.add(f, next,
            {3 * wm_random_uniform(9, 1, next), 3 * wm_random_uniform(9, 2, next), wm_random_uniform(9, 3, next)});
  }
  const auto place = [&](int frame, int i) { return out_of_triangle(kTriangle, m.map.point(frame, i).at); };
  const pose3 body = {{0.4, -2.0, 1.0}, turn_by({0.1, -0.2, 2.0})};
  map_search search{};
  search.begin({{0, 0, 0}, kNoTurn});
  for (uint64_t i = 0; i < map_search::kPointsMost; i++) {
    const uint64_t number = 500 + 3 * i;
    uint64_t seen[kAppearanceWords];
    fill(i % 4 == 0 ? 100000 + i : number, seen);  // one in four is not in the map
    const vec3 at =
        place(static_cast<int>(number) / own_map::kPointsOfFrame, static_cast<int>(number) % own_map::kPointsOfFrame);
    search.add(seen, matrix_of(conjugate(body.q)) * (at - body.p), 0.01);
  }
  int cycles = 0;
  for (; !search.step(m.map); cycles++) TEST_ASSERT_LESS_THAN(100, cycles);
  TEST_ASSERT_GREATER_OR_EQUAL(kFrames * own_map::kPointsOfFrame * map_search::kPointsMost /
                                   (map_search::kPairsEnough + own_map::kPointsOfFrame * map_search::kPointsMost),
                               cycles);
  matched_points all, some;
  const double share = search.matches(m.map, place, &all);
  TEST_ASSERT_EQUAL(36, all.count);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(kShareLeast, share);
  TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(kShareMost, share);
  const agreed_pose best = pose_of_most(all, 300, 1);
  TEST_ASSERT_EQUAL(36, best.inliers);
  search.found(best.at);
  const pose3 on = {{1.0, 0.5, 0.0}, turn_by({0, 0, 0.3})}, now = search.pose(on), wanted = composed(body, on);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, length(now.p - wanted.p));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, length(turn_of(now.q * conjugate(wanted.q))));
  // Points of a frame that was given up meanwhile are none.
  for (int f = 0; f < kFrames; f++) m.map.remove(f);
  TEST_ASSERT_EQUAL_DOUBLE(kShareMost, search.matches(m.map, place, &some));
  TEST_ASSERT_EQUAL(0, some.count);
}

TEST(the_ring_gives_up_what_was_not_seen_for_longest) {
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
TEST(agreement_by_chance_is_bounded) {
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
      TEST_ASSERT_GREATER_THAN_DOUBLE(exact - 1e-6, bound);
      if (agreeing - 3 > 0.3 * others) TEST_ASSERT_LESS_THAN_DOUBLE(exact + 4.0, bound);
    }
  TEST_ASSERT_EQUAL_DOUBLE(0.0, log_by_chance(3, 3, 0.1));
}
