// SPDX-License-Identifier: Apache-2.0
// Constants were chosen on drawn crossings (waymark-montecarlo --trials) and not swept.
#include "aid/sighting.hpp"

#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kNear_m = 0.1;        // floor of a distance that an error across the line of sight is divided by
constexpr double kMountError_m = 1.0;  // of a sensor's place, far more than any
constexpr double kBeyondRange = 1.5;   // times the sensor's range; beyond, no landmark is associated
constexpr double kStepsMost = 0.2;     // share of the counts' steps in a row's noise; not swept
// A landmark in view is seen again within kKept_s: it needs its slot. A robot passes it within kVisit_s, over which its
// error on the map acts the same way. Not swept.
constexpr double kKept_s = 3.0, kVisit_s = 10.0;
constexpr double kClearlyBest = 0.5;     // of the soft gate: only a fit within this is associated
constexpr double kLeastDepth = 0.1;      // floor of the cosine between a depth's axis and the bearing
constexpr double kLeastOnFloor_m = 0.1;  // floor of a horizontal range; bearings of nearer landmarks are not usable

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

constexpr double kSurveyed_rad = 0.01;  // a landmark's direction that comes without a sigma

bool has_yaw(const wm_setup &setup) {
  for (size_t i = 0; i < setup.landmark_count; i++)
    if (finite(setup.landmarks[i].yaw_rad)) return true;
  return false;
}

// Place, height and direction of a landmark.
int place_states(const wm_sighting_params &p) { return p.use_elevation ? 3 : 2; }
int map_states(const wm_setup &setup) { return place_states(*setup.sightings) + has_yaw(setup); }

// No more slots than the map has landmarks, and pairs of a sensor and a landmark.
int map_slots(const wm_setup &setup) {
  const int wanted = setup.sightings->map_slots, most = static_cast<int>(setup.landmark_count);
  return wanted < most ? wanted : most;
}
int error_slots(const wm_setup &setup) {
  const size_t pairs = setup.landmark_count * setup.sensor_count;
  const int wanted = setup.sightings->correlated_slots;
  return static_cast<size_t>(wanted) < pairs ? wanted : static_cast<int>(pairs);
}

constexpr double kHalfOfVariance = 0.70710678118654752;  // factor of a sigma
constexpr int kTagHeadingKey = -16;                      // of an observed heading, less the landmark's index

}  // namespace

sighting_aid::arrays sighting_aid::place(memory_layout *layout, const wm_setup &setup) {
  return {layout->take<int>(setup.landmark_count), layout->take<wm_time_ns>(setup.landmark_count)};
}

int sighting_aid::count_states(const wm_setup &setup) {
  const wm_sighting_params &s = *setup.sightings;
  return sensor_slots::count(setup) + error_slots(setup) * correlated_slot_of(s).width +
         map_states(setup) * map_slots(setup) + 2 * (s.use_elevation && s.tilt_sigma_rad > 0.0);
}

void sighting_aid::init(const wm_setup &setup, const arrays &behind, bool at_sensor) {
  setup_ = &setup;
  markers_ = marker_params_of(setup);
  yaw_offset_ = has_yaw(setup) ? place_states(params()) : -1;
  for (size_t i = 0; i < setup.sensor_count; i++) {
    sensor_[i].init(setup.sensors[i]);
    if (at_sensor) sensor_[i].x_m = sensor_[i].y_m = 0.0;
  }
  components_ = params().states.sigma[WM_SENSOR_ROW_kAngleScale] > 0.0 ? kAngleScaled : 0u;
  index_.init(setup.landmarks, setup.landmark_count, behind.order);
  seen_ns_.set(behind.seen_ns);
  for (size_t i = 0; i < setup.landmark_count; i++) behind.seen_ns[i] = WM_TIME_NONE;
  error_ = correlated_slot_of(params());
  errors_.clear();
  map_.clear();
  tilt_state_ = -1;
  tilt_ns_ = WM_TIME_NONE;
  unused_ = 0;
}

