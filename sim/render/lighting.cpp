// SPDX-License-Identifier: Apache-2.0
// Light on what doesn't move, worked out once at the corners of triangles.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "render/scene_data.h"
#include "render/workers.h"
#include "waymark/internal/math/elementary.hpp"
#include "waymark/random.h"

namespace wm::render {

namespace {

// Shadow rays begin this far from surfaces: over skirting boards and pictures, which would hide them from the light.
constexpr double kLift = 0.03;

bool blocked(RTCScene still, const Vec3 &from, const Vec3 &step) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(from.x());
  ray.org_y = static_cast<float>(from.y());
  ray.org_z = static_cast<float>(from.z());
  ray.dir_x = static_cast<float>(step.x());
  ray.dir_y = static_cast<float>(step.y());
  ray.dir_z = static_cast<float>(step.z());
  ray.tnear = 0;
  ray.tfar = 1;
  ray.mask = ~0u;
  return is_blocked(still, ray);
}

// Falls from 1 at half of the reach to 0 at the reach.
double fade(double distance, double reach) {
  const double x = std::clamp(2 * distance / reach - 1, 0.0, 1.0);
  return 1 - x * x * (3 - 2 * x);
}

double power_of(double base, double exponent) {
  if (exponent == 0) return 1;
  if (exponent == 1) return base;
  return base > 0 ? wm::exp(exponent * wm::log(base)) : 0;
}

double from_place(const Lamp &lamp, const Vec3 &place, RTCScene still, const Vec3 &point, const Vec3 &normal) {
  const Vec3 way = place - point;
  const double d2 = way.squaredNorm(), d = std::sqrt(d2);
  if (d >= lamp.reach_m || d <= 0) return 0;
  const double facing = normal.dot(way) / d;
  const double shining = lamp.focus > 0 ? -lamp.direction.normalized().dot(way) / d : 1;
  if (facing <= 0 || shining <= 0) return 0;
  const double light = lamp.power * facing * power_of(shining, lamp.focus) / (d2 + lamp.radius_m * lamp.radius_m) *
                       fade(d, lamp.reach_m);
  // The last stretch is left out: the lamp's own glass must not shade it.
  const double share = std::max(0.0, (d - 0.05 - lamp.radius_m) / d);
  if (still && lamp.shadow && light > 1e-5 && blocked(still, point + normal * kLift, way * share)) return 0;
  return light;
}

}  // namespace

Colour lamp_light(const Scene &scene, RTCScene still, const Vec3 &point, const Vec3 &normal) {
  Colour sum;
  for (const Lamp &lamp : scene.data().lamps) {
    double light = 0;
    if (lamp.kind == Lamp::Kind::point) {
      light = from_place(lamp, lamp.position, still, point, normal);
    } else {
      for (double i : {-0.25, 0.25})
        for (double j : {-0.25, 0.25})
          light += 0.25 * from_place(lamp, lamp.position + i * lamp.edge_u + j * lamp.edge_v, still, point, normal);
    }
    sum = sum + lamp.colour * static_cast<float>(light);
  }
  const Sun &sun = scene.sun;
  const Vec3 towards = sun.towards.normalized();
  const double facing = normal.dot(towards);
  if (sun.power.grey() > 0 && facing > 0 &&
      !(still && sun.shadow && blocked(still, point + normal * kLift, towards * 1000)))
    sum = sum + sun.power * static_cast<float>(facing);
  return sum;
}

float open_share(const Ambient &ambient, RTCScene still, const Vec3 &point, const Vec3 &normal) {
  if (ambient.contact_m <= 0) return 1;
  // Directions by Fibonacci's spiral on the disc, lifted to the hemisphere: even in cosine-weighted solid angle.
  constexpr int kRays = 16;
  const Vec3 side = normal.unitOrthogonal(), other = normal.cross(side);
  const Vec3 lifted = point + normal * kLift;
  int open = 0;
  for (int i = 0; i < kRays; i++) {
    const double r2 = (i + 0.5) / kRays;
    const sin_cos a = sincos(2.399963229728653 * i);
    const double r = std::sqrt(r2);
    const Vec3 d = side * (r * a.cos) + other * (r * a.sin) + normal * std::sqrt(1 - r2);
    if (!blocked(still, lifted, d * ambient.contact_m)) open++;
  }
  return static_cast<float>(1 - ambient.contact_strength * (kRays - open) / kRays);
}

