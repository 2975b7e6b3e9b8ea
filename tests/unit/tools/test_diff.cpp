// SPDX-License-Identifier: Apache-2.0
// waymark diff: finds the first row, the largest difference and the counters.
#include "common/failure.h"
#include "common/suite.h"
#include "diff/difference.h"
#include "made.h"

using namespace wm::tools;
using made::stamp;

namespace {

bool has(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

// 1 m/s for 10 s; from `from_s` on, off to the left by `off_m`.
std::string drive(double from_s, double off_m, int rows = 101) {
  std::string text = made::kPlanarHeader;
  for (int i = 0; i < rows; ++i)
    text += stamp(0.1 * i) + made::pose(0.1 * i, 0.1 * i >= from_s - 1e-9 ? off_m : 0, 0) + ",1,0,1,0,0,1,tracking\n";
  return text;
}

const made::Folder a, b;

std::string difference() { return difference_text(differences(a.path(), b.path()), "a", "b"); }

TEST(test_the_same) {
  for (const auto *run : {&a, &b}) {
    run->write("trajectory.csv", drive(99, 0));
    run->write("health.json", R"({"sources":{"gnss":{"fused":3}}})");
  }
  a.write("timing.json", "{\"a\":1}");                                     // never repeats, not compared
  b.write("health.json", R"({ "sources": { "gnss": { "fused": 3 } } })");  // the same values in other words
  for (const Difference &file : differences(a.path(), b.path())) TEST_ASSERT_TRUE(file.same);
  TEST_ASSERT_TRUE(has(difference(), "The two runs are the same."));
}

TEST(test_where_it_began) {
  a.write("trajectory.csv", drive(99, 0));
  b.write("trajectory.csv", drive(4.2, 0.25));
  const std::string header = "t_ns,source,sensor,landmark,residual,observed,verdict\n";
  a.write("innovations.csv", header + "4100000000,s,eye,7,bearing,0.1,fused\n");
  b.write("innovations.csv", header + "4100000000,s,eye,7,bearing,0.1,gate\n");
  a.write("health.json", R"({"sources":{"s":{"fused":3,"rejected":{"gate":0}}}})");
  b.write("health.json", R"({"sources":{"s":{"fused":2,"rejected":{"gate":1}}}})");
  const std::string text = difference();
  for (const char *said :
       {"first at row 43, t = 4.2 s (t_ns 4200000000): y_m 0 -> 0.25", "59 of 101 rows differ",
        "largest: position 0.25 m at 4.200 s, rotation 0 deg", "verdict fused -> gate", "sources.s.fused 3 -> 2",
        "sources.s.rejected.gate 0 -> 1",
        "The first difference is at t = 4.1 s (t_ns 4100000000) in innovations.csv: source s, sensor eye, landmark 7"})
    TEST_ASSERT_TRUE_MESSAGE(has(text, said), (std::string(said) + "\n not in\n" + text).c_str());
}

TEST(test_one_is_longer) {
  a.write("trajectory.csv", drive(99, 0));
  b.write("trajectory.csv", drive(99, 0, 51));
  const std::string text = difference();
  TEST_ASSERT_TRUE_MESSAGE(has(text, "101 rows -> 51 rows"), text.c_str());
  TEST_ASSERT_TRUE_MESSAGE(has(text, "the same up to row 51; from t = 5.1 s"), text.c_str());
}

TEST(test_a_file_in_one_only_and_other_bytes) {
  for (const auto *run : {&a, &b}) run->write("trajectory.tum", "0 0 0 0 0 0 0 1\n");
  a.write("published.csv", "t_ns\n");
  a.write("events.wmlog", "abcdef");
  b.write("events.wmlog", "abcXef");
  const std::string text = difference();
  TEST_ASSERT_TRUE(has(text, "only in the first"));
  TEST_ASSERT_TRUE(has(text, "the first that differs is byte 3"));
}

TEST(test_no_run) {
  try {
    differences(a.path(), a.path());
    TEST_FAIL_MESSAGE("an empty folder was taken for a run");
  } catch (const Failure &problem) {
    TEST_ASSERT_EQUAL(kUsage, problem.exit_code);
  }
}

}  // namespace

void setUp(void) { a.clear(), b.clear(); }
