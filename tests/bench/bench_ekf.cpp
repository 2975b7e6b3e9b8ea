// SPDX-License-Identifier: Apache-2.0
// What the landmark filter costs: medians in nanoseconds of predict, of one bearing, of both, for filters of several
// sizes. Each figure is the median of single calls, the clock's own cost taken away.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "waymark/estimator.h"

namespace {

const double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr int kRuns = 20000;

int64_t now_ns() {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * INT64_C(1000000000) + t.tv_nsec;
}

double median(std::vector<double> &v) {
  std::nth_element(v.begin(), v.begin() + (std::ptrdiff_t)v.size() / 2, v.end());
  return v[v.size() / 2];
}

double clock_cost() {
  std::vector<double> cost;
  for (int i = 0; i < kRuns; i++) {
    const int64_t a = now_ns(), b = now_ns();
    cost.push_back((double)(b - a));
  }
  return median(cost);
}

struct setting {
  const char *key;
  double value;
};

// Drives a circle of 3 m about the origin and sees one of four landmarks after each twist.
void bench(const char *title, std::initializer_list<setting> settings, bool range) {
  const wm_estimator *ekf = wm_estimator_find("landmark_ekf");
  std::vector<char> motion(wm_motion_params_table.bytes), params(ekf->params.bytes);
  wm_params_defaults(&wm_motion_params_table, motion.data());
  wm_params_defaults(&ekf->params, params.data());
  for (const setting &s : settings)
    for (size_t i = 0; i < ekf->params.count; i++) {
      const wm_param &p = ekf->params.params[i];
      if (std::strcmp(p.key, s.key) != 0) continue;
      const int32_t whole = (int32_t)s.value;
      if (p.type == WM_PARAM_F64)
        std::memcpy(&params[p.offset], &s.value, sizeof s.value);
      else
        std::memcpy(&params[p.offset], &whole, sizeof whole);
    }
  wm_sensor sensor{};
  std::strcpy(sensor.name, "eye");
  sensor.bearing_sigma_rad = 0.02;
  sensor.range_sigma_m = 0.1;
  sensor.max_range_m = 100;
  wm_landmark landmarks[4];
  for (int i = 0; i < 4; i++) landmarks[i] = {i, {6 * cos(1.57 * i), 6 * sin(1.57 * i), 0}, 0.01, kAbsent, {}, 0};
  wm_setup setup{};
  setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
  setup.wheels = {kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, 0, {}, {}};
  setup.sensors = &sensor;
  setup.sensor_count = 1;
  setup.landmarks = landmarks;
  setup.landmark_count = 4;
  setup.start = {WM_TIME_NONE, {3, 0, 0}, {0, 0, 0, 1}, 1.5707963, 0.05, 0.05};
  const char *why = "";
  const size_t bytes = ekf->state_bytes(params.data(), &setup, &why);
  if (bytes == 0) {
    std::printf("%s: %s\n", title, why);
    std::exit(1);
  }
  void *state = std::aligned_alloc(16, (bytes + 15) / 16 * 16);
  ekf->init(state, params.data(), &setup);

  const double overhead = clock_cost();
  std::vector<double> predict, correct, both;
  wm_innovation records[8];
  size_t count, fused = 0, rejected = 0;
  for (int i = 0; i < kRuns; i++) {
    const double t = 0.02 * i, turn = 1.5707963 + 0.3 * t;
    wm_event twist{}, seen{};
    twist.t_ns = seen.t_ns = wm_ns_from_seconds(t);
    twist.kind = WM_EVENT_TWIST2;
    twist.as.twist2 = {0.9, 0.3};
    const double x = 3 * sin(turn), y = -3 * cos(turn);
    const wm_landmark &l = landmarks[i % 4];
    const double dx = l.p_m[0] - x, dy = l.p_m[1] - y;
    seen.kind = WM_EVENT_SIGHTING;
    seen.as.sighting = {0,
                        l.id,
                        std::remainder(std::atan2(dy, dx) - turn, 6.283185307179586),
                        range ? std::hypot(dx, dy) : kAbsent,
                        kAbsent,
                        kAbsent};
    const int64_t a = now_ns();
    ekf->predict(state, &twist);
    const int64_t b = now_ns();
    ekf->correct(state, &seen, records, 8, &count);
    const int64_t c = now_ns();
    (records[0].verdict == WM_FUSED ? fused : rejected)++;
    predict.push_back((double)(b - a) - overhead);
    correct.push_back((double)(c - b) - overhead);
    both.push_back((double)(c - a) - 2 * overhead);
  }
  if (rejected > fused / 20) {
    std::printf("%s: %zu of %d rejected: not what was meant to be measured\n", title, rejected, kRuns);
    std::exit(1);
  }
  const double p = median(predict), c = median(correct), s = median(both);
  std::printf("%-58s predict %5.0f ns, correct %5.0f ns, both %5.0f ns\n", title, p, c, s);
  std::free(state);
}

}  // namespace

int main() {
  bench("pose, one bearing", {}, false);
  bench("pose + 6 calibration states, one bearing",
        {{"states.speed_scale_sigma", 0.05},
         {"states.yaw_rate_scale_sigma", 0.05},
         {"states.yaw_rate_bias_sigma_radps", 0.01},
         {"states.lag_sigma_s", 0.05},
         {"states.sensor_yaw_sigma_rad", 0.05},
         {"states.sensor_time_offset_sigma_s", 0.05}},
        false);
  bench("pose + 8 calibration states + 10 x 2 lasting, range too",
        {{"states.speed_scale_sigma", 0.05},
         {"states.yaw_rate_scale_sigma", 0.05},
         {"states.yaw_rate_bias_sigma_radps", 0.01},
         {"states.lag_sigma_s", 0.05},
         {"states.sensor_yaw_sigma_rad", 0.05},
         {"states.sensor_time_offset_sigma_s", 0.05},
         {"states.range_bias_sigma_m", 0.05},
         {"states.range_scale_sigma", 0.05},
         {"lasting.slots", 10},
         {"lasting.lateral_m", 0.02},
         {"lasting.range_m", 0.02}},
        true);
  return 0;
}
