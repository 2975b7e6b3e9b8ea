// SPDX-License-Identifier: Apache-2.0
// What the landmarks' innovations add up to, against plain sums over all that was seen: whether they have a mean
// (landmark_bias), whether the pose or a landmark is wrong (landmark_evidence), and whether refused sightings of a
// sensor agree with its prior (first_sightings).
#include <algorithm>
#include <map>
#include <vector>

#include "common/suite.h"
#include "events.hpp"
#include "filters/core/chi_square.hpp"
#include "filters/core/first_sightings.hpp"
#include "filters/core/landmark_bias.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "math/elementary.hpp"
#include "waymark/random.h"

namespace {

// ── landmark_bias ───────────────────────────────────────────────────────────────────────────────────────────────────

struct slot {
  wm_time_ns begin_ns;
  double sum, count;
};

// Of one landmark and residual all slots of 0.3 s. The newest one is still open.
struct series {
  int32_t id;
  std::vector<slot> slots;

  void add(wm_time_ns t_ns, double z) {
    if (slots.empty() || wm_seconds_between(slots.back().begin_ns, t_ns) >= 0.3) slots.push_back({t_ns, 0.0, 0.0});
    slots.back().sum += std::fmin(std::fmax(z, -3.0), 3.0);
    slots.back().count += 1.0;
  }
  // Means of the complete slots and their variance 1, with a time constant of 20 s.
  void weigh(double *sum, double *variance) const {
    *sum = *variance = 0.0;
    for (size_t i = 0; i + 1 < slots.size(); i++) {
      const double left = std::exp(-wm_seconds_between(slots[i].begin_ns, slots[slots.size() - 2].begin_ns) / 20.0);
      *sum += left * slots[i].sum / slots[i].count;
      *variance += left * left;
    }
  }
};

// Sums of squares of the landmarks seen within 40 s, without the worst fifth, over the limit of chi-square.
double share_of_limit(const std::vector<series> &all, wm_time_ns t_ns) {
  std::map<int32_t, std::pair<double, double>> of;  // squares and their number
  for (const series &s : all) {
    double sum, variance;
    s.weigh(&sum, &variance);
    if (variance <= 0.0 || wm_seconds_between(s.slots.back().begin_ns, t_ns) >= 40.0) continue;
    of[s.id].first += sum * sum / (1.5 * variance);
    of[s.id].second += 1.0;
  }
  std::vector<std::pair<double, double>> left;
  for (const auto &one : of) left.push_back(one.second);
  std::sort(left.begin(), left.end(),
            [](const auto &a, const auto &b) { return a.first / a.second < b.first / b.second; });
  for (size_t out = of.empty() ? 0 : 1 + (of.size() - 1) / 5; out > 0; out--) left.pop_back();
  double squares = 0.0, means = 0.0;
  for (const auto &one : left) squares += one.first, means += one.second;
  return means > 0.0 ? squares / wm::chi_square_limit(means) : 0.0;
}

// GIVEN ranges, bearings and two sensors of some landmarks, each with a mean of its own WHEN they are tested THEN sums
// and verdict are those of all that was seen.
TEST(test_means_of_landmarks_are_those_of_all_slots) {
  int contradicted = 0, near_limit = 0;
  for (uint64_t seed = 0; seed < 60; seed++) {
    wm_random random = {seed, 4, 0};
    const int landmarks = 1 + static_cast<int>(seed % 13);
    wm_monitor_landmarks seen;
    wm::landmark_bias_clear(&seen);
    std::map<int, series> of;
    double mean[13][4];
    for (auto &one : mean)
      for (double &m : one) m = 0.12 * static_cast<double>(seed % 7) * wm_random_next_normal(&random);
    for (int step = 0; step < 500; step++) {
      const double t_s = 0.1 * step;
      for (int id = 0; id < landmarks; id++) {
        if (wm_random_next_uniform(&random) < 0.6 || (id == 1 && step > 90) || (id == 2 && step > 120)) continue;
        wm_innovation i{};
        const bool is_bearing = wm_random_next_uniform(&random) < 0.5;
        i.t_ns = make::at(t_s);
        i.landmark_id = 100 + id;
        i.source = id == 4 ? step % 2 : 0;
        i.residual = is_bearing ? WM_RESIDUAL_BEARING : WM_RESIDUAL_RANGE;
        i.variance = is_bearing ? 0.01 : 0.25;
        const double z =
            mean[id][2 * i.source + is_bearing] + (step % 50 == 0 ? 4.0 : 1.0) * wm_random_next_normal(&random);
        i.expected = is_bearing ? 3.1 : 12.0;  // a bearing behind the robot: its difference goes around
        i.observed = i.expected + z * std::sqrt(i.variance);
        if (is_bearing) i.observed = wm::wrap(i.observed);
        wm::landmark_bias_take(&seen, i);
        series &s = of[4 * id + 2 * i.source + is_bearing];
        s.id = id;
        s.add(i.t_ns, z);
      }
      if (step % 25 != 24) continue;
      std::vector<series> all;
      for (const auto &one : of) all.push_back(one.second);
      wm::landmark_bias_test(&seen, make::at(t_s));
      const double share = share_of_limit(all, make::at(t_s));
      if (std::fabs(share - 1.0) > 1e-9) TEST_ASSERT_EQUAL(share > 1.0, wm::landmark_bias_contradicts(seen));
      contradicted += share > 1.0;
      near_limit += std::fabs(share - 1.0) < 0.1;
    }
    TEST_ASSERT_EQUAL(of.size(), seen.count);
    for (uint32_t k = 0; k < seen.count; k++) {
      const wm_monitor_landmark &e = seen.entries[k];
      const series &s = of[4 * (e.id - 100) + 2 * e.source + (e.residual == WM_RESIDUAL_BEARING)];
      double sum, variance;
      s.weigh(&sum, &variance);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, sum, e.sum);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, variance, e.variance);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, s.slots.back().sum, e.slot_sum);
      TEST_ASSERT_EQUAL_DOUBLE(s.slots.back().count, e.slot_count);
    }
  }
  TEST_ASSERT_GREATER_THAN(100, contradicted);
  TEST_ASSERT_GREATER_THAN(15, near_limit);
}

