// SPDX-License-Identifier: Apache-2.0
// What the monitor makes of the innovations of a source, against sums over all that was seen: its slots, the tests of
// its windows, and when it fits. Random streams of every kind of residual and verdict.
#include <vector>

#include "common/suite.h"
#include "lone_monitor.hpp"
#include "waymark/random.h"

namespace {

double wrapped(double angle) { return std::remainder(angle, 2.0 * M_PI); }

// Observations of one slot: within 0.3 s, of positions and headings within 5 s.
struct plain_slot {
  wm_time_ns begin_ns, newest_ns;
  int stamps = 1, observations = 0, scalars = 0, fused[3] = {};
  double refused = 0.0, unknown = 0.0, sum[3] = {}, squares = 0.0;
};

struct plain_source {
  std::vector<plain_slot> slots;
  std::vector<uint8_t> kinds;
  double slot_s = 0.3;

  void add(const wm_event &e, const std::vector<wm_innovation> &records) {
    int of[3] = {};
    for (const wm_innovation &i : records) {
      of[0] += i.verdict == WM_FUSED && i.residual != WM_RESIDUAL_STANDSTILL;
      of[1] += i.verdict == WM_REJECTED_GATE;
      of[2] += i.verdict == WM_REJECTED_UNKNOWN_ID;
    }
    const double all = of[0] + of[1] + of[2];
    if (all == 0.0) return;
    const uint8_t residual = records[0].residual;
    const bool is_place = records[0].landmark_id < 0 && (residual == WM_RESIDUAL_X || residual == WM_RESIDUAL_Y ||
                                                         residual == WM_RESIDUAL_Z || residual == WM_RESIDUAL_HEADING);
    slot_s = is_place ? 5.0 : 0.3;
    if (slots.empty() || wm_seconds_between(slots.back().begin_ns, e.t_ns) >= slot_s)
      slots.push_back({e.t_ns, e.t_ns});
    else if (slots.back().newest_ns != e.t_ns)
      slots.back().stamps++, slots.back().newest_ns = e.t_ns;
    plain_slot &s = slots.back();
    s.observations++;
    s.refused += of[1] / all;
    s.unknown += of[2] / all;
    for (const wm_innovation &i : records)
      if (i.verdict == WM_FUSED && i.residual != WM_RESIDUAL_STANDSTILL) add_scalar(&s, i);
  }
  void add_scalar(plain_slot *s, const wm_innovation &i) {
    size_t kind = 0;
    while (kind < kinds.size() && kinds[kind] != i.residual) kind++;
    if (kind == 3) return;
    if (kind == kinds.size()) kinds.push_back(i.residual);
    const bool is_angle = i.residual == WM_RESIDUAL_BEARING || i.residual == WM_RESIDUAL_HEADING;
    const double off = is_angle ? wrapped(i.observed - i.expected) : i.observed - i.expected;
    const double z = off / std::sqrt(i.variance);
    if (!(i.variance > 0.0) || !std::isfinite(z)) return;
    s->sum[kind] += z;
    s->squares += z * z;
    s->fused[kind]++;
    s->scalars++;
  }

  // The complete slots of a window, the newest first: of dense observations that many, of sparse ones those within
  // three times its length.
  std::vector<plain_slot> window(int most, wm_time_ns t_ns) const {
    std::vector<plain_slot> out;
    for (size_t age = 0; age < slots.size() && age < WM_MONITOR_SLOTS; age++) {
      const plain_slot &s = slots[slots.size() - 1 - age];
      if (age == 0 && wm_seconds_between(s.begin_ns, t_ns) < slot_s) continue;
      if (static_cast<int>(out.size()) == most || wm_seconds_between(s.begin_ns, t_ns) > 3.0 * most * slot_s) break;
      out.push_back(s);
    }
    return out;
  }
};

double together(double count, double stamps) { return std::fmin(std::fmax(count / stamps, 1.0), 4.0); }

// P(at least this share of n | p) below 1e-4, by Chernoff's bound.
bool is_large(double sum, int n, double p) {
  const double share = n ? sum / n : 0.0;
  if (share <= p) return false;
  double divergence = share * std::log(share / p);
  if (share < 1.0) divergence += (1.0 - share) * std::log((1.0 - share) / (1.0 - p));
  return n * divergence > 9.21;
}

double chi_square_limit(double dof) {
  return dof * std::pow(1.0 - 2.0 / (9.0 * dof) + 3.72 * std::sqrt(2.0 / (9.0 * dof)), 3);
}

// What a window shows.
struct shown {
  wm_cause cause = WM_CAUSE_NONE;
  bool is_unknown = false;
  int filled = 0, gated = 0;
  double refused = 0.0;
};

shown test(const std::vector<plain_slot> &slots) {
  shown out;
  double unknown = 0.0, squares = 0.0, stamps = 0.0, observations = 0.0, mean[3] = {}, scalars[3] = {};
  int of[3] = {};
  for (const plain_slot &s : slots) {
    stamps += s.stamps, observations += s.observations;
    unknown += s.unknown / s.observations;
    if (s.observations - s.unknown > 0.0) out.gated++, out.refused += s.refused / (s.observations - s.unknown);
    if (s.scalars == 0) continue;
    out.filled++;
    squares += s.squares / s.scalars;
    for (int k = 0; k < 3; k++)
      if (s.fused[k]) of[k]++, mean[k] += s.sum[k] / s.fused[k], scalars[k] += s.fused[k];
  }
  const double m = together(observations, stamps);
  out.is_unknown = out.filled == 0 && is_large(unknown, static_cast<int>(slots.size()), 0.5);
  bool is_biased = false;
  for (int k = 0; k < 3; k++)
    is_biased = is_biased ||
                (of[k] && std::fabs(mean[k] / of[k]) > 3.89 * std::sqrt(1.5 / (of[k] * together(scalars[k], stamps))));
  if (slots.empty()) return out;
  if (is_large(out.refused, out.gated, 0.2))
    out.cause = WM_CAUSE_REFUSED;
  else if (out.filled && squares * m > 1.5 * chi_square_limit(out.filled * m))
    out.cause = WM_CAUSE_INCONSISTENT;
  else if (is_biased)
    out.cause = WM_CAUSE_BIASED;
  return out;
}

// A stream of a source: what is observed, how often, how well it fits.
struct stream {
  wm_random random;
  double every_s, refused, unknown, bias, sigmas;
  int landmarks, kind;  // of residuals: ranges and bearings, positions, headings, more kinds than are monitored

