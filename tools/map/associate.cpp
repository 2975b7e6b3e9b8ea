// SPDX-License-Identifier: Apache-2.0
#include "map/associate.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/statistics.h"

namespace wm::tools {
namespace {

using Eigen::Index;

// Of chi-square with two degrees of freedom: a pair of places. A pair that is not found is a landmark twice; a wrong
// one is found by the drive's chi-square.
constexpr double kGate = 0.99999;
constexpr double kReach_sigma = 3;  // of a distance between two landmarks
constexpr double kLeast_m = 2;      // apart: nearer ones do not show a turn
constexpr double kEnough = 0.95;    // of the landmarks are paired: no other motion is tried
constexpr size_t kTries = 100000;   // motions, then the best one is taken: some seconds
constexpr size_t kPairs = 4;        // landmarks that must fit at once: fewer fit by chance

using Place = KnownPlace;

Eigen::Matrix2d rotation(double angle) {
  Eigen::Matrix2d out;
  out << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return out;
}

// Places with the covariance of the map's shape: what is left of it when the map is laid over another one, Q P Q' with
// Q = I - G (G'G)^-1 G', G the derivatives by shift and turn. Where a drive began is no matter.
std::vector<Place> places_of(const DriveMap &drive) {
  const auto count = static_cast<Index>(drive.landmarks.size());
  std::vector<Index> at;
  Eigen::MatrixXd G(2 * count, 3);
  Eigen::Vector2d centre(0, 0);
  for (Index j = 0; j < count; j++) centre += drive.mean.segment<2>(j * drive.width) / static_cast<double>(count);
  for (Index j = 0; j < count; j++) {
    const Eigen::Vector2d way = drive.mean.segment<2>(j * drive.width) - centre;
    G.middleRows<2>(2 * j) << 1, 0, -way.y(), 0, 1, way.x();
    at.insert(at.end(), {j * drive.width, j * drive.width + 1});
  }
  for (int k = 0; k < 3; k++) G.col(k) /= std::max(G.col(k).norm(), 1e-9);  // orthogonal about the centre
  Eigen::MatrixXd shape(2 * count, 2 * count);
  for (Index i = 0; i < 2 * count; i++)
    for (Index j = 0; j < 2 * count; j++)
      shape(i, j) = drive.covariance(at[static_cast<size_t>(i)], at[static_cast<size_t>(j)]);
  shape -= G * (G.transpose() * shape);
  shape -= (shape * G) * G.transpose();
  std::vector<Place> out;
  for (Index j = 0; j < count; j++)
    out.push_back({drive.mean.segment<2>(j * drive.width), shape.block<2, 2>(2 * j, 2 * j), static_cast<int>(j)});
  return out;
}

double sigma(const Place &a, const Place &b) { return std::sqrt((a.covariance + b.covariance).trace()); }

struct Pair {
  size_t of_drive, of_map;
};

double distance2(const Place &a, const Place &b, const Eigen::Vector3d &frame) {
  const Eigen::Matrix2d turned = rotation(frame.z());
  const Eigen::Vector2d way = frame.head<2>() + turned * a.p_m - b.p_m;
  const Eigen::Matrix2d S = b.covariance + turned * a.covariance * turned.transpose();
  return (S(1, 1) * way.x() * way.x() - 2 * S(0, 1) * way.x() * way.y() + S(0, 0) * way.y() * way.y()) /
         S.determinant();
}

// Each other's nearest within the gate.
std::vector<Pair> pairs_in(const std::vector<Place> &drive, const std::vector<Place> &map,
                           const Eigen::Vector3d &frame) {
  static const double kLimit = chi2_quantile(kGate, 2);
  const auto nearest = [&](const auto &distance, size_t count) {
    size_t best = 0;
    for (size_t i = 1; i < count; i++)
      if (distance(i) < distance(best)) best = i;
    return best;
  };
  std::vector<Pair> out;
  for (size_t j = 0; j < drive.size(); j++) {
    const size_t to = nearest([&](size_t i) { return distance2(drive[j], map[i], frame); }, map.size());
    if (distance2(drive[j], map[to], frame) > kLimit) continue;
    if (nearest([&](size_t i) { return distance2(drive[i], map[to], frame); }, drive.size()) == j)
      out.push_back({j, to});
  }
  return out;
}

// The motion that lays all pairs over each other best [Horn1987].
Eigen::Vector3d motion(const std::vector<Place> &drive, const std::vector<Place> &map, const std::vector<Pair> &pairs) {
  Eigen::Vector2d from(0, 0), to(0, 0);
  for (const Pair &pair : pairs)
    from += drive[pair.of_drive].p_m / static_cast<double>(pairs.size()),
        to += map[pair.of_map].p_m / static_cast<double>(pairs.size());
  double along = 0, across = 0;
  for (const Pair &pair : pairs) {
    const Eigen::Vector2d a = drive[pair.of_drive].p_m - from, b = map[pair.of_map].p_m - to;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  const double angle = std::atan2(across, along);
  const Eigen::Vector2d shift = to - rotation(angle) * from;
  return {shift.x(), shift.y(), angle};
}

struct Laid {
  Eigen::Vector3d frame{0, 0, 0};
  std::vector<Pair> pairs;
};

Laid lay_over(const std::vector<Place> &drive, const std::vector<Place> &map) {
  Laid best;
  size_t tries = 0;
  const auto try_frame = [&](const Eigen::Vector3d &frame) {
    tries++;
    Laid tried{frame, pairs_in(drive, map, frame)};
    if (tried.pairs.size() >= kPairs) {
      tried.frame = motion(drive, map, tried.pairs);
      tried.pairs = pairs_in(drive, map, tried.frame);
    }
    if (tried.pairs.size() > best.pairs.size()) best = std::move(tried);
  };
  try_frame({0, 0, 0});
  for (size_t a = 0; a < drive.size(); a++)
    for (size_t b = a + 1; b < drive.size(); b++) {
      const double way = (drive[a].p_m - drive[b].p_m).norm();
      if (way < kLeast_m) continue;
      const auto most = static_cast<double>(std::min(drive.size(), map.size()));
      if (static_cast<double>(best.pairs.size()) >= kEnough * most || tries > kTries) return best;
      for (size_t c = 0; c < map.size(); c++)
        for (size_t d = 0; d < map.size(); d++) {
          const double off = std::abs((map[c].p_m - map[d].p_m).norm() - way);
          if (c != d && off < kReach_sigma * (sigma(drive[a], drive[b]) + sigma(map[c], map[d])))
            try_frame(motion(drive, map, {{a, c}, {b, d}}));
        }
    }
  return best;
}

int add(int64_t id, std::vector<Merged> *known) {
  known->push_back({id});
  return static_cast<int>(known->size()) - 1;
}

}  // namespace

void associate_by_id(const DriveMap &drive, std::vector<Merged> *known, std::vector<int> *landmark) {
  std::map<int64_t, int> at;
  for (size_t i = 0; i < known->size(); i++) at[(*known)[i].id] = static_cast<int>(i);
  landmark->clear();
  for (const DriveMap::Landmark &l : drive.landmarks) {
    const auto found = at.find(l.id);
    landmark->push_back(found != at.end() ? found->second : add(l.id, known));
  }
}

std::vector<KnownPlace> places_known(const DriveMap &drive, const std::vector<int> &landmark) {
  std::vector<KnownPlace> out = places_of(drive);
  for (KnownPlace &place : out) place.landmark = landmark[static_cast<size_t>(place.landmark)];
  return out;
}

void associate_by_place(const DriveMap &drive, std::vector<KnownPlace> *places, std::vector<Merged> *known,
                        std::vector<int> *landmark) {
  const std::vector<Place> own = places_of(drive);
  const bool is_first = places->empty();
  Laid laid;
  if (!is_first) laid = lay_over(own, *places);
  if (laid.pairs.size() < kPairs) laid.pairs.clear();
  landmark->assign(own.size(), -1);
  for (const Pair &pair : laid.pairs) (*landmark)[pair.of_drive] = (*places)[pair.of_map].landmark;
  int64_t next = 0;
  for (const Merged &one : *known) next = std::max(next, one.id + 1);
  const Eigen::Matrix2d turned = rotation(laid.frame.z());
  for (size_t j = 0; j < own.size(); j++) {
    if ((*landmark)[j] >= 0) continue;
    (*landmark)[j] = add(next++, known);
    if (is_first || !laid.pairs.empty())
      places->push_back({laid.frame.head<2>() + turned * own[j].p_m, turned * own[j].covariance * turned.transpose(),
                         (*landmark)[j]});
  }
}

}  // namespace wm::tools
