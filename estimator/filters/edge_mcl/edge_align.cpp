// SPDX-License-Identifier: Apache-2.0
// The measurement update: a scan is aligned with the map's lines from the prediction on, together with the camera's
// errors, and fused as one measurement.
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

// Gauss-Newton steps of one descent; in the first ones a point's gate includes the prior's spread. Not swept.
constexpr int kRounds = 4, kCoarseRounds = 2;
constexpr double kGate_m = 0.15;          // from the map's edge; a point farther off is not aligned
constexpr double kCoarseGateMax_m = 0.5;  // below edge_map's reach of 0.6 m
// Along an axis that the prediction leaves open, descents start this far apart (door recesses are 0.1 m to 0.3 m deep)
// and up to so many sigmas, so many on each side at most. Not swept.
constexpr double kStartStep_m = 0.12, kStartSigmas = 2.5;
constexpr int kStartsMax = 6;
constexpr double kSureHeading_rad = 0.08;  // a heading less sure than this gets three starts: 5 degrees
// Minima nearer than this are one; those less probable are left out.
constexpr double kSameMinimum_m = 0.1, kSameMinimum_rad = 0.05, kLeastProbability = 0.01;
constexpr double kNormalGateCos = 0.8253356149096783;  // of 0.6 rad between a point's edge and the map's; not swept
// Density of edges that the map does not have (furniture, joints of the floor), across a wall, where the map explains
// half of the points: one in half a metre. 1 to 4 keep 32 rendered drives in flats within 5 cm; with 0.4 one drive in a
// flat of boxes goes astray.
constexpr double kUnmapped_per_m = 2.0;
constexpr double kExplainedRange[] = {0.5, 0.95};  // of the drive's mean fraction, as that density takes it; not swept
constexpr double kOpenSigmas = 2.5;                // of a point's place by the prior, added to the gate
// Errors of a scan are independent of the last one's after this distance or time. Chosen on 2 of 75 corridor-hard
// drives that were lost while they stood; not swept.
constexpr double kIndependent_m = 0.1, kIndependent_s = 5.0;
// Points of successive scans whose errors are common, so each has so much less information. By the NEES of 43 rendered
// drives; not swept.
constexpr double kCorrelatedPoints = 30.0;
// Walls are listed after so much way and rotation, by every second point. Not swept.
constexpr double kWallsEvery_m = 0.1;
constexpr uint32_t kWallsStride = 2;
constexpr double kExplained_m = 0.06,
                 kExplainedSigmas2 = 9.0;     // a point so near to an edge is explained by the map; not swept
constexpr int kLeastExplained = 5;            // points of a scan: fewer leave a pose open
constexpr double kLeastExplainedLost = 0.4;   // fraction of a scan that the map must explain while lost; not swept
constexpr double kCalibrationLogOdds = -1.5;  // of being lost (18 %), above which a scan corrects the pose alone
constexpr double kRankDeficient = 1e-9;       // of a pivot, in parts of its diagonal

// Half the squared residual as Student's distribution with 4 degrees of freedom has it: (nu + 1)/2 log(1 + r2/nu).
double student_cost(double squared, double variance) { return 2.5 * log(1.0 + 0.25 * (squared / variance)); }
// Its weight in iteratively reweighted least squares: (nu + 1)/(nu + r2).
double student_weight(double squared, double variance) { return 5.0 / (4.0 + squared / variance); }

// Weight of a point by the probability p that it is on its nearest edge of the map: its residual's density N(0,
// variance) against that of unmapped edges, as in probabilistic data association [BarShalom2001]. There the event of
// each scan is independent, but an unmapped edge is seen again in the next scans; p^2 gives doubtful edges less effect.
// Of p, p^2 and p^4 in flats full of boxes p doubles the error of p^2; in long dark corridors p^4 gets lost. The first
// pass takes p: residuals that the prediction's error shares shrink together, and the second pass decides by p^2.
double probability_mapped(double residual_m, double variance, double unmapped_per_m) {
  const double density = exp(-0.5 * square(residual_m) / variance) / std::sqrt(kTwoPi * variance);
  return density / (density + unmapped_per_m);
}

