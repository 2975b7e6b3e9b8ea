// SPDX-License-Identifier: Apache-2.0
// Simulated drives whose noise is stated wrong: the estimate stays consistent by the adapted noise. GIVEN / WHEN /
// THEN; all noise is drawn from fixed seeds.
#include "filters/core/noise_adaption.hpp"
#include "math/cholesky.hpp"
#include "world.hpp"

namespace {

using namespace world;

constexpr double kStep_s = 0.05, kEnd_s = 240.0, kFrom_s = 60.0;
constexpr double kWay_mps = 0.05, kTurn_radps = 0.05;       // true noise, per sqrt(s)
constexpr double kBearing_rad = 0.02, kRange_m = 0.05;      // true sigmas
constexpr double kReceiver_m = 1.0, kReceiverTau_s = 20.0;  // of its correlated error; a tenth of it is white
constexpr double kInside95 = 7.815;                         // chi2, 3 degrees of freedom

// Factors of the stated sigmas over the true ones, and the time constant by which the receiver smooths its positions.
struct stated {
  double motion = 1.0, sensor = 1.0, receiver = 1.0, smoothing_s = 0.0;
};

constexpr int kLandmarks = 8;

// Squared error of the pose over its covariance, of three numbers.
double nees_of_pose() {
  const wm_estimate e = estimate();
  const int at[3] = {0, 1, 5};
  double p[3][3], d[3] = {truth.x_m - e.pose_map_base.p_m[0], truth.y_m - e.pose_map_base.p_m[1],
                          wm::wrap(truth.heading_rad - e.heading_rad)};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) p[i][j] = e.covariance[wm_cov_index(at[i], at[j])];
  TEST_ASSERT_TRUE(wm::factorize(3, p[0], 3));
  wm::substitute_forward(3, p[0], 3, d);
  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

// Share of the NEES of the pose inside 95 % after the first minute.
double share_inside(uint64_t seed, const stated &by, bool has_landmarks, double adapt_log_sigma, bool lasting) {
  prepare_ekf(make::sensor("camera", by.sensor * kBearing_rad, by.sensor * kRange_m), seed);
  motion.noise_speed_rel = motion.noise_yaw_rate_rel = motion.noise_side_rel = 0.0;
  motion.noise_speed_mps = by.motion * kWay_mps;
  motion.noise_yaw_rate_radps = by.motion * kTurn_radps;
  motion.noise_rest_factor = 1.0;
  motion.noise_adapt_log_sigma = adapt_log_sigma;
  make::positions.correlated_m = -1.0;
  make::positions.correlated_tau_s = kReceiverTau_s;
  make::positions.sigma_factor = 0.1;
  if (lasting) {
    make::sightings.correlated_slots = 10;
    make::sightings.correlated_bearing_rad = make::sightings.correlated_range_m = -1.0;
  }
  put_on_map(
      {{5, 0}, {5.6569, 5.6569}, {0, 5}, {-5.6569, 5.6569}, {-5, 0}, {-5.6569, -5.6569}, {0, -5}, {5.6569, -5.6569}},
      0);
  double offset_rad[kLandmarks], offset_m[kLandmarks];
  for (int i = 0; i < kLandmarks; i++) {
    offset_rad[i] = lasting ? gauss(kBearing_rad) : 0.0;
    offset_m[i] = lasting ? gauss(kRange_m) : 0.0;
  }
  start_at({2, 0, 0}, 0.05, 0.05);
  begin();
  double receiver_m[2] = {gauss(kReceiver_m), gauss(kReceiver_m)}, smoothed_m[2] = {receiver_m[0], receiver_m[1]};
  const double kept = by.smoothing_s > 0.0 ? std::exp(-20 * kStep_s / by.smoothing_s) : 0.0;
  const double white_m = by.smoothing_s > 0.0 ? 0.01 * kReceiver_m : 0.1 * kReceiver_m;
  int inside = 0, judged = 0;
  for (int step = 1; step * kStep_s < kEnd_s; step++) {
    const double t_s = step * kStep_s, root = std::sqrt(kStep_s);
    // Circles of changing speed, then of the other direction.
    const double v = 0.5 + 0.3 * std::sin(0.2 * t_s), w = 0.35 * std::sin(0.05 * t_s);
    feed(make::twist(t_s, v + gauss(kWay_mps) / root, w + gauss(kTurn_radps) / root));
    go_on(v, w, kStep_s);
    for (int i = 0; has_landmarks && step % 8 == 0 && i < kLandmarks; i++) {
      const auto [bearing, range] = view_of(landmarks[i].p_m[0], landmarks[i].p_m[1]);
      if (std::fabs(bearing) < 0.8)
        feed(make::sighting(t_s, i, wm::wrap(bearing + offset_rad[i] + gauss(kBearing_rad)),
                            range + offset_m[i] + gauss(kRange_m)));
    }
    if (!has_landmarks && step % 20 == 0) {
      const double left = std::exp(-20 * kStep_s / kReceiverTau_s);
      for (double &m : receiver_m) m = left * m + gauss(kReceiver_m * std::sqrt(1.0 - left * left));
      for (int i = 0; i < 2; i++) smoothed_m[i] += (1.0 - kept) * (receiver_m[i] - smoothed_m[i]);
      feed(make::position(t_s, truth.x_m + smoothed_m[0] + gauss(white_m), truth.y_m + smoothed_m[1] + gauss(white_m),
                          by.receiver * kReceiver_m));
    }
    if (t_s < kFrom_s || step % 10 != 0) continue;
    judged++;
    inside += nees_of_pose() < kInside95;
  }
  return inside / static_cast<double>(judged);
}

// Of four drives.
double mean_inside(const stated &by, bool has_landmarks, double adapt_log_sigma = 1.4, bool lasting = false) {
  double sum = 0.0;
  for (uint64_t i = 0; i < 4; i++) sum += 0.25 * share_inside(100 + i, by, has_landmarks, adapt_log_sigma, lasting);
  return sum;
}

// A linear filter of the pose and of a position's time-correlated error, whose noise has these log factors: what the
// derivatives of noise_adaption are of.
struct reference {
  using adaption = wm::noise_adaption;
  static constexpr int kN = adaption::kBlock;
  double log_factor[adaption::kFactors] = {};
  double x[kN] = {}, p[kN][kN] = {};

