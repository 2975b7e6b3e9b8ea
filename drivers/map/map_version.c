// SPDX-License-Identifier: Apache-2.0
// Versions of a site (waymark/floors.h). version.yaml:
//
//   format: waymark-site-version/1
//   base: NAME                 # left out in the first one
//   date: 2026-11-30T09:00:00.000Z
//   author: TEXT
//   note: TEXT
//   files:
//     FILE: HASH
//   # seal HASH                # of all the bytes above
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "waymark/codec.h"
#include "waymark/floors.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define RECORD_BYTES_MAX (1u << 22)  // 30000 files
#define HASH_DIGITS (WM_MAP_VERSION_NAME - 1)
#define SEAL "# seal "
#define SEAL_BYTES (sizeof SEAL - 1 + HASH_DIGITS + 1)  // with its line feed

static const char *const kKeys[] = {"format", "base", "date", "author", "note", "files", NULL};

static int is_name(const char *text) {
  size_t digits = 0;
  while (isdigit((unsigned char)text[digits]) || (text[digits] >= 'a' && text[digits] <= 'f')) digits++;
  return digits == HASH_DIGITS && text[digits] == '\0';
}

static void put_hash(uint64_t hash, char out[WM_MAP_VERSION_NAME]) {
  (void)snprintf(out, WM_MAP_VERSION_NAME, "%016" PRIx64, hash);
}

wm_status wm_file_hash(const char *path, uint64_t *out, wm_error *err) {
  uint8_t bytes[1 << 14];
  FILE *file = fopen(path, "rbe");
  if (!file) return wm_fail(err, WM_NOT_FOUND, "%s: can't be read", path);
  *out = WM_HASH_START;
  for (size_t got; (got = fread(bytes, 1, sizeof bytes, file)) > 0;) *out = wm_hash(*out, bytes, got);
  const int failed = ferror(file);
  (void)fclose(file);
  return failed ? wm_fail(err, WM_IO, "%s: can't be read to its end", path) : WM_OK;
}

uint64_t wm_map_version_seal(const char *text, size_t length) { return wm_hash(WM_HASH_START, text, length); }

void wm_map_version_name(const wm_map_version *version, char out[WM_MAP_VERSION_NAME]) {
  uint64_t hash = WM_HASH_START;
  for (size_t i = 0; i < version->file_count; i++) {
    char digits[WM_MAP_VERSION_NAME];
    put_hash(version->files[i].hash, digits);
    hash = wm_hash(hash, version->files[i].path, strlen(version->files[i].path) + 1);
    hash = wm_hash(hash, digits, sizeof digits);
  }
  put_hash(hash, out);
}

wm_status wm_map_version_current(const char *folder, char out[WM_MAP_VERSION_NAME], wm_error *err) {
  char path[WM_PATH_MAX], *text;
  size_t length;
  out[0] = '\0';
  if (snprintf(path, sizeof path, "%s/versions/current", folder) >= WM_PATH_MAX)
    return wm_fail(err, WM_BAD_USAGE, "%s: the path is too long", folder);
  if (access(path, F_OK) != 0) return WM_OK;
  wm_status status = wm_text_read_file(path, 64, &text, &length, err);
  if (status != WM_OK) return status;
  while (length > 0 && isspace((unsigned char)text[length - 1])) text[--length] = '\0';
  if (is_name(text))
    memcpy(out, text, WM_MAP_VERSION_NAME);
  else
    status = wm_fail(err, WM_BAD_DATA,
                     "%s: is damaged: it has no name of a version; `waymark map version %s --use NAME` writes it", path,
                     folder);
  free(text);
  return status;
}

static wm_status read_text(const wm_yaml_node *root, const char *key, char *out, size_t capacity, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(root, key);
  out[0] = '\0';
  return wm_yaml_there(&node) ? wm_yaml_string(&node, out, capacity, err) : WM_OK;
}

