// SPDX-License-Identifier: Apache-2.0
// edge_mcl in a small drawn building: tracking forwards and backwards, mending a camera's errors, being carried away,
// starting anywhere, seeing nonsense.
#include "common/block.hpp"
#include "edge_building.hpp"
#include "filters/edge_mcl/hypotheses.hpp"
#include "filters/edge_mcl/odometry_check.hpp"
#include "filters/edge_mcl/params.h"

namespace {

using namespace edge_building;

TEST(forwards_and_backwards_it_stays_on_the_way) {
  drive d;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, d.go(10, 1.0, 0.0));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, d.go(9, -1.0, 0.0));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
}

// GIVEN a corridor, whose walls say nothing of the way along it WHEN the robot stands 4 cm further to the left than it
// believes THEN the scan's innovation is that distance, with a variance that fits a robot that knows its place to 5 cm.
TEST(a_scans_innovation_is_a_distance) {
  drive d;
  d.truth = {2, 2.04, 0};
  d.feed(make::twist(0, 0, 0));
  d.t = 0.1;
  d.feed(d.scan());
  TEST_ASSERT_EQUAL(1, d.count);
  const wm_innovation &out = d.records[0];
  TEST_ASSERT_EQUAL(WM_RESIDUAL_RANGE, out.residual);
  TEST_ASSERT_EQUAL(WM_FUSED, out.verdict);
  TEST_ASSERT_DOUBLE_WITHIN(0.015, 0.04, std::fabs(out.observed - out.expected));
  const double sigma_m = std::sqrt(out.variance);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.005, sigma_m);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, sigma_m);
  const double nis = (out.observed - out.expected) * (out.observed - out.expected) / out.variance;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9 * nis, nis, out.nis);
}

// GIVEN a robot that stands WHEN it sees the same for 5 s THEN it is hardly surer than at first, and surer once it
// drives.
TEST(seeing_the_same_again_makes_it_no_surer) {
  drive d;
  const auto variance = [&d] { return d.estimate().covariance[wm_cov_index(5, 5)]; };  // of the heading
  d.go(0.1, 0.0, 0.0);
  const double at_first = variance();
  d.go(5, 0.0, 0.0);
  const double stood = variance();
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.6 * at_first, stood);
  TEST_ASSERT_TRUE(stood <= at_first);
  d.go(5, 0.5, 0.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.4 * stood, variance());
}

// GIVEN 1 s of motion without a scan WHEN the first scan comes THEN it counts for that second, not for a scan's usual
// interval; WHEN the first scan is the first event THEN there is no interval that it could count for.
TEST(the_first_scan_counts_for_the_time_since_the_motion_began) {
  const double start = 0.5;  // lost.explained: what is explained before anything is seen
  for (const bool moved : {true, false}) {
    drive d;
    if (moved) {
      d.feed(make::twist(0, 1.0, 0.0));
      d.truth.x_m += 1.0;
      d.t = 1.0;
    }
    d.feed(d.scan());
    const double explained = d.explained();
    if (moved)
      TEST_ASSERT_GREATER_THAN_DOUBLE(0.8, explained);
    else
      TEST_ASSERT_EQUAL_DOUBLE(start, explained);
  }
}

// GIVEN a scan WHEN it comes a second time, of the same moment THEN it says nothing more.
TEST(the_same_scan_twice_says_no_more) {
  drive d;
  d.go(1, 0.5, 0.0);
  const wm_estimate once = d.estimate();
  d.feed(d.scan());
  const wm_estimate twice = d.estimate();
  for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-9, once.pose_map_base.p_m[i], twice.pose_map_base.p_m[i]);
  const int own[] = {wm_cov_index(0, 0), wm_cov_index(1, 1), wm_cov_index(5, 5)};
  for (const int i : own) TEST_ASSERT_DOUBLE_WITHIN(1e-3 * once.covariance[i], once.covariance[i], twice.covariance[i]);
}

