// SPDX-License-Identifier: Apache-2.0
#include "filters/relocalize/line_search.hpp"

#include <cstdint>

#include "math/arc.hpp"
#include "math/eigen.hpp"

// Constants were chosen on loops-lines (waymark-montecarlo --trials --renumber, seeds 1 to 6) and not swept.
namespace wm {
namespace {

constexpr int kCellsAStep = 512;                         // 1 to 2 ms with 30 bearings and 80 landmarks
constexpr int kMostCells = 8192;                         // 16 looks; larger maps get larger cells
constexpr double kCell_m = 0.25, kCellGrowth = 1.4;      // from cell to cell, a landmark at 3 m moves by 0.06 rad
constexpr double kMargin_m = 1.5;                        // around the map's landmarks
constexpr double kRange_m = 12.0, kNearest_m = 0.1;      // landmarks farther or nearer are not visible
constexpr int kBins = 96;                                // of the heading, 0.065 rad
constexpr int kRefinements = 12;                         // half of them while the gate narrows
constexpr double kWideGate_rad = 0.2, kGate_rad = 0.02;  // of an azimuth: at first, and at the end
constexpr double kDamping = 1e-6;                        // of the normal equations, 1/m2 and 1/rad2
constexpr int kFewest = 6;                               // bearings; fewer have no pattern
constexpr double kShare = 0.7;                           // of the bearings must be explained
constexpr double kLead = 0.15;                           // of the bearings: another pose must explain that many fewer
constexpr double kSigma_rad = 0.01;                      // of a bearing, with the landmark's error
constexpr double kLeast_m = 0.03, kLeast_rad = 0.01;     // sigmas added to those of a found pose

// The landmark whose azimuth from `eye` is nearest to the bearing; -1: none within the gate.
int nearest(const wm_pose2 &eye, double bearing_rad, const landmark_places &map, double gate_rad, double *off_rad) {
  int best = -1;
  const sin_cos ray = sincos(eye.heading_rad + bearing_rad);
  for (int i = 0; i < map.count; i++) {
    const double dx = map.data[i * map.stride] - eye.x_m, dy = map.data[i * map.stride + 1] - eye.y_m;
    const double ahead = ray.cos * dx + ray.sin * dy, across = ray.cos * dy - ray.sin * dx;
    if (!(ahead > kNearest_m) || ahead > kRange_m || std::fabs(across) > gate_rad * ahead) continue;
    gate_rad = std::fabs(across) / ahead;
    *off_rad = -across / ahead;
    best = i;
  }
  return best;
}

// One step of Gauss-Newton on the bearings within the gate; false where they leave the pose open.
bool refine(const bearing_look &look, const landmark_places &map, double gate_rad, wm_pose2 *pose, matrix<3> *inverse) {
  const wm_pose2 eye = compose(*pose, look.sensor);
  const double lever_x = eye.x_m - pose->x_m, lever_y = eye.y_m - pose->y_m;
  matrix<3> a = matrix<3>::Identity() * kDamping;
  vector<3> b = vector<3>::Zero();
  for (int k = 0; k < look.count; k++) {
    double off;
    const int i = nearest(eye, look.bearing_rad[k], map, gate_rad, &off);
    if (i < 0) continue;
    const double dx = map.data[i * map.stride] - eye.x_m, dy = map.data[i * map.stride + 1] - eye.y_m;
    const double q = dx * dx + dy * dy;
    vector<3> row;  // of the expected bearing
    row << dy / q, -dx / q, -1.0 - (lever_y * dy + lever_x * dx) / q;
    a += row * row.transpose();
    b += row * off;
  }
  if (!invert_positive(a, inverse)) return false;
  const vector<3> move = *inverse * b;
  pose->x_m += move[0];
  pose->y_m += move[1];
  pose->heading_rad = wrap(pose->heading_rad + move[2]);
  return finite(move.sum());
}

void put_covariance(const matrix<3> &inverse, double out[3][3]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out[i][j] = square(kSigma_rad) * inverse(i, j);
  for (int i = 0; i < 3; i++) out[i][i] += square(i < 2 ? kLeast_m : kLeast_rad);
}

}  // namespace

int line_search::explained(const bearing_look &look, const wm_pose2 &pose, const landmark_places &map,
                           double gate_rad) {
  const wm_pose2 eye = compose(pose, look.sensor);
  int count = 0;
  double off;
  for (int k = 0; k < look.count; k++) count += nearest(eye, look.bearing_rad[k], map, gate_rad, &off) >= 0;
  return count;
}

void line_search::begin(const bearing_look &look, const wm_pose2 &odom, const landmark_places &map) {
  look_ = look;
  odom_ = odom;
  candidates_.clear();
  double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
  for (int i = 0; i < map.count; i++)
    for (int k = 0; k < 2; k++) {
      const double at = map.data[i * map.stride + k];
      low[k] = at < low[k] ? at : low[k];
      high[k] = at > high[k] ? at : high[k];
    }
  step_m_ = kCell_m;
  for (;; step_m_ *= kCellGrowth) {
    for (int k = 0; k < 2; k++) {
      corner_m_[k] = low[k] - kMargin_m;
      cells_[k] = 1 + (int)((high[k] - low[k] + 2.0 * kMargin_m) / step_m_);
    }
    if ((double)cells_[0] * cells_[1] <= kMostCells) break;
  }
}

// Votes for the heading of a sensor at `place`, each bearing once a bin. Two neighbouring bins count together, since a
// heading may lie between them.
void line_search::vote(const wm_pose2 &place, const landmark_places &map) {
  uint8_t votes[kBins] = {};
  uint32_t voted[kBins] = {};
  for (int i = 0; i < map.count; i++) {
    const double dx = map.data[i * map.stride] - place.x_m, dy = map.data[i * map.stride + 1] - place.y_m;
    if (dx * dx + dy * dy > square(kRange_m)) continue;
    const double azimuth = atan2(dy, dx);
    for (int k = 0; k < look_.count; k++) {
      double turn = azimuth - look_.bearing_rad[k];
      turn -= kTwoPi * std::floor(turn / kTwoPi);
      int bin = (int)(turn * (kBins / kTwoPi));
      if (bin >= kBins) bin = 0;
      if (voted[bin] >> k & 1u) continue;
      voted[bin] |= 1u << k;
      votes[bin]++;
    }
  }
  for (int bin = 0; bin < kBins; bin++) {
    const int next = bin + 1 == kBins ? 0 : bin + 1;
    int both = 0;
    for (uint32_t bits = voted[bin] | voted[next]; bits != 0; bits &= bits - 1) both++;
    if (2 * both < look_.count) continue;
    const wm_pose2 eye = {place.x_m, place.y_m, wrap((bin + 1) * (kTwoPi / kBins))};
    candidates_.offer({compose(eye, between(look_.sensor, wm_pose2{})), both, 0});
  }
}

// Refines each candidate with its own look, then, carried on by odometry, with the newest one.
line_search_result line_search::verify(const bearing_look &now, const wm_pose2 &odom, const landmark_places &map) {
  line_search_result out{};
  const wm_pose2 way = between(odom_, odom);
  int best = 0, second = 0;
  for (int c = 0; c < candidates_.count; c++) {
    wm_pose2 pose = candidates_.best[c].pose;
    matrix<3> inverse;
    bool good = true;
    const auto converge = [&](const bearing_look &look) {
      for (int round = 0; round < kRefinements && good; round++) {
        const double gate = round < kRefinements / 2 ? kWideGate_rad / (1 + round) : kGate_rad;
        good = refine(look, map, gate, &pose, &inverse);
      }
    };
    converge(look_);
    pose = compose(pose, way);
    converge(now);
    if (!good) continue;
    const int score = explained(now, pose, map, kGate_rad);
    const bool same = best > 0 && are_near(pose, out.pose);
    if (score <= best) {
      if (!same && score > second) second = score;
      continue;
    }
    if (!same) second = best;
    best = score;
    out.pose = pose;
    put_covariance(inverse, out.covariance);
  }
  out.found = best >= kFewest && best >= kShare * now.count && best - second >= kLead * now.count;
  return out;
}

line_search_result line_search::step(const bearing_look &now, const wm_pose2 &odom, const landmark_places &map) {
  line_search_result out{};
  if (now.count < kFewest || map.count < kFewest) return out;
  if (cell_ == 0) begin(now, odom, map);
  const int all = cells_[0] * cells_[1];
  for (int n = 0; n < kCellsAStep && cell_ < all; n++, cell_++) {
    const int row = cell_ / cells_[0], column = cell_ % cells_[0];
    vote({corner_m_[0] + step_m_ * column, corner_m_[1] + step_m_ * row, 0.0}, map);
  }
  if (cell_ < all) return out;
  cell_ = 0;
  return verify(now, odom, map);
}

}  // namespace wm
