// SPDX-License-Identifier: Apache-2.0
#include "map/survey_bearings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>

#include "common/csv.h"
#include "common/event_log.h"
#include "common/failure.h"
#include "common/recording_folder.h"
#include "common/statistics.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr size_t kFewest = 5;  // sightings of a landmark
constexpr double kTwist_s = 0.02;
constexpr size_t kSeveral = 6;  // sightings that agree on another place: no accident
constexpr double kMost = 0.6;   // of those that don't fit
constexpr double kOftenMisread = 0.15;
constexpr double kElsewhere = 16;  // squared sigmas from where the map has it

struct Drive {
  std::vector<BearingSensor> sensors;
  std::vector<TakenBearing> bearings;
  std::vector<int64_t> ids;  // of each landmark
  std::map<int64_t, wm_landmark> map;
  int64_t begin_ns = 0;
};

template <typename... Values>
std::string said(const char *format, Values... values) {
  char out[256];
  std::snprintf(out, sizeof out, format, values...);
  return out;
}

std::vector<Pose> load_poses(const fs::path &folder) {
  return fs::exists(folder / "truth.csv") ? load_truth(folder) : load_trajectory(folder).poses;
}

Drive load_drive(const fs::path &run, const std::vector<Pose> &poses) {
  EventLog log(run);
  const wm_log_head &head = log.head();
  Drive out;
  for (size_t i = 0; i < head.sensor_count; i++) {
    const wm_mounting &m = head.sensors[i].mounting;
    out.sensors.push_back({head.sensors[i].name, Vector3d(m.xyz_m), Vector3d(m.rpy_rad)});
  }
  for (size_t i = 0; i < head.landmark_count; i++) out.map[head.landmarks[i].id] = head.landmarks[i];
  std::map<int64_t, size_t> numbers;
  while (const wm_event *next = log.next()) {
    const wm_event &event = *next;
    const wm_sighting &s = event.as.sighting;
    if (event.kind != WM_EVENT_SIGHTING || s.landmark_id < 0 || !std::isfinite(s.bearing_rad) ||
        s.sensor >= out.sensors.size())
      continue;
    const auto pose = pose_at(poses, event.t_ns, kMaxGapNs);
    const auto step_ns = static_cast<int64_t>(kTwist_s * 1e9);
    const auto before = pose_at(poses, event.t_ns - step_ns, kMaxGapNs);
    if (!pose || !before) continue;
    const double own = head.sensors[s.sensor].bearing_sigma_rad;
    const double sigma = std::isfinite(s.bearing_sigma_rad) ? s.bearing_sigma_rad : std::isfinite(own) ? own : 0.02;
    const auto number = numbers.emplace(s.landmark_id, numbers.size());
    if (number.second) out.ids.push_back(s.landmark_id);
    if (out.bearings.empty()) out.begin_ns = event.t_ns;
    TakenBearing b{};
    b.t_ns = event.t_ns;
    b.sensor = s.sensor;
    b.landmark = number.first->second;
    b.bearing_rad = s.bearing_rad;
    b.sigma_rad = sigma;
    b.pose = *pose;
    b.twist_mps = (pose->p_m - before->p_m).head<2>() / kTwist_s;
    b.turn_radps = wrap(heading_rad(pose->q) - heading_rad(before->q)) / kTwist_s;
    out.bearings.push_back(b);
  }
  return out;
}

double seconds(const Drive &drive, int64_t t_ns) { return 1e-9 * static_cast<double>(t_ns - drive.begin_ns); }

