// SPDX-License-Identifier: Apache-2.0
#include "filters/relocalize/pose_search.hpp"

#include "filters/relocalize/resection.hpp"
#include "filters/relocalize/shortlist.hpp"
#include "math/arc.hpp"

// Constants were chosen on drawn crossings (waymark-montecarlo --trials) and the recordings mrclam-d6-r1 to r5,
// kidnapped and without a start, and not swept one by one unless stated.
namespace wm {
namespace {

constexpr wm_time_ns kSpacing_ns = 300 * WM_NS_PER_MS;  // between two observations of one key
constexpr int kHeadings = 72;                           // every 5 degrees: well inside Gauss-Newton's convergence
constexpr int kCandidates = 12;                         // that are refined
constexpr int kTriples = 120;  // with a third of the bearings false, 8 in 27 triples are free of them
constexpr double kApart_m = 0.5, kApart_rad = 0.1;  // candidates nearer to each other are one
constexpr int kRefinements = 10;                    // steps of Gauss-Newton; most converge in five
constexpr int kLinearRounds = 3;                    // of the linear solution: the first without weights by residual
constexpr double kOutlierChi2 = 9.0;                // a residual's chi2 is clipped here, at 3 sigma
// Errors of tilt and height are constant in time, so that heights have narrower limits: chi2 of one, and the mean of a
// landmark's, where few landmarks support the pose.
constexpr double kHeightChi2 = 4.0, kHeightOfFew = 2.0;
constexpr double kMarginChi2 = 9.0;  // the second best pose must be worse by this
// Share of the observations that must agree; the lower one where at least kMany landmarks support the pose.
constexpr double kAgreeing = 0.7, kAgreeingOfMany = 0.5;
constexpr int kMany = 4;  // landmarks
// With fewer landmarks, all of bearings, each must be observed from two places: one may be a false detection.
constexpr int kFew = 3;
constexpr double kRival = 0.85;        // a pose with this share of the best one's observations is as good
constexpr double kNewView_m = 0.3;     // sensor's motion from which on a landmark's observation is another view of it
constexpr double kFirstGuess_m = 4.0;  // distance of a landmark of which only the bearing is known
constexpr double kShortest_m = 0.2;    // floor of a distance that divides an error
constexpr double kShortestLever_m = 0.5;  // the same, of odometry's error across a bearing
// Two poses are the same within these and three sigmas.
constexpr double kSame_m = 0.3, kSame_rad = 0.2;
// Consecutive observations share the odometry's and the sensor's errors: the covariance of independent ones is too
// small. Times its entries: twice the sigmas.
constexpr double kCorrelated = 4.0;
constexpr double kDamping = 1e-6;      // of the normal equations' diagonal (Levenberg), relative and absolute
constexpr double kUnobserved = 1e-9;   // weight of an unobserved unknown at zero
constexpr double kBehind_chi2 = 1e3;   // of a landmark that would lie behind the bearing
constexpr double kNoPlace_m = 1e-6;    // nearer than this a landmark has no direction
constexpr double kFailed_cost = 1e30;  // of a refinement that diverged
constexpr double kSingular = 1e-12;    // determinant over the diagonal's product

// The odometry's frame in map: its origin and rotation.
struct placement {
  double x, y, turn;
  double cost;