// GIVEN a way whose places look alike in part WHEN the robot has driven some metres THEN the others are listed, each
// apart from its own, hardly likely, and the pose is what it was.
TEST(places_that_look_the_same_are_listed_beside_the_pose) {
  drive d;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, d.go(6, 1.0, 0.0));
  const std::vector<wm_hypothesis> all = d.hypotheses();
  TEST_ASSERT_GREATER_THAN(0, all.size());
  TEST_ASSERT_LESS_OR_EQUAL(200, all.size());
  TEST_ASSERT_EQUAL(all.size(), ops->hypotheses(d.state.get(), nullptr, 0));
  double sum = 0;
  for (const wm_hypothesis &h : all) {
    const double dx = h.x_m - d.truth.x_m, dy = h.y_m - d.truth.y_m;
    TEST_ASSERT_TRUE(std::sqrt(dx * dx + dy * dy) > 0.5 ||
                     std::fabs(wm::wrap(h.heading_rad - d.truth.heading_rad)) > 0.25);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0, h.covariance[0]);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0, h.covariance[2]);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0, h.covariance[5]);
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0, h.weight);
    sum += h.weight;
  }
  TEST_ASSERT_TRUE(sum > 0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, sum);
}

// GIVEN a start pose that is 0.8 m off along a corridor, with a sigma of 0.5 m along it WHEN a corner comes into view
// THEN the pose is corrected by it at once: a wide prediction does not hold the alignment at its mean.
TEST(a_corner_corrects_a_pose_that_was_open_along_the_corridor) {
  for (const double off_m : {-0.8, 0.8}) {
    setup.start = {WM_TIME_NONE, {13.5 + off_m, 1.95, 0}, {0, 0, 0, 1}, 0, 0.5, 0.05};
    drive d;
    d.truth = {13.5, 1.95, 0};
    d.go(1.5, 0.5, 0.0);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, d.error());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
    setUp();
  }
}

// The robot is told to go on at 1 m/s, nobody hears for 3 s that it has stopped after one: it says that it doesn't know
// where it is, and finds itself again.
TEST(motion_sensors_that_fall_silent_are_not_believed) {
  drive d;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.go(4, 1.0, 0.0));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  d.silent = true;
  d.go(1, 1.0, 0.0);
  d.go(2, 0.0, 0.0);
  d.silent = false;
  d.go(0.1, 0.5, 0.0);
  const wm_estimate e = d.estimate();
  TEST_ASSERT_EQUAL(WM_STATE_LOST, e.state);
  TEST_ASSERT_GREATER_THAN_DOUBLE(d.error() * d.error(), e.covariance[wm_cov_index(0, 0)]);
  d.go(6, 0.5, 0.0);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
}

TEST(a_camera_that_looks_lower_than_believed_is_found_out) {
  drive d;
  d.pitch_rad = 0.008;
  d.go(10, 1.0, 0.0);
  d.go(8, -1.0, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.008, std::fabs(d.calibrated("front.pitch_rad")));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.04, d.go(8, 1.0, 0.0));
}

// GIVEN walls of 14 cm between rooms, and a camera that looks so much lower that far points fall beyond the middle of a
// wall WHEN the robot drives THEN they are not aligned with the face that the wall hides.
TEST(the_far_face_of_a_thin_wall_is_not_aligned_with) {
  for (const double pitch_rad : {-0.015, -0.01, 0.01}) {
    thin_walls(0.14);
    drive d;
    d.pitch_rad = pitch_rad;
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, d.go(10, 1.0, 0.0));
    TEST_ASSERT_DOUBLE_WITHIN(0.002, std::fabs(pitch_rad), std::fabs(d.calibrated("front.pitch_rad")));
    setUp();
  }
}

// GIVEN corrections that draw the scale of the odometry after the pose WHEN the poses are compared with the odometry by
// its scale before THEN the covariance has their difference; without such corrections it has none.
TEST(odometry_is_compared_by_its_scale_before) {
  for (const double drawn : {0.0, 0.12}) {
    wm::odometry_check check;
    check.clear();
    wm_pose2 odom{};
    double scale = 1.0;
    for (int k = 0; k <= 112; k++, odom.x_m += 0.02 * scale, scale = 1.0 - drawn * k / 112)
      check.add({odom, odom, 1e-4, 1e-6, 0.02 * k, scale, 1e-4});
    const double sigma_m = std::sqrt(check.covariance()[0]);
    if (drawn > 0.0)
      TEST_ASSERT_GREATER_THAN_DOUBLE(0.03, sigma_m);
    else
      TEST_ASSERT_LESS_THAN_DOUBLE(1e-6, sigma_m);
  }
}

