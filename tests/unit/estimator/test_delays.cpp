// SPDX-License-Identifier: Apache-2.0
// A sensor's time offset beside what repeats it: the lag of commands, and the steps of coarse counts.
#include <vector>

#include "world.hpp"

namespace {

using namespace world;

constexpr double kStep_s = 0.001, kBearing_rad = 0.01, kRange_m = 0.03, kTrack_m = 0.5, kWheel_m = 0.1;

const char *const kEstimators[] = {"landmark_ekf", "slam"};
std::vector<char> params;

wm_calibration_value found(const char *name) {
  const wm_calibration_value out = calibrated(name);
  TEST_ASSERT_FALSE_MESSAGE(std::isnan(out.value), name);
  return out;
}

void look(double t, const wm_pose2 &p, uint64_t seed, uint64_t k) {
  for (uint64_t i = 0; i < 3; i++) {
    const auto [bearing, range] = view_of(landmarks[i].p_m[0], landmarks[i].p_m[1], p);
    feed(make::sighting(t, landmarks[i].id, wm::wrap(bearing + kBearing_rad * wm_random_normal(seed, 1, 3 * k + i)),
                        range + kRange_m * wm_random_normal(seed, 2, 3 * k + i)));
  }
}

// The true drive of 120 s; commands change each two seconds, and the drive obeys them `lag_s` later with a first-order
// response of 0.15 s. Sightings of all landmarks five times a second are `offset_s` older than their stamps.
class Robot {
 public:
  Robot(double lag_s, double offset_s) : lag_s_(lag_s), offset_s_(offset_s) {}

  void drive(double ticks) {
    double v = 0, w = 0, way[2] = {0, 0};
    wm_pose2 p{};
    std::vector<wm_pose2> poses;
    std::vector<double> left, right;
    for (int k = 0; k < 120500; k++) {
      const double t = kStep_s * k, share = kStep_s / 0.15;
      poses.push_back(p);
      left.push_back(way[0]), right.push_back(way[1]);
      v += share * (speed(t - lag_s_) - v), w += share * (rate(t - lag_s_) - w);
      p.x_m += v * kStep_s * std::cos(p.heading_rad), p.y_m += v * kStep_s * std::sin(p.heading_rad);
      p.heading_rad += w * kStep_s;
      way[0] += kStep_s * (v - 0.5 * kTrack_m * w), way[1] += kStep_s * (v + 0.5 * kTrack_m * w);
    }
    const double tick_m = ticks > 0 ? 2 * M_PI * kWheel_m / ticks : 0;
    for (int k = 0; k < 3000; k++) {
      const double t = 0.04 * k;
      const auto at = size_t{40} * static_cast<size_t>(k);
      feed(ticks > 0 ? make::quantities(t, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(left[at] / tick_m)},
                                            {WM_Q_WHEEL_TICKS_RIGHT, std::floor(right[at] / tick_m)}})
                     : make::twist(t, speed(t), rate(t)));
      const double seen_s = t + 0.013 - offset_s_;
      if (k % 5 == 0 && seen_s >= 0)
        look(t + 0.013, poses[static_cast<size_t>(seen_s / kStep_s)], 1, static_cast<uint64_t>(k));
    }
  }

 private:
  static double speed(double t) { return t < 2 ? 0 : 0.4 + 0.2 * (static_cast<int>(t / 4) % 2); }
  static double rate(double t) { return t < 2 ? 0 : 0.4 * (static_cast<int>(t / 2) % 4) - 0.5; }
  double lag_s_, offset_s_;
};

// slam is without the map: its landmarks' places are unknown.
void begin_with(const char *name = "landmark_ekf") {
  estimator = wm_estimator_find(name);
  params.resize(estimator->params.bytes);
  wm_params_defaults(&estimator->params, params.data());
  chosen = params.data();
  begin();
}

// Only the sum shows, and each keeps the sigma that the two priors leave: 0.2 0.1 / sqrt(0.2^2 + 0.1^2) = 0.089 s.
TEST(test_a_lag_and_a_time_offset_are_observed_as_a_sum) {
  for (const char *name : kEstimators)
    for (const auto &[lag_s, offset_s] : {std::pair{0.3, 0.05}, {0.1, 0.15}, {0.3, -0.1}}) {
      begin_with(name);
      Robot(lag_s, offset_s).drive(0);
      const wm_calibration_value lag = found("motion.lag_s"), offset = found("camera.time_offset_s");
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.05, lag_s + offset_s, lag.value + offset.value, name);
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.015, 0.089, lag.sigma, name);
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.015, 0.089, offset.sigma, name);
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.5 * offset.sigma, offset_s, offset.value, name);
    }
}

