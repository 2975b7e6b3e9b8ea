// SPDX-License-Identifier: Apache-2.0
// How a scan moves the filter: aligned with the map's lines from the prediction on, together with what the camera may
// be off by, and taken in as one measurement.
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr int kRounds = 4, kCoarseRounds = 2;
constexpr double kStartStep_m = 0.12, kStartSigmas = 2.5;
constexpr int kStartsMax = 6;  // on each side
constexpr double kDoubtOdds = -1.5;
constexpr double kLeastExplained = 0.4;
constexpr double kSureHeading_rad = 0.08;
constexpr double kSameEnd_m = 0.1, kSameEnd_rad = 0.05, kLeastChance = 0.01;
constexpr double kOpenSigmas = 2.5;                     // that a point is looked for off its place
constexpr double kErrsAnew_m = 0.1, kErrsAnew_s = 5.0;  // from one scan to the next that errs by itself

}  // namespace

edge_mcl::alignment edge_mcl::alignment_of(int camera) const {
  alignment a{};
  a.camera = camera;
  for (int k = 0; k < kAlignStates; k++) a.state[k] = -1;
  for (int k = 0; k < kPoseStates; k++) a.state[k] = k;
  if (camera >= 0)
    for (int k = 0; k <= kCameraErrors; k++) a.state[kAlignCamera + k] = camera_state_[camera][k];
  a.state[kAlignEdge] = edge_state_;
  for (int k = 0; k < kAlignStates; k++)
    if (a.state[k] >= 0) a.value[k] = filter_.value(a.state[k]);
  return a;
}

edge_mcl::taken_from edge_mcl::look_back(const alignment &a) const {
  const wm_time_ns now = filter_.now_ns(), age = wm_ns_from_seconds(a.value[kAlignTime]);
  taken_from t{};
  motion_twist twist{};
  const wm_pose2 way = age >= 0 ? filter_.path(now - age, now, &twist) : filter_.path(now, now - age, &twist);
  t.from_now = age >= 0 ? between(way, wm_pose2{}) : way;
  t.pose = compose({a.value[kAlignX], a.value[kAlignY], a.value[kAlignHeading]}, t.from_now);
  t.v_mps = twist.v;
  t.w_radps = twist.w;
  return t;
}

bool edge_mcl::belief_of(int camera, belief *out) const {
  out->mean = alignment_of(camera);
  out->n = 0;
  for (int k = 0; k < kAlignStates; k++)
    if (out->mean.state[k] >= 0) out->index[out->n++] = k;
  double covariance[kAlignStates][kAlignStates], root[kAlignStates][kAlignStates];
  for (int r = 0; r < out->n; r++)
    for (int c = 0; c < out->n; c++)
      covariance[r][c] = filter_.covariance(out->mean.state[out->index[r]], out->mean.state[out->index[c]]);
  if (!invert_positive(covariance, out->n, out->inverse) || !factor_positive(covariance, out->n, root)) return false;
  for (int r = 0; r < kAlignStates; r++)
    for (int c = 0; c < kAlignStates; c++) out->root[r][c] = 0.0;
  for (int r = 0; r < out->n; r++)
    for (int c = 0; c <= r; c++) out->root[out->index[r]][c] = root[r][c];
  return true;
}

