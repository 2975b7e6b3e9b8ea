// SPDX-License-Identifier: Apache-2.0
// The detector contract (waymark/detector.h) over every registered detector.
#include <vector>

#include "common/fisheye_rig.hpp"
#include "common/no_heap.h"
#include "common/suite.h"
#include "vision/edges/params.h"
#include "waymark/detector.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/random.h"

namespace {

constexpr uint32_t kWidth = 640, kHeight = 360;
constexpr size_t kEvents = 64;
const wm_detector *detector;
std::vector<char> params;
wm_rig rig;
int32_t cameras[2] = {0, 1};
wm_view view;
wm_estimate pose;  // for guided ones
std::vector<uint8_t> sign;
wm_landmark landmark;
wm_appearance appearance;
// A middle that is brighter than all about it.
wm_cascade_feature kBlock = {{0}, {0}, {4}, {4}, {1}};
wm_cascade_node kBrighter = {{0, -1}, 0, 0, {1, 0, 0, 0, 0, 0, 0, 0}};
float kLeaves[] = {1, -1};
wm_cascade_tree kTree = {0, 0};
wm_cascade_stage kStage = {0, 1, 0};
wm_cascade cascade = {1, 12, 12, 0.5, 1, 1, 2, 1, 1, &kBlock, &kBrighter, kLeaves, &kTree, &kStage};
using Picture = std::vector<uint8_t>;

void make_rig() {
  const double down_rad = 22 * M_PI / 180;
  rig = wm::drawn::rig_of({wm::drawn::fisheye(kWidth, kHeight, 260, {{0.5, 0.1, 0.4}, {0, down_rad, 0}}),
                           wm::drawn::fisheye(kWidth, kHeight, 260, {{0.5, -0.1, 0.4}, {0, down_rad, 0}})});
  rig.stereo = {0, 1, 0.2, {260, 260, 320, 180}, {1, 1, 1, 1}};
  std::strcpy(rig.marker_family, "mr");
  rig.marker_size_m = 0.2;
  // A sign on the far wall, and a pose that knows where it is.
  sign.resize(40 * 40);
  for (int i = 0; i < 1600; i++) sign[static_cast<size_t>(i)] = (i / 40 / 10 + i % 40 / 10) % 3 == 0 ? 200 : 40;
  landmark = {7, {2.9, 0, 0.4}, 0.02, static_cast<double>(NAN), {0, 0, 0}, 0};
  appearance = {7, 40, 40, sign.data(), 0.5, 0.5, -M_PI / 2};
  view = {&rig, cameras, &landmark, 1, &appearance, 1, &cascade, 1};
  pose = wm_estimate{};
  pose.t_ns = 1000;
  pose.pose_map_base.q_xyzw[3] = 1;
  pose.state = WM_STATE_TRACKING;
  pose.dof = 3;
  for (const int i : {0, 1, 5}) pose.covariance[wm_cov_index(i, i)] = 1e-4;
}

struct machine {
  void *state;
  size_t bytes;
  machine() {
    const char *why = "";
    bytes = detector->state_bytes(params.data(), &view, &why);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
    state = aligned_alloc(64, (bytes + 63) / 64 * 64);
    std::memset(state, 0xA5, bytes);
    TEST_ASSERT_EQUAL(WM_OK, detector->init(state, params.data(), &view));
  }
  ~machine() { free(state); }
};

wm_event events[kEvents];

size_t look(machine &m, const Picture &picture, wm_status expected = WM_OK, uint32_t width = kWidth) {
  wm_frame frames[2] = {};
  for (int i = 0; i < 2; i++) {
    frames[i] = {1000, 2000, 0, 7, i, width, kHeight, width, picture.data()};
  }
  size_t count = 99;
  trapped = true;
  const wm_status status = detector->detect(m.state, frames, &pose, events, kEvents, &count);
  trapped = false;
  TEST_ASSERT_EQUAL(expected, status);
  TEST_ASSERT_LESS_OR_EQUAL(kEvents, count);
  return count;
}

Picture plain(uint8_t level) { return Picture(kWidth * kHeight, level); }

Picture noise(uint64_t seed) {
  Picture p(kWidth * kHeight);
  for (size_t i = 0; i < p.size(); i++) p[i] = static_cast<uint8_t>(256 * wm_random_uniform(seed, 1, i));
  return p;
}

// A room: bright floor, dark wall at x = 3 m and at y = +-2 m, and a soft grain.
Picture room() {
  wm::mounted_camera camera;
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, rig.cameras[0]));
  Picture p(kWidth * kHeight);
  for (uint32_t v = 0; v < kHeight; v++)
    for (uint32_t u = 0; u < kWidth; u++) {
      double sum = 0;
      for (int i = 0; i < 16; i++) {  // pixels are areas
        double x, y;
        const bool hits = wm::floor_of(camera, {u - 0.375 + 0.25 * (i % 4), v - 0.375 + 0.25 * (i / 4)}, &x, &y);
        sum += hits && x < 3 && std::fabs(y) < 2 ? 140 : 60;
      }
      p[v * kWidth + u] = static_cast<uint8_t>(sum / 16 + 3 * wm_random_uniform(1, 2, v * kWidth + u));
    }
  return p;
}

