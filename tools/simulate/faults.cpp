// SPDX-License-Identifier: Apache-2.0
#include "simulate/faults.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
  fault(sc.faults, random, 0, frames, r.sightings);
  fault(sc.faults, random, 1, frames, r.markers);
  fault(sc.faults, random, 2, frames, r.stereo);
  fault(sc.faults, random, 3, false, r.fixes);
}

}  // namespace wm::sim
