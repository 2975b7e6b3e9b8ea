// SPDX-License-Identifier: Apache-2.0
// Elevations of landmarks in the landmark filter: what is expected and how it changes, what an absent or absurd one
// does, how far it is believed, and that a pose isn't taken which heights contradict.
#include "filters/landmark_ekf/start_hypotheses.hpp"
#include "filters/relocalize/pose_search.hpp"
#include "sensors/sensor_model.hpp"
#include "world.hpp"

namespace {

using namespace world;

// Landmark `i` as it is seen from the start, with its elevation.
wm_event seen(double t_s, int i, double sigma_rad) {
  wm::mounted_sensor m;
  m.init(sensor);
  const wm::expected_sighting e = wm::expect(m, {}, {0, 0, 0}, landmarks[i].p_m);
  wm_event out = make::sighting(t_s, landmarks[i].id, e.bearing_rad, NAN);
  out.as.sighting.elevation_rad = e.elevation_rad;
  out.as.sighting.elevation_sigma_rad = sigma_rad;
  return out;
}

void stand(double from_s, double to_s) {
  for (double t = from_s; t < to_s; t += 0.02) feed(make::twist(t, 0, 0));
}

TEST(test_expected_elevation_and_its_derivatives) {
  wm_sensor s = sensor;
  s.mounting = {{0.4, -0.2, 0.7}, {0.1, 0.35, 2.2}};
  wm::mounted_sensor m;
  m.init(s);
  const wm_pose2 pose = {0.5, 0.3, 0.8};
  const double place[3] = {3.0, -1.5, 1.9}, h = 1e-6;
  for (int cause = 0; cause < wm::kCauses; cause++) {
    if (cause == wm::kBySensor + wm::kTimeOffset) continue;  // by the motion, not by this model
    double moved[2];
    for (int side = 0; side < 2; side++) {
      const double by = side ? h : -h;
      wm_pose2 p = pose;
      wm::sensor_errors errors;
      wm::mounted_sensor turned = m;
      double at[3] = {place[0], place[1], place[2]};
      switch (cause) {
        case wm::kByX: p.x_m += by; break;
        case wm::kByY: p.y_m += by; break;
        case wm::kByHeading: p.heading_rad += by; break;
        case wm::kByHeight: at[2] += by; break;
        default: {
          if (cause >= wm::kBySensor) {
            errors[cause - wm::kBySensor] += by;
            break;
          }
          // The robot leans or nods about its x or y axis through the sensor: what it sees turns the other way.
          const double c = std::cos(p.heading_rad), sn = std::sin(p.heading_rad);
          const double dx = at[0] - p.x_m, dy = at[1] - p.y_m;
          double v[3] = {c * dx + sn * dy - m.x_m, c * dy - sn * dx - m.y_m, at[2] - m.z_m};
          const double w[2] = {cause == wm::kByBodyRoll ? by : 0.0, cause == wm::kByBodyPitch ? by : 0.0};
          const double turn[3] = {-w[1] * v[2], w[0] * v[2], w[1] * v[0] - w[0] * v[1]};
          for (int i = 0; i < 3; i++) v[i] += turn[i];
          const double bx = v[0] + m.x_m, yb = v[1] + m.y_m;
          at[0] = p.x_m + c * bx - sn * yb;
          at[1] = p.y_m + sn * bx + c * yb;
          at[2] = v[2] + m.z_m;
        }
      }
      moved[side] = wm::expect(turned, errors, p, at).elevation_rad;
    }
    const double by = wm::expect(m, {}, pose, place).elevation_by[cause];
    TEST_ASSERT_DOUBLE_WITHIN(2e-6, (moved[1] - moved[0]) / (2 * h), by);
    const bool of_range = cause >= wm::kBySensor + wm::kRangeBias && cause <= wm::kBySensor + wm::kDepthAxis;
    const bool of_bearing = cause == wm::kBySensor + wm::kEccentricX || cause == wm::kBySensor + wm::kEccentricY;
    TEST_ASSERT_EQUAL(!of_range && !of_bearing, std::fabs(by) > 1e-3);
  }
}

// A ray as told and the same ray levelled; the way there and back.
TEST(test_a_ray_is_levelled) {
  wm_sensor s = sensor;
  s.mounting = {{0.4, -0.2, 0.7}, {0.1, -0.2, 1.2}};
  wm::mounted_sensor m;
  m.init(s);
  const double place[3] = {3.0, 2.5, 1.9};
  const wm::expected_sighting e = wm::expect(m, {}, {0, 0, 0}, place);
  const wm::level_ray ray = wm::levelled(m, {}, e.bearing_rad, e.elevation_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::atan2(2.5 + 0.2, 3.0 - 0.4), ray.azimuth_rad + 1.2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, (1.9 - 0.7) / std::hypot(2.5 + 0.2, 3.0 - 0.4), ray.tangent);
}

wm_estimate run_without(int use, bool told) {
  make::sightings.use_elevation = use;
  begin();
  noise = {5, 1, 0};
  for (int i = 0; i < 100; i++) {
    const double t = 0.1 * i;
    stand(t, t + 0.09);
    wm_event e = seen(t + 0.1, i % 3, told ? 0.01 : 0.0);
    if (!told) e.as.sighting.elevation_rad = NAN;
    e.as.sighting.bearing_rad += gauss(0.01);
    feed(e);
    TEST_ASSERT_EQUAL(use && told ? 2 : 1, count);
  }
  return estimate();
}

TEST(test_without_elevations_all_bits_are_as_without_the_parameter) {
  const wm_estimate off = run_without(0, false), on = run_without(1, false), not_used = run_without(0, true),
                    used = run_without(1, true);
  TEST_ASSERT_EQUAL_MEMORY(&off, &on, sizeof off);
  TEST_ASSERT_EQUAL_MEMORY(&off, &not_used, sizeof off);
  TEST_ASSERT_TRUE(std::memcmp(&off, &used, sizeof off) != 0);
}

TEST(test_absurd_elevations_are_refused_and_told) {
  begin();
  stand(0, 1);
  const auto refused = [](double elevation_rad, double sigma_rad, wm_status status) {
    wm_event e = seen(1, 0, sigma_rad);
    e.as.sighting.elevation_rad = elevation_rad;
    return verdict_of(e, status);
  };
  TEST_ASSERT_EQUAL(WM_REJECTED_NOT_FINITE, refused(INFINITY, 0.01, WM_NOT_FINITE));
  TEST_ASSERT_EQUAL(WM_REJECTED_OUT_OF_RANGE, refused(2, 0.01, WM_OUT_OF_RANGE));
  TEST_ASSERT_EQUAL(WM_REJECTED_OUT_OF_RANGE, refused(0.1, -0.01, WM_OUT_OF_RANGE));
  TEST_ASSERT_EQUAL(WM_REJECTED_OUT_OF_RANGE, refused(0.1, INFINITY, WM_OUT_OF_RANGE));
  TEST_ASSERT_EQUAL(WM_FUSED, refused(NAN, 0.01, WM_OK));  // absent
  // A thing at another height where the landmark should be: the bearing stays.
  wm_event e = seen(1, 0, 0.001);
  e.as.sighting.elevation_rad += 0.2;
  feed(e);
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_EQUAL(WM_FUSED, records[0].verdict);
  TEST_ASSERT_EQUAL(WM_RESIDUAL_ELEVATION, records[1].residual);
  TEST_ASSERT_EQUAL(WM_REJECTED_GATE, records[1].verdict);
}

TEST(test_where_a_height_is_not_known_there_is_no_elevation) {
  begin();
  stand(0, 1);
  const wm_event e = seen(1, 0, 0.01);
  landmarks[0].p_m[2] = NAN;
  TEST_ASSERT_EQUAL(WM_FUSED, verdict_of(e));
  TEST_ASSERT_EQUAL(1, count);
}

// Straight ahead, 8 m away and 1.5 m up: it tells the distance, as well as the tilt allows, and no better for being
// looked at a hundred times in two seconds: a robot that stands on a slope stands on it all the time.
TEST(test_it_tells_the_distance_and_not_more_than_the_tilt_allows) {
  setup.start.sigma_xy_m = 2.0;
  setup.start.p_m[0] = -1.0;
  begin();
  for (int i = 0; i < 100; i++) {
    const double t = 0.02 * i;
    stand(t, t + 0.01);
    TEST_ASSERT_EQUAL(WM_FUSED, verdict_of(seen(t + 0.02, 0, 0.0005)));
  }
  const wm_estimate e = estimate();
  std::printf("known to %.3f m\n", std::sqrt(e.covariance[0]));
  const double lasting_m = 0.007 * (8.0 * 8.0 + 1.5 * 1.5) / 1.5;
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, e.pose_map_base.p_m[0]);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.1 * lasting_m, std::sqrt(e.covariance[0]));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.8 * lasting_m, std::sqrt(e.covariance[0]));
}

