// SPDX-License-Identifier: Apache-2.0
#include "scan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A matrix of a device tree has decimals: 0.707 instead of the root of one half.
#define ROTATION_TOLERANCE 0.01

// The number at *text, and *text behind it; -1: none.
static int number(const char **text) {
  int value = 0;
  if (**text < '0' || **text > '9') return -1;
  while (**text >= '0' && **text <= '9') {
    value = value * 10 + (**text - '0');
    if (value > 1000) return -1;
    (*text)++;
  }
  return value;
}

int iio_type_read(const char *text, iio_type *out) {
  memset(out, 0, sizeof *out);
  if (strncmp(text, "le:", 3) != 0 && strncmp(text, "be:", 3) != 0) return 0;
  out->is_big_endian = text[0] == 'b';
  text += 3;
  if (*text != 's' && *text != 'u') return 0;
  out->is_signed = *text++ == 's';
  const int bits = number(&text);
  if (*text++ != '/') return 0;
  const int storage = number(&text);
  int repeat = 1;
  if (*text == 'X') {
    text++;
    repeat = number(&text);
  }
  if (strncmp(text, ">>", 2) != 0) return 0;
  text += 2;
  const int shift = number(&text);
  if (storage != 8 && storage != 16 && storage != 32 && storage != 64) return 0;
  if (bits < 1 || shift < 0 || bits + shift > storage) return 0;
  if (repeat < 1 || repeat > 8) return 0;
  out->bits = (uint8_t)bits;
  out->storage_bits = (uint8_t)storage;
  out->shift = (uint8_t)shift;
  out->repeat = (uint8_t)repeat;
  return 1;
}

size_t iio_type_bytes(const iio_type *self) { return (size_t)self->storage_bits / 8 * self->repeat; }

int64_t iio_type_raw(const iio_type *self, const uint8_t *bytes) {
  const size_t count = self->storage_bits / 8u;
  uint64_t raw = 0;
  for (size_t i = 0; i < count; i++) raw = raw << 8 | bytes[self->is_big_endian ? i : count - 1 - i];
  raw >>= self->shift;
  if (self->bits == 64) return (int64_t)raw;
  const uint64_t sign = UINT64_C(1) << (self->bits - 1);
  raw &= (sign << 1) - 1;
  return self->is_signed && (raw & sign) ? (int64_t)raw - (int64_t)(sign << 1) : (int64_t)raw;
}

static int by_index(const void *a, const void *b) {
  const int left = ((const iio_element *)a)->index, right = ((const iio_element *)b)->index;
  return (left > right) - (left < right);
}

static size_t aligned(size_t at, size_t size) { return (at + size - 1) / size * size; }

size_t iio_layout(iio_element *elements, size_t count) {
  size_t end = 0, largest = 1;
  if (count == 0 || count > IIO_ELEMENTS_MAX) return 0;
  qsort(elements, count, sizeof elements[0], by_index);
  for (size_t i = 0; i < count; i++) {
    const size_t bytes = iio_type_bytes(&elements[i].type);
    if (bytes == 0) return 0;
    elements[i].at = aligned(end, bytes);
    end = elements[i].at + bytes;
    if (bytes > largest) largest = bytes;
  }
  end = aligned(end, largest);
  return end <= IIO_SCAN_BYTES_MAX ? end : 0;
}

static int is_rotation(const double m[9]) {
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      const double *a = &m[3 * i], *b = &m[3 * k];
      const double product = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      if (!(fabs(product - (i == k)) < ROTATION_TOLERANCE)) return 0;
    }
  const double turned =
      m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
  return turned > 0;
}

const char *iio_matrix_read(const char *text, double out[9]) {
  for (int i = 0; i < 9; i++) {
    char *end;
    out[i] = strtod(text, &end);
    if (end == text) return "has fewer than nine numbers";
    text = end + strspn(end, " \t,;");
  }
  return is_rotation(out) ? NULL : "is not a rotation: three axes at right angles, and right-handed";
}
