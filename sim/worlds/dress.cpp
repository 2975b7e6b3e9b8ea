// SPDX-License-Identifier: Apache-2.0
#include "worlds/dress.h"

#include <algorithm>
#include <cmath>

#include "render/patterns.h"
#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"

namespace wm::sim {
namespace {

using images::Colour;
using images::Vec2;
using images::Vec3;
using render::Material;
using render::Mesh;
using render::Texture;

constexpr int kTexture_px = 512;

double length_of(const Face &f) {
  const double dx = f.b.x_m - f.a.x_m, dy = f.b.y_m - f.a.y_m;
  return std::sqrt(dx * dx + dy * dy);
}

// The part of a face between two heights; u runs to the right of who looks at it.
Mesh upright(const Face &f, double bottom, double top, uint32_t material) {
  return render::quad({f.b.x_m, f.b.y_m, bottom}, {f.a.x_m - f.b.x_m, f.a.y_m - f.b.y_m, 0}, {0, 0, top - bottom},
                      material);
}

std::vector<Vec2> outline(const std::vector<Point> &points) {
  std::vector<Vec2> out;
  for (const Point &p : points) out.emplace_back(p.x_m, p.y_m);
  return out;
}

Material flooring(Flooring kind, uint64_t seed, bool hard, double tone) {
  const float grey = static_cast<float>(tone);
  const Colour colour(1.04f * grey, grey, 0.93f * grey);
  images::Picture picture;
  Material m;
  m.albedo = Colour(1.f);
  switch (kind) {
    case Flooring::tiles:
      picture = render::tiles(seed, kTexture_px, 4, 0.02, colour, Colour(0.45f * grey), hard ? 0.16 : 0.08);
      m.texture_size_m = {2.4, 2.4};
      m.mirror = hard ? 0.07 : 0.035;
      m.mirror_glance = hard ? 1.0 : 0.8;
      m.roughness_rad = 0.006;
      break;
    case Flooring::linoleum:
      picture = render::linoleum(seed, kTexture_px, colour, 0.25);
      m.texture_size_m = {2, 2};
      m.mirror = hard ? 0.06 : 0.03;
      m.mirror_glance = hard ? 0.9 : 0.7;
      m.roughness_rad = 0.012;
      break;
    case Flooring::planks:
      picture = render::planks(seed, kTexture_px, 8, Colour(1.15f * grey, 0.9f * grey, 0.62f * grey), 0.2);
      m.texture_size_m = {1.6, 1.6};
      m.mirror = 0.02;
      m.mirror_glance = hard ? 0.5 : 0.3;
      m.roughness_rad = 0.02;
      break;
    case Flooring::concrete:
      picture = render::concrete(seed, kTexture_px, Colour(grey), hard ? 0.6 : 0.3);
      m.texture_size_m = {4, 4};
      m.mirror = 0.01;
      m.mirror_glance = 0.2;
      m.roughness_rad = 0.03;
      break;
    case Flooring::carpet:
      picture = render::carpet(seed, kTexture_px, colour * 0.7f, 0.3);
      m.texture_size_m = {1, 1};
      break;
  }
  render::add_dirt(seed + 1, hard ? 0.45 : 0.12, picture);
  m.texture = Texture::make(picture);
  return m;
}

Material plain(Colour colour) {
  Material m;
  m.albedo = colour;
  return m;
}

Material painted(uint64_t seed, Colour colour, double grime) {
  Material m;
  m.albedo = Colour(1.f);
  m.texture = Texture::make(render::paint(seed, kTexture_px, colour, grime));
  m.texture_size_m = {3, 3};
  return m;
}

void hang_posters(const Plan &plan, const BuildingStyle &style, render::Scene &scene) {
  Dice dice(style.seed, Part::posters);
  for (const Face &f : plan.faces) {
    const double length = length_of(f);
    const double where = dice.uniform(0.25, 0.75), width = dice.uniform(0.4, 1.0), height = dice.uniform(0.4, 1.0);
    const double middle = dice.uniform(1.15, 1.5);
    const bool hung = dice.chance(std::min(0.8, length / (style.hard ? 3.5 : 5.0)));
    if (f.surface != Surface::wall || f.bottom_m > 0 || length < 1.4 || !hung || !f.mapped) continue;
    const int w = 192, h = static_cast<int>(192 * height / width);
    Material m;
    m.albedo = Colour(0.9f);
    m.texture =
        Texture::make(render::poster(style.seed * 1000003 + static_cast<uint64_t>(dice.integer(0, 1 << 20)), w, h),
                      render::Wrap::clamp);
    m.texture_size_m = {width, height};
    const Vec3 along(f.a.x_m - f.b.x_m, f.a.y_m - f.b.y_m, 0);
    const Vec3 off = along.cross(Vec3(0, 0, 1)).normalized() * 0.003;
    const Vec3 place = Vec3(f.b.x_m, f.b.y_m, middle) + along * where + off;
    scene.add(render::picture(place, along, {0, 0, 1}, width, height, scene.add(m)));
  }
}

}  // namespace

void dress(const Plan &plan, const BuildingStyle &style, render::Scene &scene) {
  Dice dice(style.seed, Part::paint);
  const uint64_t seed = style.seed * 7919 + 13;
  const float wall_grey = static_cast<float>(style.wall_grey * dice.uniform(0.92, 1.06));
  const Colour warm(1.03f, 1.f, static_cast<float>(dice.uniform(0.88, 1.0)));
  const double grime = style.hard ? 0.5 : 0.12;
  const uint32_t wall = scene.add(painted(seed, warm * wall_grey, grime));
  const uint32_t skirting =
      scene.add(plain(Colour(static_cast<float>(style.hard ? dice.uniform(0.12, 0.32) : dice.uniform(0.09, 0.18)))));
  const uint32_t jamb = scene.add(plain(Colour(static_cast<float>(dice.uniform(0.25, 0.5)))));
  const uint32_t shelf_side = scene.add(plain(Colour(0.34f, 0.30f, 0.25f)));
  const uint32_t desk = scene.add(plain(Colour(0.42f, 0.31f, 0.2f)));
  const uint32_t pillar = scene.add(painted(seed + 5, warm * (0.8f * wall_grey), grime));
  const uint32_t carton = scene.add(plain(Colour(0.33f, 0.23f, 0.13f)));
  Material ceiling = plain(Colour(0.8f));
  if (style.ceiling_panels) {
    ceiling.albedo = Colour(1.f);
    ceiling.texture = Texture::make(render::ceiling_panels(seed + 9, 1024, 4, Colour(0.72f)));
    ceiling.texture_size_m = {2.4, 2.4};
  }
  const uint32_t above = scene.add(ceiling);

  // Floors, one material between two borders, and a strip of metal on each border.
  std::vector<uint32_t> floors;
  for (size_t i = 0; i < style.floorings.size(); i++)
    floors.push_back(scene.add(flooring(style.floorings[i], seed + 20 + i, style.hard, dice.uniform(0.28, 0.48))));
  const uint32_t strip = scene.add(plain(Colour(0.16f)));
  Mesh mesh;
  Plan floor = plan;
  std::erase_if(floor.faces, [](const Face &f) { return f.surface == Surface::desk; });
  for (const auto &piece : floor_pieces(floor, style.borders_m)) {
    const double x = 0.5 * (piece[0].x_m + piece[1].x_m);
    size_t zone = 0;
    while (zone < style.borders_m.size() && x > style.borders_m[zone]) zone++;
    mesh.append(render::flat_polygon(outline(piece), 0, true, floors[std::min(zone, floors.size() - 1)]));
    if (zone > 0 && piece[0].x_m == style.borders_m[zone - 1])
      mesh.append(render::quad({piece[0].x_m - 0.02, piece[0].y_m, 0.002}, {0.04, 0, 0},
                               {0, piece[3].y_m - piece[0].y_m, 0}, strip));
  }

  // The ceiling runs over what doesn't reach it.
  if (plan.outside_is_solid) {
    Plan high = plan;
    std::erase_if(high.faces, [](const Face &f) { return f.surface == Surface::shelf || f.surface == Surface::desk; });
    for (const auto &piece : floor_pieces(high, {}))
      mesh.append(render::flat_polygon(outline(piece), plan.ceiling_m, false, above));
  }

  // Upright faces. A door's picture and a shelf's goods are as wide as their face.
  int drawn = 0;
  for (const Face &f : plan.faces) {
    const double length = length_of(f), height = f.top_m - f.bottom_m;
    switch (f.surface) {
      case Surface::wall:
      case Surface::pillar:
      case Surface::lintel: {
        const uint32_t paint = f.surface == Surface::pillar ? pillar : wall;
        const bool skirted = style.skirting_m > 0 && f.bottom_m <= 0 && f.mapped;
        if (skirted) mesh.append(upright(f, 0, style.skirting_m, skirting));
        mesh.append(upright(f, skirted ? style.skirting_m : f.bottom_m, f.top_m, paint));
        break;
      }
      case Surface::jamb: mesh.append(upright(f, f.bottom_m, f.top_m, jamb)); break;
      case Surface::desk:  // a board on legs
        mesh.append(upright(f, f.top_m - 0.04, f.top_m, desk));
        mesh.append(render::box(images::pose_xyz_rpy({f.a.x_m, f.a.y_m, 0.5 * (f.top_m - 0.04)}, 0, 0, 0),
                                {0.05, 0.05, f.top_m - 0.04}, jamb));
        break;
      case Surface::carton: mesh.append(upright(f, f.bottom_m, f.top_m, carton)); break;
      case Surface::door:
      case Surface::window:
      case Surface::shelf: {
        if (f.surface == Surface::shelf && length < 0.7) {
          mesh.append(upright(f, f.bottom_m, f.top_m, shelf_side));
          break;
        }
        const int w = 256, h = std::clamp(static_cast<int>(256 * height / std::max(length, 0.1)), 32, 1024);
        const uint64_t number = seed + 100 + static_cast<uint64_t>(drawn++);
        Dice tone(number, Part::doors);
        const float leaf = static_cast<float>(tone.uniform(0.12, 0.45));
        Material m;
        m.albedo = Colour(1.f);
        m.texture = Texture::make(
            f.surface == Surface::door
                ? render::door(number, w, h, Colour(1.2f * leaf, leaf, 0.75f * leaf), Colour(0.3f))
            : f.surface == Surface::window ? render::window(number, w, h, Colour(0.5f, 0.6f, 0.7f), Colour(0.2f))
                                           : render::goods(number, w, h, std::max(2, static_cast<int>(height / 0.4))),
            render::Wrap::clamp);
        m.texture_size_m = {length, height};
        if (f.surface == Surface::window) m.mirror = 0.04;
        mesh.append(upright(f, f.bottom_m, f.top_m, scene.add(m)));
        break;
      }
    }
  }
  for (const Lid &lid : plan.lids) {
    if (lid.surface == Surface::desk)
      mesh.append(render::flat_polygon(outline(lid.outline), lid.z_m - 0.04, false, desk));
    mesh.append(render::flat_polygon(outline(lid.outline), lid.z_m, lid.up,
                                     lid.surface == Surface::carton  ? carton
                                     : lid.surface == Surface::desk  ? desk
                                     : lid.surface == Surface::shelf ? shelf_side
                                     : lid.surface == Surface::jamb  ? jamb
                                                                     : wall));
  }
  scene.add(mesh);
  if (style.posters) hang_posters(plan, style, scene);
}

void hang_lamps(const std::vector<CeilingLamp> &lamps, double ceiling_m, render::Scene &scene) {
  Material glass, dead;
  glass.albedo = Colour(0.6f);
  glass.emission = Colour(1.6f, 1.58f, 1.5f);
  dead.albedo = Colour(0.6f);
  const uint32_t lit = scene.add(glass), dark = scene.add(dead);
  for (const CeilingLamp &l : lamps) {
    const auto [s, c] = wm::sincos(l.yaw_rad);
    const Vec3 along(c * l.length_m, s * l.length_m, 0), across(-s * l.width_m, c * l.width_m, 0);
    const Vec3 middle(l.p.x_m, l.p.y_m, ceiling_m - 0.02);
    const Vec3 corner = middle - 0.5 * along - 0.5 * across;
    scene.add(render::quad(corner, across, along, l.on ? lit : dark));
    if (!l.on) continue;
    render::Lamp lamp;
    lamp.kind = render::Lamp::Kind::panel;
    lamp.position = middle - Vec3(0, 0, 0.02);
    lamp.direction = {0, 0, -1};
    lamp.edge_u = along;
    lamp.edge_v = across;
    lamp.power = l.power;
    lamp.reach_m = 9;
    scene.add(lamp);
  }
}

std::vector<CeilingLamp> lamps_for(const Plan &plan, double spacing) {
  std::vector<CeilingLamp> out;
  const Rectangle b = plan.bounds();
  const int nx = std::max(1, static_cast<int>(std::lround((b.x1_m - b.x0_m) / spacing)));
  const int ny = std::max(1, static_cast<int>(std::lround((b.y1_m - b.y0_m) / spacing)));
  for (int j = 0; j < ny; j++)
    for (int i = 0; i < nx; i++) {
      const Point p{b.x0_m + (i + 0.5) * (b.x1_m - b.x0_m) / nx, b.y0_m + (j + 0.5) * (b.y1_m - b.y0_m) / ny};
      if (plan.clearance_m(p) > 0.7) out.push_back({p});
    }
  return out;
}

}  // namespace wm::sim