// H P H' of a point, whose row has an entry 1 for its wall besides.
double variance_of(const align_matrix &p, const point_vector &row, int wall) {
  const point_vector gain = p.topLeftCorner<kAlignPoint, kAlignPoint>().lazyProduct(row);
  if (wall < 0) return row.dot(gain);
  const int at = kAlignWall + wall;
  return row.dot(gain + 2.0 * p.block<kAlignPoint, 1>(0, at)) + p(at, at);
}

// Where the heading enters, differences are wrapped.
double difference(int state, double a, double b) { return state == kAlignHeading ? wrap(a - b) : a - b; }

}  // namespace

edge_mcl::alignment edge_mcl::alignment_of(int camera) const {
  alignment a{};
  a.camera = camera;
  for (int k = 0; k < kAlignStates; k++) a.state[k] = -1;
  for (int k = 0; k < kPoseStates; k++) a.state[k] = k;
  if (camera >= 0)
    for (int k = 0; k <= kCameraTime; k++) a.state[kAlignCamera + k] = slots_.at(camera, k);
  a.state[kAlignEdge] = edge_state_;
  for (int k = 0; wall_state_ >= 0 && k < wall_list::kCapacity; k++)
    if (walls_.used(k)) a.state[kAlignWall + k] = (int)wall_state_ + k;
  for (int k = 0; k < kAlignStates; k++)
    if (a.state[k] >= 0) a.value[k] = filter_.value(a.state[k]);
  return a;
}

edge_mcl::capture edge_mcl::capture_of(const alignment &a) const {
  const wm_time_ns now = filter_.now_ns(), age = wm_ns_from_seconds(a.value[kAlignTime]);
  capture c{};
  motion_twist twist{};
  const wm_pose2 way = age >= 0 ? filter_.path(now - age, now, &twist) : filter_.path(now, now - age, &twist);
  c.from_now = age >= 0 ? between(way, wm_pose2{}) : way;
  c.pose = compose({a.value[kAlignX], a.value[kAlignY], a.value[kAlignHeading]}, c.from_now);
  c.twist = twist;
  c.turn = sincos(c.pose.heading_rad);
  const double x = a.camera >= 0 ? camera_[a.camera].x_m : 0.0, y = a.camera >= 0 ? camera_[a.camera].y_m : 0.0;
  c.eye_x_m = c.pose.x_m + c.turn.cos * x - c.turn.sin * y;
  c.eye_y_m = c.pose.y_m + c.turn.sin * x + c.turn.cos * y;
  return c;
}

bool edge_mcl::predict_scan(int camera, prediction *out) const {
  out->mean = alignment_of(camera);
  const int *state = out->mean.state;
  align_matrix &covariance = out->covariance;
  for (int r = 0; r < kAlignStates; r++)
    for (int c = 0; c < kAlignStates; c++)
      covariance(r, c) = state[r] >= 0 && state[c] >= 0 ? filter_.covariance(state[r], state[c]) : r == c;
  if (!invert_positive(covariance, &out->inverse)) return false;
  for (int k = 0; k < kAlignStates; k++)
    if (state[k] < 0) out->inverse(k, k) = 0.0;  // its rows of a measurement are 0 as well
  return true;
}

void edge_mcl::prepare_points(const wm_points &points, int camera) {
  for (uint32_t i = 0; i < points.count; i++) {
    scan_point &to = points_[i];
    const bool directed = finite((double)points.normal_rad[i]);
    const sin_cos n = directed ? sincos((double)points.normal_rad[i]) : sin_cos{};
    to.normal_cos = n.cos;
    to.normal_sin = n.sin;
    to.own2 = square(point_sigma(points, i, camera)) + square(params_.point_sigma_m);
    to.on_line = on_a_line(points, i);
  }
}

