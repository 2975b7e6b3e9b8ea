// SPDX-License-Identifier: Apache-2.0
#include "filters/relocalize/pose_search.hpp"

#include "filters/relocalize/resection.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr wm_time_ns kSpacing_ns = 300 * WM_NS_PER_MS;
constexpr int kHeadings = 72;  // every 5 degrees: well inside Gauss-Newton's reach
constexpr int kCandidates = 12;
constexpr int kTriples = 120;                       // with a third of the bearings false, one in three is of right ones
constexpr double kApart_m = 0.5, kApart_rad = 0.1;  // candidates nearer than that are one
constexpr int kRefinements = 10;
constexpr double kHeightChi2 = 4.0;      // what a tilt and a height are wrong by lasts: it is there each time
constexpr double kHeightOfFew = 2.0;     // where few landmarks bear a pose out
constexpr double kOutlierChi2 = 9.0;     // a residual beyond counts this much and no more
constexpr double kMarginChi2 = 9.0;      // the second best place must be worse by this
constexpr double kAgreeing = 0.7;        // share of observations that must agree ...
constexpr double kAgreeingOfMany = 0.5;  // ... where so many landmarks bear it out:
constexpr int kMany = 4;
constexpr int kFew = 3;  // of fewer bearings' landmarks each must be seen from two places: one may be another thing
constexpr double kRival = 0.85;        // another place that so many as many observations agree with is as good
constexpr double kAnew_m = 0.3;        // seen again from less far away, a landmark says nothing new
constexpr double kFirstGuess_m = 4.0;  // distance of a landmark of which only the bearing is known

// The frame of odometry in map: position of its origin, rotation.
struct placement {
  double x, y, turn;
  double cost;
};

struct problem {
  struct item {
    const observation *seen;
    double weight_angle, weight_length;  // 1 / variance
    double place_m2;                     // sigma_place_m squared
    double way_m2;                       // what odometry has lost since, squared
    double dir_x, dir_y;                 // of the line of sight, in the odometry's frame
    int landmark;                        // numbered as they come; -1: none
    int view;                            // the first item that saw the same from the same place; itself if none did
  };
  static constexpr int kMost = pose_search::kCapacity + 4;
  item items[kMost];
  int count = 0, landmarks = 0;
  int times_seen[kMost];    // observations of each landmark
  int stated_from = kMost;  // what was said of the start: items from here on

  void add(const observation &seen, double travelled_m, double turned_rad) {
    item &it = items[count];
    it.seen = &seen;
    it.landmark = -1;
    it.view = count++;
    it.place_m2 = (seen.kind & kObservedBearing) ? square(seen.sigma_place_m) : 0.0;
    if (seen.kind & (kObservedBearing | kObservedRange)) {
      for (int i = 0; i < count - 1 && it.landmark < 0; i++)
        if (items[i].landmark >= 0 && items[i].seen->place_m[0] == seen.place_m[0] &&
            items[i].seen->place_m[1] == seen.place_m[1])
          it.landmark = items[i].landmark;
      if (it.landmark < 0) times_seen[it.landmark = landmarks++] = 0;
      times_seen[it.landmark]++;
      for (int i = 0; i < count - 1 && it.view == count - 1; i++)
        if (items[i].view == i && items[i].landmark == it.landmark && items[i].seen->kind == seen.kind &&
            square(items[i].seen->sensor.x_m - seen.sensor.x_m) + square(items[i].seen->sensor.y_m - seen.sensor.y_m) <
                square(kAnew_m))
          it.view = i;
    }
    const double way = kWayError * (travelled_m - seen.travelled_m);
    const double turn = kTurnError * (turned_rad - seen.turned_rad);
    it.way_m2 = square(way);
    const double lever = (seen.kind & kObservedRange) ? seen.range_m : kFirstGuess_m;
    it.weight_angle = 1.0 / (square(seen.sigma_angle_rad) + square(turn) + square(way / (lever > 0.5 ? lever : 0.5)));
    it.weight_length = 1.0 / (square(seen.sigma_length_m) + square(way));
    const sin_cos d = sincos(seen.sensor.heading_rad + seen.bearing_rad);
    it.dir_x = d.cos;
    it.dir_y = d.sin;
  }
};

