// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "simulate/random.h"
#include "simulate/simulate.h"

namespace wm::sim {

// What the two counted wheels turn: a closed form of way and heading over the true track, so that nothing drifts but
// what the errors make drift; and slip, integrated over the drive.
class Wheels {
 public:
  // `drawn` are the recording's; the drive must be final. 8 bytes a wheel and 10 ms of drive where there is slip.
  Wheels(const Scenario &scenario, const Random &random, const Drive &drive, const Drawn &drawn);
  // Metres of the true rim since the start; side 0 left, 1 right. Backwards counts down.
  double rolled_m(size_t side, double t_s) const;
  // The same in turns, by the wheel's true radius.
  double turns(size_t side, double t_s) const;

 private:
  void slip(const Scenario &scenario, const Random &random);

  const Drive &drive_;
  double track_m_, heading0_rad_, radius_m_[2];
  std::vector<double> slipped_m_[2];  // what slip has added, every kStep_s
};

}  // namespace wm::sim
