// SPDX-License-Identifier: Apache-2.0
// The errors of cameras and of what is found in their pictures, measured back: mounting and intrinsics from labels,
// truth and calibration; stamps and arrivals; the map's landmarks; bearings, markers and stereo points.
#include <Eigen/Dense>
#include <algorithm>
#include <sstream>

#include "filmed.h"
#include "simulate/angle.h"
#include "simulate/motion.h"

using namespace wm::sim;
using wm::images::Vec2;
using wm::images::Vec3;

namespace {

constexpr double kDegree = kPi / 180;

bool all;

// A label: where a landmark of the map is in a picture that was taken at t_s.
struct Label {
  double t_s;
  Vec3 place;
  Vec2 pixel;
};

std::vector<Label> labels_of(const Film &film, size_t camera) {
  std::vector<Label> out;
  const std::vector<FrameTime> times = frame_times(film, camera);
  for (size_t i = 0; i < times.size(); i += 7) {
    wm::render::Shot shot;
    shot.t_ns = std::llround(times[i].t_s * 1e9);
    shot.frame = i;
    shot.T_map_base = motion_of(film.recording);
    std::string text, line;
    film.world->label(film.world->labels[0], camera, film.cameras[camera].truth, shot, text);
    for (std::istringstream lines(text); std::getline(lines, line);) {
      double u = 0, v = 0;
      int id = 0;
      TEST_ASSERT_EQUAL(3, std::sscanf(line.c_str(), "%*d,%*d,%d,%lf,%lf", &id, &u, &v));
      for (const wm_landmark &l : film.recording.landmarks)
        if (l.id == id) out.push_back({times[i].t_s, Vec3(l.p_m), Vec2(u, v)});
    }
  }
  return out;
}

using Unknowns = Eigen::Matrix<double, 10, 1>;  // turned (3), moved (3), fx, fy, cx, cy (relative)

wm::images::Camera changed(const wm::images::Camera &believed, const Unknowns &x) {
  wm::images::Camera c = believed;
  const double nowhere[3] = {0, 0, 0};
  c.T_base_camera = believed.T_base_camera * pose_of(nowhere, x.data());
  c.T_base_camera.translation() += x.segment<3>(3);
  for (int i = 0; i < 4; i++) c.intrinsics[c.intrinsics.size() - 4 + static_cast<size_t>(i)] *= 1 + x[6 + i];
  return c;
}

// Gauss-Newton from the calibration on, by what truth and labels say.
Unknowns camera_from_labels(const Film &film, size_t number, double &rms_px) {
  const std::vector<Label> labels = labels_of(film, number);
  TEST_ASSERT_GREATER_THAN(100, labels.size());
  Unknowns x = Unknowns::Zero();
  for (int pass = 0; pass < 8; pass++) {
    Eigen::Matrix<double, 10, 10> A = Eigen::Matrix<double, 10, 10>::Zero();
    Unknowns b = Unknowns::Zero();
    double squares = 0;
    for (const Label &l : labels) {
      const Vec3 in_base = true_pose(film.recording, l.t_s).inverse() * l.place;
      const auto pixel = [&](const Unknowns &at) {
        const wm::images::Camera c = changed(film.cameras[number].believed, at);
        Vec2 p(0, 0);
        wm::images::project(c, wm::images::T_base_optical(c).inverse() * in_base, p);
        return p;
      };
      const Vec2 off = l.pixel - pixel(x);
      squares += off.squaredNorm();
      Eigen::Matrix<double, 2, 10> J;
      for (int k = 0; k < 10; k++) {
        Unknowns step = x;
        step[k] += 1e-6;
        J.col(k) = (pixel(step) - pixel(x)) / 1e-6;
      }
      A += J.transpose() * J;
      b += J.transpose() * off;
    }
    rms_px = std::sqrt(squares / static_cast<double>(labels.size()));
    x += A.ldlt().solve(b);
  }
  return x;
}

void camera_is_found_in_the_labels(const char *name) {
  Film film = filmed(shipped(name), 4);
  for (size_t camera = 0; camera < 2; camera++) {
    double rms_px = 0;
    const Unknowns x = camera_from_labels(film, camera, rms_px);
    TEST_ASSERT_TRUE_MESSAGE(rms_px < 0.002, name);  // labels are rounded to 0.001 px
    const wm::images::Camera &truth = film.cameras[camera].truth, found = changed(film.cameras[camera].believed, x);
    const Eigen::AngleAxisd turned(
        Eigen::Matrix3d(truth.T_base_camera.linear().transpose() * found.T_base_camera.linear()));
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * kDegree, 0, turned.angle());
    TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0,
                              (truth.T_base_camera.translation() - found.T_base_camera.translation()).norm());
    for (size_t i = 0; i < 4; i++) TEST_ASSERT_DOUBLE_WITHIN(0.05, truth.intrinsics[i], found.intrinsics[i]);
    // And it is not the calibration that was found.
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.05 * kDegree, x.head<3>().norm());
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.001, x.segment<3>(3).norm());
    TEST_ASSERT_GREATER_THAN_DOUBLE(2e-4, x.tail<4>().norm());
  }
}

