// SPDX-License-Identifier: Apache-2.0
// Worlds of features alone: what each kind of sensor says, read back by drivers/recording, against the truth: geometry,
// noise, outliers, misses; and what mistakes in a scenario say.
#include <unistd.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <map>

#include "shipped.h"
#include "simulate/angle.h"
#include "simulate/motion.h"
#include "simulate/write.h"
#include "waymark/recording.h"

using namespace wm::sim;
using Eigen::Vector3d;

namespace {

constexpr double kDegree = kPi / 180;

Scenario scenario;
Recording made;

void load(const char *name) { load_shipped(name, scenario); }
void make(uint64_t seed) { made = driven(scenario, seed); }
double since_start(wm_time_ns t_ns) { return static_cast<double>(t_ns - made.clock_start_ns) * 1e-9; }

Vector3d place(int32_t id) {
  for (const wm_landmark &l : made.landmarks)
    if (l.id == id) return Vector3d(l.p_m);
  TEST_FAIL_MESSAGE("a landmark that isn't there was seen");
  return {};
}

void check_rms(double wanted, const Sum &s) {
  TEST_ASSERT_GREATER_THAN(200, s.n);
  TEST_ASSERT_DOUBLE_WITHIN(4 / std::sqrt(2 * s.n), 1, s.rms() / wanted);
  TEST_ASSERT_DOUBLE_WITHIN(4 * wanted / std::sqrt(s.n), 0, s.mean());
}
// Bearings against those of a perfect camera, and what arrives of them where some are lost, doubled and late.
TEST(test_bearings_have_their_noise_and_their_faults) {
  load("crossing");
  Sum noise;
  double outliers = 0, all = 0, plain = 0, late = 0;
  for (uint64_t seed = 1; seed <= 10; seed++) {
    make(seed);
    for (const Sighting &s : made.sightings) {
      const Camera &c = scenario.cameras[s.sensor];
      const State at = made.drive.at(since_start(s.t_ns));
      const Eigen::Rotation2Dd turn(at.heading_rad);
      const Eigen::Vector2d to =
          place(s.id).head<2>() - Eigen::Vector2d(at.x_m, at.y_m) - turn * Eigen::Vector2d(c.xyz_m[0], c.xyz_m[1]);
      all++;
      outliers += s.outlier;
      TEST_ASSERT_EQUAL_INT64(150000000, s.arrival_ns - s.t_ns);
      TEST_ASSERT_DOUBLE_WITHIN(0.5 * c.field_of_view_rad + 0.05, 0.0, s.bearing_rad);
      if (!s.outlier) noise.add(wrap(s.bearing_rad - wrap(std::atan2(to.y(), to.x()) - at.heading_rad - c.yaw_rad)));
    }
    plain += static_cast<double>(made.sightings.size()) / 10;
  }
  check_rms(0.3 * kDegree, noise);
  check_share(0.05, outliers, all);
  scenario.faults.sightings_lost = 0.2;
  scenario.faults.sightings_duplicated = 0.1;
  scenario.faults.frames_late = 0.3;
  scenario.faults.frames_late_s = 0.1;
  make(3);
  const auto count = static_cast<double>(made.sightings.size());
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 0.8 * 1.1, count / plain);
  for (size_t i = 1; i < made.sightings.size(); i++) {
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(made.sightings[i - 1].arrival_ns, made.sightings[i].arrival_ns);
    late += made.sightings[i].arrival_ns - made.sightings[i].t_ns == 250000000;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 0.3, late / count);
}

// Of a camera's clock that runs ahead and a start that is stated wrongly.
TEST(test_clock_offset_and_start_error) {
  load("crossing");
  make_perfect(scenario);
  scenario.faults.camera_clock_offset_s = 0.05;
  scenario.faults.start_x_m = 2;
  scenario.faults.start_heading_rad = -0.5;
  make(1);
  TEST_ASSERT_EQUAL_INT64(100000000, made.sightings[0].arrival_ns - made.sightings[0].t_ns);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2, made.start.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.5, made.start.heading_rad);
}

