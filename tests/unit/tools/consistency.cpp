// SPDX-License-Identifier: Apache-2.0
// Shipped configurations over many simulated drives, a row each: as accurate, as consistent and as efficient as
// docs/consistency.md says. usage: consistency GROUP DRIVES [DRIVES_THAT_TAKE_LONGER]. The seeds are fixed, so the
// figures are the same everywhere; the bands of few drives are as wide as those need.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "common/trials.h"
#include "montecarlo/montecarlo.h"
#include "simulate/angle.h"
#include "unity.h"

using namespace wm;
using montecarlo::Options6;
using montecarlo::Statistics;
using montecarlo::Statistics6;

namespace {

using Figures = std::map<std::string, double>;
struct Limit {
  const char *figure;
  double low, high;
  double low_of_few = low, high_of_few = high;  // of fewer than 200 drives
};
using Limits = std::vector<Limit>;

struct Row;
struct Result {
  Statistics planar;
  Statistics6 space;
};
using Change = void (*)(sim::Scenario &);
using More = void (*)(const Row &, const Result &, Figures &);
struct Row {
  Row(const char *group_, const char *name_, const char *world_, const char *config_, Limits limits_,
      size_t landmarks_ = 0, Change change_ = nullptr, More more_ = nullptr, Options6 space_ = {},
      bool takes_longer_ = false, uint64_t drives_least_ = 0)
      : group(group_),
        name(name_),
        world(world_),
        config(config_),
        limits(std::move(limits_)),
        landmarks(landmarks_),
        change(change_),
        more(more_),
        space(space_),
        takes_longer(takes_longer_),
        drives_least(drives_least_) {}
  const char *group, *name, *world, *config;
  Limits limits;
  size_t landmarks;
  Change change;
  More more;
  Options6 space;
  bool takes_longer;
  uint64_t drives_least;  // with fewer it isn't run
};

// Means over n drives of a quantity with `dof` degrees of freedom scatter by sqrt(2 / (n dof)): with 200 drives the
// band [0.8, 1.25] is 3 to 4 of that wide, with fewer it is widened by as much.
const Limits kNees = {{"share of the steps with a consistent NEES", 0.9, 1}, {"mean NEES is in its band", 1, 1}};
// Outliers that fall near the truth pass the gate; hardly anything else is refused.
const Limits kSightings = {{"share of the steps with a consistent NIS", 0.9, 1},
                           {"mean NIS", 0.95, 1.05},
                           {"sightings refused for each outlier made", 0.9, 1.02},
                           {"drives lost", 0, 0}};
const Limits kNeesInSpace = {{"share of the steps with a consistent NEES", 0.9, 1}};
const Limits kNearTheBound = {{"share of the steps with a consistent NEES", 0.9, 1},
                              {"position over its bound", 0, 1.15, 0, 1.4},
                              {"heading over its bound", 0, 1.15, 0, 1.4},
                              {"drives lost", 0, 0}};

Limits both(Limits a, const Limits &b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
// Above 1 only by the luck of few drives.
Limit efficient(double least) { return {"efficiency", least, 1.08, least, 1.25}; }
Limits seen(double end_m, double efficiency) {
  return both(both(kNees, kSightings), {{"position at the end, m", 0, end_m}, efficient(efficiency)});
}
Limits in_space(double rms_m) { return both(kNeesInSpace, {{"worst drive's RMS, m", 0, rms_m}}); }

std::string file(const char *folder, const char *name) {
  return std::string(std::getenv("WM_SOURCE_DIR")) + "/config/" + folder + "/" + name + ".yaml";
}

struct Loaded {
  sim::Scenario scenario;
  wm_config config{};
  Loaded(const char *world, const char *config_name) {
    wm_error err{};
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, sim::load_scenario(file("worlds", world), scenario, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_load(file("datasets", config_name).c_str(), &config, &err), err.text);
  }
  ~Loaded() { wm_config_free(&config); }
};

uint64_t drives = 24, longer_drives = 1;

Statistics driven(const Row &row, const char *config) {
  Loaded of(row.world, config);
  if (row.change) row.change(of.scenario);
  wm_error err{};
  Statistics s;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, montecarlo::run(of.scenario, of.config, row.landmarks, 1, drives, nullptr, s, &err),
                            err.text);
  return s;
}

Statistics6 dived(const Row &row, Change change) {
  Loaded of(row.world, row.config);
  if (change) change(of.scenario);
  Options6 options = row.space;
  options.first_seed = 1;
  options.seeds = row.takes_longer ? longer_drives : drives;
  if (options.seeds < options.bounds) options.bounds = 0;
  wm_error err{};
  Statistics6 s;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, montecarlo::run_six(of.scenario, of.config, options, nullptr, s, &err), err.text);
  return s;
}

