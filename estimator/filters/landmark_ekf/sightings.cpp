// SPDX-License-Identifier: Apache-2.0
// A sighting, from the event to the rows of its update: validation, association, expectation, Jacobian, noise.
// Constants were chosen on drawn crossings (waymark-montecarlo-landmarks) and not swept.

#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kClutterRange_m = 30.0;  // a false range lies anywhere within this; a factor of 10 is 2.3 nats
constexpr double kOnSensor_m = 0.05;      // nearer to the sensor, a landmark has no bearing
constexpr double kNear_m = 0.1;           // floor of a distance that an error across the line of sight is divided by
constexpr double kBeyondRange = 1.5;      // times the sensor's range; beyond, no landmark is associated
constexpr double kStepsMost = 0.2;        // share of the counts' steps in a row's noise; not swept
// A landmark in view is seen again within kKept_s: it needs its slot. A robot passes it within kVisit_s, over which its
// error on the map acts the same way. Not swept.
constexpr double kKept_s = 3.0, kVisit_s = 10.0;
constexpr double kClearlyBest = 0.5;  // of the soft gate: only a fit within this is associated

// The second-order correction of a sighting for an uncertain position: bias and variance of its expectation
// [Athans1968]. It matters after seconds of blind driving, with a position uncertain by metres.
struct curvature {
  double bearing_rad, bearing_variance, range_m, range_variance, elevation_rad, elevation_variance;
};

curvature curvature_of(const expected_sighting &e, double xx, double xy, double yy) {
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

// From a sensor's axes to levelled axes along its yaw.
void to_level(const mounted_sensor &sensor, const double p_m[3], double level_m[3]) {
  for (int i = 0; i < 3; i++)
    level_m[i] = sensor.axis[0][i] * p_m[0] + sensor.axis[1][i] * p_m[1] + sensor.axis[2][i] * p_m[2];
}

double at_least(double value, double floor) { return value > floor ? value : floor; }

}  // namespace

sensor_errors landmark_ekf::errors_of(int sensor) const {
  return slots_.errors(sensor, [this](int slot) { return filter_.value(slot); });
}

double landmark_ekf::time_offset(int sensor) const {
  const int slot = slots_.at(sensor, kTimeOffset);
  return slot < 0 ? 0.0 : filter_.value(slot);
}

double landmark_ekf::map_sigma(int landmark) const {
  return at_least(setup_->landmarks[landmark].sigma_m, sightings().map_sigma_min_m);
}

// A marker whose place is known is a landmark: its place in the sensor's frame gives bearing and range, of a steep
// sensor about the vertical. The range is along the line of sight where the map has the marker's height, else on the
// floor, as expect() has it. A second pose that the corners fit is turned about the same place.
wm_status landmark_ekf::fuse_marker(const wm_event &event, record_list records) {
  const wm_marker &m = event.as.marker;
  double v[3] = {m.p_m[0], m.p_m[1], m.p_m[2]};
  if (m.sensor < setup_->sensor_count && sensor_[m.sensor].is_steep) to_level(sensor_[m.sensor], m.p_m, v);
  const int landmark = index_.find(setup_->landmarks, m.id);
  const bool has_height = landmark >= 0 && finite(setup_->landmarks[landmark].p_m[2]);
  const double range_m = std::sqrt(square(v[0]) + square(v[1]) + (has_height ? square(v[2]) : 0.0));
  wm_sighting s = wm_sighting_without_numbers();
  s.sensor = m.sensor;
  s.landmark_id = m.id;
  s.bearing_rad = atan2(v[1], v[0]);
  s.range_m = range_m;
  s.range_sigma_m = m.along_sigma_m;
  return fuse_sighting(event, s, records);
}

