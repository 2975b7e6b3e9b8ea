// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/start_trial.hpp"

#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOff = 0.08;                      // what somebody states is wrong in one of twelve cases ...
constexpr double kOff_m = 2.0, kOff_rad = 0.3;     // ... by this; who is farther off is found out all the same
constexpr double kMoved = 0.02, kMovedBy_m = 2.0;  // a landmark is not where the map says, but near
constexpr double kFalse = 0.2;                     // share of detections that are anything, as far as anybody knows
constexpr double kSure = 0.999, kLasts_s = 0.25;   // false ones come and go
constexpr double kSureFound = 0.9;                 // nobody stated what was found
constexpr double kWay_m = 10.0, kTime_s = 10.0;    // then odometry has forgotten where it began
constexpr double kMatters_m = 0.3, kMatters_rad = 0.1;  // less mends itself
constexpr int kLandmarks = 3;                           // fewer fit many places
constexpr int kSightings = 6;
constexpr double kAgreeing = 0.6;
constexpr double kNever = -1e9;                                    // as logarithm of a probability
constexpr double kLoose[] = {1.0, 0.3, 0.1, 0.03, 0.0, 0.0, 0.0};  // metres, while the way is still to be found

constexpr int kMostLandmarks = 12, kMostSensors = 4;
constexpr int kMost = 3 + 2 * kMostLandmarks + kMostSensors;

// The lower triangle L of a = L L', in its place.
bool factorize(int n, double *a, int stride) {
  for (int i = 0; i < n; i++)
    for (int j = 0; j <= i; j++) {
      double sum = a[i * stride + j];
      for (int k = 0; k < j; k++) sum -= a[i * stride + k] * a[j * stride + k];
      if (i != j) {
        a[i * stride + j] = sum / a[j * stride + j];
      } else if (sum > 0.0 && finite(sum)) {
        a[i * stride + i] = std::sqrt(sum);
      } else {
        return false;
      }
    }
  return true;
}

struct bearing {
  wm_pose2 sensor;  // in the start's base_link
  double place_m[2], angle_rad;
  double angle_variance, way_variance_m2;  // the second across the line of sight
  int landmark, sensor_number;             // numbered as they come
  bool has_height;
  double height_m, tangent;  // of the landmark above the sensor, and of its elevation
  double tangent_variance, height_variance_m2;
};

struct problem {
  bearing bearings[pose_search::kCapacity];
  int count, landmarks, sensors;
  int id[kMostLandmarks], sensor_id[kMostSensors];
  double sigma_m[kMostLandmarks];
  int heights[kMostLandmarks];  // how often each was told
  double yaw_sigma_rad;

  int unknowns() const { return 3 + 2 * landmarks + sensors; }
};

int number_of(int id, int *known, int *count, int most) {
  for (int i = 0; i < *count; i++)
    if (known[i] == id) return i;
  if (*count == most) return -1;
  known[*count] = id;
  return (*count)++;
}

// One hypothesis: its prior's factor of the pose, the landmark that may be anywhere near by (-1: none).
struct hypothesis {
  const double (*pose_factor)[3];  // its lower triangle counts
  int moved;
};

struct explanation {
  double log_likelihood;  // over that of "all of it is anything"
  wm_pose2 start;
  double start_covariance[3][3];
  int agreeing;
  bool good;
};

