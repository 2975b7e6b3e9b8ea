// SPDX-License-Identifier: Apache-2.0
#include "vision/edges_hough/polylines.hpp"

#include "math/elementary.hpp"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

namespace {

struct point {
  double x, y;
};

point end_of(const line_piece &p, int which) {
  return which == 0 ? point{static_cast<double>(p.x0), static_cast<double>(p.y0)}
                    : point{static_cast<double>(p.x1), static_cast<double>(p.y1)};
}

double square_between(const point &a, const point &b) { return square(a.x - b.x) + square(a.y - b.y); }

// The nearest or the farthest ends of two pieces.
struct end_pair {
  int a, b;
  double square_px;
};

end_pair pair_of_ends(const line_piece &p, const line_piece &q, bool nearest) {
  end_pair best = {0, 0, square_between(end_of(p, 0), end_of(q, 0))};
  for (int k = 1; k < 4; k++) {
    const double d = square_between(end_of(p, k / 2), end_of(q, k % 2));
    if (nearest ? d < best.square_px : d > best.square_px) best = {k / 2, k % 2, d};
  }
  return best;
}

bool continue_each_other(const line_piece &p, const line_piece &q, const polyline_limits &limits, double angle_cos) {
  const end_pair near = pair_of_ends(p, q, true);
  if (!(near.square_px < square(limits.join_px))) return false;
  const point a = end_of(p, near.a), b = end_of(q, near.b), far_a = end_of(p, 1 - near.a),
              far_b = end_of(q, 1 - near.b);
  const double ax = far_a.x - a.x, ay = far_a.y - a.y, bx = far_b.x - b.x, by = far_b.y - b.y;
  const double lengths = std::sqrt((ax * ax + ay * ay) * (bx * bx + by * by));
  return lengths > 0 && ax * bx + ay * by <= angle_cos * lengths;
}

// Joint of two consecutive pieces: the intersection of their lines if it is near their ends, else the middle of the
// ends.
point joint_of(const line_piece &p, const line_piece &q, double join_px) {
  const end_pair near = pair_of_ends(p, q, true);
  const point a = end_of(p, near.a), b = end_of(q, near.b), far_a = end_of(p, 1 - near.a),
              far_b = end_of(q, 1 - near.b);
  const double ax = a.x - far_a.x, ay = a.y - far_a.y, bx = b.x - far_b.x, by = b.y - far_b.y;
  const double cross = ax * by - ay * bx;
  if (cross != 0) {
    const double along = ((b.x - a.x) * by - (b.y - a.y) * bx) / cross;
    const point at = {a.x + along * ax, a.y + along * ay};
    if (square_between(at, a) < square(join_px) && square_between(at, b) < square(join_px)) return at;
  }
  return {(a.x + b.x) / 2, (a.y + b.y) / 2};
}

struct builder {
  const line_piece *pieces;
  int count;
  const polyline_limits &limits;
  piece_graph &graph;
  line_vertex *out;
  int vertices, lines;

  size_t at(int a, int b) const { return static_cast<size_t>(a) * static_cast<size_t>(count) + static_cast<size_t>(b); }
  void add(const point &p) { out[vertices++] = {static_cast<float>(p.x), static_cast<float>(p.y), lines}; }

  void connect() {
    const double angle_cos = cos(limits.join_angle_rad);
    for (int a = 0; a < count; a++) {
      graph.length[at(a, a)] = 0;
      graph.hops[at(a, a)] = 0;
      for (int b = a + 1; b < count; b++) {
        float length = -1;
        if (continue_each_other(pieces[a], pieces[b], limits, angle_cos))
          length = static_cast<float>(std::sqrt(pair_of_ends(pieces[a], pieces[b], false).square_px));
        graph.length[at(a, b)] = graph.length[at(b, a)] = length;
        graph.hops[at(a, b)] = graph.hops[at(b, a)] = 1;
        graph.next[at(a, b)] = static_cast<uint16_t>(b);
        graph.next[at(b, a)] = static_cast<uint16_t>(a);
      }
    }
  }

  // Collects the pieces connected with `first` in graph.member and labels their part with its index.
  int gather(int first) {
    int size = 0;
    graph.member[size++] = first;
    graph.part[first] = first;
    for (int next = 0; next < size; next++)
      for (int b = 0; b < count; b++) {
        if (graph.part[b] >= 0 || graph.length[at(graph.member[next], b)] < 0) continue;
        graph.part[b] = first;
        graph.member[size++] = b;
      }
    return size;
  }

