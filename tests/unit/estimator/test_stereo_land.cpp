// SPDX-License-Identifier: Apache-2.0
// stereo_ekf on a street: far tracks that drift, others that move by themselves, a lorry in front, a camera that
// repeats a picture.
#include "filters/stereo_ekf/picture_motion.hpp"
#include "stereo_scene.hpp"

namespace {

// Tracks on both sides of a street. A share of them drives along; each drifts by `drift_px` in each picture.
struct street {
  static constexpr int kTracks = 90;
  scene s;
  vec3 place[kTracks], speed[kTracks];
  double drift[kTracks][2] = {};
  int32_t id[kTracks];
  int32_t next = 1;
  double moving = 0.4, drift_px = 0.5, rates_too_large = 1.0;
  // From 6 s on a lorry in front keeps its distance; this share of the tracks is on it.
  double on_lorry = 0.0;
  bool is_on_lorry[kTracks] = {};
  vec3 from_lorry[kTracks];
  uint64_t seed;

  explicit street(uint64_t seed_) : seed(seed_) {
    wm_params_defaults(&s.ekf->params, s.params.data());
    s.rig.stereo.baseline_m = 0.54;
    for (double &sigma : s.rig.stereo.sigma_px) sigma = 1.0;
    s.map.clear();
    s.draws = seed << 32U;
    for (int i = 0; i < kTracks; i++) plant(i);
  }
  double uniform() { return wm_random_uniform(31, seed, s.draws++); }
  void plant(int i) {
    const vec3 ahead = {10 + 40 * uniform(), (uniform() < 0.5 ? -1.0 : 1.0) * (3 + 8 * uniform()), -1 + 5 * uniform()};
    place[i] = s.truth.p + matrix_of(s.truth.q) * ahead;
    speed[i] = uniform() < moving ? vec3{6 * s.noise(), 2 * s.noise(), 0} : vec3{0, 0, 0};
    drift[i][0] = drift[i][1] = 0;
    is_on_lorry[i] = on_lorry > 0.0 && s.t_s >= 6 && uniform() < on_lorry;
    if (is_on_lorry[i]) from_lorry[i] = {12 + uniform(), 8 * uniform() - 4, 3 * uniform()};
    id[i] = next++;
  }
  bool pixels(int i, double px[4]) const {
    const vec3 b = transposed_times(matrix_of(s.truth.q), place[i] - s.truth.p);
    if (b.x < 4) return false;
    for (int side = 0; side < 2; side++) {
      px[2 * side] = kCu + kFocal * (-b.y - side * s.rig.stereo.baseline_m) / b.x + drift[i][0];
      px[2 * side + 1] = kCv - kFocal * b.z / b.x + drift[i][1];
      if (px[2 * side] < 0 || px[2 * side] > 639 || px[2 * side + 1] < 0 || px[2 * side + 1] > 479) return false;
    }
    return true;
  }
  // What the pair sees now.
  void look(double dt_s) {
    for (int i = 0; i < kTracks; i++) {
      place[i] = is_on_lorry[i] ? s.truth.p + matrix_of(s.truth.q) * from_lorry[i] : place[i] + dt_s * speed[i];
      for (double &d : drift[i]) d += drift_px * s.noise();
      double px[4];
      if (!pixels(i, px)) {
        plant(i);
        if (!pixels(i, px)) continue;
      }
      for (double &value : px) value += 0.2 * s.noise();
      wm_event e = make::empty(s.t_s, WM_EVENT_STEREO);
      e.as.stereo = {id[i], {px[0], px[1]}, {px[2], px[3]}, {}};
      TEST_ASSERT_EQUAL(WM_OK, s.take(e));
    }
  }
  void say(const vec3 &v, const vec3 &w) { s.tell(make::log6(s.t_s, v, w)); }
  // 20 s at 8 m/s, without a log from rest; the log is 1 % short and 2 degrees askew.
  void drive(bool pictures, bool log = true) {
    s.begin();
    const vec3 tilt = {0, 0.02, -0.035};
    for (int i = 0; i < 200; i++) {
      const vec3 v = {log || i >= 40 ? 8.0 : 0.2 * i, 0, 0}, w = {0, 0, i / 50 == 1 ? 0.15 : i / 50 == 2 ? -0.15 : 0};
      if (log)
        say(0.99 * (v - cross(tilt, v)) + 0.02 * vec3{s.noise(), s.noise(), s.noise()},
            rates_too_large * w + 0.003 * vec3{s.noise(), s.noise(), s.noise()});
      if (pictures) look(0.1);
      s.truth.p = s.truth.p + matrix_of(s.truth.q) * (0.1 * (mean_turn(0.1 * w) * v));
      s.truth.q = normalized(s.truth.q * turn_by(0.1 * w));
      s.t_s += 0.1;
    }
    if (log) say({8, 0, 0}, {0, 0, 0});
  }
};

}  // namespace

