// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/lookalikes.hpp"

#include "filters/edge_mcl/align.hpp"
#include "filters/edge_mcl/keep_best.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kBin_rad = kPi / 72.0;  // of walls' directions, which have no sign
constexpr int kBins = 72, kApartBins = 2;
constexpr double kLikeItself = 0.25;  // share of the walls that must run alike
constexpr double kLookedUpMost = 1e5;
constexpr double kSame_m = 0.6, kSame_rad = 0.3;
constexpr double kWorse = 0.15;  // share of the points that a place may explain less than the tracked one
constexpr double kExplained_m = 0.1, kTogether = 5.0;  // so many of its points err together
constexpr double kOpen_m = 0.3, kOpen_rad = 0.1;       // where the scan says nothing: half of what parts two places
constexpr double kFound_m = 0.1, kFound_rad = 0.03;
// What a usual scan that is explained as a whole says against one that isn't at all; by chance or by a detector's bias
// a place may look better for metres, by kDrift of the points at least.
constexpr double kNats = 10.0, kDrift = 0.05, kKeyframe_m = 0.4;
constexpr double kOddsMost = 50.0, kNone = 1e-4;
constexpr int kFavoured = 6;  // of those weighed: the likeliest, with each scan
constexpr double kBetter = 0.2;
constexpr double kNewest = 0.5;  // what the newest scan counts of `explained`
// What a place may fall short of the tracked one by on the grid, in parts of what a point counts: half a step of it
// places and of headings, beside what it may explain less.
constexpr double kGridLoss = 0.15;
constexpr int kTakingCost = lookalikes::kLookUpCost * (7 * lookalikes::kPoints / 2 + lookalikes::kPoints);
constexpr int64_t kSwept = INT64_MAX;

double way2(const wm_pose2 &a, const wm_pose2 &b) { return square(a.x_m - b.x_m) + square(a.y_m - b.y_m); }

bool same(const wm_pose2 &a, const wm_pose2 &b) {
  return way2(a, b) < square(kSame_m) && std::fabs(wrap(a.heading_rad - b.heading_rad)) < kSame_rad;
}

}  // namespace

void lookalikes::init(const edge_map &map) {
  const wm_raster &r = map.raster();
  double share[kBins] = {}, alike[kBins] = {};
  double grid_px = 0.1 / r.resolution_m;
  const double area = (double)r.width_px * r.height_px;
  if (area / square(grid_px) > kLookedUpMost) grid_px = std::sqrt(area / kLookedUpMost);
  for (double row = 0.5 * grid_px; row < r.height_px; row += grid_px)
    for (double column = 0.5 * grid_px; column < r.width_px; column += grid_px) {
      double x, y;
      map.to_map(column, row, &x, &y);
      const edge_line line = map.nearest(x, y);
      if (!line.found || line.distance_m > 0.3) continue;
      const double angle = atan2(line.normal_y, line.normal_x);
      const int bin = (int)((angle < 0.0 ? angle + kPi : angle) / kBin_rad);
      for (int k = -1; k <= 1; k++) share[(bin + k + kBins) % kBins] += k == 0 ? 2.0 : 1.0;
    }
  for (int turn = 0; turn < kBins; turn++)
    for (int i = 0; i < kBins; i++) alike[turn] += share[i] * share[(i + turn) % kBins];
  relative_count_ = 0;
  const double least = kLikeItself * alike[0];
  for (int n = 0; n < kHeadingsMost / 2; n++) {
    int best = 0;
    for (int i = 1; i < kBins; i++)
      if (alike[i] > alike[best]) best = i;
    if (!(alike[best] > 0.0) || alike[best] < least) break;
    relative_[relative_count_++] = best * kBin_rad;
    relative_[relative_count_++] = best * kBin_rad + kPi;
    for (int k = -kApartBins; k <= kApartBins; k++) alike[(best + k + kBins) % kBins] = 0.0;
  }
  clear({});
}

