// SPDX-License-Identifier: Apache-2.0
// The data by source, the life cycle's state over time, and the calibration states.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/statistics.h"
#include "report/page.h"
#include "report/report_json.h"
#include "report/words.h"
#include "waymark/pose.h"

namespace wm::tools {
namespace {

using Json = nlohmann::json;

// A count of health.json; a map of counts is summed; 0 where it is not there.
int64_t counted(const Json &source, const char *key) {
  if (!source.is_object() || !source.contains(key)) return 0;
  const Json &value = source[key];
  if (value.is_number()) return static_cast<int64_t>(value.get<double>());
  int64_t sum = 0;
  if (value.is_object())
    for (const auto &[name, part] : value.items())
      if (part.is_number()) sum += static_cast<int64_t>(part.get<double>());
  return sum;
}

const char *reason_in_words(const std::string &reason) {
  static constexpr std::array<std::pair<const char *, const char *>, 8> kReasons{{
      {"gate", "too far from what was expected"},
      {"unknown_id", "no such landmark in the map"},
      {"no_association", "no landmark fits, or more than one"},
      {"out_of_range", "beyond the sensor’s range"},
      {"not_finite", "not a number"},
      {"singular", "no information from there (singular)"},
      {"searching", "seen while the pose was not known yet"},
      {"by_config", "the configuration leaves it out"},
  }};
  for (const auto &[name, words] : kReasons)
    if (reason == name) return words;
  return nullptr;
}

std::string reasons(const Json &source) {
  std::string out;
  if (source.contains("rejected") && source["rejected"].is_object())
    for (const auto &[reason, n] : source["rejected"].items()) {
      if (!n.is_number() || n.get<double>() == 0) continue;
      const char *words = reason_in_words(reason);
      out += (out.empty() ? "" : "; ") + count_text(static_cast<int64_t>(n.get<double>())) + " " +
             (words != nullptr ? words : escape(plain(reason)));
    }
  return out;
}

std::string cell(int64_t n, bool is_loss) {
  return std::string(is_loss && n > 0 ? "<td class=\"some\">" : "<td>") + count_text(n) + "</td>";
}

std::string share_bar(int64_t fused, int64_t refused, int64_t lost) {
  const double all = static_cast<double>(std::max<int64_t>(1, fused + refused + lost));
  const auto part = [all](const char *css, int64_t n) {
    return n > 0 ? std::string("<i class=\"") + css +
                       "\" style=\"width:" + fixed(100 * static_cast<double>(n) / all, 2) + "%\"></i>"
                 : "";
  };
  return "<span class=\"share\">" + part("f", fused) + part("r", refused) + part("d", lost) + "</span>";
}

// A calibration value in the unit that people use, and what it means.
struct Meaning {
  double factor, offset;
  const char *unit;
  std::string words;
};

Meaning meaning_of(const std::string &name) {
  const size_t dot = name.rfind('.');
  const std::string what = dot == std::string::npos ? name : name.substr(dot + 1);
  const std::string who = dot == std::string::npos ? "" : plain(name.substr(0, dot));
  const std::string sensor = who.empty() || who == "motion" ? "the sensor" : "“" + escape(who) + "”";
  const double degrees = 180 / M_PI;
  if (what == "yaw_rad") return {degrees, 0, "°", sensor + " is turned to the left by this, against its calibration"};
  if (what == "bearing_bias_rad") return {degrees, 0, "°", sensor + " measures bearings too large by this"};
  if (what == "time_offset_s" || what == "delay_s")
    return {1e3, 0, "ms", "what " + sensor + " reports is older than its stamp by this"};
  if (what == "turn_slowdown_mps")
    return {1, 0, "m/s", "turning at 1 rad/s the robot drives slower by this much, by the square of the turn rate"};
  if (what == "speed_onset_s" || what == "turn_onset_s")
    return {1e3, 0, "ms",
            std::string("a rise of the ") + (what[0] == 's' ? "speed" : "turn rate") +
                " comes this much later than a fall"};
  if (what == "gentle_turns")
    return {100, 0, "%", "this share of gentle turns is driven with the drive's largest radius"};
  if (what == "lag_s") return {1e3, 0, "ms", "the robot follows its motion data this much later"};
  if (what == "range_bias_m") return {100, 0, "cm", sensor + " measures ranges too long by this"};
  if (what == "range_scale") return {100, -100, "%", sensor + " measures ranges too long by this share"};
  if (what == "speed_scale") return {100, -100, "%", "true speed above the measured one"};
  if (what == "yaw_rate_scale") return {100, -100, "%", "true turn rate above the measured one"};
  if (what == "yaw_rate_bias_radps") return {degrees, 0, "°/s", "the gyro's output at rest"};
  if (what == "left_scale") return {100, -100, "%", "the left wheel rolls this much farther a turn than stated"};
  if (what == "right_scale") return {100, -100, "%", "the right wheel rolls this much farther a turn than stated"};
  if (what == "track_scale") return {100, -100, "%", "the wheels act as if this much farther apart than stated"};
  if (what == "side_scale") return {100, -100, "%", "true sideways speed above the measured one, besides the speed's"};
  if (what == "rotation_center_m") return {100, 0, "cm", "the robot turns about a centre so far ahead of base_link"};
  if (what == "steering_offset_rad") return {degrees, 0, "°", "the wheels' direction to the left at steering 0"};
  if (what == "bloom_px" || what == "edge_shift_px")  // its name before
    return {1, 0, "px", "bright areas are wider by this in the pictures of " + sensor};
  if (what.ends_with("_radps")) return {degrees, 0, "°/s", ""};
  if (what.ends_with("_rad")) return {degrees, 0, "°", ""};
  if (what.ends_with("_s")) return {1e3, 0, "ms", ""};
  if (what.ends_with("_m")) return {100, 0, "cm", ""};
  if (what.ends_with("_scale")) return {100, -100, "%", ""};
  return {1, 0, "", ""};
}

// "laser.yaw_rad" as "laser: yaw".
std::string title_of(std::string name) {
  for (const char *unit : {"_radps", "_rad", "_mps", "_m", "_s"})
    if (name.ends_with(unit)) {
      name.resize(name.size() - std::char_traits<char>::length(unit));
      break;
    }
  name = plain(name);
  if (const size_t dot = name.find('.'); dot != std::string::npos) name.replace(dot, 1, ": ");
  return name;
}

struct CalibrationState {
  std::string name;
  double value, sigma;
};

// health.json's `calibration`: {NAME: {value, sigma}, ...}, or a list of {name, value, sigma}.
std::vector<CalibrationState> calibration_of(const Json &health) {
  std::vector<CalibrationState> out;
  if (!health.is_object() || !health.contains("calibration")) return out;
  for (const auto &[key, state] : health["calibration"].items()) {
    if (!state.is_object() || !state.contains("value") || !state["value"].is_number()) continue;
    const bool named = state.contains("name") && state["name"].is_string();
    const bool sure = state.contains("sigma") && state["sigma"].is_number();
    out.push_back({named ? state["name"].get<std::string>() : key, state["value"].get<double>(),
                   sure ? state["sigma"].get<double>() : kNan});
  }
  return out;
}

// What the run had to complain of beside its counts.
std::string complaints(const Json &health) {
  static constexpr std::array<std::pair<const char *, const char *>, 15> kMotion{{
      {"encoder_left_dead", "The left wheel’s encoder stood still while the robot drove: it is taken for dead."},
      {"encoder_right_dead", "The right wheel’s encoder stood still while the robot drove: it is taken for dead."},
      {"counter_frozen", "A motion message kept coming with a counter that stood still: its sender hung."},
      {"yaw_rate_stuck", "The gyro gave one and the same value while the robot turned: it is taken for stuck."},
      {"implausible", "Motion samples were refused near the end: no robot accelerates as they claim."},
      {"not_planar", "The vehicle rose, rolled or pitched for seconds, which this estimator does not model."},
      {"roll_rate_stuck", "The gyro gave one and the same roll rate: that axis is taken for stuck."},
      {"pitch_rate_stuck", "The gyro gave one and the same pitch rate: that axis is taken for stuck."},
      {"accelerometer_stuck", "The accelerometer gave one and the same value: it is taken for stuck."},
      {"speed_silent", "The speed had fallen silent by the end, while other sensors of the motion went on."},
      {"turn_silent", "The gyro, or the steering, had fallen silent by the end, while the speed came."},
      {"wheels_spin", "The wheels turned and the robot stood at the end: a hole, or a wall."},
      {"one_wheel_spins", "One wheel was spinning at the end, by the gyro."},
      {"pushed", "The robot moved and its wheels stood at the end: it was pushed, or carried."},
      {"lifted", "The robot moved otherwise than its wheels turned at the end: lifted, or sliding."},
  }};
  std::string out;
  const auto each = [&health](const char *key, const auto &then) {
    if (!health.contains(key) || !health[key].is_array()) return;
    for (const Json &name : health[key])
      if (name.is_string()) then(name.get<std::string>());
  };
  each("motion_health", [&out](const std::string &name) {
    for (const auto &[key, words] : kMotion)
      if (name == key) out += "<p class=\"note\">" + std::string(words) + "</p>";
  });
  each("stale", [&out](const std::string &name) {
    out += "<p class=\"note\">" + escape(plain(name)) + " had fallen silent by the end.</p>";
  });
  each("unused", [&out](const std::string &name) {
    out += "<p class=\"note\">" + escape(plain(name)) + " was there, but this estimator doesn’t take it.</p>";
  });
  return out;
}

// The rows of health.json's `counters` and `lost_probability`.
std::string counter_rows(const Json &health) {
  static constexpr std::array<std::pair<wm_counter_kind, const char *>, WM_COUNTER_KIND_COUNT> kWords{{
      {WM_COUNTER_LANDMARKS, "landmarks in the map at the end"},
      {WM_COUNTER_LANDMARKS_ADDED, "landmarks that entered the map"},
      {WM_COUNTER_LANDMARKS_REMOVED, "landmarks that left it: hardly seen, or moved"},
      {WM_COUNTER_LANDMARKS_MOVED, "times that an identity (of a line: its track's number) was elsewhere than before"},
      {WM_COUNTER_LANDMARKS_MERGED, "pairs of landmarks that were found to be one"},
      {WM_COUNTER_IDENTITIES_AMBIGUOUS,
       "sightings whose identity (of a line: its track's number) stood for two landmarks"},
      {WM_COUNTER_MAP_FULL, "new landmarks for which there was no room"},
      {WM_COUNTER_ROTATION_OUTLIERS, "turns that the motion data lack: slip, or turned by hand"},
      {WM_COUNTER_MOTION_OUTLIERS, "motion data that no robot can do"},
      {WM_COUNTER_RELOCALIZATIONS, "times that the lost robot was found again"},
      {WM_COUNTER_ALIASED_POSES, "other places that look the same, at the end"},
      {WM_COUNTER_EXPLAINED_PERMILLE, "of 1000 edge points, those that lie on edges of the map, at the end"},
  }};
  std::string out;
  const auto row = [&out](const std::string &name, const std::string &value, const std::string &words) {
    out += "<tr><td>" + escape(plain(name)) + "</td><td><b>" + value + "</b></td><td class=\"words\">" + words +
           "</td></tr>";
  };
  if (!health.is_object()) return out;
  if (health.contains("lost_probability") && health["lost_probability"].is_number())
    row("lost probability", number_text(100 * health["lost_probability"].get<double>(), 2) + "\u202f%",
        "that the robot was not where its last pose is");
  if (!health.contains("counters") || !health["counters"].is_object()) return out;
  for (const auto &[name, counter] : health["counters"].items()) {
    if (!counter.is_object() || !counter.contains("count") || !counter["count"].is_number()) continue;
    std::string words;
    for (const auto &[kind, meaning] : kWords)
      if (name == wm_counter_name(kind)) words = meaning;
    if (counter.contains("landmark_id") && counter["landmark_id"].is_number_integer())
      words += "; the last one: " + std::to_string(counter["landmark_id"].get<int64_t>());
    row(name, std::to_string(counter["count"].get<int64_t>()), words);
  }
  return out;
}

int decimals_for(double sigma) {
  if (!(sigma > 0)) return 2;
  return std::clamp(static_cast<int>(std::ceil(1 - std::log10(sigma) - 1e-9)), 0, 5);
}

}  // namespace

std::string source_section(const ReportData &data) {
  if (!data.json->health.is_object() || !data.json->health.contains("sources") ||
      !data.json->health["sources"].is_object())
    return "";
  std::string rows;
  bool has_lateness = false;
  for (const auto &[name, source] : data.json->health["sources"].items())
    has_lateness = has_lateness || source.contains("lateness_p99_ms");
  for (const auto &[name, source] : data.json->health["sources"].items()) {
    const int64_t fused = counted(source, "fused");
    const int64_t refused = counted(source, "rejected");
    const int64_t late = counted(source, "late");
    const int64_t dropped = counted(source, "dropped");
    const int64_t lost = counted(source, "lost");
    const int64_t malformed = counted(source, "malformed") + counted(source, "not_finite");
    rows += "<tr><td>" + escape(plain(name)) + share_bar(fused, refused, late + dropped + lost + malformed) + "</td>" +
            cell(counted(source, "received"), false) + cell(fused, false) + cell(refused, true) + cell(late, true) +
            cell(dropped, true) + cell(lost, true) + cell(malformed, true);
    if (has_lateness)
      rows += "<td>" +
              (source.contains("lateness_p99_ms") && source["lateness_p99_ms"].is_number()
                   ? fixed(source["lateness_p99_ms"].get<double>(), 1) + " ms"
                   : std::string("–")) +
              "</td>";
    rows += "<td class=\"words\">" + reasons(source) + "</td></tr>";
  }
  return section(
      "Data by source",
      "Nothing is lost silently: each datum that a source gave was used, or is counted here with the reason why not. A "
      "refused datum contradicted what the robot knew; late ones came after their moment was closed; lost ones are "
      "missing by the sender’s own count.",
      "<div class=\"wide\"><table><tr><th>source</th><th>received</th><th>used</th><th>refused</th><th>late</"
      "th><th>dropped</th><th>lost</th>"
      "<th>unreadable</th>" +
          std::string(has_lateness ? "<th>lateness, 99&nbsp;%</th>" : "") +
          "<th class=\"words\">refused because</th></tr>" + rows + "</table></div>" + complaints(data.json->health) +
          legend({{"<i class=\"key\" style=\"background:var(--blue)\"></i>", "used"},
                  {"<i class=\"key\" style=\"background:var(--orange)\"></i>", "refused"},
                  {"<i class=\"key\" style=\"background:var(--amber)\"></i>", "late, dropped, lost or unreadable"}}));
}

std::string state_section(const ReportData &data) {
  const auto &poses = data.trajectory.poses;
  if (poses.front().state < 0) return "";
  static constexpr std::array<const char *, WM_STATE_COUNT> kWords{
      "searching: no pose known yet", "tracking: what it saw fitted and was used",
      "dead reckoning: nothing to see, it went by its motion alone",
      "lost: what it saw contradicted its pose, being mended",
      "degraded: what it saw contradicted its pose or did not support it"};
  std::array<double, WM_STATE_COUNT> spent{};
  std::string strip;
  for (size_t begin = 0; begin < poses.size();) {
    size_t end = begin + 1;
    while (end < poses.size() && poses[end].state == poses[begin].state) ++end;
    const double from = data.seconds(poses[begin].t_ns);
    const double to = data.seconds(poses[std::min(end, poses.size() - 1)].t_ns);
    const int state = poses[begin].state;
    if (state >= 0 && state < WM_STATE_COUNT) {
      spent[static_cast<size_t>(state)] += to - from;
      strip += "<span class=\"" + std::string(wm_state_name(static_cast<unsigned>(state))) +
               "\" style=\"flex:" + fixed(to - from, 3) + " 0 0\" title=\"" +
               escape(plain(wm_state_name(static_cast<unsigned>(state)))) + " from " + fixed(from, 1) + " s to " +
               fixed(to, 1) + " s\"></span>";
    }
    begin = end;
  }
  std::vector<std::pair<std::string, std::string>> marks;
  for (size_t k = 0; k < spent.size(); ++k)
    if (spent[k] > 0)
      marks.emplace_back("<i class=\"key " + std::string(wm_state_name(static_cast<unsigned>(k))) + "\"></i>",
                         std::string(kWords[k]) + " (" + percent_text(spent[k] / std::max(data.end_s(), 1e-9)) + ")");
  return section("State", "The whole drive from left to right, by the estimator's life cycle.",
                 "<figure><div class=\"strip\">" + strip + "</div>" + legend(marks) + "</figure>");
}

std::string calibration_section(const ReportData &data) {
  std::string rows;
  for (const CalibrationState &state : calibration_of(data.json->health)) {
    const Meaning m = meaning_of(state.name);
    const double value = state.value * m.factor + m.offset;
    const bool known = !(state.sigma > 0);  // without a sigma
    const int decimals = known ? (value == std::round(value) ? 0 : 2) : decimals_for(state.sigma * m.factor);
    const std::string sign = value > 0 && m.offset != 0 ? "+" : "";
    rows += "<tr><td>" + escape(title_of(state.name)) + "</td><td><b>" + sign + number_text(value, decimals) + "</b>" +
            (known ? "" : " ± " + fixed(state.sigma * m.factor, decimals)) + "\u202f" + m.unit +
            "</td><td class=\"words\">" + m.words + "</td></tr>";
  }
  rows += counter_rows(data.json->health);
  if (rows.empty()) return "";
  return section(
      "Calibration states and counters",
      "These are not constants from a data sheet but states that the robot estimated while driving, each with its "
      "standard deviation at the end. A value within two standard deviations of zero shows that the calibration was "
      "right. Counts and shares stand without one.",
      "<div class=\"wide\"><table><tr><th>state</th><th>value ± σ</th><th class=\"words\">what it means</th></tr>" +
          rows + "</table></div>");
}

}  // namespace wm::tools
