// SPDX-License-Identifier: Apache-2.0
// The crossing: streets between house fronts, a car that turns left, two fisheyes, and landmarks that are there anyway:
// signs, house numbers, shop windows.
#include <algorithm>
#include <cmath>

#include "render/patterns.h"
#include "simulate/angle.h"
#include "simulate/route.h"
#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"
#include "worlds/dress.h"
#include "worlds/makers.h"
#include "worlds/signs.h"

namespace wm::sim {
namespace {

using images::Colour;
using images::Picture;
using images::Vec2;
using images::Vec3;
using render::Material;
using render::Mesh;
using render::Texture;

constexpr double kKerb_m = 0.12;

// Two roads that cross: one along x, one along y. Each is given by its middle and the half widths of carriageway and of
// the space between the house fronts.
struct Streets {
  double x, y;  // middles: of the road along y, of the road along x
  double road_x, road_y, front_x, front_y;
  double end;  // how far the streets go from the crossing
};

Route drawn_route(uint64_t seed) {
  Dice dice(seed, Part::route);
  Leg stand, ahead, turn, on, off;
  stand.stand_s = 4;
  ahead.kind = on.kind = off.kind = Leg::Kind::straight;
  ahead.length_m = dice.uniform(17, 23);
  ahead.speed_mps = on.speed_mps = off.speed_mps = 3;
  turn.kind = Leg::Kind::turn;
  turn.turn_rad = 90 * kDeg;
  turn.radius_m = dice.uniform(6.5, 8);
  turn.ease_m = 4;
  turn.speed_mps = 2;
  on.length_m = dice.uniform(5, 8);
  off.length_m = dice.uniform(13, 18);
  Leg pause = stand, last = stand;
  pause.stand_s = 3;  // for somebody who crosses the street
  last.stand_s = 1;
  Route route;
  route.legs = {stand, ahead, turn, on, pause, off, last};
  return route;
}

// The drive keeps to the right lane: the middles of the roads lie to its left.
Streets streets_around(const Route &route, uint64_t seed) {
  Dice dice(seed, Part::building);
  Drive drive;
  State end{};
  if (Drive::plan(route, drive, nullptr) == WM_OK) end = drive.at(drive.duration_s());
  const double lane = dice.uniform(1.6, 1.9);
  Streets s{};
  s.y = route.y_m + lane;
  s.x = end.x_m - lane;
  s.road_x = s.road_y = 2 * lane;
  s.front_x = s.road_x + dice.uniform(2.4, 3.6);
  s.front_y = s.road_y + dice.uniform(2.4, 3.6);
  s.end = 42;
  return s;
}

struct Facade {
  Vec3 corner, along;  // foot at the left end as one looks at it, unit vector to the right
  double length, height, ground_m;
  Vec3 normal;
};

class Builder {
 public:
  Builder(const WorldRequest &request, World &world) : request_(request), world_(world), scene_(world.scene) {}

  void build(const Streets &s) {
    ground(s);
    markings(s);
    houses(s);
    cars(s);
    people(s);
    sky();
  }

