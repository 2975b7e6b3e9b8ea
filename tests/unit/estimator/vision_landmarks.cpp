// SPDX-License-Identifier: Apache-2.0
// Known landmarks in drawn fisheye pictures: found where they are, with the sigma that they have; not found where they
// are hidden, changed, dark or elsewhere, and why.
#include <vector>

#include "common/eyes.hpp"
#include "common/fisheye_rig.hpp"
#include "vision/landmarks/params.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/random.h"

namespace {

constexpr uint32_t kWidth = 480, kHeight = 300;
constexpr int kSignSide = 96;
constexpr double kSize_m = 1.0, kBoard = 4.5;
const int32_t kCamera = 0;

wm_rig rig;
wm_view view;
wm_landmark landmark;
std::vector<uint8_t> sign;
wm_appearance appearance;
wm_landmarks_params params;

// A ring with a bar and a letter's stroke: no symmetry.
double sign_at(double x, double y) {
  const double r = std::sqrt(x * x + y * y);
  if (std::fabs(x) > 0.48 || std::fabs(y) > 0.48) return 30;
  if (r > 0.3 && r < 0.44) return 60;
  if (std::fabs(y - 0.1 - 0.3 * x) < 0.07 && r < 0.3) return 40;
  if (std::fabs(x + 0.12) < 0.05 && y < 0 && r < 0.3) return 70;
  return 210;
}

// A shop's board: strokes of letters, no two alike. x in its heights, from the middle.
double board_at(double x, double y) {
  if (std::fabs(x) > 0.5 * kBoard - 0.1 || std::fabs(y) > 0.4) return 60;
  const auto letter = static_cast<uint64_t>((x + kBoard) * 2.5), part = static_cast<uint64_t>((y + 1) * 3);
  return wm_random_uniform(21, letter, part) < 0.5 ? 40 : 220;
}

bool is_board;

struct Place {
  double x_m = 0, y_m = 0, heading_rad = 0;
};

// What the camera sees from there: the sign before a wall of soft stripes.
struct Scene {
  bool there = true, other = false, hidden = false;
  double light = 1, offset = 0, noise = 2;
  uint64_t seed = 1;
};

// Rays of the four parts of each pixel, in base_link.
const std::vector<wm::vec3> &rays_of(const wm::mounted_camera &camera) {
  static std::vector<wm::vec3> rays;
  for (uint32_t v = 0; rays.size() < 4 * kWidth * kHeight; v++)
    for (uint32_t u = 0; u < kWidth; u++)
      for (int i = 0; i < 4; i++) {
        wm::vec3 ray = {0, 0, 0};
        (void)wm::unproject(camera.optics, {u - 0.25 + 0.5 * (i % 2), v - 0.25 + 0.5 * (i / 2)}, &ray);
        rays.push_back(camera.R_base_optical * ray);
      }
  return rays;
}

std::vector<uint8_t> draw(const Place &at, const Scene &scene) {
  wm::mounted_camera camera;
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, rig.cameras[0]));
  const double yaw = appearance.yaw_rad, c = std::cos(at.heading_rad), s = std::sin(at.heading_rad);
  const double nx = std::sin(yaw), ny = -std::cos(yaw);
  std::vector<uint8_t> out(kWidth * kHeight);
  const std::vector<wm::vec3> &rays = rays_of(camera);
  for (uint32_t v = 0; v < kHeight; v++)
    for (uint32_t u = 0; u < kWidth; u++) {
      double sum = 0;
      for (size_t i = 0; i < 4; i++) {
        double grey = 90;
        const wm::vec3 &d = rays[4 * (v * kWidth + u) + i];
        if (wm::length(d) > 0) {
          const double dx = c * d.x - s * d.y, dy = s * d.x + c * d.y;
          const double ex = at.x_m + c * camera.centre_m.x - s * camera.centre_m.y,
                       ey = at.y_m + s * camera.centre_m.x + c * camera.centre_m.y;
          const double along = nx * dx + ny * dy,
                       far = (nx * (landmark.p_m[0] - ex) + ny * (landmark.p_m[1] - ey)) / along;
          if (std::fabs(along) > 1e-9 && far > 0) {
            const double px = ex + far * dx - landmark.p_m[0], py = ey + far * dy - landmark.p_m[1],
                         pz = camera.centre_m.z + far * d.z - landmark.p_m[2];
            const double a = (px * std::cos(yaw) + py * std::sin(yaw)) / kSize_m, b = pz / kSize_m;
            grey = 90 + 25 * std::sin(3 * a) + 15 * std::sin(4 * b + a);
            if (scene.there && std::fabs(a) < (is_board ? 0.5 * kBoard : 0.5) && std::fabs(b) < 0.5)
              grey = is_board ? board_at(a, b) : scene.other ? sign_at(b, a) : sign_at(a, b);
            if (scene.hidden && std::fabs(a - 0.2) < 0.3 && b < 0.3) grey = 50;
          }
        }
        sum += grey;
      }
      const double noise = scene.noise * wm_random_normal(scene.seed, 3, v * kWidth + u);
      out[v * kWidth + u] = static_cast<uint8_t>(
          std::fmin(255, std::fmax(0, std::floor(scene.light * sum / 4 + scene.offset + noise + 0.5))));
    }
  return out;
}

