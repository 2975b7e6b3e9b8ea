// SPDX-License-Identifier: Apache-2.0
#include "filters/core/scale_test.hpp"

#include <cmath>
#include <cstring>

#include "math/elementary.hpp"
#include "motion/motion_kind.hpp"
#include "sensors/sighting_params.h"

namespace wm {
namespace {

constexpr double kMost = 1.2, kSigmas = 5.0;
// Sigmas, of all lengths together. With default priors SLAM on 16 real recordings reaches 1.4.
constexpr double kLengthSigmas = 3.5;
// Names of calibration values, and whose sigma it is. The last one is of any sensor.
constexpr struct {
  const char *name;
  int term;
  bool is_length;
} kScales[WM_MONITOR_SCALES] = {{"motion.speed_scale", WM_SPEED_SCALE, true},
                                {"motion.yaw_rate_scale", WM_YAW_RATE_SCALE, false},
                                {"motion.left_scale", WM_LEFT_SCALE, true},
                                {"motion.right_scale", WM_RIGHT_SCALE, true},
                                {"motion.track_scale", WM_TRACK_SCALE, false},
                                {"motion.side_scale", WM_SIDE_SCALE, true},
                                {"range_scale", -1, true}};

// What stands behind the last dot of a name.
const char *last_part(const char *name) {
  const char *part = name;
  for (const char *c = name; *c; c++)
    if (*c == '.') part = c + 1;
  return part;
}

// WM_MONITOR_SCALES: none of them.
int scale_of(const wm_calibration_value &value) {
  for (int i = 0; i < WM_MONITOR_SCALES; i++)
    if (std::strcmp(kScales[i].term < 0 ? last_part(value.name) : value.name, kScales[i].name) == 0) return i;
  return WM_MONITOR_SCALES;
}

}  // namespace

void scales_begin(const wm_setup &setup, wm_monitor_scale scales[WM_MONITOR_SCALES]) {
  for (int i = 0; i < WM_MONITOR_SCALES; i++) {
    const int term = kScales[i].term;
    scales[i] = {1.0, 0.0};
    if (term >= 0 && setup.motion)
      scales[i] = {start_value(setup.motion->states, term), start_sigma(setup.motion->states, term)};
    if (term < 0 && setup.sightings)
      scales[i].sigma = std::fabs(setup.sightings->states.sigma[WM_SENSOR_ROW_kRangeScale]);
  }
}

bool scale_contradicts(const wm_monitor_scale scales[WM_MONITOR_SCALES], const wm_calibration_value &value) {
  const int i = scale_of(value);
  if (i == WM_MONITOR_SCALES || !(scales[i].sigma > 0.0)) return false;
  const double ratio = value.value / scales[i].value, off = std::fabs(value.value - scales[i].value);
  return (ratio > kMost || ratio < 1.0 / kMost) && off > kSigmas * larger(scales[i].sigma, value.sigma);
}

double length_contradiction(const wm_monitor_scale scales[WM_MONITOR_SCALES], const wm_calibration_value &value) {
  const int i = scale_of(value);
  if (i == WM_MONITOR_SCALES || !kScales[i].is_length || !(scales[i].sigma > 0.0)) return 0.0;
  return square((value.value - scales[i].value) / larger(scales[i].sigma, value.sigma));
}

bool lengths_contradict(double squares) { return squares > square(kLengthSigmas); }

}  // namespace wm