  double factor(int k) const { return k < adaption::kFactors ? std::exp(log_factor[k]) : 1.0; }
  double lasting() const { return factor(adaption::kLasting) * factor(adaption::kPlace); }
  void transform(const double f[kN][kN]) {
    double moved[kN] = {}, half[kN][kN] = {}, whole[kN][kN] = {};
    for (int i = 0; i < kN; i++)
      for (int k = 0; k < kN; k++) {
        moved[i] += f[i][k] * x[k];
        for (int j = 0; j < kN; j++) half[i][j] += f[i][k] * p[k][j];
      }
    for (int i = 0; i < kN; i++)
      for (int j = 0; j < kN; j++)
        for (int k = 0; k < kN; k++) whole[i][j] += half[i][k] * f[j][k];
    std::memcpy(x, moved, sizeof x);
    std::memcpy(p, whole, sizeof p);
  }
  void move(double x_m, double y_m, double along_m2, double across_m2, double turn_rad2) {
    double f[kN][kN] = {};
    for (int i = 0; i < kN; i++) f[i][i] = 1.0;
    f[0][2] = -y_m, f[1][2] = x_m;
    transform(f);
    const double length = std::hypot(x_m, y_m), c = length > 0.0 ? x_m / length : 1.0,
                 s = length > 0.0 ? y_m / length : 0.0;
    p[0][0] += factor(adaption::kWay) * (c * c * along_m2 + s * s * across_m2);
    p[1][1] += factor(adaption::kWay) * (s * s * along_m2 + c * c * across_m2);
    p[0][1] += factor(adaption::kWay) * c * s * (along_m2 - across_m2);
    p[1][0] = p[0][1];
    p[2][2] += factor(adaption::kTurn) * turn_rad2;
  }
  void fade(double left, double added_m2) {
    double f[kN][kN] = {};
    for (int i = 0; i < kN; i++) f[i][i] = i < adaption::kPose ? 1.0 : left;
    transform(f);
    for (int i = adaption::kPose; i < kN; i++) p[i][i] += lasting() * added_m2;
  }
  // The errors of places turn, the mean stays.
  void turn(double by_rad) {
    double f[kN][kN] = {}, kept[kN];
    std::memcpy(kept, x, sizeof x);
    f[2][2] = 1.0;
    for (int i : {0, adaption::kPose}) {
      f[i][i] = f[i + 1][i + 1] = std::cos(by_rad);
      f[i + 1][i] = std::sin(by_rad), f[i][i + 1] = -std::sin(by_rad);
    }
    transform(f);
    std::memcpy(x, kept, sizeof x);
  }
  void begin_pose(double variance) {
    for (int i = 0; i < adaption::kPose; i++) {
      for (int j = 0; j < kN; j++) p[i][j] = p[j][i] = 0.0;
      p[i][i] = variance;
      x[i] = 0.0;
    }
  }
  // What the innovation is without noise of its own: h x, its variance, and the gain.
  double expected(const double h[kN]) const {
    double sum = 0.0;
    for (int i = 0; i < kN; i++) sum += h[i] * x[i];
    return sum;
  }
  double variance(const double h[kN], double own, int kind, double gain[kN]) const {
    double s = factor(kind) * own;
    for (int i = 0; i < kN; i++) {
      gain[i] = 0.0;
      for (int j = 0; j < kN; j++) gain[i] += p[i][j] * h[j];
      s += h[i] * gain[i];
    }
    for (int i = 0; i < kN; i++) gain[i] /= s;
    return s;
  }
  void update(const double h[kN], double own, int kind, double observed) {
    double gain[kN], f[kN][kN] = {};
    const double innovation = observed - expected(h);
    variance(h, own, kind, gain);
    double kept[kN];
    std::memcpy(kept, x, sizeof x);
    for (int i = 0; i < kN; i++)
      for (int j = 0; j < kN; j++) f[i][j] = (i == j) - gain[i] * h[j];
    transform(f);
    for (int i = 0; i < kN; i++) {
      x[i] = kept[i] + gain[i] * innovation;
      for (int j = 0; j < kN; j++) p[i][j] += gain[i] * gain[j] * factor(kind) * own;
    }
  }
};

// A drive with a lasting error of the positions, a pose that is set, and updates of which nothing is learned; then one
// that is. Beside the filter with the stated noise each with one factor more or less: `more`, `less`.
struct learned_once {
  using adaption = wm::noise_adaption;
  static constexpr int kN = adaption::kBlock;
  static constexpr double kStep = 1e-5;
  adaption adapted;
  reference stated, more[adaption::kFactors], less[adaption::kFactors];

