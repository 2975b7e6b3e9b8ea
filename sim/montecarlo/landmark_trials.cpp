// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/landmark_trials.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/failure.h"
#include "common/statistics.h"
#include "montecarlo/simulated.h"
#include "simulate/angle.h"
#include "waymark/random.h"

namespace wm::montecarlo {
namespace {

constexpr double kDegree = sim::kPi / 180;
constexpr double kDriving_mps = 0.3, kWayAhead_s = 7, kCarried_m = 5;
constexpr uint64_t kPlaces = 0x1a7d;  // stream of random numbers

// Identities by how often they are seen rightly, most often first.
std::vector<int32_t> seen_most(const sim::Recording &r) {
  std::map<int32_t, size_t> counts;
  for (const sim::Sighting &s : r.sightings) counts[s.id] += !s.outlier;
  std::vector<int32_t> ids;
  for (const auto &[id, count] : counts) ids.push_back(id);
  std::stable_sort(ids.begin(), ids.end(), [&](int32_t a, int32_t b) { return counts[a] > counts[b]; });
  return ids;
}

void keep_only(const std::vector<int32_t> &ids, sim::Recording &r) {
  const auto other = [&](const auto &x) { return std::find(ids.begin(), ids.end(), x.id) == ids.end(); };
  std::erase_if(r.sightings, other);
  std::erase_if(r.map, other);
}

// A time of the drive while it moves, with enough of it ahead; drawn.
std::optional<double> moving_at(const sim::Recording &r, uint64_t stream, double from_s, double to_s) {
  for (uint64_t n = 0; n < 200; n++) {
    const double t = from_s + (to_s - from_s) * wm_random_uniform(r.seed, kPlaces + stream, n);
    if (std::fabs(r.drive.at(t).speed_mps) > kDriving_mps) return t;
  }
  return std::nullopt;
}

struct Judge {
  const sim::Recording &recording;
  double from_s;