// Of one bearing at that distance (squared), with the part of what lasts that an observation has which is one of
// several of the same landmark: together they know it no better than once.
double weight_at(const problem &all, const problem::item &it, double distance_m2) {
  const double lasting = it.place_m2 > 0.0 ? all.times_seen[it.landmark] * it.place_m2 : 0.0;
  return it.weight_angle / (1.0 + lasting * it.weight_angle / distance_m2);
}

double clipped(double chi2) { return chi2 < kOutlierChi2 ? chi2 : kOutlierChi2; }

// Weight of a residual with bounded influence (Geman-McClure, scaled to the clipping).
double bounded_weight(double chi2) { return square(kOutlierChi2 / (kOutlierChi2 + chi2)); }

struct residuals {
  double angle_chi2, length_chi2;  // negative: not observed
  double height_chi2 = -1.0;
};

// Of how high a landmark is above the sensor at that distance (squared) by its elevation: 1 / variance.
double height_weight(const problem::item &it, double distance_m2) {
  const observation &c = *it.seen;
  return 1.0 / (distance_m2 * square(c.sigma_tangent) + square(c.sigma_height_m) + square(c.tangent) * it.way_m2);
}

// Residuals of one seen without an arctangent: sin(error) = cross / distance; behind counts as an outlier.
residuals look(const problem::item &it, const placement &p, const sin_cos &turn) {
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
    out.angle_chi2 = ahead > 0.0 && distance > 1e-6
                         ? square(across) * it.weight_angle / (square(distance) + it.place_m2 * it.weight_angle)
                         : 1e3;
  }
  if (c.kind & kObservedRange) out.length_chi2 = square(distance - c.range_m) * it.weight_length;
  if (c.kind & kObservedElevation)
    out.height_chi2 = square(c.tangent * distance - c.height_m) * height_weight(it, distance * distance);
  return out;
}

// Who agrees with a place.
struct support {
  int observations = 0, numbers = 0;
  int stated = 0;     // what was said of the start
  int landmarks = 0;  // of which half of the observations and more agree
  int well_seen = 0;  // of these, from two places or more
  int askew = 0;      // of these, too high or too low to speak for it
};

bool only_bearings(const problem &all) {
  for (int i = 0; i < all.count; i++)
    if ((all.items[i].seen->kind & ~kObservedElevation) != kObservedBearing) return false;
  return true;
}

// By all that was seen, or by all but the heights.
double cost_of(const problem &all, const placement &p, support *fit = nullptr, bool by_heights = true) {
  const sin_cos turn = sincos(p.turn);
  double cost = 0.0;
  int balance[problem::kMost] = {};  // of each landmark: agreeing less contradicting
  int views[problem::kMost] = {};    // of each landmark that agree
  bool told[problem::kMost] = {};
  double height_chi2[problem::kMost] = {};  // of each landmark, over those that agree
  int fitting[problem::kMost] = {};
  for (int i = 0; i < all.count; i++) {
    const residuals r = look(all.items[i], p, turn);
    cost += clipped(r.angle_chi2 > 0.0 ? r.angle_chi2 : 0.0) + clipped(r.length_chi2 > 0.0 ? r.length_chi2 : 0.0) +
            (by_heights && r.height_chi2 > 0.0 ? clipped(r.height_chi2) / all.times_seen[all.items[i].landmark] : 0.0);
    if (!fit) continue;
    const bool fits =
        r.angle_chi2 < kOutlierChi2 && r.length_chi2 < kOutlierChi2 && (!by_heights || r.height_chi2 < kHeightChi2);
    const int landmark = all.items[i].landmark;
    if (landmark >= 0) balance[landmark] += fits ? 1 : -1;
    if (!fits) continue;
    fit->observations++;
    fit->stated += i >= all.stated_from;
    fit->numbers +=
        (r.angle_chi2 >= 0.0) + (r.length_chi2 >= 0.0) * ((all.items[i].seen->kind & kObservedPosition) ? 2 : 1);
    if (landmark >= 0) {
      fitting[landmark]++;
      height_chi2[landmark] += r.height_chi2 > 0.0 ? r.height_chi2 : 0.0;
      views[landmark] += !told[all.items[i].view];
    }
    told[all.items[i].view] = true;
  }
  for (int i = 0; fit && i < all.landmarks; i++) {
    fit->landmarks += balance[i] >= 0;
    fit->well_seen += balance[i] >= 0 && views[i] >= 2;
    fit->askew += balance[i] >= 0 && height_chi2[i] > kHeightOfFew * fitting[i];
  }
  return cost;
}

