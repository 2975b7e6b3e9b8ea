// SPDX-License-Identifier: Apache-2.0
// From a sighting to an update or to a new landmark.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kLeastLever_m = 0.1;       // floor of the distance by which a lateral error becomes an angle
constexpr double kLeastDepth = 0.1;         // floor of the cosine between a depth's axis and the bearing
constexpr double kAmbiguous = 2.0;          // the second best association must be worse by this factor; not swept
constexpr int kNameless = 20;               // sightings without an identity, none with one; not swept
constexpr double kLeastDeterminant = 1e-9;  // of H_l; in a regular geometry it is 1 / distance, 1e-6 at the least
constexpr int kNewtonSteps = 3;             // to the place that a sensor that is not level sees; each squares the error

}  // namespace

// Who states covariances of the odometry and of the sightings has a model of all errors. So has a detector of lines,
// whose bearings state their sigmas: while distances are unknown, rays would bend the mounting. An edge is found beside
// its place for as long as it is seen alike, so these bearings have errors that last.
slam::reading slam::reading_of(const wm_sighting &s) const {
  reading r = read_sighting(s, sensor_[s.sensor], sightings());
  const bool stated = (!r.bearing || finite(s.bearing_sigma_rad)) && (!r.range || finite(s.range_sigma_m));
  r.complete = stated && (!r.range || joint_.is_calibrated());
  r.independent = r.complete && r.range;
  return r;
}

// The default states that do not act on a complete sighting, by bit. The clock's does, and where ranges show it, the
// mounting's yaw.
unsigned slam::exact_states(const reading &r) {
  if (!r.complete) return 0u;
  return ~(1u << kTimeOffset) & ~(r.independent ? 1u << kYaw : 0u);
}

// Distance on the floor by a range that may be a depth.
double slam::distance_of(const wm_sighting &s) const {
  const mounted_sensor &sensor = sensor_[s.sensor];
  const sensor_errors errors = errors_of(s.sensor);
  const double range = (s.range_m - errors[kRangeBias]) / errors[kRangeScale];
  const bool depth = sensor.range_is_depth && !std::isnan(s.bearing_rad);
  return range / (depth ? larger(cos(s.bearing_rad), kLeastDepth) : 1.0);
}

wm_status slam::fuse_sighting(const wm_event &event, record_list records) {
  const wm_sighting &s = event.as.sighting;
  const bool has_bearing = !std::isnan(s.bearing_rad);
  context at{
      s.sensor, s.landmark_id, {}, record_of(event, has_bearing ? WM_RESIDUAL_BEARING : WM_RESIDUAL_RANGE), records};
  at.record.sensor = s.sensor;
  at.record.landmark_id = s.landmark_id;
  at.record.observed = has_bearing ? s.bearing_rad : s.range_m;
  wm_status status = check_sighting(s, setup_->sensor_count);
  if (status != WM_OK) return refuse(records, at.record, status);
  status = begin_observation(event.t_ns);
  if (status != WM_OK) return status;
  const reading r = reading_of(s);
  if (!r.bearing && !r.range) return reject(records, at.record, WM_REJECTED_BY_CONFIG);
  if (s.range_m > sensor_[s.sensor].max_range_m) return reject(records, at.record, WM_REJECTED_OUT_OF_RANGE);

  if (r.range) note_range(s.sensor, r.complete);
  if (r.complete) note_calibrated(s.sensor, exact_states(r));
  begin_picture(s.sensor, event.t_ns);
  at.past = look_back(s.sensor);
  int landmark;
  const wm_verdict verdict = identify(s, r, &at, &landmark);
  if (verdict != WM_FUSED) return reject(records, at.record, verdict);
  if (landmark >= 0 && s.landmark_id >= 0 && map_is_held()) {
    const bool fits = keep_observation(landmark, at, observation_of(s, r));
    if (relocalize()) return reject(records, at.record, WM_REJECTED_SEARCHING);
    if (!fits && life_.tracking()) return reject(records, at.record, WM_REJECTED_GATE);
  }
  if (landmark < 0 && r.bearing && !r.range) take_lines();
  if (rejoins_ && r.bearing && !r.range) collect_bearing(s, at.past);
  if (life_.searching() || (life_.lost() && rejoins_)) return reject(records, at.record, WM_REJECTED_SEARCHING);
  const wm_status taken = take_sighting(at, s, r, landmark);
  take_waiting(at);
  return taken;
}

