// SPDX-License-Identifier: Apache-2.0
// Tests of a source's recent innovations, each at kAlarm: the share that gates refuse (binomial), the mean square
// over the variance (chi-square), the mean over sigma (normal) [BarShalom2001, ch. 5.4]. Observations of one slot count
// as one of each landmark, since their errors are correlated. An adapted noise hides what it explains: one at its limit
// fails a test as well. Failed tests are time of doubt; observations that fit make up for it.
#include "waymark/monitor.h"

#include <cmath>
#include <cstring>

#include "filters/core/chi_square.hpp"
#include "filters/core/course_test.hpp"
#include "filters/core/landmark_bias.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

// Probability that a test fails although the pose is right. Tests overlap: windows of 2, 5 and 10 s are about 2900
// independent ones an hour and kind, so that a source raises less than one false alarm an hour; it lasts some 10 s.
constexpr double kAlarm_log = 9.21;  // -log(1e-4)
constexpr double kAlarm_z2 = 3.89;   // two-sided
// Correlation time of the errors of sightings (as in landmark_evidence.cpp) and of positions (multipath passes in 5 s).
constexpr double kSlot_s = 0.3, kPositionSlot_s = 5.0;
// Windows, in slots; of sightings 2, 5 and 10 s. A window of sparse observations reaches back at most three times as
// far as one of dense ones.
constexpr int kWindows[] = {6, 16, 33};
constexpr double kSparse = 3.0;
// Landmarks of one picture share errors of calibration; more than four count as four.
constexpr double kTogether = 4.0;
constexpr double kFalseShare = 0.2;    // of detections that a good run's gates refuse (landmark_evidence.cpp)
constexpr double kUnknownShare = 0.5;  // of identities that a good map lacks
constexpr double kStated = 1.5;        // innovations' variance over the stated one, in good runs at most 1.34
// Doubt. It needs 10 s of contradiction for LOST; fitting observations take it back at a third of that rate, since a
// wrong pose fits by chance in between. It stays below 30 s, so that a pose that fits again is back within a minute.
constexpr double kLostAfter_s = 10.0, kFitRate = 1.0 / 3.0, kMostDoubt_s = 30.0;
// A mean of innovations within their gates and their variance bends a map that the filter makes itself, and the pose on
// it by no more than they are off: degraded, not lost. dlr-a with the covariances of its source: ranges and way differ
// by a tenth, and the map is right to 0.2 m.
constexpr double kMostMild_s = 3.0;
// A run that was contradicted for long has a fault that no search finds, such as a mirrored map, and fits by chance now
// and then. Beyond kExcused_s each further kSuspect_s of contradiction count as much as all fitting ones: they weigh
// less by that. Half of the time is doubt of a pose that is found then. Ten times as long without doubt makes up for
// it.
constexpr double kExcused_s = 10.0, kSuspect_s = 10.0, kMostContradicted_s = 600.0, kForgiveRate = 0.1;
constexpr double kFresh_s = 1.0;      // observations within this time are present ones
constexpr double kSilent_s = 2.0;     // an observing source without data for so long is silent
constexpr double kStep_s = 0.3;       // between two steps: that of the slots
constexpr double kLongStep_s = 1.0;   // longer ones count as this
constexpr double kFoundWrong = 0.08;  // probability that a contradicted or a found pose is wrong (recovery.hpp: -2.5)
// A pose that a search found is on probation until it has fitted for kProbation_s, if the one found before was lost
// within kAgain_s, or if the one before did not fit for kProven_s more than it was contradicted. Each further one of
// these is on probation for as much longer. What fitted more than kLongAgo_s ago does not count.
constexpr double kProbation_s = 3.0, kAgain_s = 60.0, kProven_s = 5.0, kLongAgo_s = 60.0;
// A start that is contradicted before the robot drove for kProof_s in agreement may be wrong; so may map, sensors and
// motion. A pose that is found then is degraded until it has fitted for kProof_s of driving: wrong ones fit by chance,
// at rest for as long as that lasts, and along a corridor for 28 s (corridor-a, plan mirrored).
constexpr double kProof_s = 40.0, kDrives_mps = 0.05, kDrives_radps = 0.05;
// Lost for so long, the filter's covariance is inflated, and what fits again is another pose (lifecycle.hpp).
constexpr double kInflated_s = 3.0;
constexpr double kAround_m = 5.0;   // sigma of a lost robot's distance from the map (landmark_ekf.cpp)
constexpr double kOutside_m = 5.0;  // beyond the map's border and three sigma
constexpr double kNear = 9.0;       // three sigma, squared

