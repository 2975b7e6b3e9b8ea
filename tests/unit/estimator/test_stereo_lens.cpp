// SPDX-License-Identifier: Apache-2.0
// stereo_ekf: focal lengths and the principal point of the pair as states.
#include <vector>

#include "stereo_scene.hpp"

using namespace wm;

namespace {

constexpr int kValues = 4;
const char *const kNames[kValues] = {"stereo.focal_scale_u", "stereo.focal_scale_v", "stereo.centre_u_px",
                                     "stereo.centre_v_px"};
// True over calibrated focal lengths, and true less calibrated principal point, px.
constexpr double kTrue[kValues] = {1.004, 0.997, 1.5, -1.0};

void calibrate_wrongly(scene *s) {
  double *px = s->rig.stereo.rectified_px;
  px[0] = kFocal / kTrue[0];
  px[1] = kFocal / kTrue[1];
  px[2] = kCu - kTrue[2];
  px[3] = kCv - kTrue[3];
}

void use_lens_states(scene *s) {
  s->set("states.camera_focal_sigma", 0.004);
  s->set("states.camera_centre_sigma_px", 1.0);
}

void find_points(scene *s) {
  s->set("slam.points", 100);
  s->set("slam.keep_unseen_steps", 3);
  s->set("slam.keep_outside_s", 0);
  s->map.clear();
  s->setup.start.sigma_heading_rad = 0.001;
}

struct outcome {
  double turn_rad, turn_sigmas;  // error of the heading
  wm_calibration_value values[kValues];
};

// A turn and a half on a circle, among points that are known or found on the way.
outcome turn_round(scene *s) {
  s->begin();
  for (int i = 0; i < 600; i++) {
    s->swim(0.05, {0.3, 0, 0}, {0.1 * std::sin(0.1 * i), 0, 0.314});
    if (i % 2 == 1) s->look();
  }
  outcome out{};
  const wm_estimate at = s->estimate();
  const vec3 off = turn_of(conjugate(quat_of(at.pose_map_base.q_xyzw)) * s->truth.q);
  out.turn_rad = off.z;
  out.turn_sigmas = std::fabs(off.z) / std::sqrt(at.covariance[wm_cov_index(5, 5)]);
  for (int k = 0; k < kValues; k++) out.values[k] = s->calibrated(kNames[k]);
  return out;
}

void assert_found(const outcome &at, const double most_sigma[kValues]) {
  for (int k = 0; k < kValues; k++) {
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * at.values[k].sigma, kTrue[k], at.values[k].value);
    TEST_ASSERT_LESS_THAN_DOUBLE(most_sigma[k], at.values[k].sigma);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, at.values[k].sigma);
  }
}

}  // namespace

TEST(test_known_points_calibrate_the_lens) {
  scene s;
  calibrate_wrongly(&s);
  use_lens_states(&s);
  const double most[kValues] = {0.001, 0.001, 0.3, 0.3};
  const outcome at = turn_round(&s);
  assert_found(at, most);
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0, at.turn_sigmas);
}

// Points found on the way turn with what the focal length is wrong by: 0.4 % of a turn and a half is 38 mrad. With
// exact gyros the difference shows the focal length.
TEST(test_points_on_the_way_calibrate_the_lens) {
  scene s;
  calibrate_wrongly(&s);
  use_lens_states(&s);
  find_points(&s);
  const double most[kValues] = {0.002, 0.003, 0.9, 0.9};
  const outcome at = turn_round(&s);
  assert_found(at, most);
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0, at.turn_sigmas);
  scene without;
  calibrate_wrongly(&without);
  find_points(&without);
  const outcome wrong = turn_round(&without);
  TEST_ASSERT_GREATER_THAN_DOUBLE(4.0, wrong.turn_sigmas);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5 * std::fabs(wrong.turn_rad), std::fabs(at.turn_rad));
}

// A new point's place has the error of the lens. The same picture again has that error, too: its innovation has the
// pixels' noise alone, once by the point and once by the picture.
TEST(test_a_new_point_errs_as_the_lens_does) {
  scene s;
  s.set("states.camera_focal_sigma", 0.05);
  s.set("states.camera_centre_sigma_px", 20.0);
  find_points(&s);
  s.noise_v = s.noise_w = 0.0;
  s.begin();
  s.say_twist({0, 0, 0}, {0, 0, 0});
  int seen = 0;
  for (const wm_landmark &l : s.points) {
    double px[4];
    if (!s.pixels(l, px)) continue;
    seen++;
    const double z = l.p_m[0], y = -l.p_m[2];
    TEST_ASSERT_EQUAL(WM_OK, s.take(s.seen(l, px)));
    wm_landmark listed[256];
    const size_t count = s.ekf->landmarks(s.state, listed, nullptr, 256);
    // By the focal lengths (0, y, z) and (0, -y, 0), by the centre (z / f, 0, 0) and (0, z / f, 0).
    const double least_m2 = square(0.05) * (z * z + 2 * y * y) + 2 * square(20.0 * z / kFocal);
    for (size_t i = 0; i < count; i++)
      if (listed[i].id == l.id) TEST_ASSERT_GREATER_THAN_DOUBLE(std::sqrt(least_m2 / 3), listed[i].sigma_m);
    wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX] = {};
    const std::vector<char> copy = s.copy();
    TEST_ASSERT_EQUAL(WM_OK, s.take(s.seen(l, px), records));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, records[0].observed - records[0].expected);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 2 * square(0.5), records[0].variance);
    std::memcpy(s.state, copy.data(), s.bytes);
  }
  TEST_ASSERT_GREATER_THAN(5, seen);
}
