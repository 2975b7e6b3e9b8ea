// SPDX-License-Identifier: Apache-2.0
// edge_mcl with coded markers on the walls of a drawn building, and sightings of landmarks.
#include "edge_building.hpp"

namespace {

using namespace edge_building;

// Identity, place and direction.
const wm_landmark kMarkers[] = {
    {100, {5.0, 2.9, 0.8}, 0.01, -1.571, {}, 0.01},  {101, {8.4, 1.1, 0.8}, 0.01, 1.571, {}, 0.01},
    {102, {11.0, 2.9, 0.8}, 0.01, -1.571, {}, 0.01}, {103, {14.0, 1.1, 0.8}, 0.01, 1.571, {}, 0.01},
    {104, {5.9, 8.0, 0.8}, 0.01, 3.1, {}, 0.01},     {105, {3.6, 9.5, 0.8}, 0.01, 0.0, {}, 0.01}};
constexpr double kAhead_m = 0.2, kUp_m = 0.5, kFarthest_m = 5.0, kAside_rad = 1.2;
wm_sensor camera;

struct seen_result {
  int seen = 0, fused = 0, rejected = 0;
};

// All markers in view, or that one alone; `turned_rad`: by how much somebody turned them.
seen_result look(drive &d, int only = -1, double turned_rad = 0.0, double moved_m = 0.0) {
  seen_result out;
  for (const wm_landmark &l : kMarkers) {
    if (only >= 0 && l.id != only) continue;
    const double h = d.truth.heading_rad;
    const wm_pose2 eye = wm::compose(d.truth, {kAhead_m, 0, 0}),
                   seen = wm::between(eye, {l.p_m[0] + moved_m, l.p_m[1], 0});
    const double range = std::hypot(seen.x_m, seen.y_m);
    if (range > kFarthest_m || std::fabs(std::atan2(seen.y_m, seen.x_m)) > kAside_rad) continue;
    wm_event e = make::empty(d.t, WM_EVENT_MARKER);
    wm_marker &m = e.as.marker;
    m = {0, 1, l.id, {seen.x_m, seen.y_m, l.p_m[2] - kUp_m}, l.yaw_rad + turned_rad - h, {}, 0.0, NAN, NAN, NAN};
    for (int k = 0; k < 2; k++) m.p_m[k] += (k == 0 ? 0.01 : 0.005 * range) * d.noise();
    m.yaw_rad += 0.02 * d.noise();
    d.feed(e);
    TEST_ASSERT_GREATER_THAN(0, d.count);
    out.seen++;
    out.fused += d.records[0].verdict == WM_FUSED;
    out.rejected += d.records[0].verdict == WM_REJECTED_GATE;
  }
  return out;
}

// Drives on, and looks at the markers after each scan.
seen_result go(drive &d, double seconds, double v, double w) {
  seen_result out;
  for (int i = 0; i < (int)(seconds * 10 + 0.5); i++) {
    d.go(0.1, v, w);
    const seen_result now = look(d);
    out.seen += now.seen, out.fused += now.fused, out.rejected += now.rejected;
  }
  return out;
}

// GIVEN a straight corridor, whose walls say nothing of the way along it, and wheels that are off by 1 % WHEN markers
// hang there THEN the place along it is known to 3 cm, and the covariance says so: eight drives' mean NEES.
TEST(markers_tell_the_way_along_a_corridor) {
  double nees = 0, with = 0, without = 0;
  for (int seed = 0; seed < 8; seed++) {
    drive d, same;
    d.draws = same.draws = (uint64_t)seed * 100000;
    d.truth.x_m = same.truth.x_m = 2 + 0.05 * d.noise();
    d.go(3, 1.0, 0);
    same.go(3, 1.0, 0);
    const seen_result seen = go(d, 9, 1.0, 0);
    same.go(9, 1.0, 0);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
    TEST_ASSERT_GREATER_THAN(60, seen.seen);
    TEST_ASSERT_GREATER_THAN(0.95 * seen.seen, seen.fused);
    nees += d.nees() / 8;
    with = std::fmax(with, d.error());
    without = std::fmax(without, same.error());
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, with);
  TEST_ASSERT_LESS_THAN_DOUBLE(without, with);
  TEST_ASSERT_LESS_THAN_DOUBLE(5.0, nees);  // chi2 of 2 degrees of freedom, mean of 8: 99.9 % below
}

// GIVEN no start WHEN one marker is in view THEN the pose is there within two seconds, and the scans confirm it; the
// floor plan alone has not found it by then.
TEST(one_marker_finds_the_pose) {
  without_a_start();
  drive d, same;
  d.truth = same.truth = {12.5, 2.2, 0.4};
  for (int i = 0; i < 20; i++) {
    d.go(0.1, 0.1, 0);
    look(d, 103);
    same.go(0.1, 0.1, 0);
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, d.error());
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.2, same.error());
  go(d, 4, 0.2, 0);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
}

