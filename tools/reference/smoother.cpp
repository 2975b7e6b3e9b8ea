// SPDX-License-Identifier: Apache-2.0
#include "reference/smoother.h"

#include <algorithm>
#include <cmath>

#include "common/pose.h"
#include "waymark/random.h"

namespace wm::tools {
namespace {

using Eigen::Vector3d;

Vector3d compose(const Vector3d &a, const Vector3d &b) {
  const double c = std::cos(a.z()), s = std::sin(a.z());
  return {a.x() + c * b.x() - s * b.y(), a.y() + s * b.x() + c * b.y(), wrap(a.z() + b.z())};
}

// b as seen from a.
Vector3d between(const Vector3d &a, const Vector3d &b) {
  const double c = std::cos(a.z()), s = std::sin(a.z()), dx = b.x() - a.x(), dy = b.y() - a.y();
  return {c * dx + s * dy, c * dy - s * dx, wrap(b.z() - a.z())};
}

// A pass over the drive: what each step's particles were, and whose children.
class Pass {
 public:
  Pass(const std::vector<SmootherStep> &steps, const EdgeField &field, const SmootherOptions &o, uint64_t number)
      : steps_(steps), field_(field), o_(o), number_(number), cloud_(steps.size()), parent_(steps.size()) {}

  void run(const std::vector<Vector3d> &start) {
    std::vector<double> weight(start.size(), 1.0 / static_cast<double>(start.size()));
    cloud_[0] = start;
    parent_[0].resize(start.size());
    for (size_t k = 0; k < steps_.size(); k++) {
      if (k > 0) move(k);
      weigh(k, weight);
      double squares = 0;
      for (const double w : weight) squares += w * w;
      if (squares * static_cast<double>(weight.size()) > 2 || k + 1 == steps_.size()) resample(k, weight);
    }
  }

  // The mean of the particles that have descendants at the end, and the first ones of them.
  std::vector<Vector3d> mean(std::vector<Vector3d> *first) const {
    std::vector<Vector3d> out(steps_.size());
    std::vector<uint32_t> line(cloud_.back().size());
    for (uint32_t i = 0; i < line.size(); i++) line[i] = i;
    for (size_t k = steps_.size(); k-- > 0;) {
      double x = 0, y = 0, c = 0, s = 0;
      for (uint32_t &i : line) {
        const Vector3d &p = cloud_[k][i];
        x += p.x(), y += p.y(), c += std::cos(p.z()), s += std::sin(p.z());
      }
      const auto n = static_cast<double>(line.size());
      out[k] = {x / n, y / n, std::atan2(s, c)};
      if (k == 0)
        for (const uint32_t i : line) first->push_back(cloud_[0][i]);
      for (uint32_t &i : line) i = parent_[k][i];
    }
    return out;
  }

 private:
  void move(size_t k) {
    const Vector3d d = between(steps_[k - 1].odom, steps_[k].odom);
    const double way = d.head<2>().norm(), root = std::sqrt(way);
    const std::vector<Vector3d> &from = cloud_[k - 1];
    cloud_[k].resize(from.size());
    parent_[k].resize(from.size());
    wm_random noise{o_.seed, 2 * number_, static_cast<uint64_t>(k) * from.size() * 8};
    for (uint32_t i = 0; i < from.size(); i++) {
      const Vector3d step(d.x() * (1 + o_.along_rel * wm_random_next_normal(&noise)) +
                              0.1 * o_.across_m * root * wm_random_next_normal(&noise),
                          d.y() + o_.across_m * root * wm_random_next_normal(&noise),
                          d.z() * (1 + o_.turn_rel * wm_random_next_normal(&noise)) +
                              o_.turn_rad * root * wm_random_next_normal(&noise));
      cloud_[k][i] = compose(from[i], step);
      parent_[k][i] = i;
    }
  }

