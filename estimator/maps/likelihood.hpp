// SPDX-License-Identifier: Apache-2.0
// Log likelihood of a scan of edge points from a pose, for maps that are too large for a score_field. Integers from the
// look-up on, so the vector form and its scalar twin give the same bits in any order of summation.
#ifndef WAYMARK_ESTIMATOR_MAPS_LIKELIHOOD_HPP
#define WAYMARK_ESTIMATOR_MAPS_LIKELIHOOD_HPP

#include "waymark/event.h"
#include "waymark/internal/maps/edge_map.hpp"

namespace wm {

inline constexpr int kSigmaClasses = 4;  // of points; pf_edges has their sigmas
inline constexpr int kScanLanes = 8;     // floats of the widest vector

// Points in base_link, in the order of their classes of sigma; behind the last one repeated to a full vector.
struct scan_points {
  int count;
  int class_end[kSigmaClasses];
  float reach_m;  // of the farthest
  alignas(16) float x_m[WM_POINTS_MAX + kScanLanes];
  alignas(16) float y_m[WM_POINTS_MAX + kScanLanes];
};

// A point's score by its class and the distance byte under it.
struct score_table {
  int32_t value[kSigmaClasses][256];
};

inline constexpr double kScoreUnit =
    1.0 / 4096;  // nats, or the likelihood itself, of 1 in a score: its rounding is no noise

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
