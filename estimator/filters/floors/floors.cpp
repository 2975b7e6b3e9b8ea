// SPDX-License-Identifier: Apache-2.0
#include "filters/floors/floors.hpp"

#include <cmath>
#include <cstring>

#include "math/arc.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kLookEvery_s = 0.1;
// A ride takes 10 s and more, doors included; a ramp or a door is passed within a second.
constexpr double kRides_per_s = 0.1, kPasses_per_s = 1.0;
// Slower, the robot stands in the lift: below the noise of wheels and gyros that stand, above it are no rides.
constexpr double kStands_mps = 0.05, kStands_radps = 0.05, kStandsFor_s = 1.0;
constexpr double kAreaSigmas = 2.0;  // of the place, beside the area's radius
// A floor in doubt whose filter is contradicted takes up the pose again, so often, while the robot may still change.
constexpr double kContradicted = 0.01, kRefreshEvery_s = 1.0;
constexpr double kDecided = 1e-4;  // the others' probability in all, below which they are closed
constexpr double kSure = 0.99;     // below, the state is DEGRADED
constexpr double kClearly = 2.0;   // times as likely as the present floor is another one that becomes it
// Carried to another floor unnoticed: once in a thousand identities that only another floor has (others are misread);
// one in ten of the robots that have been lost for kLostFor_s.
constexpr double kCarried = 1e-3, kLostElsewhere = 0.1, kLostFor_s = 2.0;

bool has_place(const wm_estimate &e) { return e.state == WM_STATE_TRACKING || e.state == WM_STATE_DEAD_RECKONING; }

bool stands(const wm_estimate &e) {
  return std::fabs(e.v_mps[0]) < kStands_mps && std::fabs(e.v_mps[1]) < kStands_mps &&
         std::fabs(e.w_radps[2]) < kStands_radps;
}

int64_t key_of(const wm_event &event) {
  const int32_t id = event.kind == WM_EVENT_SIGHTING ? event.as.sighting.landmark_id : event.as.marker.id;
  return (static_cast<int64_t>(event.source) << 32) + id;
}

}  // namespace

size_t floors::bytes(const void *params, const wm_setup &setup, const char **why) {
  const wm_floor_plan &plan = *setup.floors;
  memory_layout layout(nullptr, sizeof(floors));
  for (size_t i = 0; i < plan.count; i++) {
    const size_t own = plan.estimator->state_bytes(params, &plan.setups[i], why);
    if (own == 0) return 0;
    layout.take<uint8_t>(own);
  }
  return layout.bytes();
}

wm_status floors::init(const void *params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  plan_ = setup.floors;
  carrier_ = wm_carrier_of(plan_->estimator);
  memory_layout layout(this, sizeof *this);
  for (int i = 0; i < count(); i++) {
    const wm_setup *own = &plan_->setups[i];
    const char *why;
    state_[i].set(layout.take<uint8_t>(inner().state_bytes(params, own, &why)));
    if (const wm_status status = inner().init(state(i), params, own); status != WM_OK) return status;
  }
  belief_.begin(count());
  if (plan_->start >= 0) belief_.decide(static_cast<int>(plan_->start));
  here_ = belief_.most_probable();
  looked_ns_ = lost_ns_ = stood_ns_ = refreshed_ns_ = WM_TIME_NONE;
  return WM_OK;
}

void floors::carry(int to, const wm_pose2 *by) { carrier_->carry(state(to), state(here()), by); }

// By a connection of both floors; without one the robot may be anywhere there.
void floors::carry_along(int to, const wm_estimate &e) {
  wm_pose2 by;
  const bool there = wm_floor_way(plan_, here(), to, e.pose_map_base.p_m[0], e.pose_map_base.p_m[1], &by) != 0;
  carry(to, there && e.state != WM_STATE_SEARCHING ? &by : nullptr);
}

wm_status floors::predict(const wm_event &motion) {
  wm_status status = WM_OK;
  for (int i = 0; i < count(); i++) {
    if (!belief_.is_open(i)) continue;
    const wm_status own = inner().predict(state(i), &motion);
    if (i == here()) status = own;
  }
  if (status == WM_OK) look_around(motion.t_ns);
  return status;
}

