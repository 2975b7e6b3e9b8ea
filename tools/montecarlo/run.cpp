// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>

#include "montecarlo/bound.h"
#include "montecarlo/montecarlo.h"
#include "simulate/angle.h"
#include "simulate/bus.h"
#include "simulate/simulate.h"

namespace wm::montecarlo {
namespace {

struct Dbc_free {
  void operator()(wm_dbc *dbc) const { wm_dbc_free(dbc); }
};
struct Decoder_free {
  void operator()(wm_can_decoder *decoder) const { wm_can_decoder_free(decoder); }
};

// The recording's data as events, in the order in which the merge would hand them on: by stamp, motion first.
wm_status make_events(const sim::Recording &recording, const wm_dbc *dbc, std::vector<wm_event> &out, wm_error *err) {
  const std::vector<wm_can_binding> bindings = sim::bindings();
  wm_can_decoder *made = nullptr;
  if (const wm_status s = wm_can_decoder_make(dbc, bindings.data(), bindings.size(), &made, err); s != WM_OK) return s;
  const std::unique_ptr<wm_can_decoder, Decoder_free> decoder(made);
  wm_source_counts counts{};
  out.clear();
  for (const wm_can_frame &frame : recording.can) {
    wm_event e{};
    if (wm_can_decode(decoder.get(), &frame, &e.as.quantities, &counts, err) != WM_OK) continue;
    e.t_ns = e.arrival_ns = frame.t_ns;
    e.kind = WM_EVENT_QUANTITIES;
    out.push_back(e);
  }
  const auto add = [&](const auto &seen, wm_event_kind kind) -> wm_event & {
    wm_event &e = out.emplace_back();
    e.t_ns = seen.t_ns;
    e.arrival_ns = seen.arrival_ns;
    e.source = static_cast<uint16_t>(1 + seen.sensor);
    e.kind = static_cast<uint8_t>(kind);
    return e;
  };
  for (const sim::Sighting &s : recording.sightings)
    add(s, WM_EVENT_SIGHTING).as.sighting = {s.sensor, s.id, s.bearing_rad, s.range_m, NAN, NAN};
  for (const sim::MarkerSeen &m : recording.markers) {
    wm_marker &seen = add(m, WM_EVENT_MARKER).as.marker;
    seen.sensor = m.sensor;
    seen.id = m.id;
    for (int k = 0; k < 3; k++) seen.p_m[k] = m.p_m[k];
    seen.yaw_rad = m.yaw_rad;
  }
  for (const sim::Fix &f : recording.fixes)
    add(f, WM_EVENT_POSITION).as.position = {{f.p_m[0], f.p_m[1], f.p_m[2]}, f.sigma_xy_m, f.sigma_z_m};
  std::stable_sort(out.begin(), out.end(), [](const wm_event &a, const wm_event &b) {
    return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.source < b.source;
  });
  return WM_OK;
}

// One estimator with its memory.
class Filter {
 public:
  Filter(const wm_config &config, const sim::Recording &recording, const sim::Scenario &scenario)
      : estimator_(config.estimator), config_(config) {
    setup_.motion = config.motion;
    setup_.wheels = scenario.robot.wheels;
    setup_.sensors = recording.sensors.data();
    setup_.sensor_count = recording.sensors.size();
    setup_.landmarks = recording.map.data();
    setup_.landmark_count = recording.map.size();
    setup_.start = recording.start;
    setup_.seed = recording.seed;
  }
  wm_status init(wm_error *err) {
    const char *why = "";
    const size_t bytes = estimator_->state_bytes(config_.estimator_params, &setup_, &why);
    if (bytes == 0) return wm_fail(err, WM_BAD_CONFIG, "%s: %s", estimator_->name, why);
    memory_ = std::make_unique<Block[]>((bytes + sizeof(Block) - 1) / sizeof(Block));
    const wm_status status = estimator_->init(state(), config_.estimator_params, &setup_);
    return status == WM_OK ? status : wm_fail(err, status, "%s: init: %s", estimator_->name, wm_status_text(status));
  }
  void *state() { return memory_.get(); }
  const wm_estimator &ops() const { return *estimator_; }

 private:
  struct alignas(64) Block {
    char bytes[64];
  };
  const wm_estimator *estimator_;
  const wm_config &config_;
  wm_setup setup_ = {};
  std::unique_ptr<Block[]> memory_;
};

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

void run_one(const std::vector<wm_event> &events, const sim::Recording &recording, Filter &filter, Statistics &out) {
  size_t next = 0;  // step to be taken
  wm_estimate estimate{};
  for (const wm_event &e : events) {
    if (wm_event_is_motion(&e)) {
      filter.ops().predict(filter.state(), &e);
      const double t_s = static_cast<double>(e.t_ns - recording.clock_start_ns) * 1e-9;
      if (next >= out.steps.size() || t_s < out.steps[next].t_s) continue;
      filter.ops().estimate(filter.state(), &estimate);
      const double at_s = static_cast<double>(estimate.t_ns - recording.clock_start_ns) * 1e-9;
      judge(estimate, recording.drive.at(at_s), out.steps[next]);
      next++;
    } else {
      wm_innovation innovations[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      filter.ops().correct(filter.state(), &e, innovations, WM_INNOVATIONS_PER_EVENT_MAX, &count);
      for (size_t i = 0; i < count; i++) {
        const bool fused = innovations[i].verdict == WM_FUSED;
        (fused ? out.fused : out.rejected)++;
        if (!fused) continue;
        Step &step = out.steps[std::min(next, out.steps.size() - 1)];
        step.nis += innovations[i].nis;
        step.nis_dof += innovations[i].gate_dof;
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
  const std::string text = sim::dbc_text();
  wm_dbc *parsed = nullptr;
  if (const wm_status s = wm_dbc_parse(text.data(), text.size(), "vehicle.dbc", &parsed, err); s != WM_OK) return s;
  const std::unique_ptr<wm_dbc, Dbc_free> dbc(parsed);
  std::vector<wm_event> events;
  for (uint64_t i = 0; i < seeds; i++) {
    sim::Recording recording;
    if (const wm_status s = sim::simulate(scenario, first_seed + i, landmarks, recording, err); s != WM_OK) return s;
    if (const wm_status s = make_events(recording, dbc.get(), events, err); s != WM_OK) return s;
    for (const sim::Sighting &s : recording.sightings) out.outliers += s.outlier;
    Filter filter(config, recording, scenario);
    if (const wm_status s = filter.init(err); s != WM_OK) return s;
    run_one(events, recording, filter, out);
    out.runs++;
    if (progress) progress(i + 1);
  }
  return WM_OK;
}

}  // namespace wm::montecarlo