// Innovations of no landmark, without a variance, or of no numbers are none.
TEST(test_innovations_that_say_nothing_of_a_landmark) {
  wm_innovation good{};
  good.variance = 1.0;
  wm_innovation bad[4] = {good, good, good, good};
  bad[0].landmark_id = -1;
  bad[1].variance = 0.0;
  bad[2].variance = NAN;
  bad[3].observed = NAN;
  wm_monitor_landmarks seen;
  wm::landmark_bias_clear(&seen);
  for (const wm_innovation &i : bad) wm::landmark_bias_take(&seen, i);
  TEST_ASSERT_EQUAL(0, seen.count);
  wm::landmark_bias_take(&seen, good);
  TEST_ASSERT_EQUAL(1, seen.count);
}

// ── landmark_evidence ───────────────────────────────────────────────────────────────────────────────────────────────

// The sums that landmark_evidence.hpp states, in plain words.
struct plain_evidence {
  struct source {
    double log_bayes, fresh, moved, angle_rad, mean;
    wm_time_ns t_ns, bad_since_ns;
  };
  std::map<int, source> sources;
  double prior, odds;
  wm_time_ns doubted_since_ns = WM_TIME_NONE;
  int observed = 0;
  bool proven = false, contradicted_once = false;

  explicit plain_evidence(double log_prior) : prior(log_prior), odds(log_prior) {}
  static double kept(const source &s, double left) { return (1.0 - s.moved) * std::exp(-s.log_bayes * left) + s.moved; }

