// SPDX-License-Identifier: Apache-2.0
// The Cramér-Rao bound of a rendered drive past known landmarks, with the bearings that the run's detector found in its
// pictures.
#include "montecarlo/bound.h"

#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/csv.h"
#include "common/event_log.h"
#include "common/failure.h"
#include "common/recording_folder.h"
#include "montecarlo/engines.h"

namespace wm::montecarlo {
namespace {

using tools::Failure;
using tools::Pose;

struct Found {
  std::vector<SeenBearing> bearings;
  size_t landmarks = 0, cameras = 0;
};

// Truth.csv as states: rows each 20 ms, between them at constant speed.
class Path {
 public:
  explicit Path(const std::vector<Pose> &poses) {
    for (const Pose &p : poses) {
      sim::State s{};
      s.x_m = p.p_m.x(), s.y_m = p.p_m.y();
      s.heading_rad = tools::heading_rad(p.q);
      if (!states_.empty()) {
        const sim::State &before = states_.back();
        s.heading_rad = before.heading_rad + tools::wrap(s.heading_rad - before.heading_rad);
        const double along =
            std::cos(s.heading_rad) * (s.x_m - before.x_m) + std::sin(s.heading_rad) * (s.y_m - before.y_m);
        s.way_m = before.way_m + std::copysign(std::hypot(s.x_m - before.x_m, s.y_m - before.y_m), along);
      }
      times_s_.push_back(1e-9 * static_cast<double>(p.t_ns - poses.front().t_ns));
      states_.push_back(s);
    }
    if (states_.size() < 2) throw Failure("truth.csv has no way in it");
  }
  double end_s() const { return times_s_.back(); }

  sim::State at(double t_s) const {
    const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), t_s) - times_s_.begin();
    const auto b =
        static_cast<size_t>(std::clamp<std::ptrdiff_t>(after, 1, static_cast<std::ptrdiff_t>(times_s_.size()) - 1));
    const size_t a = b - 1;
    const double dt = times_s_[b] - times_s_[a], part = std::clamp((t_s - times_s_[a]) / dt, 0.0, 1.0);
    const sim::State &from = states_[a], &to = states_[b];
    sim::State s{};
    s.x_m = from.x_m + part * (to.x_m - from.x_m);
    s.y_m = from.y_m + part * (to.y_m - from.y_m);
    s.heading_rad = from.heading_rad + part * (to.heading_rad - from.heading_rad);
    s.way_m = from.way_m + part * (to.way_m - from.way_m);
    s.speed_mps = (to.way_m - from.way_m) / dt;
    s.yaw_rate_radps = (to.heading_rad - from.heading_rad) / dt;
    return s;
  }

 private:
  std::vector<double> times_s_;
  std::vector<sim::State> states_;
};

std::map<int64_t, Eigen::Vector2d> load_places(const std::filesystem::path &file) {
  const tools::Csv csv = tools::Csv::load(file);
  const size_t id = csv.need("id"), x = csv.need("x_m"), y = csv.need("y_m");
  std::map<int64_t, Eigen::Vector2d> out;
  for (size_t row = 0; row < csv.rows(); row++) out[csv.integer(row, id)] = {csv.number(row, x), csv.number(row, y)};
  return out;
}

Found load_found(const std::filesystem::path &run, const std::filesystem::path &recording, int64_t begin_ns) {
  const std::map<int64_t, Eigen::Vector2d> places = load_places(recording / "truth-landmarks.csv");
  tools::EventLog log(run);
  const wm_log_head &head = log.head();
  std::map<int64_t, size_t> numbers;
  Found out;
  out.cameras = head.sensor_count;
  while (const wm_event *next = log.next()) {
    const wm_event &event = *next;
    const wm_sighting &seen = event.as.sighting;
    if (event.kind != WM_EVENT_SIGHTING || !std::isfinite(seen.bearing_sigma_rad) || seen.sensor >= head.sensor_count)
      continue;
    const auto place = places.find(seen.landmark_id);
    if (place == places.end()) continue;
    const auto number = numbers.emplace(seen.landmark_id, numbers.size()).first;
    const wm_mounting &mounting = head.sensors[seen.sensor].mounting;
    out.bearings.push_back({1e-9 * static_cast<double>(event.t_ns - begin_ns),
                            seen.sensor,
                            number->second,
                            {mounting.xyz_m[0], mounting.xyz_m[1]},
                            {place->second.x(), place->second.y()},
                            seen.bearing_sigma_rad});
  }
  out.landmarks = numbers.size();
  return out;
}

}  // namespace

void print_bound(const Request &a, const sim::Scenario &scenario) {
  const std::vector<Pose> poses = tools::load_truth(a.recording);
  const Path path(poses);
  const Found found = load_found(a.run, a.recording, poses.front().t_ns);
  std::vector<double> times_s;
  for (double t_s = 0.1; t_s <= path.end_s(); t_s += 0.1) times_s.push_back(t_s);
  const std::vector<Bound> bounds = bound(
      scenario, [&path](double t_s) { return path.at(t_s); }, found.bearings, found.landmarks, found.cameras, times_s);
  double position_m2 = 0, heading_rad2 = 0;
  for (const Bound &b : bounds) position_m2 += b.x_var_m2 + b.y_var_m2, heading_rad2 += b.heading_var_rad2;
  const auto n = static_cast<double>(bounds.size());
  const Bound &end = bounds.back();
  const nlohmann::ordered_json out = {{"position_rms_m", std::sqrt(position_m2 / n)},
                                      {"position_end_m", std::sqrt(end.x_var_m2 + end.y_var_m2)},
                                      {"heading_rms_deg", std::sqrt(heading_rad2 / n) * 180 / M_PI},
                                      {"bearings", found.bearings.size()},
                                      {"landmarks", found.landmarks}};
  std::printf("%s\n", out.dump(2).c_str());
}

}  // namespace wm::montecarlo
