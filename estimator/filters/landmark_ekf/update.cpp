// SPDX-License-Identifier: Apache-2.0
// From the rows of an observation to its gate, its update and its records.
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

// The components of one observation are gated jointly: if one is wrong, so is the other. Then they are fused one after
// the other [Stepanov2017], the second with the innovation that the first leaves, which equals a joint update.
double landmark_ekf::fuse(residual *r, int count, double clutter_volume, bool usable, record_list records) {
  projection first;
  filter_.project(r[0].row, &first);
  const double s00 = first.variance + r[0].noise;
  double nis = square(r[0].innovation) / s00, cross = 0.0, determinant = s00, s11 = 0.0;
  if (count == 2) {
    projection second;
    filter_.project(r[1].row, &second);
    cross = filter_.project_onto(r[1].row, first);
    s11 = second.variance + r[1].noise;
    determinant = s00 * s11 - cross * cross;
    nis = (s11 * square(r[0].innovation) - 2.0 * cross * r[0].innovation * r[1].innovation +
           s00 * square(r[1].innovation)) /
          determinant;
  }
  const double density = exp(-0.5 * nis) / std::sqrt((count == 2 ? square(kTwoPi) : kTwoPi) * determinant);
  const double log_bayes = landmark_evidence::log_bayes_factor(density, clutter_volume);
  const gate_result g = gate(nis, count, {sightings().gate_soft, sightings().gate_hard});
  const wm_time_ns now = filter_.now_ns();
  if (g.soft && evidence_.doubtful() &&
      (inflated_ns_ == WM_TIME_NONE || wm_seconds_between(inflated_ns_, now) > kScaleEvery_s)) {
    // After several misfits the pose's covariance is too small, not this measurement's alone.
    inflated_ns_ = now;
    filter_.scale_pose_sigmas(kScaleSigmas);
    filter_.project(r[0].row, &first);
  }
  wm_verdict verdict = usable && passes(g, count) ? WM_FUSED : WM_REJECTED_GATE;
  if (verdict == WM_FUSED) verdict = update(r, count, g, &first);
  for (int i = 0; i < count; i++) {
    put_gate(g, count, i == 0 ? s00 : s11, verdict, &r[i].record);
    records.add(r[i].record);
  }
  return verdict == WM_FUSED || (usable && g.passed) ? log_bayes : landmark_evidence::max_log_bayes_factor();
}

// Between the two gates the noise is inflated. While several observations misfit, the pose may move, but calibration
// states are considered, not corrected [Schmidt1966].
wm_verdict landmark_ekf::update(const residual *r, int count, const gate_result &g, projection *first) {
  if (r[0].row.missing > 0 || (count == 2 && r[1].row.missing > 0)) return WM_REJECTED_NUMERIC;
  const int kept = g.soft && evidence_.doubtful() ? calibration_states_ : kPoseStates;
  const double noise = r[0].noise * g.noise_scale;
  const double left =
      count < 2 ? 0.0
                : filter_.innovation_left(r[1].row, r[1].innovation, *first, r[0].innovation, noise, kPoseStates, kept);
  const bool learns = evidence_.proven() && !evidence_.doubtful();
  const auto source = [&](const residual &of) {
    return learns ? noise_adaption::source{of.source.kind, of.source.own * g.noise_scale} : noise_adaption::source{};
  };
  if (!filter_.update(*first, r[0].innovation, noise, kPoseStates, kept, source(r[0]))) return WM_REJECTED_NUMERIC;
  if (count == 2) {
    filter_.project(r[1].row, first);
    if (!filter_.update(*first, left, r[1].noise * g.noise_scale, kPoseStates, kept, source(r[1])))
      return WM_REJECTED_NUMERIC;
  }
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
  projection own;
  filter_.project(r.row, &own);
  const double variance = own.variance + r.noise;
  r.record.expected = r.record.observed - r.innovation;
  const gate_result g = gate(square(r.innovation) / variance, 1, {sightings().gate_soft, sightings().gate_hard});
  const bool fits = passes(g, 1) && bearing_then_own[0].record.verdict == WM_FUSED;
  wm_verdict verdict = fits ? WM_FUSED : WM_REJECTED_GATE;
  if (fits && (r.row.missing > 0 || !filter_.update(own, r.innovation, r.noise))) verdict = WM_REJECTED_NUMERIC;
  put_gate(g, 1, variance, verdict, &r.record);
  records.add(r.record);
}

}  // namespace wm
