// SPDX-License-Identifier: Apache-2.0
#include "filters/pf_edges/pf_edges.hpp"

#include <cstring>
#include <limits>

#include "filters/core/contract.hpp"
#include "filters/core/gate.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"
#include "sensors/points.hpp"

namespace wm {
namespace {

// Sigmas of a point for which the map has a baked layer; the last one serves larger sigmas, too.
constexpr double kClassSigma_m[kSigmaClasses] = {0.01, 0.03, 0.06, 0.12};
constexpr double kUnknownSigma_m = 0.03;  // of a point whose detector gives none: a pixel at 4 m
// Noise of the heading beside that of the way: rad per sqrt(s) of motion, and per sqrt(rad) of rotation.
constexpr double kTurnAtRest = 0.003, kTurnOfTurn = 0.02;
constexpr double kResampleBelow = 0.5;  // effective particles, of all
constexpr int kPointsMin = 5;           // of a scan: fewer leave a pose open
// The published mean is that of particles about the heaviest one. Half a corridor's width, 20 degrees; not swept.
constexpr double kCluster_m = 0.5, kCluster_rad = 0.35;
// Share of a scan that the best particle leaves unexplained, from which on it contradicts all particles: more than half
// of what is seen. Furniture and people are less.
constexpr double kContradicted = 0.5;
constexpr double kFoundShare = 0.9;  // of the weight in that cluster, from which on a search has ended; not swept
constexpr double kCovarianceMin[3] = {1.6e-5, 1.6e-5, 1e-6};  // a pixel of 1.3 cm / sqrt(12), 1 mrad; squared

// The motion's noise until the first scan; then the particles have noise of their own.
const char *const kReads[] = {"!motion.states.",
                              "!motion.standstill.bias",
                              "!motion.constant_velocity.",
                              "!motion.noise.adapt",
                              "motion.",
                              nullptr};

}  // namespace

size_t pf_edges::bytes(const wm_pf_edges_params &params, const wm_setup &setup, const char **why) {
  const size_t map = edge_map::bytes_or_reason(setup.map, why);
  if (map == 0) return 0;
  if (setup.motion->model == WM_MOTION_CONSTANT_VELOCITY) {
    *why = "it needs motion data: its particles have no velocity";
    return 0;
  }
  memory_layout layout(nullptr, sizeof(pf_edges));
  lay_out(&layout, params, setup);
  return layout.bytes();
}

pf_edges::blocks pf_edges::lay_out(memory_layout *layout, const wm_pf_edges_params &params, const wm_setup &setup) {
  uint8_t *const cloud = layout->take<uint8_t>(particles::bytes(params.particles));
  uint8_t *const map = layout->take<uint8_t>(edge_map::bytes(*setup.map));
  return {cloud, map, layout->take<uint8_t>(score_field::bytes(*setup.map))};
}

void pf_edges::init(const wm_pf_edges_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  odometry_.init(setup, wm_motion_states{}, kPoseStates);
  life_ = lifecycle();
  memory_layout layout(this, sizeof *this);
  const blocks memory = lay_out(&layout, params, setup);
  particles_.init(params.particles, setup.seed, memory.cloud);
  map_.init(*setup.map, memory.map);
  double sigma[kSigmaClasses];
  for (int k = 0; k < kSigmaClasses; k++) sigma[k] = std::sqrt(square(params.sigma_m) + square(kClassSigma_m[k]));
  make_score_table(map_, sigma, params.false_points, params.weight == PF_EDGES_SUM, &table_);
  field_.init(map_, table_, memory.field);
  start_again(start_is_known(setup.start));
}

void pf_edges::start_again(bool known) {
  double covariance[3][3];
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) covariance[r][c] = odometry_.covariance(r, c);
  if (known)
    particles_.spread(odometry_.pose(), covariance);
  else
    particles_.spread_over(map_);
  odom_ = odometry_.odom();
  travelled_m_ = odometry_.travelled_m();
  turned_rad_ = odometry_.turned_rad();
  scan_ns_ = odometry_.now_ns();
  life_.begin(known);
  life_.fused(WM_TIME_NONE);
}