  void note(wm_time_ns t_ns, int key, double log_bayes, double angle_rad, double normalised,
            wm::landmark_record *record) {
    const bool known = sources.count(key) > 0;
    if (!known) sources[key] = {0.0, 1.0, 0.0, angle_rad, 0.0, t_ns, WM_TIME_NONE};
    source &s = sources[key];
    const double dt = wm_seconds_between(s.t_ns, t_ns);
    if (known && dt > 0.0) {
      s.log_bayes *= std::exp(-dt / 3.0);
      s.fresh = std::fmin(dt / 0.3, 1.0);
    }
    s.t_ns = t_ns;
    if (std::fabs(normalised) < 10.0) s.mean += 0.1 * (normalised - s.mean);
    if (log_bayes > 0.0) {
      const double apart = std::fabs(wm::wrap(angle_rad - s.angle_rad)), near = 0.2 + 0.1 * dt;
      s.angle_rad = angle_rad;
      const double previous = std::fmax(s.log_bayes, 0.0) / s.fresh;
      if (!known || dt > 6.0)
        log_bayes = std::isfinite(angle_rad) ? 0.0 : log_bayes;
      else if (std::isfinite(apart))
        log_bayes = apart <= near ? log_bayes * (dt < 0.5 ? 2.0 : 0.5) : -std::fmin(log_bayes, previous);
    }
    s.log_bayes = std::fmin(std::fmax(s.log_bayes + s.fresh * log_bayes, -4.0), 8.0);
    if (s.log_bayes <= 0.0) s.bad_since_ns = WM_TIME_NONE;
    if (s.log_bayes > 0.0 && s.bad_since_ns == WM_TIME_NONE) s.bad_since_ns = t_ns;
    if (record) {
      if (s.log_bayes <= -1.5) record->confirmed = 1;
      s.moved = record->moved ? 0.9 : record->confirmed ? 0.002 : 0.035;
    } else {
      const double bad_s = s.bad_since_ns == WM_TIME_NONE ? 0.0 : wm_seconds_between(s.bad_since_ns, t_ns);
      s.moved = 0.05 * std::exp(-bad_s / 5.0);
    }
    sum(t_ns);
  }
  double log_product(wm_time_ns t_ns, double *best) const {
    double product = 1.0;
    *best = 1.0;
    for (const auto &one : sources) {
      const double each = kept(one.second, std::exp(-wm_seconds_between(one.second.t_ns, t_ns) / 3.0));
      product *= each;
      if (one.first >= 0) *best = std::fmax(*best, each);
    }
    return std::log(product / *best);
  }
  void forget(wm_time_ns t_ns) {
    double best;
    odds = std::fmin(std::fmax(prior - log_product(t_ns, &best), -9.0), 6.0);
  }
  void sum(wm_time_ns t_ns) {
    double best;
    odds = std::fmin(std::fmax(prior - log_product(t_ns, &best), -9.0), 6.0);
    observed++;
    contradicted_once = contradicted_once || odds > 1.0;
    if (!proven && observed >= 12 && odds - (contradicted_once ? 0.0 : std::log(best)) < -4.0) {
      proven = true;
      prior = -5.0;
    }
    if (odds < -2.0)
      doubted_since_ns = WM_TIME_NONE;
    else if (doubted_since_ns == WM_TIME_NONE)
      doubted_since_ns = t_ns;
  }
  bool biased(int key, wm_time_ns t_ns) const {
    const double own = sources.count(key) ? std::fabs(sources.at(key).mean) : 0.0;
    int better = 0;
    for (const auto &one : sources)
      better += wm_seconds_between(one.second.t_ns, t_ns) < 1.0 && one.second.log_bayes < -1.5 &&
                std::fabs(one.second.mean) < 0.6 * own;
    return own >= 1.2 && odds <= -4.0 && better >= 3;
  }
  bool moved(int key) const {
    double others = prior;
    int fitting = 0;
    for (const auto &one : sources) {
      if (one.first == key) continue;
      others -= std::log(kept(one.second, 1.0));
      fitting += one.second.log_bayes < -1.5;
    }
    return sources.count(key) && sources.at(key).log_bayes > 6.9 && fitting >= 3 && others < -4.0;
  }
};

