// SPDX-License-Identifier: Apache-2.0
#include "init/proposals.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <set>

#include "common/failure.h"
#include "init/text_file.h"

namespace wm::init {
namespace {

using Words = std::vector<std::string>;

// A name has a word of a list: equal to it, or, where that ends in '*', beginning with it.
bool has(const Words &words, const std::vector<std::string> &list) {
  for (const std::string &word : words)
    for (const std::string &one : list) {
      const bool open = one.ends_with('*');
      if (open ? word.starts_with(one.substr(0, one.size() - 1)) : word == one) return true;
    }
  return false;
}

const std::vector<std::string> kWheel{"WHEEL*", "WHL*", "WSS", "WS", "RAD", "RADGESCHW*", "TIRE", "TYRE"};
const std::vector<std::string> kSpeed{"SPEED*", "SPD*", "VEL", "VELOCITY", "GESCHW*", "RADGESCHW*",
                                      "V",      "WSS",  "WS",  "KPH",      "KMH"};
const std::vector<std::string> kCount{"TICK*", "PULS*", "COUNT*", "CNT", "IMP*", "ENC*", "ODO*"};
// What is wanted, limited, shown or checked is not what is measured.
const std::vector<std::string> kNotMeasured{
    "SET",    "CRUISE",    "TARGET", "TGT",     "DES*",    "REQ*",     "CMD*",   "COMMAND*", "LEAD",  "REL",
    "LIMIT*", "LIM",       "MAX",    "MIN",     "FAN",     "FAULT",    "VALID*", "QF",       "STAT*", "ERR*",
    "OFFSET", "BIAS",      "UI",     "DISP*",   "CLUSTER", "CHECKSUM", "CRC",    "TORQUE*",  "INIT*", "LOCKOUT",
    "ADAS",   "DIRECTION", "DIR",    "ENGINE*", "ENG",     "RPM",      "PREV*",  "GRA",      "WISH*", "SOLL"};
// A copy in a display, or an assistant's own.
const std::vector<std::string> kSecondHand{"HUD",  "DSU",  "ACC",   "PCM",    "CAM",   "IPAS",
                                           "LKAS", "DASH", "METER", "COMBI*", "HYBRID"};

struct Corner {
  unsigned quantity;
  std::vector<std::string> is;
  const char *front, *side;
};
const std::vector<Corner> kCorners{
    {WM_Q_WHEEL_SPEED_FRONT_LEFT, {"FL", "LF", "VL"}, "FRONT", "LEFT"},
    {WM_Q_WHEEL_SPEED_FRONT_RIGHT, {"FR", "RF", "VR"}, "FRONT", "RIGHT"},
    {WM_Q_WHEEL_SPEED_REAR_LEFT, {"RL", "LR", "HL", "BL"}, "REAR", "LEFT"},
    {WM_Q_WHEEL_SPEED_REAR_RIGHT, {"RR", "HR", "BR"}, "REAR", "RIGHT"},
};

// "WHLFL" and "LFWHEEL": the corner is what remains without the other words.
Words without_wheel(Words words) {
  for (std::string &word : words)
    for (const char *other : {"WHEEL", "WHL", "SPEED", "SPD", "VEL"})
      if (const size_t at = word.find(other); at != std::string::npos && word.size() > std::string(other).size())
        word.erase(at, std::string(other).size());
  return words;
}

bool is_corner(const Words &words, const Corner &corner) {
  if (has(words, corner.is)) return true;
  const std::string front = std::string(corner.front) == "REAR" ? "BACK" : corner.front;
  const bool end = has(words, {corner.front, front}), side = has(words, {corner.side});
  return end && side;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

// The range that the DBC states, where it does, else that of the bits; in the DBC's unit.
std::pair<double, double> range_of(const init_signal &s) {
  return s.max > s.min ? std::pair(std::max(s.min, s.lowest), std::min(s.max, s.highest))
                       : std::pair(s.lowest, s.highest);
}

class Finder {
 public:
  explicit Finder(const Dbc &dbc) : dbc_(dbc) {}

  std::vector<Candidate> all() {
    for (at_ = 0; at_ < dbc_.signals.size(); at_++) {
      name_ = words_of(signal().name);
      both_ = words_of(signal().message);
      both_.insert(both_.end(), name_.begin(), name_.end());
      if (has(name_, kNotMeasured)) continue;
      corner_speeds();
      ticks();
      vehicle_speed();
      yaw_rate();
      steering();
      gear();
      gnss();
    }
    std::stable_sort(out_.begin(), out_.end(), [](const Candidate &a, const Candidate &b) {
      return a.quantity != b.quantity ? a.quantity < b.quantity : a.score > b.score;
    });
    return std::move(out_);
  }

 private:
  [[nodiscard]] const init_signal &signal() const { return dbc_.signals[at_]; }

  // `widest_si`: the least span of values, in SI, that the quantity needs.
  void add(unsigned quantity, double score, const std::string &why, init_dimension dimension, double widest_si,
           bool both_signs) {
    const init_signal &s = signal();
    Candidate out{.quantity = quantity, .signal = at_, .score = score, .unit = {}, .reasons = {why}, .refused = {}};
    if (has(both_, kSecondHand)) out.score -= 2;
    if (dimension != INIT_NO_UNIT && s.dimension == dimension) {
      out.score += 2;
      out.reasons.push_back("in " + std::string(s.unit));
    } else if (dimension != INIT_NO_UNIT) {
      out.score -= 2;
      out.refused = s.unit[0] != '\0' ? "its unit '" + std::string(s.unit) + "' is none of this quantity"
                                      : std::string("it has no unit");
    }
    const auto [low, high] = range_of(s);
    const auto [widest_low, widest_high] = std::pair(s.lowest, s.highest);
    if (dimension != INIT_NO_UNIT) {
      out.reasons.push_back(short_number(low) + " to " + short_number(high));
      if (out.refused.empty() && (widest_high - widest_low) * s.si < widest_si)
        out.refused = "its range, " + short_number(widest_low) + " to " + short_number(widest_high) + " " + s.unit +
                      ", is too small";
      if (both_signs && widest_low >= 0) out.score -= 1.5;
    }
    if (!s.is_usable) out.refused = "it does not fit into its message, or its multiplexer is not stated";
    out_.push_back(out);
  }

  void corner_speeds() {
    const Words words = without_wheel(name_);
    if (!has(both_, kWheel) || !(has(both_, kSpeed) || signal().dimension == INIT_SPEED) || has(name_, kCount)) return;
    for (const Corner &corner : kCorners)
      if (is_corner(words, corner)) {
        add(corner.quantity, 3, "a wheel's speed by its name", INIT_SPEED, 2, false);
        return;
      }
  }

  void ticks() {
    const init_signal &s = signal();
    if (!has(name_, kCount) || s.is_float || s.bits < 4 || s.dimension == INIT_SPEED ||
        s.dimension == INIT_ANGULAR_RATE || s.dimension == INIT_LENGTH)
      return;
    const Words words = without_wheel(name_);
    if (!has(both_, kWheel) && !has(name_, {"TICK*", "ENC*", "ODO*"})) return;
    const bool front = has(words, {"FL", "FR", "LF", "RF", "VL", "VR", "FRONT"});
    const double score = 3 - (front ? 1 : 0);  // steered wheels roll farther than base_link
    if (has(words, {"LEFT", "L", "RL", "LR", "HL", "BL", "FL", "LF", "VL"}))
      add(WM_Q_WHEEL_TICKS_LEFT, score, "counts of a left wheel by its name", INIT_NO_UNIT, 0, false);
    else if (has(words, {"RIGHT", "R", "RR", "HR", "BR", "FR", "RF", "VR"}))
      add(WM_Q_WHEEL_TICKS_RIGHT, score, "counts of a right wheel by its name", INIT_NO_UNIT, 0, false);
  }

  void vehicle_speed() {
    if (signal().dimension != INIT_SPEED && !has(name_, kSpeed)) return;
    if (signal().dimension != INIT_SPEED && signal().dimension != INIT_NO_UNIT) return;
    const bool of_wheel =
        has(both_, kWheel) && !has(name_, {"BASED"});  // J1939's is a vehicle's: WheelBasedVehicleSpeed
    if (of_wheel || !has(name_, kSpeed) || has(name_, {"ANG*", "YAW*", "STEER*", "LAT*", "WIND", "Z", "Y"})) return;
    const bool plain = has(both_, {"VEHICLE*", "VEH*", "CAR", "ROBOT", "ODOM*", "FORWARD*"}) || name_.size() == 1;
    add(WM_Q_VEHICLE_SPEED, plain ? 3 : 2, "a speed by its name", INIT_SPEED, 2, false);
  }

  void yaw_rate() {
    const bool yaw = has(name_, {"YAW*", "GIER*"});
    const bool z =
        has(both_, {"GYRO*", "ANG*", "OMEGA*", "TURN*", "ROT*"}) && has(name_, {"Z", "WZ", "RATE", "YAW*", "TURN*"});
    if (!yaw && !z) return;
    if (has(name_, {"ACC*", "ANGLE", "MOMENT", "ROLL*", "PITCH*"}) || has(both_, {"STEER*"})) return;
    if (signal().dimension == INIT_ANGLE && !has(name_, {"RATE*", "GESCHW*"})) return;
    add(WM_Q_YAW_RATE, yaw ? 3 : 2, "a turn rate by its name", INIT_ANGULAR_RATE, 0.2, true);
  }

  void steering() {
    if (!has(both_, {"STEER*", "STRG*", "SAS*", "LENK*", "LRW", "SWA"})) return;
    if (!has(name_, {"ANGLE*", "ANG", "WINKEL*", "SWA", "LENKWINKEL*", "POSITION", "POS"})) return;
    if (has(name_, {"RATE*", "SPEED*", "SPD*", "VEL*", "GESCHW*", "FRACTION", "MOTOR", "MOT", "SIGN"})) return;
    if (has(both_, {"ROAD", "TIRE", "TYRE"}))
      add(WM_Q_ROAD_WHEEL, 3, "the road wheels' angle by its name", INIT_ANGLE, 0.2, true);
    else
      add(WM_Q_STEERING_WHEEL, 3, "the steering wheel's angle by its name", INIT_ANGLE, 0.5, true);
  }

  void gear() {
    const init_signal &s = signal();
    if (!has(name_, {"GEAR*", "PRND*", "SHIFT*", "GANG*", "SELECTOR"})) return;
    if (s.is_float || s.forwards == 0 || s.backwards == 0) return;
    add(WM_Q_GEAR, 3, "a gear by its name; its values are named forwards and backwards", INIT_NO_UNIT, 0, false);
  }

  void gnss() {
    const bool gps = has(both_, {"GPS*", "GNSS*", "LATITUDE*", "LONGITUDE*", "INS*", "POSITION*"});
    if (!gps) return;
    if (has(name_, {"LATITUDE*", "LAT"})) add(WM_CAN_LATITUDE, 3, "a latitude by its name", INIT_ANGLE, 1, false);
    if (has(name_, {"LONGITUDE*", "LON", "LONG", "LNG"}))
      add(WM_CAN_LONGITUDE, 3, "a longitude by its name", INIT_ANGLE, 1, false);
    if (has(name_, {"ALTITUDE*", "ALT"})) add(WM_CAN_ALTITUDE, 3, "an altitude by its name", INIT_LENGTH, 100, false);
  }

  const Dbc &dbc_;
  size_t at_ = 0;
  Words name_, both_;  // words of the signal's name; those of its message before them
  std::vector<Candidate> out_;
};

}  // namespace

std::string joined(const std::vector<std::string> &texts) {
  std::string out;
  for (const std::string &text : texts) out += (out.empty() ? "" : "; ") + text;
  return out;
}

namespace {

Dbc listed(wm_dbc *file, const std::filesystem::path &path) {
  Dbc out;
  out.path = path;
  out.file.reset(file);
  out.signals.resize(init_dbc_signals(file, nullptr, 0));
  (void)init_dbc_signals(file, out.signals.data(), out.signals.size());
  if (out.signals.empty()) throw tools::Failure(path.string() + ": has no signals (SG_ lines)");
  return out;
}

}  // namespace

Dbc read_dbc(const std::filesystem::path &path) {
  wm_dbc *file = nullptr;
  wm_error error{};
  if (wm_dbc_load(path.c_str(), &file, &error) != WM_OK) throw tools::Failure(error.text);
  return listed(file, path);
}

Dbc parse_dbc(const std::string &text, const std::string &name) {
  wm_dbc *file = nullptr;
  wm_error error{};
  if (wm_dbc_parse(text.data(), text.size(), name.c_str(), &file, &error) != WM_OK) throw tools::Failure(error.text);
  return listed(file, name);
}

std::vector<std::string> words_of(const std::string &name) {
  std::vector<std::string> out;
  char before = '_';
  for (size_t i = 0; i < name.size(); i++) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool letter = std::isalpha(c) != 0, digit = std::isdigit(c) != 0;
    const bool lower_next = i + 1 < name.size() && std::islower(static_cast<unsigned char>(name[i + 1])) != 0;
    const auto last = static_cast<unsigned char>(before);
    const bool starts = (letter && std::isalpha(last) == 0) || (digit && std::isdigit(last) == 0) ||
                        (std::isupper(c) != 0 && (std::islower(last) != 0 || (std::isupper(last) != 0 && lower_next)));
    if (letter || digit) {
      if (starts || out.empty()) out.emplace_back();
      out.back() += static_cast<char>(std::toupper(c));
    }
    before = name[i];
  }
  return out;
}

std::vector<Candidate> name_candidates(const Dbc &dbc) { return Finder(dbc).all(); }

std::vector<Candidate> choose(const std::vector<Candidate> &candidates) {
  std::vector<Candidate> out;
  std::set<unsigned> bound;
  std::set<size_t> used;
  for (const Candidate &one : candidates)
    if (one.refused.empty() && !bound.contains(one.quantity) && !used.contains(one.signal)) {
      bound.insert(one.quantity);
      used.insert(one.signal);
      out.push_back(one);
    }
  // One of two wheels, or half of a position, is none.
  const auto drop_half = [&](unsigned a, unsigned b) {
    if (bound.contains(a) != bound.contains(b))
      std::erase_if(out, [&](const Candidate &one) { return one.quantity == a || one.quantity == b; });
  };
  drop_half(WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT);
  drop_half(WM_CAN_LATITUDE, WM_CAN_LONGITUDE);
  return out;
}

std::string can_signals_yaml(const Dbc &dbc, const std::vector<Candidate> &all, const std::vector<Candidate> &chosen,
                             const std::string &log) {
  std::string out = "# Which signals of " + one_line(dbc.path.filename().string()) +
                    " are which quantities (docs/can.md), proposed by `waymark init` from names, units and ranges" +
                    (log.empty() ? "." : ",\n# and from how they move in " + one_line(log) + ".") +
                    "\n# Positive is forwards and to the left; `scale: -1` inverts the sign. Delete what is wrong.\n";
  const auto is = [](const Candidate &a, const Candidate &b) {
    return a.quantity == b.quantity && a.signal == b.signal;
  };
  for (const Candidate &one : chosen) {
    const init_signal &s = dbc.signals[one.signal];
    out += "\n# line " + std::to_string(s.line) + ": " + one_line(joined(one.reasons)) +
           "\n- {quantity: " + wm_can_quantity_name(one.quantity) + ", message: " + s.message + ", signal: " + s.name;
    if (!one.unit.empty()) out += ", unit: " + one.unit;
    if (one.scale != 1) out += ", scale: " + short_number(one.scale);
    out += "}\n";
  }
  bool first = true;
  for (const Candidate &one : all) {
    if (std::any_of(chosen.begin(), chosen.end(), [&](const Candidate &c) { return is(c, one); })) continue;
    const init_signal &s = dbc.signals[one.signal];
    if (first) out += "\n# Not bound:\n";
    first = false;
    out += std::string("#   ") + wm_can_quantity_name(one.quantity) + ": " + s.message + "." + s.name + ": " +
           one_line(one.refused.empty() ? "another signal fits better (" + joined(one.reasons) + ")" : one.refused) +
           "\n";
  }
  return out;
}

}  // namespace wm::init
