// SPDX-License-Identifier: Apache-2.0
#include "cli/check/changed_copy.h"

#include <dirent.h>
#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "waymark/text.h"
#include "waymark/yaml.h"

#define FILE_BYTES_MAX ((size_t)512 << 20)

// Files of a recording that a configuration may name in their place.
#define NAMED_COUNT 5
static const struct {
  const char *file, *key;
  size_t offset;
} kNamed[NAMED_COUNT] = {{"calibration.yaml", "calibration", offsetof(wm_recording_overrides, calibration)},
                         {"landmarks.csv", "landmarks", offsetof(wm_recording_overrides, landmarks)},
                         {"vehicle.dbc", "dbc", offsetof(wm_recording_overrides, dbc)},
                         {"can-signals.yaml", "can_signals", offsetof(wm_recording_overrides, can_signals)},
                         {"map/map.yaml", "map", offsetof(wm_recording_overrides, map)}};

static char *overridden(wm_recording_overrides *all, const char *file) {
  for (size_t i = 0; i < NAMED_COUNT; i++)
    if (strcmp(file, kNamed[i].file) == 0) return (char *)all + kNamed[i].offset;
  return NULL;
}

static wm_status path_in(const char *dir, const char *file, char out[WM_PATH_MAX], wm_error *err) {
  if (snprintf(out, WM_PATH_MAX, "%s/%s", dir, file) < WM_PATH_MAX) return WM_OK;
  return wm_fail(err, WM_BAD_USAGE, "%s/%s: the path is longer than %d bytes", dir, file, WM_PATH_MAX - 1);
}

static wm_status read_original(const char *dir, const wm_recording_overrides *overrides, const file_edit *edit,
                               char **text, size_t *length, wm_error *err) {
  char path[WM_PATH_MAX];
  wm_recording_overrides all = *overrides;
  const char *file = edit->file, *named = edit->is_config ? file : overridden(&all, file);
  if (named && named[0]) return wm_text_read_file(named, FILE_BYTES_MAX, text, length, err);
  wm_status status = path_in(dir, file, path, err);
  return status == WM_OK ? wm_text_read_file(path, FILE_BYTES_MAX, text, length, err) : status;
}

// The file of the edit `of`, with all of its edits.
static wm_status edited(const char *dir, const wm_recording_overrides *overrides, const file_edit *of,
                        const file_edit *edits, size_t count, const char *comment, char **text, size_t *length,
                        wm_error *err) {
  wm_status status = read_original(dir, overrides, of, text, length, err);
  for (size_t i = 0; status == WM_OK && i < count; i++) {
    char *fresh;
    if (strcmp(edits[i].file, of->file) != 0) continue;
    status = edit_text(&edits[i], *text, *length, comment, &fresh, length, err);
    if (status == WM_NOT_FOUND && edits[i].is_optional) {
      status = WM_OK;
      continue;
    }
    if (status != WM_OK) {
      free(fresh);
      free(*text);
      return status;
    }
    free(*text);
    *text = fresh;
  }
  return status;
}

static wm_status write_text(const char *path, const char *text, size_t length, wm_error *err) {
  FILE *f = fopen(path, "we");
  const size_t written = f ? fwrite(text, 1, length, f) : 0;
  if (!f || fclose(f) != 0 || written != length)
    return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  return WM_OK;
}

static int is_edited(const file_edit *edits, size_t count, const char *file) {
  for (size_t i = 0; i < count; i++)
    if (strcmp(edits[i].file, file) == 0) return 1;
  return 0;
}

static int is_within(const file_edit *edits, size_t count, const char *folder) {
  const size_t n = strlen(folder);
  for (size_t i = 0; i < count; i++)
    if (strncmp(edits[i].file, folder, n) == 0 && edits[i].file[n] == '/') return 1;
  return 0;
}

