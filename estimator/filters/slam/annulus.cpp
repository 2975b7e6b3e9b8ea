// SPDX-License-Identifier: Apache-2.0
// Landmarks seen by ranges alone. A first range puts a landmark anywhere on a circle about the sensor: a sum of
// Gaussians on it, its members, each with a weight [Blanco2008]. Members are places in the joint state, so that their
// covariance with the robot is exact. While they wait, a range corrects each member with the robot considered
// [Schmidt1966], and its likelihood multiplies the member's weight. Members of little weight leave, those that became
// one are merged, and the last one is a landmark like any other.
#include <utility>

#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// Members of a circle. With a sigma along it of 0.6 of their distance the sum is flat within 0.2 %
// (2 exp(-2 (pi 0.6)^2)), and at one sigma a member's straight axis is off the circle by 0.3 % of the range. 48 to 144
// give the same poses on simulated beacons 5 to 100 m apart.
constexpr int kMembers = 48;
constexpr double kOverlap = 0.6;
// A member is a landmark at 1e-6 of doubt. The innovations of a member share the robot's error, which no update
// removes, so the product of their likelihoods is too sure: at 1e-4, 3 of 90 simulated beacons 100 m apart became their
// mirror image, at 1e-5 and 1e-6 none.
constexpr double kDoubt = 1e-6;
constexpr double kLeastWeight = 1e-8;  // a member below leaves: well below kDoubt
// Members are one within one sigma of the heavier one's covariance, or within four sigmas of a range of it, where
// ranges hardly distinguish the two. At two sigmas, 2 of 30 simulated beacons 5 m apart stayed undecided.
constexpr double kMergeRanges = 4.0;
constexpr double kOutlier = 0.05;        // share of false ranges, as in landmark_evidence
constexpr double kFalseRange_m = 100.0;  // these lie anywhere up to this distance, the reach of radio and sound
constexpr double kLinear = 0.25;         // largest sigma of a landmark's place over its distance; 0.25 to 3 are alike

}  // namespace

wm_verdict slam::follow_annulus(const context &at, const wm_sighting &s, const reading &r) {
  int first = 0;
  while (first < joint_.landmarks() && !(is_member(note(first)) && note(first).id == at.id)) first++;
  if (first == joint_.landmarks()) return begin_annulus(at, s, r);
  weigh_members(at, s, r, first);
  merge_members(at.id, first, square(r.range_sigma_m));
  decide_member(at, first);
  return WM_FUSED;
}

// The member along u: place = sensor + range u. Along u its error is the range's, across it is the sensor's own place
// and the spread along the circle.
wm_verdict slam::begin_annulus(const context &at, const wm_sighting &s, const reading &r) {
  if (joint_.landmarks() + kMembers > joint_.landmark_capacity()) {
    counts_.no_room++;
    return WM_REJECTED_NO_ASSOCIATION;
  }
  const wm_pose2 from = sensor_pose(s.sensor, at.past);
  const double range = distance_of(s);
  if (!(range > kOnSensor_m)) return WM_REJECTED_SINGULAR;
  const sin_cos base = sincos(at.past.pose.heading_rad);
  const double lever[2] = {from.x_m - at.past.pose.x_m, from.y_m - at.past.pose.y_m};
  for (int k = 0; k < kMembers; k++) {
    const sin_cos u = sincos(kTwoPi * k / kMembers);
    const double place[3] = {from.x_m + range * u.cos, from.y_m + range * u.sin, 0.0};
    landmark_rows v;
    const wm_verdict possible = expect_sighting(s, r, at.past, {place[0], place[1], 0.0}, lend(at), &v);
    if (possible != WM_FUSED) continue;  // behind a sensor of depths
    const double by_place = v.by_landmark[0][0] * u.cos + v.by_landmark[0][1] * u.sin;
    const double t[2] = {-u.sin, u.cos};
    const double by[3] = {t[0], t[1], t[1] * lever[0] - t[0] * lever[1]};
    joint_row across;
    add_past_pose(&across, by, at.past, slots_.at(s.sensor, kTimeOffset));
    across.add(slots_.at(s.sensor, kMountX), t[0] * base.cos + t[1] * base.sin);
    across.add(slots_.at(s.sensor, kMountY), t[1] * base.cos - t[0] * base.sin);
    const double along2 = v.noise[0] / square(by_place), across2 = square(kOverlap * kTwoPi * range / kMembers);
    joint_row rows[3];
    double noise[3][3] = {};
    const double axis[2] = {u.cos, u.sin};
    for (int i = 0; i < 2; i++) {
      rows[i].add(v.row[0], -axis[i] / by_place);
      rows[i].add(across, t[i]);
      for (int j = 0; j < 2; j++) noise[i][j] = axis[i] * axis[j] * along2 + t[i] * t[j] * across2;
    }
    noise[2][2] = square(kPi);
    const int member = joint_.add_landmark(rows, noise, place);
    note(member) = note_of(at.id, s.sensor, joint_.now_ns());
    note(member).weight = 1.0 / kMembers;
    members_++;
  }
  return WM_FUSED;
}