  bool is_near(const placement &o) const {
    return std::fabs(x - o.x) + std::fabs(y - o.y) < kApart_m && std::fabs(wrap(turn - o.turn)) < kApart_rad;
  }
  bool is_better(const placement &o) const { return cost < o.cost; }
};

// The frame in which odometry `odom` is the pose.
placement placed(const wm_pose2 &pose, const wm_pose2 &odom) {
  const double turn = wrap(pose.heading_rad - odom.heading_rad);
  const sin_cos by = sincos(turn);
  return {pose.x_m - by.cos * odom.x_m + by.sin * odom.y_m, pose.y_m - by.sin * odom.x_m - by.cos * odom.y_m, turn,
          0.0};
}

struct problem {
  struct item {
    const observation *seen;
    double weight_angle, weight_length;  // 1 / variance
    double place_m2;                     // sigma_place_m squared
    double travel_m2;                    // variance of the odometry since
    double dir_x, dir_y;                 // of the line of sight, in the odometry's frame
    int landmark;                        // numbered in order of appearance; -1: none
    int view;                            // the first item of the same landmark from the same place, or itself
  };
  static constexpr int kMost = pose_search::kCapacity + 4;  // 4: priors
  item items[kMost];
  int count = 0, landmarks = 0;
  int times_seen[kMost];    // observations of each landmark
  int priors_from = kMost;  // items from here on are priors

  void add(const observation &seen, const travelled_pose2 &odometry) {
    item &it = items[count];
    it.seen = &seen;
    it.landmark = -1;
    it.view = count++;
    it.place_m2 = (seen.kind & kObservedBearing) ? square(seen.sigma_place_m) : 0.0;
    if (seen.kind & (kObservedBearing | kObservedRange)) {
      number_landmark(&it);
      it.view = view_of(it);
    }
    const double travel_m = kTravelSigma * (odometry.travelled_m - seen.travelled_m);
    const double turn_rad = kTurnSigma * (odometry.turned_rad - seen.turned_rad);
    it.travel_m2 = square(travel_m);
    const double lever_m = (seen.kind & kObservedRange) ? seen.range_m : kFirstGuess_m;
    it.weight_angle = 1.0 / (square(seen.sigma_angle_rad) + square(turn_rad) +
                             square(travel_m / (lever_m > kShortestLever_m ? lever_m : kShortestLever_m)));
    it.weight_length = 1.0 / (square(seen.sigma_length_m) + square(travel_m));
    const sin_cos d = sincos(seen.sensor.heading_rad + seen.bearing_rad);
    it.dir_x = d.cos;
    it.dir_y = d.sin;
  }

  bool only_bearings() const {
    for (int i = 0; i < count; i++)
      if ((items[i].seen->kind & ~kObservedElevation) != kObservedBearing) return false;
    return true;
  }
  bool only_ranges() const {  // and headings
    for (int i = 0; i < count; i++)
      if (items[i].seen->kind & (kObservedBearing | kObservedPosition)) return false;
    return true;
  }

