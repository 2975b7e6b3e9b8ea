// SPDX-License-Identifier: Apache-2.0
// From frame to quantities. No allocation; a frame without a binding costs one search among a few ids.
#include <math.h>

#include "decoder.h"
#include "waymark/event.h"

static size_t first_of(const wm_can_decoder *self, uint64_t key) {
  size_t low = 0, high = self->message_count;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (self->messages[middle].key < key) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

// ── one signal ──────────────────────────────────────────────────────────────────────────────────────────────────────

typedef enum presence { PRESENT, ABSENT, TOO_SHORT } presence;

static int selects(const wm_can_decoder *self, const bound_selector *s, uint64_t raw) {
  for (uint32_t i = 0; i < s->range_count; i++)
    if (raw >= self->ranges[s->first_range + i].low && raw <= self->ranges[s->first_range + i].high) return 1;
  return 0;
}

// Whether the signal is present in this frame by its multiplexers, and within the frame's length.
static presence presence_of(const wm_can_decoder *self, const bound_signal *s, const payload *data, unsigned length) {
  for (uint32_t i = s->selector_count; i-- > 0;) {  // from the outermost
    const bound_selector *above = &self->selectors[s->first_selector + i];
    if (signal_bytes(&above->bits) > length) return TOO_SHORT;
    if (!selects(self, above, signal_raw(&above->bits, data))) return ABSENT;
  }
  return signal_bytes(&s->bits) > length ? TOO_SHORT : PRESENT;
}

// A tick counter continues from its last value by the shorter way round, so that it may run backwards.
static double unwrap(bound_signal *s, uint64_t raw) {
  if (s->has_last) {
    uint64_t step = (raw - s->last) & (UINT64_MAX >> (64u - s->bits.length));
    s->unwrapped = (int64_t)((uint64_t)s->unwrapped + (uint64_t)sign_extend(step, s->bits.length));
  } else {
    s->unwrapped = s->bits.kind == SIGNAL_SIGNED ? sign_extend(raw, s->bits.length) : (int64_t)raw;
    s->has_last = 1;
  }
  s->last = raw;
  return (double)s->unwrapped;
}

static int says_no_value(const bound_signal *s, uint64_t raw) {
  for (uint32_t i = 0; i < s->no_value_count; i++)
    if (s->no_value[i] == raw) return 1;
  return 0;
}

// ── one quantity ────────────────────────────────────────────────────────────────────────────────────────────────────

static presence all_present(const wm_can_decoder *self, const bound_quantity *q, const payload *data, unsigned length) {
  presence worst = PRESENT;
  for (uint32_t i = 0; i < q->signal_count; i++) {
    presence here = presence_of(self, &self->signals[q->first_signal + i], data, length);
    if (here > worst) worst = here;
  }
  return worst;
}

static int gear_value(const bound_quantity *q, double number, double *out) {
  for (uint32_t i = 0; i < q->gear_count; i++) {
    if (q->gear[i].raw != number) continue;
    *out = q->gear[i].direction;
    return 1;
  }
  return 0;
}

// Sum of the signals in SI. 0 where the value is marked as not available.
static int quantity_value(const bound_quantity *q, bound_signal *signals, const payload *data, double *out) {
  int is_ticks = q->quantity == WM_Q_WHEEL_TICKS_LEFT || q->quantity == WM_Q_WHEEL_TICKS_RIGHT;
  double sum = 0.0;
  for (uint32_t i = 0; i < q->signal_count; i++) {
    bound_signal *s = &signals[i];
    uint64_t raw = signal_raw(&s->bits, data);
    double number = is_ticks ? unwrap(s, raw) : signal_number(&s->bits, raw);
    if (says_no_value(s, raw)) return 0;
    if (q->quantity != WM_Q_GEAR) {
      sum += (number * s->factor + s->offset) * s->si;
    } else if (!gear_value(q, number, &sum)) {
      return 0;
    }
  }
  *out = q->scale * sum + q->offset;
  return isfinite(*out);
}

// ── one frame ───────────────────────────────────────────────────────────────────────────────────────────────────────

// 0 for a frame that repeats the one before it. Counts lost frames by the message's counter, until they arrive late.
static int watch_counter(bound_message *m, const payload *data, unsigned length, wm_quantities *out,
                         wm_source_counts *counts) {
  counter *c = &m->counter;
  if (!c->is_there || signal_bytes(&c->bits) > length) return 1;
  counter_step step = counter_next(c, signal_raw(&c->bits, data));
  counts->lost += step.lost;
  counts->lost -= (uint64_t)step.late;
  if (step.lost > out->lost_before) out->lost_before = (uint16_t)(step.lost < UINT16_MAX ? step.lost : UINT16_MAX);
  if (step.repeats == 0) return 1;
  counts->frozen++;
  if (step.repeats < COUNTER_FROZEN) return 0;
  out->doubt |= WM_DOUBT_FROZEN_COUNTER;
  return 1;
}

static wm_status bad_frame(const bound_message *m, const wm_can_frame *frame, const char *what, wm_error *err) {
  return wm_fail(err, WM_BAD_DATA, "%.15s: %s (id %X, %u bytes): %s", frame->iface, m->name, frame->id, frame->length,
                 what);
}

static wm_status decode_message(wm_can_decoder *self, bound_message *m, const wm_can_frame *frame, const payload *data,
                                wm_quantities *out, wm_source_counts *counts, wm_error *err) {
  const bound_quantity *quantities = &self->quantities[m->first_quantity];
  presence there[WM_QUANTITIES_MAX];
  for (uint32_t i = 0; i < m->quantity_count; i++) {
    there[i] = all_present(self, &quantities[i], data, frame->length);
    if (there[i] != TOO_SHORT) continue;
    counts->malformed++;
    return bad_frame(m, frame, "the frame is shorter than the signals that are bound", err);
  }
  if (!watch_counter(m, data, frame->length, out, counts)) return WM_AGAIN;

  int given = 0, refused = 0;
  for (uint32_t i = 0; i < m->quantity_count; i++) {
    if (there[i] == ABSENT || out->count == WM_QUANTITIES_MAX) continue;
    double value = 0.0;
    if (!quantity_value(&quantities[i], &self->signals[quantities[i].first_signal], data, &value)) {
      refused++;
      continue;
    }
    out->id[out->count] = (uint8_t)quantities[i].quantity;
    out->value[out->count++] = value;
    given++;
  }
  counts->not_finite += (uint64_t)refused;
  if (refused > 0 && given == 0) return bad_frame(m, frame, "its signals mark that there is no value", err);
  if (given == 0) counts->ignored++;  // none of this frame's multiplexed signals is bound
  return given > 0 ? WM_OK : WM_AGAIN;
}

wm_status wm_can_decode(wm_can_decoder *self, const wm_can_frame *frame, wm_quantities *out, wm_source_counts *counts,
                        wm_error *err) {
  memset(out, 0, sizeof *out);
  if (frame->is_error) {
    counts->bus_errors++;
    return WM_AGAIN;
  }
  uint64_t key = dbc_key(frame->id, frame->is_extended);
  size_t i = frame->is_remote ? self->message_count : first_of(self, key);
  payload data;
  int is_bound = 0;
  wm_status status = WM_AGAIN;
  for (; i < self->message_count && self->messages[i].key == key; i++) {
    bound_message *m = &self->messages[i];
    if (m->bus[0] && strncmp(m->bus, frame->iface, WM_CAN_IFACE_MAX) != 0) continue;
    if (!is_bound) payload_set(&data, frame->data, frame->length);
    is_bound = 1;
    wm_status here = decode_message(self, m, frame, &data, out, counts, err);
    if (here == WM_BAD_DATA) status = WM_BAD_DATA;
  }
  if (!is_bound) counts->ignored++;
  return out->count > 0 ? WM_OK : status;
}

size_t wm_can_decoder_ids(const wm_can_decoder *self, uint32_t *ids, uint8_t *is_extended, size_t capacity) {
  size_t count = 0;
  for (size_t i = 0; i < self->message_count; i++) {
    uint64_t key = self->messages[i].key;
    if (i > 0 && key == self->messages[i - 1].key) continue;
    if (count < capacity) {
      ids[count] = (uint32_t)(key >> 1);
      is_extended[count] = (uint8_t)(key & 1u);
    }
    count++;
  }
  return count;
}

uint32_t wm_can_decoder_quantities(const wm_can_decoder *self) {
  uint32_t bits = 0;
  for (size_t i = 0; i < self->quantity_count; i++) bits |= UINT32_C(1) << self->quantities[i].quantity;
  return bits;
}