void sighting_aid::add_calibration(planar_filter *filter) {
  slots_.init(*setup_, true, [filter](double value, double sigma, double walk, double low, double high) {
    return filter->add_sensor_state(value, sigma, walk, low, high);
  });
}

void sighting_aid::add_lent(planar_filter *filter) {
  for (int i = 0; i < error_slots(*setup_) && error_.width > 0; i++) {
    errors_.add(filter->states());
    for (int k = 0; k < error_.width; k++) filter->add_state(0.0, 0.0);
  }
  for (int i = 0; i < map_slots(*setup_); i++) {
    map_.add(filter->states());
    for (int k = 0; k < map_states(*setup_); k++) filter->add_state(0.0, 0.0);
  }
  if (!has_tilt()) return;
  tilt_state_ = filter->add_state(0.0, params().tilt_sigma_rad);
  filter->add_state(0.0, params().tilt_sigma_rad);
}

void sighting_aid::release(planar_filter *filter) {
  errors_.release_all();
  map_.release_all();
  for (int k = 0; k < 2 && tilt_state_ >= 0; k++) filter->forget(tilt_state_ + k, 0.0, square(params().tilt_sigma_rad));
}

void sighting_aid::take_up(const sighting_aid &from, planar_filter *filter) {
  slots_ = from.slots_;
  for (size_t i = 0; i < setup_->landmark_count; i++) seen_ns_[i] = WM_TIME_NONE;
  tilt_ns_ = WM_TIME_NONE;
  release(filter);
}

double sighting_aid::map_sigma(int landmark) const {
  return larger(setup_->landmarks[landmark].sigma_m, params().map_sigma_min_m);
}

double sighting_aid::yaw_sigma(int landmark) const {
  const double stated = setup_->landmarks[landmark].yaw_sigma_rad;
  return stated > 0.0 && stated < kPi ? stated : kSurveyed_rad;
}

wm_status sighting_aid::check(const wm_event &event, wm_innovation *record) const {
  const bool is_marker = event.kind == WM_EVENT_MARKER;
  const wm_marker &m = event.as.marker;
  const wm_sighting &s = event.as.sighting;
  const bool has_bearing = is_marker || !std::isnan(s.bearing_rad);
  *record = record_of(event, has_bearing ? WM_RESIDUAL_BEARING : WM_RESIDUAL_RANGE);
  record->sensor = is_marker ? m.sensor : s.sensor;
  record->landmark_id = is_marker ? m.id : s.landmark_id;
  record->observed = is_marker ? atan2(m.p_m[1], m.p_m[0]) : has_bearing ? s.bearing_rad : s.range_m;
  return is_marker ? check_marker(m, setup_->sensor_count) : check_sighting(s, setup_->sensor_count);
}

wm_verdict sighting_aid::look(const wm_event &event, const planar_filter &filter, bool tracking, view *out,
                              wm_innovation *record) const {
  const bool is_marker = event.kind == WM_EVENT_MARKER;
  if (!is_marker) out->s = event.as.sighting;
  const wm_verdict verdict =
      is_marker ? look_at(event.as.marker, filter, tracking, out) : look_at(filter, tracking, out);
  if (is_marker) record->observed = out->s.bearing_rad;
  if (verdict == WM_FUSED) record->landmark_id = setup_->landmarks[out->landmark].id;
  return verdict;
}