using slot = wm_monitor_slot;
using source = wm_monitor_source;

double slot_s_of(const wm_innovation &i) {
  const bool is_place = i.landmark_id < 0 && (i.residual == WM_RESIDUAL_X || i.residual == WM_RESIDUAL_Y ||
                                              i.residual == WM_RESIDUAL_Z || i.residual == WM_RESIDUAL_HEADING);
  return is_place ? kPositionSlot_s : kSlot_s;
}

// The slot `age` before the newest one.
const slot &slot_at(const source &s, int age) {
  return s.slots[(s.opened - 1 - static_cast<uint64_t>(age)) % WM_MONITOR_SLOTS];
}

int kind_of(source *s, uint8_t residual) {
  for (uint32_t k = 0; k < s->kinds; k++)
    if (s->residual[k] == residual) return static_cast<int>(k);
  if (s->kinds == WM_MONITOR_KINDS) return -1;
  s->residual[s->kinds] = residual;
  return static_cast<int>(s->kinds++);
}

void add_scalar(source *s, slot *to, const wm_innovation &i) {
  const int kind = kind_of(s, i.residual);
  if (kind < 0 || !(i.variance > 0.0)) return;
  const bool is_angle = i.residual == WM_RESIDUAL_BEARING || i.residual == WM_RESIDUAL_HEADING;
  const double off = is_angle ? wrap(i.observed - i.expected) : i.observed - i.expected;
  const double normalised = off / std::sqrt(i.variance);
  if (!finite(normalised)) return;
  to->sum[kind] += normalised;
  to->squares += square(normalised);
  to->fused[kind]++;
  to->scalars++;
}

slot *open_slot(source *s, wm_time_ns t_ns, double slot_s) {
  if (s->opened == 0 || wm_seconds_between(slot_at(*s, 0).begin_ns, t_ns) >= slot_s) {
    slot *next = &s->slots[s->opened++ % WM_MONITOR_SLOTS];
    *next = {};
    next->begin_ns = t_ns;
    next->newest_ns = WM_TIME_NONE;
  }
  slot *now = &s->slots[(s->opened - 1) % WM_MONITOR_SLOTS];
  now->stamps += now->newest_ns != t_ns;
  now->newest_ns = t_ns;
  s->slot_s = slot_s;
  return now;
}

// One observation: its scalar updates are one, of which a share was refused.
void add_observation(source *s, const wm_event &event, const wm_innovation *records, size_t count) {
  int fused = 0, refused = 0, unknown = 0;
  for (size_t i = 0; i < count; i++) {
    fused += records[i].verdict == WM_FUSED && records[i].residual != WM_RESIDUAL_STANDSTILL;
    refused += records[i].verdict == WM_REJECTED_GATE;
    unknown += records[i].verdict == WM_REJECTED_UNKNOWN_ID;
  }
  const int all = fused + refused + unknown;
  if (all == 0) return;
  slot *to = open_slot(s, event.t_ns, slot_s_of(records[0]));
  to->observations++;
  to->refused += static_cast<double>(refused) / all;
  to->unknown += static_cast<double>(unknown) / all;
  for (size_t i = 0; i < count; i++)
    if (records[i].verdict == WM_FUSED && records[i].residual != WM_RESIDUAL_STANDSTILL) add_scalar(s, to, records[i]);
}

// Sums over a window. `slots`, `filled` with fused innovations, `gated` with observations of known landmarks.
struct window {
  int slots, filled, gated, of[WM_MONITOR_KINDS];
  double refused, unknown, squares, mean[WM_MONITOR_KINDS];
  double scalars[WM_MONITOR_KINDS], stamps, observations;
};

