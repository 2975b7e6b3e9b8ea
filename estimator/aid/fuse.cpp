// SPDX-License-Identifier: Apache-2.0
#include "aid/fuse.hpp"

#include <utility>

#include "filters/core/landmark_evidence.hpp"

namespace wm {
namespace {

constexpr double kUnproven_nis = 9.21;  // 99 % quantile of chi2, 2 degrees of freedom
constexpr double kScaleSigmas = 1.5;    // of the pose while several observations misfit; not swept

bool passes(const gate_result &g, int dof, const fuse_policy &policy) {
  return g.passed && (!policy.unproven || g.nis <= kUnproven_nis * gate_scale(dof));
}

innovation prepare(planar_filter *filter, const residual *r, int count) {
  sparse_row rows[planar_filter::kRows];
  double innovations[planar_filter::kRows], noise[planar_filter::kRows];
  for (int i = 0; i < count; i++) {
    rows[i] = r[i].row;
    innovations[i] = r[i].innovation;
    noise[i] = r[i].noise;
  }
  return filter->prepare(rows, innovations, noise, count);
}

// Observations of the pose itself and of landmarks; another localizer may be wrong as well as the wheels.
bool wheels_lie(planar_filter *filter, const residual *r, const innovation &prepared) {
  if (r->source.kind == noise_adaption::kNone || !(prepared.determinant > 0.0)) return false;
  noise_adaption::row rows[planar_filter::kRows];
  for (int k = 0; k < prepared.rows; k++) {
    rows[k] = {{}, {}, prepared.value[k], prepared.s[k][k], r[k].noise, r[k].source.kind, k};
    filter->put_adapted(r[k].row, rows[k].by);
  }
  return filter->weigh_wheels(rows, prepared.rows);
}

wm_verdict update(planar_filter *filter, innovation &&prepared, const residual *r, const gate_result &g,
                  const fuse_policy &policy) {
  const int count = prepared.rows;
  sparse_row rows[planar_filter::kRows];
  planar_filter::update_options options;
  const bool waits = r->is_position && filter->noise().waits(filter->variance(kHeading), filter->now_ns());
  options.turns_errors = r->is_position;
  options.kept_from = kPoseStates;
  options.kept_to = policy.holds || (g.soft && policy.doubtful) ? policy.held_to : kPoseStates;
  for (int i = 0; i < count; i++) {
    rows[i] = r[i].row;
    options.added_noise[i] = r[i].noise * (g.noise_scale - 1.0);
    if (policy.learns && !waits) options.source[i] = {r[i].source.kind, r[i].source.own * g.noise_scale};
  }
  if (!filter->update(std::move(prepared), rows, options)) return WM_REJECTED_NUMERIC;
  filter->noise().pass(filter->now_ns());
  return WM_FUSED;
}

}  // namespace

fuse_result fuse(planar_filter *filter, residual *r, int count, double clutter_volume, const fuse_policy &policy,
                 record_list records) {
  innovation prepared = prepare(filter, r, count);
  if (policy.usable && wheels_lie(filter, r, prepared)) prepared = prepare(filter, r, count);
  double variance[planar_filter::kRows];
  for (int i = 0; i < count; i++) variance[i] = prepared.s[i][i];
  const double log_bayes = landmark_evidence::log_bayes_factor(prepared.density(), clutter_volume);
  const gate_result g = gate(prepared.nis, count, policy.gates);
  fuse_result out{WM_REJECTED_GATE, log_bayes, g.soft && policy.doubtful && policy.widens};
  if (out.widened) {
    // After several misfits the pose's covariance is too small, not this measurement's alone.
    filter->scale_pose_sigmas(kScaleSigmas);
    prepared = prepare(filter, r, count);
  }
  if (policy.usable && passes(g, count, policy)) out.verdict = WM_FUSED;
  if (!(prepared.determinant > 0.0)) out.verdict = WM_REJECTED_NUMERIC;
  if (out.verdict == WM_FUSED) out.verdict = update(filter, std::move(prepared), r, g, policy);
  for (int i = 0; i < count; i++) {
    put_gate(g, count, variance[i], out.verdict, &r[i].record);
    records.add(r[i].record);
  }
  if (out.verdict != WM_FUSED && !(policy.usable && g.passed))
    out.log_bayes = landmark_evidence::max_log_bayes_factor();
  return out;
}

later_row::later_row(const planar_filter &filter, residual *row) : row_(row) {
  for (int k = 0; k < row->row.count; k++) before_[k] = filter.value(row->row.index[k]);
}

wm_verdict later_row::fuse(planar_filter *filter, const fuse_policy &policy, bool others_fused, record_list records) {
  residual &r = *row_;
  for (int k = 0; k < r.row.count; k++) {
    const double moved = filter->value(r.row.index[k]) - before_[k];
    r.innovation -= r.row.by[k] * (r.row.index[k] == kHeading ? wrap(moved) : moved);
  }
  const double variance = filter->variance_of(r.row) + r.noise;
  r.record.expected = r.record.observed - r.innovation;
  const gate_result g = gate(square(r.innovation) / variance, 1, policy.gates);
  const bool fits = passes(g, 1, policy) && others_fused;
  wm_verdict verdict = fits ? WM_FUSED : WM_REJECTED_GATE;
  if (fits && (r.row.missing > 0 || !filter->update(r.row, r.innovation, r.noise))) verdict = WM_REJECTED_NUMERIC;
  put_gate(g, 1, variance, verdict, &r.record);
  records.add(r.record);
  return verdict;
}

}  // namespace wm
