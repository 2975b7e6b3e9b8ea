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
  int through;                    // not explained: behind an edge, where a camera can't see
  int before;                     // not explained: before one, as its image in a shiny floor is
};

// How a camera sits is known to some sigma. Of its errors these move the points of places that are compared: pitch,
// roll, height. (Its yaw turns them as the heading does.) In sigmas, so that what is known well moves nothing.
inline constexpr int kSlackErrors = 3, kSlackCameras = 2, kSlackMost = kSlackErrors * kSlackCameras;
inline constexpr int kSlackError[kSlackErrors] = {kPitch, kRoll, kHeight};

// Points in base_link, and by how much each moves with a sigma of an error of the camera that saw it.
struct slack_points {
  int count;
  int camera[WM_POINTS_MAX];
  float x_m[WM_POINTS_MAX], y_m[WM_POINTS_MAX];
  float x_by[kSlackErrors][WM_POINTS_MAX], y_by[kSlackErrors][WM_POINTS_MAX];
  float ray_x_m[WM_POINTS_MAX], ray_y_m[WM_POINTS_MAX];  // from under the camera to the point
  float image[WM_POINTS_MAX];                            // what it counts if it lies before an edge
};

// Information weight of a scan of n points, as a multiple of a scan's of kUsualPoints: few points fit many places.
// n / (n + kHalfPoints), normalised. The two counts were read off corridor-a's scans (a ray each 1.3 degrees); not
// swept.
inline constexpr double kUsualPoints = 180.0, kHalfPoints = 80.0;
inline double information_weight(int points) {
  return (kUsualPoints + kHalfPoints) / kUsualPoints * points / (points + kHalfPoints);
}

// A shiny floor holds a wall's image and its skirting's shadow. What is seen of these lies before the wall, on the same
// ray. Whether the ray from under the camera to a place (both in the map's axes) meets an edge beyond it, by half of
// its length at most.
bool before_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m);
// Whether that ray meets an edge well before the place: nobody sees through a wall, so the robot isn't where the ray
// was drawn from. Of its first 20 m; what lies outside of the map is behind nothing. O(ray).
bool through_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m);

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
// The same of points that may move: with the pose their cameras' `error`, in sigmas, from where it is on.
void align_place(const edge_map &map, const slack_points &points, int stride, double gate_m, double explained_m,
                 int iterations, wm_pose2 *pose, double error[kSlackMost]);
// Share of the points that lie so near to an edge from `pose`; with `images`, those before an edge count for what they
// may. O(points).
double explained_share(const edge_map &map, const slack_points &points, double explained_m, const wm_pose2 &pose,
                       const double error[kSlackMost], bool images);

}  // namespace wm

#endif