wm_estimate pose_of(const Place &at, double sigma_m, double sigma_rad) {
  wm_estimate e{};
  e.t_ns = 5000;
  e.pose_map_base.p_m[0] = at.x_m;
  e.pose_map_base.p_m[1] = at.y_m;
  e.pose_map_base.q_xyzw[2] = std::sin(0.5 * at.heading_rad);
  e.pose_map_base.q_xyzw[3] = std::cos(0.5 * at.heading_rad);
  e.heading_rad = at.heading_rad;
  e.state = WM_STATE_TRACKING;
  e.dof = 3;
  e.covariance[wm_cov_index(0, 0)] = e.covariance[wm_cov_index(1, 1)] = sigma_m * sigma_m;
  e.covariance[wm_cov_index(5, 5)] = sigma_rad * sigma_rad;
  return e;
}

struct Eyes : wm::drawn::eyes {
  Eyes() : eyes("landmarks") {
    as<wm_landmarks_params>() = ::params;
    begin(view);
  }
  size_t look(const std::vector<uint8_t> &picture, const wm_estimate *prediction, wm_time_ns t_ns = 5000) {
    const wm_frame frame = wm::drawn::frame_of(picture, kWidth, kHeight, t_ns);
    return eyes::look(&frame, prediction);
  }
  wm_looked_for looked_for() const {
    wm_looked_for one{};
    TEST_ASSERT_EQUAL(1, detector->looked_for(state.get(), &one, 1));
    return one;
  }
  wm_look why() const { return static_cast<wm_look>(looked_for().look); }
};

// By the calibration's own geometry: the landmark in the camera's optical axes.
wm::vec3 true_ray(const Place &at) {
  wm::mounted_camera camera;
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, rig.cameras[0]));
  const double c = std::cos(at.heading_rad), s = std::sin(at.heading_rad);
  const double dx = landmark.p_m[0] - at.x_m, dy = landmark.p_m[1] - at.y_m;
  const wm::vec3 base = {c * dx + s * dy, c * dy - s * dx, landmark.p_m[2]};
  return wm::transposed_times(camera.R_base_optical, base - camera.centre_m);
}

// The angle to the left of the camera's axis, and above its xy plane.
double true_bearing(const Place &at) {
  const wm::vec3 r = true_ray(at);
  return std::atan2(-r.x, r.z);
}

double true_elevation(const Place &at) {
  const wm::vec3 r = true_ray(at);
  return std::atan2(-r.y, std::hypot(r.x, r.z));
}

