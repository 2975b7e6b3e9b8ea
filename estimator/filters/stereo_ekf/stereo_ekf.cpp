// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/stereo_ekf.hpp"

#include <cstring>
#include <limits>

#include "filters/core/calibration_list.hpp"
#include "filters/core/contract.hpp"
#include "filters/core/lasting_error.hpp"
#include "filters/registry.h"
#include "motion/event_time.hpp"
#include "motion/motion_params.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {
namespace {

// Prediction with velocity and rates as states: step, and the number of steps that bounds the cost of a pause. At 1
// rad/s a step of 0.05 s leaves second-order terms of 1e-3. Not swept.
constexpr double kStep_s = 0.05;
constexpr int kStepsMax = 40;  // 2 s
constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr size_t kLandmarksMax = 1u << 20;  // so that sizes and indices of the map stay within an int

// Sigmas of a measured twist, where neither the parameters nor the calibration give them: a Doppler log and MEMS gyros.
constexpr double kTwistSigma_mps = 0.03, kTwistSigma_radps = 0.01;

// Of a coordinate in a picture, where neither gives it: a corner followed to a third of a pixel, and an imperfect
// rectification.
constexpr double kPixel_px = 0.5;

// A detector finds a corner to a pixel. What a stated sigma has beyond that is of the calibration and of the shutters:
// all of a picture's points err alike, for about as long as the view stays the same. Not swept.
constexpr double kDetector_px = 1.0, kLasting_s = 2.0;
// Without such an excess: a mounting that is off by 0.2 degrees. A constant error would be estimated against the log's
// axes, which are no better. An error that changes widens the covariance and hardly moves the pose. NEES inside 95 % of
// seabed-easy, which is off by that: 0.28 without, 0.97 with it. Error of seabed-slam, which is exact: 0.0034 m
// without, 0.0046 m with it, 0.025 m with a constant of 0.4 degrees.
constexpr double kMounting_rad = 0.003, kMounting_s = 20.0;

double first_of(double set, double calibrated, double otherwise) {
  if (set > 0.0) return set;
  return finite(calibrated) && calibrated > 0.0 ? calibrated : otherwise;
}

spatial_noise twist_noise_of(const wm_stereo_ekf_params &p, const wm_rig *rig) {
  spatial_noise out = {{}, {}, p.v_rel, p.w_rel};
  for (int i = 0; i < 3; i++) {
    out.v_mps[i] = first_of(p.v_mps, rig ? rig->twist6_sigma_v_mps[i] : 0.0, kTwistSigma_mps);
    out.w_radps[i] = first_of(p.w_radps, rig ? rig->twist6_sigma_w_radps[i] : 0.0, kTwistSigma_radps);
  }
  return out;
}

// Of one coordinate in a picture, px.
double pixel_sigma(const wm_stereo_ekf_params &p, const stereo_rig &rig, int coordinate) {
  return first_of(p.pixel_px, rig.sigma_px[coordinate], kPixel_px);
}

// Sigma of the camera pair's rotation by which all points of a picture err alike, rad.
double lasting_error_of(const wm_stereo_ekf_params &p, const stereo_rig &rig) {
  double excess_px2 = -square(kDetector_px);
  for (int i = 0; i < 4; i++) excess_px2 += 0.25 * square(pixel_sigma(p, rig, i));
  return excess_px2 > 0.0 ? std::sqrt(excess_px2) / rig.fu : 0.0;
}

// The parameters with what the setup decides: without a pair of cameras points are those of the map, by ranges; without
// a stream of motion velocity and rates are states, and those of a measured twist are not.
wm_stereo_ekf_params usable(const wm_stereo_ekf_params &params, const stereo_rig &rig, const wm_setup &setup) {
  wm_stereo_ekf_params out = params;
  const auto known = static_cast<int32_t>(setup.landmark_count);
  if (!rig.there && out.points_max > known) out.points_max = known;
  if (!rig.there) out.increments = out.frames_max = 0;
  if (out.points_max == 0) out.frames_max = 0;
  if (out.camera_rotation_sigma < 0.0) {
    const double lasting = lasting_error_of(params, rig);
    out.camera_rotation_sigma = !rig.there ? 0.0 : lasting > 0.0 ? lasting : kMounting_rad;
    if (!(out.camera_rotation_tau_s > 0.0)) out.camera_rotation_tau_s = lasting > 0.0 ? kLasting_s : kMounting_s;
  }
  if (setup.motion->model == WM_MOTION_CONSTANT_VELOCITY) {
    out.prediction = WM_PREDICT_CONSTANT_VELOCITY;
    out.rate_bias_sigma = out.velocity_scale_sigma = out.rate_scale_sigma = 0.0;
    out.twist_axes_sigma = out.velocity_direction_sigma = 0.0;
    out.twist_lag_sigma = 0.0;
  }
  return out;
}

// The velocities' noise is its own; twists' own states carry their errors.
const char *const kReads[] = {"!motion.twist",
                              "!motion.drive",
                              "!motion.noise.",
                              "!motion.states.",
                              "!motion.commands.",
                              "!motion.constant_velocity.",
                              "!motion.standstill.yaw_rate",
                              "!motion.standstill.bias",
                              "motion.",
                              "sightings.noise.bearing_default",
                              "sightings.noise.range_default",
                              "sightings.noise.map_min",
                              "!positions.use.",
                              "!positions.states.heading",
                              "positions.",
                              "markers.sigma",
                              "markers.bearing",
                              nullptr};

}  // namespace