  explicit stream(uint64_t seed) : random{seed, 8, 0} {
    const double of_every[] = {0.1, 0.1, 0.25, 0.45, 2.5};
    every_s = of_every[seed % 5];
    refused = seed % 3 == 0 ? 0.7 * uniform() : 0.05;
    unknown = seed % 7 == 0 ? (seed % 2 ? 0.9 : 1.0) : seed % 4 == 0 ? 0.3 : 0.0;
    bias = seed % 4 == 1 ? 1.5 * uniform() : 0.0;
    sigmas = seed % 4 == 2 ? 1.0 + uniform() : 0.9;
    landmarks = 1 + static_cast<int>(6.0 * uniform());
    kind = static_cast<int>(seed / 5 % 4);
    if (kind == 1 || kind == 2) every_s *= 10.0, landmarks = 1;
  }
  double uniform() { return wm_random_next_uniform(&random); }
  wm_innovation record(uint8_t residual, int32_t landmark, uint8_t verdict) {
    wm_innovation i{};
    i.residual = residual;
    i.landmark_id = landmark;
    i.verdict = verdict;
    i.variance = 0.04;
    i.expected = residual == WM_RESIDUAL_BEARING || residual == WM_RESIDUAL_HEADING ? 3.0 : 10.0;
    i.observed = i.expected + 0.2 * (bias + sigmas * wm_random_next_normal(&random));
    if (residual == WM_RESIDUAL_BEARING || residual == WM_RESIDUAL_HEADING) i.observed = wrapped(i.observed);
    const double spoilt = uniform();
    if (spoilt < 0.01) i.variance = 0.0;
    if (spoilt > 0.99) i.observed = NAN;
    return i;
  }
  std::vector<wm_innovation> observation() {
    const double chance = uniform();
    const auto verdict = [&] { return static_cast<uint8_t>(uniform() < refused ? WM_REJECTED_GATE : WM_FUSED); };
    if (chance < unknown) return {record(WM_RESIDUAL_RANGE, 7, WM_REJECTED_UNKNOWN_ID)};
    if (chance > 0.97 && unknown > 0.0)
      return {record(WM_RESIDUAL_RANGE, 7, WM_FUSED), record(WM_RESIDUAL_RANGE, 8, WM_REJECTED_UNKNOWN_ID)};
    if (chance > 0.98) return {record(WM_RESIDUAL_STANDSTILL, -1, WM_FUSED)};
    if (kind == 1) return {record(WM_RESIDUAL_X, -1, verdict()), record(WM_RESIDUAL_Y, -1, verdict())};
    if (kind == 2) return {record(WM_RESIDUAL_HEADING, -1, verdict())};
    std::vector<wm_innovation> out = {record(WM_RESIDUAL_RANGE, 7, verdict()),
                                      record(WM_RESIDUAL_BEARING, 7, verdict())};
    if (kind == 3) out.push_back(record(WM_RESIDUAL_X, 7, WM_FUSED)), out.push_back(record(WM_RESIDUAL_Y, 7, WM_FUSED));
    return out;
  }
};

void expect_slots(const plain_source &expected, const wm_monitor_source &s) {
  TEST_ASSERT_EQUAL_UINT64(expected.slots.size(), s.opened);
  TEST_ASSERT_EQUAL(expected.kinds.size(), s.kinds);
  if (s.opened == 0) return;
  const plain_slot &want = expected.slots.back();
  const wm_monitor_slot &got = s.slots[(s.opened - 1) % WM_MONITOR_SLOTS];
  TEST_ASSERT_EQUAL_INT64(want.begin_ns, got.begin_ns);
  TEST_ASSERT_EQUAL_INT64(want.newest_ns, got.newest_ns);
  TEST_ASSERT_EQUAL(want.stamps, got.stamps);
  TEST_ASSERT_EQUAL(want.observations, got.observations);
  TEST_ASSERT_EQUAL(want.scalars, got.scalars);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, want.refused, got.refused);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, want.unknown, got.unknown);
  TEST_ASSERT_DOUBLE_WITHIN(1e-7, want.squares, got.squares);
  for (int k = 0; k < 3; k++) {
    TEST_ASSERT_EQUAL(want.fused[k], got.fused[k]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, want.sum[k], got.sum[k]);
  }
}