 private:
  // Landmarks are the same when their places are; the item is the newest one.
  void number_landmark(item *it) {
    for (int i = 0; i < count - 1 && it->landmark < 0; i++)
      if (items[i].landmark >= 0 && items[i].seen->place_m[0] == it->seen->place_m[0] &&
          items[i].seen->place_m[1] == it->seen->place_m[1])
        it->landmark = items[i].landmark;
    if (it->landmark < 0) times_seen[it->landmark = landmarks++] = 0;
    times_seen[it->landmark]++;
  }
  int view_of(const item &it) const {
    const wm_pose2 &from = it.seen->sensor;
    for (int i = 0; i < count - 1; i++)
      if (items[i].view == i && items[i].landmark == it.landmark && items[i].seen->kind == it.seen->kind &&
          square(items[i].seen->sensor.x_m - from.x_m) + square(items[i].seen->sensor.y_m - from.y_m) <
              square(kNewView_m))
        return i;
    return it.view;
  }
};

// Information of a bearing at that distance (squared). The landmark's constant error is shared among its observations:
// together they contain no more information than one without noise.
double weight_at(const problem &all, const problem::item &it, double distance_m2) {
  const double constant_m2 = it.place_m2 > 0.0 ? all.times_seen[it.landmark] * it.place_m2 : 0.0;
  return it.weight_angle / (1.0 + constant_m2 * it.weight_angle / distance_m2);
}

double clipped(double chi2) { return chi2 < kOutlierChi2 ? chi2 : kOutlierChi2; }
double at_least_zero(double chi2) { return chi2 > 0.0 ? chi2 : 0.0; }

// Weight of a residual with bounded influence: Geman-McClure's, scaled to the clipping.
double bounded_weight(double chi2) { return square(kOutlierChi2 / (kOutlierChi2 + chi2)); }

struct residuals {
  double angle_chi2, length_chi2;  // negative: not observed
  double height_chi2 = -1.0;
};

// Information of a landmark's height above the sensor by its elevation, at that distance (squared).
double height_weight(const problem::item &it, double distance_m2) {
  const observation &c = *it.seen;
  return 1.0 / (distance_m2 * square(c.sigma_tangent) + square(c.sigma_height_m) + square(c.tangent) * it.travel_m2);
}

// Residuals of one observation, without an arctangent: sin(error) = across / distance.
residuals residuals_of(const problem::item &it, const placement &p, const sin_cos &turn) {
  const observation &c = *it.seen;
  residuals out = {-1.0, -1.0, -1.0};
  if (c.kind & kObservedHeading) {
    out.angle_chi2 = square(wrap(c.bearing_rad - c.sensor.heading_rad - p.turn)) * it.weight_angle;
    return out;
  }
  const double sx = p.x + turn.cos * c.sensor.x_m - turn.sin * c.sensor.y_m;
  const double sy = p.y + turn.sin * c.sensor.x_m + turn.cos * c.sensor.y_m;
  const double dx = c.place_m[0] - sx, dy = c.place_m[1] - sy;
  if (c.kind & kObservedPosition) {
    out.length_chi2 = 0.5 * (dx * dx + dy * dy) * it.weight_length;
    return out;
  }
  const double distance = std::sqrt(dx * dx + dy * dy);
  if (c.kind & kObservedBearing) {
    const double ux = turn.cos * it.dir_x - turn.sin * it.dir_y, uy = turn.sin * it.dir_x + turn.cos * it.dir_y;
    const double ahead = ux * dx + uy * dy, across = ux * dy - uy * dx;
    out.angle_chi2 = ahead > 0.0 && distance > kNoPlace_m
                         ? square(across) * it.weight_angle / (square(distance) + it.place_m2 * it.weight_angle)
                         : kBehind_chi2;
  }
  if (c.kind & kObservedRange) out.length_chi2 = square(distance - c.range_m) * it.weight_length;
  if (c.kind & kObservedElevation)
    out.height_chi2 = square(c.tangent * distance - c.height_m) * height_weight(it, distance * distance);
  return out;
}

// By all observations, or by all but the heights.
double cost_of(const problem &all, const placement &p, bool by_heights = true) {
  const sin_cos turn = sincos(p.turn);
  double cost = 0.0;
  for (int i = 0; i < all.count; i++) {
    const residuals r = residuals_of(all.items[i], p, turn);
    cost += clipped(at_least_zero(r.angle_chi2)) + clipped(at_least_zero(r.length_chi2)) +
            (by_heights && r.height_chi2 > 0.0 ? clipped(r.height_chi2) / all.times_seen[all.items[i].landmark] : 0.0);
  }
  return cost;
}

// The observations that agree with a pose.
struct support {
  int observations = 0, numbers = 0;
  int priors = 0;
  int landmarks = 0;  // of which at least half of the observations agree
  int well_seen = 0;  // of these, from two views or more
  int askew = 0;      // of these, with contradicting heights
};

// What agrees of one landmark.
struct landmark_support {
  int balance = 0;  // observations that agree, less those that contradict
  int views = 0, fitting = 0;
  double height_chi2 = 0.0;  // sum over those that agree
};

support support_of(const problem &all, const placement &p, bool by_heights = true) {
  const sin_cos turn = sincos(p.turn);
  support out;
  landmark_support of[problem::kMost];
  bool counted[problem::kMost] = {};  // views
  for (int i = 0; i < all.count; i++) {
    const problem::item &it = all.items[i];
    const residuals r = residuals_of(it, p, turn);
    const bool fits =
        r.angle_chi2 < kOutlierChi2 && r.length_chi2 < kOutlierChi2 && (!by_heights || r.height_chi2 < kHeightChi2);
    if (it.landmark >= 0) of[it.landmark].balance += fits ? 1 : -1;
    if (!fits) continue;
    out.observations++;
    out.priors += i >= all.priors_from;
    out.numbers += (r.angle_chi2 >= 0.0) + (r.length_chi2 >= 0.0) * ((it.seen->kind & kObservedPosition) ? 2 : 1);
    if (it.landmark >= 0) {
      landmark_support &own = of[it.landmark];
      own.fitting++;
      own.height_chi2 += at_least_zero(r.height_chi2);
      own.views += !counted[it.view];
    }
    counted[it.view] = true;
  }
  for (int i = 0; i < all.landmarks; i++) {
    if (of[i].balance < 0) continue;
    out.landmarks++;
    out.well_seen += of[i].views >= 2;
    out.askew += of[i].height_chi2 > kHeightOfFew * of[i].fitting;
  }
  return out;
}

// Normal equations a x = b of three unknowns.
struct equations {
  double a[3][3] = {}, b[3] = {};

