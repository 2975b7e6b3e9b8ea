// SPDX-License-Identifier: Apache-2.0
// The public parameter groups of NMEA 2000 that a robot is localized by: a boat's log needs no DBC file.
#pragma once

#include <string>
#include <vector>

#include "init/proposals.h"

namespace wm::init {

// What a log has of them. Groups of one frame only: those of several (fast packets) are not read.
struct Nmea2000 {
  std::string dbc_text;               // "": none of them is in the log
  std::vector<Candidate> candidates;  // by index into the DBC's signals
  std::vector<std::string> notes;     // what is in the log and not bound
};
Nmea2000 nmea2000_of(const wm_can_survey &survey);

}  // namespace wm::init