Figures figures(const Statistics &s) {
  const montecarlo::Band band = montecarlo::band_of(drives);
  return {
      {"share of the steps with a consistent NEES", s.nees_inside(band)},
      {"mean NEES is in its band", s.nees_mean() >= band.low && s.nees_mean() <= band.high},
      {"mean NEES", s.nees_mean()},
      {"share of the steps with a consistent NIS", s.nis_inside(band)},
      {"mean NIS", s.nis_mean()},
      {"sightings refused for each outlier made", static_cast<double>(s.rejected) / static_cast<double>(s.outliers)},
      {"drives lost", static_cast<double>(s.lost)},
      {"position at the end, m", s.position_end_m()},
      {"heading at the end, deg", s.heading_end_rad() * 180 / sim::kPi},
      {"position, whole way, m", s.position_rms_m()},
      {"efficiency", s.bound_position_rms_m() / s.position_rms_m()},
      {"position over its bound", s.position_rms_m() / s.bound_position_rms_m()},
      {"heading over its bound", s.heading_rms_rad() / s.bound_heading_rms_rad()}};
}

double mean_rms_m(const Statistics6 &s) {
  double sum = 0;
  for (const auto &run : s.each) sum += run.position_rms_m;
  return sum / static_cast<double>(s.each.size());
}

Figures figures(const Statistics6 &s) {
  const auto worst = [&s](double montecarlo::Run::*of) {
    double most = 0;
    for (const auto &run : s.each) most = std::fmax(most, run.*of);
    return most;
  };
  return {{"share of the steps with a consistent NEES", s.nees_inside(montecarlo::band_of(s.runs))},
          {"mean NEES", s.nees_mean()},
          {"position over its bound", s.position_over_bound(2, 1e9)},
          {"rotation over its bound", s.rotation_over_bound(2, 1e9)},
          {"worst drive's RMS, m", worst(&montecarlo::Run::position_rms_m)},
          {"worst drive's largest error, m", worst(&montecarlo::Run::position_max_m)},
          {"worst drive's rotation, deg", worst(&montecarlo::Run::rotation_rms_rad) * 180 / sim::kPi},
          {"longest time beyond 5 sigma, s", worst(&montecarlo::Run::beyond_s)}};
}

void of_odometry(const Row &row, const Result &r, Figures &out) {
  const Statistics &s = r.planar;
  out["from odometry at the end, m"] =
      std::fabs(driven(row, "crossing-odometry").position_end_m() - s.position_end_m());
}
void of_laps(const Row &, const Result &r, Figures &out) {
  const Statistics &s = r.planar;
  const double end_s = s.steps.back().t_s, lap_s = end_s / 2;
  out["second lap over the first"] = s.position_m(lap_s, end_s) / s.position_m(0, lap_s);
  out["the same, at the laps' ends"] = s.position_m(end_s - 1, end_s) / s.position_m(lap_s - 1, lap_s);
}
void of_a_stuck_gyro(const Row &, const Result &r, Figures &out) {
  const Statistics &s = r.planar;
  out["position while it sticks, m"] = s.position_m(28, 50);
  out["position over its bound after that"] = s.position_m(60, 73) / s.bound_position_m(60, 73);
}
void of_few_points(const Row &, const Result &r, Figures &out) {
  const Statistics6 &s = r.space;
  // Ten pairs of pictures a second for 100 s, and not one point more.
  const double pairs = 1001 * static_cast<double>(s.runs);
  out["points of a pair of pictures"] = static_cast<double>(s.fused + s.rejected) / pairs;
  out["points of a pair that are fused"] = static_cast<double>(s.fused) / pairs;
}
void of_points_found(const Row &, const Result &r, Figures &out) {
  const Statistics6 &s = r.space;
  out["error of a point, m"] = s.point_error_sum_m / static_cast<double>(s.points);
  out["share of wrong points"] = static_cast<double>(s.wrong_points) / static_cast<double>(s.points);
}
void without_echoes(sim::Scenario &scenario) {
  for (sim::Sensor &sensor : scenario.sensors)
    if (sensor.gives_range) sensor.outlier_fraction = 0;
}
void of_echoes(const Row &row, const Result &r, Figures &out) {
  const Statistics6 &s = r.space;
  const Statistics6 clean = dived(row, without_echoes);
  out["ranges refused more than without echoes, a drive"] =
      (static_cast<double>(s.rejected) - static_cast<double>(clean.rejected)) / static_cast<double>(drives);
  out["mean RMS over that without echoes"] = mean_rms_m(s) / mean_rms_m(clean);
}