wm_status floors::correct(const wm_event &event, wm_innovation *out, size_t capacity, size_t *count_out) {
  *count_out = 0;
  if (event.kind == WM_EVENT_SET_FLOOR) return set_floor(event);
  if (event.kind == WM_EVENT_SET_POSE || event.kind == WM_EVENT_RESET) return take_pose(event);
  wm_innovation first[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count_here;
  const wm_status status = inner().correct(state(here()), &event, first, WM_INNOVATIONS_PER_EVENT_MAX, &count_here);
  *count_out = count_here < capacity ? count_here : capacity;
  for (size_t k = 0; out && k < *count_out; k++) out[k] = first[k];
  if (status != WM_OK) return status;
  for (int i = 0; i < count(); i++) {
    wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t ignored;
    if (i != here() && belief_.is_open(i))
      (void)inner().correct(state(i), &event, records, WM_INNOVATIONS_PER_EVENT_MAX, &ignored);
  }
  if (count_here > 0 && first[0].verdict == WM_REJECTED_UNKNOWN_ID && first[0].landmark_id >= 0)
    open_where_known(event, first[0].landmark_id);
  const bool is_of_map = event.kind == WM_EVENT_SIGHTING || event.kind == WM_EVENT_MARKER;
  if (is_of_map && !belief_.is_decided()) weigh(event);
  return WM_OK;
}

// An identity that only other floors have: the robot may have been carried there. Where the floors' axes are known to
// each other, to the same place, if that fits; else its pose is searched there.
void floors::open_where_known(const wm_event &event, int32_t id) {
  wm_estimate e;
  std::memset(&e, 0, sizeof e);
  inner().estimate(state(), &e);
  for (int i = 0; i < count(); i++) {
    const wm_setup &there = plan_->setups[i];
    bool known = false;
    for (size_t k = 0; k < there.landmark_count && !known; k++) known = there.landmarks[k].id == id;
    if (!known || belief_.is_open(i)) continue;
    wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t known_rows = 0;
    carry_along(i, e);
    belief_.open(i, kCarried);
    (void)inner().correct(state(i), &event, records, WM_INNOVATIONS_PER_EVENT_MAX, &known_rows);
    if (known_rows > 0 && records[0].verdict == WM_FUSED) continue;
    carry(i, nullptr);  // at another place
    (void)inner().correct(state(i), &event, records, WM_INNOVATIONS_PER_EVENT_MAX, &known_rows);
  }
}

void floors::weigh(const wm_event &event) {
  double misfit[WM_FLOORS_MAX] = {};
  bool shows = false;
  for (int i = 0; i < count(); i++) {
    if (!belief_.is_open(i)) continue;
    misfit[i] = carrier_->misfit(state(i));
    if (std::isnan(misfit[i])) return;
    shows |= misfit[i] != 0.0;
  }
  if (!shows) return;
  belief_.weigh(event.t_ns, key_of(event), misfit);
  choose();
}

void floors::choose() {
  const int best = belief_.most_probable();
  if (belief_.probability(best) > kClearly * belief_.probability(here())) here_ = best;
}

// Once in kLookEvery_s: opens the floors to which the pose allows a change, or decides for the present one.
void floors::look_around(wm_time_ns t_ns) {
  const double dt_s = looked_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(looked_ns_, t_ns);
  if (looked_ns_ != WM_TIME_NONE && dt_s < kLookEvery_s) return;
  looked_ns_ = t_ns;
  wm_estimate e;
  std::memset(&e, 0, sizeof e);
  inner().estimate(state(), &e);
  if (e.state != WM_STATE_LOST)
    lost_ns_ = WM_TIME_NONE;
  else if (lost_ns_ == WM_TIME_NONE)
    lost_ns_ = t_ns;
  for (int i = 0; lost_ns_ != WM_TIME_NONE && wm_seconds_between(lost_ns_, t_ns) > kLostFor_s && i < count(); i++) {
    if (belief_.is_open(i)) continue;
    carry(i, nullptr);
    belief_.open(i, kLostElsewhere / count());
  }
  if (!stands(e)) stood_ns_ = WM_TIME_NONE;
  if (stands(e) && stood_ns_ == WM_TIME_NONE) stood_ns_ = t_ns;
  const bool rides = stood_ns_ != WM_TIME_NONE && wm_seconds_between(stood_ns_, t_ns) > kStandsFor_s;
  const ways from = ways_from(e, rides);
  if (from.floors != 0) {
    open_ways(from, e, t_ns);
    belief_.change(from.floors, from.rate_per_s, dt_s);
    choose();
  } else if (!belief_.is_decided() && lost_ns_ == WM_TIME_NONE && belief_.probability(here()) > 1.0 - kDecided) {
    belief_.decide(here());
  }
}

floors::ways floors::ways_from(const wm_estimate &e, bool rides) const {
  ways out{};
  if (!has_place(e)) return out;
  const double *p = e.pose_map_base.p_m;
  const double sigma_m = std::sqrt(e.covariance[wm_cov_index(0, 0)] + e.covariance[wm_cov_index(1, 1)]);
  for (size_t i = 0; i < plan_->end_count; i++) {
    const wm_floor_end &end = plan_->ends[i];
    if (end.floor != here_ || (end.kind == WM_CONNECTION_LIFT && !rides)) continue;
    const double reach_m = end.radius_m + kAreaSigmas * sigma_m;
    if (square(p[0] - end.x_m) + square(p[1] - end.y_m) > square(reach_m)) continue;
    for (size_t k = 0; k < plan_->end_count; k++)
      if (plan_->ends[k].connection == end.connection) out.floors |= UINT64_C(1) << plan_->ends[k].floor;
    const double rate = end.kind == WM_CONNECTION_LIFT ? kRides_per_s : kPasses_per_s;
    if (rate > out.rate_per_s) out.rate_per_s = rate;
  }
  return out;
}

void floors::open_ways(const ways &from, const wm_estimate &e, wm_time_ns t_ns) {
  const bool refreshes = refreshed_ns_ == WM_TIME_NONE || wm_seconds_between(refreshed_ns_, t_ns) > kRefreshEvery_s;
  if (refreshes) refreshed_ns_ = t_ns;
  for (int i = 0; i < count(); i++) {
    if (i == here() || !(from.floors >> i & 1u)) continue;
    const bool is_new = !belief_.is_open(i);
    if (is_new || (refreshes && belief_.probability(i) < kContradicted)) carry_along(i, e);
    if (is_new) belief_.open(i, 0.0);
  }
}

wm_status floors::set_floor(const wm_event &event) {
  const int to = event.as.set_floor.floor;
  if (to < 0 || to >= count()) return WM_OUT_OF_RANGE;
  wm_event looked = event;  // the filter goes to the command's time
  looked.kind = WM_EVENT_LOOKED;
  size_t ignored;
  const wm_status status = inner().correct(state(here()), &looked, nullptr, 0, &ignored);
  if (status != WM_OK) return status;
  if (to != here()) {
    wm_estimate e;
    std::memset(&e, 0, sizeof e);
    inner().estimate(state(), &e);
    carry_along(to, e);
  }
  here_ = to;
  belief_.decide(to);
  return WM_OK;
}

// A pose is stated on the axes of the present floor. Where others may be the robot's, it goes along to them.
wm_status floors::take_pose(const wm_event &event) {
  size_t ignored;
  const bool resets = event.kind == WM_EVENT_RESET;
  const int start = static_cast<int>(plan_->start);
  for (int i = 0; resets && i < count(); i++)
    if (i != here() && (start < 0 || i == start)) carry(i, nullptr);
  if (resets && start >= 0) {
    here_ = start;
    belief_.decide(start);
  } else if (resets) {
    belief_.begin(count());
  }
  const wm_status status = inner().correct(state(here()), &event, nullptr, 0, &ignored);
  if (status != WM_OK) return status;
  wm_estimate e;
  std::memset(&e, 0, sizeof e);
  inner().estimate(state(), &e);
  for (int i = 0; i < count(); i++) {
    if (i == here() || !belief_.is_open(i)) continue;
    if (resets)
      (void)inner().correct(state(i), &event, nullptr, 0, &ignored);
    else
      carry_along(i, e);
  }
  return WM_OK;
}

void floors::estimate(wm_estimate *out) const {
  inner().estimate(state(), out);
  if (belief_.is_decided()) return;
  const double p = probability();
  out->lost_probability = 1.0 - (1.0 - out->lost_probability) * p;
  if (p >= kSure || !has_place(*out)) return;
  out->state = WM_STATE_DEGRADED;
  out->cause = WM_CAUSE_FLOOR;
  out->cause_source = -1;
}

}  // namespace wm