void add_slot(const slot &s, window *w) {
  w->slots++;
  w->stamps += s.stamps;
  w->observations += s.observations;
  w->unknown += s.unknown / s.observations;
  if (const double known = s.observations - s.unknown; known > 0.0) {
    w->gated++;
    w->refused += s.refused / known;
  }
  if (s.scalars == 0) return;
  w->filled++;
  w->squares += s.squares / s.scalars;
  for (int k = 0; k < WM_MONITOR_KINDS; k++) {
    if (s.fused[k] == 0) continue;
    w->of[k]++;
    w->mean[k] += s.sum[k] / s.fused[k];
    w->scalars[k] += s.fused[k];
  }
}

// The last `slots` ones that are complete.
window window_of(const source &s, int slots, wm_time_ns t_ns) {
  window w{};
  const int kept = s.opened < WM_MONITOR_SLOTS ? static_cast<int>(s.opened) : WM_MONITOR_SLOTS;
  const int first = kept > 0 && wm_seconds_between(slot_at(s, 0).begin_ns, t_ns) < s.slot_s ? 1 : 0;
  const double reach_s = kSparse * slots * s.slot_s;
  for (int age = first; age < kept && w.slots < slots; age++) {
    if (wm_seconds_between(slot_at(s, age).begin_ns, t_ns) > reach_s) break;
    add_slot(slot_at(s, age), &w);
  }
  return w;
}

// Observations of one stamp, as far as their errors are independent.
double together(double count, double stamps) {
  const double m = count / stamps;
  return m < 1.0 ? 1.0 : m > kTogether ? kTogether : m;
}

// Chernoff's bound of P(at least `sum` of n | p) is below that of an alarm.
bool is_too_large_a_share(double sum, int n, double p) {
  if (n == 0) return false;
  const double share = sum / n;
  if (share <= p) return false;
  const double divergence =
      share * log(share / p) + (share < 1.0 ? (1.0 - share) * log((1.0 - share) / (1.0 - p)) : 0.0);
  return n * divergence > kAlarm_log;
}

bool is_biased(const window &w) {
  for (int k = 0; k < WM_MONITOR_KINDS; k++) {
    if (w.of[k] == 0) continue;
    const double n = w.of[k] * together(w.scalars[k], w.stamps);
    if (std::fabs(w.mean[k] / w.of[k]) * std::sqrt(n / kStated) > kAlarm_z2) return true;
  }
  return false;
}

wm_cause cause_of(const window &w) {
  if (is_too_large_a_share(w.refused, w.gated, kFalseShare)) return WM_CAUSE_REFUSED;
  const double m = together(w.observations, w.stamps);
  if (w.filled > 0 && w.squares * m / kStated > chi_square_limit(w.filled * m)) return WM_CAUSE_INCONSISTENT;
  return is_biased(w) ? WM_CAUSE_BIASED : WM_CAUSE_NONE;
}

struct verdict_of_source {
  wm_cause cause;
  bool is_unknown, fits;
};

// `fits`: enough observations of late, and no test fails. Of a run that was contradicted for long, no more may be
// refused than in a good one; the test alone would need many more to fail.
verdict_of_source test(const source &s, wm_time_ns t_ns, bool is_suspect) {
  verdict_of_source out{WM_CAUSE_NONE, false, false};
  if (s.opened == 0) return out;
  const double age_s = wm_seconds_between(slot_at(s, 0).newest_ns, t_ns);
  if (age_s > larger(kFresh_s, 2.0 * s.slot_s)) return out;
  window w{};
  for (const int slots : kWindows) {
    w = window_of(s, slots, t_ns);
    if (w.slots > 0 && out.cause == WM_CAUSE_NONE) out.cause = cause_of(w);
    out.is_unknown = out.is_unknown || (w.filled == 0 && is_too_large_a_share(w.unknown, w.slots, kUnknownShare));
  }
  out.fits = out.cause == WM_CAUSE_NONE && (w.filled > 0 || slot_at(s, 0).scalars > 0) &&
             !(is_suspect && w.refused > kFalseShare * w.gated);
  return out;
}

void clear_windows(wm_monitor *self) {
  landmark_bias_clear(&self->landmarks);
  for (source &s : self->sources) {
    s.opened = 0;
    s.cause = WM_CAUSE_NONE;
  }
}

void clear(wm_monitor *self) {
  clear_windows(self);
  self->is_calibration_contradicted = 0;
  self->doubt_s = self->fitted_s = self->since_found_s = self->contradicted_s = self->proof_s = self->lost_s = 0.0;
  self->cause = WM_CAUSE_NONE;
  self->source = self->silent = -1;
  self->found = self->is_unsupported = self->is_outside = self->was_lost = self->is_probation = self->is_found_early =
      0;
  self->stepped_ns = WM_TIME_NONE;  // the next step takes the number of resets as it is
}

