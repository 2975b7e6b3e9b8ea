// SPDX-License-Identifier: Apache-2.0
// The car's CAN bus: one table of messages and signals, from which both the DBC's text and the frames are made.
#pragma once

#include <string>
#include <vector>

#include "waymark/can.h"

namespace wm::sim {

struct Signal {
  const char *name;
  int start, length;  // as in a DBC: the least significant bit (Intel) or the most significant one (Motorola)
  bool intel, is_signed;
  double factor, min, max;  // physical = factor * raw; no offset
  const char *unit;
};

struct Message {
  uint32_t id;
  const char *name;
  int length;
  std::vector<Signal> signals;  // the last one is the alive counter
  size_t counter() const { return signals.size() - 1; }
};

enum class Bus_message { wheels, yaw_rate, steering, gear, wheel_speeds };

const Message &message(Bus_message which);

// Which messages a bus has.
using Messages = std::vector<Bus_message>;
Messages car_messages();  // with rolling counts

// Text of vehicle.dbc; what binds its signals to quantities, and the same as text of can-signals.yaml.
std::string dbc_text(const Messages &sent = car_messages());
std::vector<wm_can_binding> bindings(const Messages &sent = car_messages());
std::string can_signals_text(const Messages &sent = car_messages());

// Writes a physical value, rounded and limited to the signal's range (a sensor saturates), into the frame's bits.
void pack(const Signal &signal, double physical, wm_can_frame &frame);
// The same for a raw count, modulo its width.
void pack_count(const Signal &signal, int64_t count, wm_can_frame &frame);

}  // namespace wm::sim
