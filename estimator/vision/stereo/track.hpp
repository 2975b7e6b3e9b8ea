// SPDX-License-Identifier: Apache-2.0
// Track of a world point in a stereo pair: begun at a corner, matched left to right, followed from picture to picture.
// Its first patch is kept and warped by the motion since and the surface's slope, so the place does not drift.
#ifndef WAYMARK_ESTIMATOR_VISION_TRACK_HPP
#define WAYMARK_ESTIMATOR_VISION_TRACK_HPP

#include "vision/stereo/motion.hpp"
#include "vision/stereo/patch.hpp"

namespace wm {

inline constexpr int kAnchorSide = 64;  // of the kept patch: holds a template rotated and enlarged by 1.6

inline constexpr double kSigmaMax_px = 0.25;  // of a corner or match that is used: of a track's point. Not swept

struct track {
  int32_t id;
  int32_t seen;  // pictures, the first one included
  pixel left, right;
  vec3 place;           // in the left camera's axes
  double slope[2];      // of the disparity in the left picture, px per px
  pixel anchor;         // place in the first picture
  vec3 anchor_place;    // the same in the camera's axes then
  vec3 anchor_surface;  // n of its plane n x = 1 there
  rigid world_anchor;   // from the camera's axes then to the tracker's world
  uint8_t patch[kAnchorSide * kAnchorSide];
};

// The current rectified pictures and the previous left one.
struct pair_pictures {
  const pyramid *before, *left, *right;
};

// Begins a track: matches a corner of the left picture in the right one. False: ambiguous, too near, too far or no
// match.
bool begin_track(const pair_geometry &rig, const pair_pictures &pictures, const wm_stereo_params &params,
                 const pixel &at, const rigid &world_camera, track *out);

// Finds the track in the newest pictures. `camera_world`: predicted pose; `levels`: of the pyramid to begin at. Writes
// left, right, place and slope. False where it is lost.
bool follow_track(const pair_geometry &rig, const pair_pictures &pictures, const wm_stereo_params &params,
                  const rigid &camera_before, const rigid &camera_world, int levels, track *self);

}  // namespace wm

#endif