// 40 % of the tracks move by themselves and all of them drift: the drive by pictures is several times better than that
// by the log alone, the covariance holds, and the scale is not fooled.
TEST(test_far_and_moving_tracks_improve_a_drive) {
  double with = 0, without = 0, nees = 0;
  const int drives = 8;
  for (uint64_t i = 0; i < drives; i++) {
    street seen(i), blind(i);
    seen.drive(true);
    blind.drive(false);
    with += square(seen.s.place_error()) / drives;
    without += square(blind.s.place_error()) / drives;
    nees += seen.s.nees() / drives;
    const wm_calibration_value scale = seen.s.calibrated("motion.velocity_scale");
    TEST_ASSERT_DOUBLE_WITHIN(2 * scale.sigma, 1 / 0.99, scale.value);
    TEST_ASSERT_LESS_THAN_DOUBLE(2.0, seen.s.nees());
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.4 * std::sqrt(without), std::sqrt(with));
  TEST_ASSERT_LESS_THAN_DOUBLE(1.3, nees);
}

// For 14 s most of what the pair sees is a lorry in front: what is seen beside it and before improves the drive.
TEST(test_a_lorry_in_front_is_not_followed) {
  for (const double share : {0.5, 0.8, 0.95}) {
    double with = 0, without = 0;
    const int drives = 8;
    for (uint64_t i = 0; i < drives; i++) {
      street seen(i), blind(i);
      seen.on_lorry = share;
      seen.drive(true);
      blind.drive(false);
      with += square(seen.s.place_error()) / drives;
      without += square(blind.s.place_error()) / drives;
    }
    TEST_ASSERT_LESS_THAN_DOUBLE(0.4 * std::sqrt(without), std::sqrt(with));
  }
}

// Without a log velocity and rates are states: 2 % of the 144 m, and the covariance holds.
TEST(test_a_drive_by_pictures_alone_is_honest) {
  double off_m2 = 0, nees = 0;
  const int drives = 8;
  for (uint64_t i = 0; i < drives; i++) {
    street blind(i);
    blind.s.without_motion();
    blind.drive(true, false);
    wm_event now = make::empty(blind.s.t_s, WM_EVENT_LOOKED);
    TEST_ASSERT_EQUAL(WM_OK, blind.s.take(now));
    off_m2 += square(blind.s.place_error()) / drives;
    nees += blind.s.nees() / drives;
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.02 * 144, std::sqrt(off_m2));
  TEST_ASSERT_LESS_THAN_DOUBLE(1.6, nees);
}

// Gyros that measure 5 % too much: the pictures show it, and it costs the drive little.
TEST(test_a_scale_of_the_rates_is_found) {
  double exact = 0, scaled = 0;
  const int drives = 4;
  for (uint64_t i = 0; i < drives; i++) {
    street as_stated(i), falsified(i);
    falsified.rates_too_large = 1.05;
    as_stated.drive(true);
    falsified.drive(true);
    exact += square(as_stated.s.place_error()) / drives;
    scaled += square(falsified.s.place_error()) / drives;
    const wm_calibration_value scale = falsified.s.calibrated("motion.rate_scale");
    TEST_ASSERT_DOUBLE_WITHIN(3 * scale.sigma, 1 / 1.05, scale.value);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.015, scale.sigma);
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(1.25 * std::sqrt(exact), std::sqrt(scaled));
}

