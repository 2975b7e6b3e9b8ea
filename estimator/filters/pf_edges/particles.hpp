// SPDX-License-Identifier: Apache-2.0
// Particles of a planar pose, structure of arrays: propagate, weigh, normalise, resample. Random numbers by (seed,
// step, particle). Source: [Abramov2019].
#ifndef WAYMARK_ESTIMATOR_PF_EDGES_PARTICLES_HPP
#define WAYMARK_ESTIMATOR_PF_EDGES_PARTICLES_HPP

#include <cstddef>

#include "maps/score_field.hpp"
#include "waymark/frames.h"

namespace wm {

// Sigmas of one step in the particle's own frame: along, across, turn.
struct step_noise {
  double along_m, across_m, turn_rad;
};

struct particle_moments {
  wm_pose2 mean;  // weighted, the heading on the circle
  double covariance[3][3];
  double share;  // fraction of all weight that it was computed from
};

class particles {
 public:
  static size_t bytes(int count) { return (size_t)count * 8 * sizeof(double); }
  // `memory` keeps its distance from this object when both are copied.
  void init(int count, uint64_t seed, void *memory);

  int count() const { return count_; }
  double x(int i) const { return array(0)[i]; }
  double y(int i) const { return array(1)[i]; }
  double heading(int i) const { return array(2)[i]; }
  double weight(int i) const { return array(3)[i]; }

  // Draws all of them from a normal distribution, with equal weights.
  void spread(const wm_pose2 &pose, const double covariance[3][3]);
  // Draws all of them uniformly over the drivable part of the map and all headings, with equal weights.
  void spread_over(const edge_map &map);
  // Moves each by the increment (in its own frame at the beginning) with its own noise.
  void propagate(const wm_pose2 &increment, const step_noise &noise);
  // Multiplies the weights by exp(exponent * score), or by the score itself (`sum`), and by 0 where the map is not
  // drivable. Scores come from the field, or from the table where the map is too large for a field. Then normalises.
  // False where all products were 0: the weights stay. O(count * points).
  bool weigh(const edge_map &map, const score_field &field, const scan_points &points, const score_table &table,
             double exponent, bool sum);
  double effective() const;  // 1 / sum of squared weights
  // Low-variance resampling: one random number, then equal steps through the sum of the weights.
  void resample();
  // Moments of the particles within the radii of the one with the largest weight.
  particle_moments main_cluster(double radius_m, double radius_rad) const;

 private:
  double *array(int k) { return arrays_.get() + (ptrdiff_t)k * count_; }
  const double *array(int k) const { return arrays_.get() + (ptrdiff_t)k * count_; }
  void level();
  void score_by_field(const edge_map &map, const score_field &field, const scan_points &points, double *scored);
  void normals(int particle, double out[4]) const;

  int count_;
  uint64_t seed_, step_;
  relative_array<double> arrays_;  // x, y, heading, weight, and as much work space
};

}  // namespace wm

#endif