// GIVEN streams that fit, are refused, unknown, biased or wider than stated WHEN the monitor steps THEN slots, causes,
// support and the time of agreement are those of the plain sums.
TEST(a_source_is_tested_by_the_sums_of_its_windows) {
  int causes[WM_CAUSE_TURN + 8] = {}, fitting = 0, steps = 0, unsupported = 0;
  for (uint64_t seed = 1; seed <= 60; seed++) {
    stream from(seed);
    plain_source expected;
    wm_monitor m;
    const wm_landmark post{};
    wm_setup setup{};
    setup.landmarks = &post, setup.landmark_count = 1;
    wm_monitor_init(&m, &setup, 1u << 5);
    double agreed_s = 0.0;
    wm_time_ns last_ns = 0;
    for (wm_time_ns t_ns = 0; t_ns < 120 * WM_NS_PER_S; t_ns += wm_ns_from_seconds(from.every_s)) {
      if (seed % 6 == 0 && t_ns > 50 * WM_NS_PER_S && t_ns < 60 * WM_NS_PER_S) {  // silence, but for the steps
        from.every_s = 0.4;
      } else {
        for (int k = 0; k < from.landmarks; k++) {
          wm_event e{};
          e.kind = WM_EVENT_SIGHTING;
          e.source = 5;
          e.t_ns = t_ns;
          const std::vector<wm_innovation> records = from.observation();
          expected.add(e, records);
          (void)wm_monitor_take(&m, &e, records.data(), records.size());
        }
      }
      expect_slots(expected, m.sources[5]);
      wm_estimate e{};
      e.t_ns = t_ns;
      e.state = WM_STATE_DEAD_RECKONING;
      const double suspect = m.contradicted_s;
      wm_monitor_step(&m, &e, nullptr, 0);
      shown all, last;
      const bool is_fresh = !expected.slots.empty() && wm_seconds_between(expected.slots.back().newest_ns, t_ns) <=
                                                           std::fmax(1.0, 2.0 * expected.slot_s);
      for (const int slots : {6, 16, 33}) {
        if (!is_fresh) break;
        last = test(expected.window(slots, t_ns));
        if (all.cause == WM_CAUSE_NONE) all.cause = last.cause;
        all.is_unknown = all.is_unknown || last.is_unknown;
      }
      const bool fits = is_fresh && all.cause == WM_CAUSE_NONE &&
                        (last.filled > 0 || expected.slots.back().scalars > 0) &&
                        !(suspect > 10.0 && last.refused > 0.2 * last.gated);
      const double dt_s = std::fmin(wm_seconds_between(last_ns, t_ns), 1.0);
      last_ns = t_ns;
      if (all.cause != WM_CAUSE_NONE) agreed_s = std::fmax(agreed_s - dt_s, 0.0);
      if (fits) agreed_s = agreed_s < 60.0 ? agreed_s + dt_s : 60.0;
      TEST_ASSERT_EQUAL(all.cause, m.sources[5].cause);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, agreed_s, m.fitted_s);
      if (all.cause != WM_CAUSE_NONE) TEST_ASSERT_EQUAL(5, m.source);
      if (all.cause == WM_CAUSE_NONE && m.doubt_s <= 0.0) TEST_ASSERT_EQUAL(all.is_unknown, m.is_unsupported);
      causes[all.cause]++, fitting += fits, steps++, unsupported += m.is_unsupported;
    }
  }
  for (const int cause : {WM_CAUSE_NONE, WM_CAUSE_REFUSED, WM_CAUSE_INCONSISTENT, WM_CAUSE_BIASED})
    TEST_ASSERT_GREATER_THAN(100, causes[cause]);
  TEST_ASSERT_GREATER_THAN(steps / 5, fitting);
  TEST_ASSERT_GREATER_THAN(20, unsupported);
}

}  // namespace