wm_verdict sighting_aid::look_at(const planar_filter &filter, bool tracking, view *out) const {
  const wm_sighting &s = out->s;
  const mounted_sensor &seen_by = sensor_[s.sensor];
  out->yaw_rad = out->yaw_variance = std::nan("");
  out->nearest = 0.0;
  out->reading = read_sighting(s, seen_by, params());
  if (!out->reading.bearing && !out->reading.range) return WM_REJECTED_BY_CONFIG;
  if (!std::isnan(s.range_m) && s.range_m > seen_by.max_range_m) return WM_REJECTED_OUT_OF_RANGE;
  out->past = pose_before(filter, time_offset(filter, s.sensor));
  if (s.landmark_id >= 0) {
    out->landmark = find(s.landmark_id);
    if (out->landmark < 0) return WM_REJECTED_UNKNOWN_ID;
  } else {
    out->landmark = params().use_unidentified && tracking ? find_nearest(filter, *out, &out->nearest) : -1;
    if (out->landmark < 0) return WM_REJECTED_NO_ASSOCIATION;
  }
  out->elevation = wm_sighting_has_elevation(&s) && params().use_elevation && out->reading.bearing &&
                   !out->reading.range && finite(setup_->landmarks[out->landmark].p_m[2]) && finite(seen_by.z_m);
  return WM_FUSED;
}

// Its place in the sensor's frame gives bearing and range, of a steep sensor about the vertical. The range is along the
// line of sight where the map has the marker's height, else on the floor, as expect() has it.
wm_verdict sighting_aid::look_at(const wm_marker &m, const planar_filter &filter, bool tracking, view *out) const {
  const mounted_sensor &seen_by = sensor_[m.sensor];
  const auto read = [&](bool second) {
    return read_tag(m, second, seen_by, errors_of(filter, m.sensor), params(), markers_);
  };
  tag_reading tag = read(false);
  const double *v = seen_by.is_steep ? tag.nominal : m.p_m;
  const int landmark = find(m.id);
  const bool has_height = landmark >= 0 && finite(setup_->landmarks[landmark].p_m[2]);
  wm_sighting &s = out->s = wm_sighting_without_numbers();
  s.sensor = m.sensor;
  s.landmark_id = m.id;
  s.bearing_rad = atan2(v[1], v[0]);
  s.range_m = std::sqrt(square(v[0]) + square(v[1]) + (has_height ? square(v[2]) : 0.0));
  const wm_verdict verdict = look_at(filter, false, out);
  if (verdict != WM_FUSED) return verdict;
  out->reading.bearing_sigma_rad = std::sqrt(tag.noise[1]) / larger(tag.floor_m, kNear_m);
  out->reading.range_sigma_m = std::sqrt(tag.noise[0]);
  if (!finite(setup_->landmarks[landmark].yaw_rad)) return verdict;
  if (m.poses == 2 && tracking)
    tag = choose_pose(m, tag, read(true), markers_,
                      [&](const tag_reading &one) { return heading_nis(filter, *out, one); });
  if (!tag.has_heading) return verdict;
  out->yaw_rad = tag.yaw_rad;
  out->yaw_variance = tag.noise[2];
  return verdict;
}

