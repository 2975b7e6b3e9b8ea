// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/start_hypotheses.hpp"

#include <cstring>

#include "math/arc.hpp"
#include "math/cholesky.hpp"

// Constants were chosen on drawn crossings (waymark-montecarlo --trials, 100 drives each from seeds 2001 and 5001:
// starts off by 1 m, moved landmarks, false detections) and not swept one by one.
namespace wm {
namespace {

// Prior probability that a stated pose is wrong, and the sigmas of its error then. Larger errors are noticed, too.
constexpr double kWrong = 0.08, kWrong_m = 2.0, kWrong_rad = 0.3;
// Prior probability that a landmark has moved, and the sigma of its motion.
constexpr double kMoved = 0.02, kMovedBy_m = 2.0;
constexpr double kFalse = 0.2;  // share of false detections, when nothing is known of the detector
// "Wrong" is accepted above kSure for kLasts_s, since false detections do not persist. For a found pose, not a stated
// one, less is enough.
constexpr double kSure = 0.999, kSureFound = 0.9, kLasts_s = 0.25;
// The test ends after this distance or time: odometry's error is then larger than the start's.
constexpr double kEnd_m = 10.0, kEnd_s = 10.0;
constexpr double kMatters_m = 0.3, kMatters_rad = 0.1;  // the update corrects a smaller difference
// Fewest landmarks (fewer fit many poses) and bearings, and the share of them that must agree with "wrong".
constexpr int kFewestLandmarks = 3, kFewestBearings = 6;
constexpr double kAgreeing = 0.6;     // share
constexpr double kNever = -1e9;       // logarithm of the probability of a hypothesis that is not tested
constexpr double kNearest_m2 = 0.01;  // squared distance below which a landmark has no bearing
// Sigmas across the line of sight that widen the bearings' noise, m, one a step of Gauss-Newton: far from the solution
// most bearings would count as false.
constexpr double kWidened_m[] = {1.0, 0.3, 0.1, 0.03, 0.0, 0.0, 0.0};

// Capacities. Further landmarks and sensors are left out of the test.
constexpr int kMostLandmarks = 12, kMostSensors = 4, kMostUnknowns = 3 + 2 * kMostLandmarks + kMostSensors;
constexpr int kMostHypotheses = 2 + kMostLandmarks;  // right, wrong, moved k

struct bearing {
  wm_pose2 sensor;  // in the start's base_link
  double place_m[2], angle_rad;
  double angle_variance, travel_variance_m2;  // the second across the line of sight
  int landmark, sensor_number;                // in order of appearance
  bool has_height;
  double height_m, tangent;  // of the landmark above the sensor, and of its elevation
  double tangent_variance, height_variance_m2;
};

int number_of(int id, int *known, int *count, int most) {
  for (int i = 0; i < *count; i++)
    if (known[i] == id) return i;
  if (*count == most) return -1;
  known[*count] = id;
  return (*count)++;
}

}  // namespace

// The bearings of a test. Unknowns, each divided by its sigma: the pose's error, each landmark's on the map, each
// sensor's yaw.
struct start_problem {
  bearing bearings[pose_search::kCapacity];
  int count, landmarks, sensors;
  int id[kMostLandmarks], sensor_id[kMostSensors];
  double sigma_m[kMostLandmarks];
  int heights[kMostLandmarks];  // observations of each landmark's height
  double yaw_sigma_rad;

  int unknowns() const { return 3 + 2 * landmarks + sensors; }
  int at_landmark(const bearing &b) const { return 3 + 2 * b.landmark; }
  int at_yaw(const bearing &b) const { return 3 + 2 * landmarks + b.sensor_number; }

