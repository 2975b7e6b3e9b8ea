// SPDX-License-Identifier: Apache-2.0
// From frame to quantities. No allocation; a frame without a binding costs one search among a few ids.
#include <math.h>

#include "decoder.h"
#include "sender.h"
#include "waymark/event.h"

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

// A counter is silent for longer than this and so many of its periods, as a speed is overdue
// (estimator/motion/history.hpp).
#define SILENT_NS (250 * WM_NS_PER_MS)
#define SILENT_PERIODS 3
// A rate is that of so long: jitter of stamps and bursts of an adapter average out.
#define RATE_OVER_NS (100 * WM_NS_PER_MS)
// In a silence a wheel may turn so much faster than ever before, and against its faster direction at least with this
// share of that. Margins for drives of which little was seen; not swept.
#define FASTER_THAN_EVER 1.5
#define OTHER_DIRECTION 0.5
// A change below this share of a cycle, faster than ever: the next possible one would be 15 times as fast.
#define CLEARLY_SHORTER (1.0 / 16.0)
// Bits. Longer counters do not wrap while a robot runs, and doubles hold their differences.
#define WRAPPING_BITS_MOST 48u

// The fastest of two rates in a row: one alone may be a damaged frame's.
static void note_rate(tick_rates *r, int64_t step, wm_time_ns t_ns) {
  r->ticks += (double)step;
  const wm_time_ns over_ns = t_ns - r->since_ns;
  if (over_ns < RATE_OVER_NS) return;
  const double rate = r->ticks / ((double)over_ns * 1e-9);
  r->up = fmax(r->up, fmin(rate, r->before));
  r->down = fmax(r->down, fmin(-rate, -r->before));
  r->before = rate;
  r->since_ns = t_ns;
  r->ticks = 0;
}

// Of a counter that was silent, `step` by the shorter way round: adds the cycles with which it is within the rates that
// the robot may have had. 0 where more numbers of cycles are possible, or none.
static int resolve_cycles(const bound_signal *s, wm_time_ns silent_ns, int64_t *step) {
  if (s->bits.length > WRAPPING_BITS_MOST) return 1;
  const tick_rates *r = &s->rates;
  const double cycle = ldexp(1.0, (int)s->bits.length), silent_s = (double)silent_ns * 1e-9, by = (double)*step;
  const double up = FASTER_THAN_EVER * fmax(r->up, OTHER_DIRECTION * r->down) * silent_s + 1.0;
  const double down = FASTER_THAN_EVER * fmax(r->down, OTHER_DIRECTION * r->up) * silent_s + 1.0;
  const double fewest = ceil((-down - by) / cycle), most = floor((up - by) / cycle);
  if (fewest > most) return fabs(by) < CLEARLY_SHORTER * cycle;
  *step += (int64_t)(fewest * cycle);
  return fewest == most;
}

// A tick counter continues from its last value by the shorter way round, so that it may run backwards. After a silence
// it may have gone further: *doubt where its difference is unknown.
static double unwrap(bound_signal *s, uint64_t raw, wm_time_ns t_ns, uint8_t *doubt) {
  tick_rates *r = &s->rates;
  if (s->has_last) {
    int64_t step = sign_extend((raw - s->last) & (UINT64_MAX >> (64u - s->bits.length)), s->bits.length);
    const wm_time_ns since_ns = t_ns - r->last_ns;
    const int is_silent = r->period_ns > 0 && since_ns > SILENT_NS && since_ns > SILENT_PERIODS * r->period_ns;
    if (is_silent) {
      if (!resolve_cycles(s, since_ns, &step)) *doubt |= WM_DOUBT_COUNTS_WRAPPED;
      r->since_ns = t_ns;
      r->ticks = 0;
    } else {
      note_rate(r, step, t_ns);
      r->period_ns = since_ns;
    }
    s->unwrapped = (int64_t)((uint64_t)s->unwrapped + (uint64_t)step);
  } else {
    s->unwrapped = s->bits.kind == SIGNAL_SIGNED ? sign_extend(raw, s->bits.length) : (int64_t)raw;
    s->has_last = 1;
    r->since_ns = t_ns;
  }
  r->last_ns = t_ns;
  s->last = raw;
  return (double)s->unwrapped;
}

