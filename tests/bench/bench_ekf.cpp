// SPDX-License-Identifier: Apache-2.0
// What the landmark filter costs: medians in nanoseconds of predict, of one bearing, of both, for filters of several
// sizes. Each figure is the median of single calls, the clock's own cost taken away.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "landmark_drive.h"
#include "timing.h"

namespace {

constexpr int kRuns = 20000;

double clock_cost() {
  std::vector<double> cost;
  for (int i = 0; i < kRuns; i++) {
    const int64_t a = bench::now_ns(), b = bench::now_ns();
    cost.push_back((double)(b - a));
  }
  return bench::median(cost);
}

void measure(const char *title, const std::vector<bench::setting> &settings, bool range) {
  bench::landmark_drive drive(settings, range);
  const double overhead = clock_cost();
  std::vector<double> predict, correct, both;
  int fused = 0, rejected = 0;
  for (int i = 0; i < kRuns; i++) {
    const bench::landmark_drive::step now = drive.at(i);
    const int64_t a = bench::now_ns();
    drive.predict(now);
    const int64_t b = bench::now_ns();
    const bool is_fused = drive.correct(now);
    const int64_t c = bench::now_ns();
    (is_fused ? fused : rejected)++;
    predict.push_back((double)(b - a) - overhead);
    correct.push_back((double)(c - b) - overhead);
    both.push_back((double)(c - a) - 2 * overhead);
  }
  if (rejected > fused / 20) {
    std::printf("%s: %d of %d rejected: not what was meant to be measured\n", title, rejected, kRuns);
    std::exit(1);
  }
  const double p = bench::median(predict), c = bench::median(correct), s = bench::median(both);
  std::printf("%-58s predict %5.0f ns, correct %5.0f ns, both %5.0f ns\n", title, p, c, s);
}

}  // namespace

int main() {
  measure("pose, one bearing", {}, false);
  measure("pose + 6 calibration states, one bearing", bench::kCalibrationStates, false);
  std::vector<bench::setting> all = bench::kCalibrationStates;
  for (const bench::setting &s : {bench::setting{"states.range_bias_sigma_m", 0.05},
                                  {"states.range_scale_sigma", 0.05},
                                  {"correlated.slots", 10},
                                  {"correlated.lateral_m", 0.02},
                                  {"correlated.range_m", 0.02}})
    all.push_back(s);
  measure("pose + 8 calibration states + 10 x 2 lasting, range too", all, true);
  return 0;
}