wm_status pf_edges::predict(const wm_event &motion) {
  const wm_status status = odometry_.check_motion(motion);
  if (status == WM_OK) odometry_.move(motion);
  return status;
}

wm_status pf_edges::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_POINTS: return take_points(event, records);
    case WM_EVENT_SET_POSE:
    case WM_EVENT_RESET: return take_pose(event);
    case WM_EVENT_LOOKED: {
      const wm_status status = odometry_.check_time(event.t_ns);
      if (status == WM_OK) odometry_.move_to(event.t_ns);
      return status;
    }
    default: return WM_UNSUPPORTED;
  }
}

wm_status pf_edges::take_pose(const wm_event &event) {
  const bool reset = event.kind == WM_EVENT_RESET;
  const wm_status status = reset ? reset_pose(odometry_, setup_->start, event.t_ns) : set_pose(odometry_, event);
  if (status == WM_OK) start_again(!reset || start_is_known(setup_->start));
  return status;
}

// One step of the particle filter.
wm_status pf_edges::take_points(const wm_event &event, record_list records) {
  wm_status status = odometry_.check_time(event.t_ns);
  if (status == WM_OK) status = check_points(event.as.points);
  if (status != WM_OK) return status;
  odometry_.move_to(event.t_ns);

  propagate();
  const bool fused = weigh(event.as.points);
  const bool contradicts = fused && unexplained() > kContradicted;
  if (fused) resample();

  if (fused) life_.fused(event.t_ns);
  if (life_.searching() && particles_.main_cluster(kCluster_m, kCluster_rad).share > kFoundShare) life_.fits_again();
  wm_innovation record = record_of(event, WM_RESIDUAL_RANGE);
  // A scan that no particle explains has moved the weights nevertheless; the monitor reads its record.
  record.verdict = !fused ? (uint8_t)WM_REJECTED_SINGULAR : contradicts ? (uint8_t)WM_REJECTED_GATE : (uint8_t)WM_FUSED;
  records.add(record);
  return WM_OK;
}

// d = s (1 + eta), x += d cos(theta + delta), y += d sin(theta + delta), theta += turn + delta, with eta and delta
// normal; here with noise across the way, too, and sigmas that hold for steps of any length.
void pf_edges::propagate() {
  const wm_pose2 increment = between(odom_, odometry_.odom());
  const double way = odometry_.travelled_m() - travelled_m_, turn = odometry_.turned_rad() - turned_rad_;
  const double dt = scan_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(scan_ns_, odometry_.now_ns());
  odom_ = odometry_.odom();
  travelled_m_ = odometry_.travelled_m();
  turned_rad_ = odometry_.turned_rad();
  scan_ns_ = odometry_.now_ns();
  if (way <= 0.0 && turn <= 0.0) return;  // at rest there is no motion noise
  step_noise noise;
  noise.along_m = std::sqrt(square(params_.noise_way) * way + square(params_.noise_way_rel * way));
  noise.across_m = params_.noise_side * std::sqrt(way);
  noise.turn_rad = std::sqrt(square(params_.noise_turn) * way + square(kTurnAtRest) * dt + square(kTurnOfTurn) * turn);
  particles_.propagate(increment, noise);
}

// Weights by the blurred edge layer, normalised. False: nothing could be weighed.
bool pf_edges::weigh(const wm_points &points) {
  select_points(points);
  return scan_.count >= kPointsMin &&
         particles_.weigh(map_, field_, scan_, table_, params_.exponent, params_.weight == PF_EDGES_SUM);
}