static int says_no_value(const bound_signal *s, uint64_t raw) {
  for (uint32_t i = 0; i < s->no_value_count; i++)
    if (s->no_value[i] == raw) return 1;
  return s->no_value_from > 0 && raw >= s->no_value_from;
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

// Numbers of a robot's signals are zero or within these.
#define FLOAT_LEAST 1e-9
#define FLOAT_MOST 1e9

// Whether the bits of an integer could be those of a floating-point number.
static void watch_bits(bound_signal *s, uint64_t raw) {
  if (raw == 0 || s->bits.kind == SIGNAL_FLOAT || s->bits.kind == SIGNAL_DOUBLE) return;
  const signal_bits as = {.kind = s->bits.length == 32 ? SIGNAL_FLOAT : SIGNAL_DOUBLE};
  const double size = fabs(signal_number(&as, raw));
  const int is_float = (s->bits.length == 32 || s->bits.length == 64) && size > FLOAT_LEAST && size < FLOAT_MOST;
  if (is_float && s->floats++ == 0) s->first_float = raw;
  s->others += !is_float;
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
static int quantity_value(const bound_quantity *q, bound_signal *signals, const payload *data, wm_time_ns t_ns,
                          uint8_t *doubt, double *out) {
  int is_ticks = q->quantity == WM_Q_WHEEL_TICKS_LEFT || q->quantity == WM_Q_WHEEL_TICKS_RIGHT;
  double sum = 0.0;
  for (uint32_t i = 0; i < q->signal_count; i++) {
    bound_signal *s = &signals[i];
    uint64_t raw = signal_raw(&s->bits, data);
    if (s->bits.length >= 32) watch_bits(s, raw);
    double number = is_ticks ? unwrap(s, raw, t_ns, doubt) : signal_number(&s->bits, raw);
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
    bound_signal *signals = &self->signals[quantities[i].first_signal];
    if (!quantity_value(&quantities[i], signals, data, frame->t_ns, &out->doubt, &value)) {
      refused++;
      continue;
    }
    out->id[out->count] = (uint8_t)quantities[i].quantity;
    out->value[out->count++] = value;
    given++;
  }
  counts->not_finite += refused > 0;  // a frame, not each of its values
  if (refused > 0)
    (void)bad_frame(m, frame, given ? "a signal marks that it has no value" : "its signals mark that there is no value",
                    err);
  if (refused > 0 && given == 0) return WM_BAD_DATA;
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
  payload data;
  int is_bound = 0;
  wm_status status = WM_AGAIN;
  for (size_t i = 0; i < self->message_count && !frame->is_remote; i++) {
    bound_message *m = &self->messages[i];
    if (!wm_can_matches(&m->match, frame->id, frame->is_extended)) continue;
    const sender_verdict verdict = sender_take(m, frame, counts);
    if (verdict == SENDER_AWAITED) {
      counts->malformed++;
      counts->first_problem_kind = counts->first_problem[0] ? counts->first_problem_kind : WM_ROW_SENDER;
      status = bad_frame(m, frame, "another unit's, while the one that is taken is silent", err);
      is_bound = 1;
    }
    if (verdict != SENDER_TAKEN) continue;
    if (!is_bound) payload_set(&data, frame->data, frame->length);
    is_bound = 1;
    wm_status here = decode_message(self, m, frame, &data, out, counts, err);
    if (here == WM_BAD_DATA) status = WM_BAD_DATA;
  }
  if (!is_bound) counts->ignored++;
  return out->count > 0 ? WM_OK : status;
}

size_t wm_can_decoder_matches(const wm_can_decoder *self, wm_can_match *out, size_t capacity) {
  size_t count = 0;
  for (size_t i = 0; i < self->message_count; i++) {
    const wm_can_match *m = &self->messages[i].match;
    size_t twin = 0;
    while (twin < i && (self->messages[twin].match.id != m->id || self->messages[twin].match.mask != m->mask ||
                        self->messages[twin].match.is_extended != m->is_extended))
      twin++;
    if (twin < i) continue;  // of another bus
    if (count < capacity) out[count] = *m;
    count++;
  }
  return count;
}

uint32_t wm_can_decoder_quantities(const wm_can_decoder *self) {
  uint32_t bits = 0;
  for (size_t i = 0; i < self->quantity_count; i++) bits |= UINT32_C(1) << self->quantities[i].quantity;
  return bits;
}
