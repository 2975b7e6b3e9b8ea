// SPDX-License-Identifier: Apache-2.0
// What the landmark filter does with what makes no sense: closed-form resection, witnesses, and whole filters that are
// shown wrong identities, no numbers, landmarks in a line, on the robot, or too few of them. Never a confident wrong
// pose, never NaN.
#include "filters/core/landmark_bias.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/relocalize/pose_search.hpp"
#include "filters/relocalize/resection.hpp"
#include "world.hpp"

namespace {

using namespace world;

constexpr int kLandmarks = 5;
const double kPlaces[kLandmarks][2] = {{12, 3}, {-4, 11}, {-9, -6}, {7, -10}, {2, 14}};

double stands_m[kLandmarks][2];  // truly
double judged_from_s;
int in_turn;  // 1: all are seen at each step; n: of n steps each has one

void start() {
  for (int i = 0; i < kLandmarks; i++)
    for (int k = 0; k < 2; k++) stands_m[i][k] = landmarks[i].p_m[k];
  world::begin();
}

void begin_without_pose() {
  without_a_start();
  start();
}

enum class sees { right, wrong_identities, no_numbers };

// Drives an arc at 1 m/s and sees the first `seen` landmarks at 10 Hz. After each step: all numbers are finite, and who
// tracks is where it says (5 sigma and 0.3 m).
void drive(double for_s, int seen, sees how = sees::right) {
  const double dt = 0.1;
  for (const double until_s = now_s + for_s; now_s < until_s;) {
    feed(make::twist(now_s, 1.0, 0.15));
    go_on(1.0, 0.15, dt);
    for (int i = 0; i < seen; i++) {
      if ((static_cast<int>(std::lround(10 * now_s)) + 2 * i) % in_turn != 0) continue;
      const double error = gauss(0.005);
      const double bearing = wm::wrap(view_of(stands_m[i][0], stands_m[i][1]).bearing_rad + error);
      const int other = (i + 1 + (int)(wm_random_next_uniform(&noise) * (kLandmarks - 1))) % kLandmarks;
      (void)tell(make::sighting(now_s, landmarks[how == sees::wrong_identities ? other : i].id,
                                how == sees::no_numbers ? static_cast<double>(NAN) : bearing, NAN));
    }
    const wm_estimate e = estimate();
    for (const double value : e.covariance) TEST_ASSERT_DOUBLE_IS_DETERMINATE(value);
    TEST_ASSERT_DOUBLE_IS_DETERMINATE(off());
    TEST_ASSERT_DOUBLE_IS_DETERMINATE(e.heading_rad);
    const double p = e.lost_probability;
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.0, p);
    TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(1.0, p);
    const bool tracks = e.state == WM_STATE_TRACKING || e.state == WM_STATE_DEAD_RECKONING;
    if (tracks && p < 0.5 && now_s > judged_from_s) TEST_ASSERT_LESS_THAN_DOUBLE(0.3 + 5.0 * sigma(), off());
  }
}

// ---- resection ----

// Lines of sight from three poses of the odometry's frame, which lies in the map as `frame` says.
void lines_from(const wm_pose2 &frame, const wm_pose2 from[3], wm::line_of_sight line[3]) {
  for (int i = 0; i < 3; i++) {
    const wm_pose2 eye = wm::compose(frame, from[i]);
    const double bearing = wm::atan2(kPlaces[i][1] - eye.y_m, kPlaces[i][0] - eye.x_m) - frame.heading_rad;
    line[i] = {{from[i].x_m, from[i].y_m}, {wm::cos(bearing), wm::sin(bearing)}, {kPlaces[i][0], kPlaces[i][1]}};
  }
}

bool among(const wm_pose2 *poses, int count, const wm_pose2 &wanted) {
  for (int i = 0; i < count; i++)
    if (std::fabs(poses[i].x_m - wanted.x_m) + std::fabs(poses[i].y_m - wanted.y_m) < 1e-6 &&
        std::fabs(wm::wrap(poses[i].heading_rad - wanted.heading_rad)) < 1e-7)
      return true;
  return false;
}

TEST(test_three_bearings_give_the_pose) {
  const wm_pose2 frame = {1.5, -2.0, 2.3};
  const wm_pose2 still[3] = {{0.4, 0.1, 0}, {0.4, 0.1, 0}, {0.4, 0.1, 0}};
  const wm_pose2 moving[3] = {{0, 0, 0}, {1.0, 0.2, 0.2}, {2.1, 0.6, 0.4}};
  wm::line_of_sight line[3];
  wm_pose2 out[2];
  lines_from(frame, still, line);
  TEST_ASSERT_TRUE(among(out, wm::resect(line, out), frame));
  lines_from(frame, moving, line);
  TEST_ASSERT_TRUE(among(out, wm::resect(line, out), frame));
}

