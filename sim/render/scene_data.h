// SPDX-License-Identifier: Apache-2.0
// A committed scene as the renderer's inner loops read it.
#pragma once

#include <vector>

#include "render/rays.h"
#include "render/scene.h"

namespace wm::render {

// How a place of a surface is lit: the side of its normal, and the other.
struct Lit {
  Colour lamps[2];  // irradiance / pi of lamps and sun
  float open[2];    // share of the surroundings that is seen
};

// A corner of triangles; neighbours with the same normal share it.
struct Place {
  Vec3 position, normal;
  Vec3 inwards;  // sum of the ways to the middles of its triangles: away from walls it stands at
  Lit lit;
};

// A triangle as it is shaded.
struct Piece {
  std::array<uint32_t, 3> places;
  float s[3], t[3];  // texture coordinates at the corners
  Vec3 normal;
  float span_per_m;  // texture widths a metre on the surface
  uint32_t material;
};

struct Shape {
  RTCScene scene = nullptr;
  std::vector<Piece> pieces;  // by primID
  std::vector<Place> places;
  Vec3 middle{0, 0, 0};  // movers: of a ball that holds it
  double radius_m = 0;
};

struct Scene::Data {
  ~Data();

  RTCDevice device = nullptr;
  bool committed = false;

  std::vector<Material> materials;
  std::vector<Mesh> meshes;
  std::vector<Lamp> lamps;
  std::vector<Mover> movers;
  std::vector<HeadLamp> head_lamps;

  Shape still;
  std::vector<Shape> mover_shapes;
};

// A triangle on its way into the scene: corners with what belongs to them.
struct Corner {
  Vec3 position, normal;
  Vec2 uv;
};
using Triangle = std::array<Corner, 3>;

// ── split.cpp ──
// Appends a mesh's triangles, cut at the middle of their longest edge until none is longer than `cell_m` (0: uncut).
void split(const Mesh &mesh, double cell_m, std::vector<Triangle> &triangles, std::vector<uint32_t> &materials);

// ── lighting.cpp ──
// Irradiance / pi from lamps and sun at a point of a surface; shadows are asked of `still` when it isn't nullptr.
Colour lamp_light(const Scene &scene, RTCScene still, const Vec3 &point, const Vec3 &normal);
// Share of the surroundings that a point sees within the ambient's contact_m.
float open_share(const Ambient &ambient, RTCScene still, const Vec3 &point, const Vec3 &normal);
// Finds the places of the triangles, which become the shape's pieces' corners.
void find_places(const std::vector<Triangle> &triangles, Shape &shape);
// Lights them, with shadows; two threads.
void light_places(const Scene &scene, RTCScene still, std::vector<Place> &places);
// How a mover's places are lit where it is: without shadows, and lamps as if they were points.
void light_mover(const Scene &scene, const Shape &shape, const Pose &T_map_mover, std::vector<Lit> &out);

}  // namespace wm::render
