// SPDX-License-Identifier: Apache-2.0
// Makes a decoder: each line of can-signals.yaml is checked against the DBC and refused where it cannot be right.
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "decoder.h"
#include "names.h"
#include "waymark/event.h"

enum { kTickBitsMin = 4, kSentinelBitsMin = 8 };

typedef struct maker {
  const wm_dbc *dbc;
  const wm_can_binding *binding;  // the line in work
  const dbc_message *message;     // its message
  wm_can_decoder *self;
  wm_error *err;
} maker;

// "FILE:LINE: QUANTITY: ...".
__attribute__((format(printf, 2, 3))) static wm_status refuse(maker *m, const char *format, ...) {
  char what[WM_ERROR_TEXT_MAX];
  va_list args;
  va_start(args, format);
  (void)vsnprintf(what, sizeof what, format, args);
  va_end(args);
  const wm_can_binding *b = m->binding;
  return wm_fail(m->err, WM_BAD_CONFIG, "%s:%d: %s: %s", b->file[0] ? b->file : "can-signals.yaml", b->line,
                 wm_can_quantity_name((unsigned)b->quantity), what);
}

static int is_ticks(const wm_can_binding *b) {
  return b->quantity == WM_Q_WHEEL_TICKS_LEFT || b->quantity == WM_Q_WHEEL_TICKS_RIGHT;
}
static int is_gear(const wm_can_binding *b) { return b->quantity == WM_Q_GEAR; }

// ── message and signal by name ──────────────────────────────────────────────────────────────────────────────────────

// Keeps the name nearest to the wanted one.
typedef struct nearest {
  wm_text asked, best;
  size_t distance;
} nearest;

static void consider(nearest *n, wm_text name) {
  size_t d = name.length ? wm_text_distance(n->asked, name, n->distance) : n->distance + 1;
  if (d >= n->distance) return;
  n->distance = d;
  n->best = name;
}

static wm_status find_message(maker *m) {
  const wm_dbc *dbc = m->dbc;
  wm_text asked = text_of(m->binding->message);
  nearest near = {.asked = asked, .distance = asked.length / 3 + 2};
  const dbc_message *found = NULL;
  for (size_t i = 0; i < dbc->message_count; i++) {
    const dbc_message *here = &dbc->messages[i];
    consider(&near, here->name);
    consider(&near, here->long_name);
    if (text_compare(here->name, asked) != 0 && text_compare(here->long_name, asked) != 0) continue;
    if (found)
      return refuse(m, "%s has two messages named %s, in lines %d and %d; rename one of them", dbc->path,
                    m->binding->message, found->line, here->line);
    found = here;
  }
  for (size_t i = 0; !found && i < dbc->message_count; i++)
    if (dbc->messages[i].twin_line > 0 && text_compare(dbc->messages[i].twin, asked) == 0)
      return refuse(m, "message '%s' (%s:%d) has the id of %s in line %d, which is taken; remove one of them",
                    m->binding->message, dbc->path, dbc->messages[i].twin_line,
                    wm_text_shown(dbc->messages[i].name).text, dbc->messages[i].line);
  if (!found && near.best.length)
    return refuse(m, "message '%s' is not in %s; did you mean %s?", m->binding->message, dbc->path,
                  wm_text_shown(near.best).text);
  if (!found)
    return refuse(m, "message '%s' is not among the %zu messages of %s", m->binding->message, dbc->message_count,
                  dbc->path);
  if (found->length > WM_CAN_DATA_MAX)
    return refuse(m, "%s has %u bytes (%s:%d), which go over several frames; 64 at most can be decoded",
                  m->binding->message, found->length, dbc->path, found->line);
  m->message = found;
  return WM_OK;
}

static const dbc_signal *signal_named(const maker *m, wm_text asked, nearest *near) {
  for (uint32_t i = 0; i < m->message->signal_count; i++) {
    const dbc_signal *s = &m->dbc->signals[m->message->first_signal + i];
    if (text_compare(s->name, asked) == 0 || text_compare(s->long_name, asked) == 0) return s;
    consider(near, s->name);
    consider(near, s->long_name);
  }
  return NULL;
}