TEST(test_bearings_that_say_nothing_give_no_pose) {
  wm::line_of_sight line[3] = {};
  wm_pose2 out[2];
  TEST_ASSERT_EQUAL(0, wm::resect(line, out));
  for (int i = 0; i < 3; i++) line[i] = {{0, 0}, {1, 0}, {5.0 + i, 0}};  // all in one direction
  TEST_ASSERT_EQUAL(0, wm::resect(line, out));
  line[0].along[0] = NAN;
  TEST_ASSERT_EQUAL(0, wm::resect(line, out));
}

// ---- witnesses ----

// GIVEN three landmarks WHEN so many others come that there is no room for all THEN those not seen for longest make
// room.
TEST(test_landmarks_not_seen_for_longest_make_room) {
  const int old = 3;
  for (const int later : {WM_MONITOR_LANDMARKS - 3, WM_MONITOR_LANDMARKS - 2, WM_MONITOR_LANDMARKS}) {
    wm_monitor_landmarks seen;
    wm::landmark_bias_clear(&seen);
    for (int k = 0; k < 60; k++)
      for (int id = k < 30 ? 0 : old; id < (k < 30 ? old : old + later); id++) {
        wm_innovation i{};
        i.t_ns = make::at(0.3 * k);
        i.landmark_id = id;
        i.residual = WM_RESIDUAL_RANGE;
        i.variance = 1.0;
        wm::landmark_bias_take(&seen, i);
      }
    int kept = 0;
    for (uint32_t k = 0; k < seen.count; k++) kept += seen.entries[k].id < old;
    TEST_ASSERT_EQUAL(WM_MONITOR_LANDMARKS, seen.count);
    TEST_ASSERT_EQUAL(WM_MONITOR_LANDMARKS - later, kept);
  }
}

// ---- the whole filter ----

TEST(test_started_without_a_pose_three_bearings_are_enough) {
  begin_without_pose();
  TEST_ASSERT_EQUAL_DOUBLE(1.0, estimate().lost_probability);
  TEST_ASSERT_EQUAL(0, counter(WM_COUNTER_RELOCALIZATIONS).count);
  drive(5, 3);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_EQUAL(1, counter(WM_COUNTER_RELOCALIZATIONS).count);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

// The three landmarks that are seen at first make a pose, and one of them has moved: the next ones tell which.
TEST(test_a_pose_found_by_a_moved_landmark_is_mended) {
  begin_without_pose();
  stands_m[2][0] += 1.5;
  stands_m[2][1] -= 1.5;
  judged_from_s = 5;
  drive(2, 3);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.3, off());
  drive(2, kLandmarks);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  drive(6, kLandmarks);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_EQUAL(landmarks[2].id, counter(WM_COUNTER_LANDMARKS_MOVED).landmark_id);
}

// Driving by one landmark something is taken for another one once: a pose that fits both is found, and not believed.
// Seen from two places it is.
TEST(test_a_second_landmark_seen_from_one_place_alone_is_not_enough) {
  static wm::pose_search search;
  search.clear();
  const double place_m[2][2] = {{5.0, 3.0}, {7.0, -4.0}};
  const auto see = [&](int landmark, double x_m, int64_t t_ms) {
    wm::observation seen{};
    seen.t_ns = t_ms * WM_NS_PER_MS;
    seen.kind = wm::kObservedBearing;
    seen.key = landmark * wm::kMaxSensors;
    seen.sensor.x_m = seen.travelled_m = x_m;
    for (int k = 0; k < 2; k++) seen.place_m[k] = place_m[landmark][k];
    seen.bearing_rad = wm::atan2(place_m[landmark][1], place_m[landmark][0] - x_m);
    seen.sigma_angle_rad = 0.005;
    seen.sigma_place_m = 0.02;
    search.add(seen);
  };
  const auto is_found = [] { return search.find(0, {{3.0, 0.0, 0.0}, 3.0, 0.0}, nullptr, 0, {5.0, 1.0, 5}).found; };
  for (int i = 0; i < 7; i++) see(0, 0.5 * i, 400 * i);
  see(1, 3.0, 2400);
  TEST_ASSERT_FALSE(is_found());
  see(1, 3.1, 2800);  // as good as the same place
  TEST_ASSERT_FALSE(is_found());
  see(1, 2.0, 3200);
  TEST_ASSERT_TRUE(is_found());
}

