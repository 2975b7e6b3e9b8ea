// SPDX-License-Identifier: Apache-2.0
// Position of a signal's bits in a frame, and their conversion to a number. All inline, for decoding.
#ifndef WM_CAN_SIGNAL_H
#define WM_CAN_SIGNAL_H

#include <stdint.h>
#include <string.h>

#include "waymark/can.h"

// A frame's data with zeros after it, so that nine bytes can be read at any byte of the frame.
typedef struct payload {
  uint8_t byte[WM_CAN_DATA_MAX + 9];
} payload;

static inline void payload_set(payload *out, const uint8_t *data, size_t length) {
  memset(out, 0, sizeof *out);
  memcpy(out->byte, data, length <= WM_CAN_DATA_MAX ? length : WM_CAN_DATA_MAX);
}

typedef enum signal_kind { SIGNAL_UNSIGNED, SIGNAL_SIGNED, SIGNAL_FLOAT, SIGNAL_DOUBLE } signal_kind;

// DBC numbers bits by byte (bit 0 is the lowest bit of byte 0, bit 8 that of byte 1). `start` is the lowest bit of an
// Intel signal and the highest bit of a Motorola one.
typedef struct signal_bits {
  uint16_t start;
  uint8_t length;  // 1 to 64
  uint8_t is_motorola;
  uint8_t kind;  // signal_kind
} signal_bits;

static inline int signal_same(const signal_bits *a, const signal_bits *b) {
  return a->start == b->start && a->length == b->length && a->is_motorola == b->is_motorola && a->kind == b->kind;
}

// Position of the first bit when the payload is read as one stream: from each byte's lowest bit for Intel, from each
// byte's highest bit for Motorola.
static inline unsigned signal_first(const signal_bits *s) {
  return s->is_motorola ? (s->start & ~7u) + 7u - (s->start & 7u) : s->start;
}

// Bytes that a frame must have to hold the signal.
static inline unsigned signal_bytes(const signal_bits *s) { return (signal_first(s) + s->length + 7u) / 8u; }

// The signal's bits as they are. signal_bytes() must be at most WM_CAN_DATA_MAX. Cost: nine bytes read.
static inline uint64_t signal_raw(const signal_bits *s, const payload *p) {
  unsigned first = signal_first(s), shift = first & 7u;
  const uint8_t *at = p->byte + first / 8u;
  uint64_t bits = 0;
  if (s->is_motorola) {
    for (int i = 0; i < 8; i++) bits = bits << 8 | at[i];
    if (shift) bits = bits << shift | (uint64_t)(at[8] >> (8u - shift));
    return bits >> (64u - s->length);
  }
  for (int i = 7; i >= 0; i--) bits = bits << 8 | at[i];
  if (shift) bits = bits >> shift | (uint64_t)at[8] << (64u - shift);
  return s->length == 64 ? bits : bits & ((UINT64_C(1) << s->length) - 1u);
}

// `length` bits as a two's complement number.
static inline int64_t sign_extend(uint64_t bits, unsigned length) {
  uint64_t sign = UINT64_C(1) << (length - 1u);
  return (int64_t)((bits ^ sign) - sign);
}

// The number that the bits encode, before factor and offset.
static inline double signal_number(const signal_bits *s, uint64_t raw) {
  switch ((signal_kind)s->kind) {
    case SIGNAL_UNSIGNED: return (double)raw;
    case SIGNAL_SIGNED: return (double)sign_extend(raw, s->length);
    case SIGNAL_FLOAT: {
      uint32_t word = (uint32_t)raw;
      float f;
      memcpy(&f, &word, sizeof f);
      return (double)f;
    }
    case SIGNAL_DOUBLE: {
      double d;
      memcpy(&d, &raw, sizeof d);
      return d;
    }
  }
  return 0.0;
}

#endif