  // `start`: stated pose and odometry then.
  void add(const observation &o, const start_hypotheses::constant_errors &sigma, const wm_pose2 &stated,
           const travelled_pose2 &odometry) {
    bearing &b = bearings[count];
    b.landmark = number_of(o.key / kMaxSensors, id, &landmarks, kMostLandmarks);
    b.sensor_number = number_of(o.key % kMaxSensors, sensor_id, &sensors, kMostSensors);
    if (b.landmark < 0 || b.sensor_number < 0) return;
    b.sensor = between(odometry.pose, o.sensor);
    const wm_pose2 from = compose(stated, b.sensor);
    const double distance_m2 = square(o.place_m[0] - from.x_m) + square(o.place_m[1] - from.y_m);
    sigma_m[b.landmark] =
        std::sqrt(square(o.sigma_place_m) + square(sigma.lateral_m) + square(sigma.bearing_rad) * distance_m2);
    b.place_m[0] = o.place_m[0];
    b.place_m[1] = o.place_m[1];
    b.angle_rad = o.bearing_rad;
    b.angle_variance = square(o.sigma_angle_rad) + square(kTurnSigma * (o.turned_rad - odometry.turned_rad));
    b.travel_variance_m2 = square(kTravelSigma * (o.travelled_m - odometry.travelled_m));
    b.has_height = (o.kind & kObservedElevation) != 0;
    heights[b.landmark] += b.has_height;
    b.height_m = o.height_m;
    b.tangent = o.tangent;
    b.tangent_variance = square(o.sigma_tangent);
    b.height_variance_m2 = square(o.sigma_height_m);
    count++;
  }
};

namespace {

// The factor of the pose's prior covariance, whose lower triangle counts, and the landmark that has moved (-1: none).
struct hypothesis {
  const double (*pose_factor)[3];
  int moved;

  double sigma_m(const start_problem &all, int landmark) const {
    return landmark == moved ? kMovedBy_m : all.sigma_m[landmark];
  }
};

struct explanation {
  double log_likelihood;  // relative to "all detections are false"
  wm_pose2 start;
  double start_covariance[3][3];
  int agreeing;
  bool good;
};

// Point of linearisation.
struct estimate_of_start {
  double z[kMostUnknowns];  // the unknowns, each over its sigma
  wm_pose2 start;
  sin_cos turn;
  double widened_m;

  void take_start(const wm_pose2 &stated, const hypothesis &h) {
    double off[3];
    for (int i = 0; i < 3; i++) {
      off[i] = 0.0;
      for (int k = 0; k <= i; k++) off[i] += h.pose_factor[i][k] * z[k];
    }
    start = {stated.x_m + off[0], stated.y_m + off[1], wrap(stated.heading_rad + off[2])};
    turn = sincos(start.heading_rad);
  }
};

// Normal equations a step = g, where the prior of each unknown has unit variance.
struct normal_equations {
  double a[kMostUnknowns * kMostUnknowns], g[kMostUnknowns];

