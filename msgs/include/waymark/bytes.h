// SPDX-License-Identifier: Apache-2.0
// Little-endian fields, one after the other, with bounds. A full writer and a reader at its end touch no memory and set
// a flag, which a codec checks once after its list of fields. Any thread; no allocation.
//
#ifndef WAYMARK_BYTES_H
#define WAYMARK_BYTES_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef struct wm_writer {
  uint8_t *data;
  size_t capacity;
  size_t used;
  int full;  // a field didn't fit: the bytes written are not valid
} wm_writer;

typedef struct wm_reader {
  const uint8_t *data;
  size_t size;
  size_t used;
  int bad;  // bytes were missing: the fields read since are zeros
} wm_reader;

static inline wm_writer wm_writer_of(void *data, size_t capacity) {
  return (wm_writer){.data = (uint8_t *)data, .capacity = capacity};
}

static inline wm_reader wm_reader_of(const void *data, size_t size) {
  return (wm_reader){.data = (const uint8_t *)data, .size = size};
}

static inline void wm_put_bytes(wm_writer *w, const void *bytes, size_t count) {
  if (w->full || count > w->capacity - w->used) {
    w->full = 1;
    return;
  }
  if (count > 0) memcpy(w->data + w->used, bytes, count);
  w->used += count;
}

static inline void wm_get_bytes(wm_reader *r, void *bytes, size_t count) {
  if (r->bad || count > r->size - r->used) {
    r->bad = 1;
    memset(bytes, 0, count);
    return;
  }
  if (count > 0) memcpy(bytes, r->data + r->used, count);
  r->used += count;
}

static inline void wm_put_le(wm_writer *w, uint64_t value, size_t bytes) {
  uint8_t le[8];
  for (size_t i = 0; i < bytes; i++) le[i] = (uint8_t)(value >> (8 * i));
  wm_put_bytes(w, le, bytes);
}

static inline uint64_t wm_get_le(wm_reader *r, size_t bytes) {
  uint8_t le[8] = {0};
  wm_get_bytes(r, le, bytes);
  uint64_t value = 0;
  for (size_t i = 0; i < bytes; i++) value |= (uint64_t)le[i] << (8 * i);
  return value;
}

static inline void wm_put_u8(wm_writer *w, uint8_t v) { wm_put_le(w, v, 1); }
static inline void wm_put_u16(wm_writer *w, uint16_t v) { wm_put_le(w, v, 2); }
static inline void wm_put_u32(wm_writer *w, uint32_t v) { wm_put_le(w, v, 4); }
static inline void wm_put_u64(wm_writer *w, uint64_t v) { wm_put_le(w, v, 8); }
static inline void wm_put_i32(wm_writer *w, int32_t v) { wm_put_le(w, (uint32_t)v, 4); }
static inline void wm_put_i64(wm_writer *w, int64_t v) { wm_put_le(w, (uint64_t)v, 8); }

static inline uint8_t wm_get_u8(wm_reader *r) { return (uint8_t)wm_get_le(r, 1); }
static inline uint16_t wm_get_u16(wm_reader *r) { return (uint16_t)wm_get_le(r, 2); }
static inline uint32_t wm_get_u32(wm_reader *r) { return (uint32_t)wm_get_le(r, 4); }
static inline uint64_t wm_get_u64(wm_reader *r) { return wm_get_le(r, 8); }
static inline int32_t wm_get_i32(wm_reader *r) { return (int32_t)wm_get_u32(r); }
static inline int64_t wm_get_i64(wm_reader *r) { return (int64_t)wm_get_u64(r); }

// The bits of a double or float, unchanged for NaN as well.
static inline void wm_put_f64(wm_writer *w, double v) {
  uint64_t bits;
  memcpy(&bits, &v, sizeof bits);
  wm_put_u64(w, bits);
}

static inline double wm_get_f64(wm_reader *r) {
  uint64_t bits = wm_get_u64(r);
  double v;
  memcpy(&v, &bits, sizeof v);
  return v;
}

static inline void wm_put_f32(wm_writer *w, float v) {
  uint32_t bits;
  memcpy(&bits, &v, sizeof bits);
  wm_put_u32(w, bits);
}

static inline float wm_get_f32(wm_reader *r) {
  uint32_t bits = wm_get_u32(r);
  float v;
  memcpy(&v, &bits, sizeof v);
  return v;
}

static inline void wm_put_f64s(wm_writer *w, const double *v, size_t count) {
  for (size_t i = 0; i < count; i++) wm_put_f64(w, v[i]);
}

static inline void wm_get_f64s(wm_reader *r, double *v, size_t count) {
  for (size_t i = 0; i < count; i++) v[i] = wm_get_f64(r);
}

#endif
