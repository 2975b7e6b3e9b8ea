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

void judge(const wm_estimate &estimate, const sim::State &truth, Step &step) {
  Eigen::Vector3d error(truth.x_m - estimate.pose_map_base.p_m[0], truth.y_m - estimate.pose_map_base.p_m[1],
                        sim::wrap(truth.heading_rad - estimate.heading_rad));
  const int axes[3] = {0, 1, 5};
  Eigen::Matrix3d cov;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) cov(i, j) = estimate.covariance[wm_cov_index(axes[i], axes[j])];
  step.runs++;
  step.position_sq_m2 += error.head<2>().squaredNorm();
  step.heading_sq_rad2 += error[2] * error[2];
  step.nees += error.dot(cov.ldlt().solve(error));
}

void run_one(const std::vector<SmallEvent> &events, const sim::Recording &recording, SimulatedFilter &filter,
             Statistics &out) {
  size_t next = 0;  // step to be taken
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
      judge(estimate, recording.drive.at(at_s), out.steps[next]);
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
  filter.ops().estimate(filter.state(), &estimate);
  const sim::State end = recording.drive.at(recording.drive.duration_s());
  const double dx = end.x_m - estimate.pose_map_base.p_m[0], dy = end.y_m - estimate.pose_map_base.p_m[1];
  const double turned = sim::wrap(end.heading_rad - estimate.heading_rad);
  out.lost += dx * dx + dy * dy > 4 || std::fabs(turned) > 15 * sim::kPi / 180 || estimate.state == WM_STATE_LOST ||
              estimate.state == WM_STATE_SEARCHING;
}

wm_status prepare(const sim::Scenario &scenario, size_t landmarks, uint64_t seeds, Statistics &out, wm_error *err) {
  sim::Drive drive;
  if (const wm_status s = sim::Drive::plan(scenario.route, drive, err); s != WM_OK) return s;
  drive = sim::on_base(scenario.motion, 0, drive);
  std::vector<double> times;
  for (int k = 1; k * kStep_s < drive.duration_s(); k++) times.push_back(k * kStep_s);
  const std::vector<Bound> bounds = bound(scenario, drive, landmarks, times);
  out = Statistics{};
  out.landmarks = std::min(landmarks, scenario.landmarks.size());
  for (size_t i = 0; i < times.size(); i++) {
    Step step;
    step.t_s = times[i];
    step.bound_position_sq_m2 = static_cast<double>(seeds) * (bounds[i].x_var_m2 + bounds[i].y_var_m2);
    step.bound_heading_sq_rad2 = static_cast<double>(seeds) * bounds[i].heading_var_rad2;
    out.steps.push_back(step);
  }
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
    out.runs++;
    if (progress) progress(i + 1);
  }
  return WM_OK;
}

}  // namespace wm::montecarlo
