// SPDX-License-Identifier: Apache-2.0
#include "web/live.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>

extern "C" {
#include "cli/watch/metrics.h"
#include "findings/findings.h"
}

namespace wm::tools {
namespace {

using Json = nlohmann::json;

constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr int64_t kPosesKept_ns = 5 * kSecond_ns;  // longer than any picture or sighting is late
constexpr int64_t kRaysShown_ns = 3 * kSecond_ns / 2;
constexpr int64_t kPlacesShown_ns = 3 * kSecond_ns;  // they come once a second
constexpr size_t kVerdictsKept = 2000, kLookedKept = 16;
constexpr size_t kPlacesKept = 5000, kLandmarksKept = 20000;  // a stranger's messages take no more
constexpr double kRayWithoutRange_m = 4;

// Rounded to what a page can show: 0.1 mm. Not finite: null.
Json metres(double v) { return std::isfinite(v) ? Json(std::round(v * 1e4) / 1e4) : Json(nullptr); }
Json radians(double v) { return std::isfinite(v) ? Json(std::round(v * 1e5) / 1e5) : Json(nullptr); }
// As it is; not finite: null, which the JSON library would write only when it prints.
Json number(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }

double heading_of(const wm_pose3 &pose) {
  const double *q = pose.q_xyzw;
  return std::atan2(2 * (q[3] * q[2] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2]));
}

// What a person can do about a device's state.
const char *remedy(unsigned device) {
  switch (device) {
    case WM_DEVICE_ABSENT: return "unplugged, or never there; it is looked for twice a second";
    case WM_DEVICE_DOWN:
      return "the interface is down, or the camera's size is not the calibration's: ip link set up; waymark doctor";
    case WM_DEVICE_PASSIVE: return "many errors on the bus: termination, bit rate, cable";
    case WM_DEVICE_BUS_OFF: return "the controller left the bus: bit rate, short circuit; restart-ms brings it back";
    case WM_DEVICE_STALLED: return "no pictures come; it is switched off and on after four seconds";
    case WM_DEVICE_FROZEN: return "the same picture repeats: the camera hangs";
    default: return "";
  }
}

Json source_json(const wm_source_health &s) {
  uint64_t rejected = 0;
  for (int i = 1; i < WM_VERDICT_COUNT; i++) rejected += s.rejected[i];
  char looks[300] = "";
  (void)wm_looks_text(s.looks, looks, sizeof looks);
  return {{"name", s.name},
          {"device", s.device != WM_DEVICE_NONE ? wm_device_state_name(s.device)
                     : s.stale != 0             ? "silent"
                                                : ""},
          {"is_bad", s.device > WM_DEVICE_WORKS || s.stale != 0},
          {"remedy", remedy(s.device)},
          {"silent_s", number(static_cast<double>(s.silent_ns) * 1e-9)},
          {"fused", s.fused},
          {"rejected", rejected},
          {"late", s.late},
          {"lost", s.lost + s.overflows + s.dropped},
          {"malformed", s.malformed + s.not_finite},
          {"looks", looks}};
}

}  // namespace

// ── messages ────────────────────────────────────────────────────────────────────────────────────────────────────────

void Live::take(const std::string &what, const void *message, size_t length, int64_t now_ns) {
  if (what == "POSE") take_pose(message, length, now_ns);
  if (what == "REFUSED") watch_refused(&seen_, message, length);
  if (what == "POSE_BOUND") watch_bound(&seen_, message, length);
  if (what == "HEALTH") watch_health(&seen_, message, length, now_ns);
  if (what == "INNOVATION") take_innovation(message, length);
  if (what == "OBSERVATIONS") take_sightings(message, length, now_ns);
  if (what == "PARTICLES") take_places(&particles_, message, length, now_ns);
  if (what == "HYPOTHESES") take_places(&hypotheses_, message, length, now_ns);
  if (what != "LANDMARKS" && what != "MAP") return;
  wm_lcm_part part;
  std::vector<wm_landmark> landmarks(WM_LCM_LANDMARKS_MAX);
  const bool is_known = what == "LANDMARKS";
  if ((is_known ? wm_lcm_read_landmarks : wm_lcm_read_map)(message, length, &part, landmarks.data()) != nullptr) {
    seen_.not_understood++;
    return;
  }
  if ((is_known ? known_ : own_).take(part, landmarks.data())) landmarks_version_++;
}

