// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>

#include "montecarlo/look.h"
#include "montecarlo/six.h"
#include "simulate/simulate.h"

namespace wm::montecarlo {

wm_rig rig_of(const sim::Scenario &scenario) {
  wm_rig rig;
  wm_rig_init(&rig);
  for (const sim::Sensor &s : scenario.sensors) {
    if (s.kind != sim::Sensor::Kind::stereo) continue;
    rig.camera_count = 2;
    for (uint32_t side = 0; side < 2; side++) {
      wm_camera &camera = rig.cameras[side];
      std::snprintf(camera.name, sizeof camera.name, "%s", side ? "right" : "left");
      camera.model = WM_CAMERA_PINHOLE_RADTAN;
      camera.width_px = static_cast<uint32_t>(s.size_px[0]);
      camera.height_px = static_cast<uint32_t>(s.size_px[1]);
      std::copy(s.xyz_m, s.xyz_m + 3, camera.mounting.xyz_m);
      std::copy(s.rpy_rad, s.rpy_rad + 3, camera.mounting.rpy_rad);
    }
    const double rectified[4] = {s.focal_px, s.focal_px, s.centre_px[0], s.centre_px[1]};
    rig.stereo.left = 0;
    rig.stereo.right = 1;
    rig.stereo.baseline_m = s.baseline_m;
    for (int i = 0; i < 4; i++) {
      rig.stereo.rectified_px[i] = rectified[i];
      rig.stereo.sigma_px[i] = s.sigma_px;
    }
  }
  for (int i = 0; i < 3; i++) {
    rig.twist6_sigma_v_mps[i] = std::max(scenario.errors.speed_noise_mps, 1e-4);
    rig.twist6_sigma_w_radps[i] = std::max(scenario.errors.yaw_rate_noise_radps, 1e-5);
  }
  return rig;
}

wm_setup setup_of(const sim::Scenario &scenario, const wm_config &config, const sim::Recording &recording,
                  const wm_rig *rig) {
  wm_setup out{};
  wm_config_give_params(&config, &out);
  out.wheels = scenario.robot.wheels;
  out.rig = rig;
  out.start = recording.start;
  out.seed = recording.seed;
  return out;
}

std::vector<wm_event> events_of(const sim::Recording &recording) {
  std::vector<wm_event> out;
  const auto add = [&](const auto &seen, wm_event_kind kind, uint16_t source) -> wm_event & {
    wm_event &e = out.emplace_back();
    e.t_ns = seen.t_ns;
    e.kind = static_cast<uint8_t>(kind);
    e.source = source;
    return e;
  };
  for (const sim::Twist6 &m : recording.motion6) {
    wm_event &e = add(m, WM_EVENT_TWIST6, 0);
    std::copy(m.v_mps, m.v_mps + 3, e.as.twist6.v_mps);
    std::copy(m.w_radps, m.w_radps + 3, e.as.twist6.w_radps);
    e.as.twist6.v_sigma_mps = NAN;
  }
  static constexpr uint8_t kImu[] = {WM_Q_ROLL_RATE,      WM_Q_PITCH_RATE,     WM_Q_YAW_RATE,
                                     WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z};
  for (const sim::ImuRow &row : recording.imu) {
    wm_quantities &q = add(row, WM_EVENT_QUANTITIES, 0).as.quantities;
    q.count = 6;
    std::copy(kImu, kImu + 6, q.id);
    std::copy(row.w_radps, row.w_radps + 3, q.value);
    std::copy(row.a_mps2, row.a_mps2 + 3, q.value + 3);
  }
  for (const sim::Sighting &s : recording.sightings) {
    wm_sighting &seen = add(s, WM_EVENT_SIGHTING, 1).as.sighting = wm_sighting_without_numbers();
    seen.sensor = s.sensor;
    seen.landmark_id = s.id;
    seen.bearing_rad = s.bearing_rad;
    seen.range_m = s.range_m;
  }
  for (const sim::StereoSeen &s : recording.stereo) {
    wm_stereo &seen = add(s, WM_EVENT_STEREO, 2).as.stereo;
    seen = {s.id, {s.left_px[0], s.left_px[1]}, {s.right_px[0], s.right_px[1]}, {}};
    std::copy(s.appearance, s.appearance + 4, seen.appearance);
  }
  for (const sim::Fix &f : recording.fixes)
    add(f, WM_EVENT_POSITION, 3).as.position = {{f.p_m[0], f.p_m[1], f.p_m[2]}, f.sigma_xy_m, f.sigma_z_m};
  std::stable_sort(out.begin(), out.end(), [](const wm_event &a, const wm_event &b) {
    return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.source < b.source;
  });
  return out;
}

Error6 error_of(const wm_estimate &estimate, const sim::State6 &truth) {
  const double *q = estimate.pose_map_base.q_xyzw, *rpy = truth.rpy_rad.data();
  const Eigen::Quaterniond est(q[3], q[0], q[1], q[2]);
  const Eigen::Quaterniond real = Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX());
  Error6 out;
  out.position = Eigen::Map<const Eigen::Vector3d>(truth.xyz_m.data()) -
                 Eigen::Map<const Eigen::Vector3d>(estimate.pose_map_base.p_m);
  const Eigen::AngleAxisd turn(est.conjugate() * real);
  out.rotation = turn.angle() * turn.axis();
  Eigen::Matrix<double, 6, 1> error;
  error << out.position, out.rotation;
  const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> P(estimate.covariance);
  out.nees = error.dot(P.ldlt().solve(error));
  return out;
}

