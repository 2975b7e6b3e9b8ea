// SPDX-License-Identifier: Apache-2.0
// Lost on a map of coded markers: where the robot is, by two of them or by one that was seen well again and again.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kAgree_m = 0.2;                          // of two markers on how far they are apart
constexpr double kKnown_rad = 0.05;                       // sigma of a heading to begin with
constexpr double kMapped_m = 0.01, kMapped_rad = 0.005;   // what the map adds to a sighting
constexpr double kCarried_m = 0.03, kCarried_rad = 0.02;  // and odometry, to one that was seen from elsewhere
constexpr double kStood_m = 0.02;
constexpr double kNoTurn = 1e6, kThreeSigmas = 9.0;
constexpr double kRough = 2.5;  // a turn that is not to be believed may be off by so many of its sigmas
// One marker alone: the robot is on a circle about it, and its turn says where on that.
constexpr double kAlone_m = 0.1;      // so far along the circle, one sigma
constexpr int kAloneSeen = 3;         // sightings that agree: a code is misread once
constexpr double kDrift_rad = 0.005;  // of the odometry between these, a picture's stamp in a turn included
constexpr int kRefuted = 2;           // sightings of one marker in a row that don't fit

}  // namespace

// Lost on a map. False: not known yet.
bool slam::find_start(int landmark, const wm_marker &m, const marker_reading &r, bool two) {
  const mounted_sensor &sensor = sensor_[m.sensor];
  const double turn_variance =
      two ? kNoTurn : (r.has_heading ? 1.0 : square(kRough)) * r.noise[2] + square(kMapped_rad);
  const seen_marker now = {m.id, r.noise[0] + square(kMapped_m), turn_variance,
                           compose({sensor.x_m, sensor.y_m, sensor.yaw_rad}, {r.level[0], r.level[1], r.yaw_rad}),
                           joint_.odom()};
  if (!start_by_two(landmark, now) && !start_by_one(landmark, m, r, now)) return false;
  take_found();
  return true;
}

// The robot, whose heading this is, sees the marker there. What else it says of the pose is fused after this.
void slam::start_at(const wm_pose2 &marker, const wm_pose2 &seen, double heading_rad) {
  const sin_cos h = sincos(heading_rad);
  const wm_pose2 here = {marker.x_m - h.cos * seen.x_m + h.sin * seen.y_m,
                         marker.y_m - h.sin * seen.x_m - h.cos * seen.y_m, wrap(heading_rad)};
  const double xy = square(kAgree_m), covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, square(kKnown_rad)}};
  joint_.set_pose(here, covariance);
}

// Two different markers of the map that are as far apart as it says tell where the robot is. Its heading is the
// weighted mean of what their places say and what each one's turn says, if these agree. The other marker was seen a
// while ago, and is carried on by the odometry.
bool slam::start_by_two(int landmark, const seen_marker &now) {
  seen_marker before = candidate_;
  candidate_ = now;
  const int earlier = before.id < 0 || before.id == now.id ? -1 : find_landmark((int32_t)before.id);
  if (earlier < 0) return false;
  const wm_pose2 way = between(now.odom, before.odom);
  if (square(way.x_m) + square(way.y_m) > square(kStood_m)) {
    before.variance_m2 += square(kCarried_m);
    before.turn_variance += square(kCarried_rad);
  }
  const wm_pose2 other = compose(way, before.seen), marker = pose_of(landmark), other_marker = pose_of(earlier);
  const double seen[2] = {other.x_m - now.seen.x_m, other.y_m - now.seen.y_m};
  const double mapped[2] = {other_marker.x_m - marker.x_m, other_marker.y_m - marker.y_m};
  const double apart = std::sqrt(square(mapped[0]) + square(mapped[1]));
  if (std::fabs(apart - std::sqrt(square(seen[0]) + square(seen[1]))) > kAgree_m) return false;

  const double says[3] = {atan2(mapped[1], mapped[0]) - atan2(seen[1], seen[0]),
                          marker.heading_rad - now.seen.heading_rad, other_marker.heading_rad - other.heading_rad};
  const auto turn_weight = [this](const seen_marker &sighting, int which) {
    return joint_.variance(joint_.landmark_state(which) + 2) < 1.0 ? 1.0 / sighting.turn_variance : 0.0;
  };
  const double weight[3] = {square(apart) / (now.variance_m2 + before.variance_m2), turn_weight(now, landmark),
                            turn_weight(before, earlier)};
  const double all = weight[0] + weight[1] + weight[2];
  const double first = weight[0] > weight[1] ? says[0] : says[1];
  double heading = first;
  for (int i = 0; i < 3; i++) heading += weight[i] / all * wrap(says[i] - first);
  if (all * square(kKnown_rad) < 1.0 || weight[1] + weight[2] < 1.0) return false;
  for (int i = 0; i < 3; i++)
    if (square(wrap(says[i] - heading)) * weight[i] > kThreeSigmas) return false;
  start_at(marker, now.seen, heading);
  rests_on_ = -1;
  return true;
}

// One marker, whose turn is seen so well that the robot's place is known by it: sightings that agree, carried on by the
// odometry, on where it is and how it is turned. A print's other pose is its mirror image about the line of sight, and
// turns twice as far as that does while the robot drives by; so it drives until that one wouldn't agree any more. Not
// where the map grows: a marker that was moved would spoil it.
bool slam::start_by_one(int landmark, const wm_marker &m, const marker_reading &r, const seen_marker &now) {
  const double turn_variance = r.noise[2] + joint_.variance(joint_.landmark_state(landmark) + 2);
  const double distance2 = square(now.seen.x_m) + square(now.seen.y_m);
  if (params_.map != WM_SLAM_MAP_FROZEN || one_refuted_ || !r.has_heading) return false;
  if (turn_variance * distance2 > square(kAlone_m)) return false;
  const lone_marker one = {m.id,
                           1,
                           compose(now.odom, now.seen),
                           now.odom.heading_rad + sensor_[m.sensor].yaw_rad + atan2(r.along[1], r.along[0]),
                           r.noise[0],
                           r.noise[2]};
  const double dx = one.odom.x_m - lone_.odom.x_m, dy = one.odom.y_m - lone_.odom.y_m;
  const double turn2 = kThreeSigmas * (one.turn_variance + lone_.turn_variance + square(kDrift_rad));
  const bool agree = one.id == lone_.id && square(wrap(one.odom.heading_rad - lone_.odom.heading_rad)) < turn2 &&
                     dx * dx + dy * dy < kThreeSigmas * (one.variance_m2 + lone_.variance_m2 + square(kCarried_m));
  if (!agree) {
    lone_ = one;
    return false;
  }
  const bool mirrored = finite(m.yaw_sigma_rad);  // an upright marker; a level one has no second pose
  if (++lone_.seen < kAloneSeen || (mirrored && square(2.0 * wrap(one.sight_rad - lone_.sight_rad)) < turn2))
    return false;
  const wm_pose2 marker = pose_of(landmark);
  start_at(marker, now.seen, marker.heading_rad - now.seen.heading_rad);
  rests_on_ = m.id;
  return true;
}

// A pose that rests on one marker is none any more where sightings don't fit; from then on it takes two.
void slam::doubt_start(int misfits) {
  if (rests_on_ < 0 || misfits < kRefuted) return;
  rests_on_ = candidate_.id = -1;
  one_refuted_ = true;
  life_.begin(false);
}

}  // namespace wm