  void add(const double row[3], double value, double weight) {
    for (int i = 0; i < 3; i++) {
      b[i] += weight * row[i] * value;
      for (int j = 0; j < 3; j++) a[i][j] += weight * row[i] * row[j];
    }
  }
  // The first two unknowns by Cramer's rule. False: singular.
  bool solve_place(double out[2]) const {
    const double det = determinant(a);
    if (!(det > 0.0)) return false;
    for (int k = 0; k < 2; k++) {
      double m[3][3];
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) m[i][j] = j == k ? b[i] : a[i][j];
      out[k] = determinant(m) / det;
    }
    return true;
  }
  // The inverse by cofactors. False: nearly singular.
  bool invert(double out[3][3]) const {
    const double c00 = a[1][1] * a[2][2] - a[1][2] * a[2][1], c01 = a[1][2] * a[2][0] - a[1][0] * a[2][2];
    const double c02 = a[1][0] * a[2][1] - a[1][1] * a[2][0];
    const double det = a[0][0] * c00 + a[0][1] * c01 + a[0][2] * c02;
    if (!(det > kSingular * a[0][0] * a[1][1] * a[2][2]) || !finite(det) || !(det > 0.0)) return false;
    const double inverse = 1.0 / det;
    out[0][0] = c00 * inverse;
    out[0][1] = out[1][0] = c01 * inverse;
    out[0][2] = out[2][0] = c02 * inverse;
    out[1][1] = (a[0][0] * a[2][2] - a[0][2] * a[2][0]) * inverse;
    out[1][2] = out[2][1] = (a[0][2] * a[1][0] - a[0][0] * a[1][2]) * inverse;
    out[2][2] = (a[0][0] * a[1][1] - a[0][1] * a[1][0]) * inverse;
    return true;
  }

 private:
  static double determinant(const double m[3][3]) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  }
};