static wm_status find_signal(maker *m, const char *name, const dbc_signal **out) {
  nearest near = {.asked = text_of(name), .distance = strlen(name) / 3 + 2};
  *out = signal_named(m, near.asked, &near);
  if (*out) return WM_OK;
  if (near.best.length)
    return refuse(m, "message %s has no signal '%s'; did you mean %s?", m->binding->message, name,
                  wm_text_shown(near.best).text);
  char names[256];
  size_t used = 0;
  names[0] = '\0';
  for (uint32_t i = 0; i < m->message->signal_count && used < sizeof names; i++) {
    const dbc_signal *s = &m->dbc->signals[m->message->first_signal + i];
    used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", wm_text_shown(s->name).text);
  }
  return refuse(m, "message %s has no signal '%s'; it has %s", m->binding->message, name, names[0] ? names : "none");
}

// ── one signal ──────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status bind_unit(maker *m, const dbc_signal *s, const char *name, double *si) {
  const wm_can_binding *b = m->binding;
  wm_dimension wanted = wm_quantity_dimension(b->quantity), found = WM_DIM_NONE;
  wm_text unit = b->unit[0] ? text_of(b->unit) : s->unit;
  shown unit_shown = wm_text_shown(unit);
  int known = wm_unit_find(unit, &found, si);
  if (wanted == WM_DIM_NONE) {  // counts: any unit of the DBC
    *si = 1.0;
    if (known)
      return refuse(m, "%s is in '%s', but this quantity is a bare number; bind the signal that counts", name,
                    unit_shown.text);
    return WM_OK;
  }
  if (known && found == WM_DIM_ANGULAR_RATE && wanted == WM_DIM_SPEED)
    return refuse(m,
                  "%s is in '%s', a rate of turning, and the wheel's radius is not known here; write `unit: m/s` and "
                  "`scale:` metres a second for one %s (for rpm of the wheel: 0.10472 times its radius in m)",
                  name, unit_shown.text, unit_shown.text);
  if (known && found != wanted)
    return refuse(m, "%s is in '%s', which is not a unit of this quantity (%s)", name, unit_shown.text,
                  wm_dimension_units(wanted));
  if (!known && unit.length == 0)
    return refuse(m, "%s has no unit in %s:%d; write `unit:` (%s)", name, m->dbc->path, s->line,
                  wm_dimension_units(wanted));
  if (!known)
    return refuse(m, "unit '%s' of %s is not known; write `unit:` (%s)", unit_shown.text, name,
                  wm_dimension_units(wanted));
  return WM_OK;
}

static wm_status bind_selectors(maker *m, const dbc_signal *s, const char *name, bound_signal *out) {
  uint32_t above[DBC_SELECTORS_MAX];
  int count = wm_dbc_selectors(m->dbc, s, above);
  if (count < 0)
    return refuse(m,
                  "%s (%s:%d) is multiplexed, but the file does not state by which signal: one M in the message, or "
                  "SG_MUL_VAL_ lines without a ring, are needed",
                  name, m->dbc->path, s->line);
  wm_can_decoder *self = m->self;
  out->first_selector = (uint32_t)self->selector_count;
  out->selector_count = (uint32_t)count;
  for (int i = 0; i < count; i++) {
    const dbc_signal *selector = &m->dbc->signals[above[i]];
    bound_selector *b = &self->selectors[self->selector_count++];
    if (signal_bytes(&selector->bits) > m->message->length)
      return refuse(m, "multiplexer %s (%s:%d) does not fit into the %u bytes of its message",
                    wm_text_shown(selector->name).text, m->dbc->path, selector->line, m->message->length);
    b->bits = selector->bits;
    b->first_range = s->first_range;
    b->range_count = s->range_count;
    if (s->range_count == 0) {
      b->first_range = (uint32_t)self->range_count;
      b->range_count = 1;
      self->ranges[self->range_count++] = (dbc_range){s->selected_by, s->selected_by};
    }
    s = selector;
  }
  return WM_OK;
}

#define WHOLE_ID 0x1FFFFFFFu  // of 29 bits: a J1939 message is taken by its PGN alone

static void add_no_value(bound_signal *out, uint64_t raw) {
  if (out->no_value_count < NO_VALUE_MAX) out->no_value[out->no_value_count++] = raw;
}