  void begin(int n, const double *z) {
    for (int i = 0; i < n; i++) {
      g[i] = -z[i];
      for (int j = 0; j < n; j++) a[i * kMostUnknowns + j] = i == j;
    }
  }
  void add(const int index[6], const double row[6], double residual, double weight) {
    for (int i = 0; i < 6; i++) {
      g[index[i]] -= weight * row[i] * residual;
      for (int j = 0; j < 6; j++) a[index[i] * kMostUnknowns + index[j]] += weight * row[i] * row[j];
    }
  }
};

// Residuals of one bearing, and of the landmark's height by its elevation.
struct residuals {
  double lever_x, lever_y;     // from the start's base_link to the sensor, map axes
  double dx, dy, distance_m2;  // from there to the landmark
  double angle_rad, angle_variance;
  double height_m, height_weight;  // 1 / variance; 0: none
};

// False: too near.
bool residuals_of(const start_problem &all, const hypothesis &h, const bearing &b, const estimate_of_start &at,
                  residuals *out) {
  const double sigma_m = h.sigma_m(all, b.landmark), *place = at.z + all.at_landmark(b);
  out->lever_x = at.turn.cos * b.sensor.x_m - at.turn.sin * b.sensor.y_m;
  out->lever_y = at.turn.sin * b.sensor.x_m + at.turn.cos * b.sensor.y_m;
  out->dx = b.place_m[0] + sigma_m * place[0] - at.start.x_m - out->lever_x;
  out->dy = b.place_m[1] + sigma_m * place[1] - at.start.y_m - out->lever_y;
  const double q = out->distance_m2 = out->dx * out->dx + out->dy * out->dy;
  if (!(q > kNearest_m2)) return false;
  out->angle_rad = wrap(at.start.heading_rad + b.sensor.heading_rad + all.yaw_sigma_rad * at.z[all.at_yaw(b)] +
                        b.angle_rad - atan2(out->dy, out->dx));
  const double across_m2 = b.travel_variance_m2 + square(at.widened_m);
  out->angle_variance = b.angle_variance + across_m2 / q;
  out->height_m = out->height_weight = 0.0;
  if (!b.has_height) return true;
  // Errors of tilt are constant: all heights of a landmark count as one.
  out->height_m = b.tangent * std::sqrt(q) - b.height_m;
  out->height_weight =
      1.0 / (all.heights[b.landmark] * (q * b.tangent_variance + b.height_variance_m2 + square(b.tangent) * across_m2));
  return true;
}

// Adds one bearing to the normal equations and to the likelihood, a mixture of the expected density with false
// detections. A height contradicts, but does not confirm: many landmarks have much the same height.
void add_bearing(const start_problem &all, const hypothesis &h, const bearing &b, const estimate_of_start &at,
                 normal_equations *e, explanation *out) {
  residuals r;
  if (!residuals_of(all, h, b, at, &r)) return;
  const double right = (1.0 - kFalse) * kTwoPi *
                       exp(-0.5 * (square(r.angle_rad) / r.angle_variance + square(r.height_m) * r.height_weight)) /
                       std::sqrt(kTwoPi * r.angle_variance);
  const double right_probability = right / (right + kFalse);
  out->log_likelihood += log(right + kFalse);
  out->agreeing += right_probability > 0.5;
  const int place = all.at_landmark(b), index[6] = {0, 1, 2, place, place + 1, all.at_yaw(b)};
  const double sigma_m = h.sigma_m(all, b.landmark);
  // `by`: derivatives by the start's x, y and heading; those by the landmark's place are opposite.
  const auto add_row = [&](const double(&by)[3], double by_yaw, double residual, double weight) {
    double row[6] = {0, 0, 0, -by[0] * sigma_m, -by[1] * sigma_m, by_yaw};
    for (int k = 0; k < 3; k++)
      for (int i = k; i < 3; i++) row[k] += by[i] * h.pose_factor[i][k];
    e->add(index, row, residual, weight);
  };
  const double q = r.distance_m2;
  add_row({-r.dy / q, r.dx / q, 1.0 + (r.lever_x * r.dx + r.lever_y * r.dy) / q}, all.yaw_sigma_rad, r.angle_rad,
          right_probability / r.angle_variance);
  if (!b.has_height) return;
  const double farther = b.tangent / std::sqrt(q);
  add_row({-farther * r.dx, -farther * r.dy, farther * (r.dx * r.lever_y - r.dy * r.lever_x)}, 0.0, r.height_m,
          right_probability * r.height_weight);
}

// Normal equations and likelihood at the unknowns at->z; then e->a is factorised. False: it cannot be.
bool linearise(const start_problem &all, const wm_pose2 &stated, const hypothesis &h, estimate_of_start *at,
               normal_equations *e, explanation *out) {
  const int n = all.unknowns();
  at->take_start(stated, h);
  out->start = at->start;
  out->log_likelihood = 0.0;
  out->agreeing = 0;
  for (int i = 0; i < n; i++) out->log_likelihood -= 0.5 * square(at->z[i]);
  e->begin(n, at->z);
  for (int m = 0; m < all.count; m++) add_bearing(all, h, all.bearings[m], *at, e, out);
  return factorize(n, e->a, kMostUnknowns);
}

// The start's covariance F (A^-1) F' by the factor of A, F the pose's factor: A^-1 = (L^-1)' L^-1, column by column.
void put_start_covariance(const double *l, int n, const hypothesis &h, double out[3][3]) {
  double column[3][kMostUnknowns], inverse[3][3];
  for (int c = 0; c < 3; c++) {
    for (int i = 0; i < n; i++) column[c][i] = i == c;
    substitute_forward(n, l, kMostUnknowns, column[c]);
  }
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      inverse[r][c] = out[r][c] = 0.0;
      for (int i = 0; i < n; i++) inverse[r][c] += column[r][i] * column[c][i];
    }
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++)
      for (int i = 0; i <= r; i++)
        for (int j = 0; j <= c; j++) out[r][c] += h.pose_factor[r][i] * inverse[i][j] * h.pose_factor[c][j];
}

