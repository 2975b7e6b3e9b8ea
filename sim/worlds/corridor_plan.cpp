// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "worlds/corridor.h"
#include "worlds/dice.h"

namespace wm::sim {
namespace {

constexpr double kCeiling_m = 2.6, kDoorTop_m = 2.05;

// One side of a corridor: what is taken already, so that doors and branches keep apart.
struct Strip {
  double wall;      // the other coordinate of the wall
  double from, to;  // along the corridor
  bool along_x;
  int outward;  // +1: the building lies towards larger coordinates
  std::vector<std::pair<double, double>> taken;

  bool take(double middle, double width, double margin) {
    const double a = middle - 0.5 * width - margin, b = middle + 0.5 * width + margin;
    if (a < from || b > to) return false;
    for (const auto &t : taken)
      if (a < t.second && b > t.first) return false;
    taken.emplace_back(a, b);
    return true;
  }
  // From the wall `depth` outwards (negative: into the corridor).
  Rectangle niche(double middle, double width, double depth) const {
    const double u0 = middle - 0.5 * width, u1 = middle + 0.5 * width;
    const double v0 = std::min(wall, wall + outward * depth), v1 = std::max(wall, wall + outward * depth);
    return along_x ? Rectangle{u0, v0, u1, v1} : Rectangle{v0, u0, v1, u1};
  }
  int side() const { return along_x ? (outward > 0 ? 1 : 3) : (outward > 0 ? 0 : 2); }
};

struct Drawing {
  std::vector<FreeRectangle> free;
  std::vector<Hallway> hallways;
  std::vector<Strip> strips;

