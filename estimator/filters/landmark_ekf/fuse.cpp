// SPDX-License-Identifier: Apache-2.0
// From an observation to an update: validity, the pose when it was true, expectation, gate, update.
#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kFarthest_m = 1e6;
constexpr double kAnyRange_m = 30.0, kAnyPlace_m = 200.0;  // where a false one may lie
constexpr double kUnproven = 9.21;                         // 99 % of chi2 with two degrees of freedom
constexpr double kLoosen = 1.5;                            // times the pose's sigmas, while misfits go on ...
constexpr double kLoosenEvery_s = 1.0;                     // ... and not faster than a search may find the pose
constexpr double kOneNumber = 6.635 / 9.210;               // 99 % of chi2 with one degree of freedom against two

wm_innovation record_of(const wm_event &event, wm_residual kind) {
  wm_innovation r{};
  r.t_ns = event.t_ns;
  r.source = event.source;
  r.landmark_id = -1;
  r.residual = (uint8_t)kind;
  return r;
}

wm_status refuse(record_list records, wm_innovation record, wm_status status) {
  record.verdict = status == WM_NOT_FINITE ? WM_REJECTED_NOT_FINITE : WM_REJECTED_OUT_OF_RANGE;
  records.add(record);
  return status;
}

// What the bend of a sighting makes of the sensor's uncertain place: the second order of its expectation and of its
// variance (Athans, Wishner, Bertolini 1968). Next to nothing as a rule; a robot that stood blind for seconds and is
// metres off would else believe straight lines that are circles.
struct bend {
  double bearing_rad, bearing_variance, range_m, range_variance, elevation_rad, elevation_variance;
};

bend bend_of(const expected_sighting &e, double xx, double xy, double yy) {
  const double bx = e.bearing_by[kByX], by = e.bearing_by[kByY];
  // Covariance of the place across and along the line of sight, over the distance squared.
  const double across = bx * bx * xx + 2.0 * bx * by * xy + by * by * yy;
  const double along = by * by * xx - 2.0 * bx * by * xy + bx * bx * yy;
  const double both = bx * by * (xx - yy) + (by * by - bx * bx) * xy;
  // The elevation's tangent is height over distance.
  const double tangent = finite(e.elevation_rad) ? tan(e.elevation_rad) : 0.0, over = 1.0 / (1.0 + square(tangent));
  const double by_along = 2.0 * tangent * square(over) * along, by_across = -tangent * over * across;
  return {-both,
          along * across + square(both),
          0.5 * e.distance_m * across,
          0.5 * square(e.distance_m * across),
          0.5 * (by_along + by_across),
          0.5 * (square(by_along) + square(by_across))};
}

// Absent, or what an angle above a plane and its sigma can be.
bool is_elevation(const wm_sighting &s) {
  return !wm_sighting_has_elevation(&s) ||
         (std::fabs(s.elevation_rad) <= kHalfPi && s.elevation_sigma_rad > 0.0 && s.elevation_sigma_rad < 1e6);
}

bool is_sigma(double value) { return std::isnan(value) || (value > 0.0 && value < 1e6); }

}  // namespace

landmark_ekf::past_pose landmark_ekf::look_back(double age_s) const {
  past_pose out;
  const wm_time_ns now = filter_.now_ns();
  const wm_time_ns then = now - wm_ns_from_seconds(age_s);
  motion_twist twist{};
  wm_pose2 step{};  // from now's base_link to then's
  if (then < now) {
    step = between(filter_.path(then, now, &twist), wm_pose2{});
  } else if (then > now) {
    step = filter_.path(now, then, &twist);
  } else {
    filter_.path(now - 1, now, &twist);
  }
  out.pose = compose(filter_.pose(), step);
  out.odom = compose(filter_.odom(), step);
  out.lever_x = out.pose.x_m - filter_.pose().x_m;
  out.lever_y = out.pose.y_m - filter_.pose().y_m;
  const sin_cos h = sincos(out.pose.heading_rad);
  out.age_by[0] = -twist.v * h.cos;
  out.age_by[1] = -twist.v * h.sin;
  out.age_by[2] = -twist.w;
  return out;
}

// A derivative by the past pose becomes one by the pose now and by the time offset.
void landmark_ekf::add_pose(sparse_row &row, const double by[3], const past_pose &past, int time_state) {
  row.add(kX, by[0]);
  row.add(kY, by[1]);
  row.add(kHeading, by[2] - by[0] * past.lever_y + by[1] * past.lever_x);
  row.add(time_state, by[0] * past.age_by[0] + by[1] * past.age_by[1] + by[2] * past.age_by[2]);
}

