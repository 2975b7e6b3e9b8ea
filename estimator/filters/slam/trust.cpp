// SPDX-License-Identifier: Apache-2.0
// Outliers: misread codes, landmarks that moved, identities that stand at two places, a robot that was turned.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr int kUnconfirmedMisfits = 2;   // a landmark joins by one observation with a range, a misread code's, too
constexpr double kSurprising_nis = 4.0;  // of two numbers: one in seven
constexpr double kUncertain = 25.0;      // variance of the innovation over the observation's own: five sigmas wide
constexpr double kOthersFit_s = 3.0;     // a landmark has moved where others were fused so lately; not swept
// Two views of a landmark: robot's motion, and its turn, between them. A code that is misread once is misread again
// while nothing moves.
constexpr double kView_m = 0.1, kView_rad = 0.05;
constexpr double kBurst_s = 5.0;  // light changes, too; not swept
// A new identity is misread with this probability. Otherwise its landmark stands anywhere near the other: landmarks
// stand in groups, one on 20 m2 or so. Not swept.
constexpr double kMisread = 0.02, kOwnArea_m2 = 20.0;
constexpr double kMostAlone = 1.0;  // nats, one for each second that the other is seen and this one is not; not swept
constexpr double kUnmodelled_m = 0.05;  // sigma of a difference of two places beyond their covariance; not swept
constexpr double kOnePicture_s = 0.02;  // sightings of one picture have stamps that are nearer
constexpr double kOnePlace_m = 2.0;     // landmarks farther apart are not compared
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
bool slam::is_plausible(int landmark, const innovation &block, double noise) {
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
void slam::note_rotation(bool fused, double innovation_rad, picture_outliers::kind kind, wm_time_ns last_ns) {
  if (!fused && rejoins_ && wm_seconds_between(last_ns, joint_.now_ns()) > kContinuous_s) return;
  picture_outliers::of_kind &of = outliers_.of[kind];
  if (fused)
    of.fused++;
  else if (of.rejected < picture_outliers::kCapacity)
    of.innovation_rad[of.rejected++] = innovation_rad;
}

// Most of the picture's bearings, or of its markers, were rejected by the same angle.
bool slam::is_turned(picture_outliers::kind kind, double *turn_rad) const {
  const picture_outliers::of_kind &of = outliers_.of[kind];
  const bool of_markers = kind == picture_outliers::kMarkers;
  const double least = of_markers ? kMarkerHeading_rad : 0.0;
  int most = 0;
  for (int i = 0; i < of.rejected; i++) {
    const double by = of.innovation_rad[i];
    if (std::fabs(by) < least) continue;
    int alike = 0;
    double sum = 0.0;
    for (int j = 0; j < of.rejected; j++)
      if (std::fabs(of.innovation_rad[j] - by) < kAlike * std::fabs(by) + least) {
        alike++;
        sum += of.innovation_rad[j];
      }
    if (alike > most) {
      most = alike;
      *turn_rad = sum / alike;
    }
  }
  const int seen = of.fused + of.rejected;
  if (most < (of_markers ? kAlikeMarkers : kAlikeBearings) || 2 * most <= seen) return false;
  // In the dark a tracker finds a few of its lines where others are, all shifted alike.
  return of_markers || 2 * seen > outliers_.before[kind];
}

// A new stamp: the picture before is complete. If it is turned, the landmarks stand where they stood and the robot was
// turned, by a wheel that slipped or by hand. Its covariance is inflated by that angle. False detections scatter.
void slam::end_picture(wm_time_ns t_ns) {
  if (t_ns == outliers_.t_ns) return;
  first_.count = first_.settled = 0;
  end_bearings(t_ns);
  double turn_rad = 0.0;
  if (is_turned(picture_outliers::kMarkers, &turn_rad) || is_turned(picture_outliers::kBearings, &turn_rad)) {
    joint_.inflate_pose(square(kLever_m * turn_rad), square(turn_rad));
    counts_.rotation_outliers++;
  }
  outliers_.t_ns = t_ns;
  for (int k = 0; k < picture_outliers::kKinds; k++) {
    outliers_.before[k] = outliers_.of[k].fused + outliers_.of[k].rejected;
    outliers_.of[k].fused = outliers_.of[k].rejected = 0;
  }
}

void slam::note_fused(int landmark, int sensor) {
  landmark_note &seen = note(landmark);
  const wm_time_ns now = joint_.now_ns();
  seen.misfits = 0;
  if (!map_is_held()) seen.seen++;
  seen.last_ns = now;
  seen.sensor = sensor;
  const wm_pose2 moved = between(seen.first_view, joint_.odom());
  if (square(moved.x_m) + square(moved.y_m) > square(kView_m) || std::fabs(moved.heading_rad) > kView_rad ||
      (seen.first_ns != WM_TIME_NONE && wm_seconds_between(seen.first_ns, now) > kBurst_s))
    seen.viewed_twice = true;
  for (int i = 0; i < joint_.landmarks(); i++) {
    const bool together = note(i).last_ns != WM_TIME_NONE && wm_seconds_between(note(i).last_ns, now) < kOnePicture_s;
    if (i == landmark || !together || !stands_with(landmark, i)) continue;
    seen.apart_from = note(i).id;
    note(i).apart_from = seen.id;
  }
  find_double(landmark);
  life_.fused(now);
  if (other_fused_id_[0] != seen.id) {
    other_fused_id_[1] = other_fused_id_[0];
    other_fused_ns_[1] = other_fused_ns_[0];
  }
  other_fused_id_[0] = seen.id;
  other_fused_ns_[0] = now;
}

// Outliers in a row after which it left its place. One that was on the map during one visit only may have been misread
// then: as many as there were sightings decide.
int slam::most_misfits(const landmark_note &seen) const {
  const int most = seen.seen < static_cast<uint32_t>(params_.moved_after) ? (int)seen.seen : params_.moved_after;
  return seen.surveyed || seen.revisited ? params_.moved_after
         : most > kUnconfirmedMisfits    ? most
                                         : kUnconfirmedMisfits;
}

// Landmarks that were on the map before fit the pose, so that it is right.
bool slam::do_others_fit(const landmark_note &seen) const {
  const wm_time_ns now = joint_.now_ns();
  // One that was on the map during one visit only was misread more probably than the odometry slipped since.
  const wm_time_ns fitted_ns = seen.may_be_misread && !seen.revisited ? slips_.linked_ns() : slips_.fitted_ns();
  if (fitted_ns != WM_TIME_NONE) return wm_seconds_between(fitted_ns, now) <= kOthersFit_s;
  for (int i = 0; i < 2; i++)
    if (other_fused_id_[i] >= 0 && other_fused_id_[i] != seen.id &&
        wm_seconds_between(other_fused_ns_[i], now) <= kOthersFit_s)
      return true;
  return false;
}

// A landmark that misfits again and again while others fit has moved: it leaves and joins anew where it is. One that
// moved and is elsewhere again is two landmarks of one identity, which is ambiguous from then on.
void slam::note_misfit(int landmark, bool ranged) {
  landmark_note &seen = note(landmark);
  seen.misfits++;
  // Held by this landmark alone, which more probably was misread.
  const bool is_alone = life_.tracking() && seen.may_be_misread && !seen.revisited && slips_.doubts_one();
  if (map_is_held() && !is_alone) return;
  if (ranged && !is_confirmed(seen) && seen.misfits >= kUnconfirmedMisfits) return drop_landmark(landmark);
  const bool frozen = params_.map == WM_SLAM_MAP_FROZEN;
  if (seen.misfits < (ranged ? most_misfits(seen) : params_.moved_after) || (frozen && moved_.has(seen.id))) return;
  if (!do_others_fit(seen)) return;
  if (seen.misfits >= params_.moved_after) {
    counts_.moved++;
    (moved_.has(seen.id) ? ambiguous_ : moved_).add(seen.id);
  }
  if (!frozen) drop_landmark(landmark);
}

// Two landmarks stand at one place: that they are one, misread, is more probable than that another one stands there.
// More so where the other one is still seen after this one was seen last.
bool slam::stands_with(int one, int other) const {
  const int a = joint_.landmark_state(one), b = joint_.landmark_state(other);
  if (std::fabs(joint_.value(a) - joint_.value(b)) > kOnePlace_m ||
      std::fabs(joint_.value(a + 1) - joint_.value(b + 1)) > kOnePlace_m)
    return false;
  landmark_pair p = pair_of(one, other);
  for (int k = 0; k < 2; k++) p.s[k][k] += square(kUnmodelled_m);
  const double determinant = p.s[0][0] * p.s[1][1] - p.s[0][1] * p.s[1][0];
  const double nis =
      (p.s[1][1] * square(p.apart[0]) - 2.0 * p.s[0][1] * p.apart[0] * p.apart[1] + p.s[0][0] * square(p.apart[1])) /
      determinant;
  const double alone_s = wm_seconds_between(note(one).last_ns, note(other).last_ns);
  const double alone = alone_s < 0.0 ? 0.0 : alone_s < kMostAlone ? alone_s : kMostAlone;
  return determinant > 0.0 && kMisread * kOwnArea_m2 * exp(alone - 0.5 * nis) > kTwoPi * std::sqrt(determinant);
}

// Where an identity is misread, its landmark stands where the one does that was seen, and they are never seen together.
void slam::find_double(int landmark) {
  landmark_note &own = note(landmark);
  own.is_double = false;
  if (!own.may_be_misread) return;
  for (int i = 0; i < joint_.landmarks() && !own.is_double; i++) {
    const landmark_note &other = note(i);
    const bool is_likelier = other.seen > own.seen || (other.seen == own.seen && other.last_ns > own.last_ns);
    own.is_double = i != landmark && is_likelier && own.apart_from != other.id && stands_with(landmark, i);
  }
}

}  // namespace wm