// No track of a street becomes a point of the state: it is far, or its patch grows and it drifts. So it is where the
// detector's sigma is stated as a quarter of a pixel.
TEST(test_tracks_of_a_street_are_no_landmarks) {
  for (const double stated_px : {1.0, 0.25}) {
    street s(3);
    for (double &sigma : s.s.rig.stereo.sigma_px) sigma = stated_px;
    s.drive(true);
    wm_landmark found[8];
    TEST_ASSERT_LESS_THAN(stated_px < 1.0 ? 6 : 3, s.s.ekf->landmarks(s.s.state, found, nullptr, 8));
  }
}

// The camera repeats a picture: all tracks agree that nothing moved. The motion of the log stays.
TEST(test_a_repeated_picture_moves_nothing) {
  street s(5);
  s.moving = 0;
  s.s.begin();
  const vec3 v = {8, 0, 0};
  for (int i = 0; i < 30; i++) {
    s.say(v, {0, 0, 0});
    const pose3 now = s.s.truth;
    if (i > 20) s.s.truth.p = {0.8 * 20, 0, 0};
    s.look(0.0);
    s.s.truth = now;
    s.s.truth.p = s.s.truth.p + 0.1 * v;
    s.s.t_s += 0.1;
  }
  s.say(v, {0, 0, 0});
  TEST_ASSERT_LESS_THAN_DOUBLE(0.06, s.s.place_error());
}

// The fit itself: an error of the prediction is found, and a track that was cut twice is used no more.
TEST(test_a_fit_finds_the_motion_and_bans_what_moves) {
  static picture_motion tracks;
  tracks.clear();
  pair_view pair = {420, 420, 320, 240, 0.5, 0.5, {{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}}, {0.2, 0.1, 0}};
  const pose3 moved = {{0.5, 0.02, 0}, turn_by({0, 0.002, 0.01})}, predicted = {{0.45, 0, 0}, turn_by({0, 0, 0.012})};
  matrix<6> prior = 0.01 * matrix<6>::Identity();
  motion_error seen = {};
  vec3 place[60];
  for (int i = 0; i < 60; i++) {
    const auto draw = [i](uint64_t k) { return wm_random_uniform(41, k, static_cast<uint64_t>(i)); };
    place[i] = {8 + 15 * draw(1), -4 + 8 * draw(2), -2 + 4 * draw(3)};
  }
  pose3 at = {{0, 0, 0}, kNoTurn};
  for (int picture = 0; picture < 4; picture++) {
    for (int i = 0; i < 60; i++) {
      if (i < 20) place[i] = place[i] + vec3{0, i % 2 ? 0.3 : -0.4, 0};
      const vec3 b = transposed_times(matrix_of(at.q), place[i] - at.p);
      const vec3 c = transposed_times(pair.axes, b - pair.place);
      const bool used = tracks.add(i, 320 + 420 * c.x / c.z, 420 * 0.5 / c.z, 240 + 420 * c.y / c.z);
      if (picture == 3) TEST_ASSERT_EQUAL(i >= 20, used);
    }
    if (picture > 0) {
      TEST_ASSERT_TRUE(tracks.fit(pair, predicted, prior, &seen));
      tracks.count_misses();
      for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, moved.p[k] - predicted.p[k], seen.value[k]);
        TEST_ASSERT_DOUBLE_WITHIN(2e-4, turn_of(moved.q * conjugate(predicted.q))[k], seen.value[3 + k]);
      }
    }
    tracks.close(pair, moved);
    at = {at.p + matrix_of(at.q) * moved.p, normalized(at.q * moved.q)};
  }
}
