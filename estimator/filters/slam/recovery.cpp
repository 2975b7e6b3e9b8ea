// SPDX-License-Identifier: Apache-2.0
// The kidnapped robot: observations of well known landmarks are evidence for or against the pose
// (core/landmark_evidence.hpp). In doubt the map and the calibration are held: updates move the pose alone. A pose that
// is contradicted is LOST; recent observations are then matched with the map (relocalize/pose_search.hpp).
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// Log odds above which the map is held. A proven pose rests at -5 (kidnapped) and below; one misread identity adds 1.6
// at most, two hold the map. Not swept.
constexpr double kHoldMap = -3.0;
// A pose found by one marker: its log prior of being wrong, 18 %, so that one other marker contradicts it; the sigma of
// its place; observations of the marker; its bearing's error of odometry between these, a picture's stamp included.
constexpr double kByOnePrior = -1.5;
constexpr double kByOne_m = 0.1;
constexpr int kByOneSeen = 3;
constexpr double kDrift_rad = 0.005;
constexpr double kSigmas = 3.0;     // by which the mirror image must be excluded
constexpr double kWindow_s = 20.0;  // observations older than this are not searched, as in landmark_ekf
constexpr double kRecent_s = 1.0;   // what the pose was found by serves for so long; then its covariance is small
constexpr double kFound_m = 0.5, kFound_rad = 0.15;  // a pose with larger sigmas is not taken
constexpr double kLoose_m = 0.2, kLoose_rad = 0.05;  // added: errors of sensors and map that the search takes as white
constexpr int kNumbers = 5;                          // must agree; two more than a pose has
constexpr double kFits_m = 0.5, kFits_rad = 0.2;     // of a landmark seen from the pose found: room for its covariance
constexpr double kRevisited_s = 5.0;                 // out of sight for so long and seen again where it was: a witness
constexpr uint32_t kEstablished = 20;                // sightings: hardly any of these was another landmark's
constexpr double kOld_s = 60.0;                      // or on the map for so long: no kidnapping was that long ago

}  // namespace

void slam::begin_evidence(double log_prior) {
  evidence_.begin(log_prior);
  observations_.clear();
  found_by_.clear();
  fit_ns_ = WM_TIME_NONE;
  pattern_odds_.reset(kOwnFramePrior);
  pattern_ns_ = WM_TIME_NONE;
  line_search_.clear();
}

// Doubts end where nothing is observed that would prove or refute them.
void slam::end_doubt() {
  const wm_time_ns now = joint_.now_ns();
  if (life_.tracking() && evidence_.log_odds() > kHoldMap) evidence_.forget(now);
  if (by_slip_ && !slips_.is_convincing(now)) {
    by_slip_ = false;
    life_.fits_again();
  }
}

bool slam::map_is_held() const {
  return !life_.tracking() || evidence_.log_odds() > kHoldMap || slips_.doubts(joint_.now_ns());
}

// Which states a correction may change now.
joint_state::scope slam::scope_now() const {
  if (map_is_held()) return joint_state::scope::pose;
  return params_.map == WM_SLAM_MAP_FROZEN ? joint_state::scope::robot : joint_state::scope::all;
}

// A landmark that was found after a kidnapping fits the wrong pose, so only one that proved its place is evidence for a
// pose: of a given map, seen again after it was out of sight, or on the map for long. Against a pose an
// established one is enough: seen often, or looked for again.
bool slam::is_witness(const landmark_note &note) const {
  return note.surveyed ||
         (is_confirmed(note) && (note.revisited || wm_seconds_between(note.first_ns, joint_.now_ns()) > kOld_s));
}

// The evidence of one observation of a known landmark, before it is fused. A tracker's number (lines.rejoin) is no
// identity: it contradicts nothing when the tracker changes to another edge. `angle_rad`, `normalised`: the bearing's
// innovation, and over its sigma. False: the pose is lost from now on, and the landmark's index may be another.
bool slam::weigh(int landmark, bool passed, double log_bayes, double angle_rad, double normalised) {
  landmark_note &seen = note(landmark);
  if (!params_.recover || rejoins_) return true;
  const wm_time_ns now = joint_.now_ns();
  const bool returned = seen.last_ns != WM_TIME_NONE && wm_seconds_between(seen.last_ns, now) > kRevisited_s;
  if (passed && returned && !map_is_held()) seen.revisited = true;
  const bool witness = is_witness(seen);
  const bool established =
      seen.seen >= kEstablished || (seen.seen >= static_cast<uint32_t>(params_.confirm_seen) && returned);
  if (!witness && (!established || log_bayes < 0.0)) return true;
  return weigh_source(seen.id, &seen.record, passed, witness, log_bayes, angle_rad, normalised);
}