// What a drive shows of each source: whether it fits now, a misfit's angle, and how often it is seen.
struct habit {
  double misfit_share, angle_rad, scatter_rad, bias, seen_share;
};

// GIVEN drives with landmarks that fit, that have moved, that are misread, with positions and headings among them WHEN
// they are noted THEN odds, proof, doubt, moved and biased landmarks are those of the plain sums, at each step.
TEST(test_evidence_is_that_of_the_plain_sums) {
  int proven = 0, contradicted = 0, moved = 0, biased = 0, doubted = 0;
  for (uint64_t seed = 0; seed < 80; seed++) {
    wm_random random = {seed, 9, 0};
    const auto uniform = [&] { return wm_random_next_uniform(&random); };
    const auto normal = [&] { return wm_random_next_normal(&random); };
    wm::landmark_evidence evidence;
    const double prior = seed % 3 ? -2.5 : -4.5;
    evidence.begin(prior);
    plain_evidence plain(prior);
    const int landmarks = 3 + static_cast<int>(seed % 6);
    habit habits[9];
    wm::landmark_record record[9] = {}, plain_record[9] = {};
    for (habit &h : habits)
      h = {uniform() < 0.4    ? uniform() * uniform()
           : uniform() < 0.25 ? 1.0
                              : 0.0,
           3.0 * normal(), uniform() < 0.7 ? 0.1 : 1.0, uniform() < 0.3 ? 2.0 : 0.3 * normal(), 0.2 + 0.8 * uniform()};
    for (habit &each : habits)
      if (seed % 5 < 3) each.misfit_share = seed % 5 == 0 ? 0.9 : 0.0;  // a wrong start; one that all fit
    if (seed % 5 == 1) habits[0] = {1.0, 1.0, 0.05, 0.0, 1.0};          // but one that has moved,
    if (seed % 5 == 2) habits[1].bias = 2.5;                            // or that pulls the pose
    double t_s = 0.0;
    for (int step = 0; step < 300; step++) {
      t_s += uniform() < 0.02 ? 8.0 * uniform() : uniform() < 0.3 ? 0.0 : uniform() < 0.2 ? 0.7 : 0.1;
      const wm_time_ns t_ns = make::at(t_s);
      const int key = uniform() < 0.1 ? (uniform() < 0.5 ? wm::kPositionKey : wm::kHeadingKey)
                                      : static_cast<int>(uniform() * landmarks);
      habit &h = habits[key < 0 ? 8 : key];
      if (uniform() > h.seen_share) continue;
      if (step == 200 && seed % 4 == 0)
        for (habit &each : habits) each.misfit_share = 1.0;  // carried off
      const bool misfits = uniform() < h.misfit_share;
      const double log_bayes = misfits ? 0.3 + 1.3 * uniform() : -2.0 * uniform();
      const double angle =
          key < 0 && uniform() < 0.8 ? static_cast<double>(NAN) : h.angle_rad + h.scatter_rad * normal();
      const double normalised = misfits ? 8.0 + 4.0 * uniform() : h.bias + normal();
      wm::landmark_record *of = key < 0 ? nullptr : record + key, *plain_of = key < 0 ? nullptr : plain_record + key;
      evidence.note(t_ns, key, log_bayes, angle, normalised, of);
      plain.note(t_ns, key, log_bayes, angle, normalised, plain_of);
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, plain.odds, evidence.log_odds());
      TEST_ASSERT_EQUAL(plain.proven, evidence.proven());
      TEST_ASSERT_EQUAL_INT64(plain.doubted_since_ns, evidence.doubted_since_ns());
      for (int k = 0; k < landmarks; k++) {
        TEST_ASSERT_EQUAL(plain.moved(k), evidence.moved(k));
        TEST_ASSERT_EQUAL(plain.biased(k, t_ns), evidence.biased(k, t_ns));
        moved += plain.moved(k);
        biased += plain.biased(k, t_ns);
        if (plain.moved(k)) record[k].moved = plain_record[k].moved = 1;
        TEST_ASSERT_EQUAL(plain_record[k].confirmed, record[k].confirmed);
      }
      if (step % 40 == 39) {
        evidence.forget(t_ns + WM_NS_PER_S);
        plain.forget(t_ns + WM_NS_PER_S);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, plain.odds, evidence.log_odds());
      }
      contradicted += evidence.contradicted();
      doubted += evidence.doubtful();
    }
    proven += plain.proven;
  }
  TEST_ASSERT_INT_WITHIN(35, 40, proven);  // of 80: some are, some are not
  TEST_ASSERT_GREATER_THAN(200, contradicted);
  TEST_ASSERT_GREATER_THAN(200, doubted);
  TEST_ASSERT_GREATER_THAN(20, moved);
  TEST_ASSERT_GREATER_THAN(20, biased);
}

