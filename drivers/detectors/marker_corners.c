// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker_corners.h"

#include <math.h>
#include <stdlib.h>

#include "waymark/marker_fit.h"

// Default sigma of a coordinate, for corners refined to a part of a pixel without a correction of the camera's bloom.
// Not swept.
#define SIGMA_PX 0.3

struct wm_corner_reader {
  wm_marker_fit *fit;
};

wm_status wm_corner_reader_make(const char *path, const char *name, const wm_camera *camera, double size_m,
                                wm_corner_reader **out, wm_error *err) {
  const wm_marker_print print = {
      .size_m = size_m, .corners = 4, .corner = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};
  const size_t bytes = (wm_marker_fit_bytes() + 15u) / 16u * 16u;
  wm_corner_reader *self = calloc(1, sizeof *self);
  *out = NULL;
  if (self) self->fit = aligned_alloc(16, bytes);
  if (!self || !self->fit) {
    free(self);
    return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  }
  const char *why = wm_marker_fit_init(self->fit, camera, &print);
  if (why) {
    wm_corner_reader_free(self);
    return wm_fail(err, WM_BAD_CONFIG, "%s: camera '%s': %s", path, name, why);
  }
  *out = self;
  return WM_OK;
}

void wm_corner_reader_free(wm_corner_reader *self) {
  if (!self) return;
  free(self->fit);
  free(self);
}

const char *wm_corner_reader_pose(const wm_corner_reader *self, const double (*corners_px)[2], double sigma_px,
                                  wm_marker *out) {
  if (!wm_marker_fit_corners(self->fit, corners_px, isnan(sigma_px) ? SIGMA_PX : sigma_px, out))
    return "no pose of a square fits these corners";
  return NULL;
}
