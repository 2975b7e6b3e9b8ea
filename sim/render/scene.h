// SPDX-License-Identifier: Apache-2.0
// What there is to see: surfaces, lamps, sky, water, and things that move. Build it (add...), commit() once, then any
// number of renderers may look at it from any thread.
//
// Light. The radiance of a matt surface is albedo · irradiance / pi, and lamps and ambient are given as irradiance /
// pi: a white matt surface under ambient 0.5 has radiance 0.5. What does not move is lit when the scene is committed,
// once for each corner of its triangles (which commit() splits until no edge is longer than `light_cell_m`): lamps with
// shadows, and contact darkening, cost nothing in the picture.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/shapes.h"
#include "render/texture.h"
#include "render/types.h"

namespace wm::render {

struct Material {
  Colour albedo{0.5f};                     // times the texture, where there is one
  std::shared_ptr<const Texture> texture;  // none: plain
  Vec2 texture_size_m{1, 1};               // what one copy of the texture covers, in u and v
  Vec2 texture_origin_m{0, 0};             // u and v of its lower left corner
  // Under water nothing mirrors. Where it is rough (3 mrad and more) two neighbouring pixels share one mirrored ray.
  double mirror = 0;         // share reflected when looked at straight on; rises to 1 at a glance (Schlick)
  double mirror_glance = 1;  // how much of that rise there is: 0 for wax, 1 for wet or polished stone
  double roughness_rad = 0;  // standard deviation of the mirrored ray's direction
  Colour emission{0.f};      // radiance of its own (lamps' glass, windows); dims with the lights
};

struct Lamp {
  enum class Kind { point, panel };
  Kind kind = Kind::point;
  Vec3 position{0, 0, 0};
  Vec3 direction{0, 0, -1};  // where it shines; light falls off as cos^focus of the angle from it
  double focus = 1;          // 0: all around alike (point), 1: a panel's, 20: a spot
  double power = 1;          // irradiance / pi straight ahead at 1 m
  Colour colour{1.f};        // times power
  double radius_m = 0.2;     // size: softens shadows and the neighbourhood (power / (d² + radius²))
  Vec3 edge_u{0.6, 0, 0};    // panel: whole edges, sampled 2 x 2
  Vec3 edge_v{0, 0.6, 0};
  double reach_m = 12;  // beyond it nothing, and softly so from half of it on
  bool shadow = true;
};

// Light from all around: `up` from above, `down` from below (what floors send back).
struct Ambient {
  Colour up{0.25f}, down{0.15f};
  double contact_m = 0.6;  // corners and feet of things darken within this distance; 0: not
  double contact_strength = 0.8;
};

struct Sun {
  Vec3 towards{0.3, 0.4, 0.8};  // any length
  Colour power{0.f};            // irradiance / pi on a surface that faces it; 0: none
  bool shadow = true;
};

// Seen where nothing stands.
struct Sky {
  Colour zenith{0.02f}, horizon{0.02f}, ground{0.02f};
};

struct Water {
  bool there = false;
  Colour attenuation_per_m{0.4f, 0.12f, 0.1f};  // of radiance on its way
  Colour haze{0.02f, 0.06f, 0.07f};             // radiance of endless water under ambient light
  double lamp_haze = 0.02;                      // back scatter of the vehicle's lamps, per metre (share of irradiance)
  double particles_per_m3 = 0;                  // drifting specks within particle_reach_m of the camera
  double particle_radius_m = 0.001;
  double particle_reach_m = 2.5;
  Vec3 current_mps{0, 0, 0};  // drift of the specks
};

// A lamp on the vehicle: moves with base_link, lights per pixel.
struct HeadLamp {
  Vec3 position{0, 0, 0};  // in base_link
  Vec3 direction{1, 0, 0};
  double half_angle_rad = 0.6;  // half power
  double power = 1;             // irradiance / pi at 1 m
  Colour colour{1.f};
};

// Something that moves as one piece (a person is several, or one with a walk's pose).
struct Mover {
  Mesh mesh;  // in its own frame
  std::function<Pose(int64_t t_ns)> T_map_mover;
  double shadow_radius_m = 0;  // a soft dark spot on floors under it; 0: none
};

struct Hit {
  bool there = false;
  double distance_m = 0;
  Vec3 point{0, 0, 0}, normal{0, 0, 0};
  uint32_t material = 0;
};

class Scene {
 public:
  Scene();
  ~Scene();
  Scene(const Scene &) = delete;
  Scene &operator=(const Scene &) = delete;

  // ── building: one thread ──
  uint32_t add(const Material &material);  // its number
  void add(const Mesh &mesh);              // what doesn't move; parts may be added one by one
  void add(const Lamp &lamp);
  void add(Mover mover);
  void add(const HeadLamp &lamp);
  Ambient ambient;
  Sun sun;
  Sky sky;
  Water water;
  double light_cell_m = 0.5;
  // Splits, lights (on two threads: 50 000 corners with 30 lamps take about a second) and indexes. Once. False and a
  // text when a mesh refers to a material that isn't there, has NaNs, or Embree refuses.
  bool commit(std::string &error);

  // ── asking: any thread, after commit ──
  // The nearest surface that doesn't move.
  Hit cast(const Vec3 &from, const Vec3 &direction) const;
  // Whether nothing that doesn't move stands between two points; `slack_m` before the target is left out, so that a
  // point ON a surface is seen.
  bool visible(const Vec3 &from, const Vec3 &target, double slack_m = 0.01) const;
  // The same with movers, where they are at t.
  bool visible(const Vec3 &from, const Vec3 &target, int64_t t_ns, double slack_m = 0.01) const;
  size_t triangle_count() const;

  struct Data;  // the renderer's view
  const Data &data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace wm::render
