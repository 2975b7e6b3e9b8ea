// SPDX-License-Identifier: Apache-2.0
#include "live/copy_map.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "output/new_file.h"
#include "waymark/recording.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define YAML_BYTES_MAX (1u << 20)  // usual files are below a kB
#define PATH_BYTES (2 * WM_PATH_MAX)
#define PICTURES_MAX 3  // image, layers.edges, layers.drivable

typedef struct picture {
  char named[WM_PATH_MAX];  // as in the YAML
  char beside[WM_NAME_MAX + 8];
} picture;

// Syncs it to the disk.
static int end_file(FILE *f, int failed) {
  if (!failed && (fflush(f) != 0 || fsync(fileno(f)) != 0)) failed = errno;
  if (fclose(f) != 0 && !failed) failed = errno;
  return failed;
}

static wm_status copy_file(const char *from, const char *to, wm_error *err) {
  static const size_t kChunk = 1 << 16;
  FILE *in = fopen(from, "rbe");
  if (!in) return errno == ENOENT ? WM_OK : wm_fail(err, WM_IO, "%s: can't be read: %s", from, strerror(errno));
  FILE *out = new_file(to);
  char *chunk = malloc(kChunk);
  int failed = !out ? errno : !chunk ? ENOMEM : 0;
  for (size_t length; !failed && (length = fread(chunk, 1, kChunk, in)) > 0;)
    if (fwrite(chunk, 1, length, out) != length) failed = errno;
  if (!failed && ferror(in)) failed = EIO;
  free(chunk);
  (void)fclose(in);
  if (out) failed = end_file(out, failed);
  return failed ? wm_fail(err, WM_IO, "%s: can't be written: %s", to, strerror(failed)) : WM_OK;
}

// Line by line, with the pictures' names in the recording.
static wm_status write_yaml(const char *text, const picture *pictures, size_t count, const char *to, wm_error *err) {
  FILE *out = new_file(to);
  if (!out) return wm_fail(err, WM_IO, "%s: can't be written: %s", to, strerror(errno));
  int failed = 0;
  while (*text && !failed) {
    const picture *here = NULL;
    for (size_t i = 0; i < count; i++)
      if (strncmp(text, pictures[i].named, strlen(pictures[i].named)) == 0) here = &pictures[i];
    if (here ? fputs(here->beside, out) < 0 : fputc(*text, out) == EOF) failed = errno;
    text += here ? strlen(here->named) : 1;
  }
  failed = end_file(out, failed);
  return failed ? wm_fail(err, WM_IO, "%s: can't be written: %s", to, strerror(failed)) : WM_OK;
}

// A picture's name in the recording: its last part, with a number where two would be equal.
static void name_beside(picture *pictures, size_t at) {
  const char *slash = strrchr(pictures[at].named, '/');
  const char *last = slash ? slash + 1 : pictures[at].named;
  (void)snprintf(pictures[at].beside, sizeof pictures[at].beside, "%.*s", WM_NAME_MAX - 1, last);
  for (size_t i = 0; i < at; i++)
    if (strcmp(pictures[i].beside, pictures[at].beside) == 0 && strcmp(pictures[i].named, pictures[at].named) != 0)
      (void)snprintf(pictures[at].beside, sizeof pictures[at].beside, "%zu-%.*s", at, WM_NAME_MAX - 1, last);
}

static wm_status find_pictures(const char *map_yaml, picture pictures[PICTURES_MAX], size_t *count, wm_error *err) {
  static const char *const kKeys[PICTURES_MAX] = {"layers.edges", "layers.drivable", "image"};
  wm_yaml *doc;
  *count = 0;
  wm_status status = wm_yaml_load(map_yaml, &doc, err);
  if (status != WM_OK) return status;
  wm_yaml_node root = wm_yaml_root(doc);
  for (size_t i = 0; i < PICTURES_MAX && status == WM_OK; i++) {
    wm_yaml_node node = wm_yaml_get(&root, kKeys[i]);
    if (!wm_yaml_there(&node)) continue;
    status = wm_yaml_string(&node, pictures[*count].named, sizeof pictures[*count].named, err);
    if (status != WM_OK || !pictures[*count].named[0]) continue;
    name_beside(pictures, *count);
    (*count)++;
  }
  wm_yaml_free(doc);
  return status;
}

wm_status copy_map(const char *map_yaml, const char *out_dir, wm_error *err) {
  picture pictures[PICTURES_MAX];
  char from[PATH_BYTES], to[PATH_BYTES], *text;
  size_t count, length;
  wm_status status = find_pictures(map_yaml, pictures, &count, err);
  if (status != WM_OK) return status;
  (void)snprintf(to, sizeof to, "%s/map", out_dir);
  if (mkdir(to, 0777) != 0 && errno != EEXIST)
    return wm_fail(err, WM_IO, "%s: can't be created: %s", to, strerror(errno));
  const char *slash = strrchr(map_yaml, '/');
  int folder = slash ? (int)(slash - map_yaml) + 1 : 0;
  for (size_t i = 0; i < count && status == WM_OK; i++) {
    (void)snprintf(from, sizeof from, "%.*s%s", pictures[i].named[0] == '/' ? 0 : folder, map_yaml, pictures[i].named);
    (void)snprintf(to, sizeof to, "%s/map/%s", out_dir, pictures[i].beside);
    status = copy_file(from, to, err);
  }
  if (status == WM_OK) status = wm_text_read_file(map_yaml, YAML_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  (void)snprintf(to, sizeof to, "%s/map/map.yaml", out_dir);
  status = write_yaml(text, pictures, count, to, err);
  free(text);
  return status;
}