  learned_once(double log_sigma) {
    adapted.init(log_sigma);
    for (int k = 0; k < adaption::kFactors; k++) more[k].log_factor[k] = kStep, less[k].log_factor[k] = -kStep;
  }
  template <class Act>
  void all(Act act) {
    act(stated);
    for (int k = 0; k < adaption::kFactors; k++) act(more[k]), act(less[k]);
  }
  void move(double x_m, double y_m, double along_m2, double across_m2, double turn_rad2) {
    adapted.move(x_m, y_m, along_m2, across_m2, turn_rad2);
    all([&](reference &r) { r.move(x_m, y_m, along_m2, across_m2, turn_rad2); });
  }
  void fade(double left, double added_m2) {
    adapted.fade_correlated(left, added_m2);
    all([&](reference &r) { r.fade(left, added_m2); });
  }
  void turn(double by_rad) {
    adapted.turn(std::sin(by_rad), std::cos(by_rad));
    all([&](reference &r) { r.turn(by_rad); });
  }
  void begin_correlated(double variance_m2) {
    adapted.begin_correlated(variance_m2);
    all([&](reference &r) {
      for (int i = adaption::kPose; i < kN; i++) r.p[i][i] = r.lasting() * variance_m2;
    });
  }
  void set_pose(double variance) {
    adapted.restart(false);
    all([&](reference &r) { r.begin_pose(variance); });
  }
  // `sigmas`: the innovation.
  void update(const double (&h)[kN], double own, int kind, double sigmas) {
    adaption::row row{};
    row.variance = stated.variance(h, own, kind, row.gain);
    row.innovation = sigmas * std::sqrt(row.variance);
    row.own = own;
    row.kind = kind;
    std::memcpy(row.by, h, sizeof row.by);
    adapted.update(row);
    const double observed = stated.expected(h) + row.innovation;
    all([&](reference &r) { r.update(h, own, kind, observed); });
  }
  // Log factors by their mean and covariance.
  struct posterior {
    double mean[adaption::kFactors] = {}, covariance[adaption::kFactors][adaption::kFactors] = {};