void widen_box(wm_monitor *self, double x_m, double y_m) {
  const double p[2] = {x_m, y_m};
  for (int k = 0; k < 2; k++) {
    if (!(p[k] >= self->low_m[k])) self->low_m[k] = p[k];
    if (!(p[k] <= self->high_m[k])) self->high_m[k] = p[k];
  }
  self->spread_m2 =
      square(kAround_m) + (square(self->high_m[0] - self->low_m[0]) + square(self->high_m[1] - self->low_m[1])) / 24.0;
}

// Of a pose that was found before any was proven.
double least_doubt_s(const wm_monitor &self) {
  return self.is_found_early && self.proof_s < kProof_s ? kProbation_s : 0.0;
}

// The search found another pose: what contradicted the former one does not count against it.
void take_found(wm_monitor *self, bool was_lost) {
  clear_windows(self);
  if (!was_lost) return;
  if (self->proof_s < kProof_s) {
    self->is_found_early = 1;
    self->proof_s = 0.0;
  }
  const bool again = self->found > 0 && self->since_found_s < kAgain_s;
  self->is_probation = again || self->fitted_s < kProven_s || self->contradicted_s > kExcused_s;
  if (!self->is_probation) self->found = 0;
  const double probation_s = kProbation_s * larger(self->found, 1.0) + 0.5 * self->contradicted_s;
  self->doubt_s = !self->is_probation ? least_doubt_s(*self) : probation_s < kLostAfter_s ? probation_s : kLostAfter_s;
  self->cause = self->doubt_s > 0.0 ? WM_CAUSE_LOST_AGAIN : WM_CAUSE_NONE;
  self->source = -1;
  self->found++;
  self->since_found_s = self->fitted_s = 0.0;
}

bool is_outside(const wm_monitor &self, const wm_estimate &e) {
  if (self.is_map_known != 2) return false;
  for (int k = 0; k < 2; k++) {
    const double p = e.pose_map_base.p_m[k];
    const double off = larger(self.low_m[k] - p, p - self.high_m[k]) - kOutside_m;
    if (off > 0.0 && square(off) > kNear * e.covariance[wm_cov_index(k, k)]) return true;
  }
  return false;
}

// The observing source that is silent for longest, since its last datum or since the start.
int32_t silent_source(const wm_monitor &self, wm_time_ns t_ns) {
  int32_t longest = -1;
  double most_s = kSilent_s;
  if (t_ns == WM_TIME_NONE) return longest;  // the estimate has no time yet
  for (int32_t i = 0; i < WM_MONITOR_SOURCES; i++) {
    if ((self.observers >> i & 1u) == 0) continue;
    const wm_time_ns newest = self.sources[i].newest_ns;
    const double silent_s = wm_seconds_between(newest == WM_TIME_NONE ? self.begun_ns : newest, t_ns);
    if (silent_s <= most_s) continue;
    most_s = silent_s;
    longest = i;
  }
  return longest;
}

// Sources in disagreement raise the noise of the motion, or of one of them, as far as it may grow. In 25 good drives,
// real and simulated, the largest factor is 15.5 (plaza-1).
// Or they bend a scale, or the lasting error of positions, far from what the configuration states. Where no map and no
// position gives a length, less is enough: the map has the scale of either of two that contradict each other.
bool test_calibration(wm_monitor *self, const wm_alarm *alarms, size_t count) {
  self->is_calibration_contradicted = 0;
  for (size_t i = 0; i < count; i++) {
    if (alarms[i].kind == WM_ALARM_TURN || alarms[i].kind == WM_ALARM_LOCALIZER) continue;  // the latter is left out
    const bool is_decided_by_others = alarms[i].kind == WM_ALARM_LENGTHS && (self->is_map_known || self->has_positions);
    if (!is_decided_by_others) self->is_calibration_contradicted = 1;
  }
  if (!self->is_calibration_contradicted) return false;
  self->cause = WM_CAUSE_INCONSISTENT;
  self->source = -1;
  return true;
}