// Corrects a point by the camera's errors and finds the map's edge next to it. False: it is not used.
bool edge_mcl::match(const wm_points &points, uint32_t i, const alignment &a, const capture &from,
                     matched_point *out) const {
  out->floor = {(double)points.x_m[i], (double)points.y_m[i], {}, {}};
  floor_point &p = out->floor;
  if (a.camera >= 0) {
    if (camera_[a.camera].range(p.x, p.y) > params_.range_max_m) return false;
    if (!camera_[a.camera].correct(p.x, p.y, a.value + kAlignCamera, &p)) return false;
  }
  const sin_cos &h = from.turn;
  out->from_x_m = h.cos * p.x - h.sin * p.y;
  out->from_y_m = h.sin * p.x + h.cos * p.y;
  out->x_m = from.pose.x_m + out->from_x_m;
  out->y_m = from.pose.y_m + out->from_y_m;
  const scan_point &own = points_[i];
  out->sigma2 = own.own2;
  if (a.camera >= 0)
    out->sigma2 += square(camera_[a.camera].sigma(camera_[a.camera].range(p.x, p.y), params_.common_px));
  out->line = map_.nearest_seen(out->x_m, out->y_m, out->x_m - from.eye_x_m, out->y_m - from.eye_y_m);
  edge_line &line = out->line;
  // The floor on this side of an edge was seen: its normal points away from the camera.
  if (line.normal_x * (out->x_m - from.eye_x_m) + line.normal_y * (out->y_m - from.eye_y_m) < 0.0) {
    line.normal_x = -line.normal_x;
    line.normal_y = -line.normal_y;
    line.offset_m = -line.offset_m;
  }
  out->same_side = true;
  if (line.found && (own.normal_cos != 0.0 || own.normal_sin != 0.0)) {
    const double nx = h.cos * own.normal_cos - h.sin * own.normal_sin;
    const double ny = h.sin * own.normal_cos + h.cos * own.normal_sin;
    out->same_side = nx * line.normal_x + ny * line.normal_y >= kNormalGateCos;
  }
  out->residual_m = line.offset_m - (edge_state_ >= 0 ? a.value[kAlignEdge] : 0.0);
  return true;
}

// A point on a line that no edge explains lies beyond an edge, or is an edge's reflection in the floor, or neither.
void edge_mcl::count_unexplained(const matched_point &p, const capture &from, normal_equations *out) const {
  const double ray_x = p.x_m - from.eye_x_m, ray_y = p.y_m - from.eye_y_m;
  if (through_an_edge(map_, p.x_m, p.y_m, ray_x, ray_y))
    out->beyond++;
  else
    out->reflected += before_an_edge(map_, p.x_m, p.y_m, ray_x, ray_y);
}

// Adds a point's cost and counts it. `near`: an edge is within the gate, on the side that is seen.
void edge_mcl::count_point(const matched_point &p, const scan_point &own, bool near, double mapped, const capture &from,
                           double correlated, normal_equations *out) const {
  const double residual2 = square(p.residual_m), unmatched = student_cost(square(kGate_m), p.sigma2) / correlated;
  out->seen += (int)own.on_line;
  out->cost += unmatched;
  if (near) {
    const double cost = student_cost(residual2, p.sigma2) / correlated;
    if (cost < unmatched) out->cost += mapped * (cost - unmatched);
  }
  if (near && (p.line.distance_m < kExplained_m || residual2 < kExplainedSigmas2 * own.own2)) {
    out->explained++;
    out->seen += own.on_line == 0;
  } else if (own.on_line) {
    count_unexplained(p, from, out);
  }
}

// Derivatives of a point's distance to its edge, towards smaller residuals.
void edge_mcl::jacobian_of(const matched_point &p, const alignment &a, const capture &from, point_vector *row) const {
  const edge_line &line = p.line;
  const sin_cos &h = from.turn;
  (*row)[kAlignX] = line.normal_x;
  (*row)[kAlignY] = line.normal_y;
  (*row)[kAlignHeading] = line.normal_y * (p.x_m - a.value[kAlignX]) - line.normal_x * (p.y_m - a.value[kAlignY]);
  for (int k = 0; k < kCameraErrors; k++)
    (*row)[kAlignCamera + k] = line.normal_x * (h.cos * p.floor.x_by[k] - h.sin * p.floor.y_by[k]) +
                               line.normal_y * (h.sin * p.floor.x_by[k] + h.cos * p.floor.y_by[k]);
  const planar_twist &t = from.twist;
  (*row)[kAlignTime] = -(line.normal_x * (t.v * h.cos - t.w * p.from_y_m - t.u * h.sin) +
                         line.normal_y * (t.v * h.sin + t.w * p.from_x_m + t.u * h.cos));
  (*row)[kAlignEdge] = 1.0;
  for (int k = 0; k < kAlignPoint; k++)
    if (a.state[k] < 0) (*row)[k] = 0.0;
}

