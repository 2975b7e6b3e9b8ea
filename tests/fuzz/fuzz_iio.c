// SPDX-License-Identifier: Apache-2.0
// Any bytes as texts of sysfs: types of a scan's elements, a line each, then a mounting matrix. Elements lie within the
// scan, and a matrix that is taken is a rotation.
#include <math.h>
#include <string.h>

#include "fuzz.h"
#include "scan.h"

static void read_scan(iio_element *elements, size_t count) {
  static const uint8_t kScan[IIO_SCAN_BYTES_MAX];
  const size_t bytes = iio_layout(elements, count);
  check(bytes <= IIO_SCAN_BYTES_MAX);
  if (bytes == 0) return;
  uint8_t *scan = malloc(bytes);  // of its size, for the sanitizer
  if (!scan) return;
  memcpy(scan, kScan, bytes);
  for (size_t i = 0; i < count; i++) {
    check(elements[i].at + iio_type_bytes(&elements[i].type) <= bytes);
    check(iio_type_raw(&elements[i].type, scan + elements[i].at) == 0);
  }
  free(scan);
}

static void read_matrix(const char *text) {
  double m[9];
  if (iio_matrix_read(text, m)) return;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      const double dot = m[3 * i] * m[3 * k] + m[3 * i + 1] * m[3 * k + 1] + m[3 * i + 2] * m[3 * k + 2];
      check(fabs(dot - (i == k)) < 0.1);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  iio_element elements[IIO_ELEMENTS_MAX] = {0};
  size_t count = 0;
  char *text = malloc(size + 1);
  if (!text) return 0;
  memcpy(text, data, size);
  text[size] = '\0';
  for (char *line = text; line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL) {
    char one[256];
    const size_t length = strcspn(line, "\n");
    if (length >= sizeof one) continue;
    memcpy(one, line, length);
    one[length] = '\0';
    if (count < IIO_ELEMENTS_MAX && iio_type_read(one, &elements[count].type)) {
      elements[count].index = (int)(length * 7 % 5);
      count++;
    } else {
      read_matrix(one);
    }
  }
  read_scan(elements, count);
  free(text);
  return 0;
}