 private:
  uint32_t picture_material(const Picture &picture, double width, double height) {
    Material m;
    m.albedo = Colour(1.f);
    m.texture = Texture::make(picture, render::Wrap::clamp);
    m.texture_size_m = {width, height};
    return scene_.add(m);
  }
  uint32_t tiled(const Picture &picture, double size) {
    Material m;
    m.albedo = Colour(1.f);
    m.texture = Texture::make(picture);
    m.texture_size_m = {size, size};
    return scene_.add(m);
  }
  uint32_t plain(Colour colour, double mirror = 0) {
    Material m;
    m.albedo = colour;
    m.mirror = mirror;
    return scene_.add(m);
  }
  static Mesh level(double x0, double y0, double x1, double y1, double z, uint32_t material) {
    return render::flat_polygon({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, z, true, material);
  }

  void ground(const Streets &s) {
    Picture street = render::asphalt(request_.seed, 512, Colour(0.13f), request_.hard ? 0.7 : 0.3);
    if (request_.hard) render::add_dirt(request_.seed + 3, 0.5, street);
    const uint32_t asphalt = tiled(street, 5);
    const uint32_t paving =
        tiled(render::tiles(request_.seed + 1, 512, 6, 0.03, Colour(0.30f), Colour(0.16f), 0.15), 3.0);
    const uint32_t kerb = plain(Colour(0.38f));
    Mesh m = level(s.x - s.end - 10, s.y - s.end - 10, s.x + s.end + 10, s.y + s.end + 10, 0, asphalt);
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0}) {
        // A block's pavement, its corner rounded by three pieces.
        const double x = s.x + sx * s.road_x, y = s.y + sy * s.road_y, far = s.end + 10, r = 2.0;
        std::vector<Vec2> rim = {{x, s.y + sy * far}};
        for (int i = 0; i <= 6; i++) {
          const auto [sn, cs] = wm::sincos(i * 15 * kDeg);
          rim.emplace_back(x + sx * r * (1 - cs), y + sy * r * (1 - sn));
        }
        rim.emplace_back(s.x + sx * far, y);
        std::vector<Vec2> area = rim;
        area.emplace_back(s.x + sx * far, s.y + sy * far);
        m.append(render::flat_polygon(area, kKerb_m, true, paving));
        m.append(render::walls(rim, false, 0, kKerb_m, kerb));
        // The kerb stones' top.
        for (size_t i = 0; i + 1 < rim.size(); i++) {
          const Vec2 d = (rim[i + 1] - rim[i]).normalized() * (rim[i + 1] - rim[i]).norm();
          const Vec2 in = Vec2(-d.y(), d.x()).normalized() * (sx * sy > 0 ? 0.15 : -0.15);
          m.append(
              render::flat_polygon({rim[i], rim[i + 1], rim[i + 1] + in, rim[i] + in}, kKerb_m + 0.003, true, kerb));
        }
      }
    scene_.add(m);
  }

  void markings(const Streets &s) {
    const uint32_t white = plain(Colour(request_.hard ? 0.36f : 0.62f));
    Mesh m;
    const auto bar = [&](double x0, double y0, double x1, double y1) { m.append(level(x0, y0, x1, y1, 0.004, white)); };
    for (double d = 9; d < s.end; d += 4) {
      for (const double side : {-1.0, 1.0}) {
        const double x = s.x + side * (s.road_x + d), y = s.y + side * (s.road_y + d);
        bar(std::min(x, x + side * 2), s.y - 0.06, std::max(x, x + side * 2), s.y + 0.06);
        bar(s.x - 0.06, std::min(y, y + side * 2), s.x + 0.06, std::max(y, y + side * 2));
      }
    }
    // Zebras on all four arms and stop lines before them, on the right side of who comes.
    for (const double side : {-1.0, 1.0}) {
      for (double u = -s.road_y + 0.4; u + 0.4 < s.road_y; u += 0.9) {
        const double x = s.x + side * (s.road_x + 2.4);
        bar(std::min(x, x + side * 3), s.y + u, std::max(x, x + side * 3), s.y + u + 0.45);
      }
      for (double u = -s.road_x + 0.4; u + 0.4 < s.road_x; u += 0.9) {
        const double y = s.y + side * (s.road_y + 2.4);
        bar(s.x + u, std::min(y, y + side * 3), s.x + u + 0.45, std::max(y, y + side * 3));
      }
      const double x = s.x + side * (s.road_x + 6.2), y = s.y + side * (s.road_y + 6.2);
      bar(x - 0.2, side < 0 ? s.y - s.road_y + 0.1 : s.y + 0.1, x + 0.2, side < 0 ? s.y - 0.1 : s.y + s.road_y - 0.1);
      bar(side < 0 ? s.x + 0.1 : s.x - s.road_x + 0.1, y - 0.2, side < 0 ? s.x + s.road_x - 0.1 : s.x - 0.1, y + 0.2);
    }
    scene_.add(m);
  }