// Parts in their order make a list; a part that is missing leaves the list of before.
bool Live::LandmarkList::take(const wm_lcm_part &part, const wm_landmark *landmarks) {
  if (part.total > kLandmarksKept) return false;
  if (part.first == 0) {
    coming.clear();
    coming_ns = part.t_ns;
  }
  if (part.first != coming.size() || part.t_ns != coming_ns) return false;
  coming.insert(coming.end(), landmarks, landmarks + part.count);
  if (coming.size() != part.total) return false;
  const bool is_same =
      std::equal(all.begin(), all.end(), coming.begin(), coming.end(), [](const wm_landmark &a, const wm_landmark &b) {
        return a.id == b.id && a.p_m[0] == b.p_m[0] && a.p_m[1] == b.p_m[1];
      });
  all = coming;
  return !is_same;
}

void Live::take_pose(const void *message, size_t length, int64_t now_ns) {
  const uint64_t before = seen_.not_understood;
  watch_pose(&seen_, message, length, now_ns);
  if (seen_.not_understood != before) return;
  const wm_estimate &e = seen_.pose.now;
  const double *p = e.pose_map_base.p_m, *q = e.pose_map_base.q_xyzw;
  Pose pose;
  pose.t_ns = e.t_ns;
  pose.p_m = {p[0], p[1], p[2]};
  pose.q = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
  if (!pose.p_m.allFinite() || !(std::fabs(pose.q.norm() - 1) < 1e-3)) return;
  if (!poses_.empty() && pose.t_ns <= poses_.back().t_ns) {  // another run, or a recording from its beginning
    if (pose.t_ns > poses_.back().t_ns - kSecond_ns) return;
    poses_.clear();
    trail_.clear();
  }
  const bool is_jump = e.resets != resets_ || seen_.pose.jumps != jumps_;
  resets_ = e.resets;
  jumps_ = seen_.pose.jumps;
  poses_.push_back(pose);
  const auto first = std::find_if(poses_.begin(), poses_.end(),
                                  [&](const Pose &kept) { return kept.t_ns > pose.t_ns - kPosesKept_ns; });
  if (first - poses_.begin() > 100) poses_.erase(poses_.begin(), first);
  trail_.add({p[0], p[1], p[2], e.state, static_cast<uint8_t>(is_jump)});
}

void Live::take_innovation(const void *message, size_t length) {
  watch_innovation(&seen_, message, length);
  wm_innovation i;
  if (wm_lcm_read_innovation(message, length, &i) != nullptr) return;
  verdicts_.push_back({i.t_ns, i.landmark_id, i.verdict});
  if (verdicts_.size() > kVerdictsKept) verdicts_.pop_front();
}

void Live::take_sightings(const void *message, size_t length, int64_t now_ns) {
  char sensor[WM_NAME_MAX] = "";
  std::vector<wm_sighting> sightings(WM_LCM_OBSERVATIONS_MAX);
  size_t count = 0;
  int64_t t_ns = 0;
  if (wm_lcm_read_sightings(message, length, sensor, &t_ns, sightings.data(), &count) != nullptr) {
    seen_.not_understood++;
    return;
  }
  sightings.resize(count);
  auto at = std::find_if(looked_.begin(), looked_.end(), [&](const Looked &l) { return l.sensor == sensor; });
  if (at == looked_.end()) {
    if (looked_.size() == kLookedKept) looked_.erase(looked_.begin());
    at = looked_.insert(looked_.end(), Looked{});
  }
  *at = {sensor, t_ns, now_ns, std::move(sightings)};
}

void Live::take_places(Places *places, const void *message, size_t length, int64_t now_ns) {
  wm_lcm_part part;
  std::vector<wm_place> heard(WM_LCM_PLACES_MAX);
  if (wm_lcm_read_places(message, length, &part, heard.data()) != nullptr) {
    seen_.not_understood++;
    return;
  }
  if (part.t_ns != places->t_ns) places->all.clear();
  if (places->all.size() + part.count > kPlacesKept) return;
  places->all.insert(places->all.end(), heard.begin(), heard.begin() + static_cast<std::ptrdiff_t>(part.count));
  places->t_ns = part.t_ns;
  places->heard_ns = now_ns;
  places->total = part.total;
  places_version_++;
}

// ── as JSON ─────────────────────────────────────────────────────────────────────────────────────────────────────────

std::optional<Pose> Live::pose_at_stamp(int64_t t_ns) const { return pose_at(poses_, t_ns, kMaxGapNs); }

const wm_landmark *Live::find(int32_t id) const {
  for (const LandmarkList *list : {&own_, &known_})
    for (const wm_landmark &landmark : list->all)
      if (landmark.id == id) return &landmark;
  return nullptr;
}

