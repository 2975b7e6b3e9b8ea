// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <string.h>
#include <unistd.h>

#include <wm_version.h>
#include "output/crc32.h"
#include "output/event_log.h"
#include "output/new_file.h"
#include "waymark/bytes.h"

static const char kMagic[8] = {'W', 'M', 'L', 'O', 'G', ' ', '2', '\n'};

static void write_all(wm_log_writer *self, const void *bytes, size_t count) {
  if (self->failed || count == 0) return;
  if (fwrite(bytes, 1, count, self->file) != count) self->failed = errno ? errno : EIO;
}

static void write_record(wm_log_writer *self, wm_log_tag tag, const void *content, size_t count) {
  uint8_t tag_byte = (uint8_t)tag;
  uint32_t crc = crc32_of(crc32_of(0, &tag_byte, 1), content, count);
  uint8_t head[9];
  wm_writer w = wm_writer_of(head, sizeof head);
  wm_put_u32(&w, (uint32_t)count + 1);
  wm_put_u32(&w, crc);
  wm_put_u8(&w, tag_byte);
  write_all(self, head, sizeof head);
  write_all(self, content, count);
}

static void write_text(wm_log_writer *self, wm_log_tag tag, const char *text) {
  write_record(self, tag, text, strlen(text));
}

static void write_u64(wm_log_writer *self, wm_log_tag tag, uint64_t value) {
  uint8_t bytes[8];
  wm_writer w = wm_writer_of(bytes, sizeof bytes);
  wm_put_u64(&w, value);
  write_record(self, tag, bytes, sizeof bytes);
}

static void write_setup(wm_log_writer *self, const wm_setup *setup) {
  uint8_t bytes[WM_RIG_ENCODED_MAX];
  write_record(self, WM_LOG_WHEELS, bytes, wm_wheels_encode(&setup->wheels, bytes, sizeof bytes));
  write_record(self, WM_LOG_START, bytes, wm_start_encode(&setup->start, bytes, sizeof bytes));
  for (size_t i = 0; i < setup->sensor_count; i++)
    write_record(self, WM_LOG_SENSOR, bytes, wm_sensor_encode(&setup->sensors[i], bytes, sizeof bytes));
  for (size_t i = 0; i < setup->landmark_count; i++)
    write_record(self, WM_LOG_LANDMARK, bytes, wm_landmark_encode(&setup->landmarks[i], bytes, sizeof bytes));
  if (setup->rig) write_record(self, WM_LOG_RIG, bytes, wm_rig_encode(setup->rig, bytes, sizeof bytes));
  write_u64(self, WM_LOG_LANDMARK_HASH, wm_landmarks_hash(setup->landmarks, setup->landmark_count));
}

static void write_map(wm_log_writer *self, const wm_assembly *assembly) {
  const wm_raster *map = assembly->setup.map;
  if (!map) return;
  write_u64(self, WM_LOG_MAP_HASH, map->hash);
  if (assembly->map_path) write_text(self, WM_LOG_MAP_PATH, assembly->map_path);
}

static void write_building(wm_log_writer *self, const wm_assembly *assembly) {
  const wm_building *b = assembly->building;
  uint8_t bytes[WM_RIG_ENCODED_MAX];
  if (!b) return;
  for (size_t i = 0; i < b->plan.count; i++) write_text(self, WM_LOG_FLOOR, b->floors[i].name);
  for (size_t i = 0; i < b->plan.count; i++)
    for (size_t k = 0; k < b->floors[i].landmark_count; k++) {
      wm_writer w = wm_writer_of(bytes, sizeof bytes);
      wm_put_u32(&w, (uint32_t)i);
      const size_t used = wm_landmark_encode(&b->floors[i].landmarks[k], bytes + w.used, sizeof bytes - w.used);
      write_record(self, WM_LOG_FLOOR_LANDMARK, bytes, w.used + used);
    }
  for (size_t i = 0; i < b->plan.end_count; i++) {
    const wm_floor_end *e = &b->ends[i];
    wm_writer w = wm_writer_of(bytes, sizeof bytes);
    wm_put_u32(&w, (uint32_t)e->floor);
    wm_put_u32(&w, (uint32_t)e->connection);
    wm_put_u32(&w, (uint32_t)e->kind);
    const double numbers[] = {e->x_m, e->y_m, e->heading_rad, e->radius_m};
    wm_put_f64s(&w, numbers, 4);
    write_record(self, WM_LOG_FLOOR_END, bytes, w.used);
  }
  write_u64(self, WM_LOG_START_FLOOR, (uint64_t)((int64_t)assembly->start_floor + 1));
}

