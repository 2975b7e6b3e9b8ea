// SPDX-License-Identifier: Apache-2.0
#include "library/changed_config.h"

#include <stdlib.h>
#include <string.h>

#include "waymark/text.h"
#include "waymark/yaml.h"

#define CONFIG_BYTES_MAX ((size_t)1 << 20)  // as of the commands
#define LINE_MAX_BYTES 512

// Replaces *text, which is from malloc.
static wm_status change(char **text, size_t *length, const char *line, size_t line_length, wm_error *err) {
  char key[LINE_MAX_BYTES];
  if (line_length >= sizeof key)
    return wm_fail(err, WM_BAD_USAGE, "options.changes: '%.40s...': longer than %d bytes", line, LINE_MAX_BYTES - 1);
  memcpy(key, line, line_length);
  key[line_length] = '\0';
  char *colon = strstr(key, ": ");
  if (!colon) return wm_fail(err, WM_BAD_USAGE, "options.changes: '%.60s': \"KEY: VALUE\" is needed", key);
  *colon = '\0';
  char *changed;
  size_t changed_length;
  wm_status status =
      wm_yaml_edit(*text, *length, key, colon + 2 + strspn(colon + 2, " "), "", &changed, &changed_length, err);
  if (status != WM_OK) return wm_fail_in(err, "options.changes");
  free(*text);
  *text = changed;
  *length = changed_length;
  return WM_OK;
}

wm_status changed_config_parse(const char *text, size_t length, const char *path, const char *changes,
                               config_parse_fn parse, waymark_note_fn note, void *context, wm_config *out,
                               wm_error *err) {
  memset(out, 0, sizeof *out);
  char *changed = malloc(length + 1);
  if (!changed) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  memcpy(changed, text, length);
  changed[length] = '\0';
  wm_status status = WM_OK;
  for (const char *line = changes; status == WM_OK && line && *line;) {
    const size_t end = strcspn(line, "\n");
    if (strspn(line, " \t") < end) status = change(&changed, &length, line, end, err);
    line += end + (line[end] == '\n');
  }
  if (status == WM_OK) {
    status = parse(changed, length, path, out, err);
    if (status != WM_OK && changes && *changes) status = wm_fail_in(err, "with options.changes");
  }
  free(changed);
  if (status == WM_OK && note && out->estimator) wm_config_each_warning(out, note, context);
  return status;
}

wm_status changed_config_load(const char *path, const char *changes, waymark_note_fn note, void *context,
                              wm_config *out, wm_error *err) {
  char *text;
  size_t length;
  memset(out, 0, sizeof *out);
  wm_status status = wm_text_read_file(path, CONFIG_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = changed_config_parse(text, length, path, changes, wm_config_parse_undecided, note, context, out, err);
  free(text);
  return status;
}
