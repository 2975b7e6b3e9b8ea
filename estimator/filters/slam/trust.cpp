// SPDX-License-Identifier: Apache-2.0
// Outliers: misread codes, landmarks that moved, identities that stand at two places, a robot that was turned.
#include "filters/slam/slam.hpp"

namespace wm {
namespace {

constexpr int kUnconfirmedMisfits = 2;   // a landmark joins by one observation with a range, a misread code's, too
constexpr double kSurprising_nis = 4.0;  // of two numbers: one in seven
constexpr double kUncertain = 25.0;      // variance of the innovation over the observation's own: five sigmas wide
constexpr double kOthersFit_s = 3.0;     // a landmark has moved where others were fused so lately; not swept
// Rotation outliers. Chosen on hall-hard and office-hard, seeds 1 and 2; not swept.
constexpr int kAlikeBearings = 5;            // rejected by the same angle, at least
constexpr int kAlikeMarkers = 2;             // the same of markers: each gives the robot's pose by itself
constexpr double kContinuous_s = 0.35;       // a line seen at 10 Hz, two pictures lost; hall-hard 1 to 5, not swept
constexpr double kAlike = 0.25;              // innovations are the same within this share ...
constexpr double kMarkerHeading_rad = 0.01;  // ... and this error of a marker's heading
constexpr double kLever_m = 0.3;             // a turn by 1 rad moves base_link by so much, m

}  // namespace

// After a while without landmarks the gate is as wide as the pose is uncertain, and a misread code passes it and pulls
// the pose away. So a surprising observation that would move the pose much is deferred until a second one of that
// landmark: a code is misread once.
bool slam::is_plausible(int landmark, const joint_state::innovation_block &block, double noise) {
  landmark_note &seen = note(landmark);
  const wm_time_ns now = joint_.now_ns();
  const auto lately = [now](wm_time_ns then) {
    return then != WM_TIME_NONE && then != now && wm_seconds_between(then, now) < kOthersFit_s;
  };
  if (block.nis < kSurprising_nis * gate_scale(block.rows) || block.s[0][0] < kUncertain * noise) return true;
  if (lately(seen.last_ns) || lately(seen.deferred_ns)) return true;
  seen.deferred_ns = now;
  return false;
}

// An identity that is not one landmark's: seen twice in a picture, or at two places in turn.
bool slam::is_ambiguous(int32_t id, int landmark, int sensor) {
  const bool twice = landmark >= 0 && note(landmark).last_ns == joint_.now_ns() && note(landmark).sensor == sensor;
  if (!twice && !ambiguous_.has(id)) return false;
  counts_.ambiguous++;
  return true;
}

// `last_ns`: when this landmark fitted last. A tracker that lost its lines for some pictures finds them again under
// each other's numbers, all shifted alike: that is no rotation of the robot.
void slam::note_rotation(bool fused, double innovation_rad, bool of_marker, wm_time_ns last_ns) {
  outliers_.of_markers = of_marker;
  if (!fused && rejoins_ && wm_seconds_between(last_ns, joint_.now_ns()) > kContinuous_s) return;
  if (fused)
    outliers_.fused++;
  else if (outliers_.rejected < picture_outliers::kCapacity)
    outliers_.innovation_rad[outliers_.rejected++] = innovation_rad;
}

// A new stamp: the picture before is complete. If most of its bearings or markers were rejected by the same angle, the
// landmarks stand where they stood and the robot was turned, by a wheel that slipped or by hand. Its covariance is
// inflated by that angle. False detections scatter.
void slam::end_picture(wm_time_ns t_ns) {
  if (t_ns == outliers_.t_ns) return;
  end_bearings(t_ns);
  const double least = outliers_.of_markers ? kMarkerHeading_rad : 0.0;
  int most = 0;
  double turn = 0.0;
  for (int i = 0; i < outliers_.rejected; i++) {
    const double by = outliers_.innovation_rad[i];
    if (std::fabs(by) < least) continue;
    int alike = 0;
    double sum = 0.0;
    for (int j = 0; j < outliers_.rejected; j++)
      if (std::fabs(outliers_.innovation_rad[j] - by) < kAlike * std::fabs(by) + least) {
        alike++;
        sum += outliers_.innovation_rad[j];
      }
    if (alike > most) {
      most = alike;
      turn = sum / alike;
    }
  }
  const int seen = outliers_.fused + outliers_.rejected;
  const bool enough = most >= (outliers_.of_markers ? kAlikeMarkers : kAlikeBearings) && 2 * most > seen;
  // In the dark a tracker finds a few of its lines where others are, all shifted alike.
  if (enough && (outliers_.of_markers || 2 * seen > outliers_.before)) {
    joint_.inflate_pose(square(kLever_m * turn), square(turn));
    counts_.rotation_outliers++;
  }
  outliers_.before = seen;
  outliers_.t_ns = t_ns;
  outliers_.fused = outliers_.rejected = 0;
}

void slam::note_fused(int landmark, int sensor) {
  landmark_note &seen = note(landmark);
  const wm_time_ns now = joint_.now_ns();
  seen.misfits = 0;
  if (!map_is_held()) seen.seen++;
  seen.last_ns = now;
  seen.sensor = sensor;
  life_.fused(now);
  if (other_fused_id_[0] != seen.id) {
    other_fused_id_[1] = other_fused_id_[0];
    other_fused_ns_[1] = other_fused_ns_[0];
  }
  other_fused_id_[0] = seen.id;
  other_fused_ns_[0] = now;
}

// A landmark that misfits again and again while others fit has moved: it leaves and joins anew where it is. One that
// moved and is elsewhere again is two landmarks of one identity, which is ambiguous from then on.
void slam::note_misfit(int landmark, bool ranged) {
  landmark_note &seen = note(landmark);
  seen.misfits++;
  if (map_is_held()) return;
  if (ranged && !is_confirmed(seen) && seen.misfits >= kUnconfirmedMisfits) return drop_landmark(landmark);
  const bool frozen = params_.map == WM_SLAM_MAP_FROZEN;
  if (seen.misfits < params_.moved_after || (frozen && moved_.has(seen.id))) return;
  for (int i = 0; i < 2; i++) {
    if (other_fused_id_[i] < 0 || other_fused_id_[i] == seen.id) continue;
    if (wm_seconds_between(other_fused_ns_[i], joint_.now_ns()) > kOthersFit_s) continue;
    counts_.moved++;
    (moved_.has(seen.id) ? ambiguous_ : moved_).add(seen.id);
    if (!frozen) drop_landmark(landmark);
    return;
  }
}

}  // namespace wm