// The one landmark that a sighting without identity fits: within half the gate, and no other within the gate.
int sighting_aid::find_nearest(const planar_filter &filter, const view &at, double *nearest) const {
  const wm_sighting &s = at.s;
  const mounted_sensor &seen_by = sensor_[s.sensor];
  const sensor_errors errors = errors_of(filter, s.sensor);
  int best = -1, fitting = 0;
  double least = params().gate_soft;
  *nearest = HUGE_VAL;
  // Far landmarks are left out by their plain distance, which costs a hundredth of an expectation.
  const double lever_m = std::fabs(seen_by.x_m) + std::fabs(seen_by.y_m) + kMountError_m;
  const double reach_m = kBeyondRange * seen_by.max_range_m + lever_m;
  for (int i = 0; i < static_cast<int>(setup_->landmark_count); i++) {
    const double *p = setup_->landmarks[i].p_m;
    if (square(p[0] - at.past.pose.x_m) + square(p[1] - at.past.pose.y_m) > square(reach_m)) continue;
    const expected_sighting e = wm::expect(seen_by, errors, at.past.pose, p, kBearing | kRange | components_);
    if (!e.possible || e.distance_m > kBeyondRange * seen_by.max_range_m) continue;
    double chi2 = 0.0;
    const auto test = [&](double observed, double expected, const double by[kCauses], double variance, bool angle) {
      if (std::isnan(observed)) return;
      planar_row row;
      add_past_pose(&row, by, at.past, slots_.at(s.sensor, kTimeOffset));
      slots_.add_to(&row, s.sensor, by);
      const double on_map = square(map_sigma(i)) * (square(by[kByX]) + square(by[kByY]));
      const double difference = angle ? wrap(observed - expected) : observed - expected;
      chi2 += square(difference) / (filter.variance_of(row) + variance + on_map);
    };
    test(s.bearing_rad, e.bearing_rad, e.bearing_by,
         square(at.reading.bearing_sigma_rad) + square(params().lateral_sigma_m / larger(e.distance_m, kNear_m)), true);
    test(s.range_m, e.range_m, e.range_by,
         square(at.reading.range_sigma_m) + square(params().range_sigma_rel * e.range_m), false);
    fitting += chi2 < params().gate_soft;
    if (chi2 < *nearest) *nearest = chi2;
    if (chi2 < kClearlyBest * least) {
      least = chi2 / kClearlyBest;
      best = i;
    }
  }
  return fitting == 1 ? best : -1;
}

// The bearing's derivatives are the curvature's, too.
expected_sighting sighting_aid::expect(const planar_filter &filter, const view &at) const {
  const unsigned components =
      kBearing | (at.reading.range ? kRange : 0u) | (at.elevation ? kElevation : 0u) | components_;
  return wm::expect(sensor_[at.s.sensor], errors_of(filter, at.s.sensor), at.past.pose,
                    setup_->landmarks[at.landmark].p_m, components);
}

sighting_aid::lent_slots sighting_aid::lend_states(const view &at, planar_filter *filter) {
  lent_slots out;
  const wm_time_ns t_ns = filter->now_ns();
  const int landmark = at.landmark;
  const int64_t of_pair = static_cast<int64_t>(landmark) * kMaxSensors + at.s.sensor;
  const bool alone = !at.reading.bearing && error_.bearing >= 0 && error_.range >= 0;
  const double tau_s = params().correlated_tau_s, taus_s[] = {alone ? kOfAnchor_s : tau_s, tau_s};
  wm_time_ns &seen_ns = seen_ns_[static_cast<size_t>(landmark)];
  const double since_s = seen_ns == WM_TIME_NONE ? kVisit_s + tau_s : wm_seconds_between(seen_ns, t_ns);
  seen_ns = t_ns;
  out.repeated_error = repeated_variance(2.0 * tau_s, since_s);
  out.repeated_map = repeated_variance(kVisit_s, since_s);
  out.error = errors_.lend(filter, 2 * of_pair + alone, error_.width, taus_s, kKept_s, t_ns);
  out.of_anchor = alone && out.error >= 0 ? out.error + error_.bearing : -1;
  out.map = -1;
  const double sigma = map_sigma(landmark);
  if (!(sigma > 0.0)) return out;
  bool fresh;
  auto *slot = map_.take(landmark, t_ns, kKept_s, &fresh);
  if (!slot) return out;
  out.map = slot->state;
  slot->used_ns = t_ns;
  for (int k = 0; fresh && k < place_states(params()); k++) filter->forget(slot->state + k, 0.0, square(sigma));
  if (fresh && yaw_offset_ >= 0) filter->forget(slot->state + yaw_offset_, 0.0, 0.0);
  return out;
}

// The body's tilt on its suspension: a Gauss-Markov process, carried on to the time of each elevation.
void sighting_aid::decay_tilt(planar_filter *filter) {
  if (tilt_state_ < 0) return;
  const wm_time_ns t_ns = filter->now_ns();
  const double left = tilt_ns_ == WM_TIME_NONE ? 1.0 : decay_over(tilt_ns_, t_ns, params().tilt_tau_s);
  for (int k = 0; k < 2; k++) decay_state(filter, tilt_state_ + k, left, square(params().tilt_sigma_rad));
  tilt_ns_ = t_ns;
}