wm_status slam::take_sighting(const context &at, const wm_sighting &s, const reading &r, int landmark) {
  if (landmark < 0) return begin_landmark(at, s, r);
  fuse_known(at, s, r, landmark);
  return WM_OK;
}

// auto: a sensor that has given an identity could not read this one's; so could one that has given few sightings.
bool slam::takes_unidentified(int sensor) const {
  if (sightings().use_unidentified != WM_UNIDENTIFIED_AUTO) return sightings().use_unidentified != WM_UNIDENTIFIED_OFF;
  return nameless_[sensor] >= kNameless;
}

void slam::note_identity(int sensor, bool named) {
  if (named || nameless_[sensor] < 0)
    nameless_[sensor] = -1;
  else if (nameless_[sensor] < kNameless)
    nameless_[sensor]++;
}

// The landmark of a sighting; -1: a new one. WM_FUSED: go on.
wm_verdict slam::identify(const wm_sighting &s, const reading &r, context *at, int *landmark) {
  note_identity(s.sensor, s.landmark_id >= 0);
  *landmark = s.landmark_id >= 0 ? find_landmark(s.landmark_id) : -1;
  if (s.landmark_id >= 0) return is_ambiguous(at->id, *landmark, s.sensor) ? WM_REJECTED_NO_ASSOCIATION : WM_FUSED;
  bool fresh = false;
  if (takes_unidentified(s.sensor) && r.bearing && r.range && s.range_m <= params_.associate_max_range_m)
    *landmark = associate(s, r, at->past, &fresh);
  if (*landmark < 0 && !fresh) return WM_REJECTED_NO_ASSOCIATION;
  at->id = at->record.landmark_id = *landmark < 0 ? own_id() : note(*landmark).id;
  return WM_FUSED;
}

// Nearest neighbour by NIS, in both directions: no other landmark is near, and no other sighting of the same stamp was
// this landmark's. *fresh: no landmark is near, it is a new one.
int slam::associate(const wm_sighting &s, const reading &r, const past_pose &past, bool *fresh) const {
  const wm_pose2 from = sensor_pose(s.sensor, past);
  const sin_cos ray = sincos(from.heading_rad + s.bearing_rad);
  const double x = from.x_m + s.range_m * ray.cos, y = from.y_m + s.range_m * ray.sin;
  int best = -1;
  double least = params_.new_gate, second = params_.new_gate;
  for (int i = 0; i < joint_.landmarks(); i++) {
    if (is_member(note(i))) continue;
    const int state = joint_.landmark_state(i);
    const wm_pose2 place = pose_of(i);
    if (std::fabs(place.x_m - x) > params_.associate_near_m || std::fabs(place.y_m - y) > params_.associate_near_m)
      continue;
    landmark_rows v;
    if (expect_sighting(s, r, past, place, -1, &v) != WM_FUSED) continue;
    for (int k = 0; k < 2; k++)
      for (int j = 0; j < 2; j++) v.row[k].add(state + j, v.by_landmark[k][j]);
    const double s00 = joint_.variance_of(v.row[0]) + v.noise[0], s11 = joint_.variance_of(v.row[1]) + v.noise[1];
    const double s01 = joint_.covariance_of(v.row[0], v.row[1]);
    const double nis = (s11 * square(v.innovation[0]) - 2.0 * s01 * v.innovation[0] * v.innovation[1] +
                        s00 * square(v.innovation[1])) /
                       (s00 * s11 - s01 * s01);
    if (nis < least) {
      second = least;
      least = nis;
      best = i;
    } else if (nis < second) {
      second = nis;
    }
  }
  *fresh = best < 0;
  const bool taken = best >= 0 && note(best).last_ns == joint_.now_ns();
  return best >= 0 && !taken && least < params_.associate_gate && second > kAmbiguous * least ? best : -1;
}

