// SPDX-License-Identifier: Apache-2.0
// The map that stereo_ekf makes of points that left the state: key frames, each with points that lie fixed in it.
//
// A key frame is a triangle of three points of the state before the pair of cameras, cloned from the pose without noise
// of their own, so that later corrections move it with all correlations (delayed states, [Eustice2006]). Its points lie
// in the triangle's axes with the error of their own measurement. Memory is fixed: a ring of key frames.
#ifndef WAYMARK_ESTIMATOR_STEREO_EKF_OWN_MAP_HPP
#define WAYMARK_ESTIMATOR_STEREO_EKF_OWN_MAP_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/internal/math/rotation.hpp"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/time.h"

namespace wm {

inline constexpr int kAppearanceWords = 4, kAppearanceBits = 64 * kAppearanceWords;

inline bool has_appearance(const uint64_t a[kAppearanceWords]) { return (a[0] | a[1] | a[2] | a[3]) != 0; }
int bits_that_differ(const uint64_t a[kAppearanceWords], const uint64_t b[kAppearanceWords]);

// The triangle of a key frame in map axes.
struct frame_triangle {
  vec3 corner[3];
};

// Coordinates in a triangle: in both sides from its first corner, and in their cross product (1/m).
vec3 in_triangle(const frame_triangle &at, const vec3 &place);
vec3 out_of_triangle(const frame_triangle &at, const vec3 &coordinates);
// Derivatives of that place by the three corners; their sum is the unit matrix.
void corner_derivatives(const frame_triangle &at, const vec3 &coordinates, mat3 out[3]);

struct own_point {
  uint64_t appearance[kAppearanceWords];
  vec3 at;          // in its frame's triangle
  double noise[6];  // of its place against the triangle: xx, xy, xz, yy, yz, zz, m2 in map axes
};

struct own_frame {
  int64_t points;  // 0 to kPointsOfFrame; of 64 bits, as all here: no padding, so that states compare by bytes
  int64_t is_used;
  wm_time_ns used_ns;  // made, or its points found again
  vec3 centre;         // of its points' places, and within this distance of it they lie: as last placed
  double radius_m;
};

// The point of the map that looks most like one that is seen.
struct alike_point {
  int32_t best = kAppearanceBits, second = kAppearanceBits;  // bits in which it and the next best differ
  int64_t number = -1;
  // Not another one looks nearly as much like it.
  bool is_clear() const;
};

class own_map {
 public:
  // Of a key frame. A picture of our detector has up to 110 points, of which a third is found again.
  static constexpr int kPointsOfFrame = 64;
  static constexpr int kCorners = 3;  // states of a frame: points

  static void place(memory_layout *layout, int frames, own_frame **frame, own_point **point, vec3 **places);
  void init(int frames, own_frame *frame, own_point *point, vec3 *places);

  int capacity() const { return static_cast<int>(capacity_); }
  int frames() const { return static_cast<int>(frames_); }  // in use
  bool is_used(int frame) const { return frame_[static_cast<size_t>(frame)].is_used != 0; }
  int points_of(int frame) const { return static_cast<int>(frame_[static_cast<size_t>(frame)].points); }
  const own_point &point(int frame, int i) const { return point_[at(frame, i)]; }
  own_frame &frame(int i) { return frame_[static_cast<size_t>(i)]; }
  // A free frame, or the one that was not used for longest.
  int oldest() const;
  void begin(int frame, wm_time_ns t_ns);
  void remove(int frame);
  // False: the frame has no room.
  bool add(int frame, const own_point &point);

  // Computes all places in map axes, for a search; `triangle_of(frame)` gives the triangles.
  template <class Triangles>
  void place_points(Triangles triangle_of) {
    for (int f = 0; f < capacity(); f++) {
      if (!is_used(f)) continue;
      const frame_triangle triangle = triangle_of(f);
      for (int i = 0; i < points_of(f); i++) places_[at(f, i)] = out_of_triangle(triangle, point(f, i).at);
      enclose(f);
    }
  }
  const vec3 &place_of(int frame, int i) const { return places_[at(frame, i)]; }

  // The point that looks most like `appearance` among those within `reach_m[frame]` of `near`: its number, or -1 where
  // none is alike or two are.
  int find(const uint64_t appearance[kAppearanceWords], const vec3 &near, const double *reach_m) const;
  // Compares with all points of a frame, wherever they are.
  void compare(int frame, const uint64_t appearance[kAppearanceWords], alike_point *out) const;
  static int frame_of(int number) { return number / kPointsOfFrame; }
  static int index_of(int number) { return number % kPointsOfFrame; }

 private:
  void enclose(int frame);
  static size_t at(int frame, int i) { return static_cast<size_t>(frame) * kPointsOfFrame + static_cast<size_t>(i); }
  relative_array<own_frame> frame_;
  relative_array<own_point> point_;
  relative_array<vec3> places_;
  int64_t capacity_, frames_;
};

// Logarithm of the expected number of motions on which so many of `count` matches agree by chance, each with
// probability `share`: the number of triples, times Chernoff's bound of the binomial tail of the others.
double log_by_chance(int agreeing, int count, double share);

}  // namespace wm

#endif