// Of a landmark (`record`), or of positions or headings. `witness`: it proves a pose that it fits.
bool slam::weigh_source(int key, landmark_record *record, bool passed, bool witness, double log_bayes, double angle_rad,
                        double normalised) {
  if (!params_.recover || rejoins_) return true;
  const wm_time_ns now = joint_.now_ns();
  evidence_.note(now, key, log_bayes, angle_rad, normalised, record);
  if (life_.tracking() && evidence_.contradicted()) {
    lose();
    return false;
  }
  if (evidence_.proven()) by_one_ = false;
  if (life_.lost() && !by_slip_ && evidence_.fits() && life_.announced(now)) life_.fits_again();
  if (map_is_held()) return true;
  if (passed && witness) {
    fit_ns_ = now;
    rollback_.remember(joint_, now);
  }
  observations_.clear();
  return true;
}

// The landmarks that joined since the pose last fitted stand where the wrong pose put them.
void slam::lose() {
  life_.lose(joint_.now_ns());
  if (by_one_) one_refuted_ = true;
  line_search_.clear();
  for (int i = joint_.landmarks() - 1; i >= 0 && fit_ns_ != WM_TIME_NONE; i--)
    if (!is_witness(note(i)) && note(i).first_ns > fit_ns_) drop_landmark(i);
  forget_lines();
}

observation slam::observation_from(int landmark, const context &at, const planar_observation &seen) const {
  const int state = joint_.landmark_state(landmark);
  const mounted_sensor &mounting = sensor_[at.sensor];
  observation o{};
  o.t_ns = joint_.now_ns();
  o.kind = (finite(seen.bearing_rad) ? kObservedBearing : 0u) | (finite(seen.range_m) ? kObservedRange : 0u);
  o.key = at.id;
  const wm_pose2 base = compose(joint_.odom(), between(joint_.pose(), at.past.pose));
  o.sensor = compose(base, {mounting.x_m, mounting.y_m, mounting.yaw_rad});
  o.place_m[0] = joint_.value(state);
  o.place_m[1] = joint_.value(state + 1);
  o.bearing_rad = seen.bearing_rad;
  o.range_m = seen.range_m;
  o.sigma_angle_rad = seen.bearing_sigma_rad;
  o.sigma_length_m = seen.range_sigma_m;
  o.sigma_place_m = std::sqrt(0.5 * (joint_.variance(state) + joint_.variance(state + 1)));
  o.travelled_m = joint_.travelled_m();
  o.turned_rad = joint_.turned_rad();
  return o;
}

// Keeps an observation for the search, while the map is held: a place that moves would be another landmark's. False: it
// is an outlier by the observations of this landmark by which the pose was just found, whose covariance is so large
// that the outlier would pass the gate.
bool slam::keep_observation(int landmark, const context &at, const planar_observation &seen) {
  if (!params_.recover || !map_is_held() || !is_confirmed(note(landmark))) return true;
  const int state = joint_.landmark_state(landmark);
  observation o = observation_from(landmark, at, seen);
  const wm_time_ns since = joint_.now_ns() - wm_ns_from_seconds(kRecent_s);
  const bool fits = !found_by_.contradicts(o, since, joint_.pose(), odometry());
  observations_.add(o);
  if (!finite(seen.heading_rad) || joint_.variance(state + 2) > square(kFound_rad)) return fits;
  o.kind = kObservedHeading;
  o.key = -1 - at.id;
  o.sensor = compose(joint_.odom(), between(joint_.pose(), at.past.pose));
  o.bearing_rad = wrap(joint_.value(state + 2) - seen.heading_rad);  // of the robot, in map
  o.sigma_angle_rad = std::sqrt(square(seen.heading_sigma_rad) + joint_.variance(state + 2));
  observations_.add(o);
  return fits;
}

// How many different landmarks of those observed since then a pose explains; *id: one of these. Positions count as one
// each, since a receiver that is wrong at one place is right at another.
int slam::landmarks_fitting(const wm_pose2 &pose, wm_time_ns since_ns, int32_t *id) const {
  const wm_pose2 frame = compose(pose, between(joint_.odom(), wm_pose2{}));
  int32_t fitting[pose_search::kCapacity];
  int count = 0, positions = 0;
  for (int i = 0; i < observations_.kept(); i++) {
    const observation &o = observations_.at(i);
    if (o.t_ns < since_ns) continue;
    const wm_pose2 from = compose(frame, o.sensor);
    const double dx = o.place_m[0] - from.x_m, dy = o.place_m[1] - from.y_m, distance = std::sqrt(dx * dx + dy * dy);
    positions += (o.kind & kObservedPosition) && distance < kFits_m + kSigmas * o.sigma_length_m;
    if (o.key < 0) continue;
    const bool bearing_fits = !(o.kind & kObservedBearing) ||
                              std::fabs(wrap(atan2(dy, dx) - from.heading_rad - o.bearing_rad)) < kFits_rad ||
                              distance < kFits_m;
    if (!bearing_fits || ((o.kind & kObservedRange) && std::fabs(distance - o.range_m) > kFits_m)) continue;
    int k = 0;
    while (k < count && fitting[k] != o.key) k++;
    if (k == count) fitting[count++] = *id = o.key;
  }
  return count + positions;
}