static wm_status read_files(const wm_yaml_node *root, wm_map_version *out, wm_error *err) {
  wm_yaml_node files = wm_yaml_get(root, "files");
  out->file_count = wm_yaml_count(&files);
  if (!wm_yaml_is_map(&files) || out->file_count == 0) return wm_yaml_fail(root, err, "files: {FILE: HASH} is needed");
  out->files = calloc(out->file_count, sizeof *out->files);
  if (!out->files) return wm_fail(err, WM_IO, "%s: no memory to read it", wm_yaml_file(root));
  for (size_t i = 0; i < out->file_count; i++) {
    const char *path;
    char digits[64];
    wm_yaml_node value = wm_yaml_value(&files, i, &path, NULL);
    wm_status status = wm_yaml_string(&value, digits, sizeof digits, err);
    if (status != WM_OK) return status;
    if (!is_name(digits) || path[0] == '/' || strstr(path, ".."))
      return wm_yaml_fail(&value, err, "'%s: %s' is no file with its hash", path, digits);
    (void)snprintf(out->files[i].path, sizeof out->files[i].path, "%s", path);
    out->files[i].hash = strtoull(digits, NULL, 16);
  }
  return WM_OK;
}

static wm_status read_record(const wm_yaml_node *root, wm_map_version *out, wm_error *err) {
  static const char *const kFormats[] = {"waymark-site-version/1", NULL};
  int32_t chosen;
  wm_yaml_node format = wm_yaml_get(root, "format");
  wm_status status = wm_yaml_choice(&format, kFormats, &chosen, err);
  if (status == WM_OK) status = wm_yaml_check_keys(root, kKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK) status = read_text(root, "base", out->base, sizeof out->base, err);
  if (status == WM_OK) status = read_text(root, "date", out->date, sizeof out->date, err);
  if (status == WM_OK) status = read_text(root, "author", out->author, sizeof out->author, err);
  if (status == WM_OK) status = read_text(root, "note", out->note, sizeof out->note, err);
  return status == WM_OK ? read_files(root, out, err) : status;
}

static wm_status check_seal(const char *path, const char *text, size_t length, wm_error *err) {
  char line[SEAL_BYTES + 1] = "", digits[WM_MAP_VERSION_NAME];
  if (length > SEAL_BYTES) {
    put_hash(wm_map_version_seal(text, length - SEAL_BYTES), digits);
    (void)snprintf(line, sizeof line, SEAL "%s\n", digits);
  }
  if (line[0] && memcmp(text + length - SEAL_BYTES, line, SEAL_BYTES) == 0) return WM_OK;
  return wm_fail(err, WM_BAD_DATA, "%s: is damaged: its seal does not fit; use another version", path);
}

// Each file with the hash that the record has for it, and the record with its name.
static wm_status check_files(const char *folder, const char *name, const wm_map_version *version, wm_error *err) {
  char path[2 * WM_PATH_MAX], is[WM_MAP_VERSION_NAME];
  uint64_t hash;
  wm_map_version_name(version, is);
  if (strcmp(is, name) != 0)
    return wm_fail(err, WM_BAD_DATA, "%s/versions/%s: is not the version of its name, but %s: copy it anew", folder,
                   name, is);
  for (size_t i = 0; i < version->file_count; i++) {
    (void)snprintf(path, sizeof path, "%s/versions/%s/%s", folder, name, version->files[i].path);
    const wm_status status = wm_file_hash(path, &hash, err);
    if (status != WM_OK) return status;
    if (hash != version->files[i].hash)
      return wm_fail(err, WM_BAD_DATA,
                     "%s: was changed or is damaged: its hash is not the version's. Copy the version anew, or take "
                     "another one (waymark map version %s --use NAME)",
                     path, folder);
  }
  return WM_OK;
}

wm_status wm_map_version_read(const char *folder, const char *name, wm_map_version *out, wm_error *err) {
  char path[WM_PATH_MAX], *text;
  size_t length;
  wm_yaml *doc = NULL;
  memset(out, 0, sizeof *out);
  if (!is_name(name))
    return wm_fail(err, WM_BAD_USAGE, "'%s' is no name of a version: %d hexadecimal digits", name, HASH_DIGITS);
  memcpy(out->name, name, sizeof out->name);
  if (snprintf(path, sizeof path, "%s/versions/%s/version.yaml", folder, name) >= WM_PATH_MAX)
    return wm_fail(err, WM_BAD_USAGE, "%s: the path is too long", folder);
  wm_status status = wm_text_read_file(path, RECORD_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = check_seal(path, text, length, err);
  if (status == WM_OK) status = wm_yaml_parse(text, length, path, &doc, err);
  if (status == WM_OK) {
    const wm_yaml_node root = wm_yaml_root(doc);
    status = read_record(&root, out, err);
    wm_yaml_free(doc);
  }
  free(text);
  return status == WM_OK ? check_files(folder, name, out, err) : status;
}
