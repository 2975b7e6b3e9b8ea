// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "output/crc32.h"
#include "output/event_log.h"
#include "waymark/bytes.h"

#define MAGIC "WMLOG 2\n"
#define RECORD_MAX (UINT32_C(256) << 20)  // a saved map of 7500 states, the largest record

struct wm_log_reader {
  FILE *file;
  char path[WM_PATH_MAX];
  uint64_t offset;  // of the record being read
  uint8_t *content;
  size_t capacity;
  wm_log_head head;
  wm_sensor *sensors;
  wm_landmark *landmarks;
  size_t sensor_capacity, landmark_capacity;
  wm_landmark *floor_landmarks;  // of all floors, one floor behind the other
  size_t floor_landmark_count, floor_landmark_capacity;
  size_t landmarks_on[WM_FLOORS_MAX];
  char *config_text, *calibration_text;
  void *kept;
  uint64_t events;
  int closed, saw_wheels, saw_start, saw_hash;
};

typedef struct record {
  uint8_t tag;
  const uint8_t *content;
  size_t count;
} record;

static wm_status bad(const wm_log_reader *self, wm_error *err, const char *what) {
  return wm_fail(err, WM_BAD_DATA, "%s: byte %llu: %s", self->path, (unsigned long long)self->offset, what);
}

static wm_status reserve(wm_log_reader *self, size_t bytes, wm_error *err) {
  if (bytes <= self->capacity) return WM_OK;
  uint8_t *larger = realloc(self->content, bytes);
  if (!larger) return wm_fail(err, WM_IO, "%s: no memory for a record of %zu bytes", self->path, bytes);
  self->content = larger;
  self->capacity = bytes;
  return WM_OK;
}

int wm_log_is_closed(const char *path) {
  uint8_t bytes[4 + 4 + 1 + 8];  // length, checksum, tag, count
  FILE *file = fopen(path, "rbe");
  if (!file) return 0;
  const int is_read =
      fseek(file, -(long)sizeof bytes, SEEK_END) == 0 && fread(bytes, 1, sizeof bytes, file) == sizeof bytes;
  (void)fclose(file);
  wm_reader r = wm_reader_of(bytes, sizeof bytes);
  const uint32_t length = wm_get_u32(&r), crc = wm_get_u32(&r);
  return is_read && length == sizeof bytes - 8 && bytes[8] == WM_LOG_CLOSED && crc32_of(0, bytes + 8, length) == crc;
}

// WM_END at the end of the file, *cut where that is within a record.
static wm_status read_record(wm_log_reader *self, record *out, int *cut, wm_error *err) {
  uint8_t head[8];
  size_t got = fread(head, 1, sizeof head, self->file);
  *cut = got > 0;
  if (got < sizeof head) return WM_END;
  wm_reader r = wm_reader_of(head, sizeof head);
  uint32_t length = wm_get_u32(&r), crc = wm_get_u32(&r);
  if (length == 0 && crc == 0) {  // after a power loss a file system may leave zeros at the end
    *cut = 1;
    return WM_END;
  }
  if (length == 0 || length > RECORD_MAX)
    return bad(self, err, "a record of an impossible length; the file is damaged");
  wm_status status = reserve(self, length, err);
  if (status != WM_OK) return status;
  if (fread(self->content, 1, length, self->file) < length) return WM_END;
  *cut = 0;
  if (crc32_of(0, self->content, length) != crc)
    return bad(self, err, "the record's checksum is wrong; the file is damaged here and valid before");
  self->offset += sizeof head + length;
  *out = (record){.tag = self->content[0], .content = self->content + 1, .count = length - 1};
  return WM_OK;
}

// ── the head ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void get_text(char *out, size_t capacity, const record *r) {
  size_t n = r->count < capacity - 1 ? r->count : capacity - 1;
  memcpy(out, r->content, n);
  out[n] = '\0';
}

static char *copy_text(const record *r) {
  char *text = malloc(r->count + 1);
  if (text) {
    memcpy(text, r->content, r->count);
    text[r->count] = '\0';
  }
  return text;
}

// The next element of a growing array, or NULL without memory.
static void *grow(void *array, size_t count, size_t *capacity, size_t item_bytes) {
  if (count < *capacity) return array;
  size_t larger = *capacity ? *capacity * 2 : 64;
  void *grown = realloc(array, larger * item_bytes);
  if (grown) *capacity = larger;
  return grown;
}