// Of more landmarks than there is room for those not seen for longest are forgotten: 24 are kept.
TEST(test_sources_not_seen_for_longest_make_room) {
  wm::landmark_evidence evidence;
  evidence.begin(-3.0);
  plain_evidence plain(-3.0);
  wm::landmark_record record[40] = {}, plain_record[40] = {};
  for (int i = 0; i < 200; i++) {
    const int key = i < 60 ? i % 20 : (7 * i) % 40;
    const double fits = key % 3 ? -0.4 : 0.5;
    evidence.note(make::at(0.01 * i), key, fits, NAN, 0.0, record + key);
    if (plain.sources.count(key) == 0 && plain.sources.size() == 24) {
      auto oldest = plain.sources.begin();
      for (auto one = plain.sources.begin(); one != plain.sources.end(); ++one)
        if (one->second.t_ns < oldest->second.t_ns) oldest = one;
      plain.sources.erase(oldest);
    }
    plain.note(make::at(0.01 * i), key, fits, NAN, 0.0, plain_record + key);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, plain.odds, evidence.log_odds());
  }
}

// "Anywhere" against "as expected", with a fifth of false detections.
TEST(test_the_bayes_factor_of_an_observation) {
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -std::log(0.8 * 3.0 * 2.0 + 0.2), wm::landmark_evidence::log_bayes_factor(3.0, 2.0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, wm::landmark_evidence::log_bayes_factor(0.25, 4.0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::log(5.0), wm::landmark_evidence::max_log_bayes_factor());
}

// ── first_sightings ─────────────────────────────────────────────────────────────────────────────────────────────────

using first = wm::first_sightings;

struct sighting {
  int landmark, count;
  first::row rows[2];
};

sighting draw(wm_random *random, int landmark) {
  sighting out{landmark, wm_random_next_uniform(random) < 0.5 ? 1 : 2, {}};
  for (first::row &row : out.rows) {
    for (double &by : row.by_pose) by = wm_random_next_normal(random);
    for (double &by : row.by_own) by = wm_random_next_normal(random);
    row.innovation = wm_random_next_normal(random);
    row.noise = 0.05 + 0.1 * wm_random_next_uniform(random);
  }
  return out;
}

// z' S^-1 z of the rows of the last four sightings, by Gauss's elimination of the whole matrix.
double nis_of(const std::vector<sighting> &all, const double pose[3][3], const double *prior, int *n) {
  std::vector<first::row> rows;
  for (size_t i = all.size() - 4; i < all.size(); i++) rows.insert(rows.end(), all[i].rows, all[i].rows + all[i].count);
  *n = static_cast<int>(rows.size());
  std::vector<std::vector<double>> s(rows.size(), std::vector<double>(rows.size() + 1));
  for (size_t i = 0; i < rows.size(); i++) {
    for (size_t j = 0; j < rows.size(); j++) {
      s[i][j] = i == j ? rows[i].noise : 0.0;
      for (int k = 0; k < wm::kSensorStates; k++) s[i][j] += rows[i].by_own[k] * prior[k] * rows[j].by_own[k];
      for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) s[i][j] += rows[i].by_pose[k] * pose[k][l] * rows[j].by_pose[l];
    }
    s[i].back() = rows[i].innovation;
  }
  for (size_t k = 0; k < rows.size(); k++)
    for (size_t i = 0; i < rows.size(); i++) {
      if (i == k) continue;
      const double by = s[i][k] / s[k][k];
      for (size_t j = 0; j <= rows.size(); j++) s[i][j] -= by * s[k][j];
    }
  double nis = 0.0;
  for (size_t k = 0; k < rows.size(); k++) nis += rows[k].innovation * s[k].back() / s[k][k];
  return nis;
}

