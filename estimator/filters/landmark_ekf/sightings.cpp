// SPDX-License-Identifier: Apache-2.0
// Sightings, from the event to the update, and what they tell of the pose and of the sensors' calibration.

#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kWidenEvery_s = 1.0;  // the pose's covariance in doubt; not swept

}  // namespace

// A sighting, or a marker whose place is known.
wm_status landmark_ekf::fuse_landmark(const wm_event &event, record_list records) {
  const bool is_marker = event.kind == WM_EVENT_MARKER;
  wm_sighting s = is_marker ? wm_sighting_without_numbers() : event.as.sighting;
  const bool has_bearing = is_marker || !std::isnan(s.bearing_rad);
  wm_innovation record = record_of(event, has_bearing ? WM_RESIDUAL_BEARING : WM_RESIDUAL_RANGE);
  record.sensor = is_marker ? event.as.marker.sensor : s.sensor;
  record.landmark_id = is_marker ? event.as.marker.id : s.landmark_id;
  record.observed = has_bearing ? s.bearing_rad : s.range_m;
  wm_status status =
      is_marker ? check_tag(event.as.marker, setup_->sensor_count) : check_sighting(s, setup_->sensor_count);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);

  sighting_aid::view at;
  const bool tracking = life_.tracking();
  const wm_verdict verdict =
      is_marker ? aid_.look(filter_, event.as.marker, tracking, &s, &at) : aid_.look(filter_, s, tracking, &at);
  record.observed = has_bearing ? s.bearing_rad : s.range_m;
  if (verdict != WM_FUSED) return reject(records, record, verdict);
  record.landmark_id = setup_->landmarks[at.landmark].id;
  const bool has_heading = finite(at.yaw_rad);
  buffer(at, has_heading && !tracking);
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
  const double volume = clutter_volume(at.reading) * (has_heading ? kTwoPi : 1.0);
  // A larger tilt than stated must not make the robot lost.
  later_row elevation(filter_, &rows[at.elevation ? count : 0]);
  const double log_bayes = fuse(rows, count, volume, usable, records);
  if (at.elevation) (void)elevation.fuse(&filter_, policy(true), rows[0].record.verdict == WM_FUSED, records);
  if (usable) test_calibration(at, rows, count - has_heading);
  if (at.reading.bearing)
    note(event.t_ns, at.landmark, log_bayes, rows[0].innovation,
         rows[0].innovation / std::sqrt(rows[0].record.variance));
  else
    note(event.t_ns, at.landmark, log_bayes);
  return WM_OK;
}

// For the search. A tracked pose is not doubted by one marker's heading: that one may have moved.
void landmark_ekf::buffer(const sighting_aid::view &at, bool has_heading) {
  if (!params_.recover) return;
  const sensor_errors errors = remembered_errors_of(at.s->sensor);
  observations_.add(aid_.observe(at, errors, filter_));
  if (has_heading) observations_.add(aid_.observe_heading(at, errors, filter_));
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