// For the search of the pose. Its sigmas need no cross terms: the search allows for odometry's errors besides.
slam::planar_observation slam::observation_of(const wm_sighting &s, const reading &r) const {
  const double range = distance_of(s);
  return {.bearing_rad = r.bearing ? s.bearing_rad : std::nan(""),
          .range_m = r.range ? range : std::nan(""),
          .heading_rad = std::nan(""),
          .bearing_sigma_rad =
              std::sqrt(square(r.bearing_sigma_rad) + square(correlated_bearing(sightings(), r.bearing_sigma_rad))),
          .range_sigma_m = std::sqrt(square(r.range_sigma_m) + square(correlated_range(sightings(), r.range_sigma_m)) +
                                     square((sightings().range_sigma_rel + sightings().correlated_range_rel) * range)),
          .heading_sigma_rad = std::nan("")};
}

// The rows of bearing and range. `error_state`: of the time-correlated errors; -1: they count as noise.
wm_verdict slam::expect_sighting(const wm_sighting &s, const reading &r, const past_pose &past, const wm_pose2 &place,
                                 int error_state, landmark_rows *out) const {
  const double at[3] = {place.x_m, place.y_m, std::nan("")};
  const unsigned components = (r.bearing ? kBearing : 0u) | (r.range ? kRange : 0u) | components_;
  const expected_sighting e = expect(sensor_[s.sensor], errors_of(s.sensor), past.pose, at, components);
  if (!e.possible) return why_impossible(e);
  const auto add = [&](wm_residual kind, double observed, double expected, const double by[kCauses], double variance,
                       int error_offset, double error_size) {
    const int i = out->count++;
    joint_row &row = out->row[i];
    add_past_pose(&row, by, past, slots_.at(s.sensor, kTimeOffset, exact_states(r)));
    slots_.add_to(&row, s.sensor, by, exact_states(r));
    if (error_state >= 0 && error_offset >= 0) {
      row.add(error_state + error_offset, error_size);
      expected += error_size * joint_.value(error_state + error_offset);
    } else {
      variance += square(error_size);
    }
    for (int k = 0; k < 3; k++) out->by_landmark[i][k] = k < 2 ? -by[k] : 0.0;
    out->kind[i] = kind;
    out->observed[i] = observed;
    out->expected[i] = expected;
    out->innovation[i] = kind == WM_RESIDUAL_BEARING ? wrap(observed - expected) : observed - expected;
    out->noise[i] = variance;
  };
  const double lever_m = larger(e.distance_m, kLeastLever_m);
  if (r.bearing)
    add(WM_RESIDUAL_BEARING, s.bearing_rad, e.bearing_rad, e.bearing_by,
        square(r.bearing_sigma_rad) + square(sightings().lateral_sigma_m / lever_m), error_.bearing,
        correlated_bearing(sightings(), r, lever_m));
  if (r.range)
    add(WM_RESIDUAL_RANGE, s.range_m, e.range_m, e.range_by,
        square(r.range_sigma_m) + square(sightings().range_sigma_rel * e.range_m), error_.range,
        correlated_range(sightings(), r, e.range_m));
  return WM_FUSED;
}

// Whether an identified sighting may be fused, or counted as an outlier. False: the landmark's index may be another.
bool slam::weigh_identified(int landmark, const context &at, const wm_sighting &s, const reading &r,
                            const landmark_rows &v, const innovation &block, bool passed) {
  if (weigh_slip(landmark, at, observation_of(s, r), passed)) return false;
  const double angle_rad = v.kind[0] == WM_RESIDUAL_BEARING ? v.innovation[0] : std::nan("");
  const double volume = v.kind[0] == WM_RESIDUAL_X ? kPi * square(kClutterRange_m) : clutter_volume(r);
  const double log_bayes =
      passed ? landmark_evidence::log_bayes_factor(block.density(), volume) : landmark_evidence::max_log_bayes_factor();
  return weigh(landmark, passed, log_bayes, angle_rad, angle_rad / std::sqrt(block.s[0][0])) &&
         (!passed || is_plausible(landmark, block, v.noise[0]));
}

