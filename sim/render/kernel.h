// SPDX-License-Identifier: Apache-2.0
// What the renderer's inner loop reads and writes: plain data, so that it can be compiled twice, for machines with AVX2
// and for any. Both give the same bits. `C`: channels, 1 (grey: light and surfaces by their luminance) or 3.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/rays.h"
#include "render/texture_view.h"

namespace wm::render {

// What a hit needs to be shaded: two sides (that of the normal first), three corners.
template <int C>
struct alignas(32) Facet {
  float lamps[2][3][C];  // irradiance / pi of lamps and sun
  float open[2][3];      // share of the surroundings that is seen
  float s[3], t[3];      // texture coordinates
  float normal[3];       // unit, in the map
  float span_per_m;      // texture widths a metre on the surface
  uint32_t material;
};

template <int C>
struct Surface {
  float albedo[C], emission[C];
  float mirror, glance, roughness;
  bool emits;
  TextureView texture;
};

// A head lamp where the vehicle is at a row's time. Where there are any, C is 3.
struct Beam {
  float position[3], direction[3], power[3];
  float narrow;  // 1 / (1 - cos(half angle))
};

// Where one row's sample looks from.
struct Eye {
  float rotation[9];  // map from optical
  float origin[3];
  float time;  // of the frame, 0 to 1, for movers
  const Beam *beams;
};

// Something that moves: a ball that holds it for the whole frame, and the soft dark spot on the floor under it.
template <int C>
struct Moving {
  float centre[3], radius;
  float foot[3], inverse_shadow_radius;  // 0: no shadow
  const Facet<C> *facets;
};

template <int C>
struct Glow {
  float zenith[C], horizon[C], ground[C];
};

// exp(-attenuation · distance) by table: the same bits everywhere, and cheap.
constexpr float kAttenuationStep_m = 0.02f;
constexpr int kAttenuationSteps = 2048;
struct Depths {
  bool there = false;
  const float *passed[3] = {};  // a table of kAttenuationSteps a channel
  float haze[3] = {};
  float lamp_haze = 0;
};

// What all rays of a frame share.
template <int C>
struct Frame {
  int width, height, samples;
  const float *corner[3];  // unit directions at pixels' corners, optical frame: (width + 1) a row
  const uint8_t *there;    // a pixel
  const float *angle_rad;  // a pixel
  float spread_of_sample;  // a sample stands for so much of a pixel's width
  uint32_t key[2];         // of the frame's random numbers
  RTCScene still, moving;  // moving: nullptr when nothing does
  const Facet<C> *facets;  // of `still`
  const Surface<C> *surfaces;
  const Moving<C> *movers;
  int mover_count, beam_count;
  float light, ambient;
  float ambient_up[C], ambient_down[C];
  Glow<C> sky;
  Depths water;
  bool mirrors;
};

// Mirrored rays that are still to be followed, and the pixels that they are for. Room for width + 8 each.
struct Echoes {
  static constexpr size_t kArrays = 10;
  float *origin[3], *direction[3];
  float *span, *spread;       // width where they start, m, and how it grows with the way, rad
  float *share, *share_next;  // of pixel x and, when it is more than 0, of pixel x + 1
  int32_t *x;
};

template <int C>
struct Row {
  int y;
  const Eye *eyes;    // one a sample
  float *sum;         // C planes of `sum_stride` values, which become the row's mean radiance
  size_t sum_stride;  // at least width + 8
  float *depth;       // a pixel, along the middle sample's ray; or nullptr
  Echoes echoes;
};

struct Kernel {
  void (*grey_row)(const Frame<1> &, const Row<1> &);
  void (*colour_row)(const Frame<3> &, const Row<3> &);
};
// By what the machine has; `plain`: without AVX2 in any case.
const Kernel &kernel(bool plain);

}  // namespace wm::render