// Adds all errors beside the pose's to a row: the sensor's, the time-correlated one, the landmark's on the map, the
// body's tilt. An error that is a state adds to the expectation, another one to the noise.
void sighting_aid::add_errors(const view &at, const lent_slots &lent, const row_of &of, const planar_filter &filter,
                              residual *r) const {
  const int sensor = at.s.sensor;
  const double *by = of.by;
  add_past_pose(&r->row, by, at.past, slots_.at(sensor, kTimeOffset));
  slots_.add_to(&r->row, sensor, by);
  // The steps' errors of successive rows are not independent: no evidence of the motion's noise.
  const double steps = filter.count_variance(at.past.t_ns, by, at.past.pose.heading_rad);
  r->noise += steps;
  if (steps > kStepsMost * r->noise) r->source = {};
  const auto add_state = [&](int state, double derivative) {
    r->row.add(state, derivative);
    r->record.expected += derivative * filter.value(state);
  };
  const auto add_error = [&](int state, double size) {
    add_state(state, size);
    r->source.own += square(size) * filter.variance(state);
  };
  const double size = lent.of_anchor >= 0 ? kHalfOfVariance * of.error_size : of.error_size;
  if (lent.of_anchor >= 0) add_error(lent.of_anchor, size);
  if (lent.error >= 0 && of.error_offset >= 0)
    add_error(lent.error + of.error_offset, size);
  else
    r->noise += lent.repeated_error * square(of.error_size);
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

// `r` has its noise and its source; of.expected: by pose and sensor.
void sighting_aid::put_row(const view &at, const lent_slots &lent, const row_of &of, const wm_innovation &record,
                           const planar_filter &filter, residual *r) const {
  r->row.count = r->row.missing = 0, r->row.delay = -1;
  r->record.expected = 0.0;
  add_errors(at, lent, of, filter, r);
  const double total = of.expected + r->record.expected, difference = of.observed - total;
  r->record = record;
  r->record.residual = static_cast<uint8_t>(of.kind);
  r->record.observed = of.observed;
  r->record.expected = total;
  r->innovation = of.kind == WM_RESIDUAL_BEARING ? wrap(difference) : difference;
}

// A marker's direction as it is expected in levelled axes along the sensor's yaw.
double sighting_aid::expected_yaw(const planar_filter &filter, const view &at) const {
  const int sensor = at.s.sensor;
  const double from_rad = at.past.pose.heading_rad + sensor_[sensor].yaw_rad + errors_of(filter, sensor)[kYaw];
  return wrap(setup_->landmarks[at.landmark].yaw_rad - from_rad);
}

void sighting_aid::put_heading(const view &at, planar_row *row) const {
  const double by[3] = {0.0, 0.0, -1.0};
  add_past_pose(row, by, at.past, slots_.at(at.s.sensor, kTimeOffset));
  row->add(slots_.at(at.s.sensor, kYaw), -1.0);
}

// Of its heading alone: its two poses stand at the same place.
double sighting_aid::heading_nis(const planar_filter &filter, const view &at, const tag_reading &tag) const {
  planar_row row;
  put_heading(at, &row);
  return square(wrap(tag.yaw_rad - expected_yaw(filter, at))) /
         (filter.variance_of(row) + tag.noise[2] + square(yaw_sigma(at.landmark)));
}

// The landmark's own error is a state of its slot, open from its first heading on, or noise that all views share.
void sighting_aid::put_heading_row(const view &at, const lent_slots &lent, const wm_innovation &record,
                                   planar_filter *filter, residual *r) const {
  r->row.count = r->row.missing = 0;
  r->source = {};
  r->noise = at.yaw_variance;
  put_heading(at, &r->row);
  double expected_rad = expected_yaw(*filter, at);
  const double own = square(yaw_sigma(at.landmark));
  if (lent.map >= 0) {
    const int state = lent.map + yaw_offset_;
    if (!(filter->variance(state) > 0.0)) filter->forget(state, 0.0, own);
    r->row.add(state, 1.0);
    expected_rad = wrap(expected_rad + filter->value(state));
  } else {
    r->noise += lent.repeated_map * own;
  }
  r->record = record;
  r->record.residual = WM_RESIDUAL_HEADING;
  r->record.observed = wrap(at.yaw_rad);
  r->record.expected = expected_rad;
  r->innovation = wrap(at.yaw_rad - expected_rad);
}

int sighting_aid::put_rows(const view &at, const expected_sighting &e, const wm_innovation &record,
                           planar_filter *filter, residual rows[3]) {
  const wm_sighting &s = at.s;
  const noise_adaption &noise = filter->noise();
  const lent_slots lent = lend_states(at, filter);
  if (at.elevation) decay_tilt(filter);
  const double distance = larger(e.distance_m, kNear_m);
  const curvature second = curvature_of(e, filter->variance(kX), filter->covariance(kX, kY), filter->variance(kY));
  int count = 0;
  // A sigma that is stated too small is so of the white and of the time-correlated error.
  const auto factor_of = [&](int kind) { return std::sqrt(noise.scale(kind)); };
  const auto add = [&](noise_adaption::source source, double own, const row_of &of) {
    residual &r = rows[count++];
    r.source = source;
    r.noise = own;
    put_row(at, lent, of, record, *filter, &r);
  };
  if (at.reading.bearing) {
    const auto source = noise.source_of(noise_adaption::kBearings, at.reading.bearing_sigma_rad);
    add(source, source.own + square(params().lateral_sigma_m / distance) + second.bearing_variance,
        {WM_RESIDUAL_BEARING, s.bearing_rad, e.bearing_rad + second.bearing_rad, e.bearing_by, error_.bearing,
         correlated_bearing(params(), at.reading, distance) * factor_of(noise_adaption::kBearings)});
  }
  if (at.reading.range) {
    const auto source = noise.source_of(noise_adaption::kRanges, at.reading.range_sigma_m);
    add(source, source.own + square(params().range_sigma_rel * e.range_m) + second.range_variance,
        {WM_RESIDUAL_RANGE, s.range_m, e.range_m + second.range_m, e.range_by, error_.range,
         correlated_range(params(), at.reading, e.range_m) * factor_of(noise_adaption::kRanges)});
  }
  if (at.elevation)
    add({}, square(s.elevation_sigma_rad) + second.elevation_variance,
        {WM_RESIDUAL_ELEVATION, s.elevation_rad, e.elevation_rad + second.elevation_rad, e.elevation_by, -1, 0.0});
  if (finite(at.yaw_rad)) put_heading_row(at, lent, record, filter, &rows[count++]);
  return count;
}

fuse_result sighting_aid::fuse(const view &at, const expected_sighting &e, const wm_innovation &record,
                               const fuse_policy &policy, planar_filter *filter, residual rows[kRows], int *count,
                               record_list records) {
  *count = put_rows(at, e, record, filter, rows) - at.elevation;
  const double volume = clutter_volume(at.reading) * (finite(at.yaw_rad) ? kTwoPi : 1.0);
  later_row elevation(*filter, &rows[at.elevation ? *count : 0]);
  const fuse_result done = wm::fuse(filter, rows, *count, volume, policy, records);
  if (at.elevation) (void)elevation.fuse(filter, policy, done.verdict == WM_FUSED, records);
  return done;
}

observation sighting_aid::observe_heading(const view &at, const sensor_errors &errors,
                                          const planar_filter &filter) const {
  const int sensor = at.s.sensor;
  observation seen = observation_now(filter, kTagHeadingKey - at.landmark);
  seen.kind = kObservedHeading;
  seen.sensor = compose(seen.sensor, at.past.step);
  seen.bearing_rad = wrap(setup_->landmarks[at.landmark].yaw_rad - at.yaw_rad - sensor_[sensor].yaw_rad - errors[kYaw]);
  seen.sigma_angle_rad = std::sqrt(at.yaw_variance + square(yaw_sigma(at.landmark)));
  return seen;
}

observation sighting_aid::observe(const view &at, const sensor_errors &errors, const planar_filter &filter) const {
  const wm_sighting &s = at.s;
  const mounted_sensor &seen_by = sensor_[s.sensor];
  const wm_landmark &target = setup_->landmarks[at.landmark];
  const double *sigma = params().states.sigma;
  const double tilt_sigma = sigma[WM_SENSOR_ROW_kRoll], scale_sigma = sigma[WM_SENSOR_ROW_kAngleScale];
  const bool has_place = slots_.at(s.sensor, kMountX) >= 0;
  const double mount_sigma = has_place ? sigma[WM_SENSOR_ROW_kMountX] : 0.0;
  const wm_pose2 mounting = {seen_by.x_m + errors[kMountX], seen_by.y_m + errors[kMountY],
                             seen_by.yaw_rad + errors[kYaw]};
  observation seen = observation_now(filter, at.landmark * kMaxSensors + s.sensor);
  seen.sensor = compose(compose(seen.sensor, at.past.step), mounting);
  seen.kind = (at.reading.bearing ? kObservedBearing : 0u) | (at.reading.range ? kObservedRange : 0u);
  seen.place_m[0] = target.p_m[0];
  seen.place_m[1] = target.p_m[1];
  seen.bearing_rad = s.bearing_rad;
  if (at.elevation) {
    const level_ray ray = levelled(seen_by, errors, s.bearing_rad, s.elevation_rad);
    seen.kind |= kObservedElevation;
    seen.bearing_rad = ray.azimuth_rad;
    seen.tangent = ray.tangent;
    seen.height_m = target.p_m[2] - seen_by.z_m;
    seen.sigma_tangent =
        (1.0 + square(ray.tangent)) * std::sqrt(square(s.elevation_sigma_rad) + square(params().tilt_sigma_rad) +
                                                square(tilt_sigma) + square(scale_sigma));
    seen.sigma_height_m = map_sigma(at.landmark);
  }
  const double along =
      at.reading.range && seen_by.range_is_depth && !std::isnan(s.bearing_rad) ? cos(s.bearing_rad) : 1.0;
  const double slant_m = (s.range_m - errors[kRangeBias]) / errors[kRangeScale] / larger(along, kLeastDepth);
  // The search is planar: the range on the floor, by the landmark's height over the sensor.
  const double height_m = finite(target.p_m[2]) ? target.p_m[2] - seen_by.z_m : 0.0;
  const double floor_m = std::sqrt(larger(square(slant_m) - square(height_m), square(kLeastOnFloor_m)));
  seen.range_m = height_m == 0.0 ? slant_m : floor_m;
  seen.sigma_angle_rad =
      std::sqrt(square(at.reading.bearing_sigma_rad) +
                square(correlated_bearing(params(), at.reading.bearing_sigma_rad)) + square(scale_sigma * kHalfPi));
  seen.sigma_place_m = std::sqrt(square(map_sigma(at.landmark)) + square(mount_sigma) +
                                 square(tilt_sigma * (target.p_m[2] - seen_by.z_m)));
  const double by_slant = height_m == 0.0 ? 1.0 : slant_m / floor_m;  // derivative of the range on the floor
  const double white_m2 = square(at.reading.range_sigma_m) + square(params().range_sigma_rel * slant_m);
  const double lasting_m = correlated_range(params(), at.reading, slant_m);
  seen.sigma_length_m = std::sqrt(square(by_slant) * (white_m2 + square(lasting_m)) + square(map_sigma(at.landmark)));
  return seen;
}

}  // namespace wm