double landmark_ekf::sensor_value(int sensor, int which, double neutral) const {
  const int state = sensor_state_[sensor][which];
  return state < 0 ? neutral : filter_.value(state);
}

sensor_errors landmark_ekf::errors_of(int sensor) const {
  return {sensor_value(sensor, kYaw, 0.0),       sensor_value(sensor, kMountX, 0.0),
          sensor_value(sensor, kMountY, 0.0),    sensor_value(sensor, kRangeScale, 1.0),
          sensor_value(sensor, kRangeBias, 0.0), sensor_value(sensor, kRoll, 0.0),
          sensor_value(sensor, kPitch, 0.0),     sensor_value(sensor, kAngleScale, 0.0)};
}

// A wrong pose bends what is known of the sensors; a search must not start from that.
sensor_errors landmark_ekf::remembered_errors_of(int sensor) const {
  const calibration_memory &memory = memory_to_trust();
  const auto value = [&](int which, double neutral) {
    const int state = sensor_state_[sensor][which];
    return state < 0 ? neutral : memory.value[state];
  };
  return {value(kYaw, 0.0),       value(kMountX, 0.0), value(kMountY, 0.0), value(kRangeScale, 1.0),
          value(kRangeBias, 0.0), value(kRoll, 0.0),   value(kPitch, 0.0),  value(kAngleScale, 0.0)};
}

void landmark_ekf::add_mounting(sparse_row &row, int sensor, const double by[kCauses]) const {
  const int *states = sensor_state_[sensor];
  row.add(states[kYaw], by[kByYaw]);
  row.add(states[kMountX], by[kByMountX]);
  row.add(states[kMountY], by[kByMountY]);
  row.add(states[kRoll], by[kByRoll]);
  row.add(states[kPitch], by[kByPitch]);
  row.add(states[kAngleScale], by[kByAngleScale]);
}

double landmark_ekf::map_sigma(int landmark) const {
  const double sigma = setup_->landmarks[landmark].sigma_m;
  return sigma > params_.map_sigma_min_m ? sigma : params_.map_sigma_min_m;
}

int landmark_ekf::find_landmark(int32_t id) const {
  const int *order = landmark_order();
  int low = 0, high = (int)setup_->landmark_count;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (setup_->landmarks[order[middle]].id < id)
      low = middle + 1;
    else
      high = middle;
  }
  return low < (int)setup_->landmark_count && setup_->landmarks[order[low]].id == id ? order[low] : -1;
}

// The one landmark that a sighting without an id fits: within half the gate, and no other within all of it.
int landmark_ekf::associate(const wm_event &event, const sighting_sigmas &sigmas, const past_pose &past) {
  const wm_sighting &s = event.as.sighting;
  const mounted_sensor &sensor = sensor_[s.sensor];
  const sensor_errors errors = errors_of(s.sensor);
  int best = -1, fitting = 0;
  double least = params_.gate_soft;
  for (int i = 0; i < (int)setup_->landmark_count; i++) {
    const expected_sighting e = expect(sensor, errors, past.pose, setup_->landmarks[i].p_m);
    if (!e.possible || e.distance_m > 1.5 * sensor.max_range_m) continue;
    double chi2 = 0.0;
    const auto test = [&](double observed, double expected, const double by[kCauses], double variance, bool angle) {
      if (std::isnan(observed)) return;
      sparse_row row;
      add_pose(row, by, past, sensor_state_[s.sensor][kTimeOffset]);
      add_mounting(row, s.sensor, by);
      projection p;
      filter_.project(row, &p);
      const double on_map = square(map_sigma(i)) * (square(by[kByX]) + square(by[kByY]));
      const double difference = angle ? wrap(observed - expected) : observed - expected;
      chi2 += square(difference) / (p.variance + variance + on_map);
    };
    const double distance = e.distance_m > 0.1 ? e.distance_m : 0.1;
    test(s.bearing_rad, e.bearing_rad, e.bearing_by,
         square(sigmas.bearing_rad) + square(params_.lateral_sigma_m / distance), true);
    test(s.range_m, e.range_m, e.range_by, square(sigmas.range_m) + square(params_.range_sigma_rel * e.range_m), false);
    fitting += chi2 < params_.gate_soft;
    if (chi2 < 0.5 * least) {
      least = 2.0 * chi2;
      best = i;
    }
  }
  return fitting == 1 ? best : -1;
}