wm_status landmark_ekf::fuse_sighting(const wm_event &event, const wm_sighting &s, record_list records) {
  const bool has_bearing = !std::isnan(s.bearing_rad);
  wm_innovation record = record_of(event, has_bearing ? WM_RESIDUAL_BEARING : WM_RESIDUAL_RANGE);
  record.sensor = s.sensor;
  record.landmark_id = s.landmark_id;
  record.observed = has_bearing ? s.bearing_rad : s.range_m;
  wm_status status = check_sighting(s, setup_->sensor_count);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);

  sighting_context at;
  const wm_verdict verdict = associate(s, &at);
  if (verdict != WM_FUSED) return reject(records, record, verdict);
  record.landmark_id = setup_->landmarks[at.landmark].id;
  if (params_.recover) buffer_observation(observation_of(at, event.t_ns));
  if (needs_search(event.t_ns, at.reading.bearing)) {
    search_now(event.t_ns);
    return reject(records, record, WM_REJECTED_SEARCHING);
  }

  const unsigned components = kBearing | (at.reading.range ? kRange : 0u) | (at.elevation ? kElevation : 0u) |
                              components_;  // the bearing's derivatives are the curvature's, too
  const expected_sighting e =
      expect(sensor_[s.sensor], errors_of(s.sensor), at.past.pose, setup_->landmarks[at.landmark].p_m, components);
  if (!e.possible && e.distance_m < kOnSensor_m) return reject(records, record, WM_REJECTED_SINGULAR);
  if (!e.possible) {
    note(event.t_ns, at.landmark, landmark_evidence::max_log_bayes_factor());
    return reject(records, record, WM_REJECTED_OUT_OF_RANGE);
  }
  residual rows[2];
  const int count = sighting_rows(at, e, record, rows);
  const double clutter_volume = (at.reading.bearing ? kTwoPi : 1.0) * (at.reading.range ? kClutterRange_m : 1.0);
  const bool usable = !records_[static_cast<size_t>(at.landmark)].moved && !evidence_.biased(at.landmark, event.t_ns);
  double before[planar_row::kMax];
  for (int k = 0; at.elevation && k < rows[1].row.count; k++) before[k] = filter_.value(rows[1].row.index[k]);
  const double log_bayes = fuse(rows, at.elevation ? 1 : count, clutter_volume, usable, records);
  if (at.elevation) fuse_elevation(rows, before, records);
  if (usable) test_calibration(at, rows, at.elevation ? 1 : count);
  if (at.reading.bearing)
    note(event.t_ns, at.landmark, log_bayes, rows[0].innovation,
         rows[0].innovation / std::sqrt(rows[0].record.variance));
  else
    note(event.t_ns, at.landmark, log_bayes);
  return WM_OK;
}

// A row that the gate refused, with the sensor's states at their prior's mean.
first_sightings::row landmark_ekf::row_at_prior(const residual &r, int sensor) const {
  first_sightings::row out{};
  out.innovation = r.innovation;
  out.noise = r.noise;
  for (int i = 0; i < r.row.count; i++) {
    const int state = r.row.index[i], own = slots_.state_of(sensor, state);
    const double by = r.row.by[i];
    if (own >= 0) {
      out.by_own[own] += by;
      out.innovation += by * (filter_.value(state) - kSensorStateSpecs[own].neutral);
    } else if (state < first_sightings::kPose) {
      out.by_pose[state] += by;
    } else {
      out.noise += square(by) * filter_.variance(state);
    }
  }
  return out;
}

// Where the last sightings of a sensor contradict its states and fit their prior, the states begin again.
void landmark_ekf::test_calibration(const sighting_context &at, const residual *rows, int count) {
  const int sensor = at.s->sensor;
  if (rows[0].record.verdict == WM_FUSED) return first_.fused(sensor);
  if (!life_.tracking()) return;
  first_sightings::row refused[2];
  for (int i = 0; i < count; i++) refused[i] = row_at_prior(rows[i], sensor);
  first_.refused(sensor, at.landmark, refused, count);
  double pose[first_sightings::kPose][first_sightings::kPose];
  for (int i = 0; i < first_sightings::kPose; i++)
    for (int j = 0; j < first_sightings::kPose; j++) pose[i][j] = filter_.covariance(i, j);
  double prior[kSensorStates];
  for (int k = 0; k < kSensorStates; k++) {
    const int slot = slots_.at(sensor, k);
    prior[k] = slot < 0 ? 0.0 : rollback_.variance(rollback_.kStart, slot);
  }
  if (first_.contradict(sensor, pose, prior)) restart_calibration(sensor, prior);
}

void landmark_ekf::restart_calibration(int sensor, const double prior[kSensorStates]) {
  for (int k = 0; k < kSensorStates; k++) {
    const int slot = slots_.at(sensor, k);
    if (slot < 0) continue;
    filter_.forget(slot, kSensorStateSpecs[k].neutral, prior[k]);
    rollback_.restart(slot);
  }
  first_.restarted(sensor);
}