// The wall of a matched point: its offset leaves the residual. A wall that has no state leaves each point's variance
// larger. -1: no state.
int edge_mcl::wall_of(const alignment &a, int guess, matched_point *p) const {
  if (wall_state_ < 0 || !p->line.found) return -1;
  const bool guessed = guess >= 0 && walls_.is_of(guess, p->line, p->x_m, p->y_m);
  const int wall = guessed ? guess : walls_.find(p->line, p->x_m, p->y_m);
  if (wall < 0)
    p->sigma2 += square(params_.wall_sigma_m);
  else
    p->residual_m -= a.value[kAlignWall + wall];
  return wall;
}

// Normal equations of a scan at an alignment. `open`: a point's place is as uncertain as this prior leaves it, too;
// null: by its own error alone. `mapped`: each point's weight by probability_mapped(), which the first passes
// set.
void edge_mcl::linearize(const wm_points &points, const alignment &a, double gate_m, const prediction *open,
                         descent_pass pass, double mapped[WM_POINTS_MAX], normal_equations *out) const {
  *out = normal_equations{};
  point_vector row;
  const capture from = capture_of(a);
  const double correlated = kCorrelatedPoints / independence_;  // points that count as one
  matched_point p;
  int last = -1;  // neighbours are of one wall, as a rule
  for (uint32_t i = 0; i < points.count; i++) {
    if (pass == descent_pass::kFirst) mapped[i] = 0.0;
    if (!match(points, i, a, from, &p)) continue;
    const int wall = last = wall_of(a, last, &p);
    const double gate = wall < 0 ? gate_m : gate_m + std::fabs(a.value[kAlignWall + wall]);
    const bool near = p.line.found && (open || p.line.distance_m <= gate) && p.same_side;
    if (pass == descent_pass::kLast) count_point(p, points_[i], near, mapped[i], from, correlated, out);
    if (!near) continue;
    jacobian_of(p, a, from, &row);
    const double open2 = open ? variance_of(open->covariance, row, wall) : 0.0;
    if (open && square(p.line.distance_m) > square(gate) + square(kOpenSigmas) * open2) continue;
    const double variance = p.sigma2 + open2;
    if (open) mapped[i] = probability_mapped(p.residual_m, variance, unmapped_per_m_);
    if (open && pass != descent_pass::kFirst) mapped[i] = square(mapped[i]);
    const double weight = mapped[i] * student_weight(square(p.residual_m), variance) / (variance * correlated);
    const point_vector weighted = weight * row;
    out->gradient.head<kAlignPoint>() += p.residual_m * weighted;
    out->information.topLeftCorner<kAlignPoint, kAlignPoint>().noalias() += weighted * row.transpose();
    if (wall < 0) continue;
    const int at = kAlignWall + wall;
    out->gradient[at] += weight * p.residual_m;
    out->information.block<kAlignPoint, 1>(0, at) += weighted;
    out->information(at, at) += weight;
  }
  out->information.bottomLeftCorner<wall_list::kCapacity, kAlignPoint>() =
      out->information.topRightCorner<kAlignPoint, wall_list::kCapacity>().transpose();
}

align_vector edge_mcl::difference_of(const alignment &a, const alignment &b) {
  align_vector d;
  for (int k = 0; k < kAlignStates; k++) d[k] = difference(k, a.value[k], b.value[k]);
  return d;
}