const double kPose[3][3] = {{0.04, 0.01, -0.005}, {0.01, 0.03, 0.004}, {-0.005, 0.004, 0.01}};

// GIVEN sightings of one or two numbers that were refused WHEN their joint NIS is just below the limit THEN they
// contradict the sensor's states, and just above it they do not: the last four, whatever came before.
TEST(test_refused_sightings_contradict_up_to_the_joint_limit) {
  wm_random random = {21, 2, 0};
  double prior[wm::kSensorStates];
  for (int k = 0; k < wm::kSensorStates; k++) prior[k] = 0.02 * (k + 1);
  for (int trial = 0; trial < 60; trial++) {
    std::vector<sighting> all;
    for (int i = 0; i < 4 + trial % 5; i++) all.push_back(draw(&random, i % 3));
    int n;
    const double nis = nis_of(all, kPose, prior, &n);
    for (const double share : {0.99, 1.01}) {
      first seen;
      seen.begin();
      const double factor = std::sqrt(share * wm::chi_square_limit(n) / nis);
      for (size_t i = 0; i < all.size(); i++) {
        if (i < 4) TEST_ASSERT_FALSE(seen.contradict(1, kPose, prior));
        sighting scaled = all[i];
        for (first::row &row : scaled.rows) row.innovation *= factor;
        seen.refused(1, scaled.landmark, scaled.rows, scaled.count);
      }
      TEST_ASSERT_EQUAL(share < 1.0, seen.contradict(1, kPose, prior));
      TEST_ASSERT_FALSE(seen.contradict(0, kPose, prior));  // another sensor
    }
  }
}

// Four of one landmark say nothing: it may have moved. One that is fused ends the row; with as many fused as refused
// the states are no longer in question, until they begin anew.
TEST(test_when_refused_sightings_do_not_count) {
  wm_random random = {22, 2, 0};
  double prior[wm::kSensorStates];
  for (double &each : prior) each = 100.0;
  const auto refuse = [&](first *seen, int count, int landmarks) {
    for (int i = 0; i < count; i++) {
      const sighting s = draw(&random, i % landmarks);
      seen->refused(0, s.landmark, s.rows, s.count);
    }
  };
  first seen;
  seen.begin();
  refuse(&seen, 6, 1);
  TEST_ASSERT_FALSE(seen.contradict(0, kPose, prior));
  refuse(&seen, 1, 2);
  const sighting other = draw(&random, 1);
  seen.refused(0, other.landmark, other.rows, other.count);
  TEST_ASSERT_TRUE(seen.contradict(0, kPose, prior));
  seen.fused(0);
  refuse(&seen, 3, 2);
  TEST_ASSERT_FALSE(seen.contradict(0, kPose, prior));
  refuse(&seen, 1, 2);
  TEST_ASSERT_TRUE(seen.contradict(0, kPose, prior));
  seen.restarted(0);
  for (int fused = 0; fused < 4; fused++) seen.fused(0);
  refuse(&seen, 4, 2);
  TEST_ASSERT_FALSE(seen.contradict(0, kPose, prior));  // four fused, four refused
  refuse(&seen, 1, 2);
  TEST_ASSERT_TRUE(seen.contradict(0, kPose, prior));
}

}  // namespace