TEST(test_markers_have_their_noise) {
  load("loops-markers");
  scenario.sensors[0].outlier_fraction = 0.03;
  Sum distance, direction, heading, height;
  double outliers = 0, all = 0;
  for (uint64_t seed = 1; seed <= 5; seed++) {
    make(seed);
    TEST_ASSERT_EQUAL(30, made.landmarks.size());
    TEST_ASSERT_EQUAL(0, made.map.size());
    for (const MarkerSeen &m : made.markers) {
      all++;
      outliers += m.outlier;
      TEST_ASSERT_EQUAL_INT64(60000000, m.arrival_ns - m.t_ns);
      if (m.outlier) continue;
      const State at = made.drive.at(since_start(m.t_ns));
      const Vector3d p =
          Eigen::AngleAxisd(-at.heading_rad, Vector3d::UnitZ()) * (place(m.id) - Vector3d(at.x_m, at.y_m, 0)) -
          Vector3d(0.06, 0, 0.34);
      distance.add(std::hypot(m.p_m[0], m.p_m[1]) - std::hypot(p.x(), p.y()));
      direction.add(wrap(std::atan2(m.p_m[1], m.p_m[0]) - std::atan2(p.y(), p.x())));
      height.add(m.p_m[2] - p.z());
      for (const wm_landmark &l : made.landmarks)
        if (l.id == m.id) heading.add(wrap(m.yaw_rad - l.yaw_rad + at.heading_rad));
      TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(2, std::hypot(p.x(), p.y()));
    }
  }
  check_rms(0.01, distance);
  check_rms(0.5 * kDegree, direction);
  check_rms(1 * kDegree, heading);
  check_rms(0.01, height);
  check_share(0.03, outliers, all);
}

TEST(test_stereo_pixels_have_their_noise) {
  load("seabed-slam");
  scenario.sensors[0].one_side_fraction = 0.04;
  Sum noise[4];
  double outliers = 0, all = 0, one_side = 0;
  make(3);
  std::map<wm_time_ns, int> both;
  for (const StereoSeen &s : made.stereo) {
    const Eigen::Isometry3d T = true_pose(made, since_start(s.t_ns));
    const double rpy[3] = {0, 48 * kDegree, 0}, xyz[3] = {0.4, 0.15, -0.1};
    const Vector3d p = (T * pose_of(xyz, rpy)).inverse() * place(s.id);
    const double u = 321 - 420 * p.y() / p.x(), v = 238.5 - 420 * p.z() / p.x(), right = u - 420 * 0.3 / p.x();
    const bool l = !std::isnan(s.left_px[0]), r = !std::isnan(s.right_px[0]);
    TEST_ASSERT_TRUE(l || r);
    if (u < 639.5 && right > -0.5) {
      all++;
      outliers += s.outlier;
      one_side += !l || !r;
    }
    both[s.t_ns] += l && r;
    if (s.outlier) continue;
    if (l) noise[0].add(s.left_px[0] - u), noise[1].add(s.left_px[1] - v);
    if (r) noise[2].add(s.right_px[0] - right), noise[3].add(s.right_px[1] - v);
  }
  for (const Sum &n : noise) check_rms(0.5, n);
  check_share(0.01, outliers, all);
  check_share(0.04, one_side, all);
  double sum = 0;
  for (const auto &step : both) sum += step.second;
  // 30, less 5 % that are missed and 4 % that one side has.
  TEST_ASSERT_DOUBLE_WITHIN(1.5, 30 * 0.95 * 0.96, sum / static_cast<double>(both.size()));
}

TEST(test_fifteen_points_are_seen_well_enough) {
  load("seabed-points");
  double few = 0, steps = 0;
  Sum start;
  double farthest = 0;
  for (uint64_t seed = 1; seed <= 40; seed++) {
    make(seed);
    std::map<wm_time_ns, int> both;
    for (const StereoSeen &s : made.stereo) both[s.t_ns] += !std::isnan(s.left_px[0]) && !std::isnan(s.right_px[0]);
    for (const auto &step : both) few += step.second < 3, steps++;
    const Vector3d away = Vector3d(made.start.p_m) - Vector3d(made.truth6[0].xyz_m);
    for (int i = 0; i < 3; i++) start.add(away[i]);
    farthest = std::max(farthest, away.norm());
    TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(20, away.norm());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 20 / std::sqrt(5.0), made.start.sigma_xy_m);
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, few / steps);
  TEST_ASSERT_TRUE(farthest > 17);
  TEST_ASSERT_DOUBLE_WITHIN(0.2, 1, start.rms() / (20 / std::sqrt(5.0)));
}

