// SPDX-License-Identifier: Apache-2.0
// Any bytes as the pose that a run saved: refused with a text, or a start that is finite, whatever the clock says.
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "fuzz.h"
#include "output/saved_pose.h"

static void check_start(const wm_saved_pose *saved, double utc_s) {
  static max_align_t motion[512];
  wm_start start;
  check(sizeof motion >= wm_motion_params_table.bytes);
  wm_params_defaults(&wm_motion_params_table, motion);
  if (!wm_saved_pose_start(saved, utc_s, 1e12, 0.4, 0.1, (const wm_motion_params *)motion, &start)) return;
  for (int i = 0; i < 2; i++) check(isfinite(start.p_m[i]));
  check(isfinite(start.heading_rad) && isfinite(start.sigma_xy_m) && isfinite(start.sigma_heading_rad));
  check(start.sigma_xy_m > 0 && start.sigma_heading_rad > 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static char path[64];
  if (path[0] == '\0') (void)snprintf(path, sizeof path, "/tmp/wm_fuzz_pose_%d.yaml", (int)getpid());
  FILE *file = fopen(path, "wb");
  check(file != NULL);
  check(fwrite(data, 1, size, file) == size);
  check(fclose(file) == 0);
  wm_saved_pose saved;
  wm_error err = {WM_OK, ""};
  wm_status status = wm_saved_pose_read(path, &saved, &err);
  (void)unlink(path);
  if (status != WM_OK) {
    check(err.text[0] != '\0' && memchr(err.text, 0, sizeof err.text) != NULL);
    return 0;
  }
  check_start(&saved, saved.utc_s + 1);
  check_start(&saved, saved.utc_s - 1e9);
  check_start(&saved, 1.7e9);
  return 0;
}
