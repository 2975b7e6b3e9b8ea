// SPDX-License-Identifier: Apache-2.0
// Any bytes as a map's picture: it is read whole or refused with a reason.
#include <string.h>

#include "fuzz.h"
#include "waymark/map.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  wm_grey grey;
  wm_error err = {0};
  const wm_status status = wm_grey_decode(data, size, "fuzz", &grey, &err);
  if (status != WM_OK) {
    if (grey.pixels || strlen(err.text) < 10) abort();
    return 0;
  }
  const wm_raster raster = {.width_px = grey.width_px,
                            .height_px = grey.height_px,
                            .resolution_m = 0.05,
                            .edges = grey.pixels,
                            .drivable = NULL};
  if (wm_raster_hash(&raster) != wm_raster_hash(&raster)) abort();
  free(grey.pixels);
  return 0;
}