// Best position for a given rotation: each bearing is a line, each bearing with range a point, each range alone a
// circle (whose square is linear in x, y and x^2 + y^2). Two rounds; the second believes those that fitted.
placement place_at(const problem &all, double rotation) {
  placement p = {0.0, 0.0, rotation, 0.0};
  const sin_cos turn = sincos(rotation);
  for (int round = 0; round < 3; round++) {
    double a[3][3] = {}, b[3] = {};
    const auto add_row = [&](double x, double y, double z, double value, double weight) {
      const double row[3] = {x, y, z};
      for (int i = 0; i < 3; i++) {
        b[i] += weight * row[i] * value;
        for (int j = 0; j < 3; j++) a[i][j] += weight * row[i] * row[j];
      }
    };
    bool circles = true;
    for (int i = 0; i < all.count; i++)
      circles = circles && (all.items[i].seen->kind & (kObservedBearing | kObservedPosition)) == 0;
    for (int i = 0; i < all.count; i++) {
      const problem::item &it = all.items[i];
      const observation &c = *it.seen;
      if (c.kind & kObservedHeading) continue;
      const residuals r = round > 0 ? look(it, p, turn) : residuals{0.0, 0.0};
      const double sx = turn.cos * c.sensor.x_m - turn.sin * c.sensor.y_m;
      const double sy = turn.sin * c.sensor.x_m + turn.cos * c.sensor.y_m;
      const double tx = c.place_m[0] - sx, ty = c.place_m[1] - sy;
      const double trust_angle = bounded_weight(r.angle_chi2 > 0 ? r.angle_chi2 : 0.0);
      const double trust_length = bounded_weight(r.length_chi2 > 0 ? r.length_chi2 : 0.0);
      if (c.kind & kObservedPosition) {
        add_row(1, 0, 0, tx, it.weight_length * trust_length);
        add_row(0, 1, 0, ty, it.weight_length * trust_length);
        continue;
      }
      const double ux = turn.cos * it.dir_x - turn.sin * it.dir_y, uy = turn.sin * it.dir_x + turn.cos * it.dir_y;
      if (c.kind & kObservedBearing) {
        double distance = (c.kind & kObservedRange) ? c.range_m : kFirstGuess_m;
        if (round > 0 && !(c.kind & kObservedRange)) distance = std::sqrt(square(tx - p.x) + square(ty - p.y)) + 0.1;
        const double q = square(distance > 0.2 ? distance : 0.2);
        add_row(-uy, ux, 0, ux * ty - uy * tx, weight_at(all, it, q) / q * trust_angle);
        if (c.kind & kObservedRange) add_row(ux, uy, 0, ux * tx + uy * ty - c.range_m, it.weight_length * trust_length);
      } else if ((c.kind & kObservedRange) && circles) {
        const double weight = it.weight_length / (4.0 * square(c.range_m > 0.2 ? c.range_m : 0.2));
        add_row(2 * tx, 2 * ty, -1.0, tx * tx + ty * ty - square(c.range_m), weight * trust_length);
      }
    }
    if (!circles) a[2][2] += 1.0;
    for (int i = 0; i < 3; i++) a[i][i] += 1e-9;  // what nothing says stays where it is
    // Cramer's rule is enough for three numbers.
    const auto det3 = [](const double m[3][3]) {
      return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    };
    const double det = det3(a);
    if (!(det > 0.0)) break;
    double solution[2];
    for (int k = 0; k < 2; k++) {
      double m[3][3];
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) m[i][j] = j == k ? b[i] : a[i][j];
      solution[k] = det3(m) / det;
    }
    p.x = solution[0];
    p.y = solution[1];
  }
  p.cost = cost_of(all, p);
  return p;
}

