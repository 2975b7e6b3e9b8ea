// SPDX-License-Identifier: Apache-2.0
// How well a scan of edge points fits the map from a pose: the kernel that a particle costs. Integers from the look-up
// on, so that the order of summation is nobody's business; the vector form and its scalar twin give the same bits.
#ifndef WAYMARK_ESTIMATOR_MAPS_LIKELIHOOD_HPP
#define WAYMARK_ESTIMATOR_MAPS_LIKELIHOOD_HPP

#include "maps/edge_map.hpp"
#include "waymark/event.h"

namespace wm {

inline constexpr int kSigmaClasses = 4;
inline constexpr int kScanLanes = 8;

// Points in base_link, in the order of their classes of sigma; behind the last one repeated to a full vector.
struct scan_points {
  int count;
  int class_end[kSigmaClasses];
  float reach_m;  // of the farthest
  alignas(16) float x_m[WM_POINTS_MAX + kScanLanes];
  alignas(16) float y_m[WM_POINTS_MAX + kScanLanes];
};

// Of each class: what a point counts by the distance byte under it.
struct score_table {
  int32_t value[kSigmaClasses][256];
};

inline constexpr double kScoreUnit = 1.0 / 4096;  // of a score, whatever it is

// Table of log((1 - floor) exp(-d^2/2 sigma^2) + floor), or, `sum`, of the same without the logarithm (the paper's
// likelihood: a sum over the points).
void make_score_table(const edge_map &map, const double sigma_m[kSigmaClasses], double floor, bool sum,
                      score_table *out);

// Sum over the points, in kScoreUnit. A point outside of the map counts as far from any edge. O(points).
int32_t score(const edge_map &map, const scan_points &points, const score_table &table, double x_m, double y_m,
              double heading_cos, double heading_sin);
// The same, a point at a time.
int32_t score_scalar(const edge_map &map, const scan_points &points, const score_table &table, double x_m, double y_m,
                     double heading_cos, double heading_sin);

}  // namespace wm

#endif
