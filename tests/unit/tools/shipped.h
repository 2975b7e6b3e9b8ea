// SPDX-License-Identifier: Apache-2.0
// The worlds that are shipped, and drives through them.
#pragma once

#include <string>

#include "common/suite.h"
#include "simulate/simulate.h"

namespace wm::sim {

inline void load_shipped(const std::string &name, Scenario &out) {
  wm_error err{};
  const std::string path = std::string(std::getenv("WM_SOURCE_DIR")) + "/config/worlds/" + name + ".yaml";
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, load_scenario(path, out, &err), err.text);
}

inline Scenario shipped(const std::string &name) {
  Scenario out;
  load_shipped(name, out);
  return out;
}

inline Recording driven(const Scenario &scenario, uint64_t seed, size_t landmarks = SIZE_MAX) {
  Recording out;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, simulate(scenario, seed, landmarks, out, &err), err.text);
  return out;
}

// Mean and spread of what is added.
struct Sum {
  double n = 0, sum = 0, squares = 0;
  void add(double v) { n++, sum += v, squares += v * v; }
  double mean() const { return sum / n; }
  double rms() const { return std::sqrt(squares / n); }
  double deviation() const { return std::sqrt(std::fmax(0.0, squares / n - mean() * mean())); }
};

// Within four sigma of the share that so many draws have.
inline void check_share(double wanted, double part, double all) {
  TEST_ASSERT_GREATER_THAN(500, all);
  TEST_ASSERT_DOUBLE_WITHIN(4 * std::sqrt(wanted * (1 - wanted) / all), wanted, part / all);
}

}  // namespace wm::sim