void lookalikes::clear(const wm_pose2 &odom) {
  count_ = found_count_ = points_ = next_weighed_ = 0;
  way_m_ = hazard_ = 0.0;
  running_ = false;
  odom_ = odom;
}

void lookalikes::carry(const wm_pose2 &odom) {
  const wm_pose2 way = between(odom_, odom);
  odom_ = odom;
  for (int i = 0; i < count_; i++) of_[i].pose = compose(of_[i].pose, way);
}

void lookalikes::choose_points(const slack_points &scan) {
  points_ = scan.count < kPoints ? scan.count : kPoints;
  image_ = (double)scan.image[0];
  const double telling = information_weight(scan.count);
  nats_ = kNats * telling * telling;  // fewer points, and of simpler shapes
  for (int i = 0; i < points_; i++) {
    const int from = (int)((int64_t)i * scan.count / points_);
    x_m_[i] = scan.x_m[from];
    y_m_[i] = scan.y_m[from];
    ray_x_m_[i] = scan.ray_x_m[from];
    ray_y_m_[i] = scan.ray_y_m[from];
  }
}

double lookalikes::odds() const {
  double sum = 0.0;
  for (int i = 0; i < count_; i++) sum += of_[i].weight;
  return sum;
}

int lookalikes::best() const {
  int best = count_ - 1;
  for (int i = 0; i < count_; i++)
    if (of_[i].explained > of_[best].explained) best = i;
  return best;
}

double lookalikes::likelier_for_m() const {
  int best = 0;
  for (int i = 1; i < count_; i++)
    if (of_[i].weight > of_[best].weight) best = i;
  return count_ > 0 ? way_m_ - of_[best].began_m : 0.0;
}

void lookalikes::forget_odds() {
  for (int i = 0; i < count_; i++) of_[i].weight = 0.0;
}

lookalikes::fit lookalikes::fit_at(const edge_map &map, const wm_pose2 &pose) const {
  fit f{};
  const sin_cos h = sincos(pose.heading_rad);
  for (int i = 0; i < points_; i++) {
    const double px = (double)x_m_[i], py = (double)y_m_[i];
    const double rx = h.cos * px - h.sin * py, ry = h.sin * px + h.cos * py;
    const edge_line line = map.nearest(pose.x_m + rx, pose.y_m + ry);
    if (!line.found || line.distance_m > kExplained_m) {
      const double ray_x = (double)ray_x_m_[i], ray_y = (double)ray_y_m_[i];
      if (before_an_edge(map, pose.x_m + rx, pose.y_m + ry, h.cos * ray_x - h.sin * ray_y,
                         h.sin * ray_x + h.cos * ray_y))
        f.known += image_ / points_;
      continue;
    }
    f.explained += 1.0 / points_;
    f.known += 1.0 / points_;
    const double row[3] = {line.normal_x, line.normal_y, line.normal_y * rx - line.normal_x * ry};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) f.information[r][c] += row[r] * row[c];
  }
  return f;
}

bool place_covariance(const double information[3][3], double out[6]) {
  const double open[3] = {1.0 / square(kOpen_m), 1.0 / square(kOpen_m), 1.0 / square(kOpen_rad)};
  const double lasting[3] = {square(kFound_m), square(kFound_m), square(kFound_rad)};
  double a[kAlignStates][kAlignStates] = {}, inverse[kAlignStates][kAlignStates];
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++)
      a[r][c] = information[r][c] / (kTogether * square(kExplained_m)) + (r == c ? open[r] : 0.0);
  if (!invert_positive(a, 3, inverse)) return false;
  for (int c = 0, k = 0; c < 3; c++)
    for (int r = 0; r <= c; r++) out[k++] = inverse[r][c] + (r == c ? lasting[r] : 0.0);
  return true;
}

