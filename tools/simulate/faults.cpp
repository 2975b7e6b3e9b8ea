// SPDX-License-Identifier: Apache-2.0
#include "simulate/faults.h"

#include <cmath>
#include <utility>

namespace wm::sim {
namespace {

enum { kLost, kDuplicated, kReordered, kLate };

void fault_can(const Faults &f, const Random &random, Recording &r) {
  std::vector<wm_can_frame> kept;
  for (uint64_t i = 0; i < r.can.size(); i++) {
    if (random.uniform(Stream::can_fault, i, kLost) < f.can_lost) continue;
    kept.push_back(r.can[i]);
    if (random.uniform(Stream::can_fault, i, kDuplicated) < f.can_duplicated) kept.push_back(r.can[i]);
  }
  for (uint64_t i = 0; i + 1 < kept.size(); i++) {
    if (random.uniform(Stream::can_fault, i, kReordered) >= f.can_reordered) continue;
    std::swap(kept[i], kept[i + 1]);
    i++;  // a frame changes places once
  }
  r.can = std::move(kept);
}

void fault_sightings(const Faults &f, const Random &random, Recording &r) {
  std::vector<Sighting> kept;
  for (uint64_t i = 0; i < r.sightings.size(); i++) {
    Sighting s = r.sightings[i];
    if (random.uniform(Stream::sighting_fault, i, kLost) < f.sightings_lost) continue;
    // A frame is late as a whole: the draw depends on its stamp and camera.
    if (random.uniform(Stream::frame_fault, static_cast<uint64_t>(s.t_ns), s.sensor) < f.frames_late)
      s.arrival_ns += std::llround(f.frames_late_s * 1e9);
    kept.push_back(s);
    if (random.uniform(Stream::sighting_fault, i, kDuplicated) < f.sightings_duplicated) kept.push_back(s);
  }
  r.sightings = std::move(kept);
}

}  // namespace

void apply_faults(const Scenario &scenario, const Random &random, Recording &recording) {
  fault_can(scenario.faults, random, recording);
  fault_sightings(scenario.faults, random, recording);
}

}  // namespace wm::sim
