// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/slam_trials.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "common/failure.h"
#include "common/statistics.h"
#include "montecarlo/simulated.h"
#include "simulate/angle.h"
#include "simulate/simulate.h"
#include "waymark/random.h"

namespace wm::montecarlo {
namespace {

constexpr double kDegree = sim::kPi / 180;
constexpr double kAhead_s = 25;         // of the drive behind the cut
constexpr double kForgotten_s = 1;      // a tracker gives a new number after this time
constexpr double kMapSigma_m = 0.02;    // of a finished map
constexpr double kMapTurn_rad = 0.005;  // and of its markers' headings
constexpr uint64_t kDraws = 0x51a3;     // stream of random numbers
constexpr double kNear_m = 0.5;         // renumbered: a landmark is the nearest true one's, up to this

bool is_jump(Disturbance d, double away_m, double turned_rad) {
  if (d == Disturbance::kKidnap) return away_m > 2;
  const double turned = std::fabs(turned_rad);
  return away_m < 2 && turned < 90 * kDegree && (away_m > 0.5 || turned > 20 * kDegree);
}

// The drive, cut where the disturbance takes place.
void draw_cut(const sim::Scenario &scenario, const SlamTrial &trial, uint64_t seed, sim::Recording &r,
              SlamOutcome &out) {
  wm_error error{};
  check(sim::simulate(scenario, seed, SIZE_MAX, r, &error), error, "drive");
  const auto uniform = [&](uint64_t n) { return wm_random_uniform(seed, kDraws, n); };
  const double end = r.duration_s;
  if (trial.disturbance == Disturbance::kNone) return;
  if (trial.disturbance == Disturbance::kStart) {
    out.cut_s = (end - kAhead_s) * uniform(0);
    return;
  }
  for (uint64_t n = 0; n < 2000; n++) {
    const double at = end * (0.4 + 0.2 * uniform(2 * n)), forward = (end - kAhead_s - at) * uniform(2 * n + 1);
    const sim::State a = r.drive.at(at), b = r.drive.at(at + forward);
    const double away = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m), turned = sim::wrap(b.heading_rad - a.heading_rad);
    if (forward < 0.2 || !is_jump(trial.disturbance, away, turned)) continue;
    sim::Scenario carried = scenario;
    carried.faults.kidnap_at_s = at;
    carried.faults.kidnap_forward_s = forward;
    check(sim::simulate(carried, seed, SIZE_MAX, r, &error), error, "drive");
    out.cut_s = at;
    out.moved_m = away;
    out.turned_rad = turned;
    return;
  }
  throw tools::Failure("no such disturbance fits into the drive");
}

// What a survey would have made of it.
void survey(sim::Recording &r) {
  r.map = r.landmarks;
  for (uint64_t i = 0; i < r.map.size(); i++) {
    wm_landmark &l = r.map[i];
    l.sigma_m = kMapSigma_m;
    for (uint64_t k = 0; k < 2; k++) l.p_m[k] += kMapSigma_m * wm_random_normal(r.seed, kDraws + 1, 3 * i + k);
    l.yaw_rad += kMapTurn_rad * wm_random_normal(r.seed, kDraws + 1, 3 * i + 2);
  }
}

// A copy of a configuration's parameters, of which some are changed.
class Parameters {
 public:
  explicit Parameters(const wm_config &config)
      : table_(config.estimator->params), bytes_(table_.bytes / sizeof(std::max_align_t) + 1) {
    std::memcpy(bytes_.data(), config.estimator_params, table_.bytes);
  }
  void set(const char *key, int32_t value) {
    for (size_t i = 0; i < table_.count; i++)
      if (std::strcmp(table_.params[i].key, key) == 0)
        std::memcpy(reinterpret_cast<char *>(bytes_.data()) + table_.params[i].offset, &value, sizeof value);
  }
  void *data() { return bytes_.data(); }

 private:
  const wm_param_table &table_;
  std::vector<std::max_align_t> bytes_;
};

// A tracker's numbers in place of identities.
class Renumbering {
 public:
  void begin_anew() { seen_.clear(); }
  int32_t number(int32_t id, double t_s) {
    auto [at, fresh] = seen_.try_emplace(id, Seen{next_, t_s});
    if (!fresh && t_s - at->second.t_s > kForgotten_s) at->second.number = next_, fresh = true;
    if (fresh) next_++;
    at->second.t_s = t_s;
    return at->second.number;
  }

