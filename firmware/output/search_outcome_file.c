// SPDX-License-Identifier: Apache-2.0
#include "output/search_outcome_file.h"
#include "output/new_file.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static void put_row(FILE *f, const char *source, const wm_landmark_looks *row) {
  (void)fprintf(f, "%s,%" PRId32, source, row->landmark_id);
  for (unsigned i = 0; i < WM_LOOK_COUNT; i++) (void)fprintf(f, ",%" PRIu64, row->looks[i]);
  (void)fputc('\n', f);
}

wm_status wm_write_search_outcomes(const char *dir, wm_vision *vision, wm_error *err) {
  const wm_landmark_looks *rows;
  size_t known = 0;
  for (size_t i = 0; i < wm_vision_count(vision); i++) known += wm_vision_looks(vision, i, &rows);
  char path[WM_PATH_MAX + 32];
  (void)snprintf(path, sizeof path, "%s/looked-for.csv", dir);
  if (known == 0) {
    (void)remove(path);  // of an earlier run
    return WM_OK;
  }
  FILE *f = new_file(path);
  if (!f) return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  (void)fputs("source,landmark", f);
  for (unsigned i = 0; i < WM_LOOK_COUNT; i++) (void)fprintf(f, ",%s", wm_look_name(i));
  (void)fputc('\n', f);
  for (size_t i = 0; i < wm_vision_count(vision); i++) {
    size_t count = wm_vision_looks(vision, i, &rows);
    for (size_t k = 0; k < count; k++) put_row(f, wm_vision_source(vision, i)->name, &rows[k]);
  }
  int failed = ferror(f);
  if (fclose(f) != 0 || failed)
    return wm_fail(err, WM_IO, "%s: could not be written completely: %s", path, strerror(errno));
  return WM_OK;
}
