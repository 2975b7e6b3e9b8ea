// SPDX-License-Identifier: Apache-2.0
// From the rows of an observation to its gate, its update and its records.
#include <utility>

#include "filters/landmark_ekf/landmark_ekf.hpp"

namespace wm {
namespace {

constexpr double kUnproven_nis = 9.21;  // 99 % quantile of chi2, 2 degrees of freedom
// Times the pose's sigmas while several observations misfit, slower than a search finds the pose. Not swept.
constexpr double kScaleSigmas = 1.5, kScaleEvery_s = 1.0;

}  // namespace

// A start with too small a covariance must not falsify the calibration: until the pose is proven, the gate is at 99 %.
bool landmark_ekf::passes(const gate_result &g, int dof) const {
  const bool unproven = params_.recover && !evidence_.proven();
  return g.passed && (!unproven || g.nis <= kUnproven_nis * gate_scale(dof));
}

innovation landmark_ekf::prepare(const residual *r, int count) {
  sparse_row rows[planar_filter::kRows];
  double innovations[planar_filter::kRows], noise[planar_filter::kRows];
  for (int i = 0; i < count; i++) {
    rows[i] = r[i].row;
    innovations[i] = r[i].innovation;
    noise[i] = r[i].noise;
  }
  return filter_.prepare(rows, innovations, noise, count);
}

// The components of one observation are gated and fused together: if one is wrong, so is the other.
double landmark_ekf::fuse(residual *r, int count, double clutter_volume, bool usable, record_list records) {
  innovation prepared = prepare(r, count);
  double variance[planar_filter::kRows];
  for (int i = 0; i < count; i++) variance[i] = prepared.s[i][i];
  const double log_bayes = landmark_evidence::log_bayes_factor(prepared.density(), clutter_volume);
  const gate_result g = gate(prepared.nis, count, {sightings().gate_soft, sightings().gate_hard});
  const wm_time_ns now = filter_.now_ns();
  if (g.soft && evidence_.doubtful() &&
      (inflated_ns_ == WM_TIME_NONE || wm_seconds_between(inflated_ns_, now) > kScaleEvery_s)) {
    // After several misfits the pose's covariance is too small, not this measurement's alone.
    inflated_ns_ = now;
    filter_.scale_pose_sigmas(kScaleSigmas);
    prepared = prepare(r, count);
  }
  wm_verdict verdict = usable && passes(g, count) ? WM_FUSED : WM_REJECTED_GATE;
  if (!(prepared.determinant > 0.0)) verdict = WM_REJECTED_NUMERIC;
  if (verdict == WM_FUSED) verdict = update(std::move(prepared), r, g);
  for (int i = 0; i < count; i++) {
    put_gate(g, count, variance[i], verdict, &r[i].record);
    records.add(r[i].record);
  }
  return verdict == WM_FUSED || (usable && g.passed) ? log_bayes : landmark_evidence::max_log_bayes_factor();
}

// Between the two gates the noise is inflated. While several observations misfit, the pose may move, but calibration
// states are considered, not corrected [Schmidt1966].
wm_verdict landmark_ekf::update(innovation &&prepared, const residual *r, const gate_result &g) {
  const int count = prepared.rows;
  const bool learns = evidence_.proven() && !evidence_.doubtful();
  sparse_row rows[planar_filter::kRows];
  planar_filter::update_options options;
  options.kept_from = kPoseStates;
  options.kept_to = g.soft && evidence_.doubtful() ? calibration_states_ : kPoseStates;
  for (int i = 0; i < count; i++) {
    rows[i] = r[i].row;
    options.added_noise[i] = r[i].noise * (g.noise_scale - 1.0);
    if (learns) options.source[i] = {r[i].source.kind, r[i].source.own * g.noise_scale};
  }
  if (!filter_.update(std::move(prepared), rows, options)) return WM_REJECTED_NUMERIC;
  filter_.noise().forget(filter_.now_ns());
  life_.fused(filter_.now_ns());
  return WM_FUSED;
}

// Fused after the bearing, with the innovation that this leaves (`before`: the row's states before). It has a gate of
// its own and is no evidence about the pose: a larger tilt than stated must not make the robot lost.
void landmark_ekf::fuse_elevation(residual bearing_then_own[2], const double *before, record_list records) {
  residual &r = bearing_then_own[1];
  for (int k = 0; k < r.row.count; k++) {
    const double moved = filter_.value(r.row.index[k]) - before[k];
    r.innovation -= r.row.by[k] * (r.row.index[k] == kHeading ? wrap(moved) : moved);
  }
  const double variance = filter_.variance_of(r.row) + r.noise;
  r.record.expected = r.record.observed - r.innovation;
  const gate_result g = gate(square(r.innovation) / variance, 1, {sightings().gate_soft, sightings().gate_hard});
  const bool fits = passes(g, 1) && bearing_then_own[0].record.verdict == WM_FUSED;
  wm_verdict verdict = fits ? WM_FUSED : WM_REJECTED_GATE;
  if (fits && (r.row.missing > 0 || !filter_.update(r.row, r.innovation, r.noise))) verdict = WM_REJECTED_NUMERIC;
  put_gate(g, 1, variance, verdict, &r.record);
  records.add(r.record);
}

}  // namespace wm
