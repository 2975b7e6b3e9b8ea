// SPDX-License-Identifier: Apache-2.0
// The estimator's map on disk with its covariances (waymark/keeper.h): a run continues with it after a restart, a kill
// or a power cut. Little-endian:
//
//   "WMMAP 1\n", hash of the configuration u64, hash of the calibration u64, UTC in s f64, bytes u64, CRC-32 of all
//   that precedes and of the image u32; the image
#ifndef WAYMARK_OUTPUT_SAVED_MAP_H
#define WAYMARK_OUTPUT_SAVED_MAP_H

#include "config/config.h"
#include "waymark/estimator.h"
#include "waymark/status.h"

// Identity of a map: the estimator with the parameters that it reads; the robot's calibration and given landmarks.
typedef struct wm_map_identity {
  uint64_t configuration, calibration;
} wm_map_identity;
wm_map_identity wm_map_identity_of(const wm_config *config, const wm_setup *setup);

#define WM_SAVED_MAP_BYTES_MAX ((uint64_t)1 << 30)  // 15000 states

typedef struct wm_saved_map {
  void *image;  // free() it
  size_t bytes;
  double utc_s;  // when it was saved, by this computer's clock at that time; 0: unknown
} wm_saved_map;

// Replaces the file atomically. Not on the real-time thread.
wm_status wm_saved_map_write(const char *path, const wm_map_identity *of, double utc_s, const void *image, size_t bytes,
                             wm_error *err);
// WM_NOT_FOUND: no file. WM_BAD_DATA with the reason: truncated, damaged, of another configuration or calibration, or
// refused by the estimator. Allocates.
wm_status wm_saved_map_read(const char *path, const wm_config *config, const wm_setup *setup, wm_saved_map *out,
                            wm_error *err);

#endif