// States for what lasts: the error of this sensor on this landmark, and the landmark's error on the map.
void landmark_ekf::lend_states(int sensor, int landmark, wm_time_ns t_ns, int *lasting, int *map) {
  *lasting = *map = -1;
  bool fresh;
  if (auto *slot = lasting_.take(landmark * kMaxSensors + sensor, &fresh)) {
    *lasting = slot->state;
    const int width = (lasting_bearing_offset_ >= 0) + (lasting_range_offset_ >= 0);
    const double left = fresh ? 0.0 : exp(-wm_seconds_between(slot->used_ns, t_ns) / params_.lasting_tau_s);
    for (int k = 0; k < width; k++) {
      if (fresh)
        filter_.forget(slot->state + k, 0.0, 1.0);
      else if (left < 1.0)
        filter_.fade(slot->state + k, left, 1.0 - left * left);
    }
    slot->used_ns = t_ns;
  }
  const double sigma = map_sigma(landmark);
  if (!(sigma > 0.0)) return;
  if (auto *slot = map_.take(landmark, &fresh)) {
    *map = slot->state;
    if (fresh) {
      filter_.forget(slot->state, 0.0, square(sigma));
      filter_.forget(slot->state + 1, 0.0, square(sigma));
      if (params_.use_elevation) filter_.forget(slot->state + 2, 0.0, square(sigma));
    }
    slot->used_ns = t_ns;
  }
}

// The robot's tilt as it was when last seen of says less and less of what it is (Gauss-Markov).
void landmark_ekf::sway(wm_time_ns t_ns) {
  if (tilt_state_ < 0) return;
  const double left = tilt_ns_ == WM_TIME_NONE ? 1.0 : exp(-wm_seconds_between(tilt_ns_, t_ns) / params_.tilt_tau_s);
  if (left < 1.0)
    for (int k = 0; k < 2; k++)
      filter_.fade(tilt_state_ + k, left, (1.0 - left * left) * square(params_.tilt_sigma_rad));
  tilt_ns_ = t_ns;
}

