// SPDX-License-Identifier: Apache-2.0
#include "motion/commands.hpp"

#include "math/elementary.hpp"

namespace wm {

namespace {

// Of the iRobot Create: its largest radius [iRobot2006], and the left turns beyond which MRCLAM's five robots turned to
// the right (9.6 m was still to the left).
constexpr double kRadiusMost_m = 2.0, kOverflow_m = 12.0;

double driven_by_radius(double radius_max, double overflow, double v_mps, double w_radps) {
  if (!(radius_max > 0.0) || v_mps == 0.0 || std::fabs(v_mps) <= std::fabs(w_radps) * radius_max || w_radps == 0.0)
    return w_radps;
  const double radius = v_mps / w_radps;
  const bool left = radius > 0.0 && !(overflow > 0.0 && radius > overflow);
  return v_mps / (left ? radius_max : -radius_max);
}

}  // namespace

bool are_commands(const wm_motion_params &p) { return p.commands_radius_max_m > 0.0; }

double driven_rate(const wm_motion_params &p, double v_mps, double w_radps) {
  return driven_by_radius(p.commands_radius_max_m, p.commands_radius_overflow_m, v_mps, w_radps);
}

void begin_response(const wm_motion_params &p, const motion_input *before, motion_input *input) {
  const motion_input &from = before ? *before : *input;
  const bool changes = before && before->command;
  const double left = changes ? exp(-wm_seconds_between(before->t_ns, input->t_ns) / p.commands_response_s) : 0.0;
  input->response[0] = static_cast<float>(from.a + (static_cast<double>(from.response[0]) - from.a) * left);
  input->response[1] = static_cast<float>(from.b + (static_cast<double>(from.response[1]) - from.b) * left);
}

namespace {

struct response {
  double mean, rise, end, end_rise;
};

double growth(double value, double by) { return value * by > 0.0 ? by : 0.0; }

// First-order response from `gap` off the command: the gap falls to gap exp(-x) within x = dt / response. `mean_gap` is
// its mean's factor, (1 - exp(-x)) / x.
response respond_once(double command, double gap, double end_gap, double mean_gap, double dt_s, double response_s) {
  response out{};
  out.mean = command + gap * mean_gap;
  out.end = command + end_gap;
  out.end_rise = growth(out.end, -end_gap / response_s);
  const bool turns_back = out.end * (command + gap) < 0.0;
  out.rise = turns_back ? out.end / dt_s : growth(out.end, -gap * mean_gap / response_s);
  return out;
}

}  // namespace

void respond(const wm_motion_params &p, const wm_motion_calibration &c, const wm_wheels &wheels,
             motion_segment *segment) {
  const double tau_s = p.commands_response_s, x = segment->dt_s / tau_s;
  const double left_before = exp(-segment->held_s / tau_s), left = exp(-x);
  // Below 1e-4 the series' next term is below 2e-9.
  const double mean_gap = x > 1e-4 ? (1.0 - left) / x : 1.0 - 0.5 * x;
  motion_input &input = segment->input;
  drive_terms end_terms{};
  if (!(p.commands_radius_max_m > 0.0))
    end_terms.gentle_radps = segment->drive.gentle_radps =
        driven_by_radius(kRadiusMost_m, kOverflow_m, input.a, input.b) - input.b;
  response of[2];
  for (int k = 0; k < 2; k++) {
    const double command = k ? input.b : input.a;
    const double gap = (static_cast<double>(input.response[k]) - command) * left_before;
    of[k] = respond_once(command, gap, gap * left, mean_gap, segment->dt_s, tau_s);
    segment->drive.rise[k] = of[k].rise;
    segment->changed2[k] = square(gap) - square(gap * left);
    end_terms.rise[k] = of[k].end_rise;
  }
  motion_input end = input;
  end.a = of[0].end, end.b = of[1].end;
  input.a = of[0].mean, input.b = of[1].mean;
  segment->end = twist_of(end, c, wheels, end_terms);
}

motion_twist twist_of_command(const planar_twist &response, const drive_terms &drive, const wm_motion_calibration &c,
                              double track_m) {
  const double speed = response.v - c.value[kSpeedOnset] * drive.rise[0];
  const double rate = response.w - c.value[kTurnOnset] * drive.rise[1] + c.value[kGentleTurns] * drive.gentle_radps;
  const double size = std::fabs(speed), turning = square(rate);
  const double slower = c.value[kTurnSlowdown] * turning;
  const double fraction = size > 0.0 && slower < size ? (size - slower) / size : size > 0.0 ? 0.0 : 1.0;
  motion_twist t = twist_of_sample(fraction * speed, response.u, rate, c, track_m);
  // Both wheels lose the same, so unequal wheels change the turn a little, too.
  const bool wheels = finite(track_m);
  const double v_by = c.value[kSpeedScale] * (wheels ? 0.5 * (c.value[kLeftScale] + c.value[kRightScale]) : 1.0);
  const double inverse_track = wheels ? 1.0 / (track_m * c.value[kTrackScale]) : 0.0;
  const double w_by = c.value[kYawRateScale] * inverse_track * (c.value[kRightScale] - c.value[kLeftScale]);
  const double slows = fraction > 0.0 && size > 0.0 ? (speed > 0.0 ? -1.0 : 1.0) : 0.0;
  if (slows != 0.0) t.add(kTurnSlowdown, v_by * slows * turning, w_by * slows * turning);
  if (drive.rise[0] != 0.0 && fraction > 0.0) t.add(kSpeedOnset, -v_by * drive.rise[0], -w_by * drive.rise[0]);
  if (drive.rise[1] == 0.0 && drive.gentle_radps == 0.0) return t;
  // The turn rate changes the speed by the slowdown, and by wheels of unequal scale.
  const double slows_by = slows * 2.0 * c.value[kTurnSlowdown] * rate;
  const double half = wheels ? 0.5 * track_m : 0.0;
  const double v_by_rate =
      v_by * slows_by + 0.5 * c.value[kSpeedScale] * half * (c.value[kRightScale] - c.value[kLeftScale]);
  const double own = wheels ? half * inverse_track * (c.value[kRightScale] + c.value[kLeftScale]) : 1.0;
  const double w_by_rate = w_by * slows_by + c.value[kYawRateScale] * own;
  if (drive.rise[1] != 0.0) t.add(kTurnOnset, -v_by_rate * drive.rise[1], -w_by_rate * drive.rise[1]);
  if (drive.gentle_radps != 0.0) t.add(kGentleTurns, v_by_rate * drive.gentle_radps, w_by_rate * drive.gentle_radps);
  return t;
}

void add_change_noise(const motion_segment &segment, const wm_motion_params &p, motion_noise *noise) {
  noise->distance_m2 += square(p.commands_delay_sigma_s) * segment.changed2[0];
  noise->rotation_rad2 += square(p.commands_delay_sigma_s) * segment.changed2[1];
}

}  // namespace wm