static wm_status take_sensor(wm_log_reader *self, const record *r, wm_error *err) {
  wm_log_head *h = &self->head;
  wm_sensor *grown = grow(self->sensors, h->sensor_count, &self->sensor_capacity, sizeof *grown);
  if (!grown) return wm_fail(err, WM_IO, "%s: no memory for its sensors", self->path);
  self->sensors = grown;
  h->sensors = grown;
  size_t used;
  if (wm_sensor_decode(r->content, r->count, &grown[h->sensor_count], &used) != WM_OK)
    return bad(self, err, "a sensor that can't be read");
  h->sensor_count++;
  return WM_OK;
}

static wm_status take_landmark(wm_log_reader *self, const record *r, wm_error *err) {
  wm_log_head *h = &self->head;
  wm_landmark *grown = grow(self->landmarks, h->landmark_count, &self->landmark_capacity, sizeof *grown);
  if (!grown) return wm_fail(err, WM_IO, "%s: no memory for its landmarks", self->path);
  self->landmarks = grown;
  h->landmarks = grown;
  size_t used;
  if (wm_landmark_decode(r->content, r->count, &grown[h->landmark_count], &used) != WM_OK)
    return bad(self, err, "a landmark that can't be read");
  h->landmark_count++;
  return WM_OK;
}

static wm_status take_floor(wm_log_reader *self, const record *r, wm_error *err) {
  char name[WM_NAME_MAX];
  wm_status status = WM_OK;
  if (!self->head.building) status = wm_building_make(NULL, &self->head.building, err);
  get_text(name, sizeof name, r);
  return status == WM_OK ? wm_building_add_floor(self->head.building, name, err) : status;
}

// In the order of the floors.
static wm_status take_floor_landmark(wm_log_reader *self, const record *r, wm_error *err) {
  wm_reader bytes = wm_reader_of(r->content, r->count);
  const uint32_t floor = wm_get_u32(&bytes);
  if (bytes.bad || !self->head.building || floor >= self->head.building->plan.count)
    return bad(self, err, "a landmark of a floor that the head doesn't name");
  for (size_t i = floor + 1; i < WM_FLOORS_MAX; i++)
    if (self->landmarks_on[i] > 0) return bad(self, err, "landmarks out of the order of their floors");
  wm_landmark *grown =
      grow(self->floor_landmarks, self->floor_landmark_count, &self->floor_landmark_capacity, sizeof *grown);
  if (!grown) return wm_fail(err, WM_IO, "%s: no memory for its landmarks", self->path);
  self->floor_landmarks = grown;
  size_t used;
  if (wm_landmark_decode(r->content + bytes.used, r->count - bytes.used, &grown[self->floor_landmark_count], &used) !=
      WM_OK)
    return bad(self, err, "a landmark that can't be read");
  self->floor_landmark_count++;
  self->landmarks_on[floor]++;
  return WM_OK;
}

static wm_status take_floor_end(wm_log_reader *self, const record *r, wm_error *err) {
  wm_reader bytes = wm_reader_of(r->content, r->count);
  wm_floor_end end = {0};
  end.floor = (int32_t)wm_get_u32(&bytes);
  end.connection = (int32_t)wm_get_u32(&bytes);
  end.kind = (int32_t)wm_get_u32(&bytes);
  end.x_m = wm_get_f64(&bytes);
  end.y_m = wm_get_f64(&bytes);
  end.heading_rad = wm_get_f64(&bytes);
  end.radius_m = wm_get_f64(&bytes);
  if (bytes.bad || !self->head.building) return bad(self, err, "an end of a connection that can't be read");
  return wm_building_add_end(self->head.building, &end, err);
}

static void give_landmarks(wm_log_reader *self) {
  wm_building *b = self->head.building;
  const wm_landmark *at = self->floor_landmarks;
  for (size_t i = 0; b && i < b->plan.count; at += self->landmarks_on[i++]) {
    b->floors[i].landmarks = at;
    b->floors[i].landmark_count = self->landmarks_on[i];
  }
}

