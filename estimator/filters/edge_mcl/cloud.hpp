// SPDX-License-Identifier: Apache-2.0
// The cloud of particles: structure of arrays, moved, weighed, resampled. Random numbers by (seed, step, particle).
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_CLOUD_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_CLOUD_HPP

#include <cstddef>

#include "filters/edge_mcl/score_field.hpp"
#include "waymark/frames.h"

namespace wm {

// Sigmas of one step: along, across, turn.
struct step_noise {
  double along_m, across_m, turn_rad;
};

struct cloud_moments {
  wm_pose2 mean;  // weighted, the heading on the circle
  double covariance[3][3];
  double share;  // of the weight that was taken together
};

class cloud {
 public:
  static size_t bytes(int count) { return (size_t)count * 8 * sizeof(double); }
  void init(int count, uint64_t seed, void *memory);

  int count() const { return count_; }
  double x(int i) const { return array(0)[i]; }
  double y(int i) const { return array(1)[i]; }
  double heading(int i) const { return array(2)[i]; }
  double weight(int i) const { return array(3)[i]; }

  // All particles normally about `pose`, weighted alike; or `from` to `to` of them only.
  void spread(const wm_pose2 &pose, const double covariance[3][3]);
  void spread_some(int from, int to, const wm_pose2 &pose, const double covariance[3][3]);
  void level();  // all weigh the same
  // Each by the increment (in its own frame at the beginning) with its own noise.
  void move(const wm_pose2 &increment, const step_noise &noise);
  // Multiplies the weights by exp(exponent * score), or by the score itself (`sum`), and by 0 where it can't be driven,
  // and normalises them. False where all were 0: the weights stay.
  // By the field, or where that isn't ready by the table.
  bool weigh(const edge_map &map, const score_field &field, const scan_points &points, const score_table &table,
             double exponent, bool sum);
  double effective() const;  // number of particles
  void resample();
  // Moves those within the gate of `target` towards it.
  void pull(const wm_pose2 &target, const double gain[3][3], double gate_m, double gate_rad);
  int best() const;
  // Moments of all particles, or of those within the radius of `centre`.
  cloud_moments moments() const;
  cloud_moments moments_near(const wm_pose2 &centre, double radius_m, double radius_rad) const;

 private:
  double *array(int k) const {
    return reinterpret_cast<double *>(reinterpret_cast<uintptr_t>(this) + (uintptr_t)memory_at_) +
           (ptrdiff_t)k * count_;
  }
  void score_by_field(const edge_map &map, const score_field &field, const scan_points &points, double *scored);
  void normals(int particle, double out[4]) const;

  int count_;
  uint64_t seed_, step_;
  ptrdiff_t memory_at_;  // x, y, heading, weight, and as much work space
};

// Lower triangle of a covariance; what isn't positive is taken as 0.
void cholesky3(const double covariance[3][3], double lower[3][3]);

}  // namespace wm

#endif