// Raw values for "no measurement": those named so by VAL_, and the outermost ones (all bits set; of signed signals the
// least and the largest) where the DBC's range excludes them. Other values outside of the range are taken: ranges in
// DBC files are often wrong.
static void find_no_values(const maker *m, const dbc_signal *s, bound_signal *out) {
  if (s->bits.kind != SIGNAL_UNSIGNED && s->bits.kind != SIGNAL_SIGNED) return;
  uint64_t top = s->bits.length == 64 ? UINT64_MAX : (UINT64_C(1) << s->bits.length) - 1u;
  for (uint32_t i = 0; i < s->value_count; i++) {
    const dbc_value *v = &m->dbc->values[s->first_value + i];
    int64_t least = s->bits.kind == SIGNAL_SIGNED ? sign_extend(top / 2 + 1, s->bits.length) : 0;
    int fits = v->raw < 0 ? v->raw >= least : (uint64_t)v->raw <= top;
    if (fits && wm_means_no_value(v->name)) add_no_value(out, (uint64_t)v->raw & top);
  }
  if (!(s->min < s->max) || s->bits.length < kSentinelBitsMin) return;
  uint64_t outermost[2] = {top, top};
  if (s->bits.kind == SIGNAL_SIGNED) {
    outermost[0] = top / 2 + 1;
    outermost[1] = top / 2;
  }
  for (int i = 0; i < (s->bits.kind == SIGNAL_SIGNED ? 2 : 1); i++) {
    double value = signal_number(&s->bits, outermost[i]) * s->factor + s->offset;
    if (value < s->min || value > s->max) add_no_value(out, outermost[i]);
  }
}

// SAE J1939-71: the highest byte from FB on is no value (FE: an error, FF: not available), of one, two and four bytes.
static void find_j1939_no_values(const maker *m, const dbc_signal *s, bound_signal *out) {
  const uint32_t length = s->bits.length;
  const int is_j1939 = m->message->is_extended && wm_dbc_match(m->dbc, m->message).mask != WHOLE_ID;
  if (!is_j1939 || s->bits.kind != SIGNAL_UNSIGNED || (length != 8 && length != 16 && length != 32)) return;
  const uint64_t from = UINT64_C(0xFB) << (length - 8);
  if (s->min < s->max && signal_number(&s->bits, from) * s->factor + s->offset > s->max) out->no_value_from = from;
}

static wm_status bind_signal(maker *m, const char *name) {
  const dbc_signal *s = NULL;
  wm_status status = find_signal(m, name, &s);
  if (status != WM_OK) return status;
  bound_signal *out = &m->self->signals[m->self->signal_count++];
  *out = (bound_signal){.bits = s->bits, .factor = s->factor, .offset = s->offset};
  (void)snprintf(out->name, sizeof out->name, "%s", name);
  if (signal_bytes(&s->bits) > m->message->length)
    return refuse(m, "%s (%s:%d) needs %u bytes, but %s has %u; one of the two is wrong in the DBC", name, m->dbc->path,
                  s->line, signal_bytes(&s->bits), m->binding->message, m->message->length);
  if (s->factor == 0.0)
    return refuse(m, "%s (%s:%d) has the factor 0 in the DBC, so its value is always the same", name, m->dbc->path,
                  s->line);
  int is_float = s->bits.kind == SIGNAL_FLOAT || s->bits.kind == SIGNAL_DOUBLE;
  if (is_float && (is_ticks(m->binding) || is_gear(m->binding)))
    return refuse(m, "%s is a floating-point number; an integer signal is needed", name);
  if (is_ticks(m->binding) && s->bits.length < kTickBitsMin)
    return refuse(m, "%s has %u bits; a counter that wraps so soon cannot be followed (%d at least)", name,
                  s->bits.length, kTickBitsMin);
  if ((status = bind_unit(m, s, name, &out->si)) != WM_OK) return status;
  if (!is_ticks(m->binding) && !is_gear(m->binding)) {
    find_no_values(m, s, out);
    find_j1939_no_values(m, s, out);
  }
  return bind_selectors(m, s, name, out);
}

// ── one quantity ────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status bind_gear_by_names(maker *m, bound_quantity *q) {
  const dbc_signal *s = NULL;
  wm_status status = find_signal(m, m->binding->signal[0], &s);
  if (status != WM_OK) return status;
  char names[200];
  size_t used = 0;
  names[0] = '\0';
  for (uint32_t i = 0; i < s->value_count; i++) {
    const dbc_value *v = &m->dbc->values[s->first_value + i];
    double direction = 0.0;
    if (used < sizeof names)
      used +=
          (size_t)snprintf(names + used, sizeof names - used, "%s\"%s\"", i ? ", " : "", wm_text_shown(v->name).text);
    if (q->gear_count == WM_CAN_VALUES_MAX || !wm_gear_direction(v->name, &direction)) continue;
    q->gear[q->gear_count].raw = (double)v->raw;
    q->gear[q->gear_count++].direction = direction;
  }
  if (q->gear_count > 0) return WM_OK;
  return refuse(m, "%s%s%s; write `values: {forward: [1], reverse: [2], neutral: [0]}` with the signal's raw values",
                names[0] ? "none of the names in VAL_ (" : "the DBC has no VAL_ names for this signal", names,
                names[0] ? ") is a gear" : "");
}