// The sign or the unit of the measured turn, by the innovations or by positions.
bool test_turn(wm_monitor *self, const wm_alarm *alarms, size_t count) {
  bool contradicts = course_contradicts(self->course);
  for (size_t i = 0; i < count; i++) contradicts = contradicts || alarms[i].kind == WM_ALARM_TURN;
  if (!contradicts) return false;
  self->cause = WM_CAUSE_TURN;
  self->source = -1;
  return true;
}

// Innovations of several landmarks that have a mean. Landmarks that a filter has placed itself are off for long where a
// line of sight is all that it has.
bool test_landmarks(wm_monitor *self, wm_time_ns t_ns) {
  if (self->is_map_known != 1) return false;
  landmark_bias_test(&self->landmarks, t_ns);
  if (!landmark_bias_contradicts(self->landmarks)) return false;
  self->cause = WM_CAUSE_BIASED;
  self->source = -1;
  return true;
}

// The sources' tests. Returns whether one contradicts; *fits: one fits; *mild: none does more than bend a map.
bool test_sources(wm_monitor *self, wm_time_ns t_ns, bool *fits, bool *mild) {
  bool contradicts = false;
  *fits = false;
  *mild = !self->is_map_known && !self->has_positions;
  self->is_unsupported = 0;
  for (int32_t i = 0; i < WM_MONITOR_SOURCES; i++) {
    source &s = self->sources[i];
    const verdict_of_source v = test(s, t_ns, self->contradicted_s > kExcused_s);
    s.cause = static_cast<uint8_t>(v.cause);
    *fits = *fits || v.fits;
    *mild = *mild && (v.cause == WM_CAUSE_NONE || v.cause == WM_CAUSE_BIASED);
    if (v.cause != WM_CAUSE_NONE && !contradicts) {
      contradicts = true;
      self->cause = v.cause;
      self->source = i;
    } else if (v.is_unknown && !contradicts && self->doubt_s <= 0.0) {
      self->is_unsupported = 1;
      self->cause = WM_CAUSE_UNKNOWN;
      self->source = i;
    }
  }
  return contradicts;
}

void count_contradicted(wm_monitor *self, bool contradicts, bool fits, double dt_s) {
  double &sum = self->contradicted_s;
  if (contradicts || self->was_lost) sum = sum + dt_s < kMostContradicted_s ? sum + dt_s : kMostContradicted_s;
  if (fits && !contradicts && self->doubt_s <= 0.0) sum = larger(sum - kForgiveRate * dt_s, 0.0);
}

void count_doubt(wm_monitor *self, bool contradicts, bool fits, bool is_mild, double dt_s) {
  if (contradicts) {
    self->is_probation = 0;
    self->fitted_s = larger(self->fitted_s - dt_s, 0.0);
    // Where another source fits, either may be wrong: degraded, not lost.
    const double most_s = is_mild ? kMostMild_s : fits ? kLostAfter_s : kMostDoubt_s;
    if (self->doubt_s < most_s)
      self->doubt_s = self->doubt_s + dt_s < most_s ? self->doubt_s + dt_s : most_s;
    else if (is_mild)
      self->doubt_s = larger(self->doubt_s - kFitRate * dt_s, most_s);
    return;
  }
  if (!fits) return;
  const double weight = 1.0 / (1.0 + larger(self->contradicted_s - kExcused_s, 0.0) / kSuspect_s);
  self->fitted_s = self->fitted_s < kLongAgo_s ? self->fitted_s + dt_s : kLongAgo_s;
  const double left_s = self->doubt_s - (self->is_probation ? 1.0 : kFitRate) * weight * dt_s;
  self->doubt_s = larger(left_s, least_doubt_s(*self));
}

// Time of driving in agreement with the observations. Contradictions before kProof_s begin it anew.
void count_proof(wm_monitor *self, const wm_estimate &e, bool contradicts, bool fits, double dt_s) {
  if (self->proof_s >= kProof_s) return;
  const bool drives =
      square(e.v_mps[0]) + square(e.v_mps[1]) > square(kDrives_mps) || std::fabs(e.w_radps[2]) > kDrives_radps;
  if (contradicts)
    self->proof_s = 0.0;
  else if (fits && drives)
    self->proof_s += dt_s;
}