// Rows of one observation for a known rotation, over the place (x, y) and x^2 + y^2: a bearing is a line, a bearing
// with range a point, a range alone a circle. `r`: residuals at the previous solution, which weigh the observation.
void add_place_rows(const problem &all, const problem::item &it, const placement &p, const sin_cos &turn,
                    const residuals &r, bool first_round, bool circles, equations *e) {
  const observation &c = *it.seen;
  const double sx = turn.cos * c.sensor.x_m - turn.sin * c.sensor.y_m;
  const double sy = turn.sin * c.sensor.x_m + turn.cos * c.sensor.y_m;
  const double tx = c.place_m[0] - sx, ty = c.place_m[1] - sy;
  const double angle_weight = bounded_weight(at_least_zero(r.angle_chi2));
  const double length_weight = bounded_weight(at_least_zero(r.length_chi2));
  const auto add_row = [e](double x, double y, double z, double value, double weight) {
    const double row[3] = {x, y, z};
    e->add(row, value, weight);
  };
  if (c.kind & kObservedPosition) {
    add_row(1, 0, 0, tx, it.weight_length * length_weight);
    add_row(0, 1, 0, ty, it.weight_length * length_weight);
    return;
  }
  const bool range = c.kind & kObservedRange;
  if (c.kind & kObservedBearing) {
    const double ux = turn.cos * it.dir_x - turn.sin * it.dir_y, uy = turn.sin * it.dir_x + turn.cos * it.dir_y;
    double distance = range ? c.range_m : kFirstGuess_m;
    if (!first_round && !range) distance = std::sqrt(square(tx - p.x) + square(ty - p.y)) + 0.1;
    const double q = square(distance > kShortest_m ? distance : kShortest_m);
    add_row(-uy, ux, 0, ux * ty - uy * tx, weight_at(all, it, q) / q * angle_weight);
    if (range) add_row(ux, uy, 0, ux * tx + uy * ty - c.range_m, it.weight_length * length_weight);
  } else if (range && circles) {
    const double weight = it.weight_length / (4.0 * square(c.range_m > kShortest_m ? c.range_m : kShortest_m));
    add_row(2 * tx, 2 * ty, -1.0, tx * tx + ty * ty - square(c.range_m), weight * length_weight);
  }
}

// The best place for a known rotation, in three rounds of reweighted linear least squares. Circles serve where nothing
// else gives the place: their equations are of another degree.
placement place_at(const problem &all, double rotation) {
  placement p = {0.0, 0.0, rotation, 0.0};
  const sin_cos turn = sincos(rotation);
  const bool circles = all.only_ranges();
  for (int round = 0; round < kLinearRounds; round++) {
    equations e;
    for (int i = 0; i < all.count; i++) {
      const problem::item &it = all.items[i];
      if (it.seen->kind & kObservedHeading) continue;
      const residuals r = round > 0 ? residuals_of(it, p, turn) : residuals{0.0, 0.0};
      add_place_rows(all, it, p, turn, r, round == 0, circles, &e);
    }
    if (!circles) e.a[2][2] += 1.0;
    for (int i = 0; i < 3; i++) e.a[i][i] += kUnobserved;
    double place[2];
    if (!e.solve_place(place)) break;
    p.x = place[0];
    p.y = place[1];
  }
  p.cost = cost_of(all, p);
  return p;
}

// Rows of one observation of Gauss-Newton about p, over (x, y, turn), weighted with bounded influence. Without heights:
// of observations that heights do not contradict, by the rest.
void add_rows(const problem &all, const problem::item &it, const placement &p, const sin_cos &turn, bool by_heights,
              equations *e) {
  const observation &c = *it.seen;
  const auto add = [e](const double(&row)[3], double residual, double weight) {
    e->add(row, residual, weight * bounded_weight(square(residual) * weight));
  };
  if (c.kind & kObservedHeading)
    return add({0, 0, 1}, wrap(c.bearing_rad - c.sensor.heading_rad - p.turn), it.weight_angle);
  const double rx = turn.cos * c.sensor.x_m - turn.sin * c.sensor.y_m;
  const double ry = turn.sin * c.sensor.x_m + turn.cos * c.sensor.y_m;
  const double dx = c.place_m[0] - p.x - rx, dy = c.place_m[1] - p.y - ry;
  if (c.kind & kObservedPosition) {
    add({1, 0, -ry}, dx, it.weight_length);
    add({0, 1, rx}, dy, it.weight_length);
    return;
  }
  const double q = dx * dx + dy * dy;
  if (!(q > kNoPlace_m)) return;
  if (!by_heights && residuals_of(it, p, turn).height_chi2 > kHeightChi2) return;
  if (c.kind & kObservedBearing)
    add({dy / q, -dx / q, -(rx * dx + ry * dy) / q - 1.0},
        wrap(c.sensor.heading_rad + c.bearing_rad + p.turn - atan2(dy, dx)), weight_at(all, it, q));
  if (by_heights && (c.kind & kObservedElevation)) {
    // Errors of tilt and height are constant: all observations of a landmark count as one.
    const double d = std::sqrt(q), by = c.tangent / d;
    add({-by * dx, -by * dy, by * (ry * dx - rx * dy)}, c.height_m - c.tangent * d,
        height_weight(it, q) / all.times_seen[it.landmark]);
  }
  if (c.kind & kObservedRange) {
    const double d = std::sqrt(q);
    add({-dx / d, -dy / d, (ry * dx - rx * dy) / d}, c.range_m - d, it.weight_length);
  }
}