wm_status landmark_ekf::fuse_sighting(const wm_event &event, record_list records) {
  const wm_sighting &s = event.as.sighting;
  const bool has_bearing = !std::isnan(s.bearing_rad), has_range = !std::isnan(s.range_m);
  wm_innovation blank = record_of(event, has_bearing ? WM_RESIDUAL_BEARING : WM_RESIDUAL_RANGE);
  blank.sensor = s.sensor;
  blank.landmark_id = s.landmark_id;
  blank.observed = has_bearing ? s.bearing_rad : s.range_m;
  if ((!has_bearing && !has_range) || std::isinf(s.bearing_rad) || std::isinf(s.range_m) || std::isinf(s.elevation_rad))
    return refuse(records, blank, WM_NOT_FINITE);
  if (s.sensor >= setup_->sensor_count || (has_bearing && std::fabs(s.bearing_rad) > 100.0) ||
      (has_range && !(s.range_m >= 0.0 && s.range_m < kFarthest_m)) || !is_sigma(s.bearing_sigma_rad) ||
      !is_sigma(s.range_sigma_m) || !is_elevation(s))
    return refuse(records, blank, WM_OUT_OF_RANGE);
  const wm_status status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);

  const auto drop = [&](wm_verdict verdict) {
    blank.verdict = (uint8_t)verdict;
    records.add(blank);
    return WM_OK;
  };
  const mounted_sensor &sensor = sensor_[s.sensor];
  const bool use_bearing = has_bearing && params_.use_bearing, use_range = has_range && params_.use_range;
  if (!use_bearing && !use_range) return drop(WM_REJECTED_BY_CONFIG);
  if (has_range && s.range_m > sensor.max_range_m) return drop(WM_REJECTED_OUT_OF_RANGE);
  const past_pose past = look_back(sensor_value(s.sensor, kTimeOffset, 0.0));
  const auto first_number = [](double a, double b, double c) { return finite(a) ? a : finite(b) ? b : c; };
  const double bearing_sigma =
      params_.bearing_sigma_factor *
      first_number(s.bearing_sigma_rad, sensor.bearing_sigma_rad, params_.bearing_sigma_default_rad);
  const double range_sigma =
      params_.range_sigma_factor * first_number(s.range_sigma_m, sensor.range_sigma_m, params_.range_sigma_default_m);
  int landmark = s.landmark_id >= 0 ? find_landmark(s.landmark_id) : -1;
  if (s.landmark_id >= 0 && landmark < 0) return drop(WM_REJECTED_UNKNOWN_ID);
  if (landmark < 0 && params_.associate_unknown && state_ == WM_STATE_TRACKING)
    landmark = associate(event, {bearing_sigma, range_sigma}, past);
  if (landmark < 0) return drop(WM_REJECTED_NO_ASSOCIATION);
  const wm_landmark &target = setup_->landmarks[landmark];
  blank.landmark_id = target.id;

  const sensor_errors errors = errors_of(s.sensor);

  const sensor_errors sure = remembered_errors_of(s.sensor);
  observation seen{};
  seen.t_ns = event.t_ns;
  seen.kind = (use_bearing ? kObservedBearing : 0u) | (use_range ? kObservedRange : 0u);
  seen.key = landmark * kMaxSensors + s.sensor;
  seen.sensor = compose(past.odom, {sensor.x_m + sure.x_m, sensor.y_m + sure.y_m, sensor.yaw_rad + sure.yaw_rad});
  seen.place_m[0] = target.p_m[0];
  seen.place_m[1] = target.p_m[1];
  seen.bearing_rad = s.bearing_rad;
  const bool use_elevation = wm_sighting_has_elevation(&s) && params_.use_elevation && use_bearing && !use_range &&
                             finite(target.p_m[2]) && finite(sensor.z_m);
  if (use_elevation) {
    const level_ray ray = levelled(sensor, sure, s.bearing_rad, s.elevation_rad);
    seen.kind |= kObservedElevation;
    seen.bearing_rad = ray.azimuth_rad;
    seen.tangent = ray.tangent;
    seen.height_m = target.p_m[2] - sensor.z_m;
    seen.sigma_tangent = (1.0 + square(ray.tangent)) *
                         std::sqrt(square(s.elevation_sigma_rad) + square(params_.tilt_sigma_rad) +
                                   square(params_.sensor_tilt_sigma_rad) + square(params_.sensor_angle_scale_sigma));
    seen.sigma_height_m = map_sigma(landmark);
  }
  const double along = use_range && sensor.range_is_depth && has_bearing ? cos(s.bearing_rad) : 1.0;
  seen.range_m = (s.range_m - sure.range_bias_m) / sure.range_scale / (along > 0.1 ? along : 0.1);
  seen.sigma_angle_rad = std::sqrt(square(bearing_sigma) + square(params_.lasting_bearing_rad) +
                                   square(params_.sensor_angle_scale_sigma * kHalfPi));
  seen.sigma_place_m = std::sqrt(square(map_sigma(landmark)) + square(params_.sensor_xy_sigma_m) +
                                 square(params_.sensor_tilt_sigma_rad * (target.p_m[2] - sensor.z_m)));
  seen.sigma_length_m = std::sqrt(square(range_sigma) + square(params_.lasting_range_m) + square(map_sigma(landmark)) +
                                  square((params_.range_sigma_rel + params_.lasting_range_rel) * seen.range_m));
  buffer_observation(seen);
  if (is_sought(event.t_ns, use_bearing)) {
    seek(event.t_ns);
    return drop(WM_REJECTED_SEARCHING);
  }

  const expected_sighting e = expect(sensor, errors, past.pose, target.p_m);
  if (!e.possible && e.distance_m < 0.05) return drop(WM_REJECTED_SINGULAR);
  if (!e.possible) {
    drop(WM_REJECTED_OUT_OF_RANGE);
    note(event.t_ns, landmark, landmark_evidence::max_log_bayes_factor());
    return WM_OK;
  }
  int lasting, map;
  lend_states(s.sensor, landmark, event.t_ns, &lasting, &map);
  if (use_elevation) sway(event.t_ns);
  residual residuals[2];
  int count = 0;
  const auto add = [&](wm_residual kind, double observed, double expected, const double by[kCauses], double variance,
                       int lasting_offset, double lasting_size) -> residual & {
    residual &r = residuals[count++];
    add_pose(r.row, by, past, sensor_state_[s.sensor][kTimeOffset]);
    add_mounting(r.row, s.sensor, by);
    double unit = 0.0;
    if (lasting >= 0 && lasting_offset >= 0) {
      r.row.add(lasting + lasting_offset, lasting_size);
      unit += lasting_size * filter_.value(lasting + lasting_offset);
    } else {
      variance += square(lasting_size);
    }
    if (map >= 0) {
      r.row.add(map, -by[0]);
      r.row.add(map + 1, -by[1]);
      unit -= by[0] * filter_.value(map) + by[1] * filter_.value(map + 1);
    } else {
      variance += square(map_sigma(landmark)) * (square(by[0]) + square(by[1]));
    }
    if (use_elevation) {  // they move the bearing, too
      if (map >= 0) {
        r.row.add(map + 2, by[kByUp]);
        unit += by[kByUp] * filter_.value(map + 2);
      } else {
        variance += square(map_sigma(landmark) * by[kByUp]);
      }
      if (tilt_state_ >= 0) {
        r.row.add(tilt_state_, by[kByLean]);
        r.row.add(tilt_state_ + 1, by[kByNod]);
        unit += by[kByLean] * filter_.value(tilt_state_) + by[kByNod] * filter_.value(tilt_state_ + 1);
      }
    }
    r.record = blank;
    r.record.residual = (uint8_t)kind;
    r.record.observed = observed;
    r.record.expected = expected + unit;
    const double difference = observed - r.record.expected;
    r.innovation = kind == WM_RESIDUAL_BEARING ? wrap(difference) : difference;
    r.noise = variance;
    return r;
  };
  const double distance = e.distance_m > 0.1 ? e.distance_m : 0.1;
  const bend bent = bend_of(e, filter_.variance(kX), filter_.covariance(kX, kY), filter_.variance(kY));
  if (use_bearing)
    add(WM_RESIDUAL_BEARING, s.bearing_rad, e.bearing_rad + bent.bearing_rad, e.bearing_by,
        square(bearing_sigma) + square(params_.lateral_sigma_m / distance) + bent.bearing_variance,
        lasting_bearing_offset_,
        std::sqrt(square(params_.lasting_bearing_rad) + square(params_.lasting_lateral_m / distance)));
  if (use_range) {
    const double lasting_size =
        std::sqrt(square(params_.lasting_range_m) + square(params_.lasting_range_rel * e.range_m));
    residual &r = add(WM_RESIDUAL_RANGE, s.range_m, e.range_m + bent.range_m, e.range_by,
                      square(range_sigma) + square(params_.range_sigma_rel * e.range_m) + bent.range_variance,
                      lasting_range_offset_, lasting_size);
    r.row.add(sensor_state_[s.sensor][kRangeBias], 1.0);
    r.row.add(sensor_state_[s.sensor][kRangeScale], e.range_by_scale);
  }
  if (use_elevation)
    add(WM_RESIDUAL_ELEVATION, s.elevation_rad, e.elevation_rad + bent.elevation_rad, e.elevation_by,
        square(s.elevation_sigma_rad) + bent.elevation_variance, -1, 0.0);
  const double room = (use_bearing ? kTwoPi : 1.0) * (use_range ? kAnyRange_m : 1.0);
  const bool believed = !landmark_records()[landmark].moved && !evidence_.biased(landmark, event.t_ns);
  double before[sparse_row::kMax];
  for (int k = 0; use_elevation && k < residuals[1].row.count; k++)
    before[k] = filter_.value(residuals[1].row.index[k]);
  const double against = fuse(residuals, use_elevation ? 1 : count, room, believed, records);
  if (use_elevation) fuse_elevation(residuals, before, records);
  if (!use_bearing) {
    note(event.t_ns, landmark, against);
  } else {
    const residual &bearing = residuals[0];
    note(event.t_ns, landmark, against, bearing.innovation, bearing.innovation / std::sqrt(bearing.record.variance));
  }
  return WM_OK;
}

