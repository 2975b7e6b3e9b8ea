// SPDX-License-Identifier: Apache-2.0
// A slip that the odometry does not show, noticed by the landmarks that it displaces alike (slip_search.hpp).
#include <utility>

#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {

travelled_pose2 slam::odometry() const { return {joint_.odom(), joint_.travelled_m(), joint_.turned_rad()}; }

// One sighting of a known landmark, before it is fused. True: the pose was wrong and has been corrected, and the
// landmark's index may be another.
bool slam::weigh_slip(int landmark, const context &at, const planar_observation &seen, bool fits) {
  const landmark_note &own = note(landmark);
  if (!params_.recover || rejoins_ || life_.searching() || !is_confirmed(own)) return false;
  if (!finite(seen.bearing_rad) || !finite(seen.range_m)) return false;
  const wm_time_ns now = joint_.now_ns();
  if (fits && !own.surveyed && !slips_.links(own.first_ns, now, odometry())) return false;
  slips_.add(observation_from(landmark, at, seen), !fits, odometry());
  if (fits || !slips_.is_due(now)) return false;
  for (int i = 0; i < slips_.count(); i++) {
    const int known = find_landmark(slips_.at(i).seen.key);
    if (known < 0) return slips_.clear(), false;
    slips_.at(i).state = joint_.landmark_state(known);
  }
  const slip_hypothesis found = slips_.search(joint_, odometry(), params_.consistency == WM_SLAM_INVARIANT);
  if (slips_.decide(found, now)) return take_slip(found), true;
  if (life_.tracking() && slips_.is_convincing(now)) {
    life_.lose(now);
    by_slip_ = true;
  }
  return false;
}

// The pose moves to the hypothesis, with the missed motion's covariance, and its sightings are fused there.
void slam::take_slip(const slip_hypothesis &found) {
  const wm_time_ns now = joint_.now_ns();
  const travelled_pose2 odom = odometry();
  joint_.shift_pose(found.pose, found.missed);
  forget_lines();
  begin_evidence(kOwnFramePrior);
  by_slip_ = false;
  life_.relocalized(now);
  slip_search group = slips_;
  slips_.begin_at(now, odom);
  for (int i = 0; i < group.count(); i++) {
    if (!(found.group >> i & 1u)) continue;
    const slip_rows r = slip_search::rows_of(group.at(i), joint_, joint_.pose(), odom);
    joint_row rows[2];
    for (int k = 0; k < 2; k++)
      for (int j = 0; j < 5; j++) rows[k].add(r.index[j], r.by[k][j]);
    innovation block = joint_.prepare(rows, r.innovation, r.noise, 2);
    if (joint_.fuse(std::move(block), nullptr, scope_now())) note(find_landmark(group.at(i).seen.key)).misfits = 0;
  }
  for (int i = joint_.landmarks() - 1; i >= 0 && found.since_ns != WM_TIME_NONE; i--)
    if (!note(i).surveyed && note(i).first_ns > found.since_ns) drop_landmark(i);
}

}  // namespace wm
