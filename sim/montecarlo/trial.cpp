// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/trial.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>

#include "common/failure.h"
#include "common/statistics.h"
#include "montecarlo/look.h"
#include "montecarlo/views.h"
#include "waymark/estimator.h"
#include "waymark/health.h"
#include "waymark/random.h"

namespace wm::montecarlo {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kWayAhead_m = 22, kDriving_mps = 0.25;

constexpr int64_t ns(double s) { return static_cast<int64_t>(s * 1e9); }

// The estimator of a drive, and what it had last to look at.
class EdgeFilter : public Filter {
 public:
  EdgeFilter(const EdgeDrive &drive, const wm_config &config, bool start_known, uint64_t seed) : Filter(config) {
    const wm_log_head &head = drive.head();
    wm_setup &s = setup();
    s.wheels = head.wheels;
    s.sensors = head.sensors;
    s.sensor_count = head.sensor_count;
    s.landmarks = head.landmarks;
    s.landmark_count = head.landmark_count;
    s.rig = &head.rig;
    s.map = &drive.map();
    s.start = head.start;
    s.seed = seed;
    if (!start_known) s.start.p_m[0] = s.start.p_m[1] = s.start.heading_rad = NAN;
    if (!start_known) s.start.t_ns = WM_TIME_NONE;
    wm_error error{};
    if (init(&error) != WM_OK) throw tools::Failure(drive.name() + ": " + error.text, tools::kUsage);
  }
  void take(const wm_event &event) {
    if (wm_event_is_motion(&event)) {
      (void)ops().predict(state(), &event);
      return;
    }
    wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t count = 0;
    (void)ops().correct(state(), &event, out, WM_INNOVATIONS_PER_EVENT_MAX, &count);
    if (event.kind == WM_EVENT_POINTS && count > 0) points_ = event.as.points.count;
  }
  [[nodiscard]] Sample look(const wm_pose2 &truth, const wm_estimate &e) const;

 private:
  // Share of the edge points that lie on edges of the map, smoothed.
  [[nodiscard]] double explained() const {
    const std::optional<wm_counter> found = counter(WM_COUNTER_EXPLAINED_PERMILLE);
    return found ? 1e-3 * static_cast<double>(found->count) : tools::kNan;
  }
  [[nodiscard]] double weight_about(const wm_pose2 &truth) const {
    if (ops().particles == nullptr) return 0;
    std::vector<wm_particle> all(ops().particles(state(), nullptr, 0));
    ops().particles(state(), all.data(), all.size());
    double sum = 0;
    for (const wm_particle &p : all)
      if (std::hypot(p.x_m - truth.x_m, p.y_m - truth.y_m) < 0.5 &&
          std::fabs(tools::wrap(p.heading_rad - truth.heading_rad)) < 15 * kDegree)
        sum += p.weight;
    return sum;
  }

  // Whether a place that is listed beside the estimate holds the truth within its own covariance's 95 %.
  [[nodiscard]] bool listed(const wm_pose2 &truth) const {
    if (ops().hypotheses == nullptr) return false;
    std::vector<wm_hypothesis> all(ops().hypotheses(state(), nullptr, 0));
    ops().hypotheses(state(), all.data(), all.size());
    return std::any_of(all.begin(), all.end(), [&truth](const wm_hypothesis &h) {
      const Eigen::Vector3d off(truth.x_m - h.x_m, truth.y_m - h.y_m, tools::wrap(truth.heading_rad - h.heading_rad));
      const double *c = h.covariance;
      Eigen::Matrix3d covariance;
      covariance << c[0], c[1], c[3], c[1], c[2], c[4], c[3], c[4], c[5];
      return off.dot(covariance.ldlt().solve(off)) < tools::chi2_quantile(0.95, 3);
    });
  }

  uint32_t points_ = 0;
};

Sample EdgeFilter::look(const wm_pose2 &truth, const wm_estimate &e) const {
  Sample s{};
  const PlanarError error = error_of(e, truth);
  s.error_m = error.position_m();
  s.error_rad = error.heading_rad();
  s.nees = error.nees();
  s.tracking = e.state == WM_STATE_TRACKING || e.state == WM_STATE_DEAD_RECKONING;
  s.lost_probability = e.lost_probability;
  s.explained = explained();
  s.points = points_;
  // A cluster is a hypothesis from a hundredth of the weight on.
  s.covered = s.nees < tools::chi2_quantile(0.95, 3) || weight_about(truth) > 0.01 || listed(truth);
  return s;
}

bool right(const Sample &s) { return s.tracking && s.error_m < 0.3 && s.error_rad < 10 * kDegree; }
bool off(const Sample &s) { return s.error_m > 0.5 || s.error_rad > 15 * kDegree; }

}  // namespace

Outcome run_trial(const EdgeDrive &drive, const wm_config &config, const Trial &trial, uint64_t seed) {
  EdgeFilter filter(drive, config, trial.kind != TrialKind::kStart, seed);
  const bool begun = trial.kind == TrialKind::kNormal;
  const int64_t shift = trial.kind == TrialKind::kStart ? 0 : trial.cut_ns - trial.on_ns;
  Outcome out;
  int64_t look_ns = INT64_MIN;
  wm_event event{};
  for (int part = 0; part < 2; part++) {
    for (size_t i = 0; i < drive.events(); i++) {
      drive.event(i, &event);
      if (part == 0 ? trial.kind == TrialKind::kStart || event.t_ns >= trial.cut_ns : event.t_ns < trial.on_ns)
        continue;
      if (part == 1) {
        event.t_ns += shift;
        event.arrival_ns += shift;
      }
      filter.take(event);
      if ((part == 0 && !begun) || event.t_ns < look_ns) continue;
      const wm_estimate e = filter.estimate();
      if (e.t_ns == WM_TIME_NONE) continue;
      look_ns = event.t_ns + ns(kLook_s);
      const int64_t there_ns = part == 0 ? e.t_ns : e.t_ns - shift;
      Sample s = filter.look(drive.truth(there_ns), e);
      const int64_t from_ns = begun ? drive.begin_ns() : trial.on_ns;
      s.t_s = 1e-9 * static_cast<double>(there_ns - from_ns);
      s.way_m = drive.way_m(there_ns) - drive.way_m(from_ns);
      out.samples.push_back(s);
    }
    if (begun) break;
  }
  return out;
}