// Normal equations of Gauss-Newton about p, over (x, y, turn); residuals bounded in influence. Without heights: of
// those that heights don't contradict, by the rest.
void normal_equations(const problem &all, const placement &p, bool by_heights, double a[3][3], double b[3]) {
  const sin_cos turn = sincos(p.turn);
  for (int i = 0; i < 3; i++) {
    b[i] = 0.0;
    for (int j = 0; j < 3; j++) a[i][j] = 0.0;
  }
  const auto add_row = [&](const double row[3], double residual, double weight) {
    const double w = weight * bounded_weight(square(residual) * weight);
    for (int i = 0; i < 3; i++) {
      b[i] += w * row[i] * residual;
      for (int j = 0; j < 3; j++) a[i][j] += w * row[i] * row[j];
    }
  };
  for (int i = 0; i < all.count; i++) {
    const problem::item &it = all.items[i];
    const observation &c = *it.seen;
    if (c.kind & kObservedHeading) {
      const double row[3] = {0, 0, 1};
      add_row(row, wrap(c.bearing_rad - c.sensor.heading_rad - p.turn), it.weight_angle);
      continue;
    }
    const double rx = turn.cos * c.sensor.x_m - turn.sin * c.sensor.y_m;
    const double ry = turn.sin * c.sensor.x_m + turn.cos * c.sensor.y_m;
    const double dx = c.place_m[0] - p.x - rx, dy = c.place_m[1] - p.y - ry;
    if (c.kind & kObservedPosition) {
      const double row_x[3] = {1, 0, -ry}, row_y[3] = {0, 1, rx};
      add_row(row_x, dx, it.weight_length);
      add_row(row_y, dy, it.weight_length);
      continue;
    }
    const double q = dx * dx + dy * dy;
    if (!(q > 1e-6)) continue;
    if (!by_heights && look(it, p, turn).height_chi2 > kHeightChi2) continue;
    if (c.kind & kObservedBearing) {
      const double row[3] = {dy / q, -dx / q, -(rx * dx + ry * dy) / q - 1.0};
      add_row(row, wrap(c.sensor.heading_rad + c.bearing_rad + p.turn - atan2(dy, dx)), weight_at(all, it, q));
    }
    if (by_heights && (c.kind & kObservedElevation)) {
      // The same again tells no more: tilt and heights last.
      const double d = std::sqrt(q), by = c.tangent / d;
      const double row[3] = {-by * dx, -by * dy, by * (ry * dx - rx * dy)};
      add_row(row, c.height_m - c.tangent * d, height_weight(it, q) / all.times_seen[it.landmark]);
    }
    if (c.kind & kObservedRange) {
      const double d = std::sqrt(q);
      const double row[3] = {-dx / d, -dy / d, (ry * dx - rx * dy) / d};
      add_row(row, c.range_m - d, it.weight_length);
    }
  }
}

// The best placements that are not neighbours, the best first.
struct shortlist {
  placement best[kCandidates];
  int count = 0;

  void offer(const placement &p) {
    int at = 0;
    for (; at < count; at++)
      if (std::fabs(best[at].x - p.x) + std::fabs(best[at].y - p.y) < kApart_m &&
          std::fabs(wrap(best[at].turn - p.turn)) < kApart_rad)
        break;
    if (at < count && best[at].cost <= p.cost) return;
    if (at == count && count == kCandidates && best[--at].cost <= p.cost) return;
    if (at == count) count++;
    for (; at > 0 && best[at - 1].cost > p.cost; at--) best[at] = best[at - 1];
    best[at] = p;
  }
};

