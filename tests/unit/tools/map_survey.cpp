// SPDX-License-Identifier: Apache-2.0
// waymark map survey: planted faults are named, and a good run has none.
#include "map/survey.h"

#include <nlohmann/json.hpp>

#include "common/suite.h"
#include "made.h"

namespace {

using namespace wm::tools;

const char *kHead = "t_ns,source,sensor,landmark,residual,observed,expected,variance,nis,gate,verdict\n";
const char *kMap =
    "id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt\n"
    "1,1,2,2.6,0.02,0.0004,0,0.0001,0.5,0.0001\n2,3,4,2.6,0.02,0.0004,0,0.0001,0.5,0.0001\n";

std::string marker(int step, int id, double x, double y, const char *verdict) {
  std::string out;
  const char *const kinds[3] = {"x", "y", "heading"};
  const double off[3] = {x, y, 0.01};
  for (int k = 0; k < 3; k++) {
    char row[160];
    std::snprintf(row, sizeof row, "%lld,markers,up,%d,%s,%.6f,%d,0.0001,1,25,%s\n",
                  static_cast<long long>(step) * 100000000LL, id, kinds[k], k + 1 + off[k], k + 1, verdict);
    out += row;
  }
  return out;
}

Survey of(const std::string &rows) {
  const made::Folder run;
  run.write("innovations.csv", kHead + rows);
  run.write("map-estimate.csv", kMap);
  run.write("health.json",
            R"({"calibration": {"up.range_scale": {"value": 1.0013, "sigma": 0.0029},
                                "up.bloom_px": {"value": 0.2, "sigma": 0}}})");
  return survey_run(run.path());
}

void found(const Survey &survey, size_t landmark, const char *words) {
  TEST_ASSERT_EQUAL_MESSAGE(1, survey.landmarks[landmark].findings.size(), survey_table(survey).c_str());
  const std::string &said = survey.landmarks[landmark].findings[0];
  TEST_ASSERT_TRUE_MESSAGE(said.find(words) != std::string::npos, said.c_str());
}

std::string good(int from, int until, int id = 1) {
  std::string rows;
  for (int i = from; i < until; i++) rows += marker(i, id, i % 2 ? 0.01 : -0.01, 0.005, "fused");
  return rows;
}

TEST(test_a_good_run) {
  const Survey s = of(good(0, 50) + good(50, 100, 2));
  TEST_ASSERT_EQUAL_MESSAGE(0, s.findings(), survey_table(s).c_str());
  TEST_ASSERT_EQUAL(2, s.landmarks.size());
  TEST_ASSERT_EQUAL(50, s.landmarks[0].fused);
  TEST_ASSERT_EQUAL_STRING("x", s.landmarks[0].residuals[1].kind.c_str());
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.01, s.landmarks[0].residuals[1].rms);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, s.landmarks[0].residuals[1].in_sigmas);
  TEST_ASSERT_EQUAL_STRING("up: bloom 0.200 px, scale 1.0013 +- 0.0029", s.cameras[0].c_str());
  TEST_ASSERT_EQUAL(2, survey_json(s)["landmarks"].size());
}

TEST(test_one_that_moved) {
  std::string rows = good(0, 40, 2) + good(40, 60);
  for (int i = 60; i < 72; i++) rows += marker(i, 1, 1.2, -0.9, "gate");
  const Survey s = of(rows + good(72, 100));
  found(s, 0, "moved about 1.50 m between 5.9 s and 6.0 s");
  TEST_ASSERT_EQUAL(0, s.landmarks[1].findings.size());
}

TEST(test_one_that_comes_and_goes) {
  std::string rows = good(0, 40, 2) + good(40, 60);
  for (int turn = 0; turn < 2; turn++) {
    for (int i = 0; i < 12; i++) rows += marker(60 + 40 * turn + i, 1, 1.2, -0.9, "gate");
    rows += good(72 + 40 * turn, 100 + 40 * turn);
  }
  found(of(rows), 0, "two of one identity");
}

TEST(test_two_of_one_identity_in_a_picture) {
  std::string rows = good(0, 40, 2);
  for (int i = 40; i < 80; i++) rows += good(i, i + 1) + marker(i, 1, 0, 0, "no_association");
  found(of(rows), 0, "40 sightings while the same identity was elsewhere");
}

TEST(test_misread_ones_and_the_unseen) {
  std::string rows = good(0, 40);
  for (int i = 0; i < 5; i++) rows += marker(50 + 2 * i, 1, 2, 1, "gate") + good(51 + 2 * i, 52 + 2 * i);
  const Survey s = of(rows + marker(90, 77, 0, 0, "fused"));
  found(s, 0, "5 of 50 sightings refused one by one");
  found(s, 1, "was never seen");
  found(s, 2, "seen 1 times only");
}

TEST(test_what_fits_worse_than_it_should) {
  std::string rows = good(0, 40, 2);
  for (int i = 0; i < 40; i++) rows += marker(i, 1, i % 2 ? 0.03 : -0.03, 0, "fused");
  found(of(rows), 0, "x fits worse than it should: 3.0 sigma");
}

}  // namespace