// Turn or positions may be mirrored: the covariance of the mixture with the pose that is right then.
void weigh_mirror_image(wm_monitor *self, const wm_estimate &e) {
  const double chance = course_mirrored(self->course);
  const wm_pose2 image = course_mirror_image(self->course);
  self->mirrored_m2 = self->mirrored_rad2 = 0.0;
  if (!(chance > 0.0)) return;
  self->mirrored_m2 =
      chance * (square(image.x_m - e.pose_map_base.p_m[0]) + square(image.y_m - e.pose_map_base.p_m[1]));
  self->mirrored_rad2 = chance * square(wrap(image.heading_rad - e.heading_rad));
}

// The covariance of the mixture of this pose and one anywhere on the map; a filter that has widened its own keeps it.
void widen(const wm_monitor &self, double wrong, wm_estimate *e) {
  constexpr int kAxes[] = {0, 1, 5};
  for (const int axis : kAxes) {
    const double more = wrong * (axis == 5 ? square(kPi) / 3.0 : self.spread_m2);
    double &variance = e->covariance[wm_cov_index(axis, axis)];
    if (variance < more) variance += more;
  }
}

}  // namespace
}  // namespace wm

void wm_monitor_init(wm_monitor *self, const wm_setup *setup, uint64_t observers) {
  std::memset(self, 0, sizeof *self);
  self->observers = observers;
  self->begun_ns = self->next_ns = WM_TIME_NONE;
  for (wm_monitor_source &s : self->sources) s.newest_ns = WM_TIME_NONE;
  for (int k = 0; k < 2; k++) self->low_m[k] = self->high_m[k] = NAN;
  if (setup->map) {
    const wm_raster &map = *setup->map;
    const double width_m = map.width_px * map.resolution_m, height_m = map.height_px * map.resolution_m;
    const wm::sin_cos turn = wm::sincos(map.origin_yaw_rad);
    for (int corner = 0; corner < 4; corner++) {
      const double x = corner & 1 ? width_m : 0.0, y = corner & 2 ? height_m : 0.0;
      wm::widen_box(self, map.origin_x_m + turn.cos * x - turn.sin * y, map.origin_y_m + turn.sin * x + turn.cos * y);
    }
    self->is_map_known = 2;
  } else {
    for (size_t i = 0; i < setup->landmark_count; i++)
      wm::widen_box(self, setup->landmarks[i].p_m[0], setup->landmarks[i].p_m[1]);
    self->is_map_known = setup->landmark_count > 0;
  }
  wm::course_begin(&self->course);
  wm::clear(self);
}

int wm_monitor_take(wm_monitor *self, const wm_event *event, const wm_innovation *records, size_t count) {
  if (event->kind == WM_EVENT_SET_POSE || event->kind == WM_EVENT_RESET) {
    wm::clear(self);
  } else if (!wm_event_is_motion(event) && event->source < WM_MONITOR_SOURCES) {
    wm_monitor_source *s = &self->sources[event->source];
    s->newest_ns = event->t_ns;
    wm::add_observation(s, *event, records, count);
    for (size_t i = 0; i < count; i++)
      if (records[i].verdict == WM_FUSED || records[i].verdict == WM_REJECTED_GATE)
        wm::landmark_bias_take(&self->landmarks, records[i]);
    for (size_t i = 0; i < count && event->kind == WM_EVENT_POSITION; i++)
      self->has_positions = self->has_positions || records[i].verdict == WM_FUSED;
    if (event->kind == WM_EVENT_POSITION) wm::course_take(&self->course, event->t_ns, event->as.position);
  }
  if (self->begun_ns == WM_TIME_NONE) self->begun_ns = event->t_ns;
  if (self->next_ns != WM_TIME_NONE && event->t_ns < self->next_ns) return 0;
  self->next_ns = event->t_ns + wm_ns_from_seconds(wm::kStep_s);
  return 1;
}