TEST(found_where_it_is_with_the_sigma_that_it_has) {
  Eyes eyes;
  double squares = 0, up_squares = 0, largest = 0;
  int count = 0;
  for (uint64_t i = 0; i < 24; i++) {
    const auto random = [i](uint64_t k) { return 2 * wm_random_uniform(9, k, i) - 1; };
    const Place at = {1.5 + 1.5 * random(1), 1.2 * random(2), 0.5 * random(3)};
    const Place believed = {at.x_m + 0.08 * random(4), at.y_m + 0.08 * random(5), at.heading_rad + 0.015 * random(6)};
    Scene scene;
    scene.seed = i + 1;
    scene.light = 0.7 + 0.25 * random(7);
    const wm_estimate guess = pose_of(believed, 0.05, 0.01);
    if (eyes.look(draw(at, scene), &guess) != 1) continue;
    const wm_sighting &seen = eyes.events[0].as.sighting;
    TEST_ASSERT_EQUAL(7, seen.landmark_id);
    TEST_ASSERT_EQUAL_INT64(5000, eyes.events[0].t_ns);
    const double off = std::remainder(seen.bearing_rad - true_bearing(at), 2 * M_PI);
    squares += off * off / (seen.bearing_sigma_rad * seen.bearing_sigma_rad);
    const double up_off = seen.elevation_rad - true_elevation(at);
    up_squares += up_off * up_off / (seen.elevation_sigma_rad * seen.elevation_sigma_rad);
    largest = std::fmax(largest, std::fmax(std::fabs(off), std::fabs(up_off)));
    count++;
  }
  std::printf("found %d of 24, off by at most %.4f degrees, %.2f of its sigma, elevations %.2f\n", count,
              largest * 180 / M_PI, std::sqrt(squares / count), std::sqrt(up_squares / count));
  TEST_ASSERT_GREATER_OR_EQUAL(22, count);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.001, largest);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.3, std::sqrt(squares / count));
  TEST_ASSERT_LESS_THAN_DOUBLE(1.3, std::sqrt(up_squares / count));
}

TEST(a_landmark_without_sigma_is_found) {
  landmark.sigma_m = NAN;
  Eyes eyes;
  const Place at = {1.5, 0.2, 0.1};
  const wm_estimate guess = pose_of(at, 0.05, 0.01);
  TEST_ASSERT_EQUAL(1, eyes.look(draw(at, {}), &guess));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, eyes.events[0].as.sighting.bearing_sigma_rad);
}

TEST(what_is_not_there_is_not_found_and_said_why) {
  Eyes eyes;
  const Place at = {1, 0.3, 0.1};
  const wm_estimate guess = pose_of(at, 0.03, 0.01);
  const auto why = [&](const Scene &scene) {
    TEST_ASSERT_EQUAL(0, eyes.look(draw(at, scene), &guess));
    return eyes.why();
  };
  Scene gone, other, hidden, dark;
  gone.there = false;
  other.other = true;
  hidden.hidden = true;
  dark.light = 0.01;
  dark.noise = 0.5;
  const wm_look without = why(gone);
  TEST_ASSERT_TRUE(without == WM_LOOK_UNLIKE || without == WM_LOOK_BLURRED);
  TEST_ASSERT_EQUAL(WM_LOOK_UNLIKE, why(other));
  TEST_ASSERT_EQUAL(WM_LOOK_UNLIKE, why(hidden));
  TEST_ASSERT_EQUAL(WM_LOOK_LOW_CONTRAST, why(dark));
  TEST_ASSERT_EQUAL(1, eyes.look(draw(at, Scene{}), &guess));
  TEST_ASSERT_EQUAL(WM_LOOK_FOUND, eyes.why());
}