equations normal_equations(const problem &all, const placement &p, bool by_heights) {
  const sin_cos turn = sincos(p.turn);
  equations e;
  for (int i = 0; i < all.count; i++) add_rows(all, all.items[i], p, turn, by_heights, &e);
  return e;
}

using candidates = shortlist<placement, kCandidates>;

// The local minima over all headings.
void offer_headings(const problem &all, candidates *list) {
  placement grid[kHeadings];
  for (int i = 0; i < kHeadings; i++) grid[i] = place_at(all, wrap(kTwoPi * i / kHeadings));
  for (int i = 0; i < kHeadings; i++)
    if (grid[i].cost <= grid[(i + 1) % kHeadings].cost && grid[i].cost < grid[(i + kHeadings - 1) % kHeadings].cost)
      list->offer(grid[i]);
}

// Poses by resection from three bearings each, drawn by the same pseudo-random sequence in every search.
void offer_triples(const problem &all, candidates *list) {
  int bearings[problem::kMost], count = 0;
  for (int i = 0; i < all.count; i++)
    if (all.items[i].seen->kind & kObservedBearing) bearings[count++] = i;
  if (count < 3) return;
  uint32_t state = 1;
  const auto draw = [&state, count](int but_a, int but_b) {
    state = state * 1664525u + 1013904223u;  // linear congruential generator of Numerical Recipes; its upper bits
    int i = (int)((state >> 8) % (uint32_t)count);
    while (i == but_a || i == but_b) i = (i + 1) % count;
    return i;
  };
  for (int n = 0; n < kTriples; n++) {
    int of[3];
    of[0] = draw(-1, -1);
    of[1] = draw(of[0], -1);
    of[2] = draw(of[0], of[1]);
    line_of_sight line[3];
    for (int k = 0; k < 3; k++) {
      const problem::item &it = all.items[bearings[of[k]]];
      const observation &c = *it.seen;
      line[k] = {{c.sensor.x_m, c.sensor.y_m}, {it.dir_x, it.dir_y}, {c.place_m[0], c.place_m[1]}};
    }
    wm_pose2 pose[2];
    const int found = resect(line, pose);
    for (int k = 0; k < found; k++) {
      placement p = {pose[k].x_m, pose[k].y_m, pose[k].heading_rad, 0.0};
      p.cost = cost_of(all, p);
      list->offer(p);
    }
  }
}

// Gauss-Newton with a little damping.
void refine(const problem &all, placement *p) {
  for (int step = 0; step < kRefinements && finite(p->x + p->y + p->turn); step++) {
    equations e = normal_equations(all, *p, true);
    for (int i = 0; i < 3; i++) e.a[i][i] += kDamping * (1.0 + e.a[i][i]);
    double inverse[3][3], move[3];
    if (!e.invert(inverse)) break;
    for (int i = 0; i < 3; i++) move[i] = inverse[i][0] * e.b[0] + inverse[i][1] * e.b[1] + inverse[i][2] * e.b[2];
    p->x += move[0];
    p->y += move[1];
    p->turn = wrap(p->turn + move[2]);
  }
  p->cost = finite(p->x + p->y + p->turn) ? cost_of(all, *p) : kFailed_cost;
}