  void houses(const Streets &s) {
    Dice dice(request_.seed, Part::houses);
    for (uint64_t i = 0; i < 4; i++) {
      const float red = static_cast<float>(dice.uniform(0.2, 0.34)),
                  green = red * static_cast<float>(dice.uniform(0.42, 0.6));
      const float tone = static_cast<float>(dice.uniform(0.38, 0.62)),
                  blue = tone * static_cast<float>(dice.uniform(0.65, 0.95));
      const uint64_t number = request_.seed * 977 + i;
      walls_.push_back(tiled(render::bricks(number, 256, 12, Colour(red, green, 0.08f), Colour(0.32f), 0.25), 0.9));
      walls_.push_back(
          tiled(render::paint(number, 256, Colour(tone, 0.93f * tone, blue), request_.hard ? 0.6 : 0.25), 4));
    }
    // Along each front from the crossing outwards: house after house.
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0})
        for (const bool along_x : {true, false}) {
          double d = 0;
          while (d < s.end) {
            const double length = dice.uniform(7, 12), height = 3.2 + 2.9 * dice.integer(1, 3);
            // Seen from the street; left and right swap with the side of the road.
            const double x = s.x + sx * s.front_x, y = s.y + sy * s.front_y;
            const Vec3 near = along_x ? Vec3(x + sx * d, y, kKerb_m) : Vec3(x, y + sy * d, kKerb_m);
            const Vec3 out = along_x ? Vec3(sx, 0, 0) : Vec3(0, sy, 0);
            const Vec3 normal = along_x ? Vec3(0, -sy, 0) : Vec3(-sx, 0, 0);
            const Vec3 right = Vec3(0, 0, 1).cross(normal);
            const bool outwards = right.dot(out) > 0;
            house({outwards ? near : near + length * out, right, length, height, 3.2, normal}, dice, d, outwards);
            d += length;
          }
        }
  }

  void house(const Facade &f, Dice &dice, double from_crossing, bool outwards) {
    const uint64_t number = request_.seed * 977 + static_cast<uint64_t>(++houses_);
    const uint32_t wall = walls_[static_cast<size_t>(dice.integer(0, static_cast<int>(walls_.size()) - 1))];
    const uint32_t roof = plain(Colour(0.12f, 0.10f, 0.10f)), ledge = plain(Colour(0.42f));
    Mesh m = render::quad(f.corner, f.length * f.along, Vec3(0, 0, f.height), wall);
    // The house's body behind its front, so that it casts a shadow and hides the sky.
    const Vec3 back = -8.0 * f.normal, up(0, 0, f.height);
    // At the crossing's corner the other street's front stands there.
    for (const double side : {0.0, f.length})
      if (from_crossing > 0 || outwards != (side == 0))
        m.append(render::quad(f.corner + side * f.along, back, up, wall));
    m.append(render::quad(f.corner + up, f.length * f.along, back, roof));
    // A base course and a ledge over the ground floor.
    m.append(bar(f, 0, f.length, 0, 0.5, 0.02, ledge));
    m.append(bar(f, 0, f.length, f.ground_m, f.ground_m + 0.2, 0.028, ledge));
    m.append(bar(f, 0, f.length, f.height - 0.3, f.height, 0.028, ledge));

    const int bays = std::max(2, static_cast<int>(f.length / dice.uniform(2.0, 2.8)));
    const double bay = f.length / bays, wide = std::min(bay - 0.7, dice.uniform(1.0, 1.5));
    const float glass_tone = static_cast<float>(dice.uniform(0.03, 0.12));
    const auto window = [&](double width, double height, uint64_t variant) {
      Material glass;
      glass.albedo = Colour(1.f);
      glass.texture = Texture::make(render::window(number + variant, 128, static_cast<int>(128 * height / width),
                                                   Colour(glass_tone, glass_tone, 1.3f * glass_tone), Colour(0.5f)),
                                    render::Wrap::clamp);
      glass.texture_size_m = {width, height};
      glass.mirror = 0.06;
      return scene_.add(glass);
    };
    const uint32_t upper = window(wide, 1.6, 1);
    for (double z = f.ground_m + 0.85; z + 1.7 < f.height; z += 2.9)
      for (int i = 0; i < bays; i++) {
        const Vec3 middle = at(f, (i + 0.5) * bay, z + 0.8, 0.01);
        m.append(render::picture(middle, f.along, {0, 0, 1}, wide, 1.6, upper));
        m.append(
            bar(f, (i + 0.5) * bay - 0.5 * wide - 0.1, (i + 0.5) * bay + 0.5 * wide + 0.1, z - 0.1, z, 0.028, ledge));
      }
    // The ground floor: a door in one bay; a shop or windows in the others.
    const int door_bay = dice.integer(0, bays - 1);
    const bool near = from_crossing < 26;
    const bool shop = dice.chance(near ? 0.55 : 0.3);
    const float leaf = static_cast<float>(dice.uniform(0.06, 0.25));
    const double door_s = (door_bay + 0.5) * bay;
    m.append(render::picture(
        at(f, door_s, 1.1, 0.01), f.along, {0, 0, 1}, 1.1, 2.2,
        picture_material(render::door(number, 128, 256, Colour(leaf, 0.8f * leaf, 0.6f * leaf), Colour(0.4f)), 1.1,
                         2.2)));
    for (int i = 0; i < bays; i++) {
      if (i == door_bay) continue;
      const double width = shop ? bay - 0.4 : wide, height = shop ? 1.9 : 1.5;
      m.append(render::picture(at(f, (i + 0.5) * bay, shop ? 1.55 : 1.9, 0.01), f.along, {0, 0, 1}, width, height,
                               window(width, height, 20)));
    }
    // Landmarks, where the crossing can be seen from: a shop's board, a house number, a sign that stands out.
    if (near) {
      if (shop) {
        const double width = std::min(f.length - 1, dice.uniform(2.4, 4.0)),
                     s = dice.uniform(0.5 * width + 0.3, f.length - 0.5 * width - 0.3);
        landmark(f, s, 2.86, width, 0.62, 0.028, shop_board(number, width / 0.62), "shop board");
      }
      if (dice.chance(0.8))
        landmark(f, door_s + (door_bay + 1 < bays ? 0.95 : -0.95), 2.1, 0.42, 0.42, 0.03,
                 house_number(number, dice.integer(1, 99)), "house number");
      if (!shop && dice.chance(0.6)) {
        const double s = (door_bay == 0 ? bays - 1 : 0.5) * bay - (door_bay == 0 ? 0.0 : 0.25 * bay);
        landmark(f, std::clamp(s, 0.8, f.length - 0.8), 1.75, 1.0, 1.3, 0.03, render::poster(number, 200, 260),
                 "poster");
      }
    }
    scene_.add(m);
  }

  static Vec3 at(const Facade &f, double s, double z, double out) {
    return f.corner + s * f.along + Vec3(0, 0, z) + out * f.normal;
  }
  static Mesh bar(const Facade &f, double s0, double s1, double z0, double z1, double out, uint32_t material) {
    const images::Pose T = [&] {
      images::Pose p = images::Pose::Identity();
      p.linear().col(0) = f.along;
      p.linear().col(1) = -f.normal;
      p.linear().col(2) = Vec3(0, 0, 1);
      p.translation() = at(f, 0.5 * (s0 + s1), 0.5 * (z0 + z1), 0.5 * out);
      return p;
    }();
    return render::box(T, {s1 - s0, out, z1 - z0}, material);
  }

  void landmark(const Facade &f, double s, double z, double width, double height, double out, const Picture &picture,
                const char *what) {
    const Vec3 middle = at(f, s, z, out);
    scene_.add(render::picture(middle, f.along, {0, 0, 1}, width, height, picture_material(picture, width, height)));
    if (width > 2)
      scene_.add(bar(f, s - 0.5 * width, s + 0.5 * width, z - 0.5 * height, z + 0.5 * height, out - 0.004,
                     plain(Colour(0.1f))));
    note(middle, f.along, f.normal, width, height, what);
  }
  void note(const Vec3 &middle, const Vec3 &right, const Vec3 &normal, double width, double height, const char *what) {
    const int32_t id = static_cast<int32_t>(world_.truth.size()) + 1;
    const Vec3 r = 0.5 * width * right, u(0, 0, 0.5 * height);
    world_.panels.push_back({id, {middle - r + u, middle + r + u, middle + r - u, middle - r - u}, normal});
    world_.truth.push_back({id, middle, NAN, what});
  }

  // Signs on posts at the crossing's corners.
  void signs(const Streets &s, Dice &dice) {
    const uint32_t post = plain(Colour(0.3f));
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0}) {
        const Vec3 foot(s.x + sx * (s.road_x + 0.8), s.y + sy * (s.road_y + 0.8 + dice.uniform(0, 0.6)), kKerb_m);
        scene_.add(render::cylinder(images::pose_xyz_rpy(foot, 0, 0, 0), 0.04, 2.75, 10, post));
        const Vec3 normal = (Vec3(s.x - 12, s.y, 0) - Vec3(foot.x(), foot.y(), 0)).normalized();
        const Vec3 right = Vec3(0, 0, 1).cross(normal), middle = foot + Vec3(0, 0, 2.35) + 0.05 * normal;
        const double size = 0.7;
        scene_.add(render::picture(
            middle, right, {0, 0, 1}, size, size,
            picture_material(street_sign(request_.seed * 31 + static_cast<uint64_t>(dice.integer(0, 1 << 20))), size,
                             size)));
        note(middle, right, normal, size, size, "street sign");
      }
  }

  void cars(const Streets &s) {
    Dice dice(request_.seed, Part::cars);
    signs(s, dice);
    const uint32_t tyre = plain(Colour(0.03f)), glass = plain(Colour(0.04f, 0.05f, 0.06f), 0.08);
    const auto park = [&](const Vec3 &place, double yaw) {
      const float tone = static_cast<float>(dice.uniform(0.05, 0.55));
      const uint32_t paint = plain(Colour(tone, tone * static_cast<float>(dice.uniform(0.6, 1.1)),
                                          tone * static_cast<float>(dice.uniform(0.6, 1.2))),
                                   0.05);
      const images::Pose T = images::pose_xyz_rpy(place, 0, 0, yaw);
      const double length = dice.uniform(3.8, 4.6), width = 1.75;
      // Side views, pushed across: the body with its cabin, and the windows a little wider than it.
      const auto across = [&](const std::vector<Vec2> &side, double half_width, uint32_t material) {
        Mesh m = render::extruded(side, -half_width, half_width, material, material);
        m.transform(T * images::pose_xyz_rpy({0, 0, 0}, kPi / 2, 0, 0));
        scene_.add(m);
      };
      const double n = -0.5 * length, k = 0.5 * length;
      across({{n, 0.3},
              {k, 0.28},
              {k + 0.02, 0.62},
              {k - 0.15, 0.8},
              {0.27 * length, 0.9},
              {0.1 * length, 1.38},
              {-0.28 * length, 1.42},
              {-0.44 * length, 0.98},
              {n, 0.9}},
             0.5 * width, paint);
      across({{0.235 * length, 0.93}, {0.095 * length, 1.31}, {-0.07 * length, 1.34}, {-0.07 * length, 0.93}},
             0.5 * width + 0.006, glass);
      across({{-0.09 * length, 0.93}, {-0.09 * length, 1.34}, {-0.26 * length, 1.34}, {-0.385 * length, 0.97}},
             0.5 * width + 0.006, glass);
      // Windscreen and rear window: thin plates over the slopes.
      across({{0.265 * length, 0.93}, {0.275 * length, 0.93}, {0.112 * length, 1.35}, {0.102 * length, 1.35}},
             0.5 * width - 0.12, glass);
      across({{-0.29 * length, 1.38}, {-0.3 * length, 1.38}, {-0.435 * length, 1.02}, {-0.425 * length, 1.02}},
             0.5 * width - 0.12, glass);
      for (const double x : {-0.31, 0.31})
        for (const double y : {-0.5, 0.5}) {
          const images::Pose wheel =
              T * images::pose_xyz_rpy({x * length, y * (width - 0.18) - 0.1, 0.32}, -kPi / 2, 0, 0);
          scene_.add(render::cylinder(wheel, 0.32, 0.2, 16, tyre));
        }
    };
    // At the kerbs, half on the pavement, beyond the zebras; the far side of the way that is driven.
    for (const double side : {-1.0, 1.0}) {
      for (double d = 8; d < s.end - 4; d += dice.uniform(5.4, 9)) {
        if (dice.chance(0.6))
          park({s.x + side * (s.road_x + d), s.y + s.road_y + 0.15, kKerb_m * 0.5}, side > 0 ? kPi : 0);
        if (dice.chance(0.6))
          park({s.x - s.road_x - 0.15, s.y + side * (s.road_y + d), kKerb_m * 0.5}, side > 0 ? kPi / 2 : -kPi / 2);
      }
    }
  }

  void people(const Streets &s) {
    Dice dice(request_.seed, Part::people);
    const int count = request_.hard ? 9 : 4;
    for (int i = 0; i < count; i++) {
      const bool along_x = dice.chance(0.5);
      const double side = dice.sign(), other = dice.sign(), d0 = dice.uniform(1, 8), d1 = dice.uniform(14, 34);
      const double between_x = 0.5 * (s.road_x + s.front_x) + dice.uniform(-0.3, 0.6);
      const double between_y = 0.5 * (s.road_y + s.front_y) + dice.uniform(-0.3, 0.6);
      Walk w;
      w.z_m = kKerb_m;
      w.speed_mps = dice.uniform(0.9, 1.5);
      w.phase_m = dice.uniform(0, 40);
      if (along_x) {
        w.from = {s.x + side * (s.road_x + d0), s.y + other * between_y};
        w.to = {s.x + side * (s.road_x + d1), w.from.y_m};
      } else {
        w.from = {s.x + other * between_x, s.y + side * (s.road_y + d0)};
        w.to = {w.from.x_m, s.y + side * (s.road_y + d1)};
      }
      add_person(request_.seed * 57 + static_cast<uint64_t>(i), w, scene_);
    }
  }

  void sky() {
    Dice dice(request_.seed, Part::lamps);
    const float bright = request_.hard ? 0.35f : 1.f;
    scene_.sky.zenith = Colour(0.42f, 0.55f, 0.8f) * bright;
    scene_.sky.horizon = Colour(0.85f, 0.88f, 0.92f) * bright;
    scene_.sky.ground = Colour(0.2f) * bright;
    const auto [sn, cs] = wm::sincos(dice.uniform(-kPi, kPi));
    scene_.sun.towards = {cs, sn, dice.uniform(0.7, 1.4)};
    scene_.sun.power = request_.hard ? Colour(0.f) : Colour(1.0f, 0.95f, 0.85f);
    scene_.ambient.up = Colour(0.5f, 0.53f, 0.6f) * (request_.hard ? 0.55f : 1.f);
    scene_.ambient.down = Colour(0.2f) * (request_.hard ? 0.55f : 1.f);
    scene_.ambient.contact_m = 0.8;
    scene_.ambient.contact_strength = 0.5;
    scene_.light_cell_m = 1.5;
  }

  const WorldRequest &request_;
  World &world_;
  render::Scene &scene_;
  int houses_ = 0;
  std::vector<uint32_t> walls_;  // bricks and plasters of the house fronts
};