static wm_status take_source(wm_log_reader *self, const record *r, wm_error *err) {
  wm_log_head *h = &self->head;
  wm_reader bytes = wm_reader_of(r->content, r->count);
  uint32_t kinds = wm_get_u32(&bytes);
  if (bytes.bad || h->source_count == WM_SOURCES_MAX) return bad(self, err, "a source that can't be read");
  record name = {.content = r->content + bytes.used, .count = r->count - bytes.used};
  get_text(h->sources[h->source_count].name, sizeof h->sources[0].name, &name);
  h->sources[h->source_count++].kinds = kinds;
  return WM_OK;
}

static wm_status take_head_record(wm_log_reader *self, const record *r, wm_error *err) {
  wm_log_head *h = &self->head;
  wm_reader bytes = wm_reader_of(r->content, r->count);
  size_t used;
  switch ((wm_log_tag)r->tag) {
    case WM_LOG_PROGRAM: get_text(h->program, sizeof h->program, r); break;
    case WM_LOG_ESTIMATOR: get_text(h->estimator, sizeof h->estimator, r); break;
    case WM_LOG_RECORDING: get_text(h->recording, sizeof h->recording, r); break;
    case WM_LOG_CONFIG_PATH: get_text(h->config_path, sizeof h->config_path, r); break;
    case WM_LOG_MAP_PATH: get_text(h->map_path, sizeof h->map_path, r); break;
    case WM_LOG_DECODER: get_text(h->decoder, sizeof h->decoder, r); break;
    case WM_LOG_SEED: h->seed = wm_get_u64(&bytes); break;
    case WM_LOG_LANDMARK_HASH:
      h->landmark_hash = wm_get_u64(&bytes);
      self->saw_hash = 1;
      break;
    case WM_LOG_CONFIG:
      free(self->config_text);
      h->config_text = self->config_text = copy_text(r);
      h->config_length = r->count;
      break;
    case WM_LOG_CALIBRATION:
      free(self->calibration_text);
      h->calibration_text = self->calibration_text = copy_text(r);
      h->calibration_length = r->count;
      break;
    case WM_LOG_WHEELS:
      self->saw_wheels = 1;
      if (wm_wheels_decode(r->content, r->count, &h->wheels, &used) != WM_OK) bytes.bad = 1;
      break;
    case WM_LOG_RIG:
      if (wm_rig_decode(r->content, r->count, &h->rig, &used) != WM_OK) bytes.bad = 1;
      break;
    case WM_LOG_MAP_HASH: h->map_hash = wm_get_u64(&bytes); break;
    case WM_LOG_START:
      self->saw_start = 1;
      if (wm_start_decode(r->content, r->count, &h->start, &used) != WM_OK) bytes.bad = 1;
      break;
    case WM_LOG_DRIVING:
      h->driving.kinds = wm_get_u32(&bytes);
      h->driving.quantities = wm_get_u32(&bytes);
      break;
    case WM_LOG_SENSOR: return take_sensor(self, r, err);
    case WM_LOG_LANDMARK: return take_landmark(self, r, err);
    case WM_LOG_SOURCE: return take_source(self, r, err);
    case WM_LOG_FLOOR: return take_floor(self, r, err);
    case WM_LOG_FLOOR_LANDMARK: return take_floor_landmark(self, r, err);
    case WM_LOG_FLOOR_END: return take_floor_end(self, r, err);
    case WM_LOG_START_FLOOR: h->start_floor = (int)wm_get_u64(&bytes) - 1; break;
    case WM_LOG_KEPT:
      free(self->kept);
      h->kept = self->kept = copy_text(r);
      h->kept_bytes = r->count;
      break;
    case WM_LOG_HEAD_END:
    case WM_LOG_EVENT:
    case WM_LOG_GAP:
    case WM_LOG_CLOSED: break;
  }
  return bytes.bad ? bad(self, err, "a record of the head that can't be read") : WM_OK;
}

