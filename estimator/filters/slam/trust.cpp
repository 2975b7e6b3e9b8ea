// SPDX-License-Identifier: Apache-2.0
// Which sightings and landmarks are what they say: misread codes, landmarks that moved, identities that stand twice.
#include "filters/slam/slam.hpp"

namespace wm {
namespace {

constexpr int kUnconfirmedMisfits = 2;
constexpr double kSurprising = 4.0;      // of two numbers, normalised innovation squared: one in seven
constexpr double kUnsure = 25.0;         // times the sighting's own variance is what it is expected with
constexpr double kOthersFit_s = 3.0;     // a landmark was moved where others were fused so lately
constexpr int kJolted = 5;               // bearings that were refused by the same amount, at least
constexpr int kJoltedPrints = 2;         // or prints by the same turn: each tells the robot's pose by itself
constexpr double kContinuous_s = 0.35;   // a line seen at 10 Hz, two pictures lost; hall-hard 1 to 5, not swept
constexpr double kAlike = 0.25;          // within this part of it
constexpr double kPrintTurn_rad = 0.01;  // and this: what a print's turn is off by
constexpr double kLever_m = 0.3;         // a jolt that turns the robot by so many rad moves it by that times this

}  // namespace

// After a while without landmarks the gate is as wide as the pose is unsure, and a misread code passes it and carries
// the robot off. So a sighting that is surprising and would move much waits for a second one of that landmark: codes
// are misread once.
bool slam::believable(int landmark, const joint_state::innovation_block &block, double noise, double scale) {
  landmark_note &note = notes()[landmark];
  const wm_time_ns now = joint_.now_ns();
  const auto lately = [now](wm_time_ns then) {
    return then != WM_TIME_NONE && then != now && wm_seconds_between(then, now) < kOthersFit_s;
  };
  if (block.nis < kSurprising * scale || block.s[0][0] < kUnsure * noise) return true;
  if (lately(note.last_ns) || lately(note.doubted_ns)) return true;
  note.doubted_ns = now;
  return false;
}

// `last_ns`: when this landmark fitted last. A tracker that lost its lines for some pictures finds them again under
// each other's numbers, all shifted alike: that is no turn of the robot.
void slam::note_turn(bool fused, double innovation_rad, bool of_print, wm_time_ns last_ns) {
  look_.of_prints = of_print;
  if (!fused && params_.line_rejoin && wm_seconds_between(last_ns, joint_.now_ns()) > kContinuous_s) return;
  if (fused)
    look_.fused++;
  else if (look_.refused < look_record::kMost)
    look_.by_rad[look_.refused++] = innovation_rad;
}

// A look of which most bearings or prints were refused, all by the same turn: the landmarks stand where they stood, the
// robot was turned, by a wheel that slipped or by hand. Its pose is as unsure as that; what is false is not alike.
void slam::begin_look(wm_time_ns t_ns) {
  if (t_ns == look_.t_ns) return;
  end_bearings(t_ns);
  const double least = look_.of_prints ? kPrintTurn_rad : 0.0;
  int most = 0;
  double turn = 0.0;
  for (int i = 0; i < look_.refused; i++) {
    const double by = look_.by_rad[i];
    if (std::fabs(by) < least) continue;
    int alike = 0;
    double sum = 0.0;
    for (int j = 0; j < look_.refused; j++)
      if (std::fabs(look_.by_rad[j] - by) < kAlike * std::fabs(by) + least) {
        alike++;
        sum += look_.by_rad[j];
      }
    if (alike > most) {
      most = alike;
      turn = sum / alike;
    }
  }
  const int seen = look_.fused + look_.refused;
  const bool enough = most >= (look_.of_prints ? kJoltedPrints : kJolted) && 2 * most > seen;
  // In the dark a tracker finds a few of its lines where others are, all shifted alike.
  if (enough && (look_.of_prints || 2 * seen > look_.before)) {
    joint_.loosen(square(kLever_m * turn), square(turn));
    counts_.jolts++;
  }
  look_.before = seen;
  look_.t_ns = t_ns;
  look_.fused = look_.refused = 0;
}

void slam::note_fused(int landmark, int sensor) {
  landmark_note &note = notes()[landmark];
  const wm_time_ns now = joint_.now_ns();
  note.misfits = 0;
  if (!map_is_held()) note.seen++;
  note.last_ns = now;
  note.sensor = sensor;
  fused_ns_ = now;
  if (note.id != rests_on_) rests_on_ = -1;
  if (other_fused_id_[0] != note.id) {
    other_fused_id_[1] = other_fused_id_[0];
    other_fused_ns_[1] = other_fused_ns_[0];
  }
  other_fused_id_[0] = note.id;
  other_fused_ns_[0] = now;
}

// A landmark that doesn't fit again and again, while others do, was moved: it joins anew where it is. One that was
// moved and now is elsewhere again is two of one identity; they are left alone.
void slam::misfit(int landmark, bool ranged) {
  landmark_note &note = notes()[landmark];
  note.misfits++;
  doubt_start(note.misfits);
  if (map_is_held()) return;
  // With a range a single sighting makes a landmark: a misread code, too.
  const bool unconfirmed = ranged && !note.surveyed && note.seen < (uint32_t)params_.confirm_seen;
  if (unconfirmed && note.misfits >= kUnconfirmedMisfits) return drop_landmark(landmark);
  const bool frozen = params_.map == WM_SLAM_MAP_FROZEN;
  if (note.misfits < params_.moved_after || (frozen && moved_.has(note.id))) return;
  for (int i = 0; i < 2; i++) {
    if (other_fused_id_[i] < 0 || other_fused_id_[i] == note.id) continue;
    if (wm_seconds_between(other_fused_ns_[i], joint_.now_ns()) > kOthersFit_s) continue;
    counts_.moved++;
    (moved_.has(note.id) ? doubled_ : moved_).add(note.id);
    if (!frozen) drop_landmark(landmark);
    return;
  }
}

bool slam::doubled(int32_t id, int landmark, int sensor) {
  const bool twice =
      landmark >= 0 && notes()[landmark].last_ns == joint_.now_ns() && notes()[landmark].sensor == sensor;
  if (!twice && !doubled_.has(id)) return false;
  counts_.doubled++;
  return true;
}

}  // namespace wm