void edge_mcl::accumulate(const wm_points &points, const alignment &a, double gate_m, const belief *prior,
                          normal_equations *out) const {
  *out = normal_equations{};
  const taken_from then = look_back(a);
  const sin_cos h = sincos(then.pose.heading_rad);
  const double seen_from[2] = {a.camera >= 0 ? camera_[a.camera].x_m : 0.0,
                               a.camera >= 0 ? camera_[a.camera].y_m : 0.0};
  const double eye_x = then.pose.x_m + h.cos * seen_from[0] - h.sin * seen_from[1];
  const double eye_y = then.pose.y_m + h.sin * seen_from[0] + h.cos * seen_from[1];
  const double cos_gate = cos(params_.normal_gate_rad);
  const double together = params_.correlated / fresh_;
  for (uint32_t i = 0; i < points.count; i++) {
    floor_point p{(double)points.x_m[i], (double)points.y_m[i], {}, {}};
    if (a.camera >= 0) {
      if (camera_[a.camera].range(p.x, p.y) > params_.range_max_m) continue;
      if (!camera_[a.camera].correct(p.x, p.y, a.value + kAlignCamera, &p)) continue;
    }
    const double rx = h.cos * p.x - h.sin * p.y, ry = h.sin * p.x + h.cos * p.y;  // from base_link then, in map axes
    const double x = then.pose.x_m + rx, y = then.pose.y_m + ry;
    const bool lined = on_a_line(points, i);
    out->seen += lined;
    edge_line line = map_.nearest(x, y);
    const double own2 = square(point_sigma(points, i, a.camera)) + square(params_.point_sigma_m);
    double sigma2 = own2;
    if (a.camera >= 0) sigma2 += square(camera_[a.camera].sigma(camera_[a.camera].range(p.x, p.y), params_.common_px));
    const double none = 2.5 * log(1.0 + square(params_.gate_m) / (4.0 * sigma2)) / together;
    out->cost += none;
    const auto take_unexplained = [&] {
      if (prior || !lined) return;
      if (through_an_edge(map_, x, y, x - eye_x, y - eye_y))
        out->through++;
      else
        out->before += before_an_edge(map_, x, y, x - eye_x, y - eye_y);
    };
    if (!line.found || (!prior && line.distance_m > gate_m)) {
      take_unexplained();
      continue;
    }
    // What is seen of an edge is the floor on this side of it: its normal points away.
    if (line.normal_x * (x - eye_x) + line.normal_y * (y - eye_y) < 0.0) {
      line.normal_x = -line.normal_x;
      line.normal_y = -line.normal_y;
      line.offset_m = -line.offset_m;
    }
    if (finite((double)points.normal_rad[i])) {
      const sin_cos n = sincos((double)points.normal_rad[i] + then.pose.heading_rad);
      if (n.cos * line.normal_x + n.sin * line.normal_y < cos_gate) {
        take_unexplained();
        continue;
      }
    }
    const double residual = line.offset_m - (edge_state_ >= 0 ? a.value[kAlignEdge] : 0.0);
    const double misfit = residual * residual / sigma2;
    const double cost = 2.5 * log(1.0 + 0.25 * misfit) / together;
    if (cost < none) out->cost += cost - none;
    if (line.distance_m >= 0.06 && residual * residual >= 9.0 * own2) {
      take_unexplained();
    } else if (!prior) {
      out->explained++;
      out->seen += !lined;
    }

    double row[kAlignStates] = {};
    row[kAlignX] = line.normal_x;
    row[kAlignY] = line.normal_y;
    row[kAlignHeading] = line.normal_y * (x - a.value[kAlignX]) - line.normal_x * (y - a.value[kAlignY]);
    for (int k = 0; k < kCameraErrors; k++)
      row[kAlignCamera + k] = line.normal_x * (h.cos * p.x_by[k] - h.sin * p.y_by[k]) +
                              line.normal_y * (h.sin * p.x_by[k] + h.cos * p.y_by[k]);
    row[kAlignTime] = -(line.normal_x * (then.v_mps * h.cos - then.w_radps * ry) +
                        line.normal_y * (then.v_mps * h.sin + then.w_radps * rx));
    row[kAlignEdge] = 1.0;
    double open2 = 0.0;
    for (int c = 0; prior && c < prior->n; c++) {
      double sum = 0.0;
      for (int r = 0; r < kAlignStates; r++) sum += row[r] * prior->root[r][c];
      open2 += sum * sum;
    }
    if (prior && square(line.distance_m) > square(gate_m) + square(kOpenSigmas) * open2) continue;
    // Student's distribution with 4 degrees of freedom: what doesn't fit has little to say.
    const double weight = 5.0 / (4.0 + residual * residual / (sigma2 + open2)) / ((sigma2 + open2) * together);
    for (int r = 0; r < kAlignStates; r++) {
      if (a.state[r] < 0) continue;
      out->gradient[r] += weight * row[r] * residual;
      for (int c = 0; c < kAlignStates; c++)
        if (a.state[c] >= 0) out->information[r][c] += weight * row[r] * row[c];
    }
  }
}

