// SPDX-License-Identifier: Apache-2.0
// Draws for the worlds: one stream of numbers for each part of a world, so that one more carton moves no door.
#pragma once

#include <cstdint>

#include "waymark/random.h"

namespace wm::sim {

// Parts of worlds. The numbers are part of what a seed means: add at the end, never renumber.
enum class Part : uint64_t {
  building = 1,
  doors,
  pillars,
  floor,
  lamps,
  posters,
  clutter,
  people,
  route,
  markers,
  shelves,
  windows,
  houses,
  cars,
  unused,  // keeps the numbers of those below
  relief,
  rocks,
  beacons,
  paint,
};

class Dice {
 public:
  Dice(uint64_t seed, Part part) : stream_{seed, kStreams + static_cast<uint64_t>(part), 0} {}

  // In [low, high).
  double uniform(double low, double high) { return low + (high - low) * wm_random_next_uniform(&stream_); }
  // In [low, high], both included.
  int integer(int low, int high) { return low + static_cast<int>(uniform(0, high - low + 1)); }
  bool chance(double probability) { return uniform(0, 1) < probability; }
  double sign() { return chance(0.5) ? 1 : -1; }
  // Mean 0, standard deviation 1.
  double normal() { return wm_random_next_normal(&stream_); }

 private:
  // Above the streams of the sensors (simulate/random.h), whose numbers have their kind in the upper 32 bits.
  static constexpr uint64_t kStreams = uint64_t{1} << 48;
  wm_random stream_;
};

}  // namespace wm::sim
