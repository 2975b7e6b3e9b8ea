// SPDX-License-Identifier: Apache-2.0
// Makes a building out of a plan: floors, walls with skirting boards, doors, lamps, posters, people.
#pragma once

#include <string>
#include <vector>

#include "render/scene.h"
#include "simulate/scenario.h"
#include "worlds/plan.h"

namespace wm::sim {

enum class Flooring { tiles, linoleum, planks, concrete, carpet };

struct BuildingStyle {
  uint64_t seed = 1;
  bool hard = false;
  std::vector<Flooring> floorings = {Flooring::linoleum};  // one more than borders
  std::vector<double> borders_m;                           // x where the flooring changes
  double skirting_m = 0.08;                                // 0: none
  bool posters = true;
  bool ceiling_panels = false;
  double wall_grey = 0.62;
};

struct CeilingLamp {
  Point p;
  double yaw_rad = 0;
  double length_m = 1.2, width_m = 0.3;
  double power = 1.6;
  bool on = true;
};

// Adds the plan's surfaces to the scene.
void dress(const Plan &plan, const BuildingStyle &style, render::Scene &scene);
// Adds lamps under the ceiling: the glass that one sees and the light that it gives.
void hang_lamps(const std::vector<CeilingLamp> &lamps, double ceiling_m, render::Scene &scene);
// Lamps on a grid of about `spacing_m` over a whole plan, where there is room.
std::vector<CeilingLamp> lamps_for(const Plan &plan, double spacing_m);
// Cartons beside the way that leave `gap_m` to the robot anywhere on it. They are in no map. Returns how many stand.
int add_clutter(uint64_t seed, int count, const Route &route, const Footprint &footprint, double gap_m, Plan &plan);

// A person who walks to and fro on a straight line, with legs that step and clothes of the seed's colours.
struct Walk {
  Point from, to;
  double speed_mps = 1.2, phase_m = 0, z_m = 0;
};
// Where the person is at t.
Point walker_at(const Walk &walk, double t_s);
void add_person(uint64_t seed, const Walk &walk, render::Scene &scene);
// Up to `count` walks in free space that never come nearer than `gap_m` to the robot's footprint while it drives from
// t = 0 on.
std::vector<Walk> draw_walks(uint64_t seed, int count, const Plan &plan, const Route &route, const Footprint &footprint,
                             double gap_m);

}  // namespace wm::sim