// Sensors of the IMU that repeat their last values from 20 to 40 s of 50, all axes or one, and come back.
constexpr sim::Stuck kAll = {{20, 40}, -1}, kYaw = {{20, 40}, 2};
void sticks(sim::Scenario &s, const sim::Stuck &gyro, const sim::Stuck &accelerometer) {
  s.rounds.rounds *= 50 / s.rounds.duration_s;
  s.rounds.duration_s = 50;
  s.faults.gyro_stuck = gyro;
  s.faults.accelerometer_stuck = accelerometer;
}
void gyros_stick(sim::Scenario &s) { sticks(s, kAll, {}); }
void yaw_gyro_sticks(sim::Scenario &s) { sticks(s, kYaw, {}); }
void accelerometers_stick(sim::Scenario &s) { sticks(s, {}, kAll); }
void twists_gyro_sticks(sim::Scenario &s) { s.faults.gyro_stuck = {20, 50}; }
const Limits kSticks =
    both(kNeesInSpace, {{"longest time beyond 5 sigma, s", 0, 2}, {"worst drive's largest error, m", 0, 0.05}});
constexpr Options6 kBlind = {1, 1, 40, 60, 40, 60};  // no pictures from 40 to 60 s, judged then

constexpr bool kLonger = true;

const Row kRows[] = {
    Row("landmarks", "odometry alone", "crossing", "crossing-odometry",
        both(kNees, {{"position at the end, m", 0.4, 0.6, 0.35, 0.65}, efficient(0.85)})),
    Row("landmarks", "no landmark is odometry", "crossing", "crossing-points",
        {{"from odometry at the end, m", 0, 1e-9}}, 0, nullptr, of_odometry),
    Row("landmarks", "one landmark", "crossing", "crossing-points", seen(0.15, 0.85), 1),
    Row("landmarks", "two landmarks", "crossing", "crossing-points", seen(0.1, 0.85), 2),
    Row("landmarks", "three landmarks", "crossing", "crossing-points",
        both(seen(0.05, 0.85), {{"heading at the end, deg", 0, 0.3}}), 3),
    // One landmark never tells where north is; what keeps the heading is the wheels. Each lap ends as well as the one
    // before.
    Row("landmarks", "one landmark, lap after lap", "crossing-laps", "crossing-points",
        both(seen(0.15, 0.9), {{"second lap over the first", 0, 1}, {"the same, at the laps' ends", 0, 1}}), 1, nullptr,
        of_laps, {}, false, 200),
    // Landmarks that nobody measured: three laps past 30 coded markers. (NIS has in it which landmarks join; the bound
    // knows of none.)
    Row("landmarks", "loops among markers", "loops-markers", "loops-markers",
        both(kNees, {{"position, whole way, m", 0, 0.015}, {"drives lost", 0, 0}}), 30),
    // Bases that do not roll forwards alone, and a gyro beside a twist.
    Row("bases", "holonomic", "yard-holonomic", "yard-holonomic", kNearTheBound, 8),
    Row("bases", "skid steer", "yard-skid", "yard-skid", kNearTheBound, 8),
    Row("bases", "a gyro that drifts beside a twist", "yard-imu", "yard-imu", kNearTheBound, 8),
    // Its turn rate is the twist's within the first turn. Errors fused until then stay in the map's states for a while.
    Row("bases", "a gyro that sticks beside a twist", "yard-imu", "yard-imu",
        {{"drives lost", 0, 0},
         {"position while it sticks, m", 0, 0.15},
         {"position over its bound after that", 0, 1.3}},
        8, twists_gyro_sticks, of_a_stuck_gyro),
    // A log without gyros, an IMU that drifts and is shaken by a propeller and by bumps. The bound has no vibration in
    // it, nor what the soft gate weakens.
    Row("bases", "an IMU in space", "seabed-imu", "seabed-imu",
        both(in_space(0.05), {{"position over its bound", 0, 1.15}, {"rotation over its bound", 0, 1.15}}), 0, nullptr,
        nullptr, {.bounds = 20}, kLonger),
    Row("bases", "an IMU without pictures for 20 s", "seabed-imu", "seabed-imu", in_space(0.1), 0, nullptr, nullptr,
        kBlind, kLonger),
    Row("bases", "gyros that stick", "seabed-imu", "seabed-imu", kSticks, 0, gyros_stick, nullptr, {}, kLonger),
    Row("bases", "a yaw gyro that sticks", "seabed-imu", "seabed-imu", kSticks, 0, yaw_gyro_sticks, nullptr, {},
        kLonger),
    Row("bases", "accelerometers that stick", "seabed-imu", "seabed-imu", kSticks, 0, accelerometers_stick, nullptr, {},
        kLonger),
    // Paper: 15 known points, the start wrong by up to 20 m, 3 cm after that. Here in every drive, from 2 s on.
    Row("space", "known points, a start 20 m wrong", "seabed-points", "seabed-points", in_space(0.01)),
    Row("space", "four points a picture suffice", "seabed-points", "seabed-points",
        both(in_space(0.01), {{"points of a pair of pictures", 3, 4}, {"points of a pair that are fused", 3, 4}}), 0,
        nullptr, of_few_points, {.points_per_picture = 4}),
    // Paper: about 30 points a step that nobody measured: 5 cm, points 2 cm off, 6.3 % wrong. A point's depth by pixels
    // of 0.5 px, and the way's own drift until the round is closed. One point begun by a wrong match and left alone is
    // metres off, and would be seen here.
    Row("space", "points found on the way", "seabed-slam", "seabed-points",
        both(in_space(0.03), {{"error of a point, m", 0, 0.01}, {"share of wrong points", 0, 0.01}}), 0, nullptr,
        of_points_found, {}, kLonger),
    // Ranges, depth, compass and the log carry on; the covariance stays honest; one range in five being an echo costs
    // little.
    Row("space", "pictures gone for 20 s", "seabed-acoustic", "seabed-points",
        both(in_space(0.05), {{"ranges refused more than without echoes, a drive", 20, HUGE_VAL},
                              {"mean RMS over that without echoes", 0, 1.2}}),
        0, nullptr, of_echoes, kBlind),
};
const Row *row;