// Of a circle: the second derivative across the line of sight adds (P_tt / range)^2 / 2 to the range's
// variance [Julier1997]. P_tt is of the landmark's place in base_link: a turn of the whole map changes no range.
double slam::curvature_variance(const context &at, int landmark, const landmark_rows &v) const {
  const relative_place place = relative_place_of(at, landmark);
  return place.distance_m > kOnSensor_m ? 0.5 * square(place.across_m2 / v.expected[0]) : 0.0;
}

// A range that a member's gate refuses leaves its place; its weight falls to that of a false range.
void slam::weigh_members(const context &at, const wm_sighting &s, const reading &r, int first) {
  double sum = 0.0;
  const int error_state = lend(at);
  for (int i = first; i < joint_.landmarks(); i++) {
    if (!is_member(note(i)) || note(i).id != at.id) continue;
    landmark_rows v;
    double density = 0.0;
    if (expect_sighting(s, r, at.past, pose_of(i), error_state, &v) == WM_FUSED) {
      v.noise[0] += curvature_variance(at, i, v);
      innovation block = prepare(i, &v);
      density = block.density();
      if (gate(block.nis, 1, gates()).passed) joint_.fuse_landmark(i, std::move(block));
    }
    note(i).weight *= (1.0 - kOutlier) * density + kOutlier / kFalseRange_m;
    note(i).last_ns = joint_.now_ns();
    sum += note(i).weight;
  }
  for (int i = first; i < joint_.landmarks(); i++)
    if (is_member(note(i)) && note(i).id == at.id) note(i).weight /= sum;
}

// The lighter of two members that are one leaves. The other one gets its weight, and their difference as covariance.
void slam::merge_members(int32_t id, int first, double range_variance) {
  for (int i = joint_.landmarks() - 1; i >= first; i--) {
    if (!is_member(note(i)) || note(i).id != id) continue;
    bool leaves = note(i).weight < kLeastWeight;
    for (int j = first; j < joint_.landmarks() && !leaves; j++) {
      if (i == j || !is_member(note(j)) || note(j).id != id) continue;
      if (note(j).weight < note(i).weight || (note(j).weight == note(i).weight && j > i)) continue;
      const int a = joint_.landmark_state(i), b = joint_.landmark_state(j);
      const double dx = joint_.value(a) - joint_.value(b), dy = joint_.value(a + 1) - joint_.value(b + 1);
      const double xx = joint_.variance(b), xy = joint_.covariance(b, b + 1), yy = joint_.variance(b + 1);
      const bool near = dx * dx + dy * dy < square(kMergeRanges) * range_variance;
      if (!near && yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy > xx * yy - xy * xy) continue;
      const double share = note(i).weight / (note(i).weight + note(j).weight), d[2] = {dx, dy};
      joint_.widen_landmark(j, d, share);
      note(j).weight += note(i).weight;
      leaves = true;
    }
    if (leaves) drop_landmark(i);
  }
}

// The last member, once its place in base_link (the map's common turn is none of it) is as sure as that of a landmark
// by bearings alone has to be.
void slam::decide_member(const context &at, int first) {
  int best = -1;
  for (int i = first; i < joint_.landmarks(); i++)
    if (is_member(note(i)) && note(i).id == at.id && (best < 0 || note(i).weight > note(best).weight)) best = i;
  if (best < 0 || note(best).weight < 1.0 - kDoubt) return;
  const wm_pose2 from = sensor_pose(at.sensor, at.past), place = pose_of(best);
  const int state = joint_.landmark_state(best);
  joint_row relative[2];
  for (int k = 0; k < 2; k++) {
    relative[k].add(state + k, 1.0);
    relative[k].add(k == 0 ? kX : kY, -1.0);
  }
  relative[0].add(kHeading, place.y_m - from.y_m);
  relative[1].add(kHeading, from.x_m - place.x_m);
  const double xx = joint_.variance_of(relative[0]), yy = joint_.variance_of(relative[1]);
  const double xy = joint_.covariance_of(relative[0], relative[1]);
  const double largest = 0.5 * (xx + yy) + std::sqrt(square(0.5 * (xx - yy)) + square(xy));
  const double distance2 = square(place.x_m - from.x_m) + square(place.y_m - from.y_m);
  if (largest > square(kLinear) * distance2) return;
  for (int i = joint_.landmarks() - 1; i >= first; i--) {
    if (i == best || !is_member(note(i)) || note(i).id != at.id) continue;
    drop_landmark(i);
    if (best == joint_.landmarks()) best = i;  // the last landmark took its place
  }
  members_--;
  const wm_time_ns first_ns = note(best).first_ns;
  note(note_landmark(at.id, best, at.sensor)).first_ns = first_ns;
  life_.fused(joint_.now_ns());
}

}  // namespace wm
