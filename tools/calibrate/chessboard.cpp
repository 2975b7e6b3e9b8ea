// SPDX-License-Identifier: Apache-2.0
// Saddles put together to a lattice.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <optional>

#include "calibrate/corners.h"

namespace wm::calibrate {
namespace {

using tools::GreyPicture;
using Place = std::pair<int, int>;  // column, row

constexpr int kSteps[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};

class Grower {
 public:
  Grower(const GreyPicture &picture, const std::vector<CornerCandidate> &saddles)
      : picture_(picture), saddles_(saddles) {}

  // The lattice around a saddle; empty where it has not two neighbours of different directions.
  std::map<Place, size_t> grow(size_t seed) {
    std::map<Place, size_t> lattice{{{0, 0}, seed}};
    used_.assign(saddles_.size(), false);
    used_[seed] = true;
    if (!first_cross(seed, lattice)) return {};
    std::deque<Place> open;
    for (const auto &[place, index] : lattice) open.push_back(place);
    while (!open.empty()) {
      const Place from = open.front();
      open.pop_front();
      for (const auto &step : kSteps) {
        const Place to{from.first + step[0], from.second + step[1]};
        if (lattice.contains(to)) continue;
        const std::optional<size_t> next = neighbour(lattice, from, step);
        if (!next) continue;
        lattice[to] = *next;
        used_[*next] = true;
        open.push_back(to);
        open.push_back(from);
      }
    }
    return lattice;
  }

 private:
  [[nodiscard]] const Vec2 &at(size_t i) const { return saddles_[i].pixel; }

  // Contrast across the link from a to b, left minus right, the least of several places along it; 0 where it changes
  // its sign: a link along an edge of squares has black on one side, white on the other.
  [[nodiscard]] double edge(const Vec2 &a, const Vec2 &b) const {
    const Vec2 link = b - a;
    const double length = link.norm();
    const Vec2 normal = Vec2(-link.y(), link.x()) / length * std::clamp(0.2 * length, 1.5, 6.0);
    double least = 0;
    for (const double s : {0.25, 0.4, 0.5, 0.6, 0.75}) {
      const Vec2 p = a + s * link;
      const double contrast = sample(p + normal) - sample(p - normal);
      if (s > 0.25 && contrast * least <= 0) return 0;
      if (s <= 0.25 || std::fabs(contrast) < std::fabs(least)) least = contrast;
    }
    return std::fabs(least) >= 8 ? least : 0;
  }

  [[nodiscard]] double sample(const Vec2 &p) const {
    const int x = std::clamp(static_cast<int>(std::lround(p.x())), 1, picture_.width - 2),
              y = std::clamp(static_cast<int>(std::lround(p.y())), 1, picture_.height - 2);
    return (2.0 * picture_.at(x, y) + picture_.at(x - 1, y) + picture_.at(x + 1, y) + picture_.at(x, y - 1) +
            picture_.at(x, y + 1)) /
           6;
  }

  // The seed's nearest neighbours along edges: one, and one across it whose edge has the other sign.
  bool first_cross(size_t seed, std::map<Place, size_t> &lattice) {
    std::vector<size_t> near;
    for (size_t i = 0; i < saddles_.size(); i++)
      if (i != seed) near.push_back(i);
    const size_t count = std::min<size_t>(near.size(), 14);
    std::partial_sort(
        near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end(),
        [&](size_t a, size_t b) { return (at(a) - at(seed)).squaredNorm() < (at(b) - at(seed)).squaredNorm(); });
    near.resize(count);
    for (const size_t first : near) {
      const double side = edge(at(seed), at(first));
      if (side == 0) continue;
      const Vec2 u = (at(first) - at(seed)).normalized();
      for (const size_t second : near) {
        const Vec2 w = (at(second) - at(seed)).normalized();
        const double turn = u.x() * w.y() - u.y() * w.x();
        if (turn < 0.4 || edge(at(seed), at(second)) * side >= 0) continue;
        lattice[{1, 0}] = first;
        lattice[{0, 1}] = second;
        used_[first] = used_[second] = true;
        return true;
      }
      return false;
    }
    return false;
  }

  // Where the lattice says that the next corner is: on from the last step, by a step beside it, or by the one before.
  [[nodiscard]] std::optional<Vec2> predict(const std::map<Place, size_t> &lattice, Place from,
                                            const int step[2]) const {
    const auto find = [&](int c, int r) -> std::optional<Vec2> {
      const auto place = lattice.find({from.first + c, from.second + r});
      return place == lattice.end() ? std::nullopt : std::optional<Vec2>(at(place->second));
    };
    const Vec2 here = *find(0, 0);
    const auto back = find(-step[0], -step[1]), back2 = find(-2 * step[0], -2 * step[1]);
    if (back && back2) return 3 * here - 3 * *back + *back2;  // with the bend of the last three
    Vec2 sum = Vec2::Zero();
    int count = 0;
    for (const int side : {-1, 1}) {
      const auto beside = find(side * step[1], side * step[0]),
                 ahead = find(side * step[1] + step[0], side * step[0] + step[1]);
      if (!beside || !ahead) continue;
      sum += *ahead - *beside;
      count++;
    }
    if (back) sum += here - *back, count++;
    return count > 0 ? std::optional<Vec2>(here + sum / count) : std::nullopt;
  }