// Gauss-Newton from a.value on. The coarse rounds take `part` of the prediction as the prior, the others the whole.
// Returns the cost of prediction and scan together where it ends; `e` is linearized there.
double edge_mcl::descend(const wm_points &points, const prediction &whole, const prediction &part, double slack_m,
                         alignment *a, normal_equations *e) const {
  double mapped[WM_POINTS_MAX];
  for (int round = 0; round < kRounds; round++) {
    // The gate narrows from the uncertainty of pose and camera to that of a point.
    const bool coarse = round < kCoarseRounds;
    const prediction &prior = coarse ? part : whole;
    const double gate = kGate_m + (coarse ? slack_m : 0.0);
    const descent_pass pass = round == 0             ? descent_pass::kFirst
                              : round + 1 == kRounds ? descent_pass::kLast
                                                     : descent_pass::kNext;
    linearize(points, *a, gate > kCoarseGateMax_m ? kCoarseGateMax_m : gate, coarse ? &part : nullptr, pass, mapped, e);
    if (pass == descent_pass::kLast) break;
    align_matrix total = prior.inverse + e->information;
    const align_vector right = e->gradient + prior.inverse * difference_of(prior.mean, *a);
    for (int k = 0; k < kAlignStates; k++)
      if (a->state[k] < 0) total(k, k) = 1.0;
    align_vector step;
    if (!solve_positive(total, right, &step)) continue;
    for (int k = 0; k < kAlignStates; k++) a->value[k] += step[k];
    a->value[kAlignHeading] = wrap(a->value[kAlignHeading]);
  }
  const align_vector off = difference_of(whole.mean, *a);
  return e->cost + 0.5 * off.dot(whole.inverse * off);
}