wm_verdict landmark_ekf::associate(const wm_sighting &s, sighting_context *out) {
  const mounted_sensor &sensor = sensor_[s.sensor];
  out->s = &s;
  out->reading = read_sighting(s, sensor, sightings());
  if (!out->reading.bearing && !out->reading.range) return WM_REJECTED_BY_CONFIG;
  if (!std::isnan(s.range_m) && s.range_m > sensor.max_range_m) return WM_REJECTED_OUT_OF_RANGE;
  out->past = pose_before(filter_, time_offset(s.sensor));
  if (s.landmark_id >= 0) {
    out->landmark = index_.find(setup_->landmarks, s.landmark_id);
    if (out->landmark < 0) return WM_REJECTED_UNKNOWN_ID;
  } else {
    out->landmark = sightings().use_unidentified && life_.tracking() ? associate_nearest(*out) : -1;
    if (out->landmark < 0) return WM_REJECTED_NO_ASSOCIATION;
  }
  out->elevation = wm_sighting_has_elevation(&s) && sightings().use_elevation && out->reading.bearing &&
                   !out->reading.range && finite(setup_->landmarks[out->landmark].p_m[2]) && finite(sensor.z_m);
  return WM_FUSED;
}

// The one landmark that a sighting without identity fits: within half the gate, and no other within the gate.
int landmark_ekf::associate_nearest(const sighting_context &at) {
  const wm_sighting &s = *at.s;
  const mounted_sensor &sensor = sensor_[s.sensor];
  const sensor_errors errors = errors_of(s.sensor);
  int best = -1, fitting = 0;
  double least = sightings().gate_soft;
  for (int i = 0; i < static_cast<int>(setup_->landmark_count); i++) {
    const expected_sighting e =
        expect(sensor, errors, at.past.pose, setup_->landmarks[i].p_m, kBearing | kRange | components_);
    if (!e.possible || e.distance_m > kBeyondRange * sensor.max_range_m) continue;
    double chi2 = 0.0;
    const auto test = [&](double observed, double expected, const double by[kCauses], double variance, bool angle) {
      if (std::isnan(observed)) return;
      planar_row row;
      add_past_pose(&row, by, at.past, slots_.at(s.sensor, kTimeOffset));
      slots_.add_to(&row, s.sensor, by);
      const double on_map = square(map_sigma(i)) * (square(by[kByX]) + square(by[kByY]));
      const double difference = angle ? wrap(observed - expected) : observed - expected;
      chi2 += square(difference) / (filter_.variance_of(row) + variance + on_map);
    };
    test(s.bearing_rad, e.bearing_rad, e.bearing_by,
         square(at.reading.bearing_sigma_rad) + square(sightings().lateral_sigma_m / at_least(e.distance_m, kNear_m)),
         true);
    test(s.range_m, e.range_m, e.range_by,
         square(at.reading.range_sigma_m) + square(sightings().range_sigma_rel * e.range_m), false);
    fitting += chi2 < sightings().gate_soft;
    if (chi2 < kClearlyBest * least) {
      least = chi2 / kClearlyBest;
      best = i;
    }
  }
  return fitting == 1 ? best : -1;
}

landmark_ekf::lent_slots landmark_ekf::lend_states(int sensor, int landmark, wm_time_ns t_ns) {
  lent_slots out;
  const int64_t key = static_cast<int64_t>(landmark) * kMaxSensors + sensor;
  const double tau_s = sightings().correlated_tau_s;
  wm_time_ns &seen_ns = seen_ns_[static_cast<size_t>(landmark)];
  const double since_s = seen_ns == WM_TIME_NONE ? kVisit_s + tau_s : wm_seconds_between(seen_ns, t_ns);
  seen_ns = t_ns;
  out.repeated_error = repeated_variance(2.0 * tau_s, since_s);
  out.repeated_map = repeated_variance(kVisit_s, since_s);
  out.error = errors_.lend(&filter_, key, error_.width, tau_s, kKept_s, t_ns);
  out.map = -1;
  const double sigma = map_sigma(landmark);
  if (!(sigma > 0.0)) return out;
  bool fresh;
  auto *slot = map_.take(landmark, t_ns, kKept_s, &fresh);
  if (!slot) return out;
  out.map = slot->state;
  slot->used_ns = t_ns;
  const int width = sightings().use_elevation ? 3 : 2;
  for (int k = 0; fresh && k < width; k++) filter_.forget(slot->state + k, 0.0, square(sigma));
  return out;
}

// The body's tilt on its suspension: a Gauss-Markov process, carried on to the time of each elevation.
void landmark_ekf::decay_tilt(wm_time_ns t_ns) {
  if (tilt_state_ < 0) return;
  const double left = tilt_ns_ == WM_TIME_NONE ? 1.0 : decay_over(tilt_ns_, t_ns, params_.tilt_tau_s);
  for (int k = 0; k < 2; k++) decay_state(&filter_, tilt_state_ + k, left, square(params_.tilt_sigma_rad));
  tilt_ns_ = t_ns;
}

