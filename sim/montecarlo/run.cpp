// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "montecarlo/bound.h"
#include "montecarlo/montecarlo.h"
#include "montecarlo/simulated.h"
#include "simulate/angle.h"
#include "simulate/measured.h"
#include "simulate/simulate.h"

namespace wm::montecarlo {
namespace {

// Adds the error of a pose to its step, and to the sums of its drive.
void judge(const wm_estimate &estimate, const sim::State &truth, Step &step, Run &run) {
  const PlanarError error = error_of(estimate, truth);
  const double position_sq_m2 = error.off.head<2>().squaredNorm(), nees = error.nees(), turned = error.off[2];
  step.runs++;
  step.position_sq_m2 += position_sq_m2;
  step.heading_sq_rad2 += turned * turned;
  step.nees += nees;
  run.position_rms_m += position_sq_m2;
  run.position_max_m = std::fmax(run.position_max_m, std::sqrt(position_sq_m2));
  run.rotation_rms_rad += turned * turned;
  run.nees_mean += nees;
}

// A drive's sums become its means.
Run mean_of(Run sums, size_t steps) {
  const double n = static_cast<double>(std::max<size_t>(steps, 1));
  return {sums.seed, std::sqrt(sums.position_rms_m / n), sums.position_max_m, std::sqrt(sums.rotation_rms_rad / n),
          sums.nees_mean / n};
}

void run_one(const std::vector<SmallEvent> &events, const sim::Recording &recording, SimulatedFilter &filter,
             Statistics &out) {
  size_t next = 0;  // step to be taken
  Run run{.seed = recording.seed};
  wm_estimate estimate{};
  wm_event e{};
  for (const SmallEvent &small : events) {
    small.get(&e);
    const std::span<const wm_innovation> innovations = filter.take(e);
    if (wm_event_is_motion(&e)) {
      const double t_s = static_cast<double>(e.t_ns - recording.clock_start_ns) * 1e-9;
      if (next >= out.steps.size() || t_s < out.steps[next].t_s) continue;
      filter.ops().estimate(filter.state(), &estimate);
      const double at_s = static_cast<double>(estimate.t_ns - recording.clock_start_ns) * 1e-9;
      judge(estimate, recording.drive.at(at_s), out.steps[next], run);
      next++;
    } else {
      for (const wm_innovation &innovation : innovations) {
        const bool fused = innovation.verdict == WM_FUSED;
        (fused ? out.fused : out.rejected)++;
        if (!fused) continue;
        Step &step = out.steps[std::min(next, out.steps.size() - 1)];
        step.nis += innovation.nis;
        step.nis_dof += innovation.gate_dof;
      }
    }
  }
  out.each.push_back(mean_of(run, next));
  filter.ops().estimate(filter.state(), &estimate);
  const sim::State end = recording.drive.at(recording.drive.duration_s());
  const double dx = end.x_m - estimate.pose_map_base.p_m[0], dy = end.y_m - estimate.pose_map_base.p_m[1];
  const double turned = sim::wrap(end.heading_rad - estimate.heading_rad);
  out.lost += dx * dx + dy * dy > 4 || std::fabs(turned) > 15 * sim::kPi / 180 || estimate.state == WM_STATE_LOST ||
              estimate.state == WM_STATE_SEARCHING;
}

// Adds the bound along a drive, as that of so many drives.
void add_bound(const sim::Scenario &scenario, const sim::Drive &drive, size_t landmarks, double drives,
               Statistics &out) {
  std::vector<double> times;
  for (const Step &step : out.steps) times.push_back(step.t_s);
  const std::vector<Bound> bounds = bound(scenario, drive, landmarks, times);
  for (size_t i = 0; i < bounds.size(); i++) {
    out.steps[i].bound_position_sq_m2 += drives * (bounds[i].x_var_m2 + bounds[i].y_var_m2);
    out.steps[i].bound_heading_sq_rad2 += drives * bounds[i].heading_var_rad2;
  }
}

// Where the seed draws the centre of rotation, base_link's way is another one in each drive, and its bound, too.
bool draws_the_way(const sim::Scenario &scenario) {
  return scenario.motion.base == sim::Motion::Base::skid_steer && scenario.errors.rotation_center_m > 0;
}

wm_status prepare(const sim::Scenario &scenario, size_t landmarks, uint64_t seeds, Statistics &out, wm_error *err) {
  sim::Drive drive;
  if (const wm_status s = sim::Drive::plan(scenario.route, drive, err); s != WM_OK) return s;
  drive = sim::on_base(scenario.motion, 0, drive);
  out = Statistics{};
  out.landmarks = std::min(landmarks, scenario.landmarks.size());
  for (int k = 1; k * kStep_s < drive.duration_s(); k++) {
    Step step;
    step.t_s = k * kStep_s;
    out.steps.push_back(step);
  }
  if (!draws_the_way(scenario)) add_bound(scenario, drive, landmarks, static_cast<double>(seeds), out);
  return WM_OK;
}

}  // namespace

wm_status run(const sim::Scenario &scenario, const wm_config &config, size_t landmarks, uint64_t first_seed,
              uint64_t seeds, const std::function<void(uint64_t)> &progress, Statistics &out, wm_error *err) {
  if (const wm_status s = prepare(scenario, landmarks, seeds, out, err); s != WM_OK) return s;
  std::vector<SmallEvent> events;
  for (uint64_t i = 0; i < seeds; i++) {
    sim::Recording recording;
    if (const wm_status s = sim::simulate(scenario, first_seed + i, landmarks, recording, err); s != WM_OK) return s;
    if (const wm_status s = make_events(recording, events, err); s != WM_OK) return s;
    for (const sim::Sighting &s : recording.sightings) out.outliers += s.outlier;
    SimulatedFilter filter(config, recording, scenario.robot.wheels);
    if (const wm_status s = filter.init(err); s != WM_OK) return s;
    run_one(events, recording, filter, out);
    if (draws_the_way(scenario)) add_bound(scenario, recording.drive, landmarks, 1, out);
    out.runs++;
    if (progress) progress(i + 1);
  }
  return WM_OK;
}

}  // namespace wm::montecarlo
