// SPDX-License-Identifier: Apache-2.0
// Numbers of the groups, places, resolutions and signs of their fields: the public documentation of CANboat (PGNs
// 127250, 127251, 128259, 129025, 129026) and Signal K (a rate of turn is positive to starboard). The ids have J1939's
// null address, so that any sender's frames are taken.
#include "init/nmea2000.h"

#include <cstring>

namespace wm::init {
namespace {

const char *const kDbc =
    "VERSION \"\"\n"
    "\n"
    "NS_ :\n"
    "\n"
    "BS_:\n"
    "\n"
    "BU_: SENDER\n"
    "\n"
    "BO_ 2314277630 VESSEL_HEADING: 8 SENDER\n"
    " SG_ HEADING : 8|16@1+ (0.0001,0) [0|6.2832] \"rad\" SENDER\n"
    "\n"
    "BO_ 2314277886 RATE_OF_TURN: 8 SENDER\n"
    " SG_ RATE : 8|32@1- (3.125e-08,0) [-60|60] \"rad/s\" SENDER\n"
    "\n"
    "BO_ 2314535934 WATER_SPEED: 8 SENDER\n"
    " SG_ SPEED : 8|16@1+ (0.01,0) [0|655.32] \"m/s\" SENDER\n"
    "\n"
    "BO_ 2314732030 POSITION_RAPID: 8 SENDER\n"
    " SG_ LATITUDE : 0|32@1- (1e-07,0) [-90|90] \"deg\" SENDER\n"
    " SG_ LONGITUDE : 32|32@1- (1e-07,0) [-180|180] \"deg\" SENDER\n"
    "\n"
    "BO_ 2314732286 COURSE_AND_SPEED: 8 SENDER\n"
    " SG_ COURSE_OVER_GROUND : 16|16@1+ (0.0001,0) [0|6.2832] \"rad\" SENDER\n"
    " SG_ SPEED_OVER_GROUND : 32|16@1+ (0.01,0) [0|655.32] \"m/s\" SENDER\n";

struct Group {
  uint32_t pgn;
  const char *name;
};
const Group kGroups[] = {{127250, "VESSEL_HEADING"},
                         {127251, "RATE_OF_TURN"},
                         {128259, "WATER_SPEED"},
                         {129025, "POSITION_RAPID"},
                         {129026, "COURSE_AND_SPEED"}};

struct Field {
  unsigned quantity;
  const char *message, *signal;
  double score, scale;
  const char *reason;
};
const Field kFields[] = {
    {WM_Q_VEHICLE_SPEED, "WATER_SPEED", "SPEED", 3, 1, "PGN 128259: speed through the water"},
    {WM_Q_VEHICLE_SPEED, "COURSE_AND_SPEED", "SPEED_OVER_GROUND", 2, 1,
     "PGN 129026: the GNSS receiver's speed, never negative"},
    {WM_Q_YAW_RATE, "RATE_OF_TURN", "RATE", 3, -1, "PGN 127251: positive to starboard, turned round"},
    {WM_CAN_LATITUDE, "POSITION_RAPID", "LATITUDE", 3, 1, "PGN 129025"},
    {WM_CAN_LONGITUDE, "POSITION_RAPID", "LONGITUDE", 3, 1, "PGN 129025"},
};

struct Fast {
  uint32_t pgn;
  const char *holds;
};
const Fast kFast[] = {{129029, "GNSS position with its accuracy"}, {129038, "AIS"}, {129540, "satellites in view"}};

// Of a 29-bit id: data page, PDU format and, where it is no destination, PDU specific (SAE J1939-21).
uint32_t pgn_of(uint32_t id) {
  const uint32_t pgn = id >> 8U & 0x3FFFFU;
  return (pgn & 0xFF00U) < 0xF000U ? pgn & 0x3FF00U : pgn;
}

bool has(const wm_can_survey &survey, uint32_t pgn) {
  for (size_t i = 0; i < survey.count; i++)
    if (survey.seen[i].is_extended != 0 && pgn_of(survey.seen[i].id) == pgn) return true;
  return false;
}

}  // namespace

Nmea2000 nmea2000_of(const wm_can_survey &survey) {
  Nmea2000 out;
  for (const Group &group : kGroups)
    if (has(survey, group.pgn)) out.dbc_text = kDbc;
  if (out.dbc_text.empty()) return out;
  const Dbc dbc = parse_dbc(kDbc, "NMEA 2000");
  for (const Field &field : kFields)
    for (size_t i = 0; i < dbc.signals.size(); i++)
      if (std::strcmp(dbc.signals[i].message, field.message) == 0 &&
          std::strcmp(dbc.signals[i].name, field.signal) == 0)
        out.candidates.push_back({.quantity = field.quantity,
                                  .signal = i,
                                  .score = field.score,
                                  .scale = field.scale,
                                  .unit = {},
                                  .reasons = {field.reason},
                                  .refused = {}});
  if (has(survey, 127250))
    out.notes.emplace_back(
        "the heading of PGN 127250: no quantity of the CAN bus takes it; a program that sends it as heading.csv's "
        "stream does (docs/motion-sources.md)");
  for (const Fast &fast : kFast)
    if (has(survey, fast.pgn))
      out.notes.push_back("PGN " + std::to_string(fast.pgn) + " (" + fast.holds +
                          "): it goes over several frames (fast packet), which are not read");
  return out;
}

}  // namespace wm::init