// Ranges with echoes, depth, compass: through files and the reader.
TEST(test_instruments_under_water) {
  load("seabed-acoustic");
  const std::string folder = "simulate_features." + std::to_string(getpid());
  Sum range, depth, compass, deviation;
  double echoes = 0, ranges = 0;
  for (uint64_t seed = 1; seed <= 20; seed++) {
    wm_error err{};
    make(seed);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_recording(scenario, made, folder, &err), err.text);
    wm_recording *opened = nullptr;
    TEST_ASSERT_EQUAL_MESSAGE(
        WM_OK,
        wm_recording_open(
            folder.c_str(), nullptr, [](void *, wm_note, const char *text) { TEST_FAIL_MESSAGE(text); }, nullptr,
            &opened, &err),
        err.text);
    size_t count = 0, seen = 0;
    Sum north;
    wm_source *const *sources = wm_recording_sources(opened, &count);
    for (size_t i = 0; i < count; i++) {
      wm_event e{};
      while (sources[i]->ops->next(sources[i], &e, &err) == WM_OK) {
        const Eigen::Isometry3d T = true_pose(made, since_start(e.t_ns));
        if (e.kind == WM_EVENT_POSITION) {
          TEST_ASSERT_EQUAL_DOUBLE(1e6, e.as.position.sigma_xy_m);
          TEST_ASSERT_EQUAL_DOUBLE(0.02, e.as.position.sigma_z_m);
          depth.add(e.as.position.p_m[2] - T.translation().z());
        } else if (e.kind == WM_EVENT_SIGHTING && e.as.sighting.landmark_id == kNorthId) {
          const Vector3d n = T.linear().transpose() * Vector3d::UnitY();
          north.add(wrap(e.as.sighting.bearing_rad - std::atan2(n.y(), n.x())));
        } else if (e.kind == WM_EVENT_SIGHTING) {
          TEST_ASSERT_DOUBLE_IS_NAN(e.as.sighting.bearing_rad);
          const double off =
              e.as.sighting.range_m - (place(e.as.sighting.landmark_id) - T * Vector3d(0, 0, 0.2)).norm();
          ranges++;
          if (std::fabs(off) > 0.3) {
            echoes++;
            TEST_ASSERT_TRUE(off > 0 && off < 5);
          } else if (std::fabs(off) < 0.2) {
            range.add(off);
          }
        }
        seen++;
      }
      TEST_ASSERT_EQUAL_MESSAGE(0, sources[i]->counts.malformed, sources[i]->counts.first_problem);
    }
    TEST_ASSERT_EQUAL(made.motion6.size() + made.sightings.size() + made.stereo.size() + made.fixes.size(), seen);
    wm_recording_close(opened);
    compass.add(std::sqrt(north.squares / north.n - north.mean() * north.mean()));
    deviation.add(north.mean());
  }
  std::filesystem::remove_all(folder);
  TEST_ASSERT_DOUBLE_WITHIN(0.003, 0.05, range.rms());  // cut at 4 sigma, with a few small echoes
  check_share(0.2 * 4.7 / 5, echoes, ranges);
  check_rms(0.02, depth);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 1, compass.mean() / (1 * kDegree));
  TEST_ASSERT_DOUBLE_WITHIN(0.45, 1, deviation.rms() / (0.5 * kDegree));
}

TEST(test_gnss_wanders_and_jumps) {
  load("loops-lines");
  Sensor gnss;
  gnss.kind = Sensor::Kind::gnss;
  gnss.name = "gnss";
  gnss.rate_hz = 5;
  gnss.sigma_xy_m = 0.5;
  gnss.sigma_z_m = 1;
  gnss.wander_m = 2;
  gnss.wander_s = 10;
  gnss.outlier_fraction = 0.02;
  gnss.outlier_m = 30;
  scenario.sensors.push_back(gnss);
  Sum whole, step;
  double outliers = 0;
  for (uint64_t seed = 1; seed <= 60; seed++) {
    make(seed);
    double last = NAN;
    for (const Fix &f : made.fixes) {
      outliers += f.outlier;
      const double e = f.p_m[0] - made.drive.at(since_start(f.t_ns)).x_m;
      if (f.outlier) continue;
      whole.add(e);
      if (!std::isnan(last)) step.add(e - last);
      last = e;
    }
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 1, whole.rms() / std::sqrt(0.5 * 0.5 + 2 * 2));
  // From one to the next: two draws of noise, and what wandered in 0.2 s of 10 s.
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 1, step.rms() / std::sqrt(2 * 0.25 + 2 * 4 * (1 - std::exp(-0.02))));
  check_share(0.02, outliers, whole.n + outliers);
}