int wm_floor_way(const wm_floor_plan *plan, int from, int to, double x_m, double y_m, wm_pose2 *out) {
  double nearest_m2 = HUGE_VAL;
  for (size_t i = 0; i < plan->end_count; i++)
    for (size_t k = 0; k < plan->end_count; k++) {
      const wm_floor_end &a = plan->ends[i], &b = plan->ends[k];
      if (a.connection != b.connection || a.floor != from || b.floor != to) continue;
      const double away_m2 = wm::square(x_m - a.x_m) + wm::square(y_m - a.y_m);
      if (!(away_m2 < nearest_m2)) continue;
      nearest_m2 = away_m2;
      const wm_pose2 end = {a.x_m, a.y_m, a.heading_rad}, there = {b.x_m, b.y_m, b.heading_rad};
      *out = wm::compose(there, wm::between(end, {0.0, 0.0, 0.0}));
    }
  return nearest_m2 < HUGE_VAL;
}

// What the estimator lists of itself is that of the most probable floor.
#define WM_FORWARD(name, values, ...)                                \
  if (inner.name)                                                    \
  out->name = [](const void *state, __VA_ARGS__, size_t capacity) {  \
    const wm::floors *self = static_cast<const wm::floors *>(state); \
    return self->inner().name values;                                \
  }