// Laplace's method.
explanation explain(const start_problem &all, const wm_pose2 &stated, const hypothesis &h) {
  explanation out{};
  const int n = all.unknowns();
  estimate_of_start at{};
  normal_equations e;
  for (const double widened_m : kWidened_m) {
    at.widened_m = widened_m;
    if (!linearise(all, stated, h, &at, &e, &out)) return out;
    substitute_forward(n, e.a, kMostUnknowns, e.g);
    substitute_backward(n, e.a, kMostUnknowns, e.g);
    for (int i = 0; i < n; i++) at.z[i] += e.g[i];
  }
  at.widened_m = 0.0;
  if (!linearise(all, stated, h, &at, &e, &out)) return out;
  for (int i = 0; i < n; i++) out.log_likelihood -= log(e.a[i * kMostUnknowns + i]);
  put_start_covariance(e.a, n, h, out.start_covariance);
  out.good = finite(out.log_likelihood);
  return out;
}

bool is_far(const wm_pose2 &a, const wm_pose2 &b) {
  return square(a.x_m - b.x_m) + square(a.y_m - b.y_m) > square(kMatters_m) ||
         std::fabs(wrap(a.heading_rad - b.heading_rad)) > kMatters_rad;
}

// The covariance of a pose that may be off by metres.
void widen(const double covariance[3][3], double out[3][3]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      out[i][j] = covariance[i][j] + (i != j ? 0.0 : i < 2 ? square(kWrong_m) : square(kWrong_rad));
}

}  // namespace

// The hypotheses: [0] right, [1] wrong, [2 + k] landmark k has moved.
struct start_hypotheses::posterior {
  double probability[kMostHypotheses];  // first the log of the likelihood times the prior
  bool wrong[kMostHypotheses];          // under this hypothesis the pose is another one
  int count;
  explanation alternative;  // the pose that it is then
  int best_moved;           // of a found pose: the hypothesis of `alternative`; 0: none

  void normalise() {
    double most = probability[0], sum = 0.0;
    for (int k = 1; k < count; k++) most = probability[k] > most ? probability[k] : most;
    for (int k = 0; k < count; k++) sum += probability[k] = exp(probability[k] - most);
    for (int k = 0; k < count; k++) probability[k] /= sum;
  }
  double wrong_probability() const {
    double sum = 0.0;
    for (int k = 0; k < count; k++) sum += wrong[k] ? probability[k] : 0.0;
    return sum;
  }
};

void start_hypotheses::begin(const wm_pose2 &pose, const double covariance[3][3], const travelled_pose2 &odometry) {
  stated_ = pose_ = pose;
  odometry_ = odometry;
  std::memcpy(stated_covariance_, covariance, sizeof stated_covariance_);
  std::memcpy(covariance_, covariance, sizeof covariance_);
  std::memcpy(factor_, covariance, sizeof factor_);
  begun_ns_ = accepted_since_ns_ = WM_TIME_NONE;
  wrong_ = 0.0;
  rejected_ = found_ = false;
  since_ns_ = INT64_MIN;
  open_ = factorize(3, factor_[0], 3);
}

void start_hypotheses::begin_found(const wm_pose2 &pose, const double covariance[3][3], const travelled_pose2 &odometry,
                                   wm_time_ns since_ns) {
  double wide[3][3];
  widen(covariance, wide);
  begin(pose, wide, odometry);
  found_ = true;
  since_ns_ = since_ns;
}