  void weigh(size_t k, std::vector<double> &weight) const {
    const std::vector<Eigen::Vector2d> &points = steps_[k].points;
    if (points.empty()) return;
    const double scale = std::min(1.0, o_.informative / static_cast<double>(points.size()));
    constexpr double kFloor = 0.02;  // of points that are no edge of the map
    std::vector<double> score(weight.size());
    double top = -1e300;
    for (size_t i = 0; i < weight.size(); i++) {
      const Vector3d &p = cloud_[k][i];
      const double c = std::cos(p.z()), s = std::sin(p.z());
      double sum = field_.drivable(p.x(), p.y()) ? 0 : -50;
      for (const Eigen::Vector2d &q : points) {
        const double d = field_.distance_m(p.x() + c * q.x() - s * q.y(), p.y() + s * q.x() + c * q.y()) / o_.sigma_m;
        sum += scale * std::log(std::exp(-0.5 * d * d) + kFloor);
      }
      score[i] = sum;
      top = std::max(top, sum);
    }
    double total = 0;
    for (size_t i = 0; i < weight.size(); i++) total += weight[i] *= std::exp(score[i] - top);
    for (double &w : weight) w /= total;
  }

  // Low variance: one random number for all.
  void resample(size_t k, std::vector<double> &weight) {
    const std::vector<Vector3d> was = cloud_[k];
    const std::vector<uint32_t> parents = parent_[k];
    const double share = 1.0 / static_cast<double>(was.size());
    double at = share * wm_random_uniform(o_.seed, 2 * number_ + 1, k), sum = weight[0];
    size_t from = 0;
    for (size_t i = 0; i < was.size(); i++, at += share) {
      while (sum < at && from + 1 < was.size()) sum += weight[++from];
      cloud_[k][i] = was[from];
      parent_[k][i] = parents[from];
    }
    std::fill(weight.begin(), weight.end(), share);
  }

  const std::vector<SmootherStep> &steps_;
  const EdgeField &field_;
  const SmootherOptions &o_;
  uint64_t number_;
  std::vector<std::vector<Vector3d>> cloud_;
  std::vector<std::vector<uint32_t>> parent_;  // index at the step before
};

std::vector<Vector3d> first_cloud(const Vector3d &start, const SmootherOptions &o) {
  std::vector<Vector3d> out;
  wm_random noise{o.seed, 1U << 20, 0};
  for (int i = 0; i < o.particles; i++) {
    const double x = wm_random_next_normal(&noise), y = wm_random_next_normal(&noise),
                 t = wm_random_next_normal(&noise);
    out.push_back(compose(start, {o.start_xy_m * x, o.start_xy_m * y, o.start_heading_rad * t}));
  }
  return out;
}

double explained(const std::vector<SmootherStep> &steps, const EdgeField &field, const std::vector<Vector3d> &poses,
                 double within_m) {
  size_t near = 0, all = 0;
  for (size_t k = 0; k < steps.size(); k++)
    for (const Eigen::Vector2d &q : steps[k].points) {
      const Vector3d p = compose(poses[k], {q.x(), q.y(), 0});
      all++;
      near += field.distance_m(p.x(), p.y()) < within_m ? 1 : 0;
    }
  return all > 0 ? static_cast<double>(near) / static_cast<double>(all) : 0;
}

}  // namespace

Reference smooth(const std::vector<SmootherStep> &steps, const EdgeField &field, const Vector3d &start,
                 const SmootherOptions &options, const std::function<void(int, double)> &tell) {
  Reference out;
  if (steps.empty()) return out;
  std::vector<Vector3d> cloud = first_cloud(start, options);
  while (out.passes < options.passes_max) {
    Pass pass(steps, field, options, static_cast<uint64_t>(out.passes));
    pass.run(cloud);
    std::vector<Vector3d> first;
    const std::vector<Vector3d> poses = pass.mean(&first);
    cloud = first;
    // The mean of the passes, and by how much this one moved it.
    out.passes++;
    out.moved_m = 0;
    if (out.passes == 1) {
      out.poses = poses;
    } else {
      for (size_t k = 0; k < steps.size(); k++) {
        Vector3d d = poses[k] - out.poses[k];
        d.z() = wrap(d.z());
        d /= out.passes;
        out.poses[k] += d;
        out.poses[k].z() = wrap(out.poses[k].z());
        out.moved_m += d.head<2>().norm() / static_cast<double>(steps.size());
      }
    }
    if (tell) tell(out.passes, out.moved_m);
    if (out.passes > 2 && out.moved_m < options.settled_m) break;
  }
  out.explained = explained(steps, field, out.poses, 3 * options.sigma_m);
  return out;
}

}  // namespace wm::tools