// Enough observations agree, and of enough landmarks.
bool is_supported(const problem &all, const support &own, const search_limits &limits) {
  const double share = own.landmarks >= kMany ? kAgreeingOfMany : kAgreeing;
  if (own.observations < share * all.count || own.observations < 3 || own.numbers < limits.numbers) return false;
  if (own.landmarks >= kFew) return true;
  return own.askew == 0 && (own.well_seen >= own.landmarks || !all.only_bearings());
}

// No other candidate explains the observations as well. Heights are left out, as they are of the covariance.
bool is_unique(const problem &all, const candidates &list, const placement &best, const wm_pose2 &odom,
               const search_result &result) {
  const double near_m = kSame_m + 3.0 * std::sqrt(result.covariance[0][0] + result.covariance[1][1]);
  const double near_rad = kSame_rad + 3.0 * std::sqrt(result.covariance[2][2]);
  const support own = support_of(all, best, false);
  const double own_cost = cost_of(all, best, false);
  for (int k = 0; k < list.count; k++) {
    const placement &p = list.best[k];
    const wm_pose2 other = compose({p.x, p.y, p.turn}, odom);
    const double away = std::fabs(other.x_m - result.pose.x_m) + std::fabs(other.y_m - result.pose.y_m);
    if (away < near_m && std::fabs(wrap(other.heading_rad - result.pose.heading_rad)) < near_rad) continue;
    const support rival = support_of(all, p, false);
    const bool as_good = rival.landmarks >= own.landmarks && rival.observations > kRival * own.observations;
    if (rival.priors >= own.priors && (as_good || cost_of(all, p, false) < own_cost + kMarginChi2)) return false;
  }
  return true;
}

}  // namespace

void add_attached_covariance(const wm_pose2 &from, const wm_pose2 &to, const double p[3][3], double out[3][3]) {
  const double lever_x = to.x_m - from.x_m, lever_y = to.y_m - from.y_m;
  const double j[3][3] = {{1, 0, -lever_y}, {0, 1, lever_x}, {0, 0, 1}};
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++)
      for (int m = 0; m < 3; m++)
        for (int n = 0; n < 3; n++) out[r][c] += j[r][m] * p[m][n] * j[c][n];
}

void pose_search::add(const observation &seen) {
  for (int i = kept() - 1; i >= 0; i--) {
    const observation &c = at(i);
    if (seen.t_ns - c.t_ns >= kSpacing_ns) break;
    if (c.key == seen.key) return;
  }
  ring_[count_ % kCapacity] = seen;
  count_++;
  if (count_ == 4 * kCapacity) count_ -= 2 * kCapacity;  // bounds the counter; the place in the ring stays
}

int pose_search::count_since(wm_time_ns since_ns) const {
  int count = 0;
  while (count < kept() && at(kept() - 1 - count).t_ns >= since_ns) count++;
  return count;
}