    double applied(int k) const { return k < adaption::kPlace ? std::fmax(mean[k], 0.0) : mean[k]; }
    // An observation with these derivatives by the log factors: the mean moves by `step` times the gain.
    template <class Step>
    void correct(const double by[adaption::kFactors], double noise, Step step) {
      double gain[adaption::kFactors] = {}, q = 0.0, beyond = 0.0;
      for (int k = 0; k < adaption::kFactors; k++)
        for (int l = 0; l < adaption::kFactors; l++) gain[k] += covariance[k][l] * by[l];
      for (int k = 0; k < adaption::kFactors; k++) {
        q += by[k] * gain[k];
        beyond += by[k] * (mean[k] - applied(k));
      }
      if (q < 1e-9) return;
      const double length = step(q, beyond);
      for (int k = 0; k < adaption::kFactors; k++) {
        mean[k] += gain[k] * length;
        for (int l = 0; l < adaption::kFactors; l++) covariance[k][l] -= gain[k] * gain[l] / (q + noise);
      }
    }
    void learn_variance(const double share[adaption::kFactors], double nis) {
      correct(share, 2.0, [nis](double q, double beyond) {
        double low = beyond - q, high = 3.0;  // u - beyond + q/2 (1 - nis exp(-u)) rises from below 0 to above it
        for (int i = 0; i < 60; i++) {
          const double u = 0.5 * (low + high);
          (u - beyond + 0.5 * q * (1.0 - nis * std::exp(-u)) < 0.0 ? low : high) = u;
        }
        return (low - beyond) / q;
      });
    }
    void learn_mean(const double by[adaption::kFactors], double sigmas) {
      correct(by, 1.0, [sigmas](double q, double beyond) { return (sigmas - beyond) / (q + 1.0); });
    }
  };
  // The maximum a posteriori of the log factors after such updates as the first of which something is learned: each
  // updates all but the time-correlated error, and the sum of positions' innovations over 10 s that one, too.
  template <size_t kRows>
  void expect_learned(const double (&h)[kN], double own, int kind, const double (&sigmas)[kRows], double log_sigma) {
    posterior learned;
    for (int k = 0; k < adaption::kFactors; k++)
      learned.covariance[k][k] = log_sigma * log_sigma * (k == adaption::kLasting ? 0.49 : 1.0);
    double shares[adaption::kFactors] = {}, means[adaption::kFactors] = {}, sum = 0.0;
    adapted.pass(make::at(0.0));
    for (const double z : sigmas) {
      double gain[kN], share[adaption::kFactors], by[adaption::kFactors];
      const double s = stated.variance(h, own, kind, gain);
      for (int k = 0; k < adaption::kFactors; k++) {
        share[k] = (more[k].variance(h, own, kind, gain) - less[k].variance(h, own, kind, gain)) / (2.0 * kStep) / s;
        by[k] = (more[k].expected(h) - less[k].expected(h)) / (2.0 * kStep) / std::sqrt(s);
        shares[k] += share[k] / kRows;
        means[k] += by[k] / std::sqrt(static_cast<double>(kRows));
      }
      sum += z / std::sqrt(static_cast<double>(kRows));
      update(h, own, kind, z);
      share[adaption::kLasting] = by[adaption::kLasting] = 0.0;
      learned.learn_variance(share, z * z);
      learned.learn_mean(by, z);
    }
    if (kind == adaption::kPlace) {
      learned.learn_variance(shares, sum * sum);
      learned.learn_mean(means, sum);
    }
    adapted.pass(make::at(10.0));
    for (int k = 0; k < adaption::kFactors; k++)
      TEST_ASSERT_DOUBLE_WITHIN(1e-5, learned.applied(k) * std::exp(-10.0 / 1000.0), std::log(adapted.scale(k)));
  }
};

// GIVEN a drive WHEN innovations sum up to more than their sigma THEN each factor takes its share of it, by the
// derivatives of the filter's covariance and of its mean: those of a filter whose noise has a little more of the
// factor.
TEST(test_each_factor_takes_its_share_of_innovations) {
  using adaption = wm::noise_adaption;
  const double log_sigma = 0.5;
  for (int kind = 0; kind < adaption::kFactors; kind++)
    for (double sigmas : {1.2, 1.5, -1.4}) {
      learned_once drive(log_sigma);
      drive.set_pose(0.01);
      drive.begin_correlated(0.3);
      drive.move(0.5, 0.2, 0.02, 0.005, 0.01);
      drive.fade(0.9, 0.06);
      drive.update({0.3, -0.5, 1.0, 0.0, 0.0}, 0.05, adaption::kNone, 1.3);
      drive.set_pose(0.02);  // what was driven before is of no effect; the error of the positions lasts
      for (int i = 0; i < 3; i++) {
        drive.move(0.8, -0.3, 0.03, 0.01, 0.02);
        drive.fade(0.8, 0.1);
        drive.update({1.0, 0.0, 0.0, 1.0, 0.0}, 0.2, adaption::kNone, i - 0.7);
        drive.turn(0.4);
        drive.move(-0.2, 0.9, 0.02, 0.008, 0.015);
        drive.update({0.0, 1.0, 0.0, 0.0, 1.0}, 0.3, adaption::kNone, 0.4 * i);
        drive.update({0.3, -0.5, 1.0, 0.0, 0.0}, 0.05, adaption::kNone, 0.9 - i);
        drive.move(0.0, 0.0, 0.01, 0.01, 0.03);
      }
      drive.expect_learned({0.7, 0.4, -0.8, 0.7, 0.4}, 0.1, kind, {sigmas, 0.8 * sigmas}, log_sigma);
    }
}

// GIVEN positions that are off by four stated sigmas WHEN nothing comes for three time constants of 1000 s THEN what
// was found of their noise is forgotten by exp(-3).
TEST(test_what_was_found_is_forgotten) {
  wm::noise_adaption adaption;
  adaption.init(1.0);
  adaption.pass(make::at(0.0));
  for (int i = 0; i < 60; i++) {
    wm::noise_adaption::row row{};
    row.innovation = i % 2 ? 4.0 : -4.0;
    row.variance = row.own = 1.0;
    row.kind = wm::noise_adaption::kPlace;
    adaption.update(row);
  }
  const double found = std::log(adaption.scale(wm::noise_adaption::kPlace));
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, found);
  for (int i = 1; i <= 3000; i++) adaption.pass(make::at(i));
  TEST_ASSERT_DOUBLE_WITHIN(0.01 * found, found * std::exp(-3.0), std::log(adaption.scale(wm::noise_adaption::kPlace)));
}