// What the bearings that don't fit have in common.
void judge(const Drive &drive, size_t landmark, const std::vector<SurveyedPlace> &places, LandmarkSurvey *out) {
  const SurveyedPlace &place = places[landmark];
  std::vector<TakenBearing> strays, fitting;
  for (const TakenBearing &b : drive.bearings)
    if (b.landmark == landmark) (b.fits ? fitting : strays).push_back(b);
  std::vector<TakenBearing *> pointers;
  for (TakenBearing &b : strays) pointers.push_back(&b);
  const SurveyedPlace other = agreed_place(drive.sensors, pointers, place.p_m.z());
  std::vector<int64_t> there_ns;
  for (const TakenBearing &b : strays)
    if (other.found && std::fabs(wrap(bearing_to(drive.sensors[b.sensor], b.pose, other.p_m) - b.bearing_rad)) < 0.0175)
      there_ns.push_back(b.t_ns);
  const auto named = [&]() -> int64_t {  // of whom those may be sightings
    for (size_t i = 0; i < places.size(); i++)
      if (i != landmark && places[i].found && (places[i].p_m - other.p_m).head<2>().norm() < 0.5) return drive.ids[i];
    return -1;
  };
  if (there_ns.size() >= kSeveral &&
      static_cast<double>(there_ns.size()) > kMost * static_cast<double>(strays.size())) {
    const double away = (other.p_m - place.p_m).head<2>().norm();
    const auto [first, last] = std::minmax_element(there_ns.begin(), there_ns.end());
    const bool after = *first > fitting.back().t_ns, before = *last < fitting.front().t_ns;
    if (named() >= 0)
      out->findings.push_back(said("%zu sightings are of landmark %lld, by that one's identity: misread",
                                   there_ns.size(), static_cast<long long>(named())));
    else if (after || before)
      out->findings.push_back(said("moved about %.2f m between %.1f s and %.1f s, %s (%.2f, %.2f)", away,
                                   seconds(drive, after ? fitting.back().t_ns : *last),
                                   seconds(drive, after ? *first : fitting.front().t_ns), after ? "to" : "from",
                                   other.p_m.x(), other.p_m.y()));
    else
      out->findings.push_back(
          said("has a duplicate: %zu sightings are of another landmark %.2f m away, at (%.2f, %.2f)", there_ns.size(),
               away, other.p_m.x(), other.p_m.y()));
  } else if (strays.size() >= 3 &&
             static_cast<double>(strays.size()) > kOftenMisread * static_cast<double>(strays.size() + fitting.size())) {
    out->findings.push_back(said("%zu of %zu sightings fit no place: its identity is misread, or others are read as it",
                                 strays.size(), strays.size() + fitting.size()));
  }
  const auto on_map = drive.map.find(drive.ids[landmark]);
  if (on_map == drive.map.end()) return;
  const Eigen::Vector2d off = place.p_m.head<2>() - Eigen::Vector2d(on_map->second.p_m);
  const double sigma = std::max(on_map->second.sigma_m, 0.0);
  const Eigen::Matrix2d expected = place.covariance + sigma * sigma * Eigen::Matrix2d::Identity();
  if (off.dot(expected.ldlt().solve(off)) > kElsewhere)
    out->findings.push_back(said("is %.2f m off where the map has it", off.norm()));
}

