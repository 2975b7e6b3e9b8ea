// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "simulate/angle.h"

namespace wm::montecarlo {
namespace {

// The scales of a measured twist (speed, sideways speed, turn rate: a gyro's, where there is one), and the centre of
// rotation of skid steer, are behind those of wheels.
enum { kX, kY, kHeading, kBias, kLeft, kRight, kTrack, kCenter, kSpeed, kSide, kTurn, kMap };
enum { kCameraYaw, kCameraX, kCameraY, kEachCamera };  // behind the map, for cameras that are mounted wrongly

constexpr double kSlipMemory_s = 5;  // of the simulator's wheels

// What happens, in the order of time.
struct Moment {
  double t_s;
  enum Kind { gyro, frame, wanted } kind;
  size_t index;  // of the camera or of the wanted time
};

class Recursion {
 public:
  // `cameras`: how many have errors of their own, and with them one clock that is off.
  Recursion(const sim::Scenario &scenario, Truth truth, size_t landmarks, size_t cameras)
      : sc_(scenario), truth_(std::move(truth)), landmarks_(landmarks), cameras_(cameras) {
    const auto n = static_cast<Eigen::Index>(kMap + 2 * landmarks_ + kEachCamera * cameras_ + (cameras_ > 0));
    const sim::Errors &e = sc_.errors;
    Eigen::VectorXd sigma = Eigen::VectorXd::Constant(n, e.landmark_m);
    const sim::Motion &m = sc_.motion;
    const bool twist = m.twist_hz > 0;
    sigma.head<kMap>() << e.start_xy_m, e.start_xy_m, e.start_heading_rad, e.yaw_rate_bias_radps, e.wheel_radius,
        e.wheel_radius, e.track, m.base == sim::Motion::Base::skid_steer ? e.rotation_center_m : 0, twist ? e.speed : 0,
        m.base == sim::Motion::Base::holonomic ? e.side : 0, twist ? e.turn : 0;
    for (size_t i = 0; i < cameras_; i++) {
      const Eigen::Index at = camera_state(i);
      sigma[at + kCameraYaw] = e.camera_mounting_rad;
      sigma[at + kCameraX] = sigma[at + kCameraY] = e.camera_mounting_m;
    }
    if (cameras_ > 0) sigma[n - 1] = sc_.faults.camera_clock_offset_s;
    cov_ = sigma.cwiseAbs2().asDiagonal();
  }

  void move_to(double t_s) {
    if (t_s <= t_s_) return;
    if (sc_.motion.twist_hz > 0)
      move_by_twist(t_s);
    else
      move_by_wheels(t_s);
    t_s_ = t_s;
  }

  // Along the truth: what the wheels counted, times their radii, moves the robot.
  void move_by_wheels(double t_s) {
    const sim::State from = truth_(t_s_), to = truth_(t_s);
    const double track = sc_.robot.wheels.track_m * sc_.motion.track_scale;
    const double ds = to.way_m - from.way_m, dh = to.heading_rad - from.heading_rad;
    const double left = ds - 0.5 * track * dh, right = ds + 0.5 * track * dh;
    const double mid = from.heading_rad + 0.5 * dh, c = std::cos(mid), s = std::sin(mid);
    Eigen::MatrixXd f = Eigen::MatrixXd::Identity(cov_.rows(), cov_.cols());
    const double ds_by[3] = {0.5 * left, 0.5 * right, 0}, dh_by[3] = {-left / track, right / track, -dh};
    f(kX, kHeading) = -(to.y_m - from.y_m);
    f(kY, kHeading) = to.x_m - from.x_m;
    for (int i = 0; i < 3; i++) {
      f(kX, kLeft + i) = c * ds_by[i] - 0.5 * ds * s * dh_by[i];
      f(kY, kLeft + i) = s * ds_by[i] + 0.5 * ds * c * dh_by[i];
      f(kHeading, kLeft + i) = dh_by[i];
    }
    f(kX, kCenter) = s * dh;
    f(kY, kCenter) = -c * dh;
    cov_ = f * cov_ * f.transpose();
    add_wheel_noise(std::fabs(left), std::fabs(right), track, c, s);
    const double walk = sc_.errors.yaw_rate_bias_walk;
    cov_(kBias, kBias) += walk * walk * (t_s - t_s_);
    // Both wheels slip on their own; what lasts, as noise of the same effect over many such times. What it does to the
    // wheels' opinion of the heading is left out: the gyro is better.
    const double slip = sc_.errors.slip * ds;
    const double way_m2 = kSlipMemory_s * slip * slip / (t_s - t_s_);
    cov_(kX, kX) += way_m2 * c * c;
    cov_(kX, kY) += way_m2 * c * s;
    cov_(kY, kX) += way_m2 * c * s;
    cov_(kY, kY) += way_m2 * s * s;
  }

