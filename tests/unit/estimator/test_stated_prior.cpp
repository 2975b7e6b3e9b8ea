// SPDX-License-Identifier: Apache-2.0
// Priors that are stated wrongly: the closed forms against a filter that really begins with the wide prior.
#include "belief/stated_prior.hpp"

#include "belief/stated_values.hpp"
#include "common/suite.h"
#include "waymark/random.h"

namespace {

constexpr int kStates = 6, kRows = 2;
uint64_t drawn = 0;
double gauss() { return wm_random_normal(71, 1, drawn++); }

// A filter of constants, and the log of the probability of all that it has taken.
struct constants {
  wm::error_state x;
  alignas(16) double memory[wm::error_state::doubles(kStates, kRows, 1)];
  double log_probability = 0.0;

  // States 1 to 3 have this covariance about `mean`, the others the unit one about 0.
  constants(const double root[3][3], double wider, const double mean[3]) {
    x.init({kStates, kRows, 1, kStates}, memory);
    x.append(kStates);
    for (int i = 0; i < kStates; i++) x.set_covariance(i, i, 1.0);
    for (int i = 0; i < 3; i++) {
      x.set_value(1 + i, mean[i]);
      for (int j = i; j < 3; j++) {
        double sum = 0.0;
        for (int k = 0; k < 3; k++) sum += root[i][k] * root[j][k];
        x.set_covariance(1 + i, 1 + j, wider * wider * sum);
      }
    }
  }
  void observe(const double by[kStates], double value, double variance) {
    const int all[kStates] = {0, 1, 2, 3, 4, 5};
    const wm::sparse_row row = {all, by, kStates, 0};
    const double off = value - wm::error_state::dot(row, std::as_const(x).mean());
    wm::innovation i = x.prepare(&row, &off, &variance, 1);
    log_probability += std::log(i.density());
    TEST_ASSERT_TRUE(x.solve(&i, nullptr));
    for (int k = 0; k < kStates; k++) x.set_value(k, x.value(k) + x.step()[k]);
    x.correct(std::move(i));
  }
};

// Three correlated states, one of them, and what they are.
struct drive {
  double root[3][3], mean[3], truth[kStates];
  drive(double sigmas_off) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) root[i][j] = j > i ? 0.0 : i == j ? 0.3 + 0.1 * i : 0.1 * gauss();
    for (double &m : mean) m = gauss();
    for (double &t : truth) t = gauss();
    double z[3];
    for (double &of : z) of = sigmas_off * gauss();
    for (int i = 0; i < 3; i++) {
      truth[1 + i] = mean[i];
      for (int k = 0; k <= i; k++) truth[1 + i] += root[i][k] * z[k];
    }
  }
  wm::stated_prior prior(double wider) const {
    wm::stated_prior out{3, {1, 2, 3}, {mean[0], mean[1], mean[2]}, {}, wider};
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) out.root[i][j] = root[i][j];
    return out;
  }
  // The same observation for each.
  template <class... Filters>
  void observe(Filters &...filters) const {
    double by[kStates], value = 0.1 * gauss();
    for (int k = 0; k < kStates; k++) {
      by[k] = gauss();
      value += by[k] * truth[k];
    }
    (filters.observe(by, value, 0.01), ...);
  }
};

}  // namespace

// Few observations, which leave some directions unknown, and many.
TEST(test_the_factor_and_the_filter_are_those_of_a_wide_start) {
  for (int observations = 0; observations < 12; observations++)
    for (const double wider : {1.5, 10.0, 100.0}) {
      const drive d(3.0);
      constants stated(d.root, 1.0, d.mean), wide(d.root, wider, d.mean);
      for (int i = 0; i < observations; i++) d.observe(stated, wide);
      const double factor = wm::log_factor_of_blunder(stated.x, d.prior(wider));
      TEST_ASSERT_DOUBLE_WITHIN(1e-6 + 1e-6 * std::fabs(factor), wide.log_probability - stated.log_probability, factor);
      wm::blunder_search search;
      search.weigh(stated.x, d.prior(wider), 7);
      const bool is_blunder = factor > -std::log(wm::kBlunder);
      TEST_ASSERT_EQUAL(is_blunder, search.take(&stated.x));
      for (int i = 0; i < kStates && is_blunder; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, wide.x.value(i), stated.x.value(i));
        for (int j = i; j < kStates; j++)
          TEST_ASSERT_DOUBLE_WITHIN(1e-6, wide.x.covariance(i, j), stated.x.covariance(i, j));
      }
    }
}