// A receiver with areas says there what one without says, and nothing elsewhere.
TEST(test_areas_change_nothing_but_where_it_speaks) {
  load("yard-rtk");
  scenario.sensors[0].wander_m = 0.5;
  make(3);
  const std::vector<Fix> everywhere = made.fixes;
  const std::vector<Area> areas = {{2, -3, 6, 8}, {5, -3, 9, 1}};
  scenario.sensors[0].areas = areas;
  make(3);
  size_t next = 0;
  for (const Fix &f : everywhere) {
    const State s = made.drive.at(since_start(f.t_ns));
    const bool inside = (s.x_m >= 2 && s.x_m <= 6 && s.y_m >= -3 && s.y_m <= 8) ||
                        (s.x_m >= 5 && s.x_m <= 9 && s.y_m >= -3 && s.y_m <= 1);
    if (!inside) continue;
    TEST_ASSERT_LESS_THAN(made.fixes.size(), next);
    TEST_ASSERT_EQUAL_INT64(f.t_ns, made.fixes[next].t_ns);
    TEST_ASSERT_EQUAL_DOUBLE(f.p_m[0], made.fixes[next++].p_m[0]);
  }
  TEST_ASSERT_EQUAL(next, made.fixes.size());
  TEST_ASSERT_GREATER_THAN(20, next);
  TEST_ASSERT_LESS_THAN(everywhere.size() / 2, next);
}

// Tags and an anchor in one list: each with its own sigma on the map; an anchor is no marker, and has no yaw.
TEST(test_listed_landmarks_have_yaw_and_sigma) {
  const std::string text =
      "format: waymark-scenario/1\nname: x\n"
      "world: {landmarks: [{id: 1, xyz_m: [3, 1, 1], yaw_deg: 90, sigma_m: 0.1}, {id: 2, xyz_m: [4, -1, 1]},\n"
      "  {id: 3, xyz_m: [5, 1, 1], sigma_m: 0.3}]}\n"
      "robot: {wheel_radius_m: 0.1, ticks_per_turn: 1000, track_m: 0.5}\n"
      "sensors: [{kind: markers, bearing_sigma_deg: 0.1, range_sigma_m: 0.01, heading_sigma_deg: 1}]\n"
      "route: {start: {x_m: 0, y_m: 0, heading_deg: 0}, legs: [{stand_s: 2}]}\n"
      "errors: {landmark_m: 0.02}\n";
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse_scenario(text, "x.yaml", scenario, &err), err.text);
  Sum off[3];
  for (uint64_t seed = 1; seed <= 300; seed++) {
    make(seed);
    for (size_t i = 0; i < 3; i++) off[i].add(made.map[i].p_m[0] - made.landmarks[i].p_m[0]);
    for (const MarkerSeen &m : made.markers) TEST_ASSERT_EQUAL(1, m.id);
  }
  TEST_ASSERT_GREATER_THAN(15, made.markers.size());
  const double sigma[] = {0.1, 0.02, 0.3};
  for (size_t i = 0; i < 3; i++) {
    check_rms(sigma[i], off[i]);
    TEST_ASSERT_EQUAL_DOUBLE(sigma[i], made.map[i].sigma_m);
  }

  char dir[] = "/tmp/simulate-listed-XXXXXX";
  TEST_ASSERT_NOT_NULL(mkdtemp(dir));
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_recording(scenario, made, dir, &err), err.text);
  wm_landmark *read = nullptr;
  size_t count = 0;
  const std::string file = std::string(dir) + "/landmarks.csv";
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_landmarks_load(file.c_str(), nullptr, nullptr, &read, &count, &err), err.text);
  TEST_ASSERT_EQUAL(3, count);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, 90 * kDegree, read[0].yaw_rad);
  TEST_ASSERT_TRUE(std::isnan(read[1].yaw_rad) && std::isnan(read[2].yaw_rad));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.3, read[2].sigma_m);
  std::free(read);
  std::filesystem::remove_all(dir);
  make_perfect(scenario);
  make(1);
  for (size_t i = 0; i < 3; i++) TEST_ASSERT_EQUAL_DOUBLE(made.landmarks[i].p_m[0], made.map[i].p_m[0]);
}