void check_events(size_t count) {
  for (size_t i = 0; i < count; i++) {
    const wm_event &e = events[i];
    TEST_ASSERT_TRUE(detector->gives & WM_EVENT_BIT(e.kind));
    TEST_ASSERT_EQUAL_INT64(1000, e.t_ns);
    if (e.kind == WM_EVENT_SIGHTING) {
      const wm_sighting &seen = e.as.sighting;
      TEST_ASSERT_DOUBLE_WITHIN(3.1416, 0.0, seen.bearing_rad);
      TEST_ASSERT_GREATER_THAN_DOUBLE(0, seen.bearing_sigma_rad);
      TEST_ASSERT_TRUE(std::isnan(seen.range_m) || (seen.range_m > 0 && seen.range_sigma_m > 0));
      if (seen.landmark_id == -1) continue;  // one of a class
      TEST_ASSERT_GREATER_THAN(0, seen.landmark_id);
      for (size_t k = 0; k < i; k++) TEST_ASSERT_NOT_EQUAL(seen.landmark_id, events[k].as.sighting.landmark_id);
    }
    if (e.kind != WM_EVENT_POINTS) continue;
    const wm_points &points = e.as.points;
    TEST_ASSERT_GREATER_THAN(0, points.count);
    TEST_ASSERT_LESS_OR_EQUAL(WM_POINTS_MAX, points.count);
    TEST_ASSERT_EQUAL(0, points.camera);
    for (uint32_t k = 0; k < points.count; k++) {
      TEST_ASSERT_FLOAT_IS_DETERMINATE(points.x_m[k]);
      TEST_ASSERT_FLOAT_IS_DETERMINATE(points.y_m[k]);
      TEST_ASSERT_TRUE(std::isnan(points.normal_rad[k]) || std::fabs(points.normal_rad[k]) <= 3.1416F);
      TEST_ASSERT_TRUE(std::isnan(points.sigma_m[k]) || points.sigma_m[k] > 0);
    }
  }
}

void same_picture_same_bytes() {
  machine a, b;
  const Picture pictures[] = {room(), noise(3), room()};
  for (const Picture &p : pictures) {
    const size_t count = look(a, p);
    check_events(count);
    std::vector<wm_event> first(events, events + count);
    TEST_ASSERT_EQUAL(count, look(b, p));
    for (size_t i = 0; i < count; i++) {
      TEST_ASSERT_EQUAL(wm_event_bytes(&first[i]), wm_event_bytes(&events[i]));
      TEST_ASSERT_EQUAL_MEMORY(&first[i], &events[i], wm_event_bytes(&first[i]));
    }
  }
  TEST_ASSERT_EQUAL(0, allocations);
}

void nothing_to_see_is_nothing_seen() {
  machine m;
  for (int level : {0, 1, 90, 254, 255}) TEST_ASSERT_EQUAL(0, look(m, plain(static_cast<uint8_t>(level))));
  for (uint64_t seed = 0; seed < 4; seed++) check_events(look(m, noise(seed)));
}

void another_size_is_refused() {
  machine m;
  TEST_ASSERT_EQUAL(0, (look(m, plain(100), WM_BAD_DATA, kWidth / 2) % 99));
}

void what_does_not_go_together_is_told() {
  const char *why = nullptr;
  const wm_rig good = rig;
  for (int k = 0; k < 2; k++) rig.cameras[k].model = 77;
  TEST_ASSERT_EQUAL(0, detector->state_bytes(params.data(), &view, &why));
  TEST_ASSERT_NOT_NULL(why);
  rig = good;
  rig.camera_count = 0;
  why = nullptr;
  TEST_ASSERT_EQUAL(0, detector->state_bytes(params.data(), &view, &why));
  TEST_ASSERT_NOT_NULL(why);
  rig = good;
}

void edges_lie_where_the_wall_stands() {
  if (std::strcmp(detector->name, "edges") != 0) TEST_IGNORE_MESSAGE("another detector");
  machine m;
  TEST_ASSERT_EQUAL(1, look(m, room()));
  const wm_points &p = events[0].as.points;
  TEST_ASSERT_GREATER_THAN(60, p.count);
  uint32_t right = 0;
  for (uint32_t i = 0; i < p.count; i++) {
    const double x = static_cast<double>(p.x_m[i]), y = static_cast<double>(p.y_m[i]), side = 2 - std::fabs(y);
    const double off = std::fmin(std::fabs(x - 3), std::fabs(side)), normal = static_cast<double>(p.normal_rad[i]);
    const double expected = std::fabs(x - 3) < std::fabs(side) ? 0 : y > 0 ? M_PI / 2 : -M_PI / 2;
    right +=
        off < 3 * static_cast<double>(p.sigma_m[i]) && std::fabs(std::remainder(normal - expected, 2 * M_PI)) < 0.3;
  }
  TEST_ASSERT_GREATER_OR_EQUAL(p.count * 95 / 100, right);
}

}  // namespace

void setUp() { make_rig(); }
void tearDown() {}

int main() {
  size_t count;
  const wm_detector *const *all = wm_detectors(&count);
  UNITY_BEGIN();
  for (size_t i = 0; i < count; i++) {
    detector = all[i];
    TEST_ASSERT_TRUE(wm_detector_find(detector->name) == detector);
    TEST_ASSERT_TRUE(detector->pictures == 1 || detector->pictures == 2);
    params.resize(detector->params.bytes + 1);
    wm_params_defaults(&detector->params, params.data());
    RUN_TEST(same_picture_same_bytes);
    RUN_TEST(nothing_to_see_is_nothing_seen);
    RUN_TEST(another_size_is_refused);
    RUN_TEST(what_does_not_go_together_is_told);
    RUN_TEST(edges_lie_where_the_wall_stands);
  }
  // The other way of the same detector.
  detector = wm_detector_find("edges");
  params.resize(detector->params.bytes + 1);
  wm_params_defaults(&detector->params, params.data());
  reinterpret_cast<wm_edges_params *>(params.data())->mode = EDGES_BY_WINDOWS;
  RUN_TEST(same_picture_same_bytes);
  RUN_TEST(nothing_to_see_is_nothing_seen);
  RUN_TEST(another_size_is_refused);
  return UNITY_END();
}
