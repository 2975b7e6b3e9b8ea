// SPDX-License-Identifier: Apache-2.0
// Aligning a scan of edge points with the map's lines: point to line, Gauss-Newton with bounded influence.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_ALIGN_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_ALIGN_HPP

#include "filters/edge_mcl/floor_camera.hpp"
#include "maps/edge_map.hpp"
#include "waymark/event.h"

namespace wm {

// What an alignment is about, by number; the pose comes first.
enum align_state {
  kAlignX,
  kAlignY,
  kAlignHeading,
  kAlignCamera,
  kAlignTime = kAlignCamera + kCameraErrors,
  kAlignEdge,
  kAlignStates
};

// Normal equations about a place: information and gradient of 1/2 sum of weighted squares, and how well it fitted.
struct normal_equations {
  double information[kAlignStates][kAlignStates];
  double gradient[kAlignStates];  // towards the better
  double cost;                    // half of the weighted squares, as Student has them; what finds no edge pays the gate
  int seen;                       // points that are explained or lie on a line
  int explained;                  // of them: as near to an edge as they may be
};

// Solves A x = b for a symmetric positive definite A of n <= kAlignStates rows; false where it isn't.
bool solve_positive(const double a[kAlignStates][kAlignStates], const double *b, int n, double *x);
bool invert_positive(const double a[kAlignStates][kAlignStates], int n, double out[kAlignStates][kAlignStates]);
// A = L L', the lower triangle; false where A isn't positive definite.
bool factor_positive(const double a[kAlignStates][kAlignStates], int n, double lower[kAlignStates][kAlignStates]);

// Whether a point lies between its neighbours, as an edge's do. What noise and reflections leave is scattered, and
// unexplained without saying anything about the pose.
bool on_a_line(const wm_points &points, uint32_t i);

// Aligns every `stride`th of the points in base_link by the pose alone, from `pose` on: for candidates of a search.
// O(iterations * count / stride).
void align_pose(const edge_map &map, const float *x_m, const float *y_m, int count, int stride, double gate_m,
                double explained_m, int iterations, wm_pose2 *pose);
// Share of the points that lie so near to an edge from `pose`. O(points).
double explained_share(const edge_map &map, const float *x_m, const float *y_m, int count, double explained_m,
                       const wm_pose2 &pose);

}  // namespace wm

#endif