TEST(test_cameras_are_found_in_the_labels) {
  camera_is_found_in_the_labels("seabed-hard");
  if (all) camera_is_found_in_the_labels("crossing-easy");  // fisheyes
}

TEST(test_mountings_are_off_as_said) {
  Errors e;
  e.camera_mounting_rad = 0.2 * kDegree;
  e.camera_mounting_m = 0.005;
  const double xyz[3] = {1, 0.2, 0.4}, rpy[3] = {0, 0.4, 0.9};
  const Eigen::Isometry3d believed = pose_of(xyz, rpy);
  Sum turned, moved;
  for (uint64_t seed = 1; seed <= 300; seed++) {
    const Eigen::Isometry3d truth = true_mounting(believed, e, seed, 0);
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(believed.linear().transpose() * truth.linear()));
    for (int i = 0; i < 3; i++) {
      turned.add(turn.angle() * turn.axis()[i]);
      moved.add(truth.translation()[i] - believed.translation()[i]);
    }
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 1, turned.rms() / (0.2 * kDegree));
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 1, moved.rms() / 0.005);
}

// A stereo pair is rigid: what is wrong of it is its place in the vehicle.
TEST(test_a_pair_is_one_instrument) {
  Film film = filmed(shipped("seabed-easy"), 2);
  const auto &l = film.cameras[0], &r = film.cameras[1];
  const Eigen::Isometry3d believed = l.believed.T_base_camera.inverse() * r.believed.T_base_camera,
                          truth = l.truth.T_base_camera.inverse() * r.truth.T_base_camera;
  TEST_ASSERT_TRUE(believed.isApprox(truth, 1e-12));
  TEST_ASSERT_FALSE(l.believed.T_base_camera.isApprox(l.truth.T_base_camera, 1e-4));
}

TEST(test_stamps_and_arrivals_are_as_said) {
  if (!all) TEST_IGNORE();
  for (const char *name : {"corridor-easy", "corridor-hard"}) {
    const bool hard = std::string(name) == "corridor-hard";
    Scenario s = shipped(name);
    s.faults.camera_clock_drift = 0;
    s.faults.camera_dropout = {};
    Film film = filmed(s, 1);
    const std::vector<FrameTime> times = frame_times(film, 0);
    Sum stamp, arrival;
    double late = 0;
    for (const FrameTime &t : times) {
      const double taken_s = (static_cast<double>(t.number) + 0.5) / 10;
      const double after_s = static_cast<double>(t.arrival_ns - film.recording.clock_start_ns) * 1e-9 - taken_s;
      stamp.add(static_cast<double>(t.stamp_ns - film.recording.clock_start_ns) * 1e-9 - taken_s);
      if (after_s < (hard ? 0.1201 : 0.0601))
        arrival.add(after_s);
      else
        late++;
      TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE((hard ? 0.04 : 0.02), after_s);
    }
    const double times_two = hard ? 2 : 1, n = stamp.n;
    TEST_ASSERT_GREATER_THAN(800, n);
    TEST_ASSERT_DOUBLE_WITHIN(4 * 0.002 * times_two / std::sqrt(n), 0.010 * times_two, stamp.mean());
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1, stamp.deviation() / (0.002 * times_two));
    TEST_ASSERT_DOUBLE_WITHIN(0.003 * times_two, 0.040 * times_two, arrival.mean());
    const double lost = 1 - n / std::floor(film.recording.duration_s * 10 + 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(4 * std::sqrt(0.01 * times_two / n), 0.01 * times_two, lost);
    if (!hard) TEST_ASSERT_EQUAL_DOUBLE(0, late);
    if (hard) TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.02, late / n);
  }
}

TEST(test_the_map_is_off_as_said) {
  Sum off;
  Film film = filmed(shipped("seabed-easy"), 1);
  for (uint64_t seed = 1; seed <= 10; seed++) {
    Recording r;
    r.seed = seed;
    r.map = film.recording.landmarks;
    misplace(film.scenario, 3, r);
    if (seed == 1) TEST_ASSERT_EQUAL_DOUBLE(r.map[4].p_m[2], film.recording.map[4].p_m[2]);
    for (size_t i = 0; i < r.map.size(); i++) {
      TEST_ASSERT_EQUAL_DOUBLE(0.02, r.map[i].sigma_m);
      for (int axis = 0; axis < 3; axis++) off.add(r.map[i].p_m[axis] - film.recording.landmarks[i].p_m[axis]);
    }
  }
  TEST_ASSERT_GREATER_THAN(400, off.n);
  TEST_ASSERT_DOUBLE_WITHIN(3 / std::sqrt(2 * off.n), 1, off.rms() / 0.02);
}