TEST(test_perfect_is_perfect) {
  load("seabed-acoustic");
  make_perfect(scenario);
  make(2);
  for (const Fix &f : made.fixes)
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, true_pose(made, since_start(f.t_ns)).translation().z(), f.p_m[2]);
  for (const StereoSeen &s : made.stereo)
    if (!std::isnan(s.left_px[0]) && !std::isnan(s.right_px[0]))
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, s.left_px[1], s.right_px[1]);
  for (size_t i = 0; i + 1 < made.map.size(); i++)
    TEST_ASSERT_EQUAL_DOUBLE(made.landmarks[i].p_m[2], made.map[i].p_m[2]);
}

TEST(test_a_landmark_less_changes_nothing_of_the_others) {
  load("loops-lines");
  const Recording all = driven(scenario, 4), ten = driven(scenario, 4, 10);
  size_t next = 0;
  for (const Sighting &s : all.sightings) {
    if (s.id > 10) continue;
    TEST_ASSERT_LESS_THAN(ten.sightings.size(), next);
    TEST_ASSERT_EQUAL_DOUBLE(s.bearing_rad, ten.sightings[next++].bearing_rad);
  }
  TEST_ASSERT_EQUAL(ten.sightings.size(), next);
  load("crossing");
  const std::vector<wm_can_frame> with = driven(scenario, 7).can, without = driven(scenario, 7, 0).can;
  TEST_ASSERT_EQUAL(with.size(), without.size());
  for (size_t i = 0; i < with.size(); i++) TEST_ASSERT_EQUAL_MEMORY(with[i].data, without[i].data, with[i].length);
}

void refuse(const char *extra, const char *wanted) {
  const std::string text = std::string(
                               "format: waymark-scenario/1\nname: x\nworld: {}\npath: {rounds: {duration_s: 20}}\n"
                               "sensors:\n  - ") +
                           extra + "\n";
  wm_error err{};
  Scenario out;
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, parse_scenario(text, "x.yaml", out, &err), extra);
  TEST_ASSERT_EQUAL_STRING(wanted, err.text);
}

TEST(test_a_recording_that_ends_early_is_of_the_same_world) {
  load("loops-markers");
  make(5);
  const std::vector<wm_landmark> whole = made.landmarks;
  scenario.duration_s = 2;
  make(5);
  TEST_ASSERT_EQUAL(2, static_cast<int>(std::lround(made.duration_s)));
  TEST_ASSERT_EQUAL(whole.size(), made.landmarks.size());
  for (size_t i = 0; i < whole.size(); i++)
    TEST_ASSERT_EQUAL_MEMORY(whole[i].p_m, made.landmarks[i].p_m, sizeof whole[i].p_m);
}

TEST(test_mistakes_are_told) {
  refuse("{kind: landmarks}",
         "x.yaml:6: sensors[0]: give bearing_sigma_deg, range_sigma_m or both: they choose what this sensor measures");
  refuse("{kind: landmarks, bearing_sigma_deg: 1, sigma_px: 1}",
         "x.yaml:6: sensors[0].sigma_px: only a sensor of kind stereo or edges has this");
  refuse("{kind: stereo}", "x.yaml:6: sensors[0]: `sigma_px` is missing here");
  refuse("{kind: markers, bearing_sigma_deg: 1, range_sigma_m: 0.1, heading_sigma_deg: 1}",
         "x.yaml:6: sensors[0]: markers.csv is for robots on wheels");
  refuse("{kind: depth, sigma_z_m: 0.1}\n  - {kind: depth, sigma_z_m: 0.1}",
         "x.yaml:7: sensors[1]: the name 'depth' is there already; give this sensor a `name` of its own");
  refuse("{kind: landmarks, bearing_sigma_deg: 1, areas_m: [[3, 0, 2, 1]]}",
         "x.yaml:6: sensors[0].areas_m[0]: an area is [x0, y0, x1, y1]; x1 is above x0 and y1 above y0");
  refuse("{kind: edges, sigma_px: 1}", "x.yaml:6: sensors[0]: only the world `corridor` has edges on the floor");
  refuse("{kind: landmarks, bearing_sigma_deg: 1, ids: [9, 3]}",
         "x.yaml:6: sensors[0].ids: two numbers from 0 to 2.14748e+09, the smaller one first");
}

}  // namespace