// Gauss-Newton from a.value on; the cost of prediction and scan together where it ends, equations there.
double edge_mcl::descend(const wm_points &points, const belief &prior, double slack_m, alignment *a,
                         normal_equations *e) const {
  const int *index = prior.index, n = prior.n;
  const auto off = [&](int k) {
    const double d = prior.mean.value[index[k]] - a->value[index[k]];
    return index[k] == kAlignHeading ? wrap(d) : d;
  };
  for (int round = 0; round < kRounds; round++) {
    // From as far as pose and camera may be off down to the gate.
    const bool coarse = round < kCoarseRounds;
    const double gate = params_.gate_m + (coarse ? slack_m : 0.0);
    accumulate(points, *a, gate > 0.5 ? 0.5 : gate, coarse ? &prior : nullptr, e);
    if (round + 1 == kRounds) break;
    double total[kAlignStates][kAlignStates], right[kAlignStates], step[kAlignStates];
    for (int r = 0; r < n; r++) {
      right[r] = e->gradient[index[r]];
      for (int c = 0; c < n; c++) {
        total[r][c] = prior.inverse[r][c] + e->information[index[r]][index[c]];
        right[r] += prior.inverse[r][c] * off(c);
      }
    }
    if (!solve_positive(total, right, n, step)) break;
    for (int r = 0; r < n; r++) a->value[index[r]] += step[r];
    a->value[kAlignHeading] = wrap(a->value[kAlignHeading]);
  }
  double cost = e->cost;
  for (int r = 0; r < n; r++)
    for (int c = 0; c < n; c++) cost += 0.5 * off(r) * prior.inverse[r][c] * off(c);
  return cost;
}

// Ends that lie together are one.
void edge_mcl::ends::take(const alignment &a, double its_cost, const normal_equations &e) {
  const auto same = [&a](const alignment &b) {
    return square(a.value[kAlignX] - b.value[kAlignX]) + square(a.value[kAlignY] - b.value[kAlignY]) <
               square(kSameEnd_m) &&
           std::fabs(wrap(a.value[kAlignHeading] - b.value[kAlignHeading])) < kSameEnd_rad;
  };
  int i = 0;
  while (i < count && !same(at[i])) i++;
  if (i == kMost || (i < count && its_cost >= cost[i])) return;
  if (i == count) count++;
  if (its_cost < cost[0] || i == 0) {
    at[i] = at[0];
    cost[i] = cost[0];
    i = 0;
    best = e;
  }
  at[i] = a;
  cost[i] = its_cost;
}