// Poses from three bearings each, drawn with numbers that are always the same.
void offer_triples(const problem &all, shortlist *list) {
  int bearings[problem::kMost], count = 0;
  for (int i = 0; i < all.count; i++)
    if (all.items[i].seen->kind & kObservedBearing) bearings[count++] = i;
  if (count < 3) return;
  uint32_t dice = 1;
  const auto draw = [&dice, count](int but_a, int but_b) {
    dice = dice * 1664525u + 1013904223u;  // Numerical Recipes' generator; its upper bits
    int i = (int)((dice >> 8) % (uint32_t)count);
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

bool invert(const double a[3][3], double out[3][3]) {
  const double c00 = a[1][1] * a[2][2] - a[1][2] * a[2][1], c01 = a[1][2] * a[2][0] - a[1][0] * a[2][2];
  const double c02 = a[1][0] * a[2][1] - a[1][1] * a[2][0];
  const double det = a[0][0] * c00 + a[0][1] * c01 + a[0][2] * c02;
  if (!(det > 1e-12 * a[0][0] * a[1][1] * a[2][2]) || !finite(det) || !(det > 0.0)) return false;
  const double inverse = 1.0 / det;
  out[0][0] = c00 * inverse;
  out[0][1] = out[1][0] = c01 * inverse;
  out[0][2] = out[2][0] = c02 * inverse;
  out[1][1] = (a[0][0] * a[2][2] - a[0][2] * a[2][0]) * inverse;
  out[1][2] = out[2][1] = (a[0][2] * a[1][0] - a[0][0] * a[1][2]) * inverse;
  out[2][2] = (a[0][0] * a[1][1] - a[0][1] * a[1][0]) * inverse;
  return true;
}

}  // namespace

void pose_search::add(const observation &seen) {
  const int oldest = count_ > kCapacity ? count_ - kCapacity : 0;
  for (int i = count_ - 1; i >= oldest; i--) {
    const observation &c = ring_[i % kCapacity];
    if (seen.t_ns - c.t_ns >= kSpacing_ns) break;
    if (c.key == seen.key) return;
  }
  ring_[count_ % kCapacity] = seen;
  count_++;
  if (count_ == 4 * kCapacity) count_ -= 2 * kCapacity;  // the index stays small; its place in the ring is the same
}

int pose_search::count_since(wm_time_ns since_ns) const {
  int count = 0;
  while (count < kept() && at(kept() - 1 - count).t_ns >= since_ns) count++;
  return count;
}

int pose_search::agreeing(wm_time_ns since_ns, const wm_pose2 &pose_now, const wm_pose2 &odom_now, double travelled_m,
                          double turned_rad, const wm_pose2 mounting[kMaxSensors]) const {
  problem all;
  observation seen[kCapacity];
  for (int i = kept() - count_since(since_ns), n = 0; i < kept(); i++, n++) {
    seen[n] = at(i);
    if (seen[n].key >= 0) seen[n].sensor = compose(seen[n].sensor, mounting[seen[n].key % kMaxSensors]);
    all.add(seen[n], travelled_m, turned_rad);
  }
  const double turn = wrap(pose_now.heading_rad - odom_now.heading_rad);
  const sin_cos by = sincos(turn);
  const placement frame = {pose_now.x_m - by.cos * odom_now.x_m + by.sin * odom_now.y_m,
                           pose_now.y_m - by.sin * odom_now.x_m - by.cos * odom_now.y_m, turn, 0.0};
  support fit;
  cost_of(all, frame, &fit);
  return fit.observations;
}

search_result pose_search::find(wm_time_ns since_ns, const wm_pose2 &odom_now, double travelled_m, double turned_rad,
                                const observation *prior, int prior_count, const search_limits &limits) const {
  search_result out{};
  problem all;
  const int oldest = count_ > kCapacity ? count_ - kCapacity : 0;
  for (int i = oldest; i < count_; i++)
    if (ring_[i % kCapacity].t_ns >= since_ns) all.add(ring_[i % kCapacity], travelled_m, turned_rad);
  out.used = all.stated_from = all.count;
  for (int i = 0; i < prior_count; i++) all.add(prior[i], travelled_m, turned_rad);
  if (out.used < 3) return out;

  // Coarse: every heading, and triples of bearings; the best few that are not neighbours.
  shortlist list;
  placement grid[kHeadings];
  for (int i = 0; i < kHeadings; i++) grid[i] = place_at(all, wrap(kTwoPi * i / kHeadings));
  for (int i = 0; i < kHeadings; i++)
    if (grid[i].cost <= grid[(i + 1) % kHeadings].cost && grid[i].cost < grid[(i + kHeadings - 1) % kHeadings].cost)
      list.offer(grid[i]);
  offer_triples(all, &list);
  placement *best = list.best;
  const int found = list.count;
  // Fine.
  double a[3][3], b[3], inverse[3][3];
  int winner = -1;
  support fit[kCandidates];
  for (int k = 0; k < found; k++) {
    placement &p = best[k];
    for (int step = 0; step < kRefinements; step++) {
      normal_equations(all, p, true, a, b);
      for (int i = 0; i < 3; i++) a[i][i] += 1e-6 * (1.0 + a[i][i]);
      if (!invert(a, inverse)) break;
      double move[3];
      for (int i = 0; i < 3; i++) move[i] = inverse[i][0] * b[0] + inverse[i][1] * b[1] + inverse[i][2] * b[2];
      p.x += move[0];
      p.y += move[1];
      p.turn = wrap(p.turn + move[2]);
      if (!finite(p.x) || !finite(p.y) || !finite(p.turn)) break;
    }
    fit[k] = {};
    p.cost = finite(p.x + p.y + p.turn) ? cost_of(all, p, &fit[k]) : 1e30;
    if (winner < 0 || p.cost < best[winner].cost) winner = k;
  }
  if (winner < 0) return out;
  const placement &w = best[winner];
  const support &own = fit[winner];
  out.agreeing = own.observations;
  const double share = own.landmarks >= kMany ? kAgreeingOfMany : kAgreeing;
  if (own.observations < share * all.count || own.observations < 3 || own.numbers < limits.numbers) return out;
  if (own.landmarks < kFew && own.well_seen < own.landmarks && only_bearings(all)) return out;
  if (own.landmarks < kFew && own.askew > 0) return out;
  // Heights may contradict a pose, but it is sure by the rest alone: by its heights one landmark would do, and it may
  // be another thing that looks like it.
  normal_equations(all, w, false, a, b);
  if (!invert(a, inverse)) return out;
  const wm_pose2 frame = {w.x, w.y, w.turn};
  out.pose = compose(frame, odom_now);
  // From the frame's covariance to the pose's: its origin is `lever` away.
  const double lever_x = out.pose.x_m - w.x, lever_y = out.pose.y_m - w.y;
  const double j[3][3] = {{1, 0, -lever_y}, {0, 1, lever_x}, {0, 0, 1}};
  // Following clues share the odometry's and the sensor's errors, so their number promises too much.
  const double caution = 4.0;
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      double sum = 0.0;
      for (int m = 0; m < 3; m++)
        for (int n = 0; n < 3; n++) sum += j[r][m] * inverse[m][n] * j[c][n];
      out.covariance[r][c] = caution * sum;
    }
  const double near_m = 0.3 + 3.0 * std::sqrt(out.covariance[0][0] + out.covariance[1][1]);
  const double near_rad = 0.2 + 3.0 * std::sqrt(out.covariance[2][2]);
  support plain;
  const double plain_cost = cost_of(all, w, &plain, false);
  for (int k = 0; k < found; k++) {
    const wm_pose2 other = compose({best[k].x, best[k].y, best[k].turn}, odom_now);
    const double away = std::fabs(other.x_m - out.pose.x_m) + std::fabs(other.y_m - out.pose.y_m);
    const bool same = away < near_m && std::fabs(wrap(other.heading_rad - out.pose.heading_rad)) < near_rad;
    if (same) continue;
    support rival;
    const double cost = cost_of(all, best[k], &rival, false);
    const bool as_good = rival.landmarks >= plain.landmarks && rival.observations > kRival * plain.observations;
    if (rival.stated >= plain.stated && (as_good || cost < plain_cost + kMarginChi2))
      return out;  // two places explain what was seen
  }
  out.found = out.covariance[0][0] + out.covariance[1][1] < 2.0 * square(limits.sigma_xy_m) &&
              out.covariance[2][2] < square(limits.sigma_heading_rad);
  return out;
}

}  // namespace wm
