// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/own_map.hpp"

#include <cmath>

#include "math/elementary.hpp"

namespace wm {
namespace {

// Bits of 256 in which two looks at one point may differ: a quarter. Of unrelated random bits so few differ with a
// probability of 1e-16; but patches of one sea floor are alike, so that places decide, too.
constexpr int kAlikeMost_bits = 64;
// The next best point must differ in more bits by this factor: of points that look alike none is taken [Lowe2004].
constexpr double kRatio = 0.7;
constexpr double kRounding_m = 1e-9;

int ones(uint64_t x) {
  x -= x >> 1 & UINT64_C(0x5555555555555555);
  x = (x & UINT64_C(0x3333333333333333)) + (x >> 2 & UINT64_C(0x3333333333333333));
  x = (x + (x >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f);
  return static_cast<int>(x * UINT64_C(0x0101010101010101) >> 56);
}

void note(int differ, int64_t number, alike_point *out) {
  if (differ < out->best) {
    *out = {differ, out->best, number};
  } else if (differ < out->second) {
    out->second = differ;
  }
}

}  // namespace

bool alike_point::is_clear() const { return number >= 0 && best <= kAlikeMost_bits && best < kRatio * second; }

int bits_that_differ(const uint64_t a[kAppearanceWords], const uint64_t b[kAppearanceWords]) {
  int sum = 0;
  for (int i = 0; i < kAppearanceWords; i++) sum += ones(a[i] ^ b[i]);
  return sum;
}

vec3 in_triangle(const frame_triangle &at, const vec3 &place) {
  const vec3 one = at.corner[1] - at.corner[0], two = at.corner[2] - at.corner[0], normal = cross(one, two);
  const double scale = 1.0 / dot(normal, normal);
  const vec3 off = place - at.corner[0];
  const double above = scale * dot(off, normal);
  const vec3 level = off - above * normal;
  return {scale * dot(cross(level, two), normal), scale * dot(cross(one, level), normal), above};
}

vec3 out_of_triangle(const frame_triangle &at, const vec3 &coordinates) {
  const vec3 one = at.corner[1] - at.corner[0], two = at.corner[2] - at.corner[0];
  return at.corner[0] + coordinates.x * one + coordinates.y * two + coordinates.z * cross(one, two);
}

void corner_derivatives(const frame_triangle &at, const vec3 &coordinates, mat3 out[3]) {
  const vec3 one = at.corner[1] - at.corner[0], two = at.corner[2] - at.corner[0];
  out[1] = coordinates.x * kIdentity3 + -coordinates.z * skew(two);
  out[2] = coordinates.y * kIdentity3 + coordinates.z * skew(one);
  out[0] = kIdentity3 + -1.0 * (out[1] + out[2]);
}

void own_map::place(memory_layout *layout, int frames, own_frame **frame, own_point **point, vec3 **places) {
  const size_t points = at(frames, 0);
  *frame = layout->take<own_frame>(static_cast<size_t>(frames));
  *point = layout->take<own_point>(points);
  *places = layout->take<vec3>(points);
}

void own_map::init(int frames, own_frame *frame, own_point *point, vec3 *places) {
  capacity_ = frames;
  frames_ = 0;
  frame_.set(frame);
  point_.set(point);
  places_.set(places);
}

int own_map::oldest() const {
  int oldest = 0;
  for (int f = 0; f < capacity(); f++) {
    if (!is_used(f)) return f;
    if (frame_[static_cast<size_t>(f)].used_ns < frame_[static_cast<size_t>(oldest)].used_ns) oldest = f;
  }
  return oldest;
}

void own_map::begin(int frame, wm_time_ns t_ns) {
  frames_ += !is_used(frame);
  frame_[static_cast<size_t>(frame)] = {0, 1, t_ns, {0, 0, 0}, 0.0};
}

void own_map::remove(int frame) {
  frames_ -= is_used(frame);
  frame_[static_cast<size_t>(frame)] = {0, 0, 0, {0, 0, 0}, 0.0};
}

bool own_map::add(int frame, const own_point &point) {
  own_frame &of = frame_[static_cast<size_t>(frame)];
  if (of.points >= kPointsOfFrame) return false;
  point_[at(frame, static_cast<int>(of.points++))] = point;
  return true;
}

void own_map::enclose(int frame) {
  own_frame &of = frame_[static_cast<size_t>(frame)];
  vec3 sum = {0, 0, 0};
  double most_m2 = 0.0;
  for (int i = 0; i < points_of(frame); i++) sum = sum + place_of(frame, i);
  of.centre = of.points > 0 ? 1.0 / static_cast<double>(of.points) * sum : sum;
  for (int i = 0; i < points_of(frame); i++) {
    const vec3 off = place_of(frame, i) - of.centre;
    if (dot(off, off) > most_m2) most_m2 = dot(off, off);
  }
  of.radius_m = std::sqrt(most_m2);
}

int own_map::find(const uint64_t appearance[kAppearanceWords], const vec3 &near, const double *reach_m) const {
  alike_point out;
  for (int f = 0; f < capacity(); f++) {
    if (!is_used(f)) continue;
    const double reach2 = square(reach_m[f]);
    const own_frame &of = frame_[static_cast<size_t>(f)];
    const vec3 away = of.centre - near;
    if (dot(away, away) > square(reach_m[f] + of.radius_m + kRounding_m)) continue;
    for (int i = 0; i < points_of(f); i++) {
      const vec3 off = place_of(f, i) - near;
      if (!(dot(off, off) < reach2)) continue;
      note(bits_that_differ(appearance, point(f, i).appearance), static_cast<int64_t>(at(f, i)), &out);
    }
  }
  return out.is_clear() ? static_cast<int>(out.number) : -1;
}

void own_map::compare(int frame, const uint64_t appearance[kAppearanceWords], alike_point *out) const {
  for (int i = 0; i < points_of(frame); i++)
    note(bits_that_differ(appearance, point(frame, i).appearance), static_cast<int64_t>(at(frame, i)), out);
}

double log_by_chance(int agreeing, int count, double share) {
  const int others = count - 3, agree = agreeing - 3;
  if (others <= 0 || agree <= 0) return 0.0;
  const double q = static_cast<double>(agree) / others;
  double divergence = 0.0;
  if (q > share) {
    divergence = q * log(q / share);
    if (q < 1.0) divergence += (1.0 - q) * log((1.0 - q) / (1.0 - share));
  }
  const double triples = count * (count - 1.0) * (count - 2.0) / 6.0;
  return log(triples) - others * divergence;
}

}  // namespace wm
