// SPDX-License-Identifier: Apache-2.0
// The kidnapped robot among lines without identity (lines.rejoin): the share of a picture's bearings that the map
// explains is compared with the usual share of this drive and with chance. Lost, the pose is found by their pattern
// (relocalize/line_search.hpp).
#include "filters/core/evidence.hpp"
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// Chosen on loops-lines (seeds 1 to 6), checked on hall-a and hall-hard 1 to 5; not swept.
constexpr int kFewest = 6;              // bearings of a picture; fewer have no pattern
constexpr double kPrior = -6.0;         // log odds of being kidnapped at any time
constexpr double kDoubt = -4.0;         // log odds above which a picture neither is usual nor counts as a fit
constexpr double kLost = 1.0;           // log odds from which the state is LOST: 73 %
constexpr double kMemory_s = 5.0;       // of the evidence
constexpr double kInformative = 0.3;    // usual less chance: a map as dense as its gates are wide explains any picture
constexpr double kMaxBayes = 1.5;       // nats a picture: bearings are wrong together where something stands in the way
constexpr double kUsual_s = 20.0;       // memory of the share that is usual
constexpr double kMostUsual = 0.9;      // new lines come into view
constexpr double kMostChance = 0.8;     // of a bearing to be explained by chance
constexpr double kBearing_rad = 0.005;  // of a bearing and of a landmark's place, seen from kTypical_m
constexpr double kTypical_m = 4.0;      // distance of a landmark
constexpr double kRange_m = 12.0;       // landmarks farther away are rarely detected
constexpr double kSigmas = 3.0, kWidest_rad = 0.15;  // of the gate

}  // namespace

// A bearing of the newest picture, of the sensor that was first in it.
void slam::collect_bearing(const wm_sighting &s, const past_pose &past) {
  if (bearings_.count == 0) {
    const wm_pose2 from = sensor_pose(s.sensor, past);
    bearings_.sensor = between(past.pose, from);
    bearings_odom_ = compose(joint_.odom(), between(joint_.pose(), past.pose));
    bearings_sensor_ = s.sensor;
  }
  if (bearings_.count < bearing_look::kCapacity && s.sensor == bearings_sensor_)
    bearings_.bearing_rad[bearings_.count++] = s.bearing_rad;
}

// The picture is complete: evidence for or against the pose, or a share of the search.
void slam::end_bearings(wm_time_ns t_ns) {
  if (bearings_.count >= kFewest && params_.recover && rejoins_) {
    if (life_.tracking())
      weigh_pattern(t_ns);
    else
      search_pattern();
  }
  bearings_.count = 0;
}

void slam::weigh_pattern(wm_time_ns t_ns) {
  const double dt = pattern_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(pattern_ns_, t_ns);
  pattern_ns_ = t_ns;
  const wm_pose2 then = compose(joint_.pose(), between(joint_.odom(), bearings_odom_));
  const double spread = square(kBearing_rad) + joint_.variance(kHeading) +
                        (joint_.variance(kX) + joint_.variance(kY)) / square(kTypical_m);
  const double gate = kSigmas * std::sqrt(spread) < kWidest_rad ? kSigmas * std::sqrt(spread) : kWidest_rad;
  const landmark_places map = joint_.places();
  int near = 0;
  for (int i = 0; i < map.count; i++)
    near += square(map.data[i * map.stride] - then.x_m) + square(map.data[i * map.stride + 1] - then.y_m) <
            square(kRange_m);
  const double covered = near * 2.0 * gate / kTwoPi, chance = covered < kMostChance ? covered : kMostChance;
  const int explained = line_search::explained(bearings_, then, map, gate);
  const double share = (double)explained / bearings_.count;
  const double usual = usual_share_ < kMostUsual ? usual_share_ : kMostUsual;
  pattern_odds_.forget(dt, kMemory_s, kPrior);
  if (usual > chance + kInformative && chance > 0.0) {
    const double log_bayes =
        explained * log(chance / usual) + (bearings_.count - explained) * log((1.0 - chance) / (1.0 - usual));
    pattern_odds_.add(log_bayes > kMaxBayes ? kMaxBayes : log_bayes < -kMaxBayes ? -kMaxBayes : log_bayes);
  }
  if (pattern_odds_.value() > kLost) return lose();
  if (pattern_odds_.value() > kDoubt) return;
  fit_ns_ = t_ns;
  usual_share_ += (dt < kUsual_s ? dt / kUsual_s : 1.0) * (share - usual_share_);
}

// The calibration is not rolled back: without its correlations with the map the covariance becomes too small
// (loops-lines, 8 pushes: NEES inside 95 % 0.90 instead of 0.96).
void slam::search_pattern() {
  const line_search_result found = line_search_.step(bearings_, bearings_odom_, joint_.places());
  if (!found.found) return;
  joint_.set_pose(compose(found.pose, between(bearings_odom_, joint_.odom())), found.covariance);
  localizer_.release();
  take_found(kOwnFramePrior);  // no identity proves a pose found by a pattern
}

}  // namespace wm