std::vector<Trial> draw_trials(const EdgeDrive &drive, TrialKind kind, int count, double eye_m) {
  std::vector<Trial> out;
  if (kind == TrialKind::kNormal) return {{kind, INT64_MAX, INT64_MAX}};
  const Viewer viewer(drive.map(), eye_m);
  uint64_t seed = 0;
  for (const char letter : drive.name()) seed = 131 * seed + static_cast<unsigned char>(letter);
  const int64_t span = drive.end_ns() - drive.begin_ns();
  double longest_alike_s = 0;
  const int tries = kind == TrialKind::kAlike ? 4000 : 400;
  for (int n = 0; n < tries && (kind == TrialKind::kAlike || static_cast<int>(out.size()) < count); n++) {
    const auto at = [&](uint64_t k) {
      const double u = wm_random_uniform(seed, static_cast<uint64_t>(kind), 2 * static_cast<uint64_t>(n) + k);
      return drive.begin_ns() + static_cast<int64_t>(u * static_cast<double>(span));
    };
    const Trial t{kind, kind == TrialKind::kStart ? INT64_MIN : at(0), at(1)};
    if (drive.way_m(drive.end_ns()) - drive.way_m(t.on_ns) < kWayAhead_m) continue;
    if (drive.speed_mps(t.on_ns) < kDriving_mps || drive.blind_s(t.on_ns, t.on_ns + ns(6)) > 1) continue;
    if (kind == TrialKind::kStart) {
      out.push_back(t);
      continue;
    }
    if (t.cut_ns - drive.begin_ns() < ns(12) || drive.speed_mps(t.cut_ns) < kDriving_mps) continue;
    if (drive.blind_s(t.cut_ns - ns(5), t.cut_ns) > 1) continue;
    const wm_pose2 here = drive.truth(t.cut_ns), there = drive.truth(t.on_ns), way = relative(here, there);
    const bool far = std::hypot(way.x_m, way.y_m) >= 3;
    if (kind == TrialKind::kKidnap) {
      if (!far && std::fabs(way.heading_rad) < 45 * kDegree) continue;
      if (viewer.distinction(there, here) > kOtherView) out.push_back(t);
      continue;
    }
    if (!far || Viewer::difference(viewer.at(here), viewer.at(there)) > 0.1) continue;
    // How long it stays alike, while the robot drives on there and the filter predicts on here.
    double alike_s = 0;
    for (; alike_s < 20; alike_s += 0.5) {
      const wm_pose2 now = drive.truth(t.on_ns + ns(alike_s));
      if (Viewer::difference(viewer.at(composed(here, relative(there, now))), viewer.at(now)) > kOtherView) break;
    }
    if (alike_s < 1 || alike_s <= longest_alike_s) continue;
    longest_alike_s = alike_s;
    out.assign(1, t);
  }
  return out;
}

double Outcome::position_mean_m() const {
  std::vector<double> v;
  for (const Sample &s : samples) v.push_back(s.error_m);
  return tools::mean(v);
}

double Outcome::position_max_m() const {
  double most = 0;
  for (const Sample &s : samples) most = std::max(most, s.error_m);
  return most;
}

double Outcome::heading_mean_deg() const {
  std::vector<double> v;
  for (const Sample &s : samples) v.push_back(s.error_rad / kDegree);
  return tools::mean(v);
}

double Outcome::nees_inside() const {
  const double bound = tools::chi2_quantile(0.95, 3);
  const auto inside = std::count_if(samples.begin(), samples.end(), [&](const Sample &s) { return s.nees <= bound; });
  return samples.empty() ? tools::kNan : static_cast<double>(inside) / static_cast<double>(samples.size());
}

bool Outcome::lost() const {
  if (longest(samples, off) > 2) return true;
  return samples.empty() || off(samples.back());
}

int Outcome::false_alarms() const {
  int count = 0;
  for (size_t i = 1; i < samples.size(); i++)
    count += samples[i - 1].tracking && !samples[i].tracking && !off(samples[i]);
  return count;
}

std::optional<double> Outcome::detected_after_s() const {
  for (const Sample &s : samples)
    if (!s.tracking) return s.t_s;
  return std::nullopt;
}

std::optional<double> Outcome::right_after_m() const {
  const Sample *since = first_lasting(samples, 2, right);
  return since != nullptr ? std::optional(since->way_m) : std::nullopt;
}

double Outcome::astray_s() const {
  return longest(samples, [](const Sample &s) { return s.tracking && s.error_m > 1; });
}

double Outcome::covered() const {
  double counted = 0, covered = 0;
  for (const Sample &s : samples) {
    if (right(s)) continue;
    counted++;
    covered += s.covered;
  }
  return counted > 0 ? covered / counted : 1;
}

}  // namespace wm::montecarlo