void wm_monitor_step(wm_monitor *self, const wm_estimate *e, const wm_alarm *alarms, size_t count) {
  wm::course_move(&self->course, *e);
  wm::weigh_mirror_image(self, *e);
  const bool is_first = self->stepped_ns == WM_TIME_NONE;
  double dt_s = is_first ? 0.0 : wm_seconds_between(self->stepped_ns, e->t_ns);
  if (!(dt_s < wm::kLongStep_s)) dt_s = wm::kLongStep_s;
  self->stepped_ns = e->t_ns;
  if (e->state == WM_STATE_SEARCHING) {
    wm::clear_windows(self);
    self->doubt_s = 0.0;
    self->resets = e->resets;
    return;
  }
  const bool is_lost = e->state == WM_STATE_LOST, fits_again = !is_lost && self->lost_s > wm::kInflated_s;
  if (!is_first && (e->resets != self->resets || fits_again)) wm::take_found(self, self->was_lost || is_lost);
  self->resets = e->resets;
  self->since_found_s += dt_s;
  self->was_lost = is_lost;
  self->lost_s = is_lost ? self->lost_s + dt_s : 0.0;
  if (!self->is_map_known) wm::widen_box(self, e->pose_map_base.p_m[0], e->pose_map_base.p_m[1]);
  bool fits, is_mild;
  const bool is_noisy = wm::test_calibration(self, alarms, count);
  const bool is_turned = wm::test_turn(self, alarms, count);
  const bool are_biased = wm::test_landmarks(self, e->t_ns);
  const bool others = is_noisy || is_turned || are_biased;
  const bool contradicts = wm::test_sources(self, e->t_ns, &fits, &is_mild) || others;
  wm::count_contradicted(self, contradicts, fits && !self->was_lost, dt_s);
  wm::count_proof(self, *e, contradicts, fits && !self->was_lost, dt_s);
  wm::count_doubt(self, contradicts, fits && !self->was_lost, is_mild && !others, dt_s);
  // Without a map every identity is unknown; that is a matter of the configuration.
  if (e->state != WM_STATE_DEAD_RECKONING || !self->is_map_known) self->is_unsupported = 0;
  self->silent = e->state == WM_STATE_DEAD_RECKONING ? wm::silent_source(*self, e->t_ns) : -1;
  self->is_outside = wm::is_outside(*self, *e);
}

double wm_monitor_untested(const wm_monitor *self) { return self->fitted_s < wm::kProven_s ? wm::kFoundWrong : 0.0; }

int wm_monitor_image(const wm_monitor *self, wm_hypothesis *out) {
  const double chance = wm::course_mirrored(self->course);
  if (!(chance > 0.0)) return 0;
  const wm_pose2 image = wm::course_mirror_image(self->course);
  *out = {image.x_m, image.y_m, image.heading_rad, {}, chance};
  return 1;
}

int wm_monitor_doubts(const wm_monitor *self) {
  return self->doubt_s > 0.0 || self->is_unsupported || self->is_outside;
}

void wm_monitor_judge(const wm_monitor *self, wm_estimate *e) {
  if (e->state == WM_STATE_SEARCHING) return;
  e->covariance[wm_cov_index(0, 0)] += self->mirrored_m2;
  e->covariance[wm_cov_index(1, 1)] += self->mirrored_m2;
  e->covariance[wm_cov_index(5, 5)] += self->mirrored_rad2;
  const bool doubts = wm_monitor_doubts(self) != 0;
  if (doubts) {
    const bool is_known_why = self->doubt_s > 0.0 || self->is_unsupported;
    e->cause = static_cast<uint8_t>(is_known_why ? self->cause : WM_CAUSE_OFF_MAP);
    e->cause_source = static_cast<int8_t>(is_known_why ? self->source : -1);
  } else if (e->state == WM_STATE_DEAD_RECKONING && self->silent >= 0) {
    e->cause = WM_CAUSE_SILENT;
    e->cause_source = static_cast<int8_t>(self->silent);
  }
  if (e->state == WM_STATE_LOST) {
    wm::widen(*self, wm::finite(e->lost_probability) ? e->lost_probability : 0.5, e);
  } else if (doubts) {
    e->state = self->doubt_s > wm::kLostAfter_s ? WM_STATE_LOST : WM_STATE_DEGRADED;
    const double lasting = self->doubt_s < wm::kLostAfter_s ? self->doubt_s / wm::kLostAfter_s : 1.0;
    const double wrong = wm::kFoundWrong + (1.0 - wm::kFoundWrong) * wm::square(lasting);
    wm::widen(*self, wrong, e);
    if (!(e->lost_probability > wrong)) e->lost_probability = wrong;
  }
}