// State 3 is 3 off. Where state 2 looks like it, both are widened; where it explains a little less, it is kept.
TEST(test_alternatives_that_the_data_do_not_tell_apart_are_all_taken) {
  const double root[3][3] = {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}, mean[3] = {0, 0, 0};
  for (const double alike : {1.0, 0.3}) {
    constants filter(root, 1.0, mean);
    const double by[kStates] = {0, 0, alike, 1, 0, 0};
    for (int i = 0; i < 20; i++) filter.observe(by, 3 + 0.01 * gauss(), 1e-4);
    const auto search = [&filter](int least, int most) {
      wm::blunder_search out;
      for (int k = least; k <= most; k++) out.weigh(filter.x, {1, {k}, {0}, {{0.1}}, 10.0}, k);
      return out;
    };
    const wm::blunder_search first = search(1, 3);
    TEST_ASSERT_EQUAL(alike == 1.0 ? 2 : 1, first.take(&filter.x));
    TEST_ASSERT_TRUE(alike == 1.0 || first.key(0) == 3);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, alike == 1.0 ? 1.5 : 3.0, filter.x.value(3));
    const wm::blunder_search second = search(1, alike == 1.0 ? 1 : 2);
    TEST_ASSERT_EQUAL(0, second.take(&filter.x));
  }
}

// More blunders at once than there is room for: the most probable ones are kept, in their order.
TEST(test_the_most_probable_of_many_come_first) {
  const double root[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, mean[3] = {0, 0, 0};
  constants filter(root, 1.0, mean);
  wm::blunder_search search;
  for (int k = 0; k < 20; k++) {
    const int state = 1 + k % 3;
    filter.x.set_value(state, 10.0 + 0.001 * ((k * 7) % 20));
    filter.x.set_covariance(state, state, 1e-4);
    search.weigh(filter.x, {1, {state}, {0}, {{1.0}}, 100.0}, k);
  }
  TEST_ASSERT_EQUAL(wm::blunder_search::kMost, search.take(&filter.x));
  for (int i = 0; i < wm::blunder_search::kMost; i++) TEST_ASSERT_EQUAL(19 - i, (search.key(i) * 7) % 20);
}

// As a speed's scale that the noise of a standing robot bent before its motion turned out to be commands.
TEST(test_a_value_that_was_given_up_and_is_then_left_untested_is_not_wrong) {
  const double root[3][3] = {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}, mean[3] = {0, 0, 0};
  constants filter(root, 1.0, mean);
  const double by[kStates] = {0, 1, 0, 0, 0, 0};
  filter.observe(by, 3.0, 0.1);
  wm::stated_values<1> stated;
  stated.clear();
  stated.add(1, 0.0, 0.01, 0.0);
  TEST_ASSERT_TRUE(stated.check(&filter.x, 0));
  TEST_ASSERT_TRUE(stated.is_wrong(1, filter.x.covariance(1, 1)));
  TEST_ASSERT_FALSE(stated.is_wrong(1, 0.03));
  stated.leave_untested(1);
  TEST_ASSERT_FALSE(stated.is_wrong(1, 1e-4));
}

// Tested after each observation of 2000 drives, right priors are given up as rarely as stated.
TEST(test_right_priors_are_kept) {
  int given_up = 0;
  for (int k = 0; k < 2000; k++) {
    const drive d(1.0);
    constants filter(d.root, 1.0, d.mean);
    bool is_wrong = false;
    for (int i = 0; i < 30 && !is_wrong; i++) {
      d.observe(filter);
      wm::blunder_search search;
      search.weigh(filter.x, d.prior(10.0), 0);
      is_wrong = search.take(&filter.x) > 0;
    }
    given_up += is_wrong;
  }
  TEST_ASSERT_LESS_OR_EQUAL(3, given_up);  // Poisson's 99.9 % of 2000 kBlunder
}
