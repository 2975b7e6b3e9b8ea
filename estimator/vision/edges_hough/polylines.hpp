// SPDX-License-Identifier: Apache-2.0
// Joins the windows' line pieces to polylines (M. P. Abramov et al. 2019): pieces are the vertices of a graph, its
// edges connect pieces that continue each other, and each connected part becomes one polyline.
#ifndef WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_POLYLINES_HPP
#define WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_POLYLINES_HPP

#include <cstddef>
#include <cstdint>

namespace wm {

// A line piece in the bird's-eye view, px.
struct line_piece {
  float x0, y0, x1, y1;
};

struct line_vertex {
  float x, y;
  int32_t line;  // index of its polyline, whose vertices are consecutive
};

// The paper's limits.
struct polyline_limits {
  double join_px = 10;                        // between the nearest ends of two pieces that continue each other
  double join_angle_rad = 2.792526803190927;  // between them, pi for one line: 160 degrees
  double straight_px = 3;                     // from the line through the two farthest ends, of an end that is on it
  double straight_share = 1.0 / 3;            // of the ends on that line, above which it replaces the part
};

// Work space for up to `capacity` pieces.
struct piece_graph {
  int32_t capacity;
  float *length;           // capacity^2: of the shortest path between two pieces; below 0: none
  uint16_t *hops, *next;   // capacity^2: its number of edges; the piece after the first
  int32_t *part, *member;  // capacity: each piece's connected part; the pieces of the current part
};

// Places the arrays in `memory` (64-byte aligned, or NULL to count). Returns their bytes.
size_t piece_graph_bytes(int32_t capacity);
size_t piece_graph_place(piece_graph *graph, int32_t capacity, void *memory);

// Polylines of `count` (at most the graph's capacity) pieces. Returns the number of vertices, at most twice the pieces.
// Two pieces are joined where their nearest ends are less than join_px apart and they make an angle of
// at least join_angle_rad there. A part of which more than straight_share of the ends lie within
// straight_px of the line through its two ends farthest from each other is that line; else it is the longest of
// the shortest paths between its pieces (R. W. Floyd 1962), of equals the one with the fewest, through the pieces'
// intersections. O(count^3) in the worst case, of a part that is not straight.
int make_polylines(const line_piece *pieces, int count, const polyline_limits &limits, piece_graph *graph,
                   line_vertex *out);

}  // namespace wm

#endif