namespace {

constexpr size_t kPoints = 1024;

// A point of the state, as it was last.
struct Point {
  Eigen::Vector3d p;
  double cov_xy[3];
};

void judge_points(const std::map<int32_t, Point> &points, const std::vector<wm_landmark> &truth, Statistics6 &out) {
  std::map<int32_t, Eigen::Vector3d> real;
  for (const wm_landmark &l : truth) real[l.id] = {l.p_m[0], l.p_m[1], l.p_m[2]};
  for (const auto &[id, point] : points) {
    if (!real.count(id)) continue;
    const Eigen::Vector3d off = point.p - real[id];
    const double xx = point.cov_xy[0], xy = point.cov_xy[1], yy = point.cov_xy[2];
    const double sigmas2 =
        (off.x() * off.x() * yy - 2 * off.x() * off.y() * xy + off.y() * off.y() * xx) / (xx * yy - xy * xy);
    out.points++;
    out.wrong_points += off.norm() > 0.1 || sigmas2 > 16;
    out.point_error_sum_m += off.norm();
  }
}

// The estimator of the configuration for a drive in space.
class SpaceFilter : public Filter {
 public:
  SpaceFilter(const sim::Scenario &scenario, const wm_config &config, const sim::Recording &recording)
      : Filter(config), rig_(rig_of(scenario)) {
    wm_setup &s = setup();
    s = setup_of(scenario, config, recording, &rig_);
    s.sensors = recording.sensors.data();
    s.sensor_count = recording.sensors.size();
    s.landmarks = recording.map.data();
    s.landmark_count = recording.map.size();
  }