wm_stereo_ekf_params stereo_ekf::used_params(const wm_stereo_ekf_params &params, const wm_setup &setup) {
  stereo_rig rig;
  const char *why = "";
  (void)rig.init(setup.rig, &why);
  return usable(params, rig, setup);
}

size_t stereo_ekf::bytes(const wm_stereo_ekf_params &params, const wm_setup &setup, const char **why) {
  stereo_rig rig;
  if (!rig.init(setup.rig, why)) return 0;
  if (setup.landmark_count > kLandmarksMax) {
    *why = "the map has more than 1048576 landmarks";
    return 0;
  }
  memory_layout layout(nullptr, sizeof(stereo_ekf));
  place(&layout, usable(params, rig, setup), setup);
  return layout.bytes();
}

stereo_ekf::arrays stereo_ekf::place(memory_layout *layout, const wm_stereo_ekf_params &params, const wm_setup &setup) {
  head_model models[kHeadStates];
  models_of(params, setup, models);
  const int slots = params.points_max + own_map::kCorners * params.frames_max;
  arrays out{};
  out.order = layout->take<int>(setup.landmark_count);
  out.records = layout->take<landmark_record>(setup.landmark_count);
  out.info = layout->take<point_info>((size_t)slots);
  out.filter = layout->take<double>(space_filter::doubles(models, slots));
  out.looked = layout->take<looked_point>(params.frames_max > 0 ? (size_t)kLookedMost : 0);
  out.search = layout->take<map_search>(params.frames_max > 0 ? 1 : 0);
  own_map::place(layout, params.frames_max, &out.frame, &out.map_point, &out.places);
  return out;
}

void stereo_ekf::init(const wm_stereo_ekf_params &params, const wm_setup &setup) {
  const char *why = "";
  std::memset(static_cast<void *>(this), 0, bytes(params, setup, &why));
  memory_layout layout(this, sizeof *this);
  (void)rig_.init(setup.rig, &why);
  params_ = usable(params, rig_, setup);
  const arrays behind = place(&layout, params_, setup);
  setup_ = &setup;
  for (int i = 0; i < 4; i++) sigma_px_[i] = pixel_sigma(params, rig_, i);
  motion_.init(setup.motion, &setup.wheels, twist_noise_of(params, setup.rig));
  gravity_.init(params.accelerometer_mps2);
  receiver_.begin();
  markers_ = marker_params_of(setup);
  gnss_ = position_params_of(setup);
  antenna_m_ = vec_of(antenna_of(setup, gnss_).place_m);
  head_model models[kHeadStates];
  models_of(params_, setup, models);
  filter_.init(behind.filter, models, params_.points_max + own_map::kCorners * params_.frames_max);
  if (rig_.there) filter_.set_camera_axes(rig_.R_base_optical);
  index_.init(setup.landmarks, setup.landmark_count, behind.order);
  records_.set(behind.records);
  info_.set(behind.info);
  looked_.set(behind.looked);
  search_.set(behind.search);
  map_.init(params_.frames_max, behind.frame, behind.map_point, behind.places);
  forget_map();
  now_ns_ = picture_ns_ = last_picture_ns_ = WM_TIME_NONE;
  other_scene_ = 0;
  life_ = lifecycle();
  start_ns_ = setup.start.t_ns;
  odometry_ = {{{0, 0, 0}, kNoTurn}, 0.0, 0.0};
  start_pose();
}

wm_status stereo_ekf::check_time(wm_time_ns t_ns) const { return check_event_time(t_ns, start_ns_, now_ns_); }

void stereo_ekf::move_to(wm_time_ns t_ns) {
  if (now_ns_ == WM_TIME_NONE) now_ns_ = t_ns;
  if (t_ns <= now_ns_) return;
  const bool in_picture = picture_ns_ != WM_TIME_NONE;
  end_picture();
  const auto carry = [this](const body_stretch &s) {
    filter_.propagate(s);
    const bool rates = constant_velocity();
    const vec3 v = rates ? filter_.head3(kVelocity) : s.v_mps;
    const vec3 w = rates ? filter_.head3(kRates) : s.w_radps;
    const vec3 way = s.dt_s * (mean_turn(s.dt_s * w) * v);
    pose3 &odom = odometry_.pose;
    odom.p = odom.p + matrix_of(odom.q) * way;
    odom.q = normalized(odom.q * turn_by(s.dt_s * w));
    odometry_.travelled_m += length(way);
    odometry_.turned_rad += s.dt_s * length(w);
  };
  if (constant_velocity()) {
    const double dt_s = wm_seconds_between(now_ns_, t_ns);
    const int steps = dt_s < kStepsMax * kStep_s ? 1 + (int)(dt_s / kStep_s) : kStepsMax;
    for (int i = 0; i < steps; i++) carry({dt_s / steps, {0, 0, 0}, {0, 0, 0}, {}, {}});
  } else {
    motion_.walk(now_ns_, t_ns, carry);
  }
  now_ns_ = t_ns;
  if (map_.frames() > 0 && !in_picture) search_on();  // not beside the end of a picture, which has work of its own
}