// GIVEN a tracked pose WHEN the robot is carried to the other corridor THEN two markers there find it within 6 s.
TEST(a_robot_that_is_carried_off_is_found) {
  drive d;
  go(d, 4, 1.0, 0);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  d.truth = {4.7, 6.0, 1.5};
  go(d, 6, 0.2, 0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, d.error());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
}

// GIVEN a tracked pose WHEN the one marker in view hangs 1 m beside its place THEN it is refused, and the pose stays.
TEST(one_moved_marker_moves_no_robot) {
  drive d;
  go(d, 3, 1.0, 0);
  int seen = 0;
  for (int i = 0; i < 60; i++) {
    d.go(0.1, 0.1, 0);
    const seen_result now = look(d, 101, 0.0, 1.0);
    TEST_ASSERT_EQUAL(0, now.fused);
    seen += now.seen;
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.15, d.error());
  }
  TEST_ASSERT_GREATER_THAN(40, seen);
}

// A bearing and a range of a landmark count like a marker's place; one that the map lacks is refused, and so is what is
// no number.
TEST(sightings_count_too) {
  drive d;
  d.go(0.5, 0, 0);
  const auto fuse = [&](int32_t id, double bearing, double range) {
    const wm_status status = d.tell(make::sighting(d.t, id, bearing, range));
    TEST_ASSERT_GREATER_THAN(0, d.count);
    return std::pair{status, (wm_verdict)d.records[0].verdict};
  };
  const double dx = 5.0 - 2.2, dy = 0.9, up = 0.3;
  const double before = d.estimate().covariance[wm_cov_index(0, 0)];
  TEST_ASSERT_EQUAL(WM_FUSED, fuse(100, std::atan2(dy, dx), std::sqrt(dx * dx + dy * dy + up * up)).second);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5 * before, d.estimate().covariance[wm_cov_index(0, 0)]);
  TEST_ASSERT_EQUAL(WM_REJECTED_UNKNOWN_ID, fuse(7, 0.1, 3.0).second);
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, fuse(100, INFINITY, 3.0).first);
  setup.landmark_count = 0;
  drive without;
  without.feed(make::sighting(1.0, 100, 0.1, 3.0));
  TEST_ASSERT_EQUAL(WM_REJECTED_UNKNOWN_ID, without.records[0].verdict);
}

// GIVEN the same corridor WHEN a receiver gives positions, and a compass that is 2 degrees off headings THEN the place
// along it is known to 3 cm; without a start the two find the pose, and the scans confirm it.
TEST(positions_and_headings_count_beside_scans) {
  for (const bool is_known : {true, false}) {
    if (!is_known) without_a_start();
    drive d;
    int fused = 0, heard = 0;
    for (int i = 0; i < 90; i++) {
      d.go(0.1, 1.0, 0);
      d.feed(make::position(d.t, d.truth.x_m + 0.02 * d.noise(), d.truth.y_m + 0.02 * d.noise(), 0.02));
      d.feed(make::heading(d.t, d.truth.heading_rad + 0.035, 0.02));
      heard++, fused += d.records[0].verdict == WM_FUSED;
    }
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.03, d.error());
    TEST_ASSERT_LESS_THAN_DOUBLE(9.21, d.nees());
    TEST_ASSERT_GREATER_THAN((is_known ? 0.95 : 0.6) * heard, fused);
  }
}

// GIVEN a tracked pose WHEN the receiver jumps by 5 m THEN it is refused, and the pose stays.
TEST(a_receiver_that_jumps_moves_no_robot) {
  drive d;
  for (int i = 0; i < 60; i++) {
    d.go(0.1, 1.0, 0);
    const double off_m = i < 30 ? 0.0 : 5.0;
    d.feed(make::position(d.t, d.truth.x_m + off_m, d.truth.y_m, 0.02));
    if (i >= 30) TEST_ASSERT_EQUAL(WM_REJECTED_GATE, d.records[0].verdict);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
  }
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
}

}  // namespace

void setUp(void) {
  draw("edge_mcl");
  make::exact_sensors(reinterpret_cast<wm_motion_params *>(motion_params.data()));
  camera = make::sensor("camera", 0.005, 0.01);
  camera.mounting = {{kAhead_m, 0, kUp_m}, {0, 0, 0}};
  setup.sightings = &make::sightings;
  setup.positions = &make::positions;
  setup.markers = &make::markers;
  setup.sensors = &camera;
  setup.sensor_count = 1;
  setup.landmarks = kMarkers;
  setup.landmark_count = 6;
}
