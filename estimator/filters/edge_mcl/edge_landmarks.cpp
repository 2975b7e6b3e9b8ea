// SPDX-License-Identifier: Apache-2.0
// Landmarks beside the floor plan: sightings and coded markers with an identity correct the pose between the scans, are
// evidence for or against it, and find it when it is lost.
#include "filters/core/recovery.hpp"
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// Of log Bayes factors of all landmarks together: as sure as scans are at most (fit_evidence.cpp).
constexpr double kLeastLogBayes = -6.0;
constexpr double kHeldLogOdds = -1.5;  // of being lost (18 %), above which the pose alone is corrected, as by a scan
constexpr double kWindow_s = 20.0;     // observations older than this are not searched, as in landmark_ekf
constexpr double kRecent_s = 2.0;      // those that contradict a tracked pose: others fit by chance in between
// Of a found pose, and how many numbers must agree: two more than a pose has; one more against a tracked pose, by two
// landmarks, since one may have moved.
constexpr double kFound_m = 0.5, kFound_rad = 0.25;
constexpr int kNumbers = 5, kNumbersElsewhere = 6, kLandmarksElsewhere = 2;
constexpr int kFewOf = 3;            // the tracked pose explains less than one in so many
constexpr double kRefuted_s = 10.0;  // scans refuted what landmarks found: the map is searched first; not swept

}  // namespace

void edge_mcl::begin_landmarks() {
  landmark_fit_.begin(kFoundWrong);
  landmarks_seen_.clear();
  refuted_ns_ = WM_TIME_NONE;
}

// By how much landmarks change the odds of being lost.
double edge_mcl::landmark_log_bayes() const {
  const double all = landmark_fit_.log_odds() - kFoundWrong;
  return all > kLeastLogBayes ? all : kLeastLogBayes;
}

fuse_policy edge_mcl::landmark_policy(bool usable) const {
  const wm_sighting_params &p = *setup_->sightings;
  return {.gates = {p.gate_soft, p.gate_hard},
          .usable = usable,
          .holds = lost_log_odds() > kHeldLogOdds,
          .held_to = static_cast<int>(calibration_states_)};
}

wm_status edge_mcl::take_landmark(const wm_event &event, record_list records) {
  wm_innovation record = record_of(event, WM_RESIDUAL_BEARING);
  if (!has_landmarks_) return reject(records, record, WM_REJECTED_UNKNOWN_ID);
  wm_status status = landmarks_.check(event, &record);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);

  sighting_aid::view at;
  const bool tracking = life_.tracking();
  const wm_verdict verdict = landmarks_.look(event, filter_, tracking, &at, &record);
  if (verdict != WM_FUSED) return reject(records, record, verdict);
  const sensor_errors errors = landmarks_.errors_of(filter_, at.s.sensor);
  landmarks_seen_.add(landmarks_.observe(at, errors, filter_));
  if (finite(at.yaw_rad) && !tracking) landmarks_seen_.add(landmarks_.observe_heading(at, errors, filter_));
  // The view is from the pose before.
  const bool found = search_by_landmarks();
  if (found || (life_.searching() && !tentative_)) return reject(records, record, WM_REJECTED_SEARCHING);

  const expected_sighting e = landmarks_.expect(filter_, at);
  if (!e.possible) {
    const wm_verdict why = why_impossible(e);
    if (why == WM_REJECTED_OUT_OF_RANGE) note_landmark(at, landmark_evidence::max_log_bayes_factor(), nullptr);
    return reject(records, record, why);
  }
  residual rows[sighting_aid::kRows];
  int count;
  const landmark_record &own = records_[static_cast<size_t>(at.landmark)];
  const bool usable = !own.moved && !landmark_fit_.biased(at.landmark, event.t_ns);
  const fuse_result done = landmarks_.fuse(at, e, record, landmark_policy(usable), &filter_, rows, &count, records);
  if (done.verdict == WM_FUSED) life_.fused(event.t_ns);
  note_landmark(at, done.log_bayes, at.reading.bearing ? rows : nullptr);
  return WM_OK;
}

// `bearing`: its row; null: there is none.
void edge_mcl::note_landmark(const sighting_aid::view &at, double log_bayes, const residual *bearing) {
  landmark_record &own = records_[static_cast<size_t>(at.landmark)];
  const double angle_rad = bearing ? bearing->innovation : std::nan("");
  const double normalised = bearing ? angle_rad / std::sqrt(bearing->record.variance) : std::nan("");
  landmark_fit_.note(filter_.now_ns(), at.landmark, log_bayes, angle_rad, normalised, &own);
  if (!own.moved && life_.tracking() && landmark_fit_.moved(at.landmark)) {
    own = {.confirmed = 0, .moved = 1};
  } else if (own.moved && own.confirmed) {
    own.moved = 0;
  }
  update_state(0.0);
  update_suspicion();
}

// Of a pose that is lost, what was observed before is of another one.
wm_time_ns edge_mcl::searched_since(wm_time_ns now_ns) const {
  const wm_time_ns recent = wm_ns_from_seconds(kRecent_s), window = now_ns - wm_ns_from_seconds(kWindow_s);
  if (life_.tracking()) return now_ns - recent;
  if (!life_.lost()) return window;
  const wm_time_ns doubted = landmark_fit_.doubted_since_ns();
  const wm_time_ns since = doubted != WM_TIME_NONE ? doubted : life_.lost_ns() - recent;
  return since > window ? since : window;
}

// LOST or SEARCHING, the pose that landmarks find is taken, and scans or other landmarks confirm it. A tracked pose is
// left where several landmarks contradict it and agree on another one. True: found.
bool edge_mcl::search_by_landmarks() {
  const wm_time_ns now = filter_.now_ns(), since = searched_since(now);
  const bool tracking = life_.tracking();
  if (tentative_ || !life_.search_due(now)) return false;
  if (refuted_ns_ != WM_TIME_NONE && wm_seconds_between(refuted_ns_, now) < kRefuted_s) return false;
  const int fitting = tracking ? landmarks_that_fit(since) : 0;
  if (tracking && (landmarks_seen_.count_since(since) < kNumbersElsewhere ||
                   kFewOf * fitting >= landmarks_seen_.count_since(since)))
    return false;
  life_.searched(now);
  const search_result found = landmarks_seen_.find(since, odometry(), nullptr, 0,
                                                   {kFound_m, kFound_rad, tracking ? kNumbersElsewhere : kNumbers});
  if (!found.found) return false;
  if (tracking && (found.landmarks < kLandmarksElsewhere || kFewOf * fitting >= found.agreeing)) return false;
  adopt_found(found);
  return true;
}

// How many observations since then fit the pose.
int edge_mcl::landmarks_that_fit(wm_time_ns since_ns) const {
  constexpr wm_pose2 kAsSeen[kMaxSensors] = {};
  return landmarks_seen_.agreeing(since_ns, filter_.pose(), odometry(), kAsSeen);
}

void edge_mcl::adopt_found(const search_result &found) {
  double covariance[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) covariance[i][j] = found.covariance[i][j];
  begin_tentative(found.pose);
  localizer_.release();
  // The found heading has the error of the mounting's yaw.
  for (int i = 0; i < static_cast<int>(setup_->sensor_count); i++)
    if (const int yaw = landmarks_.slots().at(i, kYaw); yaw >= 0) covariance[2][2] += filter_.variance(yaw);
  others_.drop_searched(found.pose);
  others_.forget_aliased_odds();
  filter_.set_pose(found.pose, covariance);
}

}  // namespace wm