// A scan has several places where it fits nearly (doors, pillars). Where the prediction is sure it says which; along an
// axis that it isn't sure of, every step of half a door's depth is a start, and the least cost leads.
void edge_mcl::descend_from_several(const wm_points &points, const belief &prior, ends *out) const {
  const double xx = filter_.variance(kX), yy = filter_.variance(kY), xy = filter_.covariance(kX, kY);
  const double half = 0.5 * (xx + yy), spread = std::sqrt(square(0.5 * (xx - yy)) + square(xy));
  const double sigma = std::sqrt(half + spread), angle = 0.5 * atan2(2.0 * xy, xx - yy);
  const sin_cos axis = sincos(angle);
  double step = kStartStep_m;
  int sides = (int)(kStartSigmas * sigma / step);
  if (sides > kStartsMax) {
    sides = kStartsMax;
    step = kStartSigmas * sigma / sides;
  }
  const double slack = sides > 0 ? step : 3.0 * std::sqrt(half + spread + 9.0 * filter_.variance(kHeading));
  // Nor is a heading found that is off by more than a few degrees.
  const double turn = std::sqrt(filter_.variance(kHeading));
  const bool placed = state_ == WM_STATE_TRACKING || on_trial_;
  const int turns = placed && turn > kSureHeading_rad ? 1 : 0;
  if (state_ == WM_STATE_SEARCHING && !placed) sides = 0;  // about a place that is none there is nothing to be found
  out->count = 0;
  for (int k = -sides; k <= sides; k++)
    for (int m = -turns; m <= turns; m++) {
      // The prediction's mean, given that it is k steps along the axis, and turned.
      alignment a = prior.mean;
      for (int i = 0; i < prior.n; i++) {
        const int state = a.state[prior.index[i]];
        const double shared = axis.cos * filter_.covariance(state, kX) + axis.sin * filter_.covariance(state, kY);
        a.value[prior.index[i]] += k * step * shared / square(sigma);
      }
      a.value[kAlignHeading] = wrap(a.value[kAlignHeading] + m * turn);
      normal_equations e;
      const double cost = descend(points, prior, slack, &a, &e);
      out->take(a, cost, e);
    }
}

// How far every state is off, and with what probability, if the robot isn't where the scan fits best but at another
// end.
void edge_mcl::allow_for(const ends &found, const belief &prior, double off[ends::kMost][kMaxStates],
                         double *chance) const {
  double total = 0.0;
  for (int k = 0; k < found.count; k++) total += chance[k] = exp(found.cost[0] - found.cost[k]);
  for (int k = 0; k < found.count; k++) {
    chance[k] /= total;
    double scaled[kAlignStates] = {};  // P^-1 (end - best)
    for (int c = 0; c < prior.n; c++) {
      const int which = prior.index[c];
      double way = found.at[k].value[which] - found.at[0].value[which];
      if (which == kAlignHeading) way = wrap(way);
      for (int r = 0; r < prior.n; r++) scaled[r] += prior.inverse[r][c] * way;
    }
    for (int i = 0; i < filter_.states(); i++) {
      off[k][i] = 0.0;
      for (int r = 0; r < prior.n; r++)
        off[k][i] += filter_.covariance(i, prior.mean.state[prior.index[r]]) * scaled[r];
    }
  }
}

// What the scan says of the place along the axis of the map that it knows better, with what it says of the rest from
// there: one distance, in a corridor that to its walls.
void edge_mcl::describe(const normal_equations &scan, const belief &prior, const alignment &a,
                        wm_innovation *record) const {
  const int *index = prior.index, n = prior.n;
  const int best = scan.information[kAlignX][kAlignX] > scan.information[kAlignY][kAlignY] ? kAlignX : kAlignY;
  const double known = scan.information[best][best];
  if (!(known > 0.0)) return;
  const double aslant = scan.information[kAlignX][kAlignY] / known, length = std::sqrt(1.0 + aslant * aslant);
  double innovation = scan.gradient[best] / known;
  planar_row row;
  for (int i = 0; i < n; i++) {
    const int state = a.state[index[i]];
    double off = a.value[index[i]] - filter_.value(state);
    if (index[i] == kAlignHeading) off = wrap(off);
    const double share = scan.information[best][index[i]] / known;
    row.add(state, share);
    innovation += share * off;
  }
  projection projected;
  filter_.project(row, &projected);
  record->observed = innovation / length;
  record->variance = (projected.variance + 1.0 / known) / square(length);
  record->nis = square(record->observed) / record->variance;
  record->gate_dof = 1;
}