// Rows along and across the line of sight, which are linear in the landmark's place: where a landmark is expected
// behind a sensor of depths, bearing and depth have no derivatives. It contradicts like any other, or fits an uncertain
// pose.
void slam::expect_point(const context &at, const planar_observation &seen, int landmark, landmark_rows *out) const {
  const slip_sighting point{observation_from(landmark, at, seen), 0, joint_.landmark_state(landmark)};
  const slip_rows r = slip_search::rows_of(point, joint_, joint_.pose(), odometry());
  out->count = 2;
  for (int k = 0; k < 2; k++) {
    for (int i = 0; i < 3; i++) out->row[k].add(r.index[i], r.by[k][i]);
    for (int i = 0; i < 3; i++) out->by_landmark[k][i] = i < 2 ? r.by[k][3 + i] : 0.0;
    out->kind[k] = k == 0 ? WM_RESIDUAL_X : WM_RESIDUAL_Y;
    out->observed[k] = k == 0 ? seen.range_m : 0.0;
    out->expected[k] = out->observed[k] - r.innovation[k];
    out->innovation[k] = r.innovation[k];
    out->noise[k] = r.noise[k];
  }
}

// Where the pose is vague, the second derivatives of bearing and range count as noise [Athans1968]: an error t across
// the line of sight, at distance d, shortens the range by t^2 / 2d, and with an error r along it turns the bearing by
// r t / d^2. Their mean squares are 3/4 (P_tt / d)^2 and (P_rr P_tt + 2 P_rt^2) / d^4. P_tt is of the place in
// base_link: no turn of the whole map is such an error. The gate is without this noise, with which misread identities
// would pass.
bool slam::add_bend(const context &at, int landmark, landmark_rows *v) const {
  const relative_place p = relative_place_of(at, landmark);
  const double d = p.distance_m;
  if (!(d > kOnSensor_m)) return false;
  const double added[2] = {(p.along_m2 * p.across_m2 + 2.0 * square(p.along_across_m2)) / square(square(d)),
                           0.75 * square(p.across_m2 / d)};
  bool is_bent = false;
  for (int k = 0; k < 2; k++) {
    if (!(added[k] > v->noise[k])) continue;
    v->noise[k] += added[k];
    is_bent = true;
  }
  return is_bent;
}

// Bearing and range are gated together: a wrong one spoils the other.
void slam::fuse_known(const context &at, const wm_sighting &s, const reading &r, int landmark) {
  landmark_rows v;
  const wm_verdict possible = expect_sighting(s, r, at.past, pose_of(landmark), lend(at), &v);
  const bool is_point = possible == WM_REJECTED_OUT_OF_RANGE && r.bearing && r.range;
  if (is_point)
    expect_point(at, observation_of(s, r), landmark, &v);
  else if (possible != WM_FUSED)
    return (void)reject(at.records, at.record, possible);
  if (!r.bearing) v.noise[0] += curvature_variance(at, landmark, v);
  innovation block = prepare(landmark, &v);
  if (r.bearing && !r.range && waits_for_another(at, line_bearing_of(s, r), v, block)) return;
  const gate_result g = gate(block.nis, v.count, gates());
  if (s.landmark_id >= 0 && !weigh_identified(landmark, at, s, r, v, block, g.passed))
    return (void)reject(at.records, at.record, WM_REJECTED_SEARCHING);
  if (g.passed && r.bearing && r.range && !is_point && add_bend(at, landmark, &v))
    block = joint_.prepare(v.row, v.innovation, v.noise, v.count);
  const wm_verdict verdict = fuse_rows(at, v, g, &block);
  if (r.bearing && !is_point)
    note_rotation(g.passed, v.innovation[0], picture_outliers::kBearings, note(landmark).last_ns);
  if (!g.passed) return note_misfit(landmark, r.range);
  if (verdict == WM_FUSED) {
    if (!r.range && note(landmark).last_ns != WM_TIME_NONE)
      note_return(wm_seconds_between(note(landmark).last_ns, joint_.now_ns()));
    note_fused(landmark, s.sensor);
  }
}

