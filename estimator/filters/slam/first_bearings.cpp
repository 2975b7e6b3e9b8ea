// SPDX-License-Identifier: Apache-2.0
// A tracker's line may go over to another edge. Where the pose is uncertain, as between two pictures of wheels that
// slip, the first bearing of a picture passes any gate and turns the robot; then all others are rejected. So it waits
// until another one of the picture agrees with it: a joint compatibility test of pairs [Neira2001].

#include "filters/slam/slam.hpp"

namespace wm {
namespace {

// Variance of an innovation over the bearing's own above which a wrong bearing can turn the robot far: four sigmas
// wide. By default with 4, 6, 9, 12, 16, 25: loops-lines (7 seeds) 0.016, 0.014, 0.014, 0.015, 0.018, 0.028 m, hall-a
// 0.0035 m up to 9, 0.0034 and 0.0060 m; by hall.yaml hall-a 0.0050, 0.0046, 0.0045 m with 9, 16, 25.
constexpr double kByPose = 16.0;
// Of an innovation's variance, what another one leaves: more is the landmark's own, which does not concern the pose.
// Not swept.
constexpr double kShared = 0.5;

}  // namespace

// True: it is taken later, with the one that agrees. Of `kCapacity` that all contradict each other none is better.
bool slam::waits_for_another(const context &at, const line_bearing &seen, const landmark_rows &v,
                             const innovation &block) {
  const double variance = block.s[0][0];
  if (!rejoins_ || first_.settled || !sees_many() || !life_.tracking()) return false;
  if (variance < kByPose * v.noise[0] || v.row[0].missing > 0) return false;
  const double soft = sightings().gate_soft * gate_scale(1);
  bool tells = first_.count == 0;
  for (int i = 0; i < first_.count && !first_.settled; i++) {
    const first_bearings::one &other = first_.waiting[i];
    const double gain = joint_.covariance_of(v.row[0], other.row) / other.variance;
    const double left = variance - square(gain) * other.variance;
    if (left > kShared * variance) continue;
    tells = true;
    first_.settled = square(v.innovation[0] - gain * other.innovation) < soft * left;
  }
  if (first_.settled || !tells) return false;
  if (first_.count == first_bearings::kCapacity) {
    first_.settled = 1;
    return false;
  }
  first_bearings::one &next = first_.waiting[first_.count++];
  next.id = at.id;
  next.sensor = at.sensor;
  next.bearing_rad = seen.bearing_rad;
  next.given_sigma_rad = seen.given_sigma_rad;
  next.innovation = v.innovation[0];
  next.variance = variance;
  next.row.count = next.row.missing = 0;
  next.row.add(v.row[0], 1.0);
  return true;
}

// Those that waited go through the gates that the newest one has narrowed.
void slam::take_waiting(const context &newest) {
  if (!first_.settled) return;
  const int count = first_.count;
  first_.count = 0;
  for (int i = 0; i < count; i++) {
    const first_bearings::one &one = first_.waiting[i];
    wm_sighting s = wm_sighting_without_numbers();
    s.sensor = static_cast<uint16_t>(one.sensor);
    s.landmark_id = one.id;
    s.bearing_rad = one.bearing_rad;
    s.bearing_sigma_rad = one.given_sigma_rad;
    context at = newest;
    at.sensor = one.sensor;
    at.id = at.record.landmark_id = one.id;
    at.record.sensor = s.sensor;
    at.record.observed = one.bearing_rad;
    at.past = look_back(one.sensor);
    (void)take_sighting(at, s, reading_of(s), find_landmark(one.id));
  }
}

}  // namespace wm