// Squared errors by their variances, which have the mean 1, over some drives of `seconds` with 100 observations a
// second: of sightings, or of a receiver's positions.
struct normalised {
  double heading, place, delay;
};
enum class source { sightings, positions };
constexpr uint64_t kDrives = 24;
normalised at_100_hz(source seen, double sigma_m, double sigma_rad, int seconds, const char *name = "landmark_ekf") {
  wm_rig rig = {};
  rig.antenna_m[0] = 0.8, rig.antenna_m[1] = -0.5;
  setup.rig = &rig;
  normalised out = {};
  for (uint64_t drive = 0; drive < kDrives; drive++) {
    const double base = 0.3 + 0.015 * static_cast<double>(drive), phase = static_cast<double>(drive);
    wm_pose2 p = {1, -2, wm::wrap(0.7 * phase)}, before = p;
    const auto off = [drive](uint64_t of, double sigma) { return sigma * wm_random_normal(drive, 3, of); };
    start_at({p.x_m + off(0, sigma_m), p.y_m + off(1, sigma_m), wm::wrap(p.heading_rad + off(2, sigma_rad))}, sigma_m,
             sigma_rad);  // NaN: not given
    begin_with(name);
    for (uint64_t k = 0; k < 100 * static_cast<uint64_t>(seconds); k++) {
      const double t = 0.01 * static_cast<double>(k), v = base + 0.1 * std::sin(0.8 * t),
                   w = 0.5 * std::sin(0.4 * t + phase);
      const double c = std::cos(p.heading_rad), s = std::sin(p.heading_rad);
      feed(make::twist(t, v, w));
      if (seen == source::positions)
        feed(make::position(
            t, p.x_m + c * rig.antenna_m[0] - s * rig.antenna_m[1] + 0.01 * wm_random_normal(drive, 1, k),
            p.y_m + s * rig.antenna_m[0] + c * rig.antenna_m[1] + 0.01 * wm_random_normal(drive, 2, k), 0.02));
      else
        look(t, p, drive, k);
      const wm::arc a = wm::make_arc(0.01 * v, 0.01 * w);
      before = p;
      p = wm::compose(p, {a.x_m, a.y_m, a.turn_rad});
    }
    const wm_estimate now = estimate();
    const wm_calibration_value delay = found(seen == source::positions ? "gnss.time_offset_s" : "camera.time_offset_s");
    out.heading += wm::square(turned_from(before)) / now.covariance[35] / kDrives;
    out.place += wm::square(now.pose_map_base.p_m[0] - before.x_m) / now.covariance[0] / (2.0 * kDrives);
    out.place += wm::square(now.pose_map_base.p_m[1] - before.y_m) / now.covariance[7] / (2.0 * kDrives);
    out.delay += wm::square(delay.value / delay.sigma) / kDrives;
  }
  std::printf("%s, start %.2g m, %d s: heading %.2f place %.2f delay %.2f\n",
              seen == source::positions ? "positions" : "sightings", sigma_m, seconds, out.heading, out.place,
              out.delay);
  return out;
}

// Each observation corrects the heading and what the motion's calibration makes of the twist. This jitter must not make
// a delay known, nor by it the pose.
TEST(test_the_jitter_of_corrections_makes_no_delay_known) {
  const struct {
    source seen;
    double sigma_m, sigma_rad;
    int seconds;
    double most;
  } rows[] = {{source::positions, kAbsent, kAbsent, 3, 1.5},  {source::positions, kAbsent, kAbsent, 10, 1.5},
              {source::positions, kAbsent, kAbsent, 20, 2.0}, {source::sightings, kAbsent, kAbsent, 10, 1.5},
              {source::sightings, 0.3, 0.3, 2, 1.5},          {source::sightings, 0.3, 0.3, 10, 1.5},
              {source::positions, 0.3, 0.3, 10, 4.0}};  // a heading beyond what a first order carries
  for (const auto &row : rows) {
    const normalised out = at_100_hz(row.seen, row.sigma_m, row.sigma_rad, row.seconds);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.5, out.heading);
    TEST_ASSERT_LESS_THAN_DOUBLE(row.most, out.delay);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.0, out.place);
  }
}

// The places of new landmarks have the delay in common with the pose.
TEST(test_the_jitter_of_corrections_makes_no_delay_known_while_mapping) {
  for (const int seconds : {3, 10, 30}) {
    const normalised out = at_100_hz(source::sightings, 0.001, 0.001, seconds, "slam");
    TEST_ASSERT_LESS_THAN_DOUBLE(1.5, out.heading);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.5, out.delay);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.0, out.place);
  }
}