 private:
  struct Seen {
    int32_t number;
    double t_s;
  };
  std::map<int32_t, Seen> seen_;
  int32_t next_ = 1000;
};

struct Look {
  double t_s, error_m, error_rad;
  double place_nees, nees;
  wm_state state;
  [[nodiscard]] bool astray() const { return state == WM_STATE_LOST || state == WM_STATE_SEARCHING; }
  [[nodiscard]] bool right() const { return !astray() && error_m < 0.3 && error_rad < 5 * kDegree; }
  [[nodiscard]] bool wrong() const { return state == WM_STATE_TRACKING && error_m > 0.5 && place_nees > 3.5 * 3.5; }
};

Look look_at(const sim::Recording &r, const wm_estimate &e) {
  Look out{};
  out.t_s = seconds(r, e.t_ns);
  const PlanarError error = error_of(e, r.drive.at(out.t_s));
  const auto place = error.off.head<2>();
  out.error_m = error.position_m();
  out.error_rad = error.heading_rad();
  out.place_nees = place.dot(error.covariance.topLeftCorner<2, 2>().ldlt().solve(place));
  out.nees = error.nees();
  out.state = static_cast<wm_state>(e.state);
  return out;
}

// RMS distance of the estimator's landmarks from the true ones of their identity, or from the nearest ones.
double map_error(const sim::Recording &r, SimulatedFilter &filter, bool by_identity) {
  std::vector<wm_landmark> found(filter.ops().landmarks(filter.state(), nullptr, nullptr, 0));
  filter.ops().landmarks(filter.state(), found.data(), nullptr, found.size());
  double sum = 0;
  size_t count = 0;
  for (const wm_landmark &l : found) {
    double least = by_identity ? 1e9 : kNear_m;
    for (const wm_landmark &t : r.landmarks)
      if (!by_identity || t.id == l.id) least = std::min(least, std::hypot(t.p_m[0] - l.p_m[0], t.p_m[1] - l.p_m[1]));
    if (least < 1e8) sum += least * least, count++;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : tools::kNan;
}

// When enough was seen since the cut to notice it.
class Enough {
 public:
  explicit Enough(bool by_identity) : by_identity_(by_identity) {}
  // Of the map as it is now.
  void begin(SimulatedFilter &filter) {
    std::vector<wm_landmark> known(filter.ops().landmarks(filter.state(), nullptr, nullptr, 0));
    filter.ops().landmarks(filter.state(), known.data(), nullptr, known.size());
    for (const wm_landmark &l : known) known_.insert(l.id);
  }
  void see(int32_t id, double t_s) {
    if (by_identity_ && known_.count(id) == 0) return;
    sightings_++;
    ids_.insert(id);
    if (std::isnan(at_s_) && sightings_ >= (by_identity_ ? 4 : 8) && ids_.size() >= 2) at_s_ = t_s;
  }
  [[nodiscard]] double at_s() const { return at_s_; }

 private:
  bool by_identity_;
  int sightings_ = 0;
  std::set<int32_t> known_, ids_;
  double at_s_ = NAN;
};

int32_t *identity_of(wm_event &e) {
  return e.kind == WM_EVENT_MARKER     ? &e.as.marker.id
         : e.kind == WM_EVENT_SIGHTING ? &e.as.sighting.landmark_id
                                       : nullptr;
}

void judge(const std::vector<Look> &looks, double enough_s, SlamOutcome &out) {
  const double bound = tools::chi2_quantile(0.95, 3);
  bool before = true;
  for (const Look &l : looks) {
    out.alarms += l.astray() && !before;
    before = l.astray();
    if (l.astray()) continue;
    out.looks++;
    out.inside += l.nees <= bound;
  }
  for (const Look &l : looks)
    if (l.t_s > out.cut_s && l.astray() && !out.detected_after_s)
      out.detected_after_s = std::max(0.0, l.t_s - enough_s);
  for (const Look &l : looks)
    if (l.t_s >= enough_s && l.right() && (!out.detected_after_s || *out.detected_after_s > l.t_s - enough_s)) {
      out.detected_after_s = l.t_s - enough_s;
      break;
    }
  const auto right = [&out](const Look &l) { return l.t_s >= out.cut_s && l.right(); };
  if (const Look *since = first_lasting(looks, 2, right)) out.right_after_s = since->t_s - out.cut_s;
  out.wrong_s = longest(looks, [](const Look &l) { return l.wrong(); });
  out.end_m = looks.empty() ? tools::kNan : looks.back().error_m;
}

}  // namespace

const std::vector<SlamTrial> &slam_trials() {
  static const std::vector<SlamTrial> all = {
      {"as-driven", Disturbance::kNone, false},    {"kidnap", Disturbance::kKidnap, false},
      {"push", Disturbance::kPush, false},         {"start", Disturbance::kStart, false},
      {"start-frozen", Disturbance::kStart, true},
  };
  return all;
}

SlamOutcome run_slam_trial(const sim::Scenario &scenario, const wm_config &config, const SlamTrial &trial,
                           const SlamOptions &options, uint64_t seed) {
  wm_error error{};
  SlamOutcome out;
  out.seed = seed;
  sim::Recording recording;
  draw_cut(scenario, trial, seed, recording, out);
  const bool begun = trial.disturbance != Disturbance::kStart;
  wm_config changed = config;
  Parameters params(config);
  changed.estimator_params = params.data();
  if (options.renumber) params.set("lines.rejoin", 1);
  if (!begun) {
    survey(recording);
    params.set("landmarks.map", trial.frozen ? 2 : 1);
  }
  std::vector<SmallEvent> events;
  check(make_events(recording, events, &error), error, "events");
  SimulatedFilter filter(changed, recording, scenario.robot.wheels);
  wm_start &start = filter.setup().start;
  if (!begun) start.p_m[0] = start.p_m[1] = start.heading_rad = NAN;
  check(filter.init(&error), error, "init");

  const bool by_identity = !options.renumber;
  Renumbering numbers;
  Enough enough(by_identity);
  std::vector<Look> looks;
  bool cut = false;
  double look_s = 0;
  wm_event e{};
  for (const SmallEvent &small : events) {
    small.get(&e);
    const double t_s = seconds(recording, e.t_ns);
    if (!begun && t_s < out.cut_s) continue;
    if (!cut && trial.disturbance != Disturbance::kNone && t_s >= out.cut_s) {
      cut = true;
      out.map_before_m = map_error(recording, filter, by_identity);
      numbers.begin_anew();
      enough.begin(filter);
    }
    if (int32_t *id = identity_of(e)) {
      if (cut) enough.see(*id, t_s);
      if (options.renumber) *id = numbers.number(*id, t_s);
    }
    filter.take(e);
    const wm_estimate estimate = filter.estimate();
    if (t_s < look_s || estimate.t_ns == WM_TIME_NONE) continue;
    look_s = t_s + kLook_s;
    looks.push_back(look_at(recording, estimate));
  }
  judge(looks, enough.at_s(), out);
  out.map_after_m = map_error(recording, filter, by_identity);
  return out;
}

}  // namespace wm::montecarlo