// Without errors of the camera what is left of a sensor's features is their own noise.
Film found(const char *name) {
  Scenario s = shipped(name);
  s.errors.camera_mounting_rad = s.errors.camera_mounting_m = s.errors.camera_intrinsics =
      s.errors.frame_stamp_jitter_s = 0;
  s.faults.camera_clock_offset_s = 0;
  s.pictures.none = true;
  Film film = filmed(s, 1);
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, observe_pictures(film, &err), err.text);
  return film;
}

Vec3 place(const Film &film, int32_t id) {
  for (const wm_landmark &l : film.recording.landmarks)
    if (l.id == id) return Vec3(l.p_m);
  TEST_FAIL_MESSAGE("what was seen isn't there");
  return {};
}
Vec3 from_sensor(const Film &film, wm_time_ns t_ns, uint16_t sensor, int32_t id) {
  const wm_mounting &m = film.recording.sensors[sensor].mounting;
  const double t_s = static_cast<double>(t_ns - film.recording.clock_start_ns) * 1e-9;
  return (true_pose(film.recording, t_s) * pose_of(m.xyz_m, m.rpy_rad)).inverse() * place(film, id);
}

void check_bearings(const char *name) {
  const Film film = found(name);
  Sum noise;
  double outliers = 0;
  for (const Sighting &s : film.recording.sightings) {
    outliers += s.outlier;
    if (s.outlier) continue;
    const Vec3 p = from_sensor(film, s.t_ns, s.sensor, s.id);
    noise.add(wrap(s.bearing_rad - std::atan2(p.y(), p.x())));
  }
  TEST_ASSERT_GREATER_THAN(3000, noise.n);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 1, noise.rms() / (0.3 * kDegree));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.05, outliers / (noise.n + outliers));
}
TEST(test_bearings_of_pictures_have_their_noise) {
  if (!all) TEST_IGNORE();
  check_bearings("crossing-easy");
  check_bearings("hall-easy");
}

TEST(test_markers_of_pictures_have_their_noise) {
  if (!all) TEST_IGNORE();
  const Film film = found("office-easy");
  Sum distance, yaw;
  for (const MarkerSeen &m : film.recording.markers) {
    if (m.outlier) continue;
    const Vec3 p = from_sensor(film, m.t_ns, m.sensor, m.id);
    distance.add(std::hypot(m.p_m[0], m.p_m[1]) - std::hypot(p.x(), p.y()));
    const double heading =
        film.recording.drive.at(static_cast<double>(m.t_ns - film.recording.clock_start_ns) * 1e-9).heading_rad;
    for (const wm_landmark &l : film.recording.landmarks)
      if (l.id == m.id) yaw.add(wrap(m.yaw_rad - l.yaw_rad + heading));
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(1000, distance.n);
  TEST_ASSERT_DOUBLE_WITHIN(0.08, 1, distance.rms() / 0.005);
  TEST_ASSERT_DOUBLE_WITHIN(0.08, 1, yaw.rms() / (0.5 * kDegree));
}

TEST(test_stereo_points_of_pictures_have_their_noise) {
  const Film film = found("seabed-easy");
  Sum noise;
  double one_side = 0;
  for (const StereoSeen &s : film.recording.stereo) {
    if (s.outlier) continue;
    const double t_s = static_cast<double>(s.t_ns - film.recording.clock_start_ns) * 1e-9;
    const Vec3 in_base = true_pose(film.recording, t_s).inverse() * place(film, s.id);
    one_side += std::isnan(s.left_px[0]) || std::isnan(s.right_px[0]);
    for (int side = 0; side < 2; side++) {
      const double *px = side ? s.right_px : s.left_px;
      const wm::images::Camera &c = film.cameras[static_cast<size_t>(side)].truth;
      Vec2 pixel;
      TEST_ASSERT_TRUE(wm::images::project(c, wm::images::T_base_optical(c).inverse() * in_base, pixel));
      if (!std::isnan(px[0])) noise.add(px[0] - pixel.x()), noise.add(px[1] - pixel.y());
    }
  }
  TEST_ASSERT_GREATER_THAN(2000, noise.n);
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 1, noise.rms() / 0.5);
  TEST_ASSERT_TRUE(one_side > 10);
}

TEST(test_features_stand_beside_pictures_only_where_wanted) {
  wm_error err{};
  for (const bool beside : {false, true}) {
    Scenario s = shipped("seabed-easy");
    s.sensors[0].beside_pictures = beside;
    Film film = filmed(s, 1);
    TEST_ASSERT_EQUAL(WM_OK, observe_pictures(film, &err));
    TEST_ASSERT_EQUAL(beside, !film.recording.stereo.empty());
  }
  Scenario s = shipped("hall-easy");
  s.sensors[0].camera = "front";
  s.pictures.none = true;
  Film film = filmed(s, 1);
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, observe_pictures(film, &err));
  TEST_ASSERT_EQUAL_STRING("sensors: omni: this world has no camera `front`; give the name of one as `camera`",
                           err.text);
}

}  // namespace

// The worlds of buildings and streets take seconds to draw: only with an argument.
int suite_begin(int argc, char **) {
  all = argc > 1;
  return SUITE_RUNS;
}
