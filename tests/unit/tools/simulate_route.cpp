// SPDX-License-Identifier: Apache-2.0
// The true drive against an independent integration, and its derivatives against each other.
#include "simulate/route.h"

#include "common/suite.h"
#include "simulate/angle.h"

using namespace wm::sim;

namespace {

Leg stand(double s) {
  Leg leg;
  leg.stand_s = s;
  return leg;
}
Leg straight(double length, double speed, bool reverse = false) {
  Leg leg;
  leg.kind = Leg::Kind::straight;
  leg.length_m = length;
  leg.speed_mps = speed;
  leg.reverse = reverse;
  return leg;
}
Leg turn(double deg, double radius, double ease, double speed, bool reverse = false) {
  Leg leg;
  leg.kind = Leg::Kind::turn;
  leg.turn_rad = deg * kPi / 180;
  leg.radius_m = radius;
  leg.ease_m = ease;
  leg.speed_mps = speed;
  leg.reverse = reverse;
  return leg;
}

Route mixed_route() {
  Route route;
  route.x_m = 1;
  route.y_m = -2;
  route.heading_rad = 0.3;
  route.acceleration_mps2 = 0.8;
  route.legs = {stand(2), straight(16, 3),      turn(90, 6, 3, 2),       turn(-40, 5, 2, 1.5),
                stand(1), straight(3, 1, true), turn(35, 6, 1, 1, true), straight(8, 2.5)};
  return route;
}

Drive planned(const Route &route) {
  Drive drive;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, Drive::plan(route, drive, &err), err.text);
  return drive;
}

TEST(test_derivatives_agree_everywhere) {
  const Drive drive = planned(mixed_route());
  const double h = 1e-4;
  for (double t = h; t < drive.duration_s() - h; t += 0.013) {
    const State a = drive.at(t - h), b = drive.at(t + h), s = drive.at(t);
    const double vx = (b.x_m - a.x_m) / (2 * h), vy = (b.y_m - a.y_m) / (2 * h);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, s.speed_mps * std::cos(s.heading_rad), vx);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, s.speed_mps * std::sin(s.heading_rad), vy);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, s.yaw_rate_radps, (b.heading_rad - a.heading_rad) / (2 * h));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, s.speed_mps, (b.way_m - a.way_m) / (2 * h));
  }
}

TEST(test_position_is_the_integral_of_speed_and_heading) {
  const Drive drive = planned(mixed_route());
  const State start = drive.at(0);
  double x = start.x_m, y = start.y_m;
  const double h = 1e-3;  // midpoint rule: errors of the order of h^2
  for (double t = 0; t + h <= drive.duration_s(); t += h) {
    const State s = drive.at(t + 0.5 * h);
    x += h * s.speed_mps * std::cos(s.heading_rad);
    y += h * s.speed_mps * std::sin(s.heading_rad);
  }
  const State end = drive.at(drive.duration_s());
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, x, end.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, y, end.y_m);
}

TEST(test_speed_and_acceleration_keep_their_limits) {
  const Drive drive = planned(mixed_route());
  double last = 0, fastest = 0, slowest = 0;
  const double h = 1e-3;
  for (double t = 0; t <= drive.duration_s(); t += h) {
    const double v = drive.at(t).speed_mps;
    TEST_ASSERT_DOUBLE_WITHIN(0.8 * h * 1.001 + 1e-9, last, v);
    last = v;
    fastest = std::fmax(fastest, v);
    slowest = std::fmin(slowest, v);
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3, fastest);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, -1, slowest);
}

TEST(test_turns_turn_as_they_say_forwards_and_backwards) {
  const Drive drive = planned(mixed_route());
  const State end = drive.at(1e9);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.3 + (90 - 40 + 35) * kPi / 180, end.heading_rad);
  double path = 16 + 3 + 8;
  path += kPi / 2 * 6 + 3;
  path += 40 * kPi / 180 * 5 + 2;
  path += 35 * kPi / 180 * 6 + 1;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, path, drive.length_m());
  TEST_ASSERT_EQUAL_DOUBLE(0, end.speed_mps);
}

TEST(test_four_equal_corners_return_to_the_start_lap_after_lap) {
  Route route;
  route.laps = 2;
  for (int i = 0; i < 4; i++) {
    route.legs.push_back(straight(10, 3));
    route.legs.push_back(turn(90, 5, 2, 2));
  }
  const Drive drive = planned(route);
  const State end = drive.at(drive.duration_s());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, end.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, end.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 * kPi, end.heading_rad);
}

// The way that was driven, whether the end is cut off or a part of it is skipped by carrying the vehicle.
TEST(test_the_length_is_that_of_the_part_that_is_driven) {
  const auto way = [](const Drive &drive) {
    const double h = 0.001;
    double sum = 0;
    for (double t = 0.5 * h; t < drive.duration_s(); t += h) sum += h * std::fabs(drive.at(t).speed_mps);
    return sum;
  };
  Drive cut = planned(mixed_route()), carried = planned(mixed_route());
  const double whole = cut.length_m();
  cut.cut(0.4 * cut.duration_s());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, way(cut), cut.length_m());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.7 * whole, cut.length_m());
  wm_error err;
  TEST_ASSERT_EQUAL(WM_OK, carried.carry(0.3 * carried.duration_s(), 0.2 * carried.duration_s(), &err));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, way(carried), carried.length_m());
}

TEST(test_a_turn_without_room_for_its_ease_is_refused) {
  Route route;
  route.legs = {straight(5, 1), turn(30, 4, 3, 1)};
  Drive drive;
  wm_error err{};
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, Drive::plan(route, drive, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, "leg 2: ease_m 3"), err.text);
  TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(err.text, "2.094"), err.text);
}

}  // namespace
