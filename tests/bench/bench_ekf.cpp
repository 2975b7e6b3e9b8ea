// SPDX-License-Identifier: Apache-2.0
// What the landmark filter costs: medians in nanoseconds of predict, of one bearing, of both, for filters of several
// sizes, beside a plain EKF of the pose on the same drive (plain_ekf.h). Each figure is the median of single calls, the
// clock's own cost taken away.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "landmark_drive.h"
#include "plain_ekf.h"
#include "timing.h"

namespace {

constexpr int kRuns = 20000;
constexpr int kBefore = 600;  // steps of 20 ms: for 10 s a stated start is weighed, which the rest of a drive is not

double clock_cost() {
  std::vector<double> cost;
  for (int i = 0; i < kRuns; i++) {
    const int64_t a = bench::now_ns(), b = bench::now_ns();
    cost.push_back((double)(b - a));
  }
  return bench::median(cost);
}

// The plain filter on the drive, told its noise.
class plain_drive {
 public:
  explicit plain_drive(const bench::landmark_drive &drive) : drive_(drive) {}
  void predict(const bench::landmark_drive::step &now) {
    filter_.predict(0.02, now.twist.as.twist2.v_mps, now.twist.as.twist2.w_radps, kNoise_m2ps, kNoise_rad2ps);
  }
  bool correct(const bench::landmark_drive::step &now) {
    const wm_landmark &l = drive_.landmark(now.seen.as.sighting.landmark_id);
    filter_.bearing(l.p_m[0], l.p_m[1], now.seen.as.sighting.bearing_rad, kVariance_rad2);
    return true;
  }
  // On the circle of 3 m?
  bool works() const { return std::fabs(std::hypot(filter_.x_m(), filter_.y_m()) - 3.0) < 0.05; }

 private:
  static constexpr double kNoise_m2ps = 1e-4, kNoise_rad2ps = 1e-4;  // (0.01 m)^2 and (0.01 rad)^2 a second
  static constexpr double kVariance_rad2 = 4e-4;                     // of a bearing, as the drive's sensor states it
  const bench::landmark_drive &drive_;
  bench::plain_ekf filter_{3, 0, 1.5707963, 0.05, 0.05};
};

// Nanoseconds of a prediction and a correction together.
template <class Filter>
double measure(const char *title, const bench::landmark_drive &drive, Filter *filter, double plain_ns) {
  const double overhead = clock_cost();
  std::vector<double> predict, correct, both;
  const int runs = bench::rounds(kRuns);
  int rejected = 0;
  for (int i = 0; i < kBefore + runs; i++) {
    const bench::landmark_drive::step now = drive.at(i);
    const int64_t a = bench::now_ns();
    filter->predict(now);
    const int64_t b = bench::now_ns();
    const bool is_fused = filter->correct(now);
    const int64_t c = bench::now_ns();
    rejected += !is_fused;
    if (i < kBefore) continue;
    predict.push_back((double)(b - a) - overhead);
    correct.push_back((double)(c - b) - overhead);
    both.push_back((double)(c - a) - 2 * overhead);
  }
  if (rejected > runs / 20) {
    std::printf("%s: %d of %d rejected: not what was meant to be measured\n", title, rejected, kBefore + runs);
    std::exit(1);
  }
  const double ns = bench::median(both);
  std::printf("%-66s predict %5.0f ns, correct %5.0f ns, both %5.0f ns", title, bench::median(predict),
              bench::median(correct), ns);
  if (plain_ns > 0.0) std::printf(", %5.1f times the plain one's", ns / plain_ns);
  std::printf("\n");
  return ns;
}

// `listed`: calibration states and factors of noise that it has; -1: any number above 0.
void measure(const char *title, const std::vector<bench::setting> &settings, bool range, int listed, double plain_ns) {
  bench::landmark_drive drive(settings, range);
  const auto has = static_cast<int>(drive.listed());
  if (listed < 0 ? has == 0 : has != listed) {
    std::printf("%s: %d calibration values: not what was meant to be measured\n", title, has);
    std::exit(1);
  }
  char with_count[128];
  (void)std::snprintf(with_count, sizeof with_count, "%s (%d listed)", title, has);
  (void)measure(with_count, drive, &drive, plain_ns);
}

}  // namespace

int main() {
  bench::landmark_drive same({}, false);
  plain_drive plain(same);
  const double plain_ns = measure("a plain EKF of x, y, heading, one bearing", same, &plain, 0.0);
  if (!plain.works()) return std::printf("the plain EKF left its circle: not what was meant to be measured\n"), 1;
  measure("pose alone, one bearing", bench::pose_alone(), false, 0, plain_ns);
  measure("defaults, one bearing", {}, false, -1, plain_ns);
  measure("defaults and narrower calibration, one bearing", bench::kCalibrationStates, false, -1, plain_ns);
  std::vector<bench::setting> all = bench::kCalibrationStates;
  for (const bench::setting &s : {bench::setting{"states.range_bias_sigma_m", 0.05},
                                  {"states.range_scale_sigma", 0.05},
                                  {"correlated.slots", 10},
                                  {"correlated.lateral_m", 0.02},
                                  {"correlated.range_m", 0.02}})
    all.push_back(s);
  measure("the same, range too", all, true, -1, plain_ns);
  return 0;
}
