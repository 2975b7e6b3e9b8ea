// SPDX-License-Identifier: Apache-2.0
#include "suggest/parameters.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>

#include "waymark/estimator.h"
#include "waymark/motion.h"

namespace wm::suggest {
namespace {

enum class Kind { kNoise, kState, kMultiple, kMultipleState };

struct Row {
  const char *section, *key;
  Kind kind;
  double begin;  // size where the value is 0 or below (kNoise), or where the state is off and its default is 0
};

// Noises and priors. Gates, capacities and choices of a method are no properties of a robot and stay.
constexpr Row kRows[] = {
    {"motion", "noise.speed_mps", Kind::kNoise, 0.02},
    {"motion", "noise.speed_rel", Kind::kNoise, 0.03},
    {"motion", "noise.yaw_rate_radps", Kind::kNoise, 0.01},
    {"motion", "noise.yaw_rate_rel", Kind::kNoise, 0.05},
    {"motion", "noise.side_rel", Kind::kNoise, 0.01},
    {"motion", "noise.sideways_mps", Kind::kNoise, 0.02},
    {"motion", "noise.sideways_rel", Kind::kNoise, 0.06},
    {"motion", "noise.ticks_per_sqrt_m", Kind::kNoise, 0.005},
    {"motion", "noise.steering_rad", Kind::kNoise, 0.005},
    {"motion", "constant_velocity.speed_walk", Kind::kNoise, 0.5},
    {"motion", "constant_velocity.turn_walk", Kind::kNoise, 0.5},
    {"motion", "states.speed_scale_sigma", Kind::kState, 0},
    {"motion", "states.yaw_rate_scale_sigma", Kind::kState, 0},
    {"motion", "states.yaw_rate_bias_sigma_radps", Kind::kState, 0},
    {"motion", "states.yaw_rate_bias_walk_radps", Kind::kNoise, 0.0001},
    {"motion", "states.left_scale_sigma", Kind::kState, 0},
    {"motion", "states.right_scale_sigma", Kind::kState, 0},
    {"motion", "states.track_scale_sigma", Kind::kState, 0},
    {"motion", "states.steering_offset_sigma_rad", Kind::kState, 0},
    {"motion", "states.side_scale_sigma", Kind::kState, 0},
    {"motion", "states.rotation_center_sigma_m", Kind::kState, 0},
    {"sightings", "noise.bearing_factor", Kind::kNoise, 1},
    {"sightings", "noise.range_factor", Kind::kNoise, 1},
    {"sightings", "noise.range_rel", Kind::kNoise, 0.01},
    {"sightings", "states.sensor_yaw_sigma_rad", Kind::kState, 0},
    {"sightings", "states.sensor_time_offset_sigma_s", Kind::kState, 0},
    {"sightings", "states.range_bias_sigma_m", Kind::kMultipleState, 0},
    {"sightings", "states.range_scale_sigma", Kind::kState, 0},
    {"sightings", "correlated.bearing_rad", Kind::kMultiple, 0},
    {"sightings", "correlated.lateral_m", Kind::kNoise, 0.02},
    {"sightings", "correlated.range_m", Kind::kMultiple, 0},
    {"sightings", "correlated.range_rel", Kind::kNoise, 0.01},
    {"sightings", "correlated.tau_s", Kind::kNoise, 2},
    {"landmark_ekf", "noise.gnss_factor", Kind::kNoise, 0.5},
    {"landmark_ekf", "correlated.gnss_m", Kind::kMultiple, 0},
    {"landmark_ekf", "correlated.gnss_tau_s", Kind::kNoise, 20},
    {"landmark_ekf", "states.gnss_time_offset_sigma_s", Kind::kState, 0},
    {"slam", "markers.sigma_m", Kind::kNoise, 0.002},
    {"slam", "markers.sigma_rel", Kind::kNoise, 0.005},
    {"slam", "markers.bearing_sigma_rad", Kind::kNoise, 0.001},
    {"slam", "markers.heading_sigma_rad", Kind::kNoise, 0.02},
    // No noise.pixel_px: tracks of a street drift alike, and the likelihood shows the noise of one picture alone.
    {"stereo_ekf", "noise.v_mps", Kind::kNoise, 0.03},
    {"stereo_ekf", "noise.w_radps", Kind::kNoise, 0.01},
    {"stereo_ekf", "constant_velocity.v_walk", Kind::kNoise, 2},
    {"stereo_ekf", "constant_velocity.w_walk", Kind::kNoise, 0.5},
    {"stereo_ekf", "states.rate_bias_sigma_radps", Kind::kState, 0},
    {"stereo_ekf", "states.velocity_scale_sigma", Kind::kState, 0},
    {"stereo_ekf", "states.rate_scale_sigma", Kind::kState, 0},
    {"stereo_ekf", "states.twist_axes_sigma_rad", Kind::kState, 0},
    {"stereo_ekf", "states.velocity_direction_sigma_rad", Kind::kState, 0},
    {"stereo_ekf", "states.increment_scale_sigma", Kind::kState, 0},
    {"stereo_ekf", "states.increment_direction_sigma_rad", Kind::kState, 0},
    {"stereo_ekf", "states.time_offset_sigma_s", Kind::kState, 0},
    {"edge_mcl", "points.pixel_px", Kind::kNoise, 0.5},
    {"edge_mcl", "points.sigma_m", Kind::kNoise, 0.012},
    {"edge_mcl", "points.common_px", Kind::kNoise, 0.6},
    {"edge_mcl", "states.pitch_sigma_rad", Kind::kState, 0},
    {"edge_mcl", "states.yaw_sigma_rad", Kind::kState, 0},
    {"edge_mcl", "states.time_offset_sigma_s", Kind::kState, 0},
};

// Three digits: more have no meaning, and a person has to read them.
double rounded(double value) {
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.3g", value);
  return std::strtod(text, nullptr);
}

struct Section {
  const char *name;
  const wm_param_table *table;
  void *values;
  bool is_shared;
};

}  // namespace

std::vector<double> Parameter::trials(double from, double factor) const {
  std::vector<double> out;
  const double size = is_state || is_multiple ? std::fabs(from) : from;
  const double sign = from < 0 && (is_state || is_multiple) ? -1 : 1;
  if (size > 0) {
    out = {sign * size * factor, sign * size / factor};
    if (is_state) out.push_back(0);
  } else if (is_state && initial != 0) {
    out = {initial};
  } else if (begin > 0) {
    out = {begin / factor, begin, begin * factor};
  }
  for (double &trial : out) trial = std::clamp(rounded(trial), min, max);
  std::erase(out, from);
  return out;
}

double Parameter::between(double to, double share) const {
  const double from = now > 0 || is_state || is_multiple ? std::fabs(now) : begin;
  if (from == 0 || to == 0) return share > 0.5 ? to : now;
  const double size = std::exp((1 - share) * std::log(from) + share * std::log(std::fabs(to)));
  return to == now ? now : std::clamp(rounded(std::copysign(size, to)), min, max);
}

std::vector<Parameter> parameters_of(wm_config &config) {
  const wm_estimator &estimator = *config.estimator;
  const Section sections[] = {{"motion", &wm_motion_params_table, config.motion, true},
                              {"sightings", &wm_sighting_params_table, config.sightings, true},
                              {estimator.name, &estimator.params, config.estimator_params, false}};
  std::vector<Parameter> out;
  for (const Section &section : sections) {
    for (const Row &row : kRows) {
      if (std::strcmp(row.section, section.name) != 0) continue;
      const std::string name = std::string(row.section) + "." + row.key;
      if (section.is_shared && !wm_estimator_reads(&estimator, name.c_str())) continue;
      for (const wm_param &param : std::span(section.table->params, section.table->count)) {
        if (std::strcmp(param.key, row.key) != 0 || param.type != WM_PARAM_F64) continue;
        auto *value = reinterpret_cast<double *>(static_cast<char *>(section.values) + param.offset);
        out.push_back({.section = row.section,
                       .key = row.key,
                       .value = value,
                       .now = *value,
                       .initial = param.initial,
                       .min = param.min,
                       .max = param.max,
                       .begin = row.begin,
                       .is_state = row.kind == Kind::kState || row.kind == Kind::kMultipleState,
                       .is_multiple = row.kind == Kind::kMultiple || row.kind == Kind::kMultipleState});
      }
    }
  }
  return out;
}

}  // namespace wm::suggest
