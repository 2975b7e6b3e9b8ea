// SPDX-License-Identifier: Apache-2.0
// Edges by rays: rays over the floor from the camera's foot point, sampled in the picture at steps of a pixel by a
// table. The first edge from bright to dark on a ray is the border of the floor.
#ifndef WAYMARK_ESTIMATOR_VISION_RAYS_HPP
#define WAYMARK_ESTIMATOR_VISION_RAYS_HPP

#include "image/picture_sample.hpp"
#include "vision/edges/params.h"

namespace wm {

// Fraction of the range. A narrower dark band on the floor is a line (a joint of tiles, a cable), not a wall: the
// height of a board over the camera's height, less than half of the lowest skirting.
inline constexpr double kLineOfRange = 0.05;
inline constexpr int kRaySamplesMax = 2048;  // of a ray: a step is a pixel, so above a picture's diagonal

struct ray {
  uint32_t first, count;  // samples
  double direction_rad, cos, sin;
};

// An edge on a ray.
struct ray_edge {
  int32_t ray;
  int32_t is_fall;  // from bright to dark
  float sample;     // place on the ray, in samples
  float slope;      // grey levels a pixel
  float middle;     // grey level halfway between both sides
  float change;     // between both sides, grey levels
};

struct ray_fan {
  uint32_t ray_count, sample_count;
  ray *rays;
  picture_sample *samples;
  float *range_m;  // of each sample
};

// Counts the rays and samples of this camera's fan.
void ray_fan_count(const mounted_camera &camera, const wm_edges_params &params, uint32_t *rays, uint32_t *samples);
// Fills the fan, whose arrays have the sizes counted.
void ray_fan_make(const mounted_camera &camera, const wm_edges_params &params, ray_fan *out);

// Median brightness of the floor before the robot (the first sample of each ray), in 1/256 grey levels: robust against
// mirrored lamps.
double usual_floor(const ray_fan &fan, const wm_frame &frame);

// Work space for one ray: its grey levels, in 1/256.
struct ray_work {
  int32_t grey[kRaySamplesMax];
};

// First edge of a wall on the ray, from sample `from`. False where there is none.
bool find_first_edge(const ray_fan &fan, uint32_t index, const wm_frame &frame, double usual_grey,
                     const wm_edges_params &params, int from, ray_work *work, ray_edge *out);

// Range at a place between samples.
double range_at(const ray_fan &fan, const ray &r, double sample);

}  // namespace wm

#endif