 private:
  wm_rig rig_;
};

// Variances of a pose by component (Step6).
void add_variances(const wm_estimate &e, double sums[6]) {
  const double c = std::cos(e.heading_rad), s = std::sin(e.heading_rad);
  const auto v = [&e](int i, int j) { return e.covariance[wm_cov_index(i, j)]; };
  sums[0] += c * c * v(0, 0) + 2 * c * s * v(0, 1) + s * s * v(1, 1);
  sums[1] += s * s * v(0, 0) - 2 * c * s * v(0, 1) + c * c * v(1, 1);
  for (int i = 2; i < 6; i++) sums[i] += v(i, i);
}

// The bound: the estimator's own covariance on the same way without any error. Its points of linearisation are the
// truth then, and nothing is refused; missed points and outliers are missing: the recursion of [Tichavsky1998] for the
// model and the noise of the configuration.
wm_status add_bound(const sim::Scenario &scenario, const wm_config &config, uint64_t seed, const Options6 &options,
                    Statistics6 &out, wm_error *err) {
  sim::Scenario perfect = scenario;
  sim::make_perfect(perfect);
  // Points that are missed, and those that are outliers, are missing here.
  for (size_t i = 0; i < perfect.sensors.size(); i++)
    perfect.sensors[i].missed_fraction = scenario.sensors[i].missed_fraction + scenario.sensors[i].outlier_fraction;
  sim::Recording recording, real;
  if (const wm_status s = sim::simulate(perfect, seed, SIZE_MAX, recording, err); s != WM_OK) return s;
  if (const wm_status s = sim::simulate(scenario, seed, SIZE_MAX, real, err); s != WM_OK) return s;
  recording.start.sigma_xy_m = real.start.sigma_xy_m;
  recording.start.sigma_heading_rad = real.start.sigma_heading_rad;
  recording.sensors = real.sensors;  // without errors, but with the noise that is stated
  SpaceFilter begun(scenario, config, recording);
  if (const wm_status s = begun.init(err); s != WM_OK) return s;
  const wm_estimator &ops = begun.ops();
  size_t next = 0;
  for (const wm_event &e : events_of(recording)) {
    const double event_s = static_cast<double>(e.t_ns - recording.clock_start_ns) * 1e-9;
    if (e.kind == WM_EVENT_STEREO && event_s >= options.blind_from_s && event_s < options.blind_to_s) continue;
    if (!wm_event_is_motion(&e)) {
      wm_innovation innovations[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      (void)ops.correct(begun.state(), &e, innovations, WM_INNOVATIONS_PER_EVENT_MAX, &count);
      continue;
    }
    if (next < out.steps.size() && event_s > out.steps[next].t_s + 1e-6) {
      const wm_estimate estimate = begun.estimate();
      Step6 &step = out.steps[next++];
      for (int i = 0; i < 3; i++) {
        step.bound_position_sq_m2 += estimate.covariance[wm_cov_index(i, i)];
        step.bound_rotation_sq_rad2 += estimate.covariance[wm_cov_index(3 + i, 3 + i)];
      }
      add_variances(estimate, step.bound);
    }
    (void)ops.predict(begun.state(), &e);
  }
  out.bounds++;
  return WM_OK;
}

wm_status run_one(const sim::Scenario &scenario, const wm_config &config, const sim::Recording &recording,
                  const Options6 &options, Statistics6 &out, wm_error *err) {
  SpaceFilter begun(scenario, config, recording);
  if (const wm_status s = begun.init(err); s != WM_OK) return s;
  const wm_estimator &ops = begun.ops();
  void *state = begun.state();

  for (const sim::StereoSeen &s : recording.stereo) out.outliers += s.outlier;
  std::map<int32_t, Point> points;
  std::vector<wm_landmark> listed(kPoints);
  std::vector<std::array<double, 4>> covs(kPoints);
  const auto is_judged = [&options](double t_s) { return t_s >= options.settled_s && t_s <= options.until_s; };
  Run run{.seed = recording.seed};
  uint64_t judged = 0;
  double beyond_since_s = -1;
  size_t next = 0, in_picture = 0;
  wm_time_ns picture_ns = WM_TIME_NONE;
  for (const wm_event &e : events_of(recording)) {
    const double event_s = static_cast<double>(e.t_ns - recording.clock_start_ns) * 1e-9;
    if (e.kind == WM_EVENT_STEREO && event_s >= options.blind_from_s && event_s < options.blind_to_s) continue;
    if (e.kind == WM_EVENT_STEREO && options.points_per_picture != SIZE_MAX) {
      if (e.t_ns != picture_ns) in_picture = 0;
      picture_ns = e.t_ns;
      const bool in_both = !std::isnan(e.as.stereo.left_px[0]) && !std::isnan(e.as.stereo.right_px[0]);
      if (!in_both || in_picture++ >= options.points_per_picture) continue;
    }
    if (!wm_event_is_motion(&e)) {
      wm_innovation innovations[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      (void)ops.correct(state, &e, innovations, WM_INNOVATIONS_PER_EVENT_MAX, &count);
      if (count > 0) (innovations[0].verdict == WM_FUSED ? out.fused : out.rejected)++;
      continue;
    }
    // Before the motion that takes it on: with everything of the stamp before.
    if (next < out.steps.size() && event_s > out.steps[next].t_s + 1e-6) {
      const wm_estimate estimate = begun.estimate();
      Step6 &step = out.steps[next++];
      if (ops.landmarks) {
        const size_t n = ops.landmarks(state, listed.data(), reinterpret_cast<double(*)[4]>(covs.data()), kPoints);
        for (size_t i = 0; i < std::min(n, kPoints); i++)
          points[listed[i].id] = {{listed[i].p_m[0], listed[i].p_m[1], listed[i].p_m[2]},
                                  {covs[i][0], covs[i][1], covs[i][2]}};
      }
      if (estimate.state != WM_STATE_SEARCHING) {
        const double at_s = static_cast<double>(estimate.t_ns - recording.clock_start_ns) * 1e-9;
        const Error6 error = error_of(estimate, recording.path.at(at_s));
        step.runs++;
        step.position_sq_m2 += error.position.squaredNorm();
        step.rotation_sq_rad2 += error.rotation.squaredNorm();
        step.nees += error.nees;
        add_variances(estimate, step.variance);
        const Eigen::Vector3d ahead =
            Eigen::AngleAxisd(-estimate.heading_rad, Eigen::Vector3d::UnitZ()) * error.position;
        for (int k = 0; k < 3; k++) {
          step.error_sq[k] += ahead[k] * ahead[k];
          step.error_sq[3 + k] += error.rotation[k] * error.rotation[k];
        }
        if (error.nees <= kBeyond6 || estimate.state != WM_STATE_TRACKING)
          beyond_since_s = -1;
        else if (beyond_since_s < 0)
          beyond_since_s = step.t_s;
        else
          run.beyond_s = std::max(run.beyond_s, step.t_s - beyond_since_s);
        if (is_judged(step.t_s)) {
          judged++;
          run.position_rms_m += error.position.squaredNorm();
          run.rotation_rms_rad += error.rotation.squaredNorm();
          run.nees_mean += error.nees;
          run.position_max_m = std::max(run.position_max_m, error.position.norm());
        }
      } else if (is_judged(step.t_s)) {
        run.position_max_m = HUGE_VAL;  // no pose although there should be one
      }
    }
    (void)ops.predict(state, &e);
  }
  const double n = static_cast<double>(std::max<uint64_t>(judged, 1));
  run.position_rms_m = std::isinf(run.position_max_m) ? HUGE_VAL : std::sqrt(run.position_rms_m / n);
  run.rotation_rms_rad = std::sqrt(run.rotation_rms_rad / n);
  run.nees_mean /= n;
  out.each.push_back(run);
  judge_points(points, recording.landmarks, out);
  return WM_OK;
}

}  // namespace

double Statistics6::nees_mean() const {
  double sum = 0, n = 0;
  for (const Step6 &s : steps) {
    sum += s.nees;
    n += static_cast<double>(s.runs);
  }
  return n > 0 ? sum / (6 * n) : 0;
}

double Statistics6::nees_inside(Band band) const {
  return share_inside(steps, band, [&](const Step6 &s) {
    return s.runs < runs ? std::nan("") : s.nees / (6 * static_cast<double>(s.runs));
  });
}

namespace {

double over_bound(const Statistics6 &all, double from_s, double to_s, double Step6::*squares, double Step6::*bound) {
  double sum = 0, least = 0;
  for (const Step6 &s : all.steps) {
    if (s.t_s < from_s || s.t_s > to_s || s.runs == 0 || all.bounds == 0) continue;
    sum += s.*squares / static_cast<double>(s.runs);
    least += s.*bound / static_cast<double>(all.bounds);
  }
  return least > 0 ? std::sqrt(sum / least) : 0;
}

}  // namespace

double Statistics6::position_over_bound(double from_s, double to_s) const {
  return over_bound(*this, from_s, to_s, &Step6::position_sq_m2, &Step6::bound_position_sq_m2);
}

double Statistics6::rotation_over_bound(double from_s, double to_s) const {
  return over_bound(*this, from_s, to_s, &Step6::rotation_sq_rad2, &Step6::bound_rotation_sq_rad2);
}

wm_status run_six(const sim::Scenario &scenario, const wm_config &config, const Options6 &options,
                  const std::function<void(uint64_t)> &progress, Statistics6 &out, wm_error *err) {
  if (!scenario.swims())
    return wm_fail(err, WM_BAD_CONFIG, "%s: has no path in six degrees of freedom", scenario.name.c_str());
  out = Statistics6{};
  for (uint64_t i = 0; i < options.seeds; i++) {
    sim::Recording recording;
    if (const wm_status s = sim::simulate(scenario, options.first_seed + i, SIZE_MAX, recording, err); s != WM_OK)
      return s;
    if (out.steps.empty())
      for (int k = 1; k * kStep_s < recording.duration_s; k++) out.steps.push_back({k * kStep_s});
    if (const wm_status s = run_one(scenario, config, recording, options, out, err); s != WM_OK) return s;
    out.runs++;
    if (i < options.bounds)
      if (const wm_status s = add_bound(scenario, config, options.first_seed + i, options, out, err); s != WM_OK)
        return s;
    if (progress) progress(i + 1);
  }
  return WM_OK;
}

}  // namespace wm::montecarlo