wm_status landmark_ekf::fuse_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  wm_innovation blank = record_of(event, WM_RESIDUAL_X);
  blank.observed = p.p_m[0];
  if (!finite(p.p_m[0]) || !finite(p.p_m[1]) || !finite(p.sigma_xy_m)) return refuse(records, blank, WM_NOT_FINITE);
  if (std::fabs(p.p_m[0]) > 1e7 || std::fabs(p.p_m[1]) > 1e7 || !(p.sigma_xy_m > 0.0 && p.sigma_xy_m < 1e6))
    return refuse(records, blank, WM_OUT_OF_RANGE);
  const wm_status status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!params_.use_position) {
    blank.verdict = WM_REJECTED_BY_CONFIG;
    records.add(blank);
    return WM_OK;
  }
  double sigma = params_.gnss_sigma_factor * p.sigma_xy_m;
  if (sigma < params_.gnss_sigma_min_m) sigma = params_.gnss_sigma_min_m;
  if (gnss_lasting_state_ >= 0) {
    const double left = gnss_lasting_ns_ == WM_TIME_NONE
                            ? 1.0
                            : exp(-wm_seconds_between(gnss_lasting_ns_, event.t_ns) / params_.gnss_lasting_tau_s);
    if (left < 1.0)
      for (int k = 0; k < 2; k++)
        filter_.fade(gnss_lasting_state_ + k, left, (1.0 - left * left) * square(params_.gnss_lasting_m));
    gnss_lasting_ns_ = event.t_ns;
  }
  const past_pose past = look_back(gnss_time_state_ < 0 ? 0.0 : filter_.value(gnss_time_state_));
  observation seen{};
  seen.t_ns = event.t_ns;
  seen.kind = kObservedPosition;
  seen.key = -2;
  seen.sensor = past.odom;
  seen.place_m[0] = p.p_m[0];
  seen.place_m[1] = p.p_m[1];
  seen.sigma_length_m = std::sqrt(square(sigma) + square(params_.gnss_lasting_m));
  buffer_observation(seen);
  if (state_ == WM_STATE_SEARCHING) {
    blank.verdict = WM_REJECTED_SEARCHING;
    records.add(blank);
    seek(event.t_ns);
    return WM_OK;
  }
  residual residuals[2];
  for (int k = 0; k < 2; k++) {
    residual &r = residuals[k];
    const double by[3] = {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, 0.0};
    add_pose(r.row, by, past, gnss_time_state_);
    double expected = k == 0 ? past.pose.x_m : past.pose.y_m;
    if (gnss_lasting_state_ >= 0) {
      r.row.add(gnss_lasting_state_ + k, 1.0);
      expected += filter_.value(gnss_lasting_state_ + k);
    }
    r.record = record_of(event, k == 0 ? WM_RESIDUAL_X : WM_RESIDUAL_Y);
    r.record.observed = p.p_m[k];
    r.record.expected = expected;
    r.innovation = p.p_m[k] - expected;
    r.noise = square(sigma);
  }
  note(event.t_ns, kPositionKey, fuse(residuals, 2, square(kAnyPlace_m), true, records));
  return WM_OK;
}

