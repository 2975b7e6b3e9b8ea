// SPDX-License-Identifier: Apache-2.0
#include "output/saved_map.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "output/crc32.h"
#include "output/replace_file.h"
#include "waymark/bytes.h"
#include "waymark/codec.h"
#include "waymark/keeper.h"

#define MAGIC "WMMAP 1\n"
#define HEAD_BYTES 44  // magic 8, hashes 16, UTC 8, bytes 8, CRC 4

// ── what it belongs to ──────────────────────────────────────────────────────────────────────────────────────────────

static int is_default(const wm_param *param, const char *value) {
  double real;
  int32_t whole;
  if (param->type == WM_PARAM_F64) return memcpy(&real, value, sizeof real), real == param->initial;
  memcpy(&whole, value, sizeof whole);
  return whole == (int32_t)param->initial;
}

// Of those that are not the defaults: a later version has parameters that this one does not know.
static uint64_t hash_params(uint64_t hash, const wm_param_table *table, const void *values, const char *prefix,
                            const wm_estimator *reader) {
  for (size_t i = 0; i < table->count; i++) {
    const wm_param *param = &table->params[i];
    char key[160];
    (void)snprintf(key, sizeof key, "%s%s", prefix, param->key);
    if (reader && !wm_estimator_reads(reader, key)) continue;
    const char *const value = (const char *)values + param->offset;
    if (is_default(param, value)) continue;
    hash = wm_hash(hash, key, strlen(key) + 1);
    hash = wm_hash(hash, value, param->type == WM_PARAM_F64 ? sizeof(double) : sizeof(int32_t));
  }
  return hash;
}

wm_map_identity wm_map_identity_of(const wm_config *config, const wm_setup *setup) {
  const wm_estimator *e = config->estimator;
  wm_map_identity out = {.configuration = wm_hash(0, e->name, strlen(e->name) + 1)};
  out.configuration = hash_params(out.configuration, &e->params, config->estimator_params, "", NULL);
  for (int i = 0; i < WM_CONFIG_SHARED; i++) {
    const wm_shared_section *const s = &wm_config_shared[i];
    out.configuration = hash_params(out.configuration, s->table, wm_config_params(config, i), s->prefix, e);
  }
  uint8_t bytes[WM_RIG_ENCODED_MAX];
  uint64_t hash = wm_landmarks_hash(setup->landmarks, setup->landmark_count);
  hash = wm_hash(hash, bytes, wm_wheels_encode(&setup->wheels, bytes, sizeof bytes));
  for (size_t i = 0; i < setup->sensor_count; i++)
    hash = wm_hash(hash, bytes, wm_sensor_encode(&setup->sensors[i], bytes, sizeof bytes));
  if (setup->rig) hash = wm_hash(hash, bytes, wm_rig_encode(setup->rig, bytes, sizeof bytes));
  out.calibration = hash;
  return out;
}

// ── writing ─────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status wm_saved_map_write(const char *path, const wm_map_identity *of, double utc_s, const void *image, size_t bytes,
                             wm_error *err) {
  uint8_t head[HEAD_BYTES];
  if (bytes > WM_SAVED_MAP_BYTES_MAX)
    return wm_fail(err, WM_FULL, "%s: the map of now has %.0f MB, more than a saved map may have (%.0f MB)", path,
                   (double)bytes * 1e-6, (double)WM_SAVED_MAP_BYTES_MAX * 1e-6);
  wm_writer w = wm_writer_of(head, sizeof head);
  wm_put_bytes(&w, MAGIC, sizeof MAGIC - 1);
  wm_put_u64(&w, of->configuration);
  wm_put_u64(&w, of->calibration);
  wm_put_f64(&w, utc_s);
  wm_put_u64(&w, bytes);
  wm_put_u32(&w, crc32_of(crc32_of(0, head, w.used), image, bytes));
  const file_part parts[] = {{head, w.used}, {image, bytes}};
  return replace_file(path, parts, 2, err);
}

// ── reading ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status refuse(wm_error *err, const char *path, const char *why) {
  return wm_fail(err, WM_BAD_DATA, "%s: %s", path, why);
}

static int read_all(int fd, void *out, size_t bytes) {
  for (char *at = out; bytes > 0;) {
    ssize_t got = read(fd, at, bytes);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return 0;
    at += got;
    bytes -= (size_t)got;
  }
  return 1;
}

static wm_status read_image(int fd, const char *path, const wm_map_identity *wanted, wm_saved_map *out, wm_error *err) {
  uint8_t head[HEAD_BYTES];
  char magic[sizeof MAGIC - 1];
  struct stat file;
  if (fstat(fd, &file) != 0 || !read_all(fd, head, sizeof head)) return refuse(err, path, "it is truncated");
  wm_reader r = wm_reader_of(head, sizeof head);
  wm_get_bytes(&r, magic, sizeof magic);
  const uint64_t configuration = wm_get_u64(&r), calibration = wm_get_u64(&r);
  out->utc_s = wm_get_f64(&r);
  const uint64_t bytes = wm_get_u64(&r);
  const size_t before_crc = r.used;
  const uint32_t crc = wm_get_u32(&r);
  if (memcmp(magic, MAGIC, 6) != 0) return refuse(err, path, "it is not a saved map");
  if (memcmp(magic, MAGIC, sizeof magic) != 0) return refuse(err, path, "it was written by another version");
  if (bytes > WM_SAVED_MAP_BYTES_MAX || (uint64_t)file.st_size != bytes + HEAD_BYTES)
    return refuse(err, path, "it is truncated");
  out->bytes = (size_t)bytes;
  out->image = malloc(out->bytes + 1);
  if (!out->image) return wm_fail(err, WM_IO, "%s: no memory for it", path);
  if (!read_all(fd, out->image, out->bytes)) return refuse(err, path, "it is truncated");
  if (crc32_of(crc32_of(0, head, before_crc), out->image, out->bytes) != crc)
    return refuse(err, path, "its checksum is wrong: it is damaged");
  if (configuration != wanted->configuration)
    return refuse(err, path, "it was made with another configuration (estimator or parameters)");
  if (calibration != wanted->calibration)
    return refuse(err, path, "it was made with another calibration (sensors, wheels, cameras or given landmarks)");
  return WM_OK;
}

wm_status wm_saved_map_read(const char *path, const wm_config *config, const wm_setup *setup, wm_saved_map *out,
                            wm_error *err) {
  memset(out, 0, sizeof *out);
  const wm_keeper *keeper = wm_keeper_of(config->estimator);
  if (!keeper) return wm_fail(err, WM_UNSUPPORTED, "%s: estimator %s makes no map", path, config->estimator->name);
  const wm_map_identity wanted = wm_map_identity_of(config, setup);
  int fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) return wm_fail(err, WM_NOT_FOUND, "%s: is not there", path);
  if (fd < 0) return wm_fail(err, WM_IO, "%s: can't be read: %s", path, strerror(errno));
  wm_status status = read_image(fd, path, &wanted, out, err);
  (void)close(fd);
  const char *why = status == WM_OK ? keeper->why_not(config->estimator_params, setup, out->image, out->bytes) : NULL;
  if (why) status = refuse(err, path, why);
  if (status == WM_OK) return WM_OK;
  free(out->image);
  memset(out, 0, sizeof *out);
  return status;
}
