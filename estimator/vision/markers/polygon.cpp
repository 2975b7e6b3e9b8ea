// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/polygon.hpp"

namespace wm {

namespace {

constexpr int kSpare = 3;

int farthest_from(const flat *border, int count, const flat &from) {
  int far = 0;
  double most = -1;
  for (int i = 0; i < count; i++) {
    const double off = dot(border[i] - from, border[i] - from);
    if (off > most) most = off, far = i;
  }
  return far;
}

// Of the points between two vertices, the one farthest from the line that joins them.
double farthest_off(const flat *border, int count, int from, int to, int *at) {
  const flat a = border[from], along = border[to] - a;
  const double size = larger(length(along), 1e-9);
  double most = 0;
  *at = from;
  for (int i = (from + 1) % count; i != to; i = (i + 1) % count) {
    const double off = std::fabs(cross(along, border[i] - a)) / size;
    if (off > most) most = off, *at = i;
  }
  return most;
}

}  // namespace

double doubled_area(const flat *points, int count) {
  double sum = 0;
  for (int i = 0; i < count; i++) sum += cross(points[i], points[(i + 1) % count]);
  return sum;
}

bool polygon_of(const flat *border, int count, int vertices, double off_px, flat *corner) {
  if (count < 4 * vertices || vertices > kPolygonMax) return false;
  // Two vertices for sure, then where the border is farthest from the polygon so far (D. Douglas, T. Peucker 1973). A
  // side that is parallel to what it is compared with gives a vertex in its middle, so a few too many are found, and
  // those that turn least are taken away again.
  flat middle = {0, 0};
  for (int i = 0; i < count; i++) middle = middle + (1.0 / count) * border[i];
  int vertex[kPolygonMax + kSpare], have = 2;
  vertex[0] = farthest_from(border, count, middle);
  vertex[1] = farthest_from(border, count, border[vertex[0]]);
  if (vertex[0] == vertex[1]) return false;
  while (have < vertices + kSpare) {
    int place = 0, at = 0;
    double most = -1;
    for (int i = 0; i < have; i++) {
      int candidate;
      const double off = farthest_off(border, count, vertex[i], vertex[(i + 1) % have], &candidate);
      if (off > most) most = off, place = i, at = candidate;
    }
    if (!(most > off_px)) break;
    for (int i = have; i > place + 1; i--) vertex[i] = vertex[i - 1];
    vertex[place + 1] = at;
    have++;
  }
  if (have < vertices) return false;
  while (have > vertices) {
    int flattest = 0;
    double least = 1e300;
    for (int i = 0; i < have; i++) {
      const flat a = border[vertex[(i + have - 1) % have]], b = border[vertex[(i + 1) % have]];
      const double off = std::fabs(cross(b - a, border[vertex[i]] - a)) / larger(length(b - a), 1e-9);
      if (off < least) least = off, flattest = i;
    }
    have--;
    for (int i = flattest; i < have; i++) vertex[i] = vertex[i + 1];
  }
  line side[kPolygonMax];
  for (int i = 0; i < vertices; i++) {
    const int from = vertex[i], to = vertex[(i + 1) % vertices], points = (to - from + count) % count;
    if (points < 4) return false;
    // Without the ends, where the corner is rounded.
    const int skip = points / 8;
    flat first = border[from], sum = {0, 0};
    double xx = 0, xy = 0, yy = 0;
    int used = 0;
    for (int k = skip; k <= points - skip; k++) {
      const flat p = border[(from + k) % count] - first;
      sum = sum + p;
      xx += p.x * p.x, xy += p.x * p.y, yy += p.y * p.y;
      used++;
    }
    const flat mean = (1.0 / used) * sum;
    xx -= used * mean.x * mean.x, xy -= used * mean.x * mean.y, yy -= used * mean.y * mean.y;
    const sin_cos s = sincos(0.5 * atan2(2.0 * xy, xx - yy));
    const flat n = {-s.sin, s.cos};
    side[i] = {n, dot(n, first + mean)};
    int off = 0;
    for (int k = skip; k <= points - skip; k++)
      if (std::fabs(dot(n, border[(from + k) % count]) - side[i].d) > off_px) off++;
    if (10 * off > used) return false;
  }
  // The border goes against the clock, the corners with it.
  for (int i = 0; i < vertices; i++)
    if (!meet(side[(i + vertices - 1) % vertices], side[i], &corner[vertices - 1 - i])) return false;
  for (int i = 0; i < vertices; i++) {
    const flat a = corner[(i + 1) % vertices] - corner[i], b = corner[(i + 2) % vertices] - corner[(i + 1) % vertices];
    if (!(cross(a, b) > 0.05 * length(a) * length(b))) return false;
    if (length(corner[i] - border[vertex[vertices - 1 - i]]) > 4 * off_px) return false;
  }
  return true;
}

}  // namespace wm
