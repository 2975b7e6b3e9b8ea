// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/start_trial.hpp"

#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kPrior = -2.5;                     // what somebody says is wrong in one of twelve cases, as log odds
constexpr double kWrong_m = 2.0, kWrong_rad = 0.3;  // who is farther off is found out all the same
constexpr double kWay_m = 15.0;                     // then odometry has forgotten where it began
constexpr int kLandmarks = 3;                       // fewer fit many places
constexpr int kSightings = 8;                       // one false one among few makes a pose of its own
constexpr double kNeither = 16.3;                   // 99.9 %: another place looks like this one, by chance
constexpr double kAgreeing = 0.7, kLasts_s = 0.25;  // and false ones come and go
constexpr double kRight = -5.0, kSure_m = 0.2;      // proven: also by how well it would have been seen to be wrong

struct factor3 {
  double l[3][3];  // lower triangle, m = l l'
  bool good;
};

factor3 factor(const double m[3][3]) {
  factor3 f{};
  f.good = true;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j <= i; j++) {
      double sum = m[i][j];
      for (int k = 0; k < j; k++) sum -= f.l[i][k] * f.l[j][k];
      if (i != j) {
        f.l[i][j] = sum / f.l[j][j];
      } else if (sum > 0.0 && finite(sum)) {
        f.l[i][i] = std::sqrt(sum);
      } else {
        f.good = false;
        return f;
      }
    }
  return f;
}

// l^-1 d
void solve_lower(const factor3 &f, const double d[3], double out[3]) {
  for (int i = 0; i < 3; i++) {
    out[i] = d[i];
    for (int k = 0; k < i; k++) out[i] -= f.l[i][k] * out[k];
    out[i] /= f.l[i][i];
  }
}

double squared_distance(const factor3 &f, const double d[3]) {
  double w[3];
  solve_lower(f, d, w);
  return square(w[0]) + square(w[1]) + square(w[2]);
}

// Of N(d; 0, m), without the constant.
double log_density(const factor3 &f, const double d[3]) {
  return -0.5 * squared_distance(f, d) - log(f.l[0][0] * f.l[1][1] * f.l[2][2]);
}

}  // namespace

void start_trial::begin(const wm_pose2 &pose, const double covariance[3][3], const wm_pose2 &odom, double travelled_m,
                        double turned_rad) {
  stated_ = pose_ = pose;
  odom_ = odom;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) stated_covariance_[i][j] = covariance_[i][j] = covariance[i][j];
  travelled_m_ = travelled_m;
  turned_rad_ = turned_rad;
  log_odds_ = kPrior;
  wrong_since_ns_ = WM_TIME_NONE;
  wrong_ = false;
  open_ = true;
}

void start_trial::weigh(const search_result &seen, const wm_pose2 &odom, double travelled_m, double turned_rad,
                        wm_time_ns t_ns) {
  const double way = travelled_m - travelled_m_;
  if (way > kWay_m) open_ = false;
  if (!open_ || !seen.clear || seen.landmarks < kLandmarks || seen.agreeing < kSightings ||
      seen.agreeing < kAgreeing * seen.used)
    return;
  const wm_pose2 now = compose(stated_, between(odom_, odom));
  const double lever_x = now.x_m - stated_.x_m, lever_y = now.y_m - stated_.y_m;
  const double j[3][3] = {{1, 0, -lever_y}, {0, 1, lever_x}, {0, 0, 1}};
  const double drift_m2 = square(kWayError * way), drift_rad2 = square(kTurnError * (turned_rad - turned_rad_));
  double right[3][3], wrong[3][3], wide[3][3];  // of the difference under both hypotheses; of the pose under the second
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      double sum = r != c ? 0.0 : r < 2 ? drift_m2 : drift_rad2;
      for (int m = 0; m < 3; m++)
        for (int n = 0; n < 3; n++) sum += j[r][m] * stated_covariance_[m][n] * j[c][n];
      wide[r][c] = sum + (r != c ? 0.0 : r < 2 ? square(kWrong_m) : square(kWrong_rad));
      right[r][c] = sum + seen.covariance[r][c];
      wrong[r][c] = wide[r][c] + seen.covariance[r][c];
    }
  const double d[3] = {seen.pose.x_m - now.x_m, seen.pose.y_m - now.y_m, wrap(seen.pose.heading_rad - now.heading_rad)};
  const factor3 of_right = factor(right), of_wrong = factor(wrong);
  if (!of_right.good || !of_wrong.good) return;
  if (squared_distance(of_wrong, d) > kNeither) return;
  log_odds_ = kPrior + log_density(of_wrong, d) - log_density(of_right, d);
  if (log_odds_ < kRight && seen.covariance[0][0] + seen.covariance[1][1] < 2.0 * square(kSure_m)) open_ = false;
  if (log_odds_ < kWrong) wrong_since_ns_ = WM_TIME_NONE;
  if (log_odds_ > kWrong && wrong_since_ns_ == WM_TIME_NONE) wrong_since_ns_ = t_ns;
  wrong_ = log_odds_ > kWrong && wm_seconds_between(wrong_since_ns_, t_ns) > kLasts_s;
  // Both together, if it was wrong: wide (wide + seen)^-1 moves the stated pose towards the seen one.
  double w[3], a[3][3];  // l^-1 d; l^-1 wide, by columns
  solve_lower(of_wrong, d, w);
  for (int c = 0; c < 3; c++) solve_lower(of_wrong, wide[c], a[c]);
  double move[3];
  for (int r = 0; r < 3; r++) {
    move[r] = a[r][0] * w[0] + a[r][1] * w[1] + a[r][2] * w[2];
    for (int c = 0; c < 3; c++)
      covariance_[r][c] = wide[r][c] - (a[r][0] * a[c][0] + a[r][1] * a[c][1] + a[r][2] * a[c][2]);
  }
  pose_ = {now.x_m + move[0], now.y_m + move[1], wrap(now.heading_rad + move[2])};
}

double start_trial::probability() const { return open_ ? 1.0 / (1.0 + exp(-log_odds_)) : 0.0; }

}  // namespace wm