// Links to the entries of a folder of the recording (`inner`: "" or "video/") that have no edit.
static wm_status link_entries(const changed_copy *self, const char *original, const char *inner, const file_edit *edits,
                              size_t count, wm_error *err) {
  char from[WM_PATH_MAX], to[WM_PATH_MAX], name[300], real[WM_PATH_MAX];
  wm_status status = path_in(original, inner, from, err);
  DIR *all = status == WM_OK ? opendir(from) : NULL;
  if (!all) return wm_fail(err, WM_NOT_FOUND, "%s: can't be opened: %s", from, strerror(errno));
  for (const struct dirent *e; status == WM_OK && (e = readdir(all)) != NULL;) {
    if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
    (void)snprintf(name, sizeof name, "%s%s", inner, e->d_name);
    if (is_edited(edits, count, name)) continue;
    status = path_in(original, name, real, err);
    if (status == WM_OK) status = path_in(self->out, name, to, err);
    if (status != WM_OK) break;
    if (!inner[0] && is_within(edits, count, name)) {
      char folder[304];
      (void)snprintf(folder, sizeof folder, "%s/", name);
      if (mkdir(to, 0777) != 0) status = wm_fail(err, WM_IO, "%s: can't be created: %s", to, strerror(errno));
      if (status == WM_OK) status = link_entries(self, original, folder, edits, count, err);
    } else if (symlink(real, to) != 0) {
      status = wm_fail(err, WM_IO, "%s: can't be created: %s", to, strerror(errno));
    }
  }
  (void)closedir(all);
  return status;
}

// Tables have no comments: their changes are listed at the end of recording.yaml.
static wm_status note_tables(const changed_copy *self, const char *original, const file_edit *edits, size_t count,
                             const char *comment, wm_error *err) {
  char path[WM_PATH_MAX], from[WM_PATH_MAX], words[400];
  char *text = NULL;
  size_t length;
  wm_status status = path_in(self->out, "recording.yaml", path, err);
  if (status == WM_OK) status = path_in(original, "recording.yaml", from, err);
  if (status == WM_OK)
    status =
        wm_text_read_file(is_edited(edits, count, "recording.yaml") ? path : from, FILE_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  (void)unlink(path);
  FILE *f = fopen(path, "we");
  if (f) {
    (void)fprintf(f, "%s%s", text, length > 0 && text[length - 1] != '\n' ? "\n" : "");
    for (size_t i = 0; i < count; i++) {
      edit_words(&edits[i], words, sizeof words);
      if (words[0]) (void)fprintf(f, "# %s: %s: %s\n", comment, edits[i].file, words);
    }
  }
  free(text);
  if (!f || fclose(f) != 0) return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  return WM_OK;
}

wm_status changed_copy_make(changed_copy *self, const wm_recording_overrides *overrides, const file_edit *edits,
                            size_t count, const char *comment, wm_error *err) {
  char *original = realpath(self->dir, NULL);
  if (!original) return wm_fail(err, WM_NOT_FOUND, "%s: there is no such folder", self->dir);
  self->overrides = *overrides;
  wm_status status =
      mkdir(self->out, 0777) == 0 ? WM_OK : wm_fail(err, WM_IO, "%s: can't be created: %s", self->out, strerror(errno));
  if (status == WM_OK) status = link_entries(self, original, "", edits, count, err);
  for (size_t i = 0; status == WM_OK && i < count; i++) {
    char path[WM_PATH_MAX], *text = NULL;
    size_t length;
    // Written with all of its edits, or by changed_config.
    if (edits[i].is_config || is_edited(edits, i, edits[i].file)) continue;
    status = edited(self->dir, overrides, &edits[i], edits, count, comment, &text, &length, err);
    if (status != WM_OK) break;
    status = path_in(self->out, edits[i].file, path, err);
    if (status == WM_OK) status = write_text(path, text, length, err);
    free(text);
    char *named = overridden(&self->overrides, edits[i].file);
    if (status == WM_OK && named && named[0]) (void)snprintf(named, WM_PATH_MAX, "%s", path);
  }
  if (status == WM_OK && comment[0]) status = note_tables(self, original, edits, count, comment, err);
  free(original);
  return status;
}

wm_status changed_config(const file_edit *edits, size_t count, const char *comment, char **text, size_t *length,
                         wm_error *err) {
  static const wm_recording_overrides kNone;
  for (size_t i = 0; i < count; i++)
    if (edits[i].is_config) return edited("", &kNone, &edits[i], edits, count, comment, text, length, err);
  *text = NULL;
  return WM_OK;
}

// The files that the configuration names, by paths that hold in another folder.
static wm_status name_files(const wm_recording_overrides *files, char **text, size_t *length, wm_error *err) {
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < NAMED_COUNT; i++) {
    const char *named = (const char *)files + kNamed[i].offset;
    char *real = named[0] ? realpath(named, NULL) : NULL, *fresh, quoted[WM_PATH_MAX + 2];
    if (!real) continue;
    (void)snprintf(quoted, sizeof quoted, "\"%s\"", real);
    free(real);
    status = wm_yaml_edit(*text, *length, kNamed[i].key, quoted, "", &fresh, length, err);
    if (status != WM_OK) break;
    free(*text);
    *text = fresh;
  }
  return status;
}