  // Along the truth: what a twist or a gyro measured, times its scales, moves the robot, with white noise.
  void move_by_twist(double t_s) {
    const sim::State from = truth_(t_s_), to = truth_(t_s);
    const sim::Motion &m = sc_.motion;
    const double dt = t_s - t_s_, dh = to.heading_rad - from.heading_rad, mid = from.heading_rad + 0.5 * dh;
    const double dx = to.x_m - from.x_m, dy = to.y_m - from.y_m, c = std::cos(mid), s = std::sin(mid);
    const double ahead = c * dx + s * dy, aside = c * dy - s * dx;
    const double walk = sc_.errors.yaw_rate_bias_walk;
    const bool gyro = m.imu_hz > 0;
    const double gyro_rad2 = gyro ? sc_.errors.yaw_rate_noise_radps * sc_.errors.yaw_rate_noise_radps / m.imu_hz : 0;
    if (dx == 0 && dy == 0 && dh == 0) {  // it stands, and its sensors show that: a gyro measures its bias
      Eigen::VectorXd h = Eigen::VectorXd::Zero(cov_.rows());
      h[kBias] = 1;
      inform(h, gyro_rad2 / dt + 1e-12);
      cov_(kBias, kBias) += walk * walk * dt;
      return;
    }
    Eigen::MatrixXd f = Eigen::MatrixXd::Identity(cov_.rows(), cov_.cols());
    f(kX, kHeading) = -dy;
    f(kY, kHeading) = dx;
    f(kX, kSpeed) = dx;
    f(kY, kSpeed) = dy;
    f(kX, kSide) = -s * aside;
    f(kY, kSide) = c * aside;
    const double turned_by[2] = {dh, -dt};
    const int turn[2] = {kTurn, kBias};
    for (int i = 0; i < 2; i++) {
      f(kHeading, turn[i]) = turned_by[i];
      f(kX, turn[i]) = -0.5 * dy * turned_by[i];
      f(kY, turn[i]) = 0.5 * dx * turned_by[i];
    }
    cov_ = f * cov_ * f.transpose();
    const auto white = [dt](double constant, double relative, double way) {
      return constant * constant * dt + relative * relative * way * way / dt;
    };
    const double along = white(m.speed_noise_mps, m.speed_noise, ahead);
    const double across = white(m.side_noise_mps, m.side_noise, aside);
    cov_(kX, kX) += c * c * along + s * s * across;
    cov_(kX, kY) += c * s * (along - across);
    cov_(kY, kX) += c * s * (along - across);
    cov_(kY, kY) += s * s * along + c * c * across;
    cov_(kHeading, kHeading) += gyro ? gyro_rad2 * dt : white(m.turn_noise_radps, m.turn_noise, dh);
    cov_(kBias, kBias) += walk * walk * dt;
  }

  // One sample of the yaw-rate sensor over [t - step, t]: a second opinion of how the robot turned.
  void gyro(double step_s) {
    const sim::State from = truth_(t_s_ - step_s), to = truth_(t_s_);
    const double track = sc_.robot.wheels.track_m * sc_.motion.track_scale;
    const double ds = to.way_m - from.way_m, dh = to.heading_rad - from.heading_rad;
    Eigen::VectorXd h = Eigen::VectorXd::Zero(cov_.rows());
    // Expected from the wheels less measured by the sensor.
    h[kLeft] = -(ds - 0.5 * track * dh) / track / step_s;
    h[kRight] = (ds + 0.5 * track * dh) / track / step_s;
    h[kTrack] = -dh / step_s;
    h[kBias] = 1;
    const double sigma = sc_.errors.yaw_rate_noise_radps;
    inform(h, sigma * sigma);
  }