wm_status landmark_ekf::fuse_heading(const wm_event &event, record_list records) {
  const wm_heading &h = event.as.heading;
  residual r;
  r.record = record_of(event, WM_RESIDUAL_HEADING);
  r.record.observed = h.heading_rad;
  if (!finite(h.heading_rad) || !finite(h.sigma_rad)) return refuse(records, r.record, WM_NOT_FINITE);
  if (std::fabs(h.heading_rad) > 100.0 || !(h.sigma_rad > 0.0 && h.sigma_rad < 100.0))
    return refuse(records, r.record, WM_OUT_OF_RANGE);
  const wm_status status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!params_.use_heading) {
    r.record.verdict = WM_REJECTED_BY_CONFIG;
    records.add(r.record);
    return WM_OK;
  }
  observation seen{};
  seen.t_ns = event.t_ns;
  seen.kind = kObservedHeading;
  seen.key = -3;
  seen.sensor = filter_.odom();
  seen.bearing_rad = h.heading_rad;
  seen.sigma_angle_rad = h.sigma_rad;
  buffer_observation(seen);
  if (state_ == WM_STATE_SEARCHING) {
    r.record.verdict = WM_REJECTED_SEARCHING;
    records.add(r.record);
    seek(event.t_ns);
    return WM_OK;
  }
  r.row.add(kHeading, 1.0);
  r.record.expected = filter_.pose().heading_rad;
  r.innovation = wrap(h.heading_rad - r.record.expected);
  r.noise = square(h.sigma_rad);
  note(event.t_ns, kHeadingKey, fuse(&r, 1, kTwoPi, true, records));
  return WM_OK;
}

