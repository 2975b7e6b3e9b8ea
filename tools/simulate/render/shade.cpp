// SPDX-License-Identifier: Apache-2.0
#include "simulate/render/shade.h"

#include <algorithm>
#include <cmath>

#include "math/elementary.hpp"

namespace wm::render {

namespace {

float3 turned(const std::array<float, 9> &r, float3 v) {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}

// A beam's light at a place, without regard to how the surface lies; `way` leads from the place to the lamp.
float4 beam_at(const Air &air, const Beam &beam, float3 place, float3 &way) {
  way = beam.position - place;
  const float d2 = std::max(dot(way, way), 1e-4f), d = std::sqrt(d2);
  way = way * (1 / d);
  const float off = (1 + dot(way, beam.direction)) * beam.narrow;
  const float4 power = beam.power * splat(1 / ((1 + off * off) * d2));
  return air.data && !air.attenuation.table.empty() ? power * air.attenuation(d) : power;
}

float spot_shadow(const Air &air, float3 point) {
  float open = 1;
  for (const SpotShadow &s : air.shadows) {
    const float3 way = point - s.centre;
    if (way.z > 0.1f || way.z < -0.3f) continue;
    const float r2 = (way.x * way.x + way.y * way.y) * s.inverse_radius * s.inverse_radius;
    if (r2 < 1) open *= 1 - 0.6f * (1 - r2) * (1 - r2);
  }
  return open;
}

}  // namespace

Sent shade(const Air &air, const Eye &eye, const Met &met) {
  const Scene::Data &data = *air.data;
  const bool still = met.mover == RTC_INVALID_GEOMETRY_ID;
  const Facet &facet = still ? data.facets[met.facet] : data.mover_shapes[met.mover].facets[met.facet];
  const Surface &surface = data.surfaces[facet.material];

  float3 normal = still ? met.normal : turned(air.mover_rotations[met.mover], met.normal);
  normal = normal * (1 / std::sqrt(std::max(dot(normal, normal), 1e-30f)));
  float facing = -dot(normal, met.direction);
  const int side = facing < 0;
  if (side) normal = normal * -1.0f, facing = -facing;

  const float u = met.u, v = met.v, w = 1 - u - v;
  float4 albedo = surface.albedo;
  if (surface.texture) {
    // A slanted surface is cut long by the pixel: the mean of its width and its length is the blur that errs least.
    const float span = met.span / std::sqrt(std::max(facing, 0.02f)) * facet.span_per_m;
    albedo *= TextureSampler::sample(*surface.texture, w * facet.s[0] + u * facet.s[1] + v * facet.s[2],
                                     w * facet.t[0] + u * facet.t[1] + v * facet.t[2], span, !met.mirrored);
  }

  const float up = 0.5f + 0.5f * normal.z;
  const float4 around = (air.ambient_down + (air.ambient_up - air.ambient_down) * splat(up)) * splat(air.ambient);
  float4 light;
  if (still) {
    const float4 *corner = facet.light[side];
    light = corner[0] * splat(w) + corner[1] * splat(u) + corner[2] * splat(v);
    const float open = light[3];
    light = light * splat(air.light) + around * splat(open);
    if (!air.shadows.empty() && normal.z > 0.7f)
      light *= splat(spot_shadow(air, met.origin + met.direction * met.distance));
  } else {
    const float3 p = met.origin + met.direction * met.distance;
    const Colour lamps = lamp_light(*air.scene, nullptr, Vec3(double(p.x), double(p.y), double(p.z)),
                                    Vec3(double(normal.x), double(normal.y), double(normal.z)));
    light = as_float4(lamps) * splat(air.light) + around;
  }
  for (const Beam &beam : eye.beams) {
    float3 way;
    const float4 power = beam_at(air, beam, met.origin + met.direction * met.distance, way);
    light += power * splat(std::max(dot(normal, way), 0.0f));
  }

  Sent sent{albedo * light, 0, normal, surface.roughness, facet.material};
  if (surface.emits) sent.radiance += surface.emission * splat(air.light);
  if (surface.mirror > 0 && !met.mirrored && !air.scene->water.there) {
    const float a = 1 - facing, a2 = a * a;
    sent.mirror = surface.mirror + (1 - surface.mirror) * surface.glance * a2 * a2 * a;
    sent.radiance *= splat(1 - sent.mirror);
  }
  return sent;
}

float4 shade_sky(const Air &air, float3 d) {
  const Sky &sky = air.scene->sky;
  if (sky.panorama) {
    const double azimuth = wm::atan2(double(d.y), double(d.x));
    const double up = wm::atan2(double(d.z), double(std::sqrt(d.x * d.x + d.y * d.y)));
    return TextureSampler::sample(*sky.panorama, static_cast<float>(azimuth / kTwoPi + 0.5),
                                  static_cast<float>(up / kPi + 0.5), 0) *
           splat(air.ambient);
  }
  const float4 horizon = as_float4(sky.horizon);
  const float4 end = as_float4(d.z > 0 ? sky.zenith : sky.ground);
  const float share = std::min(std::sqrt(std::fabs(d.z)) * (d.z > 0 ? 1.0f : 4.0f), 1.0f);
  return (horizon + (end - horizon) * splat(share)) * splat(air.ambient);
}

float4 through_water(const Air &air, const Eye &eye, float3 origin, float3 direction, float distance, float jitter,
                     float4 radiance) {
  const Water &water = air.scene->water;
  const float4 passed = air.attenuation(distance);
  float4 out = radiance * passed + as_float4(water.haze) * splat(air.ambient) * (splat(1) - passed);
  if (eye.beams.empty() || water.lamp_haze <= 0) return out;
  // What the beams light in the water on the way: a few steps, finer near the lamp, where it matters.
  constexpr int kSteps = 6;
  constexpr float kFar = 6;
  const float end = std::min(distance, kFar);
  for (int i = 0; i < kSteps; i++) {
    const float x = (static_cast<float>(i) + jitter) / kSteps, at = end * x * x;
    const float length = 2 * x * end / kSteps;  // d(at)/dx · step
    const float3 place = origin + direction * at;
    for (const Beam &beam : eye.beams) {
      float3 way;
      out += beam_at(air, beam, place, way) * air.attenuation(at) * splat(static_cast<float>(water.lamp_haze) * length);
    }
  }
  return out;
}

}  // namespace wm::render