wm_status changed_copy_config(const changed_copy *self, const wm_config *config, const file_edit *edits, size_t count,
                              const char *comment, char written[WM_PATH_MAX], wm_error *err) {
  char *text;
  size_t length;
  const char *slash = strrchr(config->path, '/');
  written[0] = '\0';
  wm_status status = changed_config(edits, count, comment, &text, &length, err);
  int is_renamed = 0;
  for (size_t i = 0; i < NAMED_COUNT; i++)
    is_renamed |= strcmp((const char *)&self->overrides + kNamed[i].offset,
                         (const char *)&config->overrides + kNamed[i].offset) != 0;
  if (status == WM_OK && !text && is_renamed)
    status = wm_text_read_file(config->path, FILE_BYTES_MAX, &text, &length, err);
  if (status != WM_OK || !text) return status;
  status = name_files(&self->overrides, &text, &length, err);
  if (status == WM_OK) status = path_in(self->out, slash ? slash + 1 : config->path, written, err);
  if (status == WM_OK) status = write_text(written, text, length, err);
  free(text);
  return status;
}

static void remove_entries(const char *dir) {
  char path[WM_PATH_MAX];
  DIR *all = opendir(dir);
  if (!all) return;
  for (const struct dirent *e; (e = readdir(all)) != NULL;) {
    if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
    if (path_in(dir, e->d_name, path, NULL) != WM_OK || unlink(path) == 0) continue;
    remove_entries(path);  // one of the copy's own folders: those of the recording are links
  }
  (void)closedir(all);
  (void)rmdir(dir);
}

void changed_copy_remove(const changed_copy *self) { remove_entries(self->out); }

// ── texts ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static void first_difference(const char *before, const char *after, int *line, const char **at, int *length) {
  const char *begin = after;
  *line = 1;
  while (*after && *before == *after) {
    if (*after == '\n') {
      ++*line;
      begin = after + 1;
    }
    before++;
    after++;
  }
  *at = begin + strspn(begin, " \t");
  *length = (int)strcspn(*at, "\r\n");
}

#define LINE_SHOWN_MAX 90

static int write_change(const file_edit *edit, const char *before, const char *after, int is_first, char *out,
                        size_t capacity) {
  char words[240];
  const char *at, *dot = strrchr(edit->name, '.');
  int line, shown;
  edit_words(edit, words, sizeof words);
  first_difference(before, after, &line, &at, &shown);
  const char *comma = is_first ? "" : "; ";
  if (edit->kind == EDIT_VALUE)
    return snprintf(out, capacity, "%s%s:%d: `%s: %s`", comma, edit->file, line, dot ? dot + 1 : edit->name,
                    edit->text);
  if (edit->kind == EDIT_IDS || edit->kind == EDIT_MIRROR)
    return snprintf(out, capacity, "%s%s: %s", comma, edit->file, words);
  return snprintf(out, capacity, "%s%s:%d: %s%s`%.*s`%s", comma, edit->file, line, words, words[0] ? ": " : "",
                  shown < LINE_SHOWN_MAX ? shown : LINE_SHOWN_MAX, at, words[0] ? " and so each row" : "");
}

void changed_lines(const char *dir, const wm_recording_overrides *overrides, const file_edit *edits, size_t count,
                   char *out, size_t capacity) {
  size_t used = 0;
  out[0] = '\0';
  for (size_t i = 0; i < count && used < capacity; i++) {
    char *before, *after;
    size_t length;
    if (edits[i].is_optional || read_original(dir, overrides, &edits[i], &before, &length, NULL) != WM_OK) continue;
    if (edit_text(&edits[i], before, length, "", &after, &length, NULL) == WM_OK) {
      char *ended = realloc(after, length + 1);
      if (ended) {
        after = ended;
        after[length] = '\0';
        const int n = write_change(&edits[i], before, after, used == 0, out + used, capacity - used);
        used += n > 0 ? (size_t)n : 0;
      }
    }
    free(after);
    free(before);
  }
}