  [[nodiscard]] std::optional<size_t> neighbour(const std::map<Place, size_t> &lattice, Place from,
                                                const int step[2]) const {
    const std::optional<Vec2> guess = predict(lattice, from, step);
    const Vec2 here = at(lattice.at(from));
    if (!guess) return {};
    const double reach = 0.4 * (*guess - here).norm();
    std::optional<size_t> best;
    double nearest = reach;
    for (size_t i = 0; i < saddles_.size(); i++) {
      const double off = (at(i) - *guess).norm();
      if (used_[i] || off >= nearest) continue;
      nearest = off;
      best = i;
    }
    // Squares alternate: two links of one line lie in opposite colours.
    if (!best || edge(here, at(*best)) == 0) return {};
    const auto back = lattice.find({from.first - step[0], from.second - step[1]});
    if (back != lattice.end() && edge(at(back->second), here) * edge(here, at(*best)) >= 0) return {};
    return best;
  }

  const GreyPicture &picture_;
  const std::vector<CornerCandidate> &saddles_;
  std::vector<bool> used_;
};

bool fits_board(const std::map<Place, size_t> &lattice, int columns, int rows) {
  int c0 = 0, c1 = 0, r0 = 0, r1 = 0;
  for (const auto &[place, index] : lattice) {
    c0 = std::min(c0, place.first), c1 = std::max(c1, place.first);
    r0 = std::min(r0, place.second), r1 = std::max(r1, place.second);
  }
  const int wide = c1 - c0 + 1, high = r1 - r0 + 1;
  if (lattice.size() < 12 || wide < 3 || high < 3) return false;
  return columns <= 0 || (wide <= columns && high <= rows) || (wide <= rows && high <= columns);
}

}  // namespace

std::vector<BoardCorner> grow_chessboard(const GreyPicture &picture, int columns, int rows) {
  const std::vector<CornerCandidate> saddles = find_saddles(picture);
  Grower grower(picture, saddles);
  std::map<Place, size_t> best;
  std::vector<bool> tried(saddles.size(), false);
  constexpr size_t kSeeds = 60;
  size_t seeds = 0;
  for (size_t i = 0; i < saddles.size() && seeds < kSeeds; i++) {
    if (tried[i]) continue;
    seeds++;
    const std::map<Place, size_t> lattice = grower.grow(i);
    for (const auto &[place, index] : lattice) tried[index] = true;
    if (lattice.size() > best.size() && fits_board(lattice, columns, rows)) best = lattice;
  }
  std::vector<BoardCorner> out;
  out.reserve(best.size());
  for (const auto &[place, index] : best) out.push_back({saddles[index].pixel, Vec2(place.first, place.second)});
  return out;
}

LatticeSize lattice_size(const std::vector<BoardCorner> &corners) {
  if (corners.empty()) return {};
  Vec2 low = corners[0].board, high = low;
  for (const BoardCorner &corner : corners) low = low.cwiseMin(corner.board), high = high.cwiseMax(corner.board);
  return {static_cast<int>(high.x() - low.x()) + 1, static_cast<int>(high.y() - low.y()) + 1};
}

LatticeSize full_size(const std::vector<BoardCorner> &corners) {
  int lines[2] = {};
  for (const int side : {0, 1}) {
    std::map<long, size_t> count;
    size_t most = 0;
    for (const BoardCorner &corner : corners) most = std::max(most, ++count[std::lround(corner.board[side])]);
    for (const auto &[line, n] : count) lines[side] += 2 * n >= most ? 1 : 0;
  }
  return {lines[0], lines[1]};
}

namespace {

constexpr double kSharpened_px = 1.5;  // smoothing that takes the rims of a camera's sharpening away
constexpr int kWindowFirst_px = 4;     // half of the window that found them
constexpr double kWindow = 0.2;        // of the spacing: the next corner's edges stay outside
constexpr double kWindowMax_px = 8;

// Every corner once more, with a window that the squares around it allow: the larger, the less noise.
void refine_by_spacing(const GreyPicture &picture, std::vector<BoardCorner> &corners) {
  const std::vector<BoardCorner> before = corners;
  for (BoardCorner &corner : corners) {
    double spacing = 1e9;
    for (const BoardCorner &other : before)
      if (std::fabs((other.board - corner.board).norm() - 1) < 1e-6)
        spacing = std::min(spacing, (other.pixel - corner.pixel).norm());
    const int window = static_cast<int>(std::min(kWindow * spacing, kWindowMax_px));
    Vec2 pixel = corner.pixel;
    if (window > kWindowFirst_px && spacing < 1e8 && refine_corner(picture, window, pixel) &&
        (pixel - corner.pixel).norm() < 1.5)
      corner.pixel = pixel;
  }
}

}  // namespace

std::vector<BoardCorner> find_chessboard(const GreyPicture &picture, int columns, int rows) {
  std::vector<BoardCorner> found = grow_chessboard(picture, columns, rows);
  const auto all = static_cast<size_t>(std::max(0, columns * rows));
  if (all > 0 && found.size() < all) {
    std::vector<BoardCorner> whole = find_whole_chessboard(picture, columns, rows);
    if (whole.size() > found.size()) found = std::move(whole);
  }
  if (found.empty()) {
    found = grow_chessboard(smoothed(picture, kSharpened_px), columns, rows);
    for (BoardCorner &corner : found) {
      Vec2 pixel = corner.pixel;
      if (refine_corner(picture, kWindowFirst_px, pixel) && (pixel - corner.pixel).norm() < 1.5) corner.pixel = pixel;
    }
  }
  refine_by_spacing(picture, found);
  return found;
}

}  // namespace wm::calibrate