static wm_status bind_gear(maker *m, bound_quantity *q) {
  const wm_can_binding *b = m->binding;
  if (b->signal_count != 1) return refuse(m, "a gear is one signal, not a sum of %u", b->signal_count);
  if (b->gear_count == 0) return bind_gear_by_names(m, q);
  if (b->gear_count > WM_CAN_VALUES_MAX) return refuse(m, "more than %d values", WM_CAN_VALUES_MAX);
  for (uint32_t i = 0; i < b->gear_count; i++) {
    for (uint32_t k = 0; k < i; k++)
      if (b->gear[k].raw == b->gear[i].raw)
        return refuse(m, "values: %g appears twice; each raw value is one gear", b->gear[i].raw);
    q->gear[i].raw = b->gear[i].raw;
    q->gear[i].direction = b->gear[i].direction;
  }
  q->gear_count = b->gear_count;
  return WM_OK;
}

static wm_status bind_quantity(maker *m) {
  const wm_can_binding *b = m->binding;
  wm_can_decoder *self = m->self;
  bound_quantity *q = &self->quantities[self->quantity_count++];
  *q = (bound_quantity){.quantity = b->quantity, .scale = b->scale, .offset = b->offset};
  q->first_signal = (uint32_t)self->signal_count;
  q->signal_count = b->signal_count;
  if (b->signal_count < 1 || b->signal_count > WM_CAN_SUM_MAX)
    return refuse(m, "%u signals; 1 to %d can be summed", b->signal_count, WM_CAN_SUM_MAX);
  if (!isfinite(b->scale) || b->scale == 0.0 || !isfinite(b->offset))
    return refuse(m, "scale must be a number other than 0 (1 or -1 as a rule), offset a number");
  for (uint32_t i = 0; i < b->signal_count; i++) {
    for (uint32_t k = 0; k < i; k++)
      if (strcmp(b->signal[k], b->signal[i]) == 0) return refuse(m, "signal %s is summed twice", b->signal[i]);
    wm_status status = bind_signal(m, b->signal[i]);
    if (status != WM_OK) return status;
  }
  return is_gear(b) ? bind_gear(m, q) : WM_OK;
}

// ── all of them ─────────────────────────────────────────────────────────────────────────────────────────────────────

static int is_bound(const maker *m, const bound_message *message, const dbc_signal *s) {
  for (uint32_t q = 0; q < message->quantity_count; q++) {
    const bound_quantity *quantity = &m->self->quantities[message->first_quantity + q];
    for (uint32_t i = 0; i < quantity->signal_count; i++)
      if (signal_same(&m->self->signals[quantity->first_signal + i].bits, &s->bits)) return 1;
  }
  return 0;
}

// The signal of the message whose name is most like a rolling counter's; decoding verifies it.
static void find_counter(const maker *m, bound_message *out) {
  int best = 0;
  for (uint32_t i = 0; i < m->message->signal_count; i++) {
    const dbc_signal *s = &m->dbc->signals[m->message->first_signal + i];
    int likeness = wm_counter_likeness(s->name);
    if (likeness <= best || s->bits.kind != SIGNAL_UNSIGNED || s->bits.length < 2 || s->bits.length > 16) continue;
    if (s->unit.length > 0 || s->is_selected || s->is_selector || is_bound(m, out, s)) continue;
    if (signal_bytes(&s->bits) > m->message->length) continue;
    best = likeness;
    out->counter.is_there = 1;
    out->counter.bits = s->bits;
  }
}

static wm_status refuse_twice_bound(maker *m, const wm_can_binding *bindings, size_t count) {
  for (size_t i = 0; i < count; i++) {
    m->binding = &bindings[i];
    if (bindings[i].quantity < 0 || bindings[i].quantity >= WM_CAN_COUNT)
      return refuse(m, "%d is not a quantity", bindings[i].quantity);
    for (size_t k = 0; k < i; k++)
      if (bindings[k].quantity == bindings[i].quantity)
        return refuse(m, "bound twice; the first time in line %d", bindings[k].line);
  }
  return WM_OK;
}

