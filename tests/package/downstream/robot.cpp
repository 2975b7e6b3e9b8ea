// SPDX-License-Identifier: Apache-2.0
// robot.c in C++17: rows of odometry and sightings from standard input, fused poses to standard output.
// c++ -std=c++17 robot.cpp $(pkg-config --cflags --libs waymark-session)
#include <cmath>
#include <cstdio>
#include <iostream>
#include <string>
#include <waymark/waymark.hpp>

int main(int argc, char **argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: robot CONFIG SITE < ROWS\n"), 2;
  waymark::options options{argv[1], argv[2]};
  options.on.fused = [](const wm_estimate &pose) {
    std::printf("%lld %.17g %.17g %.17g\n", static_cast<long long>(pose.t_ns), pose.pose_map_base.p_m[0],
                pose.pose_map_base.p_m[1], pose.covariance[0]);
  };
  try {
    auto robot = waymark::session::open(options).value();
    auto motion = robot.add_source("motion").value();
    auto sightings = robot.add_source("sightings:front").value();
    robot.start().value();
    for (std::string line; std::getline(std::cin, line);) {  // the robot's own loop
      long long t_ns = 0, arrival_ns = 0;
      double v_mps = 0, w_radps = 0;
      wm_event seen{};
      seen.kind = WM_EVENT_SIGHTING;
      wm_sighting &s = seen.as.sighting = wm_sighting_without_numbers();
      waymark::result<void> pushed;
      if (std::sscanf(line.c_str(), "moved %lld %lf %lf", &t_ns, &v_mps, &w_radps) == 3)
        pushed = motion.push(waymark::time::of_ns(t_ns), {v_mps, std::nan(""), w_radps});
      if (std::sscanf(line.c_str(), "saw %lld %lld %d %lf %lf", &t_ns, &arrival_ns, &s.landmark_id, &s.bearing_rad,
                      &s.range_m) == 5) {
        seen.t_ns = t_ns, seen.arrival_ns = arrival_ns;
        pushed = sightings.push(seen);
      }
      if (!pushed) std::cerr << pushed.error().text << '\n';  // this datum is refused; the next one is taken
    }
    robot.close().value();
  } catch (const std::exception &why) {
    return std::fprintf(stderr, "%s\n", why.what()), 1;
  }
}