// GIVEN factors that were found WHEN they are dropped THEN the next ones begin at 1, as of a filter that begins.
TEST(test_dropped_factors_begin_anew) {
  using adaption = wm::noise_adaption;
  adaption used, fresh;
  used.init(1.0);
  fresh.init(1.0);
  adaption::row row{};
  row.innovation = 4.0;
  row.variance = row.own = 1.0;
  row.kind = adaption::kPlace;
  for (int i = 0; i < 20; i++) used.update(row);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.5, used.scale(adaption::kPlace));
  used.restart(true);
  TEST_ASSERT_EQUAL_DOUBLE(1.0, used.scale(adaption::kPlace));
  used.update(row);
  fresh.update(row);
  TEST_ASSERT_EQUAL_DOUBLE(fresh.scale(adaption::kPlace), used.scale(adaption::kPlace));
}

// GIVEN noise that is stated right or wrong WHEN it is adapted THEN 0.85 and more of the NEES are inside of its 95 %;
// `without`: of a filter that does not adapt no more than so many are. Positions that are smoothed over 10 s are no
// first-order process, and reach less.
TEST(test_noise_that_is_stated_wrong_stays_consistent) {
  const struct {
    const char *name;
    stated by;
    bool has_landmarks, lasting;
    double without;
  } rows[] = {{"right, landmarks", {}, true, false, 1},
              {"right, positions", {}, false, false, 1},
              {"right, errors that last", {}, true, true, 1},
              {"motion too small", {.motion = 0.25}, true, false, 0.6},
              {"motion too small, errors that last", {.motion = 0.25}, true, true, 1},
              {"motion too large", {.motion = 4.0}, true, false, 1},
              {"motion too large, positions", {.motion = 4.0}, false, false, 1},
              {"sensor too small", {.sensor = 0.25}, true, false, 0.87},
              {"sensor too large", {.sensor = 4.0}, true, false, 1},
              {"receiver too small", {.receiver = 0.25}, false, false, 0.6},
              {"receiver too large", {.receiver = 4.0}, false, false, 1},
              {"receiver that smooths", {.smoothing_s = 10.0}, false, false, 1}};
  for (const auto &row : rows) {
    const double share = mean_inside(row.by, row.has_landmarks, 1.4, row.lasting);
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE_MESSAGE(row.by.smoothing_s > 0.0 ? 0.7 : 0.85, share, row.name);
    if (row.without < 1)
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(row.without, mean_inside(row.by, row.has_landmarks, 0.0), row.name);
  }
}

}  // namespace
