// SPDX-License-Identifier: Apache-2.0
// Sightings, from the event to the update, and what they tell of the pose and of the sensors' calibration.

#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kWidenEvery_s = 1.0;  // the pose's covariance in doubt; not swept
// Chi-square beyond which a sighting without identity is surely of no landmark: 10 sigmas. Nearer, the association's
// gate would decide by chance.
constexpr double kNowhere = 100.0;

// Of a sighting that is not compared with a landmark; 0: it is.
double misfit_of(wm_verdict verdict, bool tracking, double nearest) {
  const double nowhere = landmark_evidence::max_log_bayes_factor();
  if (verdict == WM_REJECTED_UNKNOWN_ID) return nowhere;  // wherever the robot is on this map
  if (verdict != WM_REJECTED_NO_ASSOCIATION || !tracking) return 0.0;
  return nearest > kNowhere ? nowhere : std::nan("");
}

}  // namespace

// A sighting, or a marker whose place is known.
wm_status landmark_ekf::fuse_landmark(const wm_event &event, record_list records) {
  wm_innovation record;
  wm_status status = aid_.check(event, &record);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  go_to(setup_->sensors[record.sensor].mounting.xyz_m);
  sighting_aid::view at;
  const bool tracking = life_.tracking();
  const wm_verdict verdict = aid_.look(event, filter_, tracking, &at, &record);
  misfit_ = misfit_of(verdict, tracking, at.nearest);
  if (verdict != WM_FUSED) return reject(records, record, verdict);
  // A tracked pose is not doubted by one marker's heading: that one may have been turned.
  const bool has_heading = finite(at.yaw_rad);
  const sensor_errors errors = remembered_errors_of(at.s.sensor);
  buffer(aid_.observe(at, errors, filter_));
  if (has_heading && !tracking) buffer(aid_.observe_heading(at, errors, filter_));
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
  residual rows[sighting_aid::kRows];
  int count;
  const bool usable = !records_[static_cast<size_t>(at.landmark)].moved && !evidence_.biased(at.landmark, event.t_ns);
  const double log_bayes = took(aid_.fuse(at, e, record, policy(usable), &filter_, rows, &count, records));
  if (usable) test_calibration(at, rows, count - has_heading);
  if (usable && tracking) misfit_ = log_bayes;
  const double off_rad = at.reading.bearing ? rows[0].innovation : std::nan("");
  note(event.t_ns, at.landmark, log_bayes, off_rad, off_rad / std::sqrt(rows[0].record.variance));
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
  const int sensor = at.s.sensor;
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
  return took(wm::fuse(&filter_, rows, count, clutter_volume, policy(usable), records));
}

double landmark_ekf::took(const fuse_result &done) {
  if (done.widened) inflated_ns_ = filter_.now_ns();
  if (done.verdict == WM_FUSED) life_.fused(filter_.now_ns());
  return done.log_bayes;
}

}  // namespace wm