  void frame(const sim::Camera &camera) {
    const sim::State s = truth_(t_s_);
    const double c = std::cos(s.heading_rad), n = std::sin(s.heading_rad);
    const double arm_x = c * camera.xyz_m[0] - n * camera.xyz_m[1], arm_y = n * camera.xyz_m[0] + c * camera.xyz_m[1];
    for (size_t i = 0; i < landmarks_; i++) {
      const double dx = sc_.landmarks[i].p_m[0] - s.x_m - arm_x, dy = sc_.landmarks[i].p_m[1] - s.y_m - arm_y;
      const double q = dx * dx + dy * dy;
      const double bearing = sim::wrap(std::atan2(dy, dx) - s.heading_rad - camera.yaw_rad);
      if (std::fabs(bearing) > 0.5 * camera.field_of_view_rad || std::sqrt(q) > camera.range_m) continue;
      Eigen::VectorXd h = Eigen::VectorXd::Zero(cov_.rows());
      h[kX] = dy / q;
      h[kY] = -dx / q;
      h[kHeading] = -(dx * arm_x + dy * arm_y) / q - 1;
      const auto at = static_cast<Eigen::Index>(kMap + 2 * i);
      h[at] = -dy / q;
      h[at + 1] = dx / q;
      inform(h, camera.bearing_sigma_rad * camera.bearing_sigma_rad / (1 - camera.outlier_fraction));
    }
  }

  // One bearing, by a camera that is mounted wrongly.
  void bearing(const SeenBearing &seen) {
    const sim::State s = truth_(t_s_);
    const double c = std::cos(s.heading_rad), n = std::sin(s.heading_rad);
    const double arm_x = c * seen.camera_m[0] - n * seen.camera_m[1],
                 arm_y = n * seen.camera_m[0] + c * seen.camera_m[1];
    const double dx = seen.landmark_m[0] - s.x_m - arm_x, dy = seen.landmark_m[1] - s.y_m - arm_y,
                 q = dx * dx + dy * dy;
    Eigen::VectorXd h = Eigen::VectorXd::Zero(cov_.rows());
    h[kX] = dy / q;
    h[kY] = -dx / q;
    h[kHeading] = -(dx * arm_x + dy * arm_y) / q - 1;
    const auto map = static_cast<Eigen::Index>(kMap + 2 * seen.landmark);
    h[map] = -dy / q;
    h[map + 1] = dx / q;
    const Eigen::Index at = camera_state(seen.camera);
    h[at + kCameraYaw] = -1;
    h[at + kCameraX] = (c * dy - n * dx) / q;
    h[at + kCameraY] = -(n * dy + c * dx) / q;
    // Taken a little later than stamped: by what the robot moves in that time.
    h[cov_.rows() - 1] = s.speed_mps * (c * h[kX] + n * h[kY]) + s.yaw_rate_radps * h[kHeading];
    inform(h, seen.sigma_rad * seen.sigma_rad);
  }

  Bound now() const { return {cov_(kX, kX), cov_(kY, kY), cov_(kHeading, kHeading)}; }

 private:
  // White noise of each wheel's way, by the ways of both.
  void add_wheel_noise(double left_m, double right_m, double track_m, double c, double s) {
    const double k2 = sc_.errors.wheel_noise_sqrtm * sc_.errors.wheel_noise_sqrtm;
    if (k2 <= 0) return;
    const double way = 0.25 * k2 * (left_m + right_m), turn = k2 * (left_m + right_m) / (track_m * track_m),
                 both = 0.5 * k2 * (right_m - left_m) / track_m;
    cov_(kX, kX) += way * c * c;
    cov_(kX, kY) += way * c * s;
    cov_(kY, kX) += way * c * s;
    cov_(kY, kY) += way * s * s;
    cov_(kX, kHeading) += both * c;
    cov_(kHeading, kX) += both * c;
    cov_(kY, kHeading) += both * s;
    cov_(kHeading, kY) += both * s;
    cov_(kHeading, kHeading) += turn;
  }