static void write_sources(wm_log_writer *self, const wm_assembly *assembly) {
  uint8_t bytes[4 + WM_SOURCE_NAME_MAX];
  wm_writer w = wm_writer_of(bytes, sizeof bytes);
  wm_put_u32(&w, assembly->driving.kinds);
  wm_put_u32(&w, assembly->driving.quantities);
  write_record(self, WM_LOG_DRIVING, bytes, w.used);
  for (size_t i = 0; i < assembly->source_count; i++) {
    w = wm_writer_of(bytes, sizeof bytes);
    wm_put_u32(&w, assembly->sources[i].kinds);
    wm_put_bytes(&w, assembly->sources[i].name, strlen(assembly->sources[i].name));
    write_record(self, WM_LOG_SOURCE, bytes, w.used);
  }
}

wm_status wm_log_create(wm_log_writer *self, const char *path, const wm_assembly *assembly, wm_error *err) {
  self->events = 0;
  self->failed = 0;
  self->file = new_file(path);
  if (!self->file) return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  setvbuf(self->file, self->buffer, _IOFBF, sizeof self->buffer);

  const wm_config *config = assembly->config;
  write_all(self, kMagic, sizeof kMagic);
  write_text(self, WM_LOG_PROGRAM, WM_VERSION);
  write_text(self, WM_LOG_ESTIMATOR, config->estimator->name);
  write_text(self, WM_LOG_RECORDING, assembly->recording);
  write_u64(self, WM_LOG_SEED, assembly->setup.seed);
  write_text(self, WM_LOG_CONFIG_PATH, config->path);
  write_record(self, WM_LOG_CONFIG, config->text, config->text_length);
  write_record(self, WM_LOG_CALIBRATION, assembly->calibration_text, assembly->calibration_length);
  write_setup(self, &assembly->setup);
  write_map(self, assembly);
  write_building(self, assembly);
  write_sources(self, assembly);
  if (assembly->decoder[0]) write_text(self, WM_LOG_DECODER, assembly->decoder);
  if (assembly->kept) write_record(self, WM_LOG_KEPT, assembly->kept, assembly->kept_bytes);
  write_record(self, WM_LOG_HEAD_END, "", 0);
  return WM_OK;
}

void wm_log_write_event(wm_log_writer *self, const wm_event *event) {
  uint8_t bytes[WM_EVENT_ENCODED_MAX];
  write_record(self, WM_LOG_EVENT, bytes, wm_event_encode(event, bytes, sizeof bytes));
  self->events++;
}

void wm_log_write_gap(wm_log_writer *self, uint64_t missing) { write_u64(self, WM_LOG_GAP, missing); }

void wm_log_flush(wm_log_writer *self) {
  if (!self->failed && fflush(self->file) != 0) self->failed = errno ? errno : EIO;
}

wm_status wm_log_close(wm_log_writer *self, wm_error *err) {
  if (!self->file) return WM_OK;
  write_u64(self, WM_LOG_CLOSED, self->events);
  wm_log_flush(self);
  // To the disk. What is no file (a pipe) has none.
  if (!self->failed && fdatasync(fileno(self->file)) != 0 && errno != EINVAL) self->failed = errno;
  if (fclose(self->file) != 0 && !self->failed) self->failed = errno ? errno : EIO;
  self->file = NULL;
  if (self->failed)
    return wm_fail(err, WM_IO, "events.wmlog: could not be written completely: %s", strerror(self->failed));
  return WM_OK;
}
