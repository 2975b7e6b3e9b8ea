// SPDX-License-Identifier: Apache-2.0
// Detectors that err and maps that are old, on top of the same drive without: so many as asked for, marked as what they
// are, and nothing else changed.
#include <algorithm>
#include <string>

#include "shipped.h"
#include "simulate/angle.h"

using namespace wm::sim;

namespace {

Scenario scenario;

Recording make(const Faults &faults, uint64_t seed) {
  scenario.faults = faults;
  return driven(scenario, seed);
}

bool on_map(const Recording &r, int32_t id) {
  return std::any_of(r.map.begin(), r.map.end(), [id](const wm_landmark &l) { return l.id == id; });
}

TEST(test_misread_codes_are_another_landmark_s) {
  const Recording right = make({}, 3);
  Faults faults;
  faults.sightings_misread = 0.2;
  const Recording wrong = make(faults, 3);
  TEST_ASSERT_EQUAL(right.sightings.size(), wrong.sightings.size());
  double misread = 0;
  for (size_t i = 0; i < right.sightings.size(); i++) {
    const Sighting &a = right.sightings[i], &b = wrong.sightings[i];
    TEST_ASSERT_EQUAL_DOUBLE(a.bearing_rad, b.bearing_rad);
    TEST_ASSERT_EQUAL_INT64(a.t_ns, b.t_ns);
    TEST_ASSERT_TRUE(on_map(wrong, b.id));
    TEST_ASSERT_EQUAL(a.outlier || a.id != b.id, b.outlier);
    misread += a.id != b.id;
  }
  check_share(0.2, misread, static_cast<double>(right.sightings.size()));
}

TEST(test_false_detections_are_anywhere_and_added) {
  const Recording right = make({}, 4);
  Faults faults;
  faults.sightings_false = 0.6;  // more than one to each right one
  const Recording wrong = make(faults, 4);
  const double half = scenario.cameras[0].field_of_view_rad / 2;
  size_t next = 0;
  double added = 0, squares = 0;
  for (const Sighting &s : wrong.sightings) {
    if (next < right.sightings.size() && s.id == right.sightings[next].id &&
        s.bearing_rad == right.sightings[next].bearing_rad) {
      next++;
      continue;
    }
    TEST_ASSERT_TRUE(s.outlier && on_map(wrong, s.id) && std::fabs(s.bearing_rad) <= half);
    added++;
    squares += s.bearing_rad * s.bearing_rad;
  }
  TEST_ASSERT_EQUAL(right.sightings.size(), next);  // all that was right is there, in its order
  check_share(0.6, added, static_cast<double>(wrong.sightings.size()));
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 1, std::sqrt(squares / added) / (half / std::sqrt(3.0)));
}

TEST(test_moved_landmarks_stay_on_the_map_where_they_were) {
  const Recording before = make({}, 5);
  Faults faults;
  faults.landmarks_moved = 2;
  faults.landmarks_moved_m = 1.5;
  const Recording now = make(faults, 5);
  TEST_ASSERT_EQUAL(2, now.moved.size());
  TEST_ASSERT_TRUE(now.moved[0] != now.moved[1]);
  for (size_t i = 0; i < now.map.size(); i++) {
    const bool moved = std::find(now.moved.begin(), now.moved.end(), now.map[i].id) != now.moved.end();
    const double by = std::hypot(now.map[i].p_m[0] - before.map[i].p_m[0], now.map[i].p_m[1] - before.map[i].p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, moved ? 1.5 : 0, by);
    TEST_ASSERT_EQUAL_MEMORY(before.landmarks[i].p_m, now.landmarks[i].p_m, sizeof now.landmarks[i].p_m);
  }
  TEST_ASSERT_EQUAL(before.sightings.size(), now.sightings.size());
  for (size_t i = 0; i < now.sightings.size(); i++)
    TEST_ASSERT_EQUAL_DOUBLE(before.sightings[i].bearing_rad, now.sightings[i].bearing_rad);
}

TEST(test_more_moved_than_there_are_is_all) {
  Faults faults;
  faults.landmarks_moved = 1000;
  faults.landmarks_moved_m = 1;
  const Recording all = make(faults, 6);
  TEST_ASSERT_EQUAL(all.map.size(), all.moved.size());
}

TEST(test_a_mistake_is_told) {
  const std::string text =
      "format: waymark-scenario/1\nname: x\nworld: {}\npath: {rounds: {duration_s: 20}}\n"
      "faults: {landmarks_moved: {count: 1}}\n";
  wm_error err{};
  Scenario out;
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, parse_scenario(text, "x.yaml", out, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, "x.yaml:5: faults.landmarks_moved: `by_m` is missing"), err.text);
}

}  // namespace

void setUp(void) { load_shipped("crossing-drawn", scenario); }