static void list_of_present(const wm_estimator &inner, wm_estimator *out) {
  WM_FORWARD(calibration, (self->state(), at, capacity), wm_calibration_value * at);
  WM_FORWARD(alarms, (self->state(), at, capacity), wm_alarm * at);
  WM_FORWARD(counters, (self->state(), at, capacity), wm_counter * at);
  WM_FORWARD(landmarks, (self->state(), at, covariance, capacity), wm_landmark * at, double(*covariance)[4]);
  WM_FORWARD(particles, (self->state(), at, capacity), wm_particle * at);
  WM_FORWARD(hypotheses, (self->state(), at, capacity), wm_hypothesis * at);
}
#undef WM_FORWARD

void wm_estimator_over_floors(const wm_estimator *inner, wm_estimator *out) {
  using wm::floors;
  *out = *inner;
  out->takes |= WM_EVENT_BIT(WM_EVENT_SET_FLOOR);
  out->state_bytes = [](const void *params, const wm_setup *setup, const char **why) {
    return floors::bytes(params, *setup, why);
  };
  out->init = [](void *state, const void *params, const wm_setup *setup) {
    return static_cast<floors *>(state)->init(params, *setup);
  };
  out->predict = [](void *state, const wm_event *motion) { return static_cast<floors *>(state)->predict(*motion); };
  out->correct = [](void *state, const wm_event *event, wm_innovation *records, size_t capacity, size_t *count) {
    return static_cast<floors *>(state)->correct(*event, records, capacity, count);
  };
  out->estimate = [](const void *state, wm_estimate *e) { static_cast<const floors *>(state)->estimate(e); };
  out->floor = [](const void *state, double *probability) {
    *probability = static_cast<const floors *>(state)->probability();
    return static_cast<const floors *>(state)->here();
  };
  // Of the most probable floor.
  out->motion = [](const void *state, wm_motion_calibration *calibration) {
    const floors *self = static_cast<const floors *>(state);
    self->inner().motion(self->state(), calibration);
  };
  out->motion_health = [](const void *state) {
    const floors *self = static_cast<const floors *>(state);
    return self->inner().motion_health(self->state());
  };
  list_of_present(*inner, out);
}