Json Live::pose_json() const {
  const wm_estimate &e = seen_.pose.now;
  const double *p = e.pose_map_base.p_m, *q = e.pose_map_base.q_xyzw, *c = e.covariance;
  const auto sigma = [c](int i) { return number(std::sqrt(std::fmax(c[wm_cov_index(i, i)], 0))); };
  return {{"t_ns", e.t_ns},
          {"x_m", metres(p[0])},
          {"y_m", metres(p[1])},
          {"z_m", metres(p[2])},
          {"heading_rad", radians(heading_of(e.pose_map_base))},
          {"pitch_rad", radians(std::asin(std::clamp(2 * (q[3] * q[1] - q[2] * q[0]), -1.0, 1.0)))},
          {"roll_rad", radians(std::atan2(2 * (q[3] * q[0] + q[1] * q[2]), 1 - 2 * (q[0] * q[0] + q[1] * q[1])))},
          {"covariance", {number(c[wm_cov_index(0, 0)]), number(c[wm_cov_index(0, 1)]), number(c[wm_cov_index(1, 1)])}},
          {"sigma_m", {sigma(0), sigma(1), sigma(2)}},
          {"sigma_heading_rad", sigma(5)},
          {"dof", e.dof},
          {"state", wm_state_name(e.state)},
          {"speed_mps", metres(std::hypot(e.v_mps[0], e.v_mps[1]))},
          {"turn_radps", radians(e.w_radps[2])},
          {"fused_s_ago", number(static_cast<double>(e.t_ns - seen_.pose.fused_until_ns) * 1e-9)},
          {"resets", e.resets},
          {"jumps", seen_.pose.jumps},
          {"last_jump_m", metres(seen_.pose.last_jump_m)},
          {"rate_hz", number(std::round(seen_.rate_hz * 10) / 10)}};
}

Json Live::health_json() const {
  const wm_health &h = seen_.health;
  Json sources = Json::array(), counters = Json::array(), calibration = Json::array(), findings = Json::array();
  for (uint32_t i = 0; i < std::min<uint32_t>(h.source_count, WM_HEALTH_SOURCES_MAX); i++)
    sources.push_back(source_json(h.sources[i]));
  for (uint32_t i = 0; i < std::min<uint32_t>(h.counter_count, WM_HEALTH_COUNTERS_MAX); i++)
    counters.push_back({{"name", wm_counter_name(h.counters[i].kind)}, {"count", h.counters[i].count}});
  for (uint32_t i = 0; i < std::min<uint32_t>(h.calibration_count, WM_HEALTH_CALIBRATION_MAX); i++)
    calibration.push_back({{"name", h.calibration[i].name},
                           {"value", number(h.calibration[i].value)},
                           {"sigma", number(h.calibration[i].sigma)}});
  for (size_t i = 0; i < seen_.found.count; i++) {
    const wm_finding &f = seen_.found.at[i];
    findings.push_back({{"id", kFindingKinds[f.id].identifier},
                        {"severity", wm_severity_name(f.severity)},
                        {"about", f.about},
                        {"text", f.text},
                        {"cause", kFindingKinds[f.id].cause},
                        {"fix", f.fix}});
  }
  return {{"lost_probability", number(h.lost_probability)},
          {"left_m", number(h.reckoning_left_m)},
          {"left_s", number(h.reckoning_left_s)},
          {"loops", h.loops},
          {"deadlines_missed", h.deadlines_missed},
          {"outputs_lost", h.outputs_lost},
          {"send_p99_ms", number(static_cast<double>(h.send_p99_ns) * 1e-6)},
          {"sources", sources},
          {"counters", counters},
          {"calibration", calibration},
          {"findings", findings}};
}