explanation explain(const problem &all, const wm_pose2 &stated, const hypothesis &h) {
  explanation out{};
  const int n = all.unknowns();
  double z[kMost] = {};               // the unknowns, each over its sigma
  double a[kMost * kMost], g[kMost];  // normal equations, then their factor
  const auto sigma_of = [&](int landmark) { return landmark == h.moved ? kMovedBy_m : all.sigma_m[landmark]; };
  constexpr int kRounds = sizeof kLoose / sizeof kLoose[0];
  for (int round = 0; round <= kRounds; round++) {
    const bool last = round == kRounds;
    const double loose_m = last ? 0.0 : kLoose[round];
    double off[3];
    for (int i = 0; i < 3; i++) {
      off[i] = 0.0;
      for (int k = 0; k <= i; k++) off[i] += h.pose_factor[i][k] * z[k];
    }
    out.start = {stated.x_m + off[0], stated.y_m + off[1], wrap(stated.heading_rad + off[2])};
    const sin_cos turn = sincos(out.start.heading_rad);
    out.log_likelihood = 0.0;
    out.agreeing = 0;
    for (int i = 0; i < n; i++) {
      g[i] = -z[i];
      out.log_likelihood -= 0.5 * square(z[i]);
      for (int j = 0; j < n; j++) a[i * kMost + j] = i == j;
    }
    for (int m = 0; m < all.count; m++) {
      const bearing &b = all.bearings[m];
      const double sigma_m = sigma_of(b.landmark);
      const int at_landmark = 3 + 2 * b.landmark, at_yaw = 3 + 2 * all.landmarks + b.sensor_number;
      const double rx = turn.cos * b.sensor.x_m - turn.sin * b.sensor.y_m;
      const double ry = turn.sin * b.sensor.x_m + turn.cos * b.sensor.y_m;
      const double dx = b.place_m[0] + sigma_m * z[at_landmark] - out.start.x_m - rx;
      const double dy = b.place_m[1] + sigma_m * z[at_landmark + 1] - out.start.y_m - ry;
      const double q = dx * dx + dy * dy;
      if (!(q > 0.01)) continue;
      const double residual = wrap(out.start.heading_rad + b.sensor.heading_rad + all.yaw_sigma_rad * z[at_yaw] +
                                   b.angle_rad - atan2(dy, dx));
      const double variance = b.angle_variance + (b.way_variance_m2 + square(loose_m)) / q;
      // A height speaks against, not for: signs hang at much the same one. Often told, it is no more than one: tilts
      // last.
      const double distance = std::sqrt(q), height = b.has_height ? b.tangent * distance - b.height_m : 0.0;
      const double height_weight =
          b.has_height ? 1.0 / (all.heights[b.landmark] * (q * b.tangent_variance + b.height_variance_m2 +
                                                           square(b.tangent) * (b.way_variance_m2 + square(loose_m))))
                       : 0.0;
      const double right = (1.0 - kFalse) * kTwoPi *
                           exp(-0.5 * (square(residual) / variance + square(height) * height_weight)) /
                           std::sqrt(kTwoPi * variance);
      const double trust = right / (right + kFalse);
      out.log_likelihood += log(right + kFalse);
      out.agreeing += trust > 0.5;
      const double by[3] = {-dy / q, dx / q, 1.0 + (rx * dx + ry * dy) / q};
      const int index[6] = {0, 1, 2, at_landmark, at_landmark + 1, at_yaw};
      const auto add_row = [&](const double of[3], double by_yaw, double off_by, double weight) {
        double row[6] = {0, 0, 0, -of[0] * sigma_m, -of[1] * sigma_m, by_yaw};
        for (int k = 0; k < 3; k++)
          for (int i = k; i < 3; i++) row[k] += of[i] * h.pose_factor[i][k];
        for (int i = 0; i < 6; i++) {
          g[index[i]] -= weight * row[i] * off_by;
          for (int j = 0; j < 6; j++) a[index[i] * kMost + index[j]] += weight * row[i] * row[j];
        }
      };
      add_row(by, all.yaw_sigma_rad, residual, trust / variance);
      if (b.has_height) {
        const double farther = b.tangent / distance;
        const double raised[3] = {-farther * dx, -farther * dy, farther * (dx * ry - dy * rx)};
        add_row(raised, 0.0, height, trust * height_weight);
      }
    }
    if (!factorize(n, a, kMost)) return out;
    if (last) break;
    for (int i = 0; i < n; i++) {
      for (int k = 0; k < i; k++) g[i] -= a[i * kMost + k] * g[k];
      g[i] /= a[i * kMost + i];
    }
    for (int i = n - 1; i >= 0; i--) {
      for (int k = i + 1; k < n; k++) g[i] -= a[k * kMost + i] * g[k];
      g[i] /= a[i * kMost + i];
    }
    for (int i = 0; i < n; i++) z[i] += g[i];
  }
  for (int i = 0; i < n; i++) out.log_likelihood -= log(a[i * kMost + i]);
  // The pose's covariance: factor (a^-1 of the pose) factor'. a^-1 = (L^-1)' L^-1, column by column.
  double column[3][kMost];
  for (int c = 0; c < 3; c++)
    for (int i = 0; i < n; i++) {
      double sum = i == c;
      for (int k = 0; k < i; k++) sum -= a[i * kMost + k] * column[c][k];
      column[c][i] = sum / a[i * kMost + i];
    }
  double inverse[3][3];
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      inverse[r][c] = 0.0;
      for (int i = 0; i < n; i++) inverse[r][c] += column[r][i] * column[c][i];
    }
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++)
      for (int i = 0; i <= r; i++)
        for (int j = 0; j <= c; j++)
          out.start_covariance[r][c] += h.pose_factor[r][i] * inverse[i][j] * h.pose_factor[c][j];
  out.good = finite(out.log_likelihood);
  return out;
}

