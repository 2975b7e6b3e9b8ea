// SPDX-License-Identifier: Apache-2.0
// Eight numbers at a time, for the renderer's inner loops. The compiler makes one AVX instruction or two SSE ones of
// each; both round alike, so a picture's bits don't depend on which it was.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include <cstdint>
#include <cstring>

// Everything is inlined into the two translation units that include this: nothing of the AVX one may be linked into the
// other.
#define WM_LANES_INLINE static inline __attribute__((always_inline))

namespace wm::render {

typedef float float8 __attribute__((vector_size(32)));
typedef int32_t int8 __attribute__((vector_size(32)));
typedef uint32_t uint8 __attribute__((vector_size(32)));

constexpr int kLanes = 8;

WM_LANES_INLINE float8 splat(float v) { return float8{v, v, v, v, v, v, v, v}; }
WM_LANES_INLINE int8 splat(int v) { return int8{v, v, v, v, v, v, v, v}; }
WM_LANES_INLINE uint8 splat(uint32_t v) { return uint8{v, v, v, v, v, v, v, v}; }

template <class V, class T>
WM_LANES_INLINE V load(const T *from) {
  static_assert(sizeof(V) == kLanes * sizeof(T));
  V v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
template <class V, class T>
WM_LANES_INLINE void store(T *to, V v) {
  static_assert(sizeof(V) == kLanes * sizeof(T));
  std::memcpy(to, &v, sizeof v);
}

// Masks: -1 in lanes that hold, 0 in others.
WM_LANES_INLINE float8 select(int8 mask, float8 yes, float8 no) { return mask ? yes : no; }
WM_LANES_INLINE int8 select(int8 mask, int8 yes, int8 no) { return mask ? yes : no; }
WM_LANES_INLINE float8 least(float8 a, float8 b) { return select(a < b, a, b); }
WM_LANES_INLINE float8 most(float8 a, float8 b) { return select(a > b, a, b); }
WM_LANES_INLINE float8 clamp(float8 v, float low, float high) { return least(most(v, splat(low)), splat(high)); }

// One bit a lane.
WM_LANES_INLINE unsigned bits_of(int8 mask) {
#ifdef __AVX2__
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#else
  unsigned bits = 0;
  for (int i = 0; i < kLanes; i++) bits |= mask[i] ? 1u << i : 0u;
  return bits;
#endif
}

WM_LANES_INLINE float8 to_float(int8 v) { return __builtin_convertvector(v, float8); }
WM_LANES_INLINE int8 to_int(float8 v) { return __builtin_convertvector(v, int8); }  // towards zero
WM_LANES_INLINE int8 floor_int(float8 v) {
  const int8 i = to_int(v);
  return i + (to_float(i) > v);  // a mask that holds is -1
}

WM_LANES_INLINE float8 root(float8 v) {
#ifdef __AVX2__
  return (float8)_mm256_sqrt_ps((__m256)v);
#else
  float8 out;
  for (int i = 0; i < kLanes; i++) out[i] = __builtin_sqrtf(v[i]);
  return out;
#endif
}

// log2, within 0.01: the choice between two levels of a pyramid needs no more.
WM_LANES_INLINE float8 rough_log2(float8 v) {
  const int8 bits = (int8)v;
  const float8 m = (float8)((bits & 0x7fffff) | 0x3f800000) - 1.0f;
  return to_float((bits >> 23) - 127) + m * (1.3465f - 0.3465f * m);
}

// Two neighbouring 16-bit values at each index, as one number each: the first in the lower half.
WM_LANES_INLINE uint8 gather_pairs(const uint16_t *from, int8 index) {
#ifdef __AVX2__
  return (uint8)_mm256_i32gather_epi32(reinterpret_cast<const int *>(from), (__m256i)index, 2);
#else
  uint8 out;
  for (int i = 0; i < kLanes; i++) {
    uint32_t pair;
    std::memcpy(&pair, from + index[i], sizeof pair);
    out[i] = pair;
  }
  return out;
#endif
}

WM_LANES_INLINE float8 gather(const float *from, int8 index) {
#ifdef __AVX2__
  return (float8)_mm256_i32gather_ps(from, (__m256i)index, 4);
#else
  float8 out;
  for (int i = 0; i < kLanes; i++) out[i] = from[index[i]];
  return out;
#endif
}

// Random bits from a number: the mixing found by C. Wellons' search ("lowbias32", 2018); `key` comes in half way.
WM_LANES_INLINE uint8 hash(uint8 x, uint32_t key) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x += key;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}
// [0, 1) from the lower or the upper half of the bits.
WM_LANES_INLINE float8 lower_part(uint8 bits) { return to_float((int8)(bits & 0xffffu)) * (1.0f / 65536.0f); }
WM_LANES_INLINE float8 upper_part(uint8 bits) { return to_float((int8)(bits >> 16)) * (1.0f / 65536.0f); }

struct vec8 {
  float8 x, y, z;
};
WM_LANES_INLINE vec8 splat3(const float *v) { return {splat(v[0]), splat(v[1]), splat(v[2])}; }
WM_LANES_INLINE vec8 operator+(vec8 a, vec8 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
WM_LANES_INLINE vec8 operator-(vec8 a, vec8 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
WM_LANES_INLINE vec8 operator*(vec8 a, float8 k) { return {a.x * k, a.y * k, a.z * k}; }
WM_LANES_INLINE float8 dot(vec8 a, vec8 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WM_LANES_INLINE vec8 cross(vec8 a, vec8 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
WM_LANES_INLINE vec8 unit(vec8 v) { return v * (1.0f / root(dot(v, v))); }
WM_LANES_INLINE vec8 select(int8 mask, vec8 yes, vec8 no) {
  return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}

}  // namespace wm::render