// The robot drives from the first datum on, and the delay, which may be half a second, reaches back to before it.
TEST(test_a_delay_that_reaches_back_to_before_the_first_datum) {
  make::exact_motion(&motion);
  const normalised out = at_100_hz(source::positions, 0.3, 0.02, 10);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, out.heading);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, out.delay);
}

// No lag is below 0: what the sum has below it is the offset's.
TEST(test_a_lag_at_its_limit_leaves_the_rest_to_the_offset) {
  for (const char *name : kEstimators) {
    begin_with(name);
    Robot(0.0, -0.15).drive(0);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.02, 0, found("motion.lag_s").value, name);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.07, -0.15, found("camera.time_offset_s").value, name);
  }
}

// Stamps that are too early are carried ahead of the counts by the last step of them. Steps of 12 mm must neither
// look like noise of the turns nor falsify the track.
TEST(test_coarse_counts_behind_early_stamps_leave_the_track) {
  setup.wheels = {kWheel_m, 50, kTrack_m, NAN, NAN, NAN, 0, {}, {}};
  begin_with();
  Robot(0.0, -0.15).drive(50);
  const wm_calibration_value track = found("motion.track_scale");
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 1, track.value);
  TEST_ASSERT_LESS_THAN(4, found("noise.turn_factor").value);
}

// A robot that stands, drives off and turns; its wheels' scale is anyone's. A receiver of 2 cm has no delay, of which
// the filter knows half a second only. While the delay is vague, the robot may have stood then, or driven.
double delay_of(uint64_t seed) {
  begin_with();
  const double scale = 1.0 + 0.05 * wm_random_normal(5, seed, 0);
  wm_pose2 p{};
  for (int k = 0; k < 3000; k++) {
    const double t = 0.02 * k, v = std::fmin(std::fmax(0.6 * (t - 3.0), 0.0), 0.8),
                 w = v > 0 ? 0.5 * std::sin(0.4 * t) : 0;
    const auto at = static_cast<uint64_t>(k);
    if (k % 10 == 0)
      feed(make::position(t, p.x_m + 0.02 * wm_random_normal(5, seed, 3 * at + 1),
                          p.y_m + 0.02 * wm_random_normal(5, seed, 3 * at + 2), 0.02));
    feed(make::twist(t, scale * v, w + 0.01 * wm_random_normal(5, seed, 3 * at + 3)));
    p.x_m += 0.02 * v * std::cos(p.heading_rad), p.y_m += 0.02 * v * std::sin(p.heading_rad), p.heading_rad += 0.02 * w;
  }
  return found("gnss.time_offset_s").value;
}

// 0.034 s (root mean square) and 0.088 s at most; with the derivative of one moment 0.045 and 0.133 s.
TEST(test_a_receivers_delay_is_found_when_a_robot_drives_off) {
  double squares = 0.0, worst = 0.0;
  for (uint64_t seed = 1; seed <= 40; seed++) {
    const double off_s = std::fabs(delay_of(seed));
    squares += off_s * off_s / 40;
    worst = std::fmax(worst, off_s);
  }
  std::printf("delay: %.3f s, %.3f s at most\n", std::sqrt(squares), worst);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.04, std::sqrt(squares));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.11, worst);
}

// At one speed and straight on, from the first datum, a delay and the antenna's place along the way are the same:
// neither is observed, whether the pose is given or found.
TEST(test_a_receivers_delay_is_not_observed_at_one_speed) {
  for (const bool is_given : {true, false}) {
    const double place = is_given ? 0.0 : static_cast<double>(NAN);
    start_at({place, place, place}, 1.0, 0.1);
    begin_with();
    for (int k = 0; k < 500; k++) {
      const double t = 0.02 * k;
      const auto at = static_cast<uint64_t>(3 * k);
      feed(make::twist(t, 1.5 + 0.01 * wm_random_normal(6, 1, at), 0.0));
      if (k % 10) continue;
      feed(make::position(t, 1.5 * t + 0.03 * wm_random_normal(6, 1, at + 1), 0.03 * wm_random_normal(6, 1, at + 2),
                          0.05));
      feed(make::heading(t, 0.02 * wm_random_normal(6, 2, at), 0.02));
    }
    const wm_calibration_value delay = found("gnss.time_offset_s");
    // What is left where their sum is known: 0.5 s of delay beside 0.3 m of antenna at 1.5 m/s.
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.5 * 0.2 / std::hypot(0.5, 0.2), delay.sigma);
    TEST_ASSERT_LESS_THAN_DOUBLE(3.0, std::fabs(delay.value) / delay.sigma);
  }
}

}  // namespace

void setUp() {
  prepare_ekf(make::sensor("camera", kBearing_rad, kRange_m));
  all_by_default();
  put_on_map({{5, 0}, {2, 5}, {-3, -4}}, 0);
}