TEST(found_anywhere_without_a_pose) {
  Eyes eyes;
  int found = 0;
  double largest = 0, squares = 0;
  for (uint64_t i = 0; i < 24; i++) {
    const auto random = [i](uint64_t k) { return 2 * wm_random_uniform(11, k, i) - 1; };
    const Place at = {2 + 1.5 * random(1), 1.5 * random(2), 0.7 * random(3)};
    Scene scene;
    scene.seed = i + 1;
    scene.light = 0.8 + 0.2 * random(4);
    if (eyes.look(draw(at, scene), nullptr) == 0) continue;
    const wm_sighting &seen = eyes.events[0].as.sighting;
    TEST_ASSERT_EQUAL(7, seen.landmark_id);
    const double off = std::remainder(seen.bearing_rad - true_bearing(at), 2 * M_PI);
    squares += off * off / (seen.bearing_sigma_rad * seen.bearing_sigma_rad);
    largest = std::fmax(largest, std::fabs(off));
    found++;
    scene.there = false;
    TEST_ASSERT_EQUAL(0, eyes.look(draw(at, scene), nullptr));
    TEST_ASSERT_EQUAL(WM_LOOK_UNCERTAIN, eyes.why());
    scene.there = scene.other = true;
    TEST_ASSERT_EQUAL(0, eyes.look(draw(at, scene), nullptr));
  }
  std::printf("without a pose: found %d of 24, off by at most %.4f degrees, %.2f of its sigma\n", found,
              largest * 180 / M_PI, std::sqrt(squares / found));
  TEST_ASSERT_GREATER_OR_EQUAL(16, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, std::sqrt(squares / found));
}

// How many of 8 pictures from there (12 m away) it is found in without a pose, each time where it is.
int found_from_afar() {
  int found = 0;
  Eyes eyes;
  for (uint64_t i = 0; i < 8; i++) {
    const auto random = [i](uint64_t k) { return 2 * wm_random_uniform(13, k, i) - 1; };
    const Place at = {-6 + 0.5 * random(1), 2 * random(2), 0.5 * random(3)};
    Scene scene;
    scene.seed = i + 1;
    if (eyes.look(draw(at, scene), nullptr) == 0) continue;
    found++;
    const wm_sighting &seen = eyes.events[0].as.sighting;
    TEST_ASSERT_DOUBLE_WITHIN(4 * seen.bearing_sigma_rad, 0,
                              std::remainder(seen.bearing_rad - true_bearing(at), 2 * M_PI));
    if (i % 4 != 0) continue;
    scene.there = false;
    TEST_ASSERT_EQUAL(0, eyes.look(draw(at, scene), nullptr));
  }
  return found;
}

TEST(found_without_a_pose_where_it_has_thirteen_pixels) {
  params.likeness_alone = 0.85;  // so few are never very much alike, and no others are there to agree
  const int found = found_from_afar();
  std::printf("without a pose, 12 m away: found %d of 8\n", found);
  TEST_ASSERT_GREATER_OR_EQUAL(3, found);
}

TEST(what_is_too_small_is_not_recognised) {
  params.likeness_alone = 0.85;
  params.search_area_px2 = 300;
  TEST_ASSERT_EQUAL(0, found_from_afar());
}

TEST(a_wide_board_is_found_without_a_pose) {
  is_board = true;
  std::vector<uint8_t> board(kSignSide * 432);
  for (int y = 0; y < kSignSide; y++)
    for (int x = 0; x < 432; x++)
      board[static_cast<size_t>(y * 432 + x)] =
          static_cast<uint8_t>(board_at((x + 0.5) / kSignSide - 0.5 * kBoard, 0.5 - (y + 0.5) / kSignSide));
  appearance = {7, 432, kSignSide, board.data(), kBoard * kSize_m, kSize_m, appearance.yaw_rad};
  const int found = found_from_afar();
  std::printf("a board without a pose, 12 m away: found %d of 8\n", found);
  TEST_ASSERT_GREATER_OR_EQUAL(6, found);
}

