// SPDX-License-Identifier: Apache-2.0
#include "output/csv_row.h"

#include <math.h>
#include <string.h>

#include "output/number_text.h"

void wm_row_text(wm_row *self, const char *string) {
  size_t n = strlen(string), room = sizeof self->bytes - self->length;
  if (n > room) n = room;
  memcpy(self->bytes + self->length, string, n);
  self->length += n;
}

void wm_row_char(wm_row *self, char c) {
  if (self->length < sizeof self->bytes) self->bytes[self->length++] = c;
}

static void put_unsigned(wm_row *self, uint64_t value, int digits_at_least) {
  char digits[24];
  int n = 0;
  do {
    digits[n++] = (char)('0' + value % 10);
    value /= 10;
  } while (value > 0 || n < digits_at_least);
  while (n > 0) wm_row_char(self, digits[--n]);
}

void wm_row_int(wm_row *self, int64_t value) {
  if (value < 0) wm_row_char(self, '-');
  put_unsigned(self, value < 0 ? (uint64_t)0 - (uint64_t)value : (uint64_t)value, 1);
}

static void put_number(wm_row *self, double value, size_t (*format)(double, char *)) {
  if (isnan(value) || sizeof self->bytes - self->length < WM_NUMBER_MAX) return;
  self->length += format(value, self->bytes + self->length);
}

void wm_row_exact(wm_row *self, double value) { put_number(self, value, wm_number_exact); }
void wm_row_short(wm_row *self, double value) { put_number(self, value, wm_number_short); }

void wm_row_fixed(wm_row *self, double value, int decimals) {
  static const uint64_t kTens[] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000, 1000000000};
  if (isnan(value)) return;
  if (fabs(value) > 9e8) {
    wm_row_exact(self, value);
    return;
  }
  double scaled = fabs(value) * (double)kTens[decimals];
  uint64_t units = (uint64_t)(scaled + 0.5);
  if (value < 0 && units > 0) wm_row_char(self, '-');
  put_unsigned(self, units / kTens[decimals], 1);
  if (decimals > 0) {
    wm_row_char(self, '.');
    put_unsigned(self, units % kTens[decimals], decimals);
  }
}

void wm_row_seconds(wm_row *self, wm_time_ns t_ns) {
  uint64_t size = t_ns < 0 ? (uint64_t)0 - (uint64_t)t_ns : (uint64_t)t_ns;
  if (t_ns < 0) wm_row_char(self, '-');
  put_unsigned(self, size / (uint64_t)WM_NS_PER_S, 1);
  wm_row_char(self, '.');
  put_unsigned(self, size % (uint64_t)WM_NS_PER_S, 9);
}
