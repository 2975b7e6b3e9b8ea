// SPDX-License-Identifier: Apache-2.0
// A committed scene as the renderer's inner loops read it.
#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "simulate/render/sampler.h"
#include "simulate/render/scene.h"

namespace wm::render {

// What a hit needs to be shaded, in two cache lines. `light`: for the side of the normal and for the other, at the
// three corners: lamps' irradiance (red, green, blue) and the open share of the surroundings.
struct alignas(64) Facet {
  float4 light[2][3];
  float s[3], t[3];  // texture coordinates at the corners
  float span_per_m;  // texture widths a metre on the surface
  uint32_t material;
};
static_assert(sizeof(Facet) == 128);

struct Surface {
  float4 albedo, emission;
  const Texture *texture;
  float mirror, glance, roughness;
  bool emits;
};

struct MoverShape {
  RTCScene scene = nullptr;
  std::vector<Facet> facets;
};

struct Scene::Data {
  ~Data();

  RTCDevice device = nullptr;
  RTCScene still = nullptr;
  bool committed = false;

  std::vector<Material> materials;
  std::vector<Mesh> meshes;
  std::vector<Lamp> lamps;
  std::vector<Mover> movers;
  std::vector<HeadLamp> head_lamps;

  std::vector<Surface> surfaces;
  std::vector<Facet> facets;  // of `still`, by primID
  std::vector<MoverShape> mover_shapes;
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
// Fills Facet::light of every facet; two threads.
void light_facets(const Scene &scene, RTCScene still, const std::vector<Triangle> &triangles,
                  std::vector<Facet> &facets);

}  // namespace wm::render