void is_within_its_limits() {
  const bool swims = Loaded(row->world, row->config).scenario.swims();
  Result result;
  if (swims)
    result.space = dived(*row, row->change);
  else
    result.planar = driven(*row, row->config);
  Figures found = swims ? figures(result.space) : figures(result.planar);
  if (row->more) row->more(*row, result, found);
  std::printf("%s\n", row->name);
  for (const auto &[name, value] : found) std::printf("  %-50s %.4f\n", name.c_str(), value);
  for (const Limit &limit : row->limits) {
    const double low = drives < 200 ? limit.low_of_few : limit.low,
                 high = drives < 200 ? limit.high_of_few : limit.high;
    const auto at = found.find(limit.figure);
    char text[160];
    std::snprintf(text, sizeof text, "%s is not in [%g, %g]", limit.figure, low, high);
    TEST_ASSERT_TRUE_MESSAGE(at != found.end() && at->second >= low && at->second <= high, text);
  }
}

}  // namespace

void setUp(void) {}
void tearDown(void) {}

int main(int argc, char **argv) {
  if (argc < 3) return 2;
  const std::string group = argv[1];
  drives = wm_trials(std::strtoull(argv[2], nullptr, 10), group == "landmarks" ? 6 : group == "bases" ? 4 : 1);
  if (argc > 3) longer_drives = std::strtoull(argv[3], nullptr, 10);
  UNITY_BEGIN();
  for (const Row &of : kRows)
    if (row = &of; of.group == group && drives >= of.drives_least)
      UnityDefaultTestRun(is_within_its_limits, of.name, __LINE__);
  return UNITY_END();
}