bool is_far(const wm_pose2 &a, const wm_pose2 &b) {
  return square(a.x_m - b.x_m) + square(a.y_m - b.y_m) > square(kMatters_m) ||
         std::fabs(wrap(a.heading_rad - b.heading_rad)) > kMatters_rad;
}

}  // namespace

void start_trial::begin(const wm_pose2 &pose, const double covariance[3][3], const wm_pose2 &odom, double travelled_m,
                        double turned_rad) {
  stated_ = pose_ = pose;
  odom_ = odom;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      stated_covariance_[i][j] = covariance_[i][j] = factor_[i][j] = covariance[i][j];
    }
  travelled_m_ = travelled_m;
  turned_rad_ = turned_rad;
  begun_ns_ = WM_TIME_NONE;
  off_ = 0.0;
  off_since_ns_ = WM_TIME_NONE;
  surely_off_ = found_ = false;
  since_ns_ = INT64_MIN;
  open_ = factorize(3, factor_[0], 3);
}

void start_trial::begin_found(const wm_pose2 &pose, const double covariance[3][3], const wm_pose2 &odom,
                              double travelled_m, double turned_rad, wm_time_ns since_ns) {
  double wide[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      wide[i][j] = covariance[i][j] + (i != j ? 0.0 : i < 2 ? square(kOff_m) : square(kOff_rad));
  begin(pose, wide, odom, travelled_m, turned_rad);
  found_ = true;
  since_ns_ = since_ns;
}

void start_trial::weigh(const pose_search &clues, const lasting &sigma, const wm_pose2 &pose, const wm_pose2 &odom,
                        double travelled_m, double turned_rad, wm_time_ns t_ns) {
  if (begun_ns_ == WM_TIME_NONE) begun_ns_ = t_ns;
  if (travelled_m - travelled_m_ > kWay_m || wm_seconds_between(begun_ns_, t_ns) > kTime_s) open_ = false;
  if (!open_) return;
  problem all{};
  all.yaw_sigma_rad = sigma.yaw_rad;
  for (int i = 0; i < clues.kept(); i++) {
    const observation &c = clues.at(i);
    if (!(c.kind & kObservedBearing) || c.key < 0 || c.t_ns < since_ns_) continue;
    bearing &b = all.bearings[all.count];
    b.landmark = number_of(c.key / kMaxSensors, all.id, &all.landmarks, kMostLandmarks);
    b.sensor_number = number_of(c.key % kMaxSensors, all.sensor_id, &all.sensors, kMostSensors);
    if (b.landmark < 0 || b.sensor_number < 0) continue;
    b.sensor = between(odom_, c.sensor);
    const wm_pose2 from = compose(stated_, b.sensor);
    const double distance_m2 = square(c.place_m[0] - from.x_m) + square(c.place_m[1] - from.y_m);
    all.sigma_m[b.landmark] =
        std::sqrt(square(c.sigma_place_m) + square(sigma.lateral_m) + square(sigma.bearing_rad) * distance_m2);
    b.place_m[0] = c.place_m[0];
    b.place_m[1] = c.place_m[1];
    b.angle_rad = c.bearing_rad;
    b.angle_variance = square(c.sigma_angle_rad) + square(kTurnError * (c.turned_rad - turned_rad_));
    b.way_variance_m2 = square(kWayError * (c.travelled_m - travelled_m_));
    b.has_height = (c.kind & kObservedElevation) != 0;
    all.heights[b.landmark] += b.has_height;
    b.height_m = c.height_m;
    b.tangent = c.tangent;
    b.tangent_variance = square(c.sigma_tangent);
    b.height_variance_m2 = square(c.sigma_height_m);
    all.count++;
  }
  if (all.count == 0) return;
  double wide_factor[3][3];
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++)
      wide_factor[r][c] = stated_covariance_[r][c] + (r != c ? 0.0 : r < 2 ? square(kOff_m) : square(kOff_rad));
  if (!factorize(3, wide_factor[0], 3)) return;

  // Right, off, moved k; of what was found the best "moved" stands for "off".
  const explanation right = explain(all, stated_, {factor_, -1});
  explanation off = found_ ? right : explain(all, stated_, {wide_factor, -1});
  if (!right.good || !off.good) return;
  double of[2 + kMostLandmarks];
  bool elsewhere[2 + kMostLandmarks] = {false, !found_};
  of[0] = right.log_likelihood;
  of[1] = found_ ? kNever : off.log_likelihood + log(kOff);
  int best = 0;
  const wm_pose2 here = compose(pose, between(odom, odom_));  // the filter's, carried back
  for (int k = 0; k < all.landmarks; k++) {
    const explanation moved = explain(all, stated_, {factor_, k});
    of[2 + k] = moved.good ? moved.log_likelihood + log(kMoved) : of[0] + log(kMoved);
    if (!found_ || !moved.good) continue;
    elsewhere[2 + k] = is_far(moved.start, here);
    if (!elsewhere[2 + k] || (best > 0 && of[2 + k] <= of[best])) continue;
    best = 2 + k;
    off = moved;
  }
  double most = of[0], sum = 0.0;
  for (int k = 1; k < 2 + all.landmarks; k++) most = of[k] > most ? of[k] : most;
  for (int k = 0; k < 2 + all.landmarks; k++) sum += of[k] = exp(of[k] - most);
  off_ = 0.0;
  for (int k = 0; k < 2 + all.landmarks; k++) off_ += elsewhere[k] ? of[k] / sum : 0.0;
  const bool enough = all.landmarks >= kLandmarks + found_ && all.count >= kSightings;
  const bool matters = found_ ? best > 0 && of[best] > kSureFound * sum : is_far(off.start, stated_);
  // "Off", but at the same place.
  if (!found_ && !matters && off.start_covariance[0][0] + off.start_covariance[1][1] < square(kMatters_m)) off_ = 0.0;
  const bool sure = enough && matters && off_ > (found_ ? kSureFound : kSure) &&
                    off.agreeing >= kAgreeing * all.count && off.log_likelihood > 0.0;
  if (!sure) off_since_ns_ = WM_TIME_NONE;
  if (sure && off_since_ns_ == WM_TIME_NONE) off_since_ns_ = t_ns;
  surely_off_ = sure && wm_seconds_between(off_since_ns_, t_ns) > kLasts_s;

  pose_ = compose(off.start, between(odom_, odom));
  const double lever_x = pose_.x_m - off.start.x_m, lever_y = pose_.y_m - off.start.y_m;
  const double j[3][3] = {{1, 0, -lever_y}, {0, 1, lever_x}, {0, 0, 1}};
  const double way_m2 = square(kWayError * (travelled_m - travelled_m_));
  const double turn_rad2 = square(kTurnError * (turned_rad - turned_rad_));
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      covariance_[r][c] = r != c ? 0.0 : r < 2 ? way_m2 : turn_rad2;
      for (int m = 0; m < 3; m++)
        for (int n = 0; n < 3; n++) covariance_[r][c] += j[r][m] * off.start_covariance[m][n] * j[c][n];
    }
}

}  // namespace wm
