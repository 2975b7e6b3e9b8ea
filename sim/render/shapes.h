// SPDX-License-Identifier: Apache-2.0
// Shapes to build worlds of. Each makes a mesh with its uv in metres along the surface; put them together with
// append(). A surface is seen from both sides; the normal (the side of lamps that light it) is turned towards who
// looks.
#pragma once

#include <vector>

#include "render/types.h"

namespace wm::render {

struct Mesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;  // empty: flat triangles; else one a position (smooth shading)
  std::vector<Vec2> uv;       // one a position, metres
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<uint32_t> materials;  // one a triangle: number of the material in the scene

  void append(const Mesh &other);
  void transform(const Pose &T);  // moves positions and turns normals; uv stay
};

// A parallelogram: corner, corner + edge_u, ... ; u runs along edge_u from 0 to its length, v along edge_v. Textures
// stand upright when v points up.
Mesh quad(const Vec3 &corner, const Vec3 &edge_u, const Vec3 &edge_v, uint32_t material);
// The picture of a sign or poster: its middle, `right` as the viewer sees it and `up` (any length), width and height.
// Material's texture_size_m must be {width, height}. Lift it 2-3 mm off its wall.
Mesh picture(const Vec3 &middle, const Vec3 &right, const Vec3 &up, double width_m, double height_m, uint32_t material);
// Axes along the pose's, `size` whole lengths, middle at the pose.
Mesh box(const Pose &T_map_box, const Vec3 &size_m, uint32_t material);
// Upright in the pose's axes, foot at its origin, with a lid on top. u around, v up.
Mesh cylinder(const Pose &T_map_cylinder, double radius_m, double height_m, int segments, uint32_t material);
// A cone's stump: radius `foot_m` below, `top_m` above (0: a tip).
Mesh cone(const Pose &T_map_cone, double foot_m, double top_m, double height_m, int segments, uint32_t material);
Mesh sphere(const Vec3 &middle, double radius_m, int rings, uint32_t material);
// Ellipsoid with radii along the pose's axes.
Mesh ellipsoid(const Pose &T_map_ellipsoid, const Vec3 &radii_m, int rings, uint32_t material);
// Heights (row by row: index = iy·nx + ix) on a grid from origin, `cell_m` apart; smooth. u = x, v = y.
Mesh height_field(const Vec3 &origin, double cell_m, int nx, int ny, const std::vector<double> &heights_m,
                  uint32_t material);
// Walls along a polyline from z0 to z1. u = length along the line (it goes on around corners), v = z - z0.
Mesh walls(const std::vector<Vec2> &line, bool closed, double z0_m, double z1_m, uint32_t material);
// The area inside a simple polygon (either sense), flat at z; `up` says where its normal points. u = x, v = y.
// Ear clipping, O(n²); outlines that cross themselves give holes or overlaps, never a crash.
Mesh flat_polygon(const std::vector<Vec2> &outline, double z_m, bool up, uint32_t material);
// A prism: walls of `side` and lids of `lid`.
Mesh extruded(const std::vector<Vec2> &outline, double z0_m, double z1_m, uint32_t side, uint32_t lid);

}  // namespace wm::render