// GIVEN a pose with a sigma of 0.5 m WHEN it is corrected by 0.8 m, and is sure then THEN odometry, which disagrees by
// that, leaves no doubt; the same of a pose that was sure before does.
TEST(a_correction_of_an_open_pose_is_no_disagreement) {
  for (const double sigma_m : {0.5, 0.02}) {
    wm::odometry_check check;
    check.clear();
    for (int k = 0; k <= 8; k++) {
      const wm_pose2 odom{0.25 * k, 0, 0}, pose{0.25 * k, k < 4 ? 0.0 : 0.8, 0};
      check.add({pose, odom, k < 4 ? sigma_m * sigma_m : 4e-4, 1e-6, 0.25 * k, 1.0, 1e-4});
    }
    const double doubt_m = std::sqrt(check.covariance()[2]);
    if (sigma_m > 0.1)
      TEST_ASSERT_LESS_THAN_DOUBLE(0.03, doubt_m);
    else
      TEST_ASSERT_GREATER_THAN_DOUBLE(0.3, doubt_m);
  }
}

// GIVEN a map that has a corridor's end 0.3 m behind a row of cupboards WHEN the robot drives towards them THEN the
// cupboards do not pull the pose, and it stays within 3 sigma; on the right map it is confident.
TEST(unmapped_cupboards_pull_no_confident_pose) {
  for (const double cupboards_m : {0.0, 0.3}) {
    for (int row = 0; row < kHeight; row++) {  // the end wall is at 16 m
      const size_t at = (size_t)row * kWidth, end = at + (size_t)(16.0 / kPixel_m);
      const int shift = (int)(cupboards_m / kPixel_m + 0.5);
      const double y = (kHeight - 0.5 - row) * kPixel_m;
      if (y < 0.99 || y > 3.01) continue;
      for (int k = 0; k < shift; k++) {
        edges[end + (size_t)k] = y < 1.02 || y > 2.98 ? 255 : 0;
        drivable[end + (size_t)k] = drivable[end - 5];
      }
      edges[end + (size_t)shift] = 255;
    }
    drive d;
    d.go(13, 0.9, 0.0);
    const wm_estimate e = d.estimate();
    const double sigma_m = std::sqrt(e.covariance[wm_cov_index(0, 0)]);
    if (cupboards_m > 0.0) {
      TEST_ASSERT_LESS_THAN_DOUBLE(0.08, d.error());
      TEST_ASSERT_LESS_THAN_DOUBLE(3.0 * sigma_m, d.error());
    } else {
      TEST_ASSERT_LESS_THAN_DOUBLE(0.06, sigma_m);
    }
    setUp();
  }
}

// GIVEN a map in which the right wall is 0.08 m too far away from x = 7 m on WHEN the robot drives along it THEN the
// pose stays within a quarter of that, and its sigma covers it all along.
TEST(a_wall_that_was_drawn_elsewhere_pulls_no_confident_pose) {
  constexpr double kFrom_m = 7.0, kOff_m = 0.08;
  const int right = (int)(1.0 / kPixel_m), off = (int)(kOff_m / kPixel_m + 0.5);
  for (int column = (int)(kFrom_m / kPixel_m); column < (int)(16.0 / kPixel_m); column++) {
    const auto at = [column](int up) { return (size_t)(kHeight - 1 - up) * kWidth + (size_t)column; };
    edges[at(right)] = 0;
    edges[at(right - off)] = 255;
    for (int up = right - off + 1; up <= right; up++) drivable[at(up)] = 255;
  }
  drive d;
  double sum = 0.0;
  constexpr int kSteps = 230;
  for (int i = 0; i < kSteps; i++) {
    d.go(0.1, 0.5, 0.0);
    const wm_estimate e = d.estimate();
    const double off_m = e.pose_map_base.p_m[1] - d.truth.y_m;
    TEST_ASSERT_DOUBLE_WITHIN(0.25 * kOff_m, 0.0, off_m);
    sum += off_m * off_m / e.covariance[wm_cov_index(1, 1)];
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.8, sum / kSteps);
}

// GIVEN pictures that are 0.05 s older than their stamps, or walls with a skirting of 2 cm WHEN the robot drives to and
// fro THEN that is found, with its sign. Of the skirting only a part: pitch and height explain most of it here, and the
// offset of each wall would explain the rest.
TEST(late_pictures_and_skirtings_are_found_out) {
  reinterpret_cast<wm_edge_mcl_params *>(params.data())->wall_sigma_m = 0.0;
  for (const bool late : {true, false}) {
    drive d;
    d.late = late ? 5 : 0;
    d.thick_m = late ? 0.0 : 0.02;
    for (int i = 0; i < 3; i++) {
      d.go(10, 1.0, 0.0);
      d.go(10, -1.0, 0.0);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.015, late ? 0.05 : 0.0, d.calibrated("front.time_offset_s"));
    TEST_ASSERT_DOUBLE_WITHIN(0.0015, late ? 0.0 : 0.0035, d.calibrated("edges.offset_m"));
  }
}