// Iterated: minimises the prediction's and the scan's misfit together, then takes in what the scan says there as scalar
// measurements, one for each row of the information's factor. Source: the iterated extended Kalman filter (B. M. Bell,
// F. W. Cathey, "The iterated Kalman filter update as a Gauss-Newton method", 1993), in information form.
bool edge_mcl::align(const wm_points &points, int camera, normal_equations *scan, wm_innovation *record) {
  // What looks like an edge and is none, and by what each edge is seen off, are the same from the same place.
  const int by = camera >= 0 ? camera : kCamerasMax;
  const double way = filter_.travelled_m() + filter_.turned_rad();
  fresh_ = aligned_ns_[by] == WM_TIME_NONE ? 1.0
                                           : (way - aligned_m_[by]) / kErrsAnew_m +
                                                 wm_seconds_between(aligned_ns_[by], filter_.now_ns()) / kErrsAnew_s;
  if (fresh_ > 1.0) fresh_ = 1.0;
  belief prior;
  if (!belief_of(camera, &prior)) return false;
  const int *index = prior.index, n = prior.n;
  ends found;
  descend_from_several(points, prior, &found);
  const alignment &a = found.at[0];
  const normal_equations &e = *scan = found.best;
  record->verdict = e.explained < 5 ? (uint8_t)WM_REJECTED_SINGULAR : (uint8_t)WM_FUSED;
  if (e.explained < 5) return false;
  describe(e, prior, a, record);
  // Lost: of what the map doesn't explain a few points happen to lie near its edges. They would drag the pose there,
  // which odometry carries on meanwhile as one of the places that are possible.
  if (state_ != WM_STATE_TRACKING && e.explained < kLeastExplained * e.seen) {
    record->verdict = (uint8_t)WM_REJECTED_GATE;
    return false;
  }

  aligned_m_[by] = way;
  aligned_ns_[by] = filter_.now_ns();

  double elsewhere[ends::kMost][kMaxStates], chance[ends::kMost];
  allow_for(found, prior, elsewhere, chance);
  // information = L D L'; the rows of L' measure what the scan knows, with variances 1/D.
  double lower[kAlignStates][kAlignStates] = {}, d[kAlignStates];
  for (int i = 0; i < n; i++) {
    d[i] = e.information[index[i]][index[i]];
    for (int k = 0; k < i; k++) d[i] -= lower[i][k] * lower[i][k] * d[k];
    if (!(d[i] > 1e-9 * e.information[index[i]][index[i]])) d[i] = 0.0;
    lower[i][i] = 1.0;
    for (int j = i + 1; j < n; j++) {
      double sum = e.information[index[j]][index[i]];
      for (int k = 0; k < i; k++) sum -= lower[j][k] * lower[i][k] * d[k];
      lower[j][i] = d[i] > 0.0 ? sum / d[i] : 0.0;
    }
  }
  double forward[kAlignStates];  // L^-1 gradient
  for (int i = 0; i < n; i++) {
    forward[i] = e.gradient[index[i]];
    for (int k = 0; k < i; k++) forward[i] -= lower[i][k] * forward[k];
  }
  // In doubt of the pose a scan teaches nothing of sensors and camera.
  const int kept_to = odds_lost() > kDoubtOdds ? filter_.states() : kPoseStates;
  for (int i = 0; i < n; i++) {
    if (!(d[i] > 0.0)) continue;
    planar_row row;
    double innovation = forward[i] / d[i];
    for (int j = i; j < n; j++) {
      const int state = a.state[index[j]];
      double off = a.value[index[j]] - filter_.value(state);
      if (index[j] == kAlignHeading) off = wrap(off);
      row.add(state, lower[j][i]);
      innovation += lower[j][i] * off;
    }
    projection projected;
    filter_.project(row, &projected);
    (void)filter_.update(projected, innovation, 1.0 / d[i], kPoseStates, kept_to);
  }
  for (int k = 1; k < found.count; k++)
    if (chance[k] > kLeastChance) filter_.add_chance(chance[k], elsewhere[k]);
  return true;
}

}  // namespace wm
