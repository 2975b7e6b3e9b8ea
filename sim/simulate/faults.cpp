// SPDX-License-Identifier: Apache-2.0
#include "simulate/faults.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "simulate/angle.h"
#include "simulate/features.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

enum { kLost, kDuplicated, kReordered, kLate };

// Features that were seen right. `list` tells apart the lists, so that each draws for itself; `frames`: they come as
// camera frames do, and are late as these.
template <class Seen>
void fault(const Faults &f, const Random &random, uint64_t list, bool frames, std::vector<Seen> &all) {
  const uint64_t base = list * 16;
  std::vector<Seen> kept;
  kept.reserve(all.size());
  for (uint64_t i = 0; i < all.size(); i++) {
    Seen s = all[i];
    if (random.uniform(Stream::sighting_fault, i, base + kLost) < f.sightings_lost) continue;
    // A frame is late as a whole: the draw depends on its stamp and sensor.
    if (frames && random.uniform(Stream::frame_fault, static_cast<uint64_t>(s.t_ns), s.sensor) < f.frames_late)
      s.arrival_ns += std::llround(f.frames_late_s * 1e9);
    kept.push_back(s);
    if (random.uniform(Stream::sighting_fault, i, base + kDuplicated) < f.sightings_duplicated) kept.push_back(s);
  }
  std::stable_sort(kept.begin(), kept.end(), [](const Seen &a, const Seen &b) { return a.arrival_ns < b.arrival_ns; });
  all = std::move(kept);
}

double field_of_view_of(const Scenario &sc, uint16_t sensor) {
  if (sensor < sc.cameras.size()) return sc.cameras[sensor].field_of_view_rad;
  for (size_t i = 0; i < sc.sensors.size(); i++)
    if (sc.sensors[i].kind == Sensor::Kind::landmarks && sensor_index(sc, i) == sensor)
      return sc.sensors[i].field_of_view_rad;
  return 2 * kPi;
}

// Detectors err: one landmark is taken for another, and what is none at all for one of the map.
void mistake(const Scenario &sc, const Random &random, Recording &r) {
  const Faults &f = sc.faults;
  if (r.map.empty() || (f.sightings_misread <= 0 && f.sightings_false <= 0)) return;
  const double added = f.sightings_false / (1 - f.sightings_false);  // to each right one, so that of all it is that
  const auto any_id = [&](double u, int32_t but) {
    const auto n = static_cast<double>(r.map.size());
    const auto i = static_cast<size_t>(u * n);
    return r.map[i].id != but ? r.map[i].id : r.map[(i + 1) % r.map.size()].id;
  };
  std::vector<Sighting> all;
  for (uint64_t i = 0; i < r.sightings.size(); i++) {
    Sighting s = r.sightings[i];
    const auto draw = [&](Stream stream, uint64_t sub) { return random.uniform(stream, i, sub); };
    if (s.id != kNorthId && draw(Stream::sighting_misread, 0) < f.sightings_misread) {
      s.id = any_id(draw(Stream::sighting_misread, 1), s.id);
      s.outlier = true;
    }
    all.push_back(s);
    if (std::isnan(s.bearing_rad)) continue;
    for (double left = added; left > 0; left -= 1) {
      const auto sub = static_cast<uint64_t>(4 * (added - left) + 0.5);
      if (draw(Stream::sighting_false, sub) >= left) continue;
      Sighting nothing = s;
      nothing.id = any_id(draw(Stream::sighting_false, sub + 1), -1);
      nothing.bearing_rad = (draw(Stream::sighting_false, sub + 2) - 0.5) * field_of_view_of(sc, s.sensor);
      nothing.elevation_rad = (draw(Stream::sighting_false, sub + 3) - 0.5) * 0.3;
      nothing.outlier = true;
      all.push_back(nothing);
    }
  }
  r.sightings = std::move(all);
}

}  // namespace

void fault_can(const Faults &f, const Random &random, std::vector<wm_can_frame> &frames) {
  // candump stamps what it receives: a frame that waits on the bus says what was true before its stamp.
  if (f.can_late > 0) {
    for (uint64_t i = 0; i < frames.size(); i++)
      if (random.uniform(Stream::can_fault, i, kLate) < f.can_late)
        frames[i].t_ns += std::llround(f.can_late_s * 1e6) * WM_NS_PER_US;
    std::stable_sort(frames.begin(), frames.end(),
                     [](const wm_can_frame &a, const wm_can_frame &b) { return a.t_ns < b.t_ns; });
  }
  std::vector<wm_can_frame> kept;
  for (uint64_t i = 0; i < frames.size(); i++) {
    if (random.uniform(Stream::can_fault, i, kLost) < f.can_lost) continue;
    kept.push_back(frames[i]);
    if (random.uniform(Stream::can_fault, i, kDuplicated) < f.can_duplicated) kept.push_back(frames[i]);
  }
  for (uint64_t i = 0; i + 1 < kept.size(); i++) {
    if (random.uniform(Stream::can_fault, i, kReordered) >= f.can_reordered) continue;
    std::swap(kept[i], kept[i + 1]);
    i++;  // a frame changes places once
  }
  frames = std::move(kept);
}

void settle(const Scenario &sc, Recording &r) {
  const Random random(r.seed);
  const bool frames = !sc.world.pictured();  // pictures have been late already
  mistake(sc, random, r);
  fault(sc.faults, random, 0, frames, r.sightings);
  fault(sc.faults, random, 1, frames, r.markers);
  fault(sc.faults, random, 2, frames, r.stereo);
  fault(sc.faults, random, 3, false, r.fixes);
  fault(sc.faults, random, 4, frames, r.edges);
}

void move_landmarks(const Scenario &sc, Recording &r) {
  const Random random(r.seed);
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = 0; i < r.map.size(); i++) order.emplace_back(random.uniform(Stream::landmark_moved, i, 0), i);
  std::sort(order.begin(), order.end());
  const size_t count = std::min(order.size(), static_cast<size_t>(sc.faults.landmarks_moved));
  for (size_t k = 0; k < count; k++) {
    const size_t i = order[k].second;
    const double direction = 2 * kPi * random.uniform(Stream::landmark_moved, i, 1);
    r.map[i].p_m[0] += sc.faults.landmarks_moved_m * wm::cos(direction);
    r.map[i].p_m[1] += sc.faults.landmarks_moved_m * wm::sin(direction);
    r.moved.push_back(r.map[i].id);
  }
}

}  // namespace wm::sim