namespace {

// Corners of neighbours are lit once: same place, same normal.
struct Key {
  float v[6];
  bool operator==(const Key &other) const { return std::equal(v, v + 6, other.v); }
};
struct KeyHash {
  size_t operator()(const Key &p) const {
    uint64_t h = 0;
    for (float v : p.v) h = (h ^ std::bit_cast<uint32_t>(v)) * 0x9e3779b97f4a7c15ull, h ^= h >> 29;
    return static_cast<size_t>(h);
  }
};

void light_place(const Scene &scene, RTCScene still, Place &place) {
  // A corner lies on the walls that meet there; its light is that of a point a little inside of its surfaces.
  Vec3 point = place.position;
  const double inwards = place.inwards.norm();
  if (inwards > 1e-3) point += place.inwards * (2 * kLift / inwards);
  for (int side = 0; side < 2; side++) {
    const Vec3 normal = side == 0 ? place.normal : -place.normal;
    place.lit.lamps[side] = lamp_light(scene, still, point, normal);
    place.lit.open[side] = open_share(scene.ambient, still, point, normal);
  }
}

}  // namespace

void find_places(const std::vector<Triangle> &triangles, Shape &shape) {
  std::unordered_map<Key, uint32_t, KeyHash> known;
  known.reserve(triangles.size());
  for (size_t i = 0; i < triangles.size(); i++) {
    const Triangle &t = triangles[i];
    const Vec3 middle = (t[0].position + t[1].position + t[2].position) / 3;
    for (size_t k = 0; k < 3; k++) {
      Key key;
      for (int a = 0; a < 3; a++) {
        key.v[a] = static_cast<float>(t[k].position[a]);
        key.v[3 + a] = static_cast<float>(std::lround(t[k].normal[a] * 1000));
      }
      const auto [it, fresh] = known.try_emplace(key, static_cast<uint32_t>(shape.places.size()));
      if (fresh) shape.places.push_back({t[k].position, t[k].normal, Vec3(0, 0, 0), {}});
      shape.places[it->second].inwards += middle - t[k].position;
      shape.pieces[i].places[k] = it->second;
    }
  }
}

void light_places(const Scene &scene, RTCScene still, std::vector<Place> &places) {
  Workers workers(0);
  workers.run(static_cast<int>(places.size()), 256, [&](int begin, int end, int) {
    for (int i = begin; i < end; i++) light_place(scene, still, places[static_cast<size_t>(i)]);
  });
}

void light_mover(const Scene &scene, const Shape &shape, const Pose &T_map_mover, std::vector<Lit> &out) {
  std::vector<const Lamp *> near;
  for (const Lamp &lamp : scene.data().lamps)
    if ((lamp.position - T_map_mover * shape.middle).norm() < lamp.reach_m + shape.radius_m) near.push_back(&lamp);
  const Vec3 sun = scene.sun.towards.normalized();
  out.resize(shape.places.size());
  for (size_t i = 0; i < out.size(); i++) {
    const Vec3 point = T_map_mover * shape.places[i].position, normal = T_map_mover.linear() * shape.places[i].normal;
    for (int side = 0; side < 2; side++) {
      const Vec3 facing = side == 0 ? normal : -normal;
      Colour sum = scene.sun.power * static_cast<float>(std::max(facing.dot(sun), 0.0));
      for (const Lamp *lamp : near)
        sum = sum + lamp->colour * static_cast<float>(from_place(*lamp, lamp->position, nullptr, point, facing));
      out[i].lamps[side] = sum;
      out[i].open[side] = 1;
    }
  }
}

}  // namespace wm::render