static wm_status read_head(wm_log_reader *self, wm_error *err) {
  char magic[sizeof MAGIC - 1];
  if (fread(magic, 1, sizeof magic, self->file) != sizeof magic || memcmp(magic, MAGIC, sizeof magic) != 0)
    return wm_fail(err, WM_BAD_DATA, "%s: not an event log (it should begin with \"WMLOG 2\")", self->path);
  self->offset = sizeof magic;
  for (;;) {
    record r;
    int cut;
    wm_status status = read_record(self, &r, &cut, err);
    if (status == WM_END) return bad(self, err, "the file ends within its head; nothing can be replayed from it");
    if (status != WM_OK) return status;
    if (r.tag == WM_LOG_HEAD_END) break;
    if (r.tag >= WM_LOG_EVENT && r.tag < WM_LOG_KEPT) return bad(self, err, "an event before the end of the head");
    status = take_head_record(self, &r, err);
    if (status != WM_OK) return status;
  }
  give_landmarks(self);
  const wm_log_head *h = &self->head;
  if (!h->config_text || !h->calibration_text || !h->estimator[0] || !self->saw_wheels || !self->saw_start ||
      !self->saw_hash || h->source_count == 0)
    return bad(self, err, "the head lacks configuration, setup or sources");
  if (h->building && (h->start_floor < -1 || h->start_floor >= (int)h->building->plan.count))
    return bad(self, err, "the start is on a floor that the head doesn't name");
  if (wm_landmarks_hash(h->landmarks, h->landmark_count) != h->landmark_hash)
    return bad(self, err, "the landmarks don't have the head's hash");
  return WM_OK;
}

wm_status wm_log_open_file(FILE *file, const char *path, wm_log_reader **out, wm_error *err) {
  *out = NULL;
  wm_log_reader *self = calloc(1, sizeof *self);
  if (!self) {
    (void)fclose(file);
    return wm_fail(err, WM_IO, "%s: no memory", path);
  }
  self->file = file;
  (void)snprintf(self->path, sizeof self->path, "%s", path);
  wm_status status = reserve(self, WM_EVENT_ENCODED_MAX + 1, err);
  if (status == WM_OK) status = read_head(self, err);
  if (status != WM_OK) {
    wm_log_reader_close(self);
    return status;
  }
  *out = self;
  return WM_OK;
}

wm_status wm_log_open(const char *path, wm_log_reader **out, wm_error *err) {
  *out = NULL;
  FILE *file = fopen(path, "rbe");
  if (!file) return wm_fail(err, WM_IO, "%s: can't be read: %s", path, strerror(errno));
  return wm_log_open_file(file, path, out, err);
}

const wm_log_head *wm_log_reader_head(const wm_log_reader *self) { return &self->head; }

// ── the events ──────────────────────────────────────────────────────────────────────────────────────────────────────

// Differences of stamps must fit in 64 bits: 146 years.
static int is_stamp(wm_time_ns t_ns) { return t_ns > -(INT64_MAX / 2) && t_ns < INT64_MAX / 2; }

static wm_status take_event(wm_log_reader *self, const record *r, wm_event *out, wm_error *err) {
  size_t used;
  if (wm_event_decode(r->content, r->count, out, &used) != WM_OK || used != r->count)
    return bad(self, err, "an event that can't be read");
  if (!is_stamp(out->t_ns) || !is_stamp(out->arrival_ns)) return bad(self, err, "an event with an impossible stamp");
  if (out->source >= self->head.source_count) return bad(self, err, "an event of a source that the head doesn't name");
  self->events++;
  return WM_OK;
}

wm_status wm_log_next(wm_log_reader *self, wm_event *out, uint64_t *missing, int *cut, wm_error *err) {
  for (;;) {
    record r = {0};
    wm_status status = read_record(self, &r, cut, err);
    if (status == WM_END) *cut |= !self->closed;
    if (status != WM_OK) return status;
    wm_reader bytes = wm_reader_of(r.content, r.count);
    switch (r.tag) {
      case WM_LOG_EVENT: return take_event(self, &r, out, err);
      case WM_LOG_GAP: {
        uint64_t gap = wm_get_u64(&bytes);
        *missing = *missing + gap < gap ? UINT64_MAX : *missing + gap;
        break;
      }
      case WM_LOG_CLOSED:
        if (wm_get_u64(&bytes) != self->events) return bad(self, err, "the count at the end is not that of the events");
        self->closed = 1;
        break;
      default: return bad(self, err, "a record of an unknown kind; was it written by a newer program?");
    }
    if (bytes.bad) return bad(self, err, "a record that can't be read");
  }
}

void wm_log_reader_close(wm_log_reader *self) {
  if (!self) return;
  (void)fclose(self->file);
  free(self->content);
  free(self->sensors);
  free(self->landmarks);
  free(self->floor_landmarks);
  wm_building_close(self->head.building);
  free(self->config_text);
  free(self->calibration_text);
  free(self->kept);
  free(self);
}