// Keeps the best first; minima that lie together are one.
void edge_mcl::minima::take(const alignment &a, double its_cost, const normal_equations &e) {
  const auto same = [&a](const alignment &b) {
    return square(a.value[kAlignX] - b.value[kAlignX]) + square(a.value[kAlignY] - b.value[kAlignY]) <
               square(kSameMinimum_m) &&
           std::fabs(wrap(a.value[kAlignHeading] - b.value[kAlignHeading])) < kSameMinimum_rad;
  };
  int i = 0;
  while (i < count && !same(at[i])) i++;
  if (i == kCapacity || (i < count && its_cost >= cost[i])) return;
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

// Leaves a prediction only `to` of its `variance` along an axis of the plane, as if its place there had been measured;
// `shared`: the covariance of the unknowns with that place.
void edge_mcl::narrow(const sin_cos &axis, const align_vector &shared, double variance, double to, prediction *part) {
  part->covariance.noalias() -= (variance - to) / square(variance) * shared * shared.transpose();
  const double information = 1.0 / to - 1.0 / variance;
  part->inverse(kAlignX, kAlignX) += information * square(axis.cos);
  part->inverse(kAlignY, kAlignY) += information * square(axis.sin);
  part->inverse(kAlignX, kAlignY) += information * axis.cos * axis.sin;
  part->inverse(kAlignY, kAlignX) = part->inverse(kAlignX, kAlignY);
}

// A scan has several local minima (doors, pillars). Descents start along the axis that the prediction leaves most open,
// and, of a heading that is not sure, at three headings. Where starts are nearer to each other than a sigma, each
// begins with the part of the prediction around it: the whole would pull each descent back to its mean before the gate
// narrows.
void edge_mcl::find_minima(const wm_points &points, const prediction &prior, minima *out) const {
  const double xx = filter_.variance(kX), yy = filter_.variance(kY), xy = filter_.covariance(kX, kY);
  const double half = 0.5 * (xx + yy), spread = std::sqrt(square(0.5 * (xx - yy)) + square(xy));
  const double sigma = std::sqrt(half + spread), angle = 0.5 * atan2(2.0 * xy, xx - yy);
  const sin_cos axis = sincos(angle);
  double step = kStartStep_m;
  const double wanted = kStartSigmas * sigma / step;
  int sides = wanted < kStartsMax + 1.0 ? (int)wanted : kStartsMax + 1;
  if (sides > kStartsMax) {
    sides = kStartsMax;
    step = kStartSigmas * sigma / sides;
  }
  const double slack = sides > 0 ? step : 3.0 * std::sqrt(half + spread + 9.0 * filter_.variance(kHeading));
  const double turn = std::sqrt(filter_.variance(kHeading));
  const bool placed = life_.tracking() || tentative_;
  const int turns = placed && turn > kSureHeading_rad ? 1 : 0;
  if (life_.searching() && !placed) sides = 0;  // the pose is arbitrary: no use in starts around it
  // Covariance of the unknowns with the place along the axis; 0 of those that are off.
  const align_vector shared = axis.cos * prior.covariance.col(kAlignX) + axis.sin * prior.covariance.col(kAlignY);
  prediction part = prior;
  // Of the way from the prior's mean to a start: where that start's part has its mean.
  const double kept = sides > 0 && step < sigma ? 1.0 - square(step / sigma) : 0.0;
  if (kept > 0.0) narrow(axis, shared, square(sigma), square(step), &part);
  out->count = 0;
  for (int k = -sides; k <= sides; k++)
    for (int m = -turns; m <= turns; m++) {
      // The prior's mean, conditioned on k steps along the axis; then turned.
      alignment a = prior.mean;
      for (int i = 0; i < kAlignStates; i++) {
        a.value[i] += k * step * shared[i] / square(sigma);
        part.mean.value[i] = prior.mean.value[i] + kept * k * step * shared[i] / square(sigma);
      }
      a.value[kAlignHeading] = wrap(a.value[kAlignHeading] + m * turn);
      normal_equations e;
      const double cost = descend(points, prior, part, slack, &a, &e);
      out->take(a, cost, e);
    }
}

// Probability of each minimum, and by how much every state differs there from the best one.
void edge_mcl::compare_minima(const minima &found, const prediction &prior, double *off, double *probability) const {
  double total = 0.0;
  for (int k = 0; k < found.count; k++) total += probability[k] = exp(found.cost[0] - found.cost[k]);
  for (int k = 0; k < found.count; k++) {
    probability[k] /= total;
    const align_vector scaled = prior.inverse * difference_of(found.at[k], found.at[0]);
    for (int i = 0; i < filter_.states(); i++) {
      double &by = off[k * filter_.states() + i] = 0.0;
      for (int r = 0; r < kAlignStates; r++)
        if (prior.mean.state[r] >= 0) by += filter_.covariance(i, prior.mean.state[r]) * scaled[r];
    }
  }
}

// The innovation along the map axis of which the scan has more information, with its information of the other states
// given that axis: one distance, in a corridor that to its walls.
void edge_mcl::describe(const normal_equations &scan, const alignment &a, wm_innovation *record) const {
  const int best = scan.information(kAlignX, kAlignX) > scan.information(kAlignY, kAlignY) ? kAlignX : kAlignY;
  const double known = scan.information(best, best);
  if (!(known > 0.0)) return;
  const double aslant = scan.information(kAlignX, kAlignY) / known, length = std::sqrt(1.0 + aslant * aslant);
  double innovation = scan.gradient[best] / known;
  planar_row row;
  for (int k = 0; k < kAlignStates; k++) {
    if (a.state[k] < 0) continue;
    const double share = scan.information(best, k) / known;
    row.add(a.state[k], share);
    innovation += share * difference(k, a.value[k], filter_.value(a.state[k]));
  }
  record->observed = innovation / length;
  record->variance = (filter_.variance_of(row) + 1.0 / known) / square(length);
  record->nis = square(record->observed) / record->variance;
  record->gate_dof = 1;
}

// The scan's information A = L D L' as scalar measurements: row i of L' with variance 1/D_i, where D_i is not 0. False:
// a variance was not positive, and that row was not fused.
bool edge_mcl::fuse_information(const normal_equations &e, const alignment &a) {
  align_matrix lower;
  align_vector d, forward = e.gradient;  // forward: L^-1 gradient
  factorize_semidefinite(e.information, kRankDeficient, &lower, &d);
  for (int i = 0; i < kAlignStates; i++)
    for (int k = 0; k < i; k++) forward[i] -= lower(i, k) * forward[k];
  const int considered_to = lost_log_odds() > kCalibrationLogOdds ? filter_.states() : kPoseStates;
  bool numeric = true;
  for (int i = 0; i < kAlignStates; i++) {
    if (!(d[i] > 0.0)) continue;
    planar_row row;
    double innovation = forward[i] / d[i];
    for (int j = i; j < kAlignStates; j++) {
      if (a.state[j] < 0) continue;
      row.add(a.state[j], lower(j, i));
      innovation += lower(j, i) * difference(j, a.value[j], filter_.value(a.state[j]));
    }
    numeric &= filter_.update(row, innovation, 1.0 / d[i], kPoseStates, considered_to);
  }
  return numeric;
}

// Lists the walls of a scan as they are predicted. A new one has the prior: it may be anywhere near the map's.
void edge_mcl::update_walls(const wm_points &points, int camera) {
  const double way = filter_.travelled_m() + filter_.turned_rad();
  if (wall_state_ < 0 || !life_.tracking() || way - walls_m_ < kWallsEvery_m) return;
  walls_m_ = way;
  const alignment a = alignment_of(camera);
  const capture from = capture_of(a);
  matched_point p;
  walls_.begin();
  for (uint32_t i = 0; i < points.count; i += kWallsStride)
    if (match(points, i, a, from, &p) && p.line.found && p.same_side && p.line.distance_m <= kGate_m)
      walls_.add(p.line, p.x_m, p.y_m);
  const uint32_t changed = walls_.replace();
  for (int k = 0; k < wall_list::kCapacity; k++)
    if (changed & 1u << k) filter_.forget((int)wall_state_ + k, 0.0, square(params_.wall_sigma_m));
}

void edge_mcl::forget_walls() {
  walls_.clear();
  walls_m_ = -kWallsEvery_m;
  for (int k = 0; wall_state_ >= 0 && k < wall_list::kCapacity; k++)
    filter_.forget((int)wall_state_ + k, 0.0, square(params_.wall_sigma_m));
}

// Iterated extended Kalman filter in information form (B. M. Bell, F. W. Cathey, "The iterated Kalman filter update as
// a Gauss-Newton method", 1993): minimises prediction's and scan's cost together, then fuses the scan's information at
// the minimum. False: the scan was not fused; the record's verdict has the reason.
bool edge_mcl::align(const wm_points &points, int camera, normal_equations *scan, wm_innovation *record) {
  const int by = camera >= 0 ? camera : kCamerasMax;
  const double way = filter_.travelled_m() + filter_.turned_rad();
  independence_ = aligned_ns_[by] == WM_TIME_NONE
                      ? 1.0
                      : (way - aligned_m_[by]) / kIndependent_m +
                            wm_seconds_between(aligned_ns_[by], filter_.now_ns()) / kIndependent_s;
  if (independence_ > 1.0) independence_ = 1.0;
  prepare_points(points, camera);
  update_walls(points, camera);
  prediction before;
  if (!predict_scan(camera, &before)) return false;
  double share = fit_.mean_explained();
  share = share < kExplainedRange[0] ? kExplainedRange[0] : share > kExplainedRange[1] ? kExplainedRange[1] : share;
  unmapped_per_m_ = kUnmapped_per_m * (1.0 - share) / share;
  minima found;
  find_minima(points, before, &found);
  *scan = found.best;
  record->verdict = scan->explained < kLeastExplained ? (uint8_t)WM_REJECTED_SINGULAR : (uint8_t)WM_FUSED;
  if (scan->explained < kLeastExplained) return false;
  describe(*scan, found.at[0], record);
  // While lost, points lie near edges by chance. They would draw the pose there, which only odometry carries on.
  if (!life_.tracking() && scan->explained < kLeastExplainedLost * scan->seen) {
    record->verdict = (uint8_t)WM_REJECTED_GATE;
    return false;
  }
  aligned_m_[by] = way;
  aligned_ns_[by] = filter_.now_ns();
  double *off = &off_[0], probability[minima::kCapacity];
  compare_minima(found, before, off, probability);
  if (!fuse_information(*scan, found.at[0])) record->verdict = (uint8_t)WM_REJECTED_NUMERIC;
  for (int k = 1; k < found.count; k++)
    if (probability[k] > kLeastProbability) filter_.add_chance(probability[k], off + k * filter_.states());
  return true;
}

}  // namespace wm