// Explains the bearings by each hypothesis. Of a found pose there is no "wrong": the best landmark that has moved, and
// by that displaces the pose, stands for it. `filter_start`: the filter's pose, carried back to the start. False:
// numerical failure.
bool start_hypotheses::explain_all(const start_problem &all, const wm_pose2 &filter_start, posterior *out) const {
  double wide[3][3];
  widen(stated_covariance_, wide);
  if (!factorize(3, wide[0], 3)) return false;
  const explanation right = explain(all, stated_, {factor_, -1});
  out->alternative = found_ ? right : explain(all, stated_, {wide, -1});
  if (!right.good || !out->alternative.good) return false;
  out->count = 2 + all.landmarks;
  out->probability[0] = right.log_likelihood;
  out->probability[1] = found_ ? kNever : out->alternative.log_likelihood + log(kWrong);
  out->wrong[0] = false;
  out->wrong[1] = !found_;
  out->best_moved = 0;
  for (int k = 2; k < out->count; k++) {
    const explanation moved = explain(all, stated_, {factor_, k - 2});
    out->probability[k] = (moved.good ? moved.log_likelihood : right.log_likelihood) + log(kMoved);
    out->wrong[k] = found_ && moved.good && is_far(moved.start, filter_start);
    if (!out->wrong[k] || (out->best_moved > 0 && out->probability[k] <= out->probability[out->best_moved])) continue;
    out->best_moved = k;
    out->alternative = moved;
  }
  out->normalise();
  return true;
}

// Is the alternative pose so probable, so far from the stated one and so well supported that it should be taken?
bool start_hypotheses::accepts_wrong(const start_problem &all, const posterior &p) {
  const explanation &other = p.alternative;
  const bool matters =
      found_ ? p.best_moved > 0 && p.probability[p.best_moved] > kSureFound : is_far(other.start, stated_);
  // "Wrong", but at the same place.
  if (!found_ && !matters && other.start_covariance[0][0] + other.start_covariance[1][1] < square(kMatters_m))
    wrong_ = 0.0;
  const bool enough = all.landmarks >= kFewestLandmarks + found_ && all.count >= kFewestBearings;
  return enough && matters && wrong_ > (found_ ? kSureFound : kSure) && other.agreeing >= kAgreeing * all.count &&
         other.log_likelihood > 0.0;
}

void start_hypotheses::test(const pose_search &observations, const constant_errors &sigma, const wm_pose2 &pose,
                            const travelled_pose2 &odometry, wm_time_ns t_ns) {
  if (begun_ns_ == WM_TIME_NONE) begun_ns_ = t_ns;
  const double travelled_m = odometry.travelled_m - odometry_.travelled_m;
  if (travelled_m > kEnd_m || wm_seconds_between(begun_ns_, t_ns) > kEnd_s) open_ = false;
  if (!open_) return;
  start_problem all{};
  all.yaw_sigma_rad = sigma.yaw_rad;
  for (int i = 0; i < observations.kept(); i++) {
    const observation &o = observations.at(i);
    if ((o.kind & kObservedBearing) && o.key >= 0 && o.t_ns >= since_ns_) all.add(o, sigma, stated_, odometry_);
  }
  posterior p;
  if (all.count == 0 || !explain_all(all, compose(pose, between(odometry.pose, odometry_.pose)), &p)) return;
  wrong_ = p.wrong_probability();
  const bool accepted = accepts_wrong(all, p);
  if (!accepted) accepted_since_ns_ = WM_TIME_NONE;
  if (accepted && accepted_since_ns_ == WM_TIME_NONE) accepted_since_ns_ = t_ns;
  rejected_ = accepted && wm_seconds_between(accepted_since_ns_, t_ns) > kLasts_s;

  // The alternative start, carried on by odometry.
  pose_ = compose(p.alternative.start, between(odometry_.pose, odometry.pose));
  std::memset(covariance_, 0, sizeof covariance_);
  for (int i = 0; i < 2; i++) covariance_[i][i] = square(kTravelSigma * travelled_m);
  covariance_[2][2] = square(kTurnSigma * (odometry.turned_rad - odometry_.turned_rad));
  add_attached_covariance(p.alternative.start, pose_, p.alternative.start_covariance, covariance_);
}

}  // namespace wm