bool pose_search::contradicts(const observation &seen, wm_time_ns since_ns, const wm_pose2 &pose_now,
                              const travelled_pose2 &odometry) const {
  constexpr uint32_t kPlace = kObservedBearing | kObservedRange;
  if ((seen.kind & kPlace) != kPlace) return false;
  const sin_cos sight = sincos(seen.sensor.heading_rad + seen.bearing_rad);
  int balance = 0;
  for (int i = kept() - count_since(since_ns); i < kept(); i++) {
    const observation &c = at(i);
    if (c.key != seen.key || c.t_ns >= seen.t_ns || (c.kind & kPlace) != kPlace) continue;
    problem one;
    one.add(c, odometry);
    if (support_of(one, placed(pose_now, odometry.pose)).observations == 0) continue;
    const sin_cos other = sincos(c.sensor.heading_rad + c.bearing_rad);
    const double dx = c.sensor.x_m + c.range_m * other.cos - seen.sensor.x_m - seen.range_m * sight.cos;
    const double dy = c.sensor.y_m + c.range_m * other.sin - seen.sensor.y_m - seen.range_m * sight.sin;
    const double along = sight.cos * dx + sight.sin * dy, across = sight.cos * dy - sight.sin * dx;
    // The other's variances, along and across this line of sight.
    const double cos2 = square(sight.cos * other.cos + sight.sin * other.sin);
    const double length2 = square(c.sigma_length_m), width2 = square(c.range_m * c.sigma_angle_rad);
    const double travel2 = square(kTravelSigma * (seen.travelled_m - c.travelled_m));
    const double turn2 = square(seen.range_m * kTurnSigma * (seen.turned_rad - c.turned_rad));
    const double along2 = square(seen.sigma_length_m) + cos2 * length2 + (1.0 - cos2) * width2 + travel2;
    const double across2 =
        square(seen.range_m * seen.sigma_angle_rad) + cos2 * width2 + (1.0 - cos2) * length2 + travel2 + turn2;
    balance += square(along) < kOutlierChi2 * along2 && square(across) < kOutlierChi2 * across2 ? 1 : -1;
  }
  return balance < 0;
}

int pose_search::agreeing(wm_time_ns since_ns, const wm_pose2 &pose_now, const travelled_pose2 &odometry,
                          const wm_pose2 mounting[kMaxSensors]) const {
  problem all;
  observation seen[kCapacity];
  for (int i = kept() - count_since(since_ns), n = 0; i < kept(); i++, n++) {
    seen[n] = at(i);
    if (seen[n].key >= 0) seen[n].sensor = compose(seen[n].sensor, mounting[seen[n].key % kMaxSensors]);
    all.add(seen[n], odometry);
  }
  return support_of(all, placed(pose_now, odometry.pose)).observations;
}

search_result pose_search::find(wm_time_ns since_ns, const travelled_pose2 &odometry, const observation *prior,
                                int prior_count, const search_limits &limits) const {
  search_result out{};
  problem all;
  for (int i = 0; i < kept(); i++)
    if (at(i).t_ns >= since_ns) all.add(at(i), odometry);
  out.used = all.priors_from = all.count;
  for (int i = 0; i < prior_count; i++) all.add(prior[i], odometry);
  if (out.used < 3) return out;

  candidates list;
  list.clear();
  offer_headings(all, &list);
  offer_triples(all, &list);
  int best = 0;
  for (int k = 0; k < list.count; k++) {
    refine(all, &list.best[k]);
    if (list.best[k].cost < list.best[best].cost) best = k;
  }
  if (list.count == 0) return out;
  const placement &p = list.best[best];
  const support own = p.cost < kFailed_cost ? support_of(all, p) : support{};
  out.agreeing = own.observations;
  out.landmarks = own.landmarks;
  if (!is_supported(all, own, limits)) return out;
  // The covariance is by all but the heights: by them one landmark would do, and it may be a false detection.
  double inverse[3][3];
  if (!normal_equations(all, p, false).invert(inverse)) return out;
  const wm_pose2 frame = {p.x, p.y, p.turn};
  out.pose = compose(frame, odometry.pose);
  add_attached_covariance(frame, out.pose, inverse, out.covariance);
  for (auto &row : out.covariance)
    for (double &value : row) value *= kCorrelated;
  out.found = is_unique(all, list, p, odometry.pose, out) &&
              out.covariance[0][0] + out.covariance[1][1] < 2.0 * square(limits.sigma_xy_m) &&
              out.covariance[2][2] < square(limits.sigma_heading_rad);
  return out;
}

}  // namespace wm
