// SPDX-License-Identifier: Apache-2.0
// Samples of Linux IIO: the layout of a buffer's scans and the attributes that turn raw counts into SI units. Text as
// sysfs has it (Linux, Documentation/ABI/testing/sysfs-bus-iio). No files here.
#ifndef WM_IIO_SCAN_H
#define WM_IIO_SCAN_H

#include <stddef.h>
#include <stdint.h>

// "le:s16/32>>4": a little-endian signed number of 16 bits in 32, shifted right by 4 first.
typedef struct iio_type {
  uint8_t is_big_endian, is_signed;
  uint8_t bits, storage_bits, shift;
  uint8_t repeat;  // numbers in one element ("X4"), of which the first is read
} iio_type;

// 1: read. Storage is of 8, 16, 32 or 64 bits.
int iio_type_read(const char *text, iio_type *out);
int64_t iio_type_raw(const iio_type *self, const uint8_t *bytes);
size_t iio_type_bytes(const iio_type *self);

// An element of a scan. The kernel orders them by their index and aligns each to its own size
// (drivers/iio/industrialio-buffer.c, iio_compute_scan_bytes).
typedef struct iio_element {
  iio_type type;
  int index;
  size_t at;  // byte in the scan
} iio_element;

#define IIO_ELEMENTS_MAX 32  // of a scan
#define IIO_SCAN_BYTES_MAX (IIO_ELEMENTS_MAX * 64)
// Sorts the elements and sets their places. Returns the bytes of a scan; 0: without elements, or a scan beyond the
// largest.
size_t iio_layout(iio_element *elements, size_t count);

// "0, 1, 0; 1, 0, 0; 0, 0, -1", by rows: from the sensor's axes to the board's. NULL, or the fault: a matrix that is
// no rotation would mirror a turn.
const char *iio_matrix_read(const char *text, double out[9]);

#endif