WorldCamera fisheye(const char *name, double y, double yaw) {
  WorldCamera c;
  c.name = name;
  c.camera.model = images::Model::equidistant;
  c.camera.width = 960;
  c.camera.height = 600;
  c.camera.intrinsics = {318.2, 318.6, 481.3, 298.4};
  c.camera.distortion = {-0.011, 0.004, -0.002, 0.0003};
  c.camera.T_base_camera = images::pose_xyz_rpy({1.6, y, 1.4}, 0, -4 * kDeg, yaw);
  c.rate_hz = 10;
  c.exposure_s = 0.004;
  c.colour = true;
  return c;
}

}  // namespace

wm_status make_crossing(const WorldRequest &request, World &world, wm_error *) {
  world.about =
      "A car turns left at a crossing; two fisheyes see signs, house numbers and shops whose places are known.";
  world.vehicle = Vehicle::car;
  world.wheelbase_m = 1.8;
  world.footprint = {2.3, -0.4, 0.75};
  world.route = request.route ? *request.route : drawn_route(request.seed);
  Builder(request, world).build(streets_around(world.route, request.seed));
  world.landmarks_known = true;
  world.cameras = {fisheye("left", 0.4, 50 * kDeg), fisheye("right", -0.4, -50 * kDeg)};
  world.labels = {World::Labels::landmarks};
  world.label_reach_m = 40;
  return WM_OK;
}

}  // namespace wm::sim
