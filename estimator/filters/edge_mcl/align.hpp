// SPDX-License-Identifier: Apache-2.0
// Aligning edge points with the map's lines: point to line, Gauss-Newton with bounded influence.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_ALIGN_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_ALIGN_HPP

#include "filters/edge_mcl/wall_list.hpp"
#include "math/arc.hpp"
#include "math/eigen.hpp"
#include "waymark/event.h"
#include "waymark/internal/filters/edge_mcl/floor_camera.hpp"
#include "waymark/internal/maps/edge_map.hpp"

namespace wm {

// Unknowns of an alignment; the pose comes first.
enum align_state {
  kAlignX,
  kAlignY,
  kAlignHeading,
  kAlignCamera,
  kAlignTime = kAlignCamera + kCameraTime,
  kAlignEdge = kAlignCamera + kEdgeOffset,
  kAlignPoint = kAlignCamera + kCameraStates,  // those before it may move any point; the others one wall's points
  kAlignWall = kAlignPoint,
  kAlignStates = kAlignWall + wall_list::kCapacity
};
using align_matrix = matrix<kAlignStates>;
using align_vector = vector<kAlignStates>;
using point_vector = vector<kAlignPoint>;

// Normal equations of a scan at an alignment: information and gradient of half the weighted squares. Rows of unknowns
// that are no states are 0.
struct normal_equations {
  align_matrix information = align_matrix::Zero();
  align_vector gradient = align_vector::Zero();  // towards a lower cost
  double cost = 0.0;  // of Student's distribution; an unmatched point costs what the gate does
  int seen = 0;       // points that are explained or lie on a line
  int explained = 0;  // of them: near enough to an edge of the map
  int beyond = 0;     // of the others: beyond an edge, where a camera cannot see
  int reflected = 0;  // of the others: before an edge, as its reflection in a floor is
};

// Errors of a camera's mounting that are estimated with a hypothesis: pitch, roll, height, in sigmas of the filter's
// calibration. Yaw is left out: it is equivalent to the heading.
inline constexpr int kMountingErrors = 3, kMountingCameras = 2, kMountingAll = kMountingErrors * kMountingCameras;
inline constexpr int kMountingError[kMountingErrors] = {kCameraPitch, kCameraRoll, kCameraHeight};

// A point of an edge on the floor, in base_link.
struct floor_edge {
  float x_m, y_m;
  float ray_x_m, ray_y_m;                              // from under the camera to the point
  float x_by[kMountingErrors], y_by[kMountingErrors];  // shift by a sigma of each error of its camera's mounting
  float reflection;                                    // weight as explained, where it lies before an edge
  int32_t camera;
};
struct floor_points {
  int count;
  floor_edge of[WM_POINTS_MAX];
};
// The point from another pose: `from` is its base_link, h the cosine and sine of from's heading.
floor_edge moved(const floor_edge &point, const wm_pose2 &from, const sin_cos &h);
// At most `most` of `count` points, evenly taken. Returns how many.
int take_evenly(const floor_edge *points, int count, int most, floor_edge *out);

// Information weight of a scan of n points, as a multiple of a scan's of kUsualPoints: few points fit many places.
// n / (n + kHalfPoints), normalised. Both counts were read off corridor-a's scans (a ray each 1.3 degrees); not swept.
inline constexpr double kUsualPoints = 180.0, kHalfPoints = 80.0;
inline double information_weight(int points) {
  return (kUsualPoints + kHalfPoints) / kUsualPoints * points / (points + kHalfPoints);
}

// Specular reflection: the mirror image of a wall in a glossy floor, or its skirting's shadow, is seen on the ray to
// the wall, before it. True if the ray from under the camera to a place (both in the map's axes) meets an edge beyond
// the place, by half of the ray's length at most.
bool before_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m);
// True if that ray meets an edge well before the place: no camera at the ray's beginning sees the place. The first 20 m
// are looked at; outside of the map there are no edges. O(ray).
bool through_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m);

// Whether a point lies between its neighbours, as an edge's do. Noise and reflections are scattered.
bool on_a_line(const wm_points &points, uint32_t i);

// Aligns every `stride`th of the points by the pose alone, from `pose` on. O(iterations * count / stride).
void align_pose(const edge_map &map, const floor_edge *points, int count, int stride, double gate_m, double explained_m,
                int iterations, wm_pose2 *pose);
// The same with the cameras' mounting errors as unknowns, in sigmas, from `error` on.
void align_place(const edge_map &map, const floor_points &points, int stride, double gate_m, double explained_m,
                 int iterations, wm_pose2 *pose, double error[kMountingAll]);
// Fraction of the points within explained_m of an edge, seen from `pose`; with `reflections`, points before an edge
// count by their weight. O(points).
double explained_share(const edge_map &map, const floor_points &points, double explained_m, const wm_pose2 &pose,
                       const double error[kMountingAll], bool reflections);

}  // namespace wm

#endif