// Adds all errors beside the pose's to a row: the sensor's, the time-correlated one, the landmark's on the map, the
// body's tilt. An error that is a state adds to the expectation, another one to the noise.
void landmark_ekf::add_errors(const sighting_context &at, const lent_slots &lent, const double by[kCauses],
                              int error_offset, double error_size, residual *r) const {
  const int sensor = at.s->sensor;
  add_past_pose(&r->row, by, at.past, slots_.at(sensor, kTimeOffset));
  slots_.add_to(&r->row, sensor, by);
  // The steps' errors of successive rows are not independent: no evidence of the motion's noise.
  const double steps = filter_.count_variance(at.past.t_ns, by, at.past.pose.heading_rad);
  r->noise += steps;
  if (steps > kStepsMost * r->noise) r->source = {};
  const auto add_state = [&](int state, double derivative) {
    r->row.add(state, derivative);
    r->record.expected += derivative * filter_.value(state);
  };
  if (lent.error >= 0 && error_offset >= 0)
    add_state(lent.error + error_offset, error_size);
  else
    r->noise += lent.repeated_error * square(error_size);
  if (lent.map >= 0) {
    add_state(lent.map, -by[kByX]);
    add_state(lent.map + 1, -by[kByY]);
  } else {
    r->noise += lent.repeated_map * square(map_sigma(at.landmark)) * (square(by[kByX]) + square(by[kByY]));
  }
  if (!at.elevation) return;
  if (lent.map >= 0)
    add_state(lent.map + 2, by[kByHeight]);
  else
    r->noise += lent.repeated_map * square(map_sigma(at.landmark) * by[kByHeight]);
  if (tilt_state_ < 0) return;
  add_state(tilt_state_, by[kByBodyRoll]);
  add_state(tilt_state_ + 1, by[kByBodyPitch]);
}

// `expected`: by pose and sensor; r->record.expected has what the lent states add.
void landmark_ekf::finish_row(wm_residual kind, double observed, double expected, const wm_innovation &record,
                              residual *r) const {
  const double total = expected + r->record.expected;
  r->record = record;
  r->record.residual = static_cast<uint8_t>(kind);
  r->record.observed = observed;
  r->record.expected = total;
  const double difference = observed - total;
  r->innovation = kind == WM_RESIDUAL_BEARING ? wrap(difference) : difference;
}

int landmark_ekf::sighting_rows(const sighting_context &at, const expected_sighting &e, const wm_innovation &record,
                                residual rows[2]) {
  const wm_sighting &s = *at.s;
  const lent_slots lent = lend_states(s.sensor, at.landmark, record.t_ns);
  if (at.elevation) decay_tilt(record.t_ns);
  const double distance = at_least(e.distance_m, kNear_m);
  const curvature second = curvature_of(e, filter_.variance(kX), filter_.covariance(kX, kY), filter_.variance(kY));
  int count = 0;
  if (at.reading.bearing) {
    residual &r = rows[count++];
    r.record.expected = 0.0;
    r.source = filter_.noise().source_of(noise_adaption::kBearings, at.reading.bearing_sigma_rad);
    r.noise = r.source.own + square(sightings().lateral_sigma_m / distance) + second.bearing_variance;
    add_errors(at, lent, e.bearing_by, error_.bearing, correlated_bearing(sightings(), at.reading, distance), &r);
    finish_row(WM_RESIDUAL_BEARING, s.bearing_rad, e.bearing_rad + second.bearing_rad, record, &r);
  }
  if (at.reading.range) {
    residual &r = rows[count++];
    r.record.expected = 0.0;
    r.source = filter_.noise().source_of(noise_adaption::kRanges, at.reading.range_sigma_m);
    r.noise = r.source.own + square(sightings().range_sigma_rel * e.range_m) + second.range_variance;
    add_errors(at, lent, e.range_by, error_.range, correlated_range(sightings(), at.reading, e.range_m), &r);
    finish_row(WM_RESIDUAL_RANGE, s.range_m, e.range_m + second.range_m, record, &r);
  }
  if (at.elevation) {
    residual &r = rows[count++];
    r.record.expected = 0.0;
    r.noise = square(s.elevation_sigma_rad) + second.elevation_variance;
    add_errors(at, lent, e.elevation_by, -1, 0.0, &r);
    finish_row(WM_RESIDUAL_ELEVATION, s.elevation_rad, e.elevation_rad + second.elevation_rad, record, &r);
  }
  return count;
}

}  // namespace wm
