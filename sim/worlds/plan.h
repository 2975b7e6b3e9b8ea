// SPDX-License-Identifier: Apache-2.0
// A floor plan: upright faces with a height, of walls, doors, pillars, shelves, clutter. Each face has the free space
// on its left (from a to b), so the plan also says where one may drive. Plans come from rectangles of free space, from
// polylines in YAML, or from the image of a ROS map.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/status.h"

namespace wm::sim {

struct Point {
  double x_m = 0, y_m = 0;
};

enum class Surface : uint8_t { wall, door, jamb, lintel, window, pillar, shelf, desk, carton };

struct Face {
  Point a, b;                      // free space to the left
  double bottom_m = 0, top_m = 0;  // heights
  Surface surface = Surface::wall;
  bool mapped = true;  // in the map, and labelled where it meets the floor
};

// A level face that closes a body: the top of a shelf, the underside of a lintel.
struct Lid {
  std::vector<Point> outline;  // counter-clockwise
  double z_m = 0;
  bool up = true;  // which way it faces
  Surface surface = Surface::wall;
};

struct Rectangle {
  double x0_m, y0_m, x1_m, y1_m;  // x0 < x1, y0 < y1
  bool holds(Point p, double margin_m = 0) const {
    return p.x_m > x0_m + margin_m && p.x_m < x1_m - margin_m && p.y_m > y0_m + margin_m && p.y_m < y1_m - margin_m;
  }
};

struct PlanHit {
  bool hit = false;
  double distance_m = 0;
  size_t face = 0;
};

class Plan {
 public:
  double ceiling_m = 2.6;
  bool outside_is_solid = true;  // a building drawn from within; false: bodies that stand in the open
  std::vector<Face> faces;       // a closed outline's faces follow one another
  std::vector<Lid> lids;

  // Whether the floor is free at p. `with_clutter`: what the map does not know counts, too. O(faces).
  bool free(Point p, bool with_clutter = true) const;
  // Distance to the nearest face that stands on the floor, 0 where p is not free. O(faces).
  double clearance_m(Point p, bool with_clutter = true) const;
  // The first face that stands on the floor on the way from `from` to `to`. O(faces).
  PlanHit ray(Point from, Point to) const;
  // Smallest rectangle around all faces.
  Rectangle bounds() const;
  // Adds an upright body (its corners counter-clockwise), with a lid where it ends below the ceiling or above the
  // floor.
  void add_body(const std::vector<Point> &corners, double bottom_m, double top_m, Surface surface, bool mapped);
};

// A rectangle turned by `yaw_rad` about its centre, counter-clockwise.
std::vector<Point> turned_box(Point centre, double length_m, double width_m, double yaw_rad);
double distance_m(Point p, const Face &face);

// The robot's outline on the floor, in base_link.
struct Footprint {
  double front_m = 0.3, back_m = -0.3, half_width_m = 0.3;
};
// Least distance of the footprint's rim at a pose to anything that stands on the floor, 0 where it touches.
double clearance_m(const Plan &plan, const Footprint &footprint, double x_m, double y_m, double heading_rad);

// The free floor in pieces that don't overlap, each convex and counter-clockwise; cut at each x of `borders_m`, too.
// What the map doesn't know stands on it. O(faces^2).
std::vector<std::vector<Point>> floor_pieces(const Plan &plan, const std::vector<double> &borders_m);

// Free space as a union of rectangles; `door` ones are recesses whose back is a door of `top_m`. Later ones win where
// they overlap. Faces are the outline of the union, exact and closed.
struct FreeRectangle {
  Rectangle area;
  Surface back = Surface::wall;  // door: a recess with jambs, a lintel above it and a door at its back
  double top_m = 0;              // height of a recess; 0: up to the ceiling
  int back_side = -1;            // recess: 0 right (+x), 1 top (+y), 2 left, 3 bottom; which side is its back
  bool solid = false;            // takes away what earlier ones gave: a pillar at a wall
};
Plan plan_of_rectangles(const std::vector<FreeRectangle> &free, double ceiling_m);

// A polyline plan:
//   format: waymark-plan/1
//   ceiling_m: 2.6
//   outside: solid | free       # solid: `rooms` are cut out of it; free: walls stand in the open
//   rooms: [[[x, y], [x, y], ...], ...]                    # closed outlines of free space
//   walls: [{points_m: [[x, y], ...], thickness_m: 0.2, height_m: 2.6, closed: false,
//            openings: [{at_m: 3.2, width_m: 0.9, kind: opening | door | window, height_m: 2.1, sill_m: 0.9}]}]
//   pillars: [{xy_m: [x, y], size_m: [0.4, 0.4], yaw_deg: 0}]
//   shelves: [same with height_m]      clutter: [same with height_m; the map does not know it]
// Any mistake stops with file, line, key and what is allowed.
wm_status load_plan(const std::string &path, Plan &out, wm_error *err);
wm_status parse_plan(const std::string &text, const std::string &path, Plan &out, wm_error *err);

// Either of a polyline plan and a ROS map's YAML, whose walls are `ceiling_m` high (a plan says so itself). Relative
// files are beside the YAML. WM_BAD_CONFIG for a map without walls or with more than 20000.
// A picture (PNG, PGM) needs `resolution_m`, metres of a pixel; a plan and a ROS map have their own (0).
wm_status load_building(const std::string &path, double ceiling_m, double resolution_m, Plan &out, wm_error *err);

// Outlines of what is occupied in a ROS map's image (8-bit grey, row 0 at the top); unknown counts as free where it
// touches nothing. Staircases of slanted walls become straight within 0.7 pixels.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;
};
Plan plan_of_image(const GreyImage &image, double resolution_m, Point origin, int occupied_below, double ceiling_m);

}  // namespace wm::sim