// Two landmarks must agree, since one may have moved. Whether one marker does for all that: its second pose is the
// mirror image about the line of sight, whose heading turns twice as far as that while the robot drives by: it must
// have become impossible. Not where the map grows, since a marker that has moved would spoil it.
bool slam::is_found_by_one(const search_result &found, wm_time_ns since_ns, int32_t id) const {
  if (params_.map != WM_SLAM_MAP_FROZEN || one_refuted_ || !has_headings()) return false;
  if (found.covariance[0][0] + found.covariance[1][1] > 2.0 * square(kByOne_m)) return false;
  double first_rad = 0.0, turned_rad = 0.0, heading_sigma_rad = 0.0;
  int seen = 0;
  for (int i = 0; i < observations_.kept(); i++) {
    const observation &o = observations_.at(i);
    if (o.t_ns >= since_ns && o.key == -1 - id) heading_sigma_rad = larger(heading_sigma_rad, o.sigma_angle_rad);
    if (o.t_ns < since_ns || o.key != id || !(o.kind & kObservedBearing)) continue;
    const double sight_rad = o.sensor.heading_rad + o.bearing_rad;
    if (seen++ == 0) first_rad = sight_rad;
    turned_rad = larger(turned_rad, std::fabs(wrap(sight_rad - first_rad)));
  }
  const int landmark = find_landmark(id);
  const double spread_rad = std::sqrt(2.0 * square(heading_sigma_rad) + square(kDrift_rad));
  return seen >= kByOneSeen && landmark >= 0 && (note(landmark).level || 2.0 * turned_rad > kSigmas * spread_rad);
}

// LOST, or SEARCHING from the start: the pose by the observations of late. True: found.
bool slam::relocalize() {
  const wm_time_ns now = joint_.now_ns();
  if (!params_.recover || by_slip_ || life_.tracking() || (life_.lost() && !life_.announced(now)) ||
      !life_.search_due(now))
    return false;
  life_.searched(now);
  const wm_time_ns since = now - wm_ns_from_seconds(kWindow_s);
  search_result found = observations_.find(since, odometry(), nullptr, 0, {kFound_m, kFound_rad, kNumbers});
  int32_t id = -1;
  const bool by_one = found.found && landmarks_fitting(found.pose, since, &id) < 2;
  if (!found.found || (by_one && !is_found_by_one(found, since, id))) {
    inflate_while_lost();
    return false;
  }
  rollback_.restore(&joint_);
  for (size_t i = 0; i < setup_->sensor_count; i++)  // the heading found is off by the mounting's yaw
    if (const int yaw = slots_.at((int)i, kYaw); yaw >= 0) found.covariance[2][2] += joint_.variance(yaw);
  for (int k = 0; k < 3; k++) found.covariance[k][k] += square(k < 2 ? kLoose_m : kLoose_rad);
  joint_.set_pose(found.pose, found.covariance);
  localizer_.release();
  const pose_search used = observations_;
  take_found(by_one ? kByOnePrior : kFoundWrong);
  found_by_ = used;
  by_one_ = by_one;
  return true;
}

// The pose was found: a new life of the evidence, the map held until it is proven.
void slam::take_found(double log_prior) {
  forget_lines();
  begin_evidence(log_prior);
  life_.relocalized(joint_.now_ns());
}

void slam::inflate_while_lost() { inflate_lost_pose(&life_, &joint_, joint_.now_ns()); }

// Lost, the robot is anywhere on the map, and heads anywhere.
void slam::widen(wm_estimate *out) const {
  double sum[2] = {}, squares[2] = {};
  const int count = joint_.landmarks();
  for (int i = 0; i < count; i++)
    for (int k = 0; k < 2; k++) {
      const double at = joint_.value(joint_.landmark_state(i) + k) - joint_.value(k);
      sum[k] += at;
      squares[k] += square(at);
    }
  for (int k = 0; k < 2 && count > 0; k++) out->covariance[wm_cov_index(k, k)] += squares[k] / count;
  out->covariance[wm_cov_index(5, 5)] += square(kPi) / 3.0;  // uniform
}

}  // namespace wm