wm_status stereo_ekf::predict(const wm_event &motion) {
  wm_status status = motion_.check(motion);
  if (status != WM_OK) return status;
  const bool early = start_ns_ != WM_TIME_NONE && motion.t_ns < start_ns_;
  if (now_ns_ != WM_TIME_NONE && motion.t_ns < now_ns_) return WM_TIME_RAN_BACK;
  motion_.feed(motion);
  if (early) {  // the start pose is of a later time: until then samples are kept, not integrated
    now_ns_ = motion.t_ns;
    return WM_OK;
  }
  if (now_ns_ != WM_TIME_NONE && start_ns_ != WM_TIME_NONE && now_ns_ < start_ns_) now_ns_ = start_ns_;
  move_to(motion.t_ns);
  follow_rates();
  if (constant_velocity() && (motion.kind != WM_EVENT_QUANTITIES || motion_.source().rates_are_fresh()))
    fuse_twist(motion);
  if (filter_.at(kForceBias) >= 0 && motion_.source().force_is_fresh()) fuse_gravity();
  return WM_OK;
}

wm_status stereo_ekf::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_STEREO: return fuse_stereo(event, records);
    case WM_EVENT_SIGHTING: return fuse_sighting(event, records);
    case WM_EVENT_MARKER: return fuse_marker(event, records);
    case WM_EVENT_POSITION: return fuse_position(event, records);
    case WM_EVENT_HEADING: return fuse_heading(event, records);
    case WM_EVENT_SET_POSE:
    case WM_EVENT_RESET: return take_pose(event);
    case WM_EVENT_LOOKED: {
      const wm_status status = check_time(event.t_ns);
      if (status != WM_OK) return status;
      move_to(event.t_ns);
      begin_picture(event.t_ns);
      return WM_OK;
    }
    default: return WM_UNSUPPORTED;
  }
}

void stereo_ekf::estimate(wm_estimate *out) const {
  std::memset(out, 0, sizeof *out);
  filter_.estimate(out);
  out->t_ns = now_ns_;
  const bool rates = constant_velocity();
  const vec3 v = rates ? filter_.head3(kVelocity) : filter_.velocity_of(motion_.v_mps());
  const vec3 w = rates ? filter_.head3(kRates) : filter_.rates_of(motion_.w_radps());
  for (int i = 0; i < 3; i++) {
    out->v_mps[i] = v[i];
    out->w_radps[i] = w[i];
  }
  out->resets = life_.resets();
  out->state = life_.state(now_ns_, params_.dead_reckoning_after_s);
  out->lost_probability = life_.searching() ? 1.0 : params_.recover ? evidence_.probability() : kAbsent;
}

wm_motion_calibration stereo_ekf::motion_calibration() const { return kNeutralCalibration; }

size_t stereo_ekf::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_MOTION_OUTLIERS, motion_.outliers());
  list.add(WM_COUNTER_RELOCALIZATIONS, life_.relocalizations());
  return list.count();
}

void stereo_ekf::list_calibration(calibration_list *list) const {
  for (int k = 0; k < kHeadStates; k++) {
    const bool is_receivers = k == kReceiverOffset || k == kAntenna;
    const int first = is_receivers && !receiver_.is_used() ? -1 : filter_.at(k);
    for (int i = 0; first >= 0 && kHeadSpecs[k].name[0] && i < kHeadSpecs[k].width; i++) {
      const double about = k == kAntenna ? antenna_m_[i] : 0.0;
      list->add(kHeadSpecs[k].name[i], about + filter_.head(first + i) + filter_.pending1(first + i),
                std::sqrt(filter_.variance(first + i)));
      if (filter_.is_stated_wrongly(k)) list->alarm(WM_ALARM_STATED, filter_.head(first + i));
    }
  }
  const vec3 error = filter_.head3(kReceiverError);
  list_lasting_error(std::sqrt(square(error.x) + square(error.y)), list);
}

}  // namespace wm

const wm_estimator wm_stereo_ekf_estimator = wm::estimator_of<wm::stereo_ekf, wm_stereo_ekf_params>(
    "stereo_ekf",
    "Extended Kalman filter in six degrees of freedom: points in a stereo pair's pictures, known or found on the way, "
    "ranges to beacons, coded markers, depth, heading, velocity. Finds the pose when lost.",
    WM_EVENT_BIT(WM_EVENT_STEREO) | WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER) |
        WM_EVENT_BIT(WM_EVENT_POSITION) | WM_EVENT_BIT(WM_EVENT_HEADING) | WM_EVENT_BIT(WM_EVENT_LOOKED) |
        WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    wm_stereo_ekf_params_table, wm::kReads);
