// SPDX-License-Identifier: Apache-2.0
// A point of the world in a stereo pair: begun at a corner, matched left to right, followed from picture to picture.
// Its patch is kept as it was first seen and bent as the motion since and the surface's slope say it must look now: so
// its place doesn't creep from picture to picture.
#ifndef WAYMARK_ESTIMATOR_VISION_TRACK_HPP
#define WAYMARK_ESTIMATOR_VISION_TRACK_HPP

#include "vision/stereo/motion.hpp"
#include "vision/stereo/patch.hpp"

namespace wm {

inline constexpr int kAnchorSide = 64;  // of the patch that is kept: a template turned and enlarged by 1.6 fits in

struct track {
  int32_t id;
  int32_t seen;  // pictures, the first one included
  pixel left, right;
  vec3 place;           // in the left camera's axes
  double slope[2];      // of the disparity in the left picture, px a px
  pixel anchor;         // where it was first seen
  vec3 anchor_place;    // and in the camera's axes then
  vec3 anchor_surface;  // n of the plane n x = 1 that it lies on there
  rigid world_anchor;   // from the camera's axes then to the tracker's own world
  uint8_t patch[kAnchorSide * kAnchorSide];
};

// The rectified pictures of now and the left one of before.
struct pair_pictures {
  const pyramid *before, *left, *right;
};

// Finds a corner of the left picture in the right one. False where it is ambiguous, too near, too far or not there.
bool begin_track(const pair_geometry &rig, const pair_pictures &pictures, const wm_stereo_params &params,
                 const pixel &at, const rigid &world_camera, track *out);

// Finds the track in the newest pictures. `camera_world`: as the motion so far lets expect it; `levels`: how far up the
// pyramid it must be looked for. Writes left, right, place and slope. False where it is gone.
bool follow_track(const pair_geometry &rig, const pair_pictures &pictures, const wm_stereo_params &params,
                  const rigid &camera_before, const rigid &camera_world, int levels, track *self);

}  // namespace wm

#endif
