// SPDX-License-Identifier: Apache-2.0
#include "simulate/bus.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wm::sim {
namespace {

const std::vector<Message> &messages() {
  static const std::vector<Message> all = {
      {0x120,
       "WHEELS",
       6,
       {{"TICKS_LEFT", 0, 16, true, false, 1, 0, 65535, ""},
        {"TICKS_RIGHT", 16, 16, true, false, 1, 0, 65535, ""},
        {"WH_ALIVE", 40, 8, true, false, 1, 0, 255, ""}}},
      {0x130,
       "INERTIAL",
       4,
       {{"YAW_RATE", 0, 16, true, true, 0.002, -65.536, 65.534, "deg/s"},
        {"IN_ALIVE", 24, 8, true, false, 1, 0, 255, ""}}},
      {0x140,
       "STEERING",
       4,
       {{"ACTUATOR_POSITION", 7, 16, false, false, 0.02, 0, 200, "mm"},
        {"ST_ALIVE", 24, 8, true, false, 1, 0, 255, ""}}},
      {0x150, "DRIVE", 2, {{"GEAR", 0, 4, true, true, 1, -1, 1, ""}, {"DR_ALIVE", 8, 8, true, false, 1, 0, 255, ""}}},
      {0x110,
       "WHEEL_SPEED",
       6,
       {{"WS_REAR_LEFT", 0, 16, true, false, 0.001, 0, 65.535, "m/s"},
        {"WS_REAR_RIGHT", 16, 16, true, false, 0.001, 0, 65.535, "m/s"},
        {"WS_ALIVE", 40, 8, true, false, 1, 0, 255, ""}}},
  };
  return all;
}

// What a message's signals, in their order, mean.
std::vector<wm_quantity> quantities(Bus_message which) {
  switch (which) {
    case Bus_message::wheels: return {WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT};
    case Bus_message::yaw_rate: return {WM_Q_YAW_RATE};
    case Bus_message::steering: return {WM_Q_STEERING_ACTUATOR};
    case Bus_message::gear: return {WM_Q_GEAR};
    case Bus_message::wheel_speeds: return {WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT};
  }
  return {};
}

const char *remark(Bus_message which) {
  switch (which) {
    case Bus_message::wheels:
      return "CM_ SG_ 288 TICKS_LEFT \"Rolling count of the rear left encoder, wraps at 65536, grows forwards.\";\n";
    case Bus_message::yaw_rate: return "";
    case Bus_message::steering:
      return "CM_ SG_ 320 ACTUATOR_POSITION \"Linear actuator of the steering; see steering_table in "
             "calibration.yaml.\";\n";
    case Bus_message::gear: return "VAL_ 336 GEAR -1 \"reverse\" 0 \"neutral\" 1 \"forward\" ;\n";
    case Bus_message::wheel_speeds:
      return "CM_ SG_ 272 WS_REAR_LEFT \"Magnitude only; the direction is GEAR in DRIVE.\";\n";
  }
  return "";
}

// Bit i (from the least significant) of a signal is bit `at(i)` of the frame, counted as the DBC counts.
int bit_of(const Signal &s, int i) {
  if (s.intel) return s.start + i;
  int at = s.start;  // the most significant bit; downwards in its byte, then on to the next byte's top
  for (int k = s.length - 1; k > i; k--) at = at % 8 == 0 ? at + 15 : at - 1;
  return at;
}

}  // namespace

const Message &message(Bus_message which) { return messages()[static_cast<size_t>(which)]; }

Messages car_messages() {
  return {Bus_message::wheels, Bus_message::yaw_rate, Bus_message::steering, Bus_message::gear};
}

std::string dbc_text(const Messages &sent) {
  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: CAR WAYMARK\n", remarks;
  char line[256];
  for (const Bus_message which : sent) {
    const Message &m = message(which);
    std::snprintf(line, sizeof line, "\nBO_ %u %s: %d CAR\n", m.id, m.name, m.length);
    text += line;
    for (const Signal &s : m.signals) {
      std::snprintf(line, sizeof line, " SG_ %s : %d|%d@%d%c (%.12g,0) [%.12g|%.12g] \"%s\" WAYMARK\n", s.name, s.start,
                    s.length, s.intel ? 1 : 0, s.is_signed ? '-' : '+', s.factor, s.min, s.max, s.unit);
      text += line;
    }
    remarks += remark(which);
  }
  return text + "\n" + remarks;
}

std::vector<wm_can_binding> bindings(const Messages &sent) {
  std::vector<wm_can_binding> all;
  for (const Bus_message which : sent) {
    size_t signal = 0;
    for (const wm_quantity quantity : quantities(which)) {
      wm_can_binding b{};
      b.quantity = quantity;
      std::snprintf(b.message, sizeof b.message, "%s", message(which).name);
      std::snprintf(b.signal[0], sizeof b.signal[0], "%s", message(which).signals[signal++].name);
      b.signal_count = 1;
      b.scale = 1;
      all.push_back(b);
    }
  }
  return all;
}

std::string can_signals_text(const Messages &sent) {
  std::string text;
  for (const wm_can_binding &b : bindings(sent))
    text += std::string("- quantity: ") + wm_quantity_name(static_cast<unsigned>(b.quantity)) +
            "\n  message: " + b.message + "\n  signal: " + b.signal[0] + "\n";
  return text;
}

void pack(const Signal &s, double physical, wm_can_frame &frame) {
  pack_count(s, std::llround(std::clamp(physical, s.min, s.max) / s.factor), frame);
}

void pack_count(const Signal &s, int64_t count, wm_can_frame &frame) {
  const uint64_t raw = static_cast<uint64_t>(count);  // two's complement; what doesn't fit is cut off
  for (int i = 0; i < s.length; i++) {
    const int at = bit_of(s, i);
    const uint8_t mask = static_cast<uint8_t>(1u << at % 8);
    if (raw >> i & 1) frame.data[at / 8] = static_cast<uint8_t>(frame.data[at / 8] | mask);
  }
}

}  // namespace wm::sim
