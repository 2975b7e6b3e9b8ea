// SPDX-License-Identifier: Apache-2.0
#include "waymark/lcm_streams.h"
#include "lcm_bytes.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "stream_types.h"

#define MEMBER(name) waymark_##name##_t name;
typedef union any_message {
  WM_STREAM_TYPES(MEMBER)
} any_message;

// A message is its stamp, then the numbers of the stream's columns in their order.
typedef struct stream_type {
  const char *stream, *type, *not_it, *too_short;
  size_t bytes;  // of the message in memory
  int (*decode)(const void *from, int length, any_message *to);
  int (*encode)(void *to, int length, const any_message *from);
} stream_type;

#define FUNCTIONS(name)                                                                                      \
  static int decode_##name(const void *from, int length, any_message *to) {                                  \
    return waymark_##name##_t_decode(from, 0, length, &to->name);                                            \
  }                                                                                                          \
  static int encode_##name(void *to, int length, const any_message *from) {                                  \
    return waymark_##name##_t_encode(to, 0, length, &from->name);                                            \
  }                                                                                                          \
  _Static_assert(offsetof(waymark_##name##_t, t_ns) == 0 &&                                                  \
                     sizeof(waymark_##name##_t) <= sizeof(int64_t) + WM_STREAM_NUMBERS_MAX * sizeof(double), \
                 "a stamp, and numbers behind it");
#define TYPE(name)                                                            \
  {#name,                                                                     \
   #name "_t",                                                                \
   "does not match " #name "_t of this version",                              \
   "is shorter than " #name "_t of this version: are all its numbers there?", \
   sizeof(waymark_##name##_t),                                                \
   decode_##name,                                                             \
   encode_##name},

WM_STREAM_TYPES(FUNCTIONS)

static const stream_type kTypes[] = {WM_STREAM_TYPES(TYPE)};

// A bit for each number that senders from before NaN meant absent leave 0 where they don't have it.
static const struct {
  const char *stream;
  uint32_t numbers;
} kZeroIsAbsent[] = {{"imu", UINT32_C(0x3f) << 6}, {"gnss", UINT32_C(1) << 4}};  // sigmas; sigma of the altitude

static uint32_t zero_is_absent(const stream_type *type) {
  for (size_t i = 0; i < sizeof kZeroIsAbsent / sizeof kZeroIsAbsent[0]; i++)
    if (strcmp(kZeroIsAbsent[i].stream, type->stream) == 0) return kZeroIsAbsent[i].numbers;
  return 0;
}

static const stream_type *find(const char *stream) {
  for (size_t i = 0; stream && i < sizeof kTypes / sizeof kTypes[0]; i++)
    if (strcmp(kTypes[i].stream, stream) == 0) return &kTypes[i];
  return NULL;
}

const char *wm_lcm_stream_type(const char *stream) {
  const stream_type *type = find(stream);
  return type ? type->type : NULL;
}

const char *wm_lcm_read_row(const char *stream, const void *message, size_t length, wm_stream_row *out) {
  any_message m;
  const stream_type *type = find(stream);
  if (!type) return "is of no stream";
  if (type->decode(message, given(message, length), &m) < 0) {
    const any_message none = {0};
    uint8_t right[sizeof m + sizeof(int64_t)];
    const int bytes = type->encode(right, sizeof right, &none);
    return bytes > 0 && is_beginning(message, length, right) ? type->too_short : type->not_it;
  }
  const size_t bytes = type->bytes - sizeof(int64_t);
  memset(out, 0, sizeof *out);
  memcpy(&out->t_ns, &m, sizeof(int64_t));
  memcpy(out->number, (const char *)&m + sizeof(int64_t), bytes);
  for (size_t i = bytes / sizeof(double); i < WM_STREAM_NUMBERS_MAX; i++) out->number[i] = (double)NAN;
  for (size_t i = 0; i < bytes / sizeof(double); i++)
    if ((zero_is_absent(type) >> i & 1u) && out->number[i] == 0.0) out->number[i] = (double)NAN;
  return NULL;
}

size_t wm_lcm_row(const char *stream, const wm_stream_row *row, void *out, size_t capacity) {
  any_message m;
  const stream_type *type = find(stream);
  if (!type) return 0;
  memcpy(&m, &row->t_ns, sizeof(int64_t));
  memcpy((char *)&m + sizeof(int64_t), row->number, type->bytes - sizeof(int64_t));
  const int bytes = type->encode(out, room(capacity), &m);
  return bytes > 0 ? (size_t)bytes : 0;
}