// A vague pose is searched for, by what is known of it. One set anew is another pose: what was known before does not
// count.
TEST(test_a_vague_pose_set_anew_is_searched_anew) {
  setup.start.sigma_heading_rad = 1.0;
  start();
  const auto verdict_of_a_sighting = [] { return verdict_of(make::sighting(now_s, landmarks[0].id, 0.3, NAN)); };
  drive(0.5, 0);
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, verdict_of_a_sighting());
  drive(6.0, 0);
  feed(make::set_pose(now_s, truth.x_m, truth.y_m, truth.heading_rad, 0.1, 1.0));
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, verdict_of_a_sighting());
}

TEST(test_two_landmarks_and_driving_are_enough) {
  begin_without_pose();
  drive(20, 2);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5, off());
}

TEST(test_a_known_place_and_an_unknown_heading) {
  setup.start.heading_rad = NAN;
  start();
  drive(3, 1);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

// Off by twenty of its sigmas: told within half a second, mended, and forgotten.
TEST(test_a_start_that_is_surer_than_right_is_told_and_mended) {
  setup.start.p_m[0] += 0.8;
  setup.start.p_m[1] += 0.6;
  start();
  judged_from_s = 0.5;
  const uint32_t before = estimate().resets;
  drive(1, kLandmarks);
  TEST_ASSERT_EQUAL(before + 1, estimate().resets);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, off());
  drive(5, kLandmarks);
  TEST_ASSERT_EQUAL(before + 1, estimate().resets);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

// What is seen of two landmarks fits many places: a good start is not given up for one of them.
TEST(test_a_good_start_is_kept) {
  for (const int seen : {2, kLandmarks}) {
    setUp();
    start();
    const uint32_t before = estimate().resets;
    drive(10, seen);
    TEST_ASSERT_EQUAL(before, estimate().resets);
  }
}

TEST(test_all_identities_wrong) {
  begin_without_pose();
  drive(20, kLandmarks, sees::wrong_identities);
}

TEST(test_bearings_that_are_no_numbers) {
  begin_without_pose();
  drive(5, kLandmarks, sees::no_numbers);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, estimate().state);
  drive(5, kLandmarks);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

// In a line, and the robot in it at the start: its mirror image sees the same of them but for the order.
TEST(test_landmarks_in_a_line) {
  for (int i = 0; i < kLandmarks; i++) landmarks[i].p_m[0] = 4.0 * i - 6.0, landmarks[i].p_m[1] = 0.0;
  begin_without_pose();
  drive(15, kLandmarks);
}

TEST(test_a_landmark_on_top_of_the_robot) {
  landmarks[0].p_m[0] = truth.x_m;
  landmarks[0].p_m[1] = truth.y_m;
  start();
  drive(10, kLandmarks);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

TEST(test_landmarks_all_in_one_place) {
  for (wm_landmark &l : landmarks) l.p_m[0] = 5.0, l.p_m[1] = 5.0;
  begin_without_pose();
  drive(15, kLandmarks);
}

// A camera that finds little: each landmark is seen once a second. What fitted before it was carried off has no weight,
// as another pose explains all that is seen since.
TEST(test_carried_off_it_says_so_though_little_is_seen) {
  in_turn = 10;
  start();
  drive(10, kLandmarks);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  truth = {truth.x_m + 4.0, truth.y_m - 7.0, wm::wrap(truth.heading_rad + 1.0)};
  judged_from_s = now_s + 3.0;
  drive(2.5, kLandmarks);
  const bool said = estimate().state == WM_STATE_LOST || off() < 0.3;
  TEST_ASSERT_TRUE(said);
  drive(2.5, kLandmarks);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, estimate().state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

TEST(test_a_moved_landmark_is_told_and_does_no_harm) {
  start();
  drive(3, kLandmarks);
  stands_m[2][0] += 3.0;
  stands_m[2][1] -= 2.0;
  drive(10, kLandmarks);
  TEST_ASSERT_EQUAL(1, counter(WM_COUNTER_LANDMARKS_MOVED).count);
  TEST_ASSERT_EQUAL(landmarks[2].id, counter(WM_COUNTER_LANDMARKS_MOVED).landmark_id);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, off());
}

}  // namespace

void setUp(void) {
  prepare_ekf(make::sensor("camera", 0.006, NAN), 7);
  put_on_map({{12, 3}, {-4, 11}, {-9, -6}, {7, -10}, {2, 14}}, 10);
  start_at({-1, 0.5, 0.2}, 0.05, 0.02);
  judged_from_s = 0;
  in_turn = 1;
}