slam::line_bearing slam::line_bearing_of(const wm_sighting &s, const reading &r) const {
  const bool none = r.independent && sightings().correlated_bearing_rad < 0.0;
  return {s.bearing_rad, s.bearing_sigma_rad, r.bearing_sigma_rad,
          none ? 0.0 : correlated_bearing(sightings(), r.bearing_sigma_rad), exact_states(r)};
}

// A sighting of a landmark that is not on the map.
wm_status slam::begin_landmark(context at, const wm_sighting &s, const reading &r) {
  const bool may_join = params_.map != WM_SLAM_MAP_FROZEN && r.bearing && (r.range || has_lines());
  const bool as_ray = params_.line_method == WM_SLAM_LINE_INVERSE_DISTANCE;
  wm_verdict verdict = WM_REJECTED_UNKNOWN_ID;
  if (!r.bearing && params_.map != WM_SLAM_MAP_FROZEN)
    verdict = map_is_held() ? WM_REJECTED_SEARCHING : follow_annulus(at, s, r);
  else if (may_join && map_is_held())
    verdict = WM_REJECTED_SEARCHING;
  else if (may_join && r.range)
    verdict = join_seen(at, s, r);
  else if (may_join && !as_ray)
    verdict = track_bearing(at, line_bearing_of(s, r));
  else if (may_join) {
    if (bearing_tracks::track *ray = current_ray(at)) return follow_ray(at, ray, line_bearing_of(s, r));
    verdict = begin_ray(at, line_bearing_of(s, r));
  }
  if (verdict == WM_FUSED) at.record.expected = at.record.observed;  // it defines the landmark
  return reject(at.records, at.record, verdict);
}

// By bearing and range. The first guess takes the sensor as level; Newton's steps end where it sees the landmark.
wm_verdict slam::join_seen(const context &at, const wm_sighting &s, const reading &r) {
  const double range = distance_of(s);
  const wm_pose2 from = sensor_pose(s.sensor, at.past);
  const sin_cos ray = sincos(from.heading_rad + s.bearing_rad);
  double place[3] = {from.x_m + range * ray.cos, from.y_m + range * ray.sin, 0.0};
  const int error_state = lend(at);
  for (int step = 0;; step++) {
    landmark_rows v;
    const wm_verdict possible = expect_sighting(s, r, at.past, {place[0], place[1], 0.0}, error_state, &v);
    const double(*h)[3] = v.by_landmark;
    const double determinant = possible == WM_FUSED ? h[0][0] * h[1][1] - h[0][1] * h[1][0] : 0.0;
    if (!(std::fabs(determinant) > kLeastDeterminant) || !(range > kOnSensor_m)) return WM_REJECTED_SINGULAR;
    const double inverse[3][3] = {{h[1][1] / determinant, -h[0][1] / determinant, 0.0},
                                  {-h[1][0] / determinant, h[0][0] / determinant, 0.0},
                                  {0.0, 0.0, 0.0}};
    if (step == kNewtonSteps) {
      if (!finite(place[0]) || !finite(place[1]) || !make_room()) return WM_REJECTED_NO_ASSOCIATION;
      // A heading, where landmarks have one, is unknown.
      note(join(at, v, inverse, place, square(kPi))).may_be_misread = s.landmark_id >= 0;
      return WM_FUSED;
    }
    for (int k = 0; k < 2; k++) place[k] += inverse[k][0] * v.innovation[0] + inverse[k][1] * v.innovation[1];
  }
}

}  // namespace wm