// Derivatives of a point on the floor by each error of the mounting, against differences.
TEST(each_error_of_a_mounting_has_its_derivative) {
  wm_camera camera = rig.cameras[0];
  camera.mounting.rpy_rad[2] = 0.6;
  wm::floor_camera c{};
  c.init(camera);
  const double at[] = {0.01, -0.02, 0.03, 0.015};
  wm::floor_point p, more, less;
  TEST_ASSERT_TRUE(c.correct(3.0, 1.2, at, &p));
  for (int k = 0; k < wm::kCameraErrors; k++) {
    double up[] = {at[0], at[1], at[2], at[3]}, down[] = {at[0], at[1], at[2], at[3]};
    up[k] += 1e-6;
    down[k] -= 1e-6;
    TEST_ASSERT_TRUE(c.correct(3.0, 1.2, up, &more) && c.correct(3.0, 1.2, down, &less));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, (more.x - less.x) / 2e-6, p.x_by[k]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, (more.y - less.y) / 2e-6, p.y_by[k]);
  }
}

TEST(carried_away_it_says_so_and_finds_back) {
  drive d;
  d.go(10, 1.0, 0.0);
  d.go(8, -1.0, 0.0);
  d.truth = {4.7, 3.5, 1.5707963267948966};
  bool lost = false;
  for (int i = 0; i < 50; i++) {
    d.go(0.1, 0.6, 0.0);
    lost |= d.published_state() != WM_STATE_TRACKING;
  }
  TEST_ASSERT_TRUE(lost);
  d.go(6, 0.4, 0.0);
  d.go(12, -0.5, 0.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
}

// GIVEN a robot on its way WHEN something that the map doesn't have hides nearly all for 1.5 s THEN it is not taken for
// lost; WHEN as much of what it sees is behind walls THEN it is, in as much time.
// GIVEN robots that are carried off WHEN they search THEN with each scan the probability of being lost is at least the
// one that the listed hypotheses have together, in whatever state.
TEST(listed_hypotheses_are_part_of_the_probability_of_being_lost) {
  const wm_pose2 to[] = {{10.53, 2.02, 5.417}, {3.97, 4.89, 3.707}, {12.55, 2.39, 0.689}};
  for (const wm_pose2 &there : to) {
    drive d;
    d.go(4, 1.0, 0.0);
    d.truth = there;
    for (int i = 0; i < 60; i++) {
      d.go(0.1, i % 20 < 10 ? 0.8 : -0.8, 0.0);
      double sum = 0;
      for (const wm_hypothesis &h : d.hypotheses()) sum += h.weight;
      TEST_ASSERT_GREATER_THAN_DOUBLE(sum - 0.02, d.estimate().lost_probability);
    }
  }
}

TEST(something_in_the_way_is_not_being_lost_but_sight_through_walls_is) {
  drive d;
  d.go(8, 1.0, 0.0);
  d.go(8, -1.0, 0.0);
  d.go(4, 1.0, 0.0);
  d.blocked_m = 0.5;
  for (int i = 0; i < 15; i++) {
    d.go(0.1, 1.0, 0.0);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  }
  d.blocked_m = INFINITY;
  d.go(3, 1.0, 0.0);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
  d.glass = 110;
  d.go(1.5, 1.0, 0.0);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, d.published_state());
}

// GIVEN a building where it sees through some of the walls all along THEN that says nothing.
TEST(glass_walls_are_usual) {
  drive d;
  d.glass = 30;
  for (int i = 0; i < 3; i++) {
    d.go(8, 1.0, 0.0);
    d.go(8, -1.0, 0.0);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.01, d.estimate().lost_probability);
  }
}

TEST(it_starts_without_being_told_where) {
  without_a_start();
  drive d;
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, d.published_state());
  d.go(12, 0.8, 0.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, d.published_state());
}

