// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/polygon.hpp"

namespace wm {

namespace {

constexpr int kSpare = 3;              // vertices found beyond those wanted, before the flattest are removed. Not swept
constexpr int kSidePointsMin = 4;      // points of a side that a line can be fitted to
constexpr int kRoundedPart = 8;        // 1 / this of a side's points at each end is left out: corners are rounded
constexpr int kOutlierPart = 10;       // at most 1 / this of a side's points may lie off it
constexpr double kTurnMin_sin = 0.05;  // sine of the smallest turn at a vertex: convex
constexpr double kCornerOff = 4;       // farthest a fitted corner may be from its border point, in `off_px`
constexpr double kShortest = 1e-9;     // length of a chord, against division by 0

int farthest_from(const tangent_point *border, int count, const tangent_point &from) {
  int far = 0;
  double most = -1;
  for (int i = 0; i < count; i++) {
    const double off = dot(border[i] - from, border[i] - from);
    if (off > most) most = off, far = i;
  }
  return far;
}

// Index of the point between two vertices that is farthest from their chord, and its distance.
double farthest_off(const tangent_point *border, int count, int from, int to, int *at) {
  const tangent_point a = border[from], along = border[to] - a;
  const double size = larger(length(along), kShortest);
  double most = 0;
  *at = from;
  for (int i = (from + 1) % count; i != to; i = (i + 1) % count) {
    const double off = std::fabs(cross(along, border[i] - a)) / size;
    if (off > most) most = off, *at = i;
  }
  return most;
}

// The vertex that turns least, by its distance from the chord of its neighbours.
int flattest_of(const tangent_point *border, const int *vertex, int have) {
  int flattest = 0;
  double least = 1e300;
  for (int i = 0; i < have; i++) {
    const tangent_point a = border[vertex[(i + have - 1) % have]], b = border[vertex[(i + 1) % have]];
    const double off = std::fabs(cross(b - a, border[vertex[i]] - a)) / larger(length(b - a), kShortest);
    if (off < least) least = off, flattest = i;
  }
  return flattest;
}

// Indices of the border's points that are vertices. Two first, then where the border is farthest from the polygon so
// far [Douglas1973]. A side parallel to its chord yields a vertex in its middle, so `kSpare` too many
// are found, and the flattest are removed again.
bool find_vertices(const tangent_point *border, int count, int vertices, double off_px, int *vertex) {
  tangent_point middle = {0, 0};
  for (int i = 0; i < count; i++) middle = middle + (1.0 / count) * border[i];
  int have = 2;
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
  for (; have > vertices; have--)
    for (int i = flattest_of(border, vertex, have); i + 1 < have; i++) vertex[i] = vertex[i + 1];
  return true;
}

// Total least squares through the border's points from one vertex to the next, without the rounded corners. False where
// too many points lie off it.
bool fit_side(const tangent_point *border, int count, int from, int to, double off_px, tangent_line *out) {
  const int points = (to - from + count) % count, skip = points / kRoundedPart;
  if (points < kSidePointsMin) return false;
  const tangent_point first = border[from];
  tangent_point sum = {0, 0};
  double xx = 0, xy = 0, yy = 0;
  int used = 0;
  for (int k = skip; k <= points - skip; k++) {
    const tangent_point p = border[(from + k) % count] - first;
    sum = sum + p;
    xx += p.x * p.x, xy += p.x * p.y, yy += p.y * p.y;
    used++;
  }
  const tangent_point mean = (1.0 / used) * sum;
  xx -= used * mean.x * mean.x, xy -= used * mean.x * mean.y, yy -= used * mean.y * mean.y;
  const sin_cos s = sincos(0.5 * atan2(2.0 * xy, xx - yy));
  const tangent_point n = {-s.sin, s.cos};
  *out = {n, dot(n, first + mean)};
  int off = 0;
  for (int k = skip; k <= points - skip; k++)
    if (std::fabs(dot(n, border[(from + k) % count]) - out->d) > off_px) off++;
  return kOutlierPart * off <= used;
}

}  // namespace

double doubled_area(const tangent_point *points, int count) {
  double sum = 0;
  for (int i = 0; i < count; i++) sum += cross(points[i], points[(i + 1) % count]);
  return sum;
}

bool polygon_of(const tangent_point *border, int count, int vertices, double off_px, tangent_point *corner) {
  int vertex[kPolygonMax + kSpare];
  if (count < 4 * vertices || vertices > kPolygonMax || !find_vertices(border, count, vertices, off_px, vertex))
    return false;
  tangent_line side[kPolygonMax];
  for (int i = 0; i < vertices; i++)
    if (!fit_side(border, count, vertex[i], vertex[(i + 1) % vertices], off_px, &side[i])) return false;
  // The border goes counterclockwise; the corners are clockwise.
  for (int i = 0; i < vertices; i++)
    if (!meet(side[(i + vertices - 1) % vertices], side[i], &corner[vertices - 1 - i])) return false;
  for (int i = 0; i < vertices; i++) {
    const tangent_point a = corner[(i + 1) % vertices] - corner[i],
                        b = corner[(i + 2) % vertices] - corner[(i + 1) % vertices];
    if (!(cross(a, b) > kTurnMin_sin * length(a) * length(b))) return false;
    if (length(corner[i] - border[vertex[vertices - 1 - i]]) > kCornerOff * off_px) return false;
  }
  return true;
}

}  // namespace wm
