// SPDX-License-Identifier: Apache-2.0
#include "init/dbc_signals.h"

#include <math.h>

#include "can/dbc.h"
#include "can/names.h"

static void copy(wm_text from, char *out, size_t capacity) {
  size_t n = from.length < capacity - 1 ? from.length : capacity - 1;
  if (n > 0) memcpy(out, from.at, n);
  out[n] = '\0';
}

static void fill_unit(const dbc_signal *s, init_signal *out) {
  static const init_dimension kOurs[] = {
      [WM_DIM_NONE] = INIT_NO_UNIT, [WM_DIM_SPEED] = INIT_SPEED,   [WM_DIM_ANGULAR_RATE] = INIT_ANGULAR_RATE,
      [WM_DIM_ANGLE] = INIT_ANGLE,  [WM_DIM_LENGTH] = INIT_LENGTH, [WM_DIM_ACCELERATION] = INIT_OTHER_UNIT};
  wm_dimension dimension;
  out->si = 1;
  out->dimension = s->unit.length > 0 ? INIT_OTHER_UNIT : INIT_NO_UNIT;
  if (wm_unit_find(s->unit, &dimension, &out->si)) out->dimension = kOurs[dimension];
}

static void fill_range(const dbc_signal *s, init_signal *out) {
  const double span = ldexp(1.0, s->bits.length);
  double low = 0, high = span - 1;
  if (s->bits.kind == SIGNAL_SIGNED) {
    low = -span / 2;
    high = span / 2 - 1;
  } else if (s->bits.kind != SIGNAL_UNSIGNED) {
    low = -HUGE_VAL;
    high = HUGE_VAL;
  }
  const double a = low * s->factor + s->offset, b = high * s->factor + s->offset;
  out->lowest = fmin(a, b);
  out->highest = fmax(a, b);
}

static void fill(const wm_dbc *dbc, const dbc_message *m, const dbc_signal *s, init_signal *out) {
  memset(out, 0, sizeof *out);
  copy(m->name, out->message, sizeof out->message);
  copy(s->name, out->name, sizeof out->name);
  copy(s->unit, out->unit, sizeof out->unit);
  out->line = s->line;
  out->match = wm_dbc_match(dbc, m);
  out->bits = s->bits.length;
  out->is_signed = s->bits.kind != SIGNAL_UNSIGNED;
  out->is_float = s->bits.kind == SIGNAL_FLOAT || s->bits.kind == SIGNAL_DOUBLE;
  out->factor = s->factor;
  out->min = s->min;
  out->max = s->max;
  uint32_t above[DBC_SELECTORS_MAX];
  out->is_usable = m->length <= WM_CAN_DATA_MAX && signal_bytes(&s->bits) <= m->length && s->factor != 0 &&
                   wm_dbc_selectors(dbc, s, above) >= 0;
  fill_unit(s, out);
  fill_range(s, out);
  for (uint32_t i = 0; i < s->value_count; i++) {
    double direction;
    if (!wm_gear_direction(dbc->values[s->first_value + i].name, &direction)) continue;
    out->forwards += direction > 0;
    out->backwards += direction < 0;
  }
  out->is_counter = wm_counter_likeness(s->name) > 0;
}

size_t init_dbc_signals(const wm_dbc *dbc, init_signal *out, size_t capacity) {
  for (size_t i = 0; i < dbc->message_count; i++) {
    const dbc_message *m = &dbc->messages[i];
    for (size_t k = m->first_signal; k < (size_t)m->first_signal + m->signal_count && k < capacity; k++)
      fill(dbc, m, &dbc->signals[k], &out[k]);
  }
  return dbc->signal_count;
}

int init_signal_value(const wm_dbc *dbc, size_t index, const wm_can_frame *frame, double *value, uint64_t *raw) {
  const dbc_signal *s = &dbc->signals[index];
  if (frame->is_error || frame->is_remote || signal_bytes(&s->bits) > frame->length) return 0;
  payload p;
  payload_set(&p, frame->data, frame->length);
  uint32_t above[DBC_SELECTORS_MAX];
  const int count = wm_dbc_selectors(dbc, s, above);
  const dbc_signal *selected = s;
  for (int i = 0; i < count; i++) {
    const dbc_signal *selector = &dbc->signals[above[i]];
    if (signal_bytes(&selector->bits) > frame->length) return 0;
    if (!wm_dbc_selects(dbc, selected, signal_raw(&selector->bits, &p))) return 0;
    selected = selector;
  }
  *raw = signal_raw(&s->bits, &p);
  *value = signal_number(&s->bits, *raw) * s->factor + s->offset;
  for (uint32_t i = 0; i < s->value_count; i++) {
    const dbc_value *named = &dbc->values[s->first_value + i];
    if ((uint64_t)named->raw == *raw && wm_means_no_value(named->name)) return 0;
  }
  return isfinite(*value);
}

int init_signal_gear(const wm_dbc *dbc, size_t index, uint64_t raw, double *direction) {
  const dbc_signal *s = &dbc->signals[index];
  for (uint32_t i = 0; i < s->value_count; i++) {
    const dbc_value *named = &dbc->values[s->first_value + i];
    if ((uint64_t)named->raw == raw) return wm_gear_direction(named->name, direction);
  }
  return 0;
}
