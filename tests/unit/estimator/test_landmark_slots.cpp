// SPDX-License-Identifier: Apache-2.0
// Errors of the map: a robot that sees more landmarks than there are states for their errors is no more certain of its
// place than the map is. A straight is no evidence of a turn's sign.
#include "sensors/sighting.hpp"
#include "world.hpp"

namespace {

using namespace world;

constexpr double kMapSigma_m = 0.3;
constexpr int kMaps = 16, kSteps = 200;

double normal(uint64_t of, int i) { return wm_random_normal(11, of, static_cast<uint64_t>(i)); }

// On a circle of 12 m.
void begin_among(int n, double sigma_m) {
  put_on_map({}, 0);
  for (int k = 0; k < n; k++)
    landmarks[k] = {k, {12.0 * std::cos(2 * M_PI * k / n), 12.0 * std::sin(2 * M_PI * k / n), 0}, sigma_m, NAN, {}, 0};
  setup.landmark_count = static_cast<size_t>(n);
  begin();
}

// Twenty seconds in a small circle: all landmarks are seen ten times a second. The mean NEES over the maps: 1.2
// and 2.2. It is 71 where 30 landmarks take each other's slots.
double drive_among(int n) {
  double sum = 0;
  for (int map = 0; map < kMaps; map++) {
    begin_among(n, kMapSigma_m);
    truth = {};
    now_s = 0.0;
    for (int i = 0;; i++) {
      feed(make::twist(now_s, 0.5, 0.25));
      for (int k = 0; k < n; k++) {
        const uint64_t of = static_cast<uint64_t>(1000 * map + 2 * k);
        const auto [bearing, range] = view_of(landmarks[k].p_m[0] + kMapSigma_m * normal(of, 0),
                                              landmarks[k].p_m[1] + kMapSigma_m * normal(of, 1));
        feed(make::sighting(now_s, k, wm::wrap(bearing + 0.02 * normal(of + 1, 2 * i)),
                            range + 0.1 * normal(of + 1, 2 * i + 1)));
      }
      if (i == kSteps - 1) break;
      go_on(0.5, 0.25, 0.1);
    }
    sum += 0.5 * nees_from(truth) / kMaps;
  }
  return sum;
}

TEST(test_more_landmarks_than_slots_are_no_more_certain_than_their_map) {
  for (const int count : {12, 30}) {
    const double nees = drive_among(count);
    char text[64];
    (void)snprintf(text, sizeof text, "%d landmarks: NEES %.2f", count, nees);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(3.0, nees, text);
    TEST_ASSERT_GREATER_THAN_DOUBLE_MESSAGE(0.05, nees, text);
  }
}

// A camera takes a landmark's size for its distance; of radio and sound the sensor's scale grows with the range, and no
// anchor's own error.
TEST(test_an_anchors_own_error_does_not_grow_with_the_range) {
  wm_sighting_params p;
  wm_params_defaults(&wm_sighting_params_table, &p);
  p.correlated_range_m = 0.3;
  p.correlated_range_rel = 0.02;
  wm::sighting_reading r{};
  r.range = true;
  r.range_sigma_m = 0.1;
  for (const double range_m : {1.0, 40.0}) TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, wm::correlated_range(p, r, range_m));
  r.bearing = true;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, wm::correlated_range(p, r, 20.0));
}

// A minute in a small circle among eight landmarks, seen ten times a second: mean NEES of the last 40 s over the maps.
// `factor`: of all sigmas over those that are stated; `tau_s`: of the time-correlated half of the errors.
double nees_of_errors(double factor, double tau_s, bool with_bearings) {
  constexpr int kCount = 8, kAll = 600, kJudged = 400;
  double sum = 0;
  all_by_default();
  for (int map = 0; map < kMaps; map++) {
    begin_among(kCount, 0.0);
    truth = {};
    now_s = 0.0;
    double lasting[kCount][2];
    const double left = std::exp(-0.1 / tau_s);
    for (int i = 0; i < kAll; i++) {
      feed(make::twist(now_s, 0.5, 0.25));
      for (int k = 0; k < kCount; k++) {
        const uint64_t of = static_cast<uint64_t>(20000 + 100 * map + 2 * k);
        for (int c = 0; c < 2; c++) {
          const double fresh = normal(of, 2 * i + c);
          lasting[k][c] = i == 0 ? fresh : left * lasting[k][c] + std::sqrt(1 - left * left) * fresh;
        }
        const auto [bearing, range] = view_of(landmarks[k].p_m[0], landmarks[k].p_m[1]);
        const double seen_rad = bearing + factor * 0.02 * (normal(of + 1, 2 * i) + lasting[k][0]);
        const double seen_m = range + factor * 0.1 * (normal(of + 1, 2 * i + 1) + lasting[k][1]);
        feed(make::sighting(now_s, k, with_bearings ? wm::wrap(seen_rad) : std::nan(""), seen_m));
      }
      if (i >= kAll - kJudged) sum += nees_from(truth) / 3.0 / (kMaps * kJudged);
      go_on(0.5, 0.25, 0.1);
    }
  }
  return sum;
}

// All sigmas are three times as large as stated: of anchors that are wrong for a whole drive, by eight times the sigma
// of that part, and of landmarks.
TEST(test_time_correlated_errors_that_are_larger_than_stated_are_found) {
  for (const bool landmarks_seen : {false, true}) {
    const double nees = nees_of_errors(3.0, landmarks_seen ? 2.0 : 1000.0, landmarks_seen);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(landmarks_seen ? 1.2 : 2.4, nees, landmarks_seen ? "landmarks" : "anchors");
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.2, nees);
  }
}

// Wheels whose radii differ by 1 %: on a straight the counts turn, and the robot doesn't.
TEST(test_a_straight_is_no_evidence_of_the_sign_of_a_turn) {
  all_by_default();
  setup.wheels = make::two_wheels();
  sensor = make::sensor("eye", 0.005, NAN);
  begin_among(6, 0.02);
  const double tick_m = 2 * M_PI * 0.1 / 1000;
  for (int i = 0; i < 300; i++) {
    const double t_s = 0.05 * i, x_m = 0.02 * i;
    feed(make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(x_m / tick_m)},
                                {WM_Q_WHEEL_TICKS_RIGHT, std::floor(0.99 * x_m / tick_m)}}));
    for (int k = 0; k < 6; k++) {
      const double bearing = view_of(landmarks[k].p_m[0], landmarks[k].p_m[1], {x_m, 0, 0}).bearing_rad;
      feed(make::sighting(t_s, k, bearing + 0.005 * normal(900 + static_cast<uint64_t>(k), i), NAN));
    }
    TEST_ASSERT_DOUBLE_IS_NAN(value_of("motion.turn_factor"));
  }
}

}  // namespace

void setUp(void) {
  prepare_ekf(make::sensor("eye", 0.02, 0.1));
  make::sightings.map_slots = 16;
  start_at({}, 0.5, 0.05);
}