// Recognised once, it is found from picture to picture by how the robot moves, although nobody knows where that is.
TEST(what_was_recognised_is_followed) {
  params.search_places = 1;  // the landmarks have their turn one by one, a picture each
  const wm_landmark first = landmark;
  std::vector<uint8_t> other(sign.rbegin(), sign.rend());
  wm_landmark all[12];
  wm_appearance looks[12];
  for (int i = 0; i < 12; i++) {
    all[i] = first;
    looks[i] = appearance;
    if (i == 0) continue;
    all[i].id = looks[i].landmark_id = 20 + i;
    all[i].p_m[0] = -30;  // nowhere near
    looks[i].yaw_rad += M_PI;
    looks[i].grey = other.data();
  }
  view.landmarks = all;
  view.appearances = looks;
  view.landmark_count = view.appearance_count = 12;
  Eyes eyes;
  int followed = 0;
  wm_estimate moving = pose_of({0, 0, 0}, 1, 1);
  moving.state = WM_STATE_SEARCHING;
  moving.v_mps[0] = 2;
  moving.w_radps[2] = 0.5;
  for (int i = 0; i < 10; i++) {
    const double t_s = 0.1 * i, a = 0.5 * t_s;  // an arc of 4 m
    const Place at = {1 + 4 * std::sin(a), 4 - 4 * std::cos(a), a};
    Scene scene;
    scene.seed = static_cast<uint64_t>(i + 1);
    const wm_time_ns t_ns = 5000 + i * 100 * WM_NS_PER_MS;
    moving.t_ns = t_ns;
    const size_t count = eyes.look(draw(at, scene), &moving, t_ns);
    for (size_t k = 0; k < count; k++) {
      if (eyes.events[k].as.sighting.landmark_id != 7) continue;
      TEST_ASSERT_DOUBLE_WITHIN(0.002, 0,
                                std::remainder(eyes.events[k].as.sighting.bearing_rad - true_bearing(at), 2 * M_PI));
      followed++;
    }
  }
  TEST_ASSERT_EQUAL(10, followed);
}

// Nobody knows where the robot is, and its twist or stamp is nonsense: it is looked for from scratch.
TEST(a_motion_that_is_no_number_misleads_nothing) {
  Eyes eyes;
  const Place at = {2, 0.4, 0.2};
  const auto picture = draw(at, Scene{});
  const double nonsense[] = {0, NAN, INFINITY, 1e300, 0};
  wm_estimate moving = pose_of({0, 0, 0}, 1, 1);
  moving.state = WM_STATE_SEARCHING;
  for (int i = 0; i < 5; i++) {
    moving.v_mps[0] = moving.w_radps[2] = nonsense[i];
    moving.t_ns = i == 4 ? WM_TIME_NONE : 5000;
    TEST_ASSERT_EQUAL(1, eyes.look(picture, &moving, 5000 + i * 100 * WM_NS_PER_MS));
    TEST_ASSERT_DOUBLE_WITHIN(0.002, true_bearing(at), eyes.events[0].as.sighting.bearing_rad);
  }
}

// A pose that leads to nothing is doubted after a while.
TEST(carried_off_it_is_found_where_it_is) {
  Eyes eyes;
  const auto picture = draw({2, 0.4, 0.2}, Scene{});
  wm_estimate wrong = pose_of({1, -3, -0.6}, 0.03, 0.01);
  int looks = 0;
  for (wm_time_ns t_ns = 0; t_ns <= 600 * WM_NS_PER_MS; t_ns += 200 * WM_NS_PER_MS, looks++) {
    wrong.t_ns = t_ns;
    TEST_ASSERT_EQUAL(t_ns > 500 * WM_NS_PER_MS ? 1 : 0, eyes.look(picture, &wrong, t_ns));
  }
  TEST_ASSERT_EQUAL(4, looks);
}