// Share of the scan that the best particle leaves unexplained: its mean score, from that of points on edges (0) to that
// of points far from any (1).
double pf_edges::unexplained() const {
  int best = 0;
  for (int i = 1; i < particles_.count(); i++)
    if (particles_.weight(i) > particles_.weight(best)) best = i;
  const sin_cos h = sincos(particles_.heading(best));
  const double scored =
      kScoreUnit * score(map_, scan_, table_, particles_.x(best), particles_.y(best), h.cos, h.sin) / scan_.count;
  const double none = kScoreUnit * table_.value[0][edge_map::kFar], all = kScoreUnit * table_.value[0][0];
  return (all - scored) / (all - none);
}

void pf_edges::resample() {
  if (particles_.effective() < kResampleBelow * particles_.count()) particles_.resample();
}

// The scan's points in the order of their classes of sigma.
void pf_edges::select_points(const wm_points &points) {
  const auto class_of = [&points](uint32_t i) {
    const bool known = finite((double)points.sigma_m[i]) && points.sigma_m[i] > 0.0f;
    const double sigma = known ? (double)points.sigma_m[i] : kUnknownSigma_m;
    int own = 0;
    while (own + 1 < kSigmaClasses && sigma > 1.5 * kClassSigma_m[own]) own++;
    return own;
  };
  int next = 0;
  double reach2 = 0.0;
  for (int k = 0; k < kSigmaClasses; k++) {
    for (uint32_t i = 0; i < points.count; i++) {
      const double range2 = square((double)points.x_m[i]) + square((double)points.y_m[i]);
      if (class_of(i) != k || range2 > square(params_.range_max_m)) continue;
      scan_.x_m[next] = points.x_m[i];
      scan_.y_m[next++] = points.y_m[i];
      if (range2 > reach2) reach2 = range2;
    }
    scan_.class_end[k] = next;
  }
  scan_.count = next;
  scan_.reach_m = (float)std::sqrt(reach2);
  for (int i = next; i < next + kScanLanes; i++) scan_.x_m[i] = scan_.y_m[i] = 0.0f;
}

void pf_edges::estimate(wm_estimate *out) const {
  odometry_.estimate(out);  // time and twist
  out->resets = life_.resets();
  out->state = life_.state(odometry_.now_ns(), params_.dead_reckoning_after_s);
  // Normalised weights rank the particles; none of them measures how well the best one fits.
  out->lost_probability = life_.searching() ? 1.0 : std::numeric_limits<double>::quiet_NaN();
  // Before the first scan the given pose is exact; the particles are only samples of it.
  if (life_.fused_ns() == WM_TIME_NONE && life_.tracking()) return;
  const particle_moments m = particles_.main_cluster(kCluster_m, kCluster_rad);
  // The particles stand at the last scan.
  const wm_pose2 pose = compose(m.mean, between(odom_, odometry_.odom()));
  put_planar_estimate(
      pose,
      [&m](int r, int c) {
        return r == c ? m.covariance[r][r] + kCovarianceMin[r] : m.covariance[r < c ? r : c][r < c ? c : r];
      },
      out);
}

size_t pf_edges::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_MOTION_OUTLIERS, odometry_.motion_outliers());
  return list.count();
}

size_t pf_edges::list_particles(wm_particle *out, size_t capacity) const {
  const size_t count = (size_t)particles_.count();
  for (size_t i = 0; i < count && i < capacity; i++)
    out[i] = {particles_.x((int)i), particles_.y((int)i), particles_.heading((int)i), particles_.weight((int)i)};
  return count;
}

}  // namespace wm

const wm_estimator wm_pf_edges_estimator = wm::estimator_of<wm::pf_edges, wm_pf_edges_params>(
    "pf_edges",
    "Particle filter over a raster map of edges on the floor: propagate, weigh, normalise, resample. Needs a start "
    "pose.",
    WM_EVENT_BIT(WM_EVENT_POINTS) | WM_EVENT_BIT(WM_EVENT_LOOKED) | WM_EVENT_BIT(WM_EVENT_SET_POSE) |
        WM_EVENT_BIT(WM_EVENT_RESET),
    wm_pf_edges_params_table, wm::kReads);