  Sample look(const wm_estimate &e) const {
    const double t_s = seconds(recording, e.t_ns);
    const PlanarError error = error_of(e, recording.drive.at(t_s));
    Sample s{};
    s.t_s = t_s - from_s;
    s.error_m = error.position_m();
    s.error_rad = error.heading_rad();
    s.nees = error.nees();
    s.tracking = e.state == WM_STATE_TRACKING || e.state == WM_STATE_DEAD_RECKONING;
    s.lost_probability = e.lost_probability;
    return s;
  }
};

bool right(const Sample &s) { return s.tracking && s.error_m < 0.3 && s.error_rad < 5 * kDegree; }
bool confidently_wrong(const Sample &s) {
  return s.tracking && (s.error_m > 0.3 || s.error_rad > 5 * kDegree) && !(s.nees < tools::chi2_quantile(0.999, 3)) &&
         !(s.lost_probability > 0.5);
}

// Seconds of driving until it is right for 2 s, or to the end.
std::optional<double> driven_until_right(const sim::Recording &r, double from_s, const std::vector<Sample> &samples) {
  double driven = 0, since_driven = 0, since = NAN;
  for (const Sample &s : samples) {
    if (std::fabs(r.drive.at(from_s + s.t_s).speed_mps) > kDriving_mps) driven += kLook_s;
    if (!right(s)) since = NAN;
    if (right(s) && std::isnan(since)) since = s.t_s, since_driven = driven;
    if (s.t_s - since >= 2) return since_driven;
  }
  return std::nullopt;
}

}  // namespace

const std::vector<LandmarkTrial> &landmark_trials() {
  static const std::vector<LandmarkTrial> all = {
      {.name = "as-driven"},
      {.name = "start", .start = true},
      {.name = "start-false", .start = true, .false_share = 0.3},
      {.name = "start-moved", .start = true, .moved = 1},
      {.name = "start-off", .start_off_m = 1},
      {.name = "kidnap", .kidnap = true},
      {.name = "kidnap-false", .kidnap = true, .false_share = 0.3},
      {.name = "false", .false_share = 0.3},
      {.name = "misread", .misread_share = 0.1},
      {.name = "all-misread", .start = true, .misread_share = 1},
      {.name = "moved", .moved = 1},
      {.name = "one", .landmarks = 1},
      {.name = "two", .landmarks = 2},
      {.name = "start-two", .start = true, .landmarks = 2},
      {.name = "start-three", .start = true, .landmarks = 3},
  };
  return all;
}

LandmarkWorld::LandmarkWorld(const sim::Scenario &scenario, uint64_t seed) : seed_(seed) {
  wm_error error{};
  film_.scenario = scenario;
  film_.scenario.pictures.none = true;
  if (scenario.world.pictured()) {
    const sim::Scenario wanted = film_.scenario;
    check(sim::prepare(wanted, seed, film_, &error), error, "world");
  }
  driven_ = record(film_.scenario.faults);
}

sim::Recording LandmarkWorld::record(const sim::Faults &faults) {
  wm_error error{};
  const sim::Faults before = film_.scenario.faults;
  film_.scenario.faults = faults;
  if (film_.scenario.world.pictured()) {
    check(sim::record(seed_, film_, &error), error, "drive");
    check(sim::observe_pictures(film_, &error), error, "features");
  } else {
    check(sim::simulate(film_.scenario, seed_, SIZE_MAX, film_.recording, &error), error, "drive");
  }
  film_.scenario.faults = before;
  return film_.recording;
}

sim::Recording LandmarkWorld::drive(const LandmarkTrial &trial, double *at_s) {
  sim::Recording out = driven_;
  if (trial.kidnap) {
    sim::Faults faults = film_.scenario.faults;
    const double end = driven_.duration_s;
    for (uint64_t n = 0; n < 200; n++) {
      const double at = end * (0.2 + 0.3 * wm_random_uniform(seed_, kPlaces + 1, 2 * n));
      const double to = at + (end - kWayAhead_s - at) * wm_random_uniform(seed_, kPlaces + 1, 2 * n + 1);
      const sim::State a = driven_.drive.at(at), b = driven_.drive.at(to);
      if (std::fabs(b.speed_mps) < kDriving_mps || std::hypot(b.x_m - a.x_m, b.y_m - a.y_m) < kCarried_m) continue;
      faults.kidnap_at_s = *at_s = at;
      faults.kidnap_forward_s = to - at;
      out = record(faults);
      break;
    }
  }
  // Faults of detectors come on top of what was seen rightly.
  sim::Scenario more = film_.scenario;
  more.faults = {};
  more.faults.sightings_false = trial.false_share;
  more.faults.sightings_misread = trial.misread_share;
  if (trial.landmarks > 0) {
    std::vector<int32_t> ids = seen_most(out);
    ids.resize(std::min(ids.size(), static_cast<size_t>(trial.landmarks)));
    keep_only(ids, out);
  }
  if (trial.moved > 0) {
    keep_only(seen_most(out), out);  // only landmarks that are seen can be found to have moved
    more.faults.landmarks_moved = trial.moved;
    more.faults.landmarks_moved_m = 1.5;
    sim::move_landmarks(more, out);
  }
  sim::settle(more, out);
  return out;
}

LandmarkOutcome run_landmark_trial(LandmarkWorld &world, const wm_config &config, const LandmarkTrial &trial) {
  wm_error error{};
  double at_s = NAN;
  const sim::Recording recording = world.drive(trial, &at_s);
  std::vector<SmallEvent> events;
  check(make_events(recording, events, &error), error, "events");
  SimulatedFilter filter(config, recording, world.scenario().robot.wheels);
  double from_s = trial.kidnap ? at_s : 0, begin_s = 0;
  if (trial.start) {
    begin_s = moving_at(recording, 2, 0, recording.duration_s - kWayAhead_s).value_or(0);
    from_s = begin_s;
    wm_start &start = filter.setup().start;
    start.p_m[0] = start.p_m[1] = start.heading_rad = NAN;
  }
  if (trial.start_off_m > 0) {
    const double direction = 2 * sim::kPi * wm_random_uniform(recording.seed, kPlaces + 3, 0);
    filter.setup().start.p_m[0] += trial.start_off_m * std::cos(direction);
    filter.setup().start.p_m[1] += trial.start_off_m * std::sin(direction);
    filter.setup().start.sigma_xy_m = 0.05;
  }
  check(filter.init(&error), error, "init");

  LandmarkOutcome out;
  out.seed = recording.seed;
  const Judge judge{recording, from_s};
  double look_s = from_s, first_view_s = NAN, squares_m = 0, squares_deg = 0;
  wm_event e{};
  for (const SmallEvent &small : events) {
    small.get(&e);
    const double t_s = seconds(recording, e.t_ns);
    if (t_s < begin_s) continue;
    filter.take(e);
    if (!wm_event_is_motion(&e)) {
      if (t_s >= from_s && std::isnan(first_view_s)) first_view_s = t_s;
      out.moved_seen += e.kind == WM_EVENT_SIGHTING && std::find(recording.moved.begin(), recording.moved.end(),
                                                                 e.as.sighting.landmark_id) != recording.moved.end();
    }
    const wm_estimate estimate = filter.estimate();
    const bool astray = estimate.state == WM_STATE_LOST || estimate.state == WM_STATE_SEARCHING;
    if (trial.kidnap && astray && !out.detected_after_s && t_s >= first_view_s)
      out.detected_after_s = t_s - first_view_s;
    if (t_s < look_s || estimate.t_ns == WM_TIME_NONE) continue;
    look_s = t_s + kLook_s;
    const Sample s = judge.look(estimate);
    squares_m += s.error_m * s.error_m;
    squares_deg += s.error_rad * s.error_rad / (kDegree * kDegree);
    out.outcome.samples.push_back(s);
  }
  const double n = static_cast<double>(std::max<size_t>(1, out.outcome.samples.size()));
  out.rms_m = std::sqrt(squares_m / n);
  out.rms_deg = std::sqrt(squares_deg / n);
  std::vector<Sample> judged = out.outcome.samples;
  if (trial.kidnap && out.detected_after_s)
    std::erase_if(judged, [&](const Sample &s) { return from_s + s.t_s < first_view_s + *out.detected_after_s; });
  // From the look before the first one on.
  out.wrong_s = longest(judged, confidently_wrong);
  if (std::any_of(judged.begin(), judged.end(), confidently_wrong)) out.wrong_s += kLook_s;
  if (trial.start || trial.kidnap) out.right_after_s = driven_until_right(recording, from_s, out.outcome.samples);
  const wm_counter moved = filter.counter(WM_COUNTER_LANDMARKS_MOVED).value_or(wm_counter{0, -1, 0});
  out.reported_moved = static_cast<double>(moved.count);
  const int32_t last = moved.landmark_id;
  out.rightly_named =
      std::any_of(recording.moved.begin(), recording.moved.end(), [last](int32_t id) { return last == id; });
  return out;
}

}  // namespace wm::montecarlo