  Eigen::Index camera_state(size_t camera) const {
    return static_cast<Eigen::Index>(kMap + 2 * landmarks_ + kEachCamera * camera);
  }

  // Adds the information h h' / variance, in covariance form.
  void inform(const Eigen::VectorXd &h, double variance) {
    const Eigen::VectorXd ph = cov_ * h;
    cov_ -= ph * ph.transpose() / (h.dot(ph) + variance);
  }

  const sim::Scenario &sc_;
  Truth truth_;
  size_t landmarks_, cameras_;
  double t_s_ = 0;
  Eigen::MatrixXd cov_;
};

// Of the gyro beside the wheels, on the bus or of an IMU; infinite: none, or one beside a twist (move_by_twist).
double gyro_step_s(const sim::Scenario &sc) {
  const double rate_hz = sc.motion.imu_hz > 0 ? sc.motion.imu_hz : sc.bus.yaw_rate_hz;
  return sc.motion.twist_hz > 0 || rate_hz <= 0 ? HUGE_VAL : 1 / rate_hz;
}

}  // namespace

std::vector<Bound> bound(const sim::Scenario &sc, const sim::Drive &drive, size_t landmarks,
                         const std::vector<double> &times_s) {
  std::vector<Moment> moments;
  const double end_s = drive.duration_s(), step_s = gyro_step_s(sc);
  for (double t = step_s; t <= end_s; t += step_s) moments.push_back({t, Moment::gyro, 0});
  for (size_t i = 0; i < sc.cameras.size(); i++)
    for (double t = sc.cameras[i].phase_s; t <= end_s; t += 1 / sc.cameras[i].rate_hz)
      moments.push_back({t, Moment::frame, i});
  for (size_t i = 0; i < times_s.size(); i++) moments.push_back({times_s[i], Moment::wanted, i});
  std::stable_sort(moments.begin(), moments.end(), [](const Moment &a, const Moment &b) { return a.t_s < b.t_s; });

  std::vector<Bound> out(times_s.size());
  Recursion recursion(
      sc, [&drive](double t_s) { return drive.at(t_s); }, std::min(landmarks, sc.landmarks.size()), 0);
  for (const Moment &m : moments) {
    recursion.move_to(m.t_s);
    if (m.kind == Moment::gyro) recursion.gyro(step_s);
    if (m.kind == Moment::frame) recursion.frame(sc.cameras[m.index]);
    if (m.kind == Moment::wanted) out[m.index] = recursion.now();
  }
  return out;
}

std::vector<Bound> bound(const sim::Scenario &sc, const Truth &truth, const std::vector<SeenBearing> &seen,
                         size_t landmarks, size_t cameras, const std::vector<double> &times_s) {
  std::vector<Moment> moments;
  const double end_s = times_s.empty() ? 0 : times_s.back(), step_s = gyro_step_s(sc);
  for (double t = step_s; t <= end_s; t += step_s) moments.push_back({t, Moment::gyro, 0});
  for (size_t i = 0; i < seen.size(); i++) moments.push_back({seen[i].t_s, Moment::frame, i});
  for (size_t i = 0; i < times_s.size(); i++) moments.push_back({times_s[i], Moment::wanted, i});
  std::stable_sort(moments.begin(), moments.end(), [](const Moment &a, const Moment &b) { return a.t_s < b.t_s; });
  std::vector<Bound> out(times_s.size());
  Recursion recursion(sc, truth, landmarks, cameras);
  for (const Moment &m : moments) {
    recursion.move_to(m.t_s);
    if (m.kind == Moment::gyro) recursion.gyro(step_s);
    if (m.kind == Moment::frame) recursion.bearing(seen[m.index]);
    if (m.kind == Moment::wanted) out[m.index] = recursion.now();
  }
  return out;
}

}  // namespace wm::montecarlo
