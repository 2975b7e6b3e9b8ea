// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/aliased_poses.hpp"

#include "filters/edge_mcl/hypotheses.hpp"

namespace wm {
namespace {

constexpr double kBin_rad = kPi / 72.0;  // of walls' directions, which have no sign
constexpr int kBins = 72, kApartBins = 2;
constexpr double kSelfCorrelation = 0.25;  // of the histogram of walls' directions, least of a rotation; not swept
constexpr double kLookUpsMax = 1e5, kGrid_m = 0.1, kNearEdge_m = 0.3;  // of that histogram
constexpr int kPointsMin = 8;
constexpr double kWorse = 0.15;  // fraction of the points that a listed pose may explain less than the tracked one
constexpr double kExplained_m = 0.1, kCorrelatedPoints = 5.0;  // points of a scan whose errors are common
constexpr double kOpen_m = 0.3, kOpen_rad = 0.1;     // prior sigmas: half of what separates two places of a sweep
constexpr double kFound_m = 0.1, kFound_rad = 0.03;  // sigmas of the error that all points of a scan share
constexpr double kDrift = 0.05;  // fraction explained by which a wrong pose may be better for metres, by chance or bias
constexpr double kKeyframe_m = 0.4;                  // as in place_search
constexpr double kOddsMax = 50.0, kOddsNone = 1e-4;  // above the first, hypotheses decides
constexpr int kFavoured = 6;                         // of those weighed with each scan: the most promising
constexpr double kPromising = 0.2;                   // fraction explained beyond the tracked pose's
constexpr double kSmoothing = 0.5;                   // weight of the newest scan in `explained`
constexpr double kGridLoss = 0.15;  // mean score that a true place loses by half a step of places and headings

bool same(const wm_pose2 &a, const wm_pose2 &b) { return same_pose(a, b, kSweepApart_m, kSweepApart_rad); }

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

void aliased_poses::init(const edge_map &map) {
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
  clear({});
}

void aliased_poses::clear(const wm_pose2 &odom) {
  count_ = points_ = next_weighed_ = taken_ = 0;
  way_m_ = hazard_ = 0.0;
  sweep_.stop();
  odom_ = odom;
}

void aliased_poses::carry(const wm_pose2 &odom) {
  const wm_pose2 way = between(odom_, odom);
  odom_ = odom;
  for (int i = 0; i < count_; i++) of_[i].pose = compose(of_[i].pose, way);
}

void aliased_poses::choose_points(const floor_points &scan) {
  points_ = scan.count < kPoints ? scan.count : kPoints;
  reflection_ = (double)scan.reflection[0];
  nats_ = kNatsAKeyframe * square(information_weight(scan.count));
  for (int i = 0; i < points_; i++) {
    const int from = (int)((int64_t)i * scan.count / points_);
    x_m_[i] = scan.x_m[from];
    y_m_[i] = scan.y_m[from];
    ray_x_m_[i] = scan.ray_x_m[from];
    ray_y_m_[i] = scan.ray_y_m[from];
  }
}

double aliased_poses::odds() const {
  double sum = 0.0;
  for (int i = 0; i < count_; i++) sum += of_[i].odds;
  return sum;
}

int aliased_poses::best() const {
  int best = count_ - 1;
  for (int i = 0; i < count_; i++)
    if (of_[i].explained > of_[best].explained) best = i;
  return best;
}

double aliased_poses::likelier_for_m() const {
  int best = 0;
  for (int i = 1; i < count_; i++)
    if (of_[i].odds > of_[best].odds) best = i;
  return count_ > 0 ? way_m_ - of_[best].began_m : 0.0;
}

void aliased_poses::forget_odds() {
  for (int i = 0; i < count_; i++) of_[i].odds = 0.0;
}

aliased_poses::fit aliased_poses::fit_at(const edge_map &map, const wm_pose2 &pose) const {
  fit f;
  const sin_cos h = sincos(pose.heading_rad);
  for (int i = 0; i < points_; i++) {
    const double px = (double)x_m_[i], py = (double)y_m_[i];
    const double rx = h.cos * px - h.sin * py, ry = h.sin * px + h.cos * py;
    const edge_line line = map.nearest(pose.x_m + rx, pose.y_m + ry);
    if (!line.found || line.distance_m > kExplained_m) {
      const double ray_x = (double)ray_x_m_[i], ray_y = (double)ray_y_m_[i];
      if (before_an_edge(map, pose.x_m + rx, pose.y_m + ry, h.cos * ray_x - h.sin * ray_y,
                         h.sin * ray_x + h.cos * ray_y))
        f.known += reflection_ / points_;
      continue;
    }
    f.explained += 1.0 / points_;
    f.known += 1.0 / points_;
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

void aliased_poses::update(const edge_map &map, const search_field &field, const floor_points &scan,
                           const wm_pose2 &own, double new_m, double expected, double hazard, int poses) {
  expected_ = expected;
  if (scan.count < kPointsMin) return;
  choose_points(scan);
  way_m_ += new_m;
  hazard_ += hazard;
  weigh_some(map, own);
  poses -= kWeighingCost;
  if (poses <= 0) {
    sweep_.stop();
    return;
  }
  if (!sweep_.running()) begin_sweep(field, map, own);
  if (!sweep_.swept()) poses = sweep_.step(map, field, poses);
  if (!sweep_.swept()) return;
  for (; taken_ < sweep_.count() && poses > 0; taken_++) {
    const wm_pose2 pose = compose(sweep_[taken_].pose, between(swept_odom_, odom_));
    if (listed_before(count_, pose)) continue;
    poses -= kTakingCost;
    if (poses >= 0) take(map, own, pose);
  }
  if (taken_ >= sweep_.count()) sweep_.stop();
}

// Of those that explain more than the tracked pose the one that does by most and was not weighed since the robot moved.
int aliased_poses::most_promising() const {
  int best = -1;
  for (int i = 0; i < count_; i++) {
    const aliased_pose &a = of_[i];
    if (a.weighed_m < way_m_ && a.explained > kPromising && (best < 0 || a.explained > of_[best].explained)) best = i;
  }
  return best;
}

// The most promising, and others in turn.
void aliased_poses::weigh_some(const edge_map &map, const wm_pose2 &own) {
  const fit own_fit = fit_at(map, own);
  own_explained_ = own_fit.explained;
  own_known_ = own_fit.known;
  int left = kWeighed;
  for (int n = 0; n < kFavoured; n++, left--) {
    const int i = most_promising();
    if (i < 0) break;
    if (!weigh(map, own, &of_[i]) || listed_before(i, of_[i].pose)) of_[i] = of_[--count_];
  }
  if (left > count_) left = count_;
  for (; left > 0 && count_ > 0; left--) {
    if (next_weighed_ >= count_) next_weighed_ = 0;
    aliased_pose &a = of_[next_weighed_];
    if (weigh(map, own, &a) && !listed_before(next_weighed_, a.pose))
      next_weighed_++;
    else
      a = of_[--count_];
  }
}

// odds := odds exp(n (known - own - drift)) + hazard, n by the new distance in keyframes. Only up to the expected
// fraction: a right tracked pose explains no more either. False: the pose is no alias any more.
bool aliased_poses::weigh(const edge_map &map, const wm_pose2 &own, aliased_pose *a) const {
  align_pose(map, x_m_, y_m_, points_, 2, 0.3, kExplained_m, 2, &a->pose);
  const fit f = fit_at(map, a->pose);
  const double new_m = way_m_ - a->weighed_m;
  const double nats = nats_ * (new_m < kKeyframe_m ? new_m / kKeyframe_m : 1.0);
  a->explained += kSmoothing * (f.explained - own_explained_ - a->explained);
  const double known = f.known < expected_ ? f.known : expected_;
  a->odds = a->odds * exp(nats * (known - own_known_ - kDrift)) + (hazard_ - a->hazard) / kCapacity;
  if (!(a->odds < kOddsMax)) a->odds = kOddsMax;
  if (a->odds < kOddsNone) a->began_m = way_m_;
  a->weighed_m = way_m_;
  a->hazard = hazard_;
  return place_covariance(f.information, a->covariance) && a->explained > -2.0 * kWorse && !same(a->pose, own) &&
         map.drivable(a->pose.x_m, a->pose.y_m);
}

bool aliased_poses::listed_before(int end, const wm_pose2 &pose) const {
  for (int i = 0; i < end; i++)
    if (same(of_[i].pose, pose)) return true;
  return false;
}

void aliased_poses::begin_sweep(const search_field &field, const edge_map &map, const wm_pose2 &own) {
  taken_ = 0;
  swept_odom_ = odom_;
  sweep_.begin(rotations_, 0.0);
  for (int k = 0; k < rotations_; k++) sweep_.set_heading(k, own.heading_rad + rotation_rad_[k]);
  for (int i = 0; i < points_; i++) {
    const double x = (double)x_m_[i], y = (double)y_m_[i];
    if (square(x) + square(y) < square(field.reach_m())) sweep_.add_point(field, map.raster().origin_yaw_rad, x, y);
  }
  sweep_.set_first(sweep_.points());
  sweep_.exclude(own);
  const int least =
      sweep_.score_at(field, map, own.x_m, own.y_m) - (int)((kWorse + kGridLoss) * 255.0 * sweep_.points());
  sweep_.set_least(least > 0 ? least : 0);
}

// Lists a pose if the newest scan fits there as well.
void aliased_poses::take(const edge_map &map, const wm_pose2 &own, const wm_pose2 &pose) {
  aliased_pose a{};
  a.pose = pose;
  align_pose(map, x_m_, y_m_, points_, 2, 0.4, 2.0 * kExplained_m, 4, &a.pose);
  align_pose(map, x_m_, y_m_, points_, 2, 0.2, kExplained_m, 3, &a.pose);
  const fit f = fit_at(map, a.pose);
  a.explained = f.explained - own_explained_;
  a.weighed_m = a.began_m = way_m_;
  a.hazard = hazard_;
  if (a.explained < -kWorse || !map.drivable(a.pose.x_m, a.pose.y_m) || same(a.pose, own) ||
      listed_before(count_, a.pose) || !place_covariance(f.information, a.covariance))
    return;
  int at = count_;
  if (count_ < kCapacity) {
    count_++;
  } else {
    for (int i = at = 0; i < count_; i++)
      if (of_[i].explained < of_[at].explained) at = i;
    if (of_[at].explained >= a.explained) return;
  }
  of_[at] = a;
}

}  // namespace wm