void write_map(const SurveyDrive &drive, const Drive &taken, const std::vector<SurveyedPlace> &places) {
  std::error_code problem;
  fs::create_directories(drive.out, problem);
  std::ofstream file(drive.out / "landmarks.csv");
  file << "id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy\n";
  std::map<int64_t, size_t> by_id;
  for (size_t i = 0; i < places.size(); i++)
    if (places[i].found) by_id[taken.ids[i]] = i;
  for (const auto &[id, i] : by_id) {
    const SurveyedPlace &p = places[i];
    const Eigen::Matrix2d &c = p.covariance;
    file << said("%lld,%.4f,%.4f,%.4f,%.4f,%.4e,%.4e,%.4e\n", static_cast<long long>(id), p.p_m.x(), p.p_m.y(),
                 p.p_m.z(), std::sqrt(0.5 * c.trace()), c(0, 0), c(0, 1), c(1, 1));
  }
  file.close();
  if (!file) throw Failure((drive.out / "landmarks.csv").string() + ": could not be written");
  const fs::path looks = drive.poses / "landmarks" / "appearance.csv";
  if (!fs::exists(looks)) return;
  fs::create_directories(drive.out / "landmarks", problem);
  const Csv rows = Csv::load(looks);
  const size_t id = rows.need("id"), picture = rows.need("picture");
  std::ofstream kept(drive.out / "landmarks" / "appearance.csv");
  for (size_t c = 0; c < rows.columns().size(); c++) kept << (c > 0 ? "," : "") << rows.columns()[c];
  kept << "\n";
  for (size_t row = 0; row < rows.rows(); row++) {
    if (by_id.find(rows.integer(row, id)) == by_id.end()) continue;
    for (size_t c = 0; c < rows.columns().size(); c++) kept << (c > 0 ? "," : "") << rows.text(row, c);
    kept << "\n";
    const std::string name(rows.text(row, picture));
    fs::copy_file(looks.parent_path() / name, drive.out / "landmarks" / name, fs::copy_options::overwrite_existing,
                  problem);
    if (problem) throw Failure((drive.out / "landmarks" / name).string() + ": " + problem.message());
  }
}

}  // namespace

Survey survey_drive(const SurveyDrive &drive) {
  if (!drive.out.empty() && fs::exists(drive.out / "landmarks.csv"))
    throw Failure(
        (drive.out / "landmarks.csv").string() + ": exists already and is not overwritten; name another --out", kUsage);
  Drive taken = load_drive(drive.run, load_poses(drive.poses));
  if (taken.bearings.empty())
    throw Failure((drive.run / "events.wmlog").string() +
                  ": no bearings of landmarks with identities at times of which " + drive.poses.string() +
                  " has poses");
  double height_m = 0;
  for (const BearingSensor &s : taken.sensors) height_m += s.xyz_m.z() / static_cast<double>(taken.sensors.size());
  std::vector<SurveyedPlace> places(taken.ids.size());
  for (size_t i = 0; i < places.size(); i++) {
    std::vector<TakenBearing *> of;
    for (TakenBearing &b : taken.bearings)
      if (b.landmark == i) of.push_back(&b);
    const auto known = taken.map.find(taken.ids[i]);
    places[i] = agreed_place(taken.sensors, of, known != taken.map.end() ? known->second.p_m[2] : height_m);
  }
  triangulate(taken.sensors, drive.priors, taken.bearings, places);
  Survey out;
  std::map<int64_t, LandmarkSurvey> by_id;
  for (size_t i = 0; i < places.size(); i++) {
    LandmarkSurvey one;
    one.id = taken.ids[i];
    one.on_map = places[i].found;
    std::vector<double> residuals, scaled;
    bool first = true;
    for (const TakenBearing &b : taken.bearings) {
      if (b.landmark != i) continue;
      if (first) one.first_s = seconds(taken, b.t_ns);
      first = false;
      one.last_s = seconds(taken, b.t_ns);
      ++(b.fits && places[i].found ? one.fused : one.refused);
      if (!b.fits || !places[i].found) continue;
      residuals.push_back(b.residual_rad);
      scaled.push_back(b.residual_rad / b.expected_sigma_rad);
    }
    if (places[i].found && residuals.size() >= kFewest) {
      const Eigen::Matrix2d &c = places[i].covariance;
      one.x_m = places[i].p_m.x(), one.y_m = places[i].p_m.y();
      one.sigma_m = std::sqrt(0.5 * c.trace() + std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1)));
      one.residuals.push_back({"bearing", mean(residuals), rms(residuals), rms(scaled)});
      judge(taken, i, places, &one);
    } else {
      one.on_map = places[i].found = false;
      one.findings.push_back(
          said("seen %zu times, too seldom or from too much the same direction: no place", one.fused + one.refused));
    }
    by_id[one.id] = one;
  }
  for (auto &[id, one] : by_id) out.landmarks.push_back(one);
  if (!drive.out.empty()) write_map(drive, taken, places);
  return out;
}

}  // namespace wm::tools
