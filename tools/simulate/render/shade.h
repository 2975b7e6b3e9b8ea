// SPDX-License-Identifier: Apache-2.0
// The radiance that comes along one ray from what it met. Inner loop of the renderer: no allocation, no virtual call.
#pragma once

#include <vector>

#include "simulate/render/scene_data.h"

namespace wm::render {

struct float3 {
  float x, y, z;
};
inline float3 operator+(float3 a, float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline float3 operator-(float3 a, float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline float3 operator*(float3 a, float k) { return {a.x * k, a.y * k, a.z * k}; }
inline float dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline float3 to_float3(const Vec3 &v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// A head lamp where the vehicle is at a row's time.
struct Beam {
  float3 position, direction;
  float4 power;
  float narrow;  // 1 / (1 - cos(half angle))
};

// Where one row's sample looks from.
struct Eye {
  float rotation[9];  // map from optical
  float3 origin;
  float time;  // of the frame, 0 to 1, for movers
  std::vector<Beam> beams;
};

struct SpotShadow {
  float3 centre;
  float inverse_radius;
};

// exp(-attenuation · distance) by table: the same bits everywhere, and cheap.
struct Attenuation {
  std::vector<float4> table;
  static constexpr float kStep = 0.02f;
  float4 operator()(float distance) const {
    const float at = distance / kStep;
    if (!(at < static_cast<float>(table.size() - 1))) return table.back();
    const auto i = static_cast<size_t>(at);
    return table[i] + (table[i + 1] - table[i]) * splat(at - static_cast<float>(i));
  }
};

// What all rays of a frame share.
struct Air {
  const Scene *scene;
  const Scene::Data *data;
  float light, ambient;
  float4 ambient_up, ambient_down;
  std::vector<SpotShadow> shadows;
  std::vector<std::array<float, 9>> mover_rotations;  // map from mover, at the middle of the frame
  Attenuation attenuation;
};

struct Met {
  float3 origin, direction;  // direction of length 1
  float distance;
  float u, v;
  float3 normal;  // any length; in the mover's frame when it is one
  uint32_t facet;
  uint32_t mover;  // RTC_INVALID_GEOMETRY_ID: what stands still
  float span;      // width on a surface that faces the ray, m
  bool mirrored;   // seen in a mirror: a rougher look will do
};

// What a surface sends back along the ray. When it mirrors: `mirror` > 0 says which share of what comes from
// `reflected` is to be added.
struct Sent {
  float4 radiance;
  float mirror;
  float3 normal;  // unit, towards the viewer
  float roughness;
  uint32_t material;
};
Sent shade(const Air &air, const Eye &eye, const Met &met);
// What is seen where the ray meets nothing.
float4 shade_sky(const Air &air, float3 direction);
// Through `distance` of water on the way to the eye. `jitter` in [0, 1).
float4 through_water(const Air &air, const Eye &eye, float3 origin, float3 direction, float distance, float jitter,
                     float4 radiance);

}  // namespace wm::render
