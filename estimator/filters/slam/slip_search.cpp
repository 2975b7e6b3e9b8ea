// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/slip_search.hpp"

#include "math/arc.hpp"
#include "math/cholesky.hpp"

namespace wm {
namespace {

// Prior probability of B at a stamp, and of a sighting that is misread or of a landmark that moved. A misread or moved
// landmark lies anywhere in a half disc of 14 m. Prototyped on dlr-a; 1e-2 to 1e-4 decide the same there.
constexpr double kSlipPrior = 1e-3, kWrong = 0.05, kClutter_m2 = 314.0;
constexpr double kDecided = 3.0;  // nats of B against A, at two stamps
// Stamps so far apart at least, by the same turn: a turn that is obeyed late is over by then, or has another size.
constexpr double kLasting_s = 1.0, kSameTurn_rad = 0.15, kSigmas = 3.0;
constexpr double kSearchEvery_s = 0.2;
constexpr int kHeldAfter = 2;      // misfits without a majority of fits: one is misread more often than a wheel slips
constexpr double kDoubt_s = 10.0;  // after the last misfit the doubt ends
// The anchor lies in the middle of the way since the last fit. The sigma of its error is kAnchor_m, about the length of
// a robot, and a share of that way: 0.29 for a place anywhere on it, times the chord of 70 degrees.
constexpr double kAnchor_m = 0.3, kAnchorShare = 0.33;
constexpr double kTurnVariance = kPi * kPi / 3.0;  // of the missed turn: uniform
constexpr double kTried_rad = 0.2;                 // sigma of a turn by two places, which gathers the group
constexpr double kGroupChi2 = 13.8;                // 99.9 % of chi2 with two degrees of freedom
constexpr double kApart_m = 0.5;                   // two places nearer to each other give no turn
constexpr int kRounds = 3;                         // relinearisations; each squares the error
constexpr double kPoint_m = 0.03;                  // floor of a sighting's sigma: mounting, levelness; not swept

double cov(const joint_state &joint, const slip_rows &a, int k, const slip_rows &b, int l, const double missed[3]) {
  double sum = 0.0;
  for (int i = 0; i < 5; i++)
    for (int j = 0; j < 5; j++) sum += a.by[k][i] * b.by[l][j] * joint.covariance(a.index[i], b.index[j]);
  for (int i = 0; i < 3; i++) sum += a.by_missed[k][i] * missed[i] * b.by_missed[l][i];
  return sum;
}

// NIS of one sighting's two numbers; *determinant of their covariance.
double nis_of(const joint_state &joint, const slip_rows &r, const double missed[3], double *determinant) {
  const double xx = cov(joint, r, 0, r, 0, missed) + r.noise[0], yy = cov(joint, r, 1, r, 1, missed) + r.noise[1];
  const double xy = cov(joint, r, 0, r, 1, missed);
  *determinant = xx * yy - xy * xy;
  return (yy * square(r.innovation[0]) - 2.0 * xy * r.innovation[0] * r.innovation[1] + xx * square(r.innovation[1])) /
         *determinant;
}

// Where a sighting puts its landmark, in the odometry's frame.
void point_of(const observation &o, double out[2]) {
  const sin_cos ray = sincos(o.sensor.heading_rad + o.bearing_rad);
  out[0] = o.sensor.x_m + o.range_m * ray.cos;
  out[1] = o.sensor.y_m + o.range_m * ray.sin;
}

}  // namespace

void slip_search::fit(wm_time_ns now_ns, const travelled_pose2 &odometry) {
  fitted_ns_ = linked_ns_ = now_ns;
  linked_ = odometry;
  gaps_ = 0;
}

void slip_search::add_gap(const travelled_pose2 &odometry) {
  if (linked_ns_ == WM_TIME_NONE) linked_ = odometry;
  for (int i = 1; i < kGaps && gaps_ == kGaps; i++) gap_[i - 1] = gap_[i];
  if (gaps_ == kGaps) gaps_--;
  gap_[gaps_++] = {linked_ns_, linked_.pose, odometry.pose, odometry.travelled_m - linked_.travelled_m};
}

bool slip_search::links(wm_time_ns joined_ns, wm_time_ns now_ns, const travelled_pose2 &odometry) {
  if (fitted_ns_ == WM_TIME_NONE || joined_ns <= fitted_ns_) return true;
  if (doubted_ns_ != WM_TIME_NONE) return false;
  if (joined_ns > linked_ns_) add_gap(odometry);
  linked_ns_ = now_ns;
  linked_ = odometry;
  if (gaps_ == 0) fitted_ns_ = now_ns;
  return false;
}

void slip_search::add(const observation &seen, bool is_misfit, const travelled_pose2 &odometry) {
  const bool ended = misfit_ns_ != WM_TIME_NONE && wm_seconds_between(misfit_ns_, seen.t_ns) > kDoubt_s;
  if (ended && gaps_ > 0) gaps_--;  // the doubt's own
  if (ended) clear();
  if (doubted_ns_ == WM_TIME_NONE) {
    if (!is_misfit) return fit(seen.t_ns, odometry);
    doubted_ns_ = seen.t_ns;
    add_gap(odometry);
  }
  if (is_misfit) {
    misfit_ns_ = seen.t_ns;
    misfits_++;
  }
  int place = 0;
  while (place < count_ && sighting_[place].seen.key != seen.key) place++;
  if (place == count_ && count_ == kCapacity) {
    place = 0;
    for (int i = 1; i < kCapacity; i++)
      if (sighting_[i].seen.t_ns < sighting_[place].seen.t_ns) place = i;
  } else if (place == count_) {
    count_++;
  }
  sighting_[place] = {seen, is_misfit, -1};
  int misfits = 0;
  for (int i = 0; i < count_; i++) misfits += sighting_[i].is_misfit;
  if (2 * misfits > count_) return;
  clear();
  fit(seen.t_ns, odometry);
}

bool slip_search::doubts(wm_time_ns now_ns) const {
  return misfits_ >= kHeldAfter && wm_seconds_between(doubted_ns_, now_ns) <= kDoubt_s && log_odds_ > -kDecided;
}

bool slip_search::is_convincing(wm_time_ns now_ns) const {
  return log_odds_ > kDecided && misfit_ns_ != WM_TIME_NONE && wm_seconds_between(misfit_ns_, now_ns) <= kDoubt_s;
}

bool slip_search::is_due(wm_time_ns now_ns) const {
  int misfits = 0;
  for (int i = 0; i < count_; i++) misfits += sighting_[i].is_misfit;
  return misfits >= 2 && (judged_ns_ == WM_TIME_NONE || wm_seconds_between(judged_ns_, now_ns) >= kSearchEvery_s);
}

bool slip_search::decide(const slip_hypothesis &found, wm_time_ns now_ns) {
  judged_ns_ = now_ns;
  log_odds_ = found.log_odds;
  if (!(found.log_odds > kDecided)) return false;
  const double apart_rad = std::fabs(wrap(found.turn_rad - convinced_rad_));
  if (convinced_ns_ == WM_TIME_NONE || apart_rad > kSameTurn_rad + kSigmas * found.turn_sigma_rad) {
    convinced_ns_ = now_ns;
    convinced_rad_ = found.turn_rad;
  }
  return wm_seconds_between(convinced_ns_, now_ns) >= kLasting_s;
}

slip_rows slip_search::rows_of(const slip_sighting &s, const joint_state &joint, const wm_pose2 &pose,
                               const travelled_pose2 &odometry) {
  const observation &o = s.seen;
  const wm_pose2 from = compose(pose, between(odometry.pose, o.sensor));
  const sin_cos ray = sincos(from.heading_rad + o.bearing_rad);
  const double at[2] = {from.x_m + o.range_m * ray.cos, from.y_m + o.range_m * ray.sin};
  const double arm[2] = {at[0] - pose.x_m, at[1] - pose.y_m};
  // The odometry's error since then.
  const double moved = square(kTravelSigma * (odometry.travelled_m - o.travelled_m));
  const double turned = square(kTurnSigma * (odometry.turned_rad - o.turned_rad)) * (square(arm[0]) + square(arm[1]));
  const double drift = moved + turned + square(kPoint_m);
  slip_rows out{};
  const int index[5] = {kX, kY, kHeading, s.state, s.state + 1};
  for (int i = 0; i < 5; i++) out.index[i] = index[i];
  for (int k = 0; k < 2; k++) {
    const double a[2] = {k == 0 ? ray.cos : -ray.sin, k == 0 ? ray.sin : ray.cos};
    const double by[5] = {-a[0], -a[1], a[0] * arm[1] - a[1] * arm[0], a[0], a[1]};
    for (int i = 0; i < 5; i++) out.by[k][i] = by[i];
    out.innovation[k] = a[0] * (at[0] - joint.value(s.state)) + a[1] * (at[1] - joint.value(s.state + 1));
    out.noise[k] = square(k == 0 ? o.sigma_length_m : o.range_m * o.sigma_angle_rad) + drift;
  }
  return out;
}

slip_search::frame slip_search::anchor_of(const gap &g, const joint_state &joint, const travelled_pose2 &odometry) {
  const wm_pose2 middle = {0.5 * (g.from.x_m + g.to.x_m), 0.5 * (g.from.y_m + g.to.y_m), 0.0};
  const wm_pose2 map = compose(joint.pose(), between(odometry.pose, middle));
  return {{middle.x_m, middle.y_m}, {map.x_m, map.y_m}, square(kAnchor_m) + square(kAnchorShare * g.way_m)};
}

// The rows of all sightings after that turn about the anchor. The covariance of a pose that has moved by d is T P T'
// with T = I + J d h' in the invariant filter (joint_state.hpp), which the rows take instead of P.
void slip_search::place(const joint_state &joint, const travelled_pose2 &odometry, const frame &anchor, bool invariant,
                        trial *out) const {
  const sin_cos turn = sincos(out->turn_rad);
  const wm_pose2 origin = {anchor.map_m[0] - turn.cos * anchor.odom_m[0] + turn.sin * anchor.odom_m[1],
                           anchor.map_m[1] - turn.sin * anchor.odom_m[0] - turn.cos * anchor.odom_m[1], out->turn_rad};
  out->pose = compose(origin, odometry.pose);
  const wm_pose2 present = joint.pose();
  const double e[2] = {present.y_m - out->pose.y_m, out->pose.x_m - present.x_m};
  const double arm[2] = {anchor.map_m[1] - out->pose.y_m, out->pose.x_m - anchor.map_m[0]};  // J (pose - anchor)
  for (int i = 0; i < count_; i++) {
    slip_rows &r = out->rows[i] = rows_of(sighting_[i], joint, out->pose, odometry);
    for (int k = 0; k < 2; k++) {
      r.by_missed[k][0] = r.by[k][0];
      r.by_missed[k][1] = r.by[k][1];
      r.by_missed[k][2] = r.by[k][2] + r.by[k][0] * arm[0] + r.by[k][1] * arm[1];
      if (invariant) r.by[k][2] += r.by[k][0] * e[0] + r.by[k][1] * e[1];
    }
  }
}

void slip_search::gather(const joint_state &joint, const frame &anchor, trial *out) const {
  const double missed[3] = {anchor.variance_m2, anchor.variance_m2, square(kTried_rad)};
  out->group = 0;
  out->members = 0;
  out->chi2 = 0.0;
  for (int i = 0; i < count_; i++) {
    double determinant;
    const double nis = nis_of(joint, out->rows[i], missed, &determinant);
    if (!(determinant > 0.0) || !(nis < kGroupChi2)) continue;
    out->group |= 1u << i;
    out->members++;
    out->chi2 += nis;
  }
}

// Of the group's innovations, normal with their joint covariance. *turn_rad, *variance: by how much the turn fits
// better, and its variance then.
double slip_search::log_density(const joint_state &joint, const frame &anchor, const trial &t, double *turn_rad,
                                double *variance) const {
  static constexpr int kRows = 2 * kCapacity;
  const double missed[3] = {anchor.variance_m2, anchor.variance_m2, kTurnVariance};
  double s[kRows][kRows], v[kRows], by_heading[kRows];
  int of[kRows], part[kRows], n = 0;
  for (int i = 0; i < count_; i++)
    for (int k = 0; k < 2 && (t.group >> i & 1u); k++) {
      of[n] = i;
      part[n++] = k;
    }
  for (int a = 0; a < n; a++) {
    const slip_rows &r = t.rows[of[a]];
    for (int b = 0; b <= a; b++) s[a][b] = cov(joint, r, part[a], t.rows[of[b]], part[b], missed);
    s[a][a] += r.noise[part[a]];
    v[a] = r.innovation[part[a]];
    by_heading[a] = r.by_missed[part[a]][2] * kTurnVariance;
    for (int i = 0; i < 5; i++) by_heading[a] += r.by[part[a]][i] * joint.covariance(kHeading, r.index[i]);
  }
  if (n == 0 || !factorize(n, s[0], kRows)) return -1e9;
  substitute_forward(n, s[0], kRows, v);
  double sum = 0.0;
  for (int a = 0; a < n; a++) sum += square(v[a]) + 2.0 * log(s[a][a]) + log(kTwoPi);
  substitute_backward(n, s[0], kRows, v);
  *turn_rad = 0.0;
  for (int a = 0; a < n; a++) *turn_rad += by_heading[a] * v[a];
  substitute_forward(n, s[0], kRows, by_heading);
  *variance = kTurnVariance + joint.variance(kHeading);
  for (int a = 0; a < n; a++) *variance -= square(by_heading[a]);
  return -0.5 * sum;
}

double slip_search::log_likelihood_as_expected(const joint_state &joint, const travelled_pose2 &odometry) const {
  const double none[3] = {};
  double sum = 0.0;
  for (int i = 0; i < count_; i++) {
    double determinant;
    const double nis = nis_of(joint, rows_of(sighting_[i], joint, joint.pose(), odometry), none, &determinant);
    const double density = determinant > 0.0 ? exp(-0.5 * nis) / (kTwoPi * std::sqrt(determinant)) : 0.0;
    sum += log((1.0 - kWrong) * density + kWrong / kClutter_m2);
  }
  return sum;
}

// The gap in which the odometry missed a turn is unknown: each one is tried.
slip_hypothesis slip_search::search(const joint_state &joint, const travelled_pose2 &odometry, bool invariant) const {
  slip_hypothesis best{};
  best.log_odds = -1e9;
  for (int i = 0; i < gaps_; i++) {
    const slip_hypothesis found = search_after(gap_[i], joint, odometry, invariant);
    if (found.log_odds > best.log_odds) best = found;
  }
  return best;
}

// By two places: landmarks i and j, or landmark i and the anchor for j < 0. False: too near to each other.
bool slip_search::turn_by(const joint_state &joint, const frame &anchor, int i, int j, double *turn_rad) const {
  double seen[2], other[2] = {anchor.odom_m[0], anchor.odom_m[1]};
  double map[2] = {anchor.map_m[0], anchor.map_m[1]};
  point_of(sighting_[i].seen, seen);
  if (j >= 0) point_of(sighting_[j].seen, other);
  for (int k = 0; k < 2 && j >= 0; k++) map[k] = joint.value(sighting_[j].state + k);
  const double x = seen[0] - other[0], y = seen[1] - other[1];
  const double to_x = joint.value(sighting_[i].state) - map[0], to_y = joint.value(sighting_[i].state + 1) - map[1];
  *turn_rad = wrap(atan2(to_y, to_x) - atan2(y, x));
  return x * x + y * y > square(kApart_m) && to_x * to_x + to_y * to_y > square(kApart_m);
}

slip_hypothesis slip_search::search_after(const gap &g, const joint_state &joint, const travelled_pose2 &odometry,
                                          bool invariant) const {
  slip_hypothesis out{};
  out.log_odds = -1e9;
  const frame anchor = anchor_of(g, joint, odometry);
  trial best, t;
  for (int i = 0; i < count_; i++)
    for (int j = -1; j < i; j++) {
      if (!turn_by(joint, anchor, i, j, &t.turn_rad)) continue;
      place(joint, odometry, anchor, invariant, &t);
      gather(joint, anchor, &t);
      if (t.members > best.members || (t.members == best.members && t.chi2 < best.chi2)) best = t;
    }
  if (best.members < 2) return out;
  double by_rad, variance;
  for (int round = 0; round < kRounds; round++) {
    (void)log_density(joint, anchor, best, &by_rad, &variance);
    best.turn_rad = wrap(best.turn_rad + by_rad);
    place(joint, odometry, anchor, invariant, &best);
  }
  const double log_of_group = log_density(joint, anchor, best, &by_rad, &variance);
  out.log_odds = log(kSlipPrior) + log_of_group + (count_ - best.members) * log(kWrong / kClutter_m2) -
                 log_likelihood_as_expected(joint, odometry);
  out.turn_rad = best.turn_rad;
  out.turn_sigma_rad = std::sqrt(larger(variance, 0.0));
  out.since_ns = g.from_ns;
  out.pose = best.pose;
  out.group = best.group;
  const double arm[2] = {anchor.map_m[1] - best.pose.y_m, best.pose.x_m - anchor.map_m[0]};
  const double by[3][3] = {{1, 0, arm[0]}, {0, 1, arm[1]}, {0, 0, 1}};
  const double missed[3] = {anchor.variance_m2, anchor.variance_m2, kTurnVariance};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) out.missed[i][j] += by[i][k] * missed[k] * by[j][k];
  return out;
}

}  // namespace wm