void lookalikes::look(const edge_map &map, const search_field &field, const slack_points &scan, const wm_pose2 &own,
                      double new_m, double expected, double hazard, int poses) {
  expected_ = expected;
  if (scan.count < 8) return;
  choose_points(scan);
  way_m_ += new_m;
  hazard_ += hazard;
  weigh(map, own);
  poses -= kWeighingCost;
  if (poses <= 0) {
    running_ = false;
    return;
  }
  if (!running_) begin(field, map, own);
  poses = sweep(map, field, poses);
  if (next_ < kSwept) return;
  for (; taken_ < found_count_ && poses > 0; taken_++) {
    const wm_pose2 pose = compose(found_[taken_].pose, between(swept_odom_, odom_));
    if (listed_before(count_, pose)) continue;
    poses -= kTakingCost;
    if (poses >= 0) take(map, own, pose);
  }
  running_ = taken_ < found_count_;
}

// Of those that explain more than the tracked place the one that does by most and wasn't weighed since the robot moved.
int lookalikes::likeliest_unweighed() const {
  int best = -1;
  for (int i = 0; i < count_; i++) {
    const lookalike &l = of_[i];
    if (l.weighed_m < way_m_ && l.explained > kBetter && (best < 0 || l.explained > of_[best].explained)) best = i;
  }
  return best;
}

// Some of them: the likeliest, and others in turn.
void lookalikes::weigh(const edge_map &map, const wm_pose2 &own) {
  const fit own_fit = fit_at(map, own);
  own_explained_ = own_fit.explained;
  own_known_ = own_fit.known;
  int left = kWeighed;
  for (int n = 0; n < kFavoured; n++, left--) {
    const int i = likeliest_unweighed();
    if (i < 0) break;
    if (!weigh(map, own, &of_[i]) || listed_before(i, of_[i].pose)) of_[i] = of_[--count_];
  }
  if (left > count_) left = count_;
  for (; left > 0 && count_ > 0; left--) {
    if (next_weighed_ >= count_) next_weighed_ = 0;
    lookalike &l = of_[next_weighed_];
    if (weigh(map, own, &l) && !listed_before(next_weighed_, l.pose))
      next_weighed_++;
    else
      l = of_[--count_];
  }
}

bool lookalikes::weigh(const edge_map &map, const wm_pose2 &own, lookalike *l) const {
  align_pose(map, x_m_, y_m_, points_, 2, 0.3, kExplained_m, 2, &l->pose);
  const fit f = fit_at(map, l->pose);
  const double new_m = way_m_ - l->weighed_m;
  const double nats = nats_ * (new_m < kKeyframe_m ? new_m / kKeyframe_m : 1.0);
  l->explained += kNewest * (f.explained - own_explained_ - l->explained);
  // What is explained beyond the usual speaks for no place: the tracked one explains no more where it is the right one.
  const double known = f.known < expected_ ? f.known : expected_;
  l->weight = l->weight * exp(nats * (known - own_known_ - kDrift)) + (hazard_ - l->hazard) / kMost;
  if (!(l->weight < kOddsMost)) l->weight = kOddsMost;  // from there on it is for the search to say which it is
  if (l->weight < kNone) l->began_m = way_m_;
  l->weighed_m = way_m_;
  l->hazard = hazard_;
  return place_covariance(f.information, l->covariance) && l->explained > -2.0 * kWorse && !same(l->pose, own) &&
         map.drivable(l->pose.x_m, l->pose.y_m);
}

bool lookalikes::listed_before(int end, const wm_pose2 &pose) const {
  for (int i = 0; i < end; i++)
    if (same(of_[i].pose, pose)) return true;
  return false;
}