// Sweeps over the drawn building after sixteen looks along a corridor.
struct searching {
  block map_memory = allocate(wm::edge_map::bytes(map)), field = allocate(wm::place_search::bytes(map));
  wm::edge_map edge_map;
  wm::place_search search;
  wm_pose2 odom = {0, 0, 0};
  drive d;
  // `off`: the camera's error, in sigmas, of which each moves a point away by 2 % of its range squared.
  explicit searching(double off = 0.0) {
    edge_map.init(map, map_memory.get());
    search.init(edge_map, field.get());
    static wm::floor_points scan;
    d.truth = {2, 2, 0};
    for (int k = 0; k < 16; k++, d.truth.x_m += 0.5, odom.x_m += 0.5) {
      const wm_event e = d.scan();
      scan.count = (int)e.as.points.count;
      for (int i = 0; i < scan.count; i++) {
        wm::floor_edge &p = scan.of[i];
        const double x = (double)e.as.points.x_m[i], y = (double)e.as.points.y_m[i],
                     by = 0.02 * std::sqrt(x * x + y * y);
        p.x_by[0] = (float)(by * x);
        p.y_by[0] = (float)(by * y);
        p.x_m = (float)(x - off * by * x);
        p.y_m = (float)(y - off * by * y);
      }
      TEST_ASSERT_TRUE(search.add_keyframe(scan, odom));
    }
  }
};

TEST(a_step_of_the_search_spends_no_more_than_it_may) {
  const int least = wm::place_search::kAligningCost;
  for (const int poses : {least, 20000, 80000}) {
    searching s;
    int steps = 0;
    bool ended = false;
    for (; !ended && steps < 1000; steps++) {
      const uint64_t before = s.search.spent();
      ended = s.search.step(s.edge_map, poses, s.odom);
      TEST_ASSERT_LESS_OR_EQUAL_UINT64((uint64_t)poses, s.search.spent() - before);
    }
    TEST_ASSERT_TRUE(ended);
    TEST_ASSERT_GREATER_THAN_INT(80000 / poses, steps);  // it was too much for one
    int count;
    const wm::place *places = s.search.places(&count);
    TEST_ASSERT_GREATER_THAN_INT(0, count);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, s.odom.x_m + 2, places[0].pose.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2, places[0].pose.y_m);
  }
}

// GIVEN a camera that is off by two of its sigmas WHEN the search looks THEN the place that it finds is the true one,
// and its error is found with it.
TEST(a_place_is_found_with_what_the_camera_is_off_by) {
  for (const double off : {-2.0, 0.0, 2.0}) {
    searching s(off);
    while (!s.search.step(s.edge_map, 80000, s.odom)) continue;
    int count;
    const wm::place *places = s.search.places(&count);
    TEST_ASSERT_GREATER_THAN_INT(0, count);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, s.odom.x_m + 2, places[0].pose.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2, places[0].pose.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, off, places[0].error[0]);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.9, places[0].explained);
  }
}

TEST(weighing_places_spends_what_it_says) {
  searching s;
  wm::hypotheses others;
  others.clear({2, 2, 0}, s.odom);
  while (!s.search.step(s.edge_map, 80000, s.odom)) continue;
  others.offer(s.search);
  TEST_ASSERT_GREATER_THAN_INT(3, others.searched());
  const uint64_t before = s.search.spent();
  others.weigh(s.edge_map, &s.search, 0.0, 0.0, s.search.information(), 3);
  TEST_ASSERT_EQUAL_UINT64(3 * wm::place_search::kWeighingCost, s.search.spent() - before);
}

TEST(nonsense_makes_it_no_surer_and_never_breaks_it) {
  drive d;
  d.go(3, 1.0, 0.0);
  d.go(5, 0.5, 0.0, true);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5, d.error());
  d.go(4, 0.5, 0.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, d.error());
}

TEST(what_it_can_not_work_with_is_said) {
  const char *why = nullptr;
  setup.map = nullptr;
  TEST_ASSERT_EQUAL(0, ops->state_bytes(params.data(), &setup, &why));
  TEST_ASSERT_NOT_NULL(std::strstr(why, "no map"));
  wm_raster bare = map;
  bare.edges = nullptr;
  setup.map = &bare;
  TEST_ASSERT_EQUAL(0, ops->state_bytes(params.data(), &setup, &why));
  TEST_ASSERT_NOT_NULL(std::strstr(why, "edges"));
}

}  // namespace

void setUp(void) { draw("edge_mcl"); }
