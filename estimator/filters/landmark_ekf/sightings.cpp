// SPDX-License-Identifier: Apache-2.0
// Sightings, from the event to the update, and what they tell of the pose and of the sensors' calibration.

#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kWidenEvery_s = 1.0;  // the pose's covariance in doubt; not swept

// From a sensor's axes to levelled axes along its yaw.
void to_level(const mounted_sensor &sensor, const double p_m[3], double level_m[3]) {
  for (int i = 0; i < 3; i++)
    level_m[i] = sensor.axis[0][i] * p_m[0] + sensor.axis[1][i] * p_m[1] + sensor.axis[2][i] * p_m[2];
}

}  // namespace

// A marker whose place is known is a landmark: its place in the sensor's frame gives bearing and range, of a steep
// sensor about the vertical. The range is along the line of sight where the map has the marker's height, else on the
// floor, as expect() has it. A second pose that the corners fit is turned about the same place.
wm_status landmark_ekf::fuse_marker(const wm_event &event, record_list records) {
  const wm_marker &m = event.as.marker;
  double v[3] = {m.p_m[0], m.p_m[1], m.p_m[2]};
  if (m.sensor < setup_->sensor_count && aid_.sensor(m.sensor).is_steep) to_level(aid_.sensor(m.sensor), m.p_m, v);
  const int landmark = aid_.find(m.id);
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

  sighting_aid::view at;
  const wm_verdict verdict = aid_.look(filter_, s, life_.tracking(), &at);
  if (verdict != WM_FUSED) return reject(records, record, verdict);
  record.landmark_id = setup_->landmarks[at.landmark].id;
  if (params_.recover) observations_.add(aid_.observe(at, remembered_errors_of(s.sensor), filter_));
  if (needs_search(event.t_ns, at.reading.bearing)) {
    search_now(event.t_ns);
    return reject(records, record, WM_REJECTED_SEARCHING);
  }

  const expected_sighting e = aid_.expect(filter_, at);
  if (!e.possible) {
    const wm_verdict why = why_impossible(e);
    if (why == WM_REJECTED_OUT_OF_RANGE) note(event.t_ns, at.landmark, landmark_evidence::max_log_bayes_factor());
    return reject(records, record, why);
  }
  residual rows[3];
  const int count = aid_.put_rows(at, e, record, &filter_, rows) - at.elevation;
  const bool usable = !records_[static_cast<size_t>(at.landmark)].moved && !evidence_.biased(at.landmark, event.t_ns);
  // A larger tilt than stated must not make the robot lost.
  later_row elevation(filter_, &rows[count]);
  const double log_bayes = fuse(rows, count, clutter_volume(at.reading), usable, records);
  if (at.elevation) (void)elevation.fuse(&filter_, policy(true), rows[0].record.verdict == WM_FUSED, records);
  if (usable) test_calibration(at, rows, count);
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
    const int state = r.row.index[i], own = aid_.slots().state_of(sensor, state);
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
void landmark_ekf::test_calibration(const sighting_aid::view &at, const residual *rows, int count) {
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
    const int slot = aid_.slots().at(sensor, k);
    prior[k] = slot < 0 ? 0.0 : rollback_.variance(rollback_.kStart, slot);
  }
  if (first_.contradict(sensor, pose, prior)) restart_calibration(sensor, prior);
}

void landmark_ekf::restart_calibration(int sensor, const double prior[kSensorStates]) {
  for (int k = 0; k < kSensorStates; k++) {
    const int slot = aid_.slots().at(sensor, k);
    if (slot < 0) continue;
    filter_.forget(slot, kSensorStateSpecs[k].neutral, prior[k]);
    rollback_.restart(slot);
  }
  first_.restarted(sensor);
}

// After several misfits the pose's covariance grows, slower than a search finds the pose.
fuse_policy landmark_ekf::policy(bool usable) const {
  const bool doubtful = evidence_.doubtful();
  const bool due = inflated_ns_ == WM_TIME_NONE || wm_seconds_between(inflated_ns_, filter_.now_ns()) > kWidenEvery_s;
  return {.gates = {sightings().gate_soft, sightings().gate_hard},
          .usable = usable,
          .unproven = params_.recover && !evidence_.proven(),
          .doubtful = doubtful,
          .widens = due,
          .learns = evidence_.proven() && !doubtful,
          .held_to = calibration_states_};
}

double landmark_ekf::fuse(residual *rows, int count, double clutter_volume, bool usable, record_list records) {
  const fuse_result done = wm::fuse(&filter_, rows, count, clutter_volume, policy(usable), records);
  if (done.widened) inflated_ns_ = filter_.now_ns();
  if (done.verdict == WM_FUSED) life_.fused(filter_.now_ns());
  return done.log_bayes;
}

}  // namespace wm
