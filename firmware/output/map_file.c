// SPDX-License-Identifier: Apache-2.0
// map-estimate.csv: estimated landmarks with their covariances. Also readable as a landmarks.csv.
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "output/csv_row.h"
#include "output/json_files.h"
#include "output/new_file.h"
#include "output/run_folder.h"

static void put_landmark(wm_row *line, const wm_landmark *l, const double covariance[4]) {
  const double numbers[] = {l->p_m[0],     l->p_m[1],     l->p_m[2],  l->sigma_m,   covariance[0],
                            covariance[1], covariance[2], l->yaw_rad, covariance[3]};
  line->length = 0;
  wm_row_int(line, l->id);
  for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
    wm_row_char(line, ',');
    wm_row_exact(line, numbers[i]);
  }
  wm_row_char(line, '\n');
}

static int by_id(const void *a, const void *b) {
  int32_t x = ((const wm_landmark *)a)->id, y = ((const wm_landmark *)b)->id;
  return x < y ? -1 : x > y;
}

wm_status wm_write_map(const char *dir, const wm_estimator *estimator, const void *state, wm_error *err) {
  if (!estimator->landmarks) return WM_OK;
  size_t count = estimator->landmarks(state, NULL, NULL, 0);
  // A landmark with its covariance, so that they are sorted together.
  typedef struct entry {
    wm_landmark landmark;
    double covariance[4];
  } entry;
  entry *entries = calloc(count + 1, sizeof *entries);
  wm_landmark *landmarks = calloc(count + 1, sizeof *landmarks);
  double(*covariances)[4] = calloc(count + 1, sizeof *covariances);
  int have_memory = entries && landmarks && covariances;
  wm_status status = have_memory ? WM_OK : wm_fail(err, WM_IO, "%s: no memory for the map", dir);
  char path[WM_PATH_MAX + 32];
  (void)snprintf(path, sizeof path, "%s/map-estimate.csv", dir);
  FILE *file = status == WM_OK ? new_file(path) : NULL;
  if (status == WM_OK && !file) status = wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  if (file && entries && landmarks && covariances) {
    estimator->landmarks(state, landmarks, covariances, count);
    for (size_t i = 0; i < count; i++) {
      entries[i].landmark = landmarks[i];
      memcpy(entries[i].covariance, covariances[i], sizeof entries[i].covariance);
    }
    qsort(entries, count, sizeof *entries, by_id);
    wm_row line;
    (void)fputs("id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt\n", file);
    for (size_t i = 0; i < count; i++) {
      put_landmark(&line, &entries[i].landmark, entries[i].covariance);
      (void)fwrite(line.bytes, 1, line.length, file);
    }
    int failed = ferror(file);
    if (fclose(file) != 0 || failed)
      status = wm_fail(err, WM_IO, "%s: could not be written completely: %s", path, strerror(errno));
  }
  free(entries);
  free(landmarks);
  free(covariances);
  return status;
}