// The numbers of one observation are gated together: a wrong one spoils its fellow. Between the two gates the
// measurement counts less, as a Student distribution would have it; above, not at all. Then one number after the other
// (paper, system 1), each with the innovation that the ones before left of it: the same as both at once.
double landmark_ekf::fuse(residual *r, int count, double room, bool believed, record_list records) {
  projection first, second;
  filter_.project(r[0].row, &first);
  const double s00 = first.variance + r[0].noise;
  double nis = square(r[0].innovation) / s00;
  double cross = 0.0, determinant = s00;
  r[0].record.variance = s00;
  if (count == 2) {
    filter_.project(r[1].row, &second);
    cross = filter_.project_onto(r[1].row, first);
    const double s11 = second.variance + r[1].noise;
    r[1].record.variance = s11;
    determinant = s00 * s11 - cross * cross;
    nis = (s11 * square(r[0].innovation) - 2.0 * cross * r[0].innovation * r[1].innovation +
           s00 * square(r[1].innovation)) /
          determinant;
  }
  const double density = exp(-0.5 * nis) / std::sqrt((count == 2 ? square(kTwoPi) : kTwoPi) * determinant);
  const double against = landmark_evidence::log_bayes_factor(density, room);
  const double scale = count == 2 ? 1.0 : kOneNumber;
  const double hard = params_.gate_hard * scale, soft = params_.gate_soft * scale;
  // Until the pose is proven, a start that is surer than it should be must not bend what it sees.
  const bool unproven = params_.recover && !evidence_.proven();
  const bool fused = believed && nis <= (unproven && kUnproven * scale < hard ? kUnproven * scale : hard);
  for (int i = 0; i < count; i++) {
    r[i].record.nis = nis;
    r[i].record.gate = hard;
    r[i].record.gate_dof = (uint8_t)count;
    r[i].record.verdict = fused ? WM_FUSED : WM_REJECTED_GATE;
    records.add(r[i].record);
  }
  const wm_time_ns now = filter_.now_ns();
  if (nis > soft && evidence_.doubtful() &&
      (loosened_ns_ == WM_TIME_NONE || wm_seconds_between(loosened_ns_, now) > kLoosenEvery_s)) {
    loosened_ns_ = now;
    // Several misfits lately: it is the pose that is less sure than it claims, not only this measurement.
    filter_.loosen_pose(kLoosen);
    filter_.project(r[0].row, &first);
    if (count == 2) cross = filter_.project_onto(r[1].row, first);
  }
  if (!fused) return believed && nis <= hard ? against : landmark_evidence::max_log_bayes_factor();
  const double weaker = nis > soft ? nis / soft : 1.0;
  // While several did not fit, what hardly fits may move the pose, but teaches nothing of the sensors.
  const int kept = nis > soft && evidence_.doubtful() ? calibration_states_ : kPoseStates;
  filter_.update(first, r[0].innovation, r[0].noise * weaker, kPoseStates, kept);
  if (count == 2) {
    const double left = r[1].innovation - cross / (first.variance + r[0].noise * weaker) * r[0].innovation;
    filter_.project(r[1].row, &second);
    filter_.update(second, left, r[1].noise * weaker, kPoseStates, kept);
  }
  fused_ns_ = filter_.now_ns();
  return against;
}

// After its bearing, with the innovation that this left of it (`before`: the row's states before). It has a gate of its
// own, and no say in whether the pose is right: a camera that is tilted by more than stated must not make the robot
// lost.
void landmark_ekf::fuse_elevation(residual bearing_then_own[2], const double *before, record_list records) {
  residual &r = bearing_then_own[1];
  for (int k = 0; k < r.row.count; k++) {
    const double moved = filter_.value(r.row.index[k]) - before[k];
    r.innovation -= r.row.by[k] * (r.row.index[k] == kHeading ? wrap(moved) : moved);
  }
  projection own;
  filter_.project(r.row, &own);
  const double hard = params_.gate_hard * kOneNumber;
  const bool unproven = params_.recover && !evidence_.proven();
  r.record.variance = own.variance + r.noise;
  r.record.expected = r.record.observed - r.innovation;
  r.record.nis = square(r.innovation) / r.record.variance;
  r.record.gate = hard;
  r.record.gate_dof = 1;
  const bool fits = r.record.nis <= (unproven && kUnproven * kOneNumber < hard ? kUnproven * kOneNumber : hard);
  const bool fused = fits && bearing_then_own[0].record.verdict == WM_FUSED;
  r.record.verdict = fused ? WM_FUSED : WM_REJECTED_GATE;
  records.add(r.record);
  if (fused) filter_.update(own, r.innovation, r.noise);
}

}  // namespace wm