// Each sighting as a line in map: from the sensor to what it saw, with what became of it.
Json Live::rays_json(int64_t now_ns) const {
  Json out = Json::array();
  for (const Looked &look : looked_) {
    const auto pose = pose_at_stamp(look.t_ns);
    if (now_ns - look.heard_ns > kRaysShown_ns || !pose) continue;
    const SensorMount mount = site_.sensor(look.sensor);
    const Eigen::Vector3d eye = pose->p_m + pose->q * mount.T_base.translation();
    for (const wm_sighting &s : look.sightings) {
      if (!std::isfinite(s.bearing_rad)) continue;  // a range alone has no direction
      const Eigen::Vector3d ray =
          pose->q * mount.direction(s.bearing_rad, std::isfinite(s.elevation_rad) ? s.elevation_rad : 0);
      const wm_landmark *landmark = s.landmark_id >= 0 ? find(s.landmark_id) : nullptr;
      double reach_m = std::isfinite(s.range_m) ? s.range_m : kRayWithoutRange_m;
      if (landmark != nullptr && !std::isfinite(s.range_m))
        reach_m =
            std::hypot(landmark->p_m[0] - eye.x(), landmark->p_m[1] - eye.y()) / std::fmax(ray.head<2>().norm(), 0.1);
      const char *verdict = "seen";
      for (const Verdict &v : verdicts_) {
        if (v.t_ns != look.t_ns || v.landmark != s.landmark_id) continue;
        verdict = v.verdict == WM_FUSED ? "fused" : "refused";
        if (v.verdict == WM_FUSED) break;
      }
      out.push_back({metres(eye.x()), metres(eye.y()), metres(eye.x() + reach_m * ray.x()),
                     metres(eye.y() + reach_m * ray.y()), verdict, s.landmark_id});
    }
  }
  return out;
}

Json Live::trail_json(const Has &has) const {
  const auto &points = trail_.points();
  size_t from = has.trail_generation == trail_.generation() && has.trail_points >= 0
                    ? std::min(static_cast<size_t>(has.trail_points), points.size())
                    : 0;
  Json list = Json::array();
  const size_t first = from;
  for (; from < points.size(); from++) {
    const TrailPoint &p = points[from];
    list.push_back({metres(p.x_m), metres(p.y_m), metres(p.z_m), p.state, p.is_jump});
  }
  return {{"generation", trail_.generation()}, {"from", first}, {"points", list}};
}

Json Live::landmarks_json() const {
  Json list = Json::array();
  for (const LandmarkList *from : {&known_, &own_})
    for (const wm_landmark &l : from->all) {
      const bool has_shape = std::isfinite(l.cov_m2[0]) && l.cov_m2[0] > 0;
      const double own = std::isfinite(l.sigma_m) ? l.sigma_m * l.sigma_m : 0;
      list.push_back({l.id, metres(l.p_m[0]), metres(l.p_m[1]), metres(l.p_m[2]), number(has_shape ? l.cov_m2[0] : own),
                      number(has_shape ? l.cov_m2[1] : 0), number(has_shape ? l.cov_m2[2] : own),
                      from == &own_ ? 1 : 0});
    }
  return {{"version", landmarks_version_}, {"list", list}};
}

Json Live::places_json(int64_t now_ns) const {
  Json out = {{"version", places_version_}};
  for (const auto &[name, places] : {std::pair("particles", &particles_), std::pair("hypotheses", &hypotheses_)}) {
    Json list = Json::array();
    if (now_ns - places->heard_ns < kPlacesShown_ns)
      for (const wm_place &p : places->all)
        list.push_back({metres(p.x_m), metres(p.y_m), radians(p.heading_rad), number(p.weight), number(p.covariance[0]),
                        number(p.covariance[1]), number(p.covariance[2])});
    out[name] = list;
  }
  return out;
}

std::string Live::state(int64_t now_ns, const Has &has) const {
  char why[240] = "";
  const char *state = watch_state(&seen_, now_ns, why, sizeof why);
  Json out = {{"state", state},
              {"why", why},
              {"name", site_.name},
              {"consistency", watch_consistency(&seen_)},
              {"nis", seen_.innovations > 0 ? number(seen_.nis) : Json(nullptr)},
              {"not_understood", seen_.not_understood},
              {"has_map", site_.raster() != nullptr},
              {"rays", rays_json(now_ns)},
              {"trail", trail_json(has)},
              {"landmarks_version", landmarks_version_},
              {"places_version", places_version_}};
  if (seen_.has_pose != 0) out["pose"] = pose_json();
  if (seen_.has_health != 0) out["health"] = health_json();
  if (has.landmarks != landmarks_version_) out["landmarks"] = landmarks_json();
  const bool are_old = now_ns - std::max(particles_.heard_ns, hypotheses_.heard_ns) >= kPlacesShown_ns;
  if (has.places != places_version_ || are_old) out["places"] = places_json(now_ns);
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string Live::metrics(int64_t now_ns) const {
  char *text = nullptr;
  size_t bytes = 0;
  FILE *to = open_memstream(&text, &bytes);
  if (to == nullptr) throw std::bad_alloc();
  watch_metrics(&seen_, now_ns, to);
  const bool is_whole = std::fclose(to) == 0;
  const std::unique_ptr<char, decltype(&std::free)> held(text, std::free);
  if (!is_whole || !held) throw std::bad_alloc();
  return {held.get(), bytes};
}

}  // namespace wm::tools