static void note_twins(maker *m) {
  const dbc_message *is = m->message;
  if (is->twin_line == 0 || m->self->twins[0]) return;
  (void)snprintf(m->self->twins, sizeof m->self->twins,
                 "%.100s:%d: BO_ %.40s has the id 0x%X of %.40s in line %d, which is taken; remove one of them",
                 m->dbc->path, is->twin_line, wm_text_shown(is->twin).text, is->id, wm_text_shown(is->name).text,
                 is->line);
}

// The lines of one message and bus, from bindings[first] on, become one bound_message.
static wm_status bind_group(maker *m, const wm_can_binding *bindings, size_t count, size_t first, uint32_t *done) {
  wm_can_decoder *self = m->self;
  bound_message *out = &self->messages[self->message_count++];
  for (size_t i = first; i < count; i++) {
    if (*done & (1u << i) || strcmp(bindings[i].message, bindings[first].message) != 0 ||
        strcmp(bindings[i].bus, bindings[first].bus) != 0)
      continue;
    *done |= 1u << i;
    m->binding = &bindings[i];
    wm_status status = i == first ? find_message(m) : WM_OK;
    if (i == first) out->first_quantity = (uint32_t)self->quantity_count;
    if (status == WM_OK) status = bind_quantity(m);
    if (status != WM_OK) return status;
    if (++out->quantity_count > WM_QUANTITIES_MAX)
      return refuse(m, "more than %d quantities from one message", WM_QUANTITIES_MAX);
  }
  note_twins(m);
  out->match = wm_dbc_match(m->dbc, m->message);
  (void)snprintf(out->bus, sizeof out->bus, "%s", bindings[first].bus);
  (void)snprintf(out->name, sizeof out->name, "%s", bindings[first].message);
  find_counter(m, out);
  return WM_OK;
}

static int by_id(const void *a, const void *b) {
  const bound_message *x = a, *y = b;
  if (x->match.id != y->match.id) return x->match.id > y->match.id ? 1 : -1;
  return x->match.is_extended - y->match.is_extended;
}

static wm_can_decoder *allocate(size_t dbc_ranges) {
  enum {
    kQuantities = WM_CAN_COUNT,
    kSignals = kQuantities * WM_CAN_SUM_MAX,
    kSelectors = kSignals * DBC_SELECTORS_MAX
  };
  wm_can_decoder *self = calloc(1, sizeof *self);
  if (!self) return NULL;
  self->messages = calloc(kQuantities, sizeof *self->messages);
  self->quantities = calloc(kQuantities, sizeof *self->quantities);
  self->signals = calloc(kSignals, sizeof *self->signals);
  self->selectors = calloc(kSelectors, sizeof *self->selectors);
  self->ranges = calloc(dbc_ranges + kSelectors, sizeof *self->ranges);
  if (self->messages && self->quantities && self->signals && self->selectors && self->ranges) return self;
  wm_can_decoder_free(self);
  return NULL;
}

wm_status wm_can_decoder_make(const wm_dbc *dbc, const wm_can_binding *bindings, size_t count, wm_can_decoder **out,
                              wm_error *err) {
  *out = NULL;
  maker m = {.dbc = dbc, .err = err};
  wm_status status = refuse_twice_bound(&m, bindings, count);  // so there are at most WM_CAN_COUNT
  if (status != WM_OK) return status;
  if (!(m.self = allocate(dbc->range_count))) return wm_fail(err, WM_FULL, "no memory for the CAN decoder");
  if (dbc->range_count > 0) memcpy(m.self->ranges, dbc->ranges, dbc->range_count * sizeof *dbc->ranges);
  m.self->range_count = dbc->range_count;
  uint32_t done = 0;
  for (size_t i = 0; i < count && status == WM_OK; i++)
    if (!(done & (1u << i))) status = bind_group(&m, bindings, count, i, &done);
  if (status != WM_OK) {
    wm_can_decoder_free(m.self);
    return status;
  }
  qsort(m.self->messages, m.self->message_count, sizeof *m.self->messages, by_id);
  *out = m.self;
  return WM_OK;
}

const char *wm_can_decoder_twins(const wm_can_decoder *self) { return self->twins; }

void wm_can_decoder_free(wm_can_decoder *self) {
  if (!self) return;
  free(self->messages);
  free(self->quantities);
  free(self->signals);
  free(self->selectors);
  free(self->ranges);
  free(self);
}