  void hallway(Rectangle area, bool along_x) {
    free.push_back({area});
    hallways.push_back({area, along_x});
    strips.push_back({along_x ? area.y1_m : area.x1_m,
                      along_x ? area.x0_m : area.y0_m,
                      along_x ? area.x1_m : area.y1_m,
                      along_x,
                      1,
                      {}});
    strips.push_back({along_x ? area.y0_m : area.x0_m,
                      along_x ? area.x0_m : area.y0_m,
                      along_x ? area.x1_m : area.y1_m,
                      along_x,
                      -1,
                      {}});
  }
};

double overlap(double a0, double a1, double b0, double b1) { return std::min(a1, b1) - std::max(a0, b0); }

// Where another hallway or a room comes through a wall there is no place for doors.
void take_junctions(Drawing &d) {
  for (Strip &s : d.strips)
    for (const FreeRectangle &f : d.free) {
      const Rectangle &a = f.area;
      const double v0 = s.along_x ? a.y0_m : a.x0_m, v1 = s.along_x ? a.y1_m : a.x1_m;
      const double u0 = s.along_x ? a.x0_m : a.y0_m, u1 = s.along_x ? a.x1_m : a.y1_m;
      // What is within half a metre behind the wall takes its place.
      const double w0 = s.outward > 0 ? s.wall : s.wall - 0.5, w1 = w0 + 0.5;
      if (overlap(v0, v1, w0, w1) > 1e-6) s.taken.emplace_back(u0 - 0.25, u1 + 0.25);
    }
}

// Nothing else within `margin` of an area: room for a branch.
bool clear_of(const Drawing &d, const Rectangle &area, double margin, const Rectangle &limit) {
  if (area.x0_m < limit.x0_m || area.y0_m < limit.y0_m || area.x1_m > limit.x1_m || area.y1_m > limit.y1_m)
    return false;
  for (const FreeRectangle &f : d.free)
    if (overlap(area.x0_m - margin, area.x1_m + margin, f.area.x0_m, f.area.x1_m) > 1e-6 &&
        overlap(area.y0_m - margin, area.y1_m + margin, f.area.y0_m, f.area.y1_m) > 1e-6)
      return false;
  return true;
}

void mirror(Rectangle &r, double sum_x, double sum_y, bool x, bool y) {
  if (x) r = {sum_x - r.x1_m, r.y0_m, sum_x - r.x0_m, r.y1_m};
  if (y) r = {r.x0_m, sum_y - r.y1_m, r.x1_m, sum_y - r.y0_m};
}

}  // namespace

CorridorDrawing draw_corridor(uint64_t seed, bool hard) {
  Dice dice(seed, Part::building);
  const Rectangle limit{-3.2, -1.7, 57.5, 15.0};  // half a metre and more within the map

  // Two long corridors (low, high) and two cross ones; the second leads from the high one down to a room's side.
  const double low_w = dice.uniform(1.9, 2.6), high_w = dice.uniform(1.9, 2.6);
  const double cross1_w = dice.uniform(1.8, 2.4), cross2_w = dice.uniform(1.8, 2.4);
  const double low_y = dice.uniform(0.6, 1.8), high_y = dice.uniform(10.2, 11.8);
  const double low_x0 = dice.uniform(-2.8, -1.5), low_x1 = dice.uniform(25, 29);
  const double cross1_x = dice.uniform(15, 18.5), cross2_x = dice.uniform(34, 37.5);
  const double high_x0 = cross1_x - dice.uniform(5, 10), high_x1 = dice.uniform(54, 57);
  const double cross1_y0 = low_y - 0.5 * low_w - dice.uniform(0.0, 0.6), cross2_y0 = dice.uniform(-1.2, 0.4);
  Drawing d;
  d.hallway({low_x0, low_y - 0.5 * low_w, low_x1, low_y + 0.5 * low_w}, true);
  d.hallway({high_x0, high_y - 0.5 * high_w, high_x1, high_y + 0.5 * high_w}, true);
  d.hallway({cross1_x - 0.5 * cross1_w, cross1_y0, cross1_x + 0.5 * cross1_w, high_y}, false);
  d.hallway({cross2_x - 0.5 * cross2_w, cross2_y0, cross2_x + 0.5 * cross2_w, high_y}, false);
  // A room at the far end, open to the high corridor by a passage.
  const double room_x0 = cross2_x + 0.5 * cross2_w + dice.uniform(1.0, 2.5), room_x1 = dice.uniform(53.5, 57);
  const double room_y0 = dice.uniform(-1.4, -0.2), room_y1 = high_y - 0.5 * high_w - dice.uniform(1.8, 2.6);
  const double passage_x = dice.uniform(room_x0 + 2, room_x1 - 2), passage_w = dice.uniform(1.6, 3.0);
  d.free.push_back({{room_x0, room_y0, room_x1, room_y1}});
  d.hallway({passage_x - 0.5 * passage_w, room_y1 - 0.5, passage_x + 0.5 * passage_w, high_y}, false);
  take_junctions(d);

  // Branches that end after some metres.
  const int branches = dice.integer(6, 10);
  for (int tries = 0, made = 0; tries < 600 && made < branches; tries++) {
    Strip &s = d.strips[static_cast<size_t>(dice.integer(0, 3))];  // along the long corridors
    const double at = dice.uniform(s.from + 1.5, s.to - 1.5), width = dice.uniform(1.2, 2.2),
                 depth = dice.uniform(1.4, 3.5);
    const Rectangle area = s.niche(at, width, depth);
    Rectangle beyond = area;  // its mouth belongs to the corridor
    (s.outward > 0 ? beyond.y0_m : beyond.y1_m) += s.outward * 0.35;
    if (!clear_of(d, beyond, 0.3, limit) || !s.take(at, width, 0.4)) continue;
    d.free.push_back({area});
    d.hallways.push_back({area, false});
    made++;
  }
  // Doors in recesses on both sides, some of them double.
  Dice doors(seed, Part::doors);
  const int wanted = doors.integer(16, 26);
  for (int tries = 0, made = 0; tries < 400 && made < wanted; tries++) {
    Strip &s = d.strips[static_cast<size_t>(doors.integer(0, static_cast<int>(d.strips.size()) - 1))];
    const double at = doors.uniform(s.from, s.to), width = doors.chance(0.2) ? 1.6 : doors.uniform(0.86, 1.1);
    const double depth = doors.uniform(0.08, 0.18);
    if (!s.take(at, width, 0.25)) continue;
    d.free.push_back({s.niche(at, width, depth), Surface::door, kDoorTop_m, s.side()});
    made++;
  }
  // Pillars that stand out of the walls.
  Dice pillars(seed, Part::pillars);
  const int columns = pillars.integer(4, hard ? 12 : 8);
  for (int tries = 0, made = 0; tries < 200 && made < columns; tries++) {
    Strip &s = d.strips[static_cast<size_t>(pillars.integer(0, 3))];
    const double at = pillars.uniform(s.from, s.to), width = pillars.uniform(0.3, 0.5),
                 out = pillars.uniform(0.1, 0.18);
    // In front of a mouth of a cross corridor the robot turns: none there.
    bool turning = false;
    for (const double x : {cross1_x, cross2_x, passage_x}) turning = turning || std::fabs(at - x) < 3.2;
    if (turning || !s.take(at, width, 0.3)) continue;
    FreeRectangle pillar{s.niche(at, width, -out)};
    pillar.solid = true;
    d.free.push_back(pillar);
    made++;
  }
  for (int i = 0, n = pillars.integer(2, 4); i < n; i++) {
    const double size = pillars.uniform(0.35, 0.6), x = room_x0 + (room_x1 - room_x0) * (i + 1) / (n + 1);
    const double y = 0.5 * (room_y0 + room_y1) + pillars.uniform(-0.5, 0.5);
    FreeRectangle pillar{{x - 0.5 * size, y - 0.5 * size, x + 0.5 * size, y + 0.5 * size}};
    pillar.solid = true;
    d.free.push_back(pillar);
  }

  // The way: along the low corridor, up, along the high one, down the second cross one; backwards out of it and along
  // the high corridor's end; forwards all the way back, and the last stretch backwards along the low corridor.
  Dice turns(seed, Part::route);
  const double dead_end_y = std::max(cross2_y0 + 1.9, turns.uniform(1.5, 3.0));
  const double far_x = std::min(high_x1 - 1.3, cross2_x + turns.uniform(11, 15));
  const double tail_x = low_x1 - turns.uniform(1.9, 2.4), last_x = turns.uniform(2, 5);
  CorridorDrawing out;
  out.start = {low_x0 + turns.uniform(1.2, 2.0), low_y};
  out.way = {
      {{cross1_x, low_y}},
      {{cross1_x, high_y}},
      {{cross2_x, high_y}},
      {{cross2_x, dead_end_y}, false, 1, 2},
      {{cross2_x, high_y}, true, 0.7},
      {{far_x, high_y}, true, 0.7, 1},
      {{cross1_x, high_y}},
      {{cross1_x, low_y}},
      {{tail_x, low_y}, false, 1, 2},
      {{last_x, low_y}, true, 0.8, 2},
  };

  const bool mirror_x = dice.chance(0.5), mirror_y = dice.chance(0.5);
  const double sum_x = 2 * kCorridorOrigin.x_m + kCorridorWidth_px * kCorridorResolution_m;
  const double sum_y = 2 * kCorridorOrigin.y_m + kCorridorHeight_px * kCorridorResolution_m;
  for (FreeRectangle &f : d.free) {
    mirror(f.area, sum_x, sum_y, mirror_x, mirror_y);
    if (mirror_x && f.back_side >= 0 && f.back_side % 2 == 0) f.back_side = 2 - f.back_side;
    if (mirror_y && f.back_side >= 0 && f.back_side % 2 == 1) f.back_side = 4 - f.back_side;
  }
  for (Hallway &h : d.hallways) mirror(h.area, sum_x, sum_y, mirror_x, mirror_y);
  const auto turned = [&](Point &p) {
    if (mirror_x) p.x_m = sum_x - p.x_m;
    if (mirror_y) p.y_m = sum_y - p.y_m;
  };
  turned(out.start);
  for (Waypoint &w : out.way) turned(w.p);
  out.hallways = d.hallways;
  out.plan = plan_of_rectangles(d.free, kCeiling_m);
  return out;
}

}  // namespace wm::sim