// Landmark `key` at this place, seen from (from_x_m, 0) where it hangs so high, `wrong_m` more than on the map.
wm::observation observed(int key, const double place_m[2], double from_x_m, double height_m, double wrong_m) {
  wm::observation seen{};
  seen.kind = wm::kObservedBearing | (height_m > 0 ? wm::kObservedElevation : 0u);
  seen.key = key * wm::kMaxSensors;
  seen.sensor.x_m = seen.travelled_m = from_x_m;
  for (int k = 0; k < 2; k++) seen.place_m[k] = place_m[k];
  const auto [bearing_rad, range_m] = view_of(place_m[0], place_m[1], {from_x_m, 0, 0});
  seen.bearing_rad = bearing_rad;
  seen.height_m = height_m;
  seen.tangent = (height_m + wrong_m) / range_m;
  seen.sigma_angle_rad = 0.005;
  seen.sigma_place_m = seen.sigma_height_m = 0.02;
  seen.sigma_tangent = 0.008;
  return seen;
}

// Bearings of three landmarks fit some pose, as three always do, and those of two while driving: the pose is found with
// heights that agree with it and without heights, but not with one that contradicts it.
TEST(test_a_contradicting_height_rejects_a_found_pose) {
  static wm::pose_search search;
  const double place_m[3][2] = {{5.0, 3.0}, {7.0, -4.0}, {1.0, 6.0}};
  const auto found = [&](int count, double heights, double wrong_m) {
    search.clear();
    for (int n = 0; n < 12; n++) {
      const int i = n % count;
      wm::observation seen = observed(i, place_m[i], 0.3 * n, heights, i == 1 ? wrong_m : 0.0);
      seen.t_ns = 400 * n * WM_NS_PER_MS;
      search.add(seen);
    }
    return search.find(0, {{3.3, 0.0, 0.0}, 3.3, 0.0}, nullptr, 0, {5.0, 1.0, 5}).found;
  };
  for (const int count : {2, 3}) {
    TEST_ASSERT_TRUE(found(count, 0.0, 0.0));
    TEST_ASSERT_TRUE(found(count, 0.8, 0.0));
    TEST_ASSERT_TRUE(found(count, 0.8, 0.03));
    TEST_ASSERT_FALSE(found(count, 0.8, 0.5));
  }
}