void lookalikes::begin(const search_field &field, const edge_map &map, const wm_pose2 &own) {
  running_ = true;
  next_ = 0;
  found_count_ = taken_ = 0;
  swept_from_ = own;
  swept_odom_ = odom_;
  swept_points_ = 0;
  for (int i = 0; i < points_; i++) {
    const double x = (double)x_m_[i], y = (double)y_m_[i];
    if (square(x) + square(y) >= square(field.reach_m())) continue;
    for (int k = 0; k < relative_count_; k++) {
      const sin_cos h = sincos(own.heading_rad + relative_[k] - map.raster().origin_yaw_rad);
      steps_[k][swept_points_] = field.step(h.cos * x - h.sin * y, -(h.sin * x + h.cos * y));
    }
    swept_points_++;
  }
  const int own_sum = field.sum(field.nearest(map, own.x_m, own.y_m), steps_[0], swept_points_);
  least_ = own_sum - (int)((kWorse + kGridLoss) * 255.0 * swept_points_);
  if (least_ < 0) least_ = 0;
}

// Returns what is left of `poses`.
int lookalikes::sweep(const edge_map &map, const search_field &field, int poses) {
  if (next_ == kSwept) return poses;
  const int64_t all = field.runs() * field.rows();
  for (; next_ < all && poses >= kRunCostMost; next_++)
    poses -= look_from(map, field, next_ % field.runs(), next_ / field.runs());
  if (next_ >= all) next_ = kSwept;
  return poses;
}

// Where the points fit from the places of a run, in each heading: of neighbours the best. Returns what it cost.
int lookalikes::look_from(const edge_map &map, const search_field &field, int64_t run, int64_t row) {
  const uint32_t standing = field.standing(run, row);
  if (standing == 0) return kRunCost;
  uint16_t sums[kHeadingsMost][search_field::kRun];
  bool reached[kHeadingsMost];
  const auto least = [this] {
    const bool full = found_count_ == kMost;
    return full && found_[kMost - 1].score > least_ ? (int)found_[kMost - 1].score : least_;
  };
  field.sum_run(field.corner_of(run, row), steps_[0], kPoints, relative_count_, swept_points_, least(), sums, reached);
  int cost = kRunCost + relative_count_ * kHeadingCost;
  for (int k = 0; k < relative_count_; k++) {
    if (!reached[k]) continue;
    const uint16_t *of = sums[k];
    for (int i = 0; i < search_field::kRun; i++) {
      if (!(standing >> i & 1) || of[i] <= least()) continue;
      if ((i > 0 && of[i - 1] > of[i]) || (i + 1 < search_field::kRun && of[i + 1] > of[i])) continue;
      wm_pose2 pose;
      field.place_of(map, run, row, i, &pose.x_m, &pose.y_m);
      pose.heading_rad = wrap(swept_from_.heading_rad + relative_[k]);
      if (!same(pose, swept_from_)) keep_best(found_, &found_count_, {pose, of[i]}, same);
      cost += kOfferCost;
    }
  }
  return cost;
}

// If the newest scan fits there as well, it is a place that is possible.
void lookalikes::take(const edge_map &map, const wm_pose2 &own, const wm_pose2 &pose) {
  lookalike l{};
  l.pose = pose;
  align_pose(map, x_m_, y_m_, points_, 2, 0.4, 2.0 * kExplained_m, 4, &l.pose);
  align_pose(map, x_m_, y_m_, points_, 2, 0.2, kExplained_m, 3, &l.pose);
  const fit f = fit_at(map, l.pose);
  l.explained = f.explained - own_explained_;
  l.weighed_m = l.began_m = way_m_;
  l.hazard = hazard_;
  if (l.explained < -kWorse || !map.drivable(l.pose.x_m, l.pose.y_m) || same(l.pose, own) ||
      listed_before(count_, l.pose) || !place_covariance(f.information, l.covariance))
    return;
  int at = count_;
  if (count_ < kMost) {
    count_++;
  } else {
    for (int i = at = 0; i < count_; i++)
      if (of_[i].explained < of_[at].explained) at = i;
    if (of_[at].explained >= l.explained) return;
  }
  of_[at] = l;
}

}  // namespace wm