TEST(a_pose_that_says_nothing_guides_nowhere) {
  params.search_places = 0;
  Eyes eyes;
  const Place at = {1, 0, 0};
  const auto picture = draw(at, Scene{});
  TEST_ASSERT_EQUAL(0, eyes.look(picture, nullptr));
  TEST_ASSERT_EQUAL(WM_LOOK_UNCERTAIN, eyes.why());
  wm_estimate guess = pose_of(at, 2, 0.5);
  TEST_ASSERT_EQUAL(0, eyes.look(picture, &guess));
  TEST_ASSERT_EQUAL(WM_LOOK_UNCERTAIN, eyes.why());
  guess = pose_of(at, 0.03, 0.01);
  guess.state = WM_STATE_LOST;
  TEST_ASSERT_EQUAL(0, eyes.look(picture, &guess));
  guess = pose_of({20, 0, 0}, 0.03, 0.01);  // behind the sign
  TEST_ASSERT_EQUAL(0, eyes.look(picture, &guess));
  guess = pose_of({1, 0, 3}, 0.03, 0.01);
  TEST_ASSERT_EQUAL(0, eyes.look(picture, &guess));
  TEST_ASSERT_EQUAL(WM_LOOK_NOT_IN_VIEW, eyes.why());
  guess = pose_of({-30, 0, 0}, 0.03, 0.01);
  TEST_ASSERT_EQUAL(0, eyes.look(picture, &guess));
  TEST_ASSERT_EQUAL(WM_LOOK_TOO_SMALL, eyes.why());
}

TEST(a_moving_robot_is_expected_where_it_was) {
  Eyes eyes;
  const Place at = {1, 0, 0};
  wm_estimate guess = pose_of({1.3, 0, 0.06}, 0.02, 0.005);  // 0.1 s later, at 3 m/s and 0.6 rad/s
  guess.t_ns += 100000000;
  guess.v_mps[0] = 3;
  guess.w_radps[2] = 0.6;
  TEST_ASSERT_EQUAL(1, eyes.look(draw(at, Scene{}), &guess));
  TEST_ASSERT_DOUBLE_WITHIN(0.001, true_bearing(at), eyes.events[0].as.sighting.bearing_rad);
}

TEST(rows_have_their_own_times) {
  rig.cameras[0].readout_ns = 20000000;
  Eyes eyes;
  const Place at = {1, 0, 0};
  const wm_estimate guess = pose_of(at, 0.02, 0.005);
  TEST_ASSERT_EQUAL(1, eyes.look(draw(at, Scene{}), &guess));
  const double row = eyes.looked_for().found_px[1] / (kHeight - 1) - 0.5;
  TEST_ASSERT_INT64_WITHIN(2, 5000 + std::llround(row * 20e6), eyes.events[0].t_ns);
}

TEST(pictures_of_another_maps_landmarks_are_refused) {
  const Eyes eyes;
  landmark.id = 8;
  eyes.expect_refused(view, "are they of one map?");
}

}  // namespace

void setUp() {
  rig = wm::drawn::rig_of({wm::drawn::fisheye(kWidth, kHeight, 159, {{0.5, 0.1, 1.2}, {0.01, -0.07, 0.2}},
                                              {-0.011, 0.004, -0.002, 0.0003})});
  landmark = {7, {6, 0.5, 2.0}, 0.02, static_cast<double>(NAN), {0, 0, 0}, 0};
  sign.resize(kSignSide * kSignSide);
  for (int y = 0; y < kSignSide; y++)
    for (int x = 0; x < kSignSide; x++)
      sign[static_cast<size_t>(y * kSignSide + x)] =
          static_cast<uint8_t>(sign_at((x + 0.5) / kSignSide - 0.5, 0.5 - (y + 0.5) / kSignSide));
  is_board = false;
  appearance = {7, kSignSide, kSignSide, sign.data(), kSize_m, kSize_m, -M_PI / 2 + 0.2};
  view = {&rig, &kCamera, &landmark, 1, &appearance, 1, nullptr, 0};
  wm_params_defaults(&wm_landmarks_params_table, &params);
}