// Three landmarks ahead while the robot stands: a start that is half a metre short is explained by a heading and three
// places that are a little off as well, but then all three hang too low.
TEST(test_heights_reject_a_wrong_start) {
  static wm::pose_search observations;
  static wm::start_hypotheses start;
  const double place_m[3][2] = {{4.0, 1.0}, {5.0, -1.2}, {4.5, 0.2}};
  const auto off = [&](bool heights, double short_m) {
    observations.clear();
    for (int n = 0; n < 30; n++) {
      wm::observation seen = observed(n % 3, place_m[n % 3], 0.0, 1.5, 0.0);
      if (!heights) seen.kind = wm::kObservedBearing;
      seen.t_ns = 150 * n * WM_NS_PER_MS;
      observations.add(seen);
    }
    const double covariance[3][3] = {{0.0025, 0, 0}, {0, 0.0025, 0}, {0, 0, 0.0001}};
    const wm_pose2 stated = {-short_m, 0, 0};
    start.begin(stated, covariance, {});
    start.test(observations, {0.0035, 0, 0.1}, stated, {}, 0);
    return start.wrong_probability();
  };
  std::printf("off: %.3f by bearings, %.3f by heights, too; right: %.3f and %.3f\n", off(false, 0.5), off(true, 0.5),
              off(false, 0.0), off(true, 0.0));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.5, off(true, 0.5));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off(false, 0.5));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off(true, 0.0));
}

}  // namespace

void setUp(void) {
  prepare_ekf(make::sensor("camera", 0.01, 0.05));
  put_on_map({{8, 0, 2.5}, {3, 5, 1.8}, {2, -6, 3}}, 10, 1, 0.02);
  sensor.mounting.xyz_m[2] = 1.0;
  make::sightings.use_elevation = 1;
  make::sightings.states.sigma[WM_SENSOR_ROW_kRoll] = 0.0035;
  make::sightings.map_slots = 3;
}
