// SPDX-License-Identifier: Apache-2.0
// Whether a pose is right by the share of scans that the map explains, on floors with few false points.
#include "common/suite.h"
#include "filters/edge_mcl/fit_evidence.hpp"

namespace {

constexpr double kScan_s = 0.1, kScan_m = 0.09;  // ten scans a second at walking pace

wm::fit_evidence evidence() {
  wm_edge_mcl_params params;
  wm_params_defaults(&wm_edge_mcl_params_table, &params);
  wm::fit_evidence out;
  out.init(params);
  out.reset(true);
  return out;
}

// Scans of so many points, of which so many are explained, for so long. Returns the largest log odds of being lost.
double drive(wm::fit_evidence *fit, int seen, int explained, double seconds) {
  wm::normal_equations scan;
  scan.seen = seen;
  scan.explained = explained;
  double most = fit->log_odds();
  for (int i = 0; i < static_cast<int>(seconds / kScan_s); i++) {
    fit->add(scan, kScan_s, kScan_m);
    if (fit->log_odds() < -4.5) fit->learn(scan, kScan_s);  // a pose that is trusted
    if (fit->log_odds() > most) most = fit->log_odds();
  }
  return most;
}

}  // namespace

// From a corridor into a hall where few edges are in view, and into a corridor again.
TEST(few_points_do_not_raise_what_many_should_explain) {
  wm::fit_evidence fit = evidence();
  drive(&fit, 150, 145, 30.0);
  drive(&fit, 12, 11, 60.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(-4.5, drive(&fit, 150, 143, 20.0));
}

// Parallel walls explain two thirds of a scan from a wrong pose. Where the floor leaves nothing else unexplained, that
// is noticed; where glare has made a third of all points, it is not.
TEST(a_share_that_is_unusual_here_is_evidence) {
  wm::fit_evidence clean = evidence(), glaring = evidence();
  drive(&clean, 150, 145, 30.0);
  drive(&glaring, 150, 100, 30.0);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, drive(&clean, 150, 100, 20.0));
  TEST_ASSERT_LESS_THAN_DOUBLE(-4.5, drive(&glaring, 150, 100, 20.0));
}