  // Adds the whole part as one line from end to end, if it is straight enough.
  bool add_straight(int size) {
    point u = end_of(pieces[graph.member[0]], 0), v = end_of(pieces[graph.member[0]], 1);
    for (int i = 0; i < size; i++)
      for (int k = i + 1; k < size; k++) {
        const line_piece &p = pieces[graph.member[i]], &q = pieces[graph.member[k]];
        const end_pair far = pair_of_ends(p, q, false);
        if (far.square_px <= square_between(u, v)) continue;
        u = end_of(p, far.a);
        v = end_of(q, far.b);
      }
    const double dx = v.x - u.x, dy = v.y - u.y, length = std::sqrt(dx * dx + dy * dy);
    int near = 0;
    for (int i = 0; i < size; i++)
      for (int end = 0; end < 2; end++) {
        const point p = end_of(pieces[graph.member[i]], end);
        near += std::fabs(dx * (p.y - u.y) - dy * (p.x - u.x)) <= limits.straight_px * length;
      }
    if (size > 1 && !(near > limits.straight_share * 2 * size)) return false;
    add(u);
    add(v);
    return true;
  }

  // Shortest paths between all pieces of the part (R. W. Floyd 1962); ties by the number of edges.
  void find_shortest_paths(int size) {
    for (int m = 0; m < size; m++) {
      const int k = graph.member[m];
      for (int i = 0; i < size; i++) {
        const int a = graph.member[i];
        const size_t a_k = at(a, k);
        if (graph.length[a_k] < 0 || a == k) continue;
        for (int j = 0; j < size; j++) {
          const int b = graph.member[j];
          const size_t a_b = at(a, b), k_b = at(k, b);
          if (graph.length[k_b] < 0) continue;
          const float length = graph.length[a_k] + graph.length[k_b];
          const auto hops = static_cast<uint16_t>(graph.hops[a_k] + graph.hops[k_b]);
          const float known = graph.length[a_b];
          if (known >= 0 && (known < length || (!(length < known) && graph.hops[a_b] <= hops))) continue;
          graph.length[a_b] = length;
          graph.hops[a_b] = hops;
          graph.next[a_b] = graph.next[a_k];
        }
      }
    }
  }

  void add_longest_path(int size) {
    find_shortest_paths(size);
    int from = graph.member[0], to = from;
    for (int i = 0; i < size; i++)
      for (int j = i + 1; j < size; j++) {
        const size_t here = at(graph.member[i], graph.member[j]), best = at(from, to);
        if (graph.length[here] < graph.length[best] ||
            (!(graph.length[best] < graph.length[here]) && graph.hops[here] >= graph.hops[best]))
          continue;
        from = graph.member[i];
        to = graph.member[j];
      }
    const int second = graph.next[at(from, to)];
    add(end_of(pieces[from], 1 - pair_of_ends(pieces[from], pieces[second], true).a));
    int a = from;
    for (int b = second;; a = b, b = graph.next[at(b, to)]) {
      add(joint_of(pieces[a], pieces[b], limits.join_px));
      if (b != to) continue;
      add(end_of(pieces[b], 1 - pair_of_ends(pieces[a], pieces[b], true).b));
      return;
    }
  }
};

}  // namespace

size_t piece_graph_place(piece_graph *graph, int32_t capacity, void *memory) {
  const auto n = static_cast<size_t>(capacity);
  memory_layout layout(memory, 0);
  graph->capacity = capacity;
  graph->length = layout.take<float>(n * n);
  graph->hops = layout.take<uint16_t>(n * n);
  graph->next = layout.take<uint16_t>(n * n);
  graph->part = layout.take<int32_t>(n);
  graph->member = layout.take<int32_t>(n);
  return layout.bytes();
}

size_t piece_graph_bytes(int32_t capacity) {
  piece_graph counted;
  return piece_graph_place(&counted, capacity, nullptr);
}

int make_polylines(const line_piece *pieces, int count, const polyline_limits &limits, piece_graph *graph,
                   line_vertex *out) {
  builder b = {pieces, count, limits, *graph, out, 0, 0};
  b.connect();
  for (int i = 0; i < count; i++) graph->part[i] = -1;
  for (int i = 0; i < count; i++) {
    if (graph->part[i] >= 0) continue;
    const int size = b.gather(i);
    if (!b.add_straight(size)) b.add_longest_path(size);
    b.lines++;
  }
  return b.vertices;
}

}  // namespace wm
