// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/hypotheses.hpp"

namespace wm {
namespace {

// Log likelihood difference, in nats, between a keyframe (0.4 m) of usual information that is explained completely and
// one that is not at all. Its points' errors are correlated with each other and with the next keyframe's. Chosen on 20
// corridor-easy and 20 corridor-hard drives: 5 is right again earlier than 3 (starts 8.7 m instead of 11.6 in 90 of
// 100); more makes adopted poses overconfident.
constexpr double kNatsAKeyframe = 5.0;
// Fraction explained by a place that is not in the list: walls are parallel. Not swept.
constexpr double kUnknownExplained = 0.5;
constexpr double kDropNats = 12.0;   // below the best, from which on a hypothesis is dropped; not swept
constexpr double kUnweighed = -1e3;  // nats: log weight of a hypothesis that was not weighed yet
// Hypotheses nearer than this are one. Less than a sweep's places: an error of half a metre along a corridor must
// remain another hypothesis (0.6 m let one of 20 corridor-hard drives stay off).
constexpr double kSame_m = 0.4, kSame_rad = 0.2;
constexpr double kLeastProbability = 1e-6;  // of the tracked pose: bounds the odds against it
// Variances of a searched pose: 14 cm, 2.4 degrees. Of poses that were right, on corridor-hard; not swept.
constexpr double kSearchedCovariance[6] = {0.02, 0.0, 0.02, 0.0, 0.0, 0.0018};

// Histogram of walls' directions (which have no sign) by 2.5 degrees, from at most 1e5 places of a grid of 0.1 m that
// are within 0.3 m of a line. A rotation is listed from a quarter of the autocorrelation's maximum on; rotations two
// bins apart are one. Not swept.
constexpr int kBins = 72, kApartBins = 2;
constexpr double kBin_rad = kPi / kBins, kSelfCorrelation = 0.25;
constexpr double kLookUpsMax = 1e5, kGrid_m = 0.1, kNearEdge_m = 0.3;
constexpr int kPointsMin = 8;  // of a scan that aliased poses are weighed by: a pose has three unknowns
// Fraction of the points that a listed pose may explain less than the tracked one; not swept.
constexpr double kWorse = 0.15;
constexpr double kExplained_m = 0.1;              // a point so near to an edge is explained: half of the sweep's sigma
constexpr double kCorrelatedPoints = 5.0;         // points of a scan of 32 that count as one; not swept
constexpr double kOpen_m = 0.3, kOpen_rad = 0.1;  // prior sigmas: half of the distance of two places of a sweep
constexpr double kFound_m = 0.1, kFound_rad = 0.03;  // sigmas of the error that all points of a scan share; not swept
// Fraction explained by which a wrong pose may be better for metres, by chance or bias; not swept.
constexpr double kDrift = 0.05;
constexpr double kKeyframe_m = 0.4;  // scans so far apart are independent, as place_search's keyframes
// Odds of an aliased pose: at most (from there on its keyframes decide), and least that are more than none.
constexpr double kOddsMax = 50.0, kOddsNone = 1e-4;
// Of those weighed with each scan so many are the most promising: these explain a fifth of the points more than the
// tracked pose. Not swept.
constexpr int kFavoured = 6;
constexpr double kPromising = 0.2;
constexpr double kSmoothing = 0.5;  // weight of the newest scan in the fraction explained: mean of two scans
// Mean score (0 to 1) that a true place loses by half a step of places and headings; not swept.
constexpr double kGridLoss = 0.15;

bool same(const wm_pose2 &a, const wm_pose2 &b) { return same_pose(a, b, kSame_m, kSame_rad); }
bool same_place(const wm_pose2 &a, const wm_pose2 &b) { return same_pose(a, b, kSweepApart_m, kSweepApart_rad); }

hypothesis searched_at(const wm_pose2 &pose) {
  hypothesis h{};
  h.pose = pose;
  h.origin = kSearched;
  for (int k = 0; k < 6; k++) h.covariance[k] = kSearchedCovariance[k];
  return h;
}

// Histogram of the directions of the lines next to the places of a grid, smoothed over three bins.
void count_wall_directions(const edge_map &map, double histogram[kBins]) {
  const wm_raster &r = map.raster();
  double grid_px = kGrid_m / r.resolution_m;
  const double area = (double)r.width_px * r.height_px;
  if (area / square(grid_px) > kLookUpsMax) grid_px = std::sqrt(area / kLookUpsMax);
  for (double row = 0.5 * grid_px; row < r.height_px; row += grid_px)
    for (double column = 0.5 * grid_px; column < r.width_px; column += grid_px) {
      double x, y;
      map.to_map(column, row, &x, &y);
      const edge_line line = map.nearest(x, y);
      if (!line.found || line.distance_m > kNearEdge_m) continue;
      const double angle = atan2(line.normal_y, line.normal_x);
      const int bin = (int)((angle < 0.0 ? angle + kPi : angle) / kBin_rad);
      for (int k = -1; k <= 1; k++) histogram[(bin + k + kBins) % kBins] += k == 0 ? 2.0 : 1.0;
    }
}

}  // namespace

void hypotheses::init(const edge_map &map) {
  double histogram[kBins] = {}, correlation[kBins] = {};
  count_wall_directions(map, histogram);
  for (int turn = 0; turn < kBins; turn++)
    for (int i = 0; i < kBins; i++) correlation[turn] += histogram[i] * histogram[(i + turn) % kBins];
  rotations_ = 0;
  const double least = kSelfCorrelation * correlation[0];
  for (int n = 0; n < kHeadingsMax / 2; n++) {
    int best = 0;
    for (int i = 1; i < kBins; i++)
      if (correlation[i] > correlation[best]) best = i;
    if (!(correlation[best] > 0.0) || correlation[best] < least) break;
    rotation_rad_[rotations_++] = best * kBin_rad;
    rotation_rad_[rotations_++] = best * kBin_rad + kPi;
    for (int k = -kApartBins; k <= kApartBins; k++) correlation[(best + k + kBins) % kBins] = 0.0;
  }
}

void hypotheses::clear(const wm_pose2 &own, const wm_pose2 &odom) {
  odom_ = odom;
  drop_searched(own);
  aliased_ = point_count_ = next_aliased_ = 0;
  taken_ = 0;
  way_m_ = hazard_ = 0.0;
  sweep_.stop();
}

void hypotheses::drop_searched(const wm_pose2 &own) {
  searched_ = 1;
  next_searched_ = 0;
  of_[0] = searched_at(own);
  of_[0].origin = kTracked;
  of_[0].probability = 1.0;
}

void hypotheses::carry(const wm_pose2 &own, const wm_pose2 &odom) {
  const wm_pose2 way = between(odom_, odom);
  odom_ = odom;
  of_[0].pose = own;
  for (int i = 1; i < searched_; i++) of_[i].pose = compose(of_[i].pose, way);
  for (int i = kSearchedMax; i < kSearchedMax + aliased_; i++) of_[i].pose = compose(of_[i].pose, way);
}

void hypotheses::offer(const place_search &search) {
  int found;
  const place *places = search.places(&found);
  const wm_pose2 since = between(search.odom_of_places(), odom_);
  for (int k = 0; k < found; k++) offer(compose(places[k].pose, since), places[k].explained, places[k].error);
}

void hypotheses::offer(const wm_pose2 &pose, double explained, const double error[kMountingAll]) {
  if (searched_ == kSearchedMax) return;
  for (int i = 0; i < searched_; i++)
    if (same(of_[i].pose, pose)) return;
  hypothesis &h = of_[searched_++] = searched_at(pose);
  h.explained = explained;
  for (int e = 0; e < kMountingAll; e++) h.error[e] = error[e];
}

// log w = n explained + prior - error^2 / 2, n: kNatsAKeyframe times the information; beside them stands a place that
// is not in the list.
void hypotheses::weigh(const edge_map &map, place_search *search, double own_prior, double own_least,
                       double information, int some) {
  const double nats = kNatsAKeyframe * information;
  for (int n = 0; n < some && n < searched_; n++, next_searched_++) {
    if (next_searched_ >= searched_) next_searched_ = 0;
    hypothesis &h = of_[next_searched_];
    wm_pose2 aligned = h.pose;
    h.explained = search->explained(map, odom_, &aligned, h.error, next_searched_ == 0);
    if (next_searched_ == 0) {
      if (h.explained < own_least) h.explained = own_least;
    } else {
      h.pose = aligned;
      if (!map.drivable(aligned.x_m, aligned.y_m)) h.explained = 0.0;
    }
    h.weighed = 1;
  }
  double best = nats * kUnknownExplained;
  for (int i = 0; i < searched_; i++) {
    hypothesis &h = of_[i];
    h.log_weight = h.weighed ? nats * h.explained + (i == 0 ? own_prior : 0.0) : kUnweighed;
    for (const double e : h.error) h.log_weight -= 0.5 * e * e;
    if (h.log_weight > best) best = h.log_weight;
  }
  double total = exp(nats * kUnknownExplained - best);
  for (int i = 0; i < searched_; i++) total += of_[i].probability = exp(of_[i].log_weight - best);
  for (int i = 0; i < searched_; i++) of_[i].probability /= total;
  drop_unlikely(best);
}

void hypotheses::drop_unlikely(double best) {
  int kept = 1;
  for (int i = 1; i < searched_; i++) {
    bool drop = of_[i].weighed && of_[i].log_weight < best - kDropNats;
    for (int k = 0; k < kept; k++) drop |= same(of_[k].pose, of_[i].pose);
    if (drop) continue;
    of_[kept++] = of_[i];
  }
  searched_ = kept;
}

void hypotheses::adopt(int i) {
  const hypothesis own = of_[0];
  of_[0] = of_[i];
  of_[i] = own;
  of_[0].origin = kTracked;
  of_[i].origin = kSearched;
}

double hypotheses::searched_odds() const {
  double sum = 0.0;
  for (int i = 1; i < searched_; i++)
    if (of_[i].weighed) sum += of_[i].probability;
  return sum / (of_[0].probability > kLeastProbability ? of_[0].probability : kLeastProbability);
}

int hypotheses::best() const {
  int best = 0;
  for (int i = 1; i < searched_; i++)
    if (of_[i].probability > of_[best].probability) best = i;
  return best;
}

double hypotheses::aliased_odds() const {
  double sum = 0.0;
  for (int i = 0; i < aliased_; i++) sum += alias(i).odds;
  return sum;
}

int hypotheses::best_aliased() const {
  int best = aliased_ - 1;
  for (int i = 0; i < aliased_; i++)
    if (alias(i).explained > alias(best).explained) best = i;
  return best;
}

double hypotheses::likelier_for_m() const {
  int best = 0;
  for (int i = 1; i < aliased_; i++)
    if (alias(i).odds > alias(best).odds) best = i;
  return aliased_ > 0 ? way_m_ - alias(best).began_m : 0.0;
}

void hypotheses::forget_aliased_odds() {
  for (int i = 0; i < aliased_; i++) of_[kSearchedMax + i].odds = 0.0;
}

hypotheses::fit hypotheses::fit_at(const edge_map &map, const wm_pose2 &pose) const {
  fit f;
  const sin_cos h = sincos(pose.heading_rad);
  for (int i = 0; i < point_count_; i++) {
    const floor_edge &p = points_[i];
    const double px = (double)p.x_m, py = (double)p.y_m;
    const double rx = h.cos * px - h.sin * py, ry = h.sin * px + h.cos * py;
    const edge_line line = map.nearest(pose.x_m + rx, pose.y_m + ry);
    if (!line.found || line.distance_m > kExplained_m) {
      const double ray_x = (double)p.ray_x_m, ray_y = (double)p.ray_y_m;
      if (before_an_edge(map, pose.x_m + rx, pose.y_m + ry, h.cos * ray_x - h.sin * ray_y,
                         h.sin * ray_x + h.cos * ray_y))
        f.known += (double)points_[0].reflection / point_count_;
      continue;
    }
    f.explained += 1.0 / point_count_;
    f.known += 1.0 / point_count_;
    const vector<3> row(line.normal_x, line.normal_y, line.normal_y * rx - line.normal_x * ry);
    f.information.noalias() += row * row.transpose();
  }
  return f;
}

bool place_covariance(const matrix<3> &information, double out[6]) {
  matrix<3> a = information / (kCorrelatedPoints * square(kExplained_m)), inverse;
  a.diagonal() += vector<3>(1.0 / square(kOpen_m), 1.0 / square(kOpen_m), 1.0 / square(kOpen_rad));
  if (!invert_positive(a, &inverse)) return false;
  inverse.diagonal() += vector<3>(square(kFound_m), square(kFound_m), square(kFound_rad));
  for (int c = 0, k = 0; c < 3; c++)
    for (int r = 0; r <= c; r++) out[k++] = inverse(r, c);
  return true;
}

void hypotheses::update_aliased(const edge_map &map, const search_field &field, const floor_points &scan, double new_m,
                                double expected, double hazard, int poses) {
  expected_ = expected;
  if (scan.count < kPointsMin) return;
  point_count_ = take_evenly(scan.of, scan.count, kPoints, points_);
  nats_ = kNatsAKeyframe * square(information_weight(scan.count));
  way_m_ += new_m;
  hazard_ += hazard;
  weigh_aliased(map);
  poses -= kWeighingCost;
  if (poses <= 0) {
    sweep_.stop();
    return;
  }
  if (!sweep_.running()) begin_sweep(field, map);
  if (!sweep_.swept()) poses = sweep_.step(map, field, poses);
  if (!sweep_.swept()) return;
  for (; taken_ < sweep_.count() && poses > 0; taken_++) {
    const wm_pose2 pose = compose(sweep_[(int)taken_].pose, between(swept_odom_, odom_));
    if (listed_before(aliased_, pose)) continue;
    poses -= kTakingCost;
    if (poses >= 0) take_alias(map, pose);
  }
  if (taken_ >= sweep_.count()) sweep_.stop();
}

// Of those that explain more than the tracked pose the one that does by most and was not weighed since the robot moved.
int hypotheses::most_promising() const {
  int best = -1;
  for (int i = 0; i < aliased_; i++) {
    const hypothesis &a = alias(i);
    if (a.weighed_m < way_m_ && a.explained > kPromising && (best < 0 || a.explained > alias(best).explained)) best = i;
  }
  return best;
}

// The most promising, and others in turn.
void hypotheses::weigh_aliased(const edge_map &map) {
  const fit own_fit = fit_at(map, of_[0].pose);
  own_explained_ = own_fit.explained;
  own_known_ = own_fit.known;
  hypothesis *const aliases = of_ + kSearchedMax;
  int left = kWeighed;
  for (int n = 0; n < kFavoured; n++, left--) {
    const int i = most_promising();
    if (i < 0) break;
    if (!weigh_alias(map, &aliases[i]) || listed_before(i, aliases[i].pose)) aliases[i] = aliases[--aliased_];
  }
  if (left > aliased_) left = aliased_;
  for (; left > 0 && aliased_ > 0; left--) {
    if (next_aliased_ >= aliased_) next_aliased_ = 0;
    hypothesis &a = aliases[next_aliased_];
    if (weigh_alias(map, &a) && !listed_before(next_aliased_, a.pose))
      next_aliased_++;
    else
      a = aliases[--aliased_];
  }
}

// odds := odds exp(n (known - own - drift)) + hazard, n by the new distance in keyframes. Only up to the expected
// fraction: a right tracked pose explains no more either. False: the pose is no alias any more.
bool hypotheses::weigh_alias(const edge_map &map, hypothesis *a) const {
  align_pose(map, points_, point_count_, 2, 0.3, kExplained_m, 2, &a->pose);
  const fit f = fit_at(map, a->pose);
  const double new_m = way_m_ - a->weighed_m;
  const double nats = nats_ * (new_m < kKeyframe_m ? new_m / kKeyframe_m : 1.0);
  a->explained += kSmoothing * (f.explained - own_explained_ - a->explained);
  const double known = f.known < expected_ ? f.known : expected_;
  a->odds = a->odds * exp(nats * (known - own_known_ - kDrift)) + (hazard_ - a->hazard) / kAliasedMax;
  if (!(a->odds < kOddsMax)) a->odds = kOddsMax;
  if (a->odds < kOddsNone) a->began_m = way_m_;
  a->weighed_m = way_m_;
  a->hazard = hazard_;
  return place_covariance(f.information, a->covariance) && a->explained > -2.0 * kWorse &&
         !same_place(a->pose, of_[0].pose) && map.drivable(a->pose.x_m, a->pose.y_m);
}

bool hypotheses::listed_before(int end, const wm_pose2 &pose) const {
  for (int i = 0; i < end; i++)
    if (same_place(alias(i).pose, pose)) return true;
  return false;
}

void hypotheses::begin_sweep(const search_field &field, const edge_map &map) {
  const wm_pose2 &own = of_[0].pose;
  taken_ = 0;
  swept_odom_ = odom_;
  sweep_.begin(rotations_, 0.0);
  for (int k = 0; k < rotations_; k++) sweep_.set_heading(k, own.heading_rad + rotation_rad_[k]);
  for (int i = 0; i < point_count_; i++) {
    const double x = (double)points_[i].x_m, y = (double)points_[i].y_m;
    if (square(x) + square(y) < square(field.reach_m())) sweep_.add_point(field, map.raster().origin_yaw_rad, x, y);
  }
  sweep_.set_first(sweep_.points());
  sweep_.exclude(own);
  const int least =
      sweep_.score_at(field, map, own.x_m, own.y_m) - (int)((kWorse + kGridLoss) * 255.0 * sweep_.points());
  sweep_.set_least(least > 0 ? least : 0);
}

// Lists a pose if the newest scan fits there as well.
void hypotheses::take_alias(const edge_map &map, const wm_pose2 &pose) {
  hypothesis a{};
  a.origin = kAliased;
  a.pose = pose;
  align_pose(map, points_, point_count_, 2, 0.4, 2.0 * kExplained_m, 4, &a.pose);
  align_pose(map, points_, point_count_, 2, 0.2, kExplained_m, 3, &a.pose);
  const fit f = fit_at(map, a.pose);
  a.explained = f.explained - own_explained_;
  a.weighed_m = a.began_m = way_m_;
  a.hazard = hazard_;
  if (a.explained < -kWorse || !map.drivable(a.pose.x_m, a.pose.y_m) || same_place(a.pose, of_[0].pose) ||
      listed_before(aliased_, a.pose) || !place_covariance(f.information, a.covariance))
    return;
  int at = aliased_;
  if (aliased_ < kAliasedMax) {
    aliased_++;
  } else {
    for (int i = at = 0; i < aliased_; i++)
      if (alias(i).explained < alias(at).explained) at = i;
    if (alias(at).explained >= a.explained) return;
  }
  of_[kSearchedMax + at] = a;
}

}  // namespace wm
