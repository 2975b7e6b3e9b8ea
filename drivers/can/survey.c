// SPDX-License-Identifier: Apache-2.0
// What a log's first frames tell before they are decoded: ids, senders, and what its times are. Texts about them.
#include <stdarg.h>
#include <stdio.h>

#include "decoder.h"

// ── the first frames ────────────────────────────────────────────────────────────────────────────────────────────────

int wm_can_survey_take(wm_can_survey *self, const wm_can_frame *frame) {
  if (self->frames >= WM_CAN_SURVEY_FRAMES) return 0;
  if (self->frames++ == 0) {
    self->first_ns = frame->t_ns;
  } else {
    self->not_later += frame->t_ns <= self->last_ns;
    if (frame->t_ns - self->last_ns > self->rise_ns) self->rise_ns = frame->t_ns - self->last_ns;
  }
  self->last_ns = frame->t_ns;
  if (frame->is_error || frame->is_remote) return 1;
  size_t i = 0;
  while (i < self->count && (self->seen[i].id != frame->id || self->seen[i].is_extended != frame->is_extended ||
                             strcmp(self->seen[i].iface, frame->iface) != 0))
    i++;
  if (i == WM_CAN_SURVEY_IDS) return 1;
  wm_can_seen *seen = &self->seen[i];
  if (i == self->count) {
    *seen = (wm_can_seen){.id = frame->id, .is_extended = frame->is_extended, .first_ns = frame->t_ns};
    memcpy(seen->iface, frame->iface, sizeof seen->iface);
    self->count++;
  }
  self->runs += self->runs == 0 || self->newest != i;
  self->newest = i;
  seen->frames++;
  seen->last_ns = frame->t_ns;
  return 1;
}

// Differences begin with 0, or with the time since candump was started, and half of them are no larger than the one
// before. Stamps of a clock go back or repeat now and then: where two adapters are read, or one stamps to the
// millisecond. But they grow: the last one is many steps behind the first.
#define DIFFERENCES_SHARE 4  // at least one of so many
#define DIFFERENCES_FRAMES 8
#define DIFFERENCE_STEPS 2  // a difference is within so many of the largest rise
#define FIRST_DIFFERENCE_NS (60 * WM_NS_PER_S)

int wm_can_survey_has_differences(const wm_can_survey *self) {
  if (self->frames < DIFFERENCES_FRAMES || self->first_ns < 0 || self->first_ns > FIRST_DIFFERENCE_NS) return 0;
  return self->last_ns >= 0 && self->last_ns < FIRST_DIFFERENCE_NS &&
         self->last_ns - self->first_ns <= DIFFERENCE_STEPS * self->rise_ns &&
         DIFFERENCES_SHARE * self->not_later >= self->frames;
}

// ── texts ───────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct sink {
  char *out;
  size_t capacity, used;
} sink;

__attribute__((format(printf, 2, 3))) static void say(sink *s, const char *format, ...) {
  if (s->used + 1 >= s->capacity) return;
  va_list args;
  va_start(args, format);
  const int n = vsnprintf(s->out + s->used, s->capacity - s->used, format, args);
  va_end(args);
  if (n > 0) s->used = s->used + (size_t)n < s->capacity ? s->used + (size_t)n : s->capacity - 1;
}

static sink begin(char *out, size_t capacity) {
  if (capacity > 0) out[0] = '\0';
  return (sink){out, capacity, 0};
}

static void say_id(sink *s, uint32_t id, int is_extended) { say(s, is_extended ? "%08X" : "%03X", id); }

static const char *width(int is_extended) { return is_extended ? "29 bits" : "11 bits"; }

// How like an id is to a wanted one: the same number (also with the other width), the same PGN, nothing.
typedef enum likeness { UNLIKE, SAME_PGN, SAME_NUMBER } likeness;

static likeness likeness_of(const wm_can_seen *seen, uint32_t id, int is_extended) {
  if (seen->id == id) return SAME_NUMBER;
  if (!seen->is_extended || !is_extended) return UNLIKE;
  return ((seen->id ^ id) & wm_j1939_pgn_mask(id)) == 0 ? SAME_PGN : UNLIKE;
}

const wm_can_seen *wm_can_survey_nearest(const wm_can_survey *self, uint32_t id, int is_extended) {
  const wm_can_seen *best = NULL;
  likeness how = UNLIKE;
  for (size_t i = 0; i < self->count; i++) {
    const likeness here = likeness_of(&self->seen[i], id, is_extended);
    const int is_better = here > how || (here != UNLIKE && here == how && self->seen[i].frames > best->frames);
    if (!is_better) continue;
    how = here;
    best = &self->seen[i];
  }
  return best;
}

#define NAMED_IDS 5

// The most frequent ids, each once.
static void say_most(sink *s, const wm_can_survey *seen) {
  uint64_t below = UINT64_MAX;
  size_t named = 0;
  while (named < NAMED_IDS) {
    uint64_t most = 0;
    for (size_t i = 0; i < seen->count; i++)
      if (seen->seen[i].frames < below && seen->seen[i].frames > most) most = seen->seen[i].frames;
    if (most == 0) break;
    for (size_t i = 0; i < seen->count && named < NAMED_IDS; i++) {
      if (seen->seen[i].frames != most) continue;
      say(s, named++ ? ", " : " ");
      say_id(s, seen->seen[i].id, seen->seen[i].is_extended);
    }
    below = most;
  }
  if (named < seen->count) say(s, " ...");
}

static int is_on_another_bus(const bound_message *m, const wm_can_seen *seen) {
  return m->bus[0] && strcmp(m->bus, seen->iface) != 0 && wm_can_matches(&m->match, seen->id, seen->is_extended);
}

static void say_missing(sink *s, const bound_message *m, const wm_can_survey *seen) {
  const wm_can_seen *near = wm_can_survey_nearest(seen, m->match.id, m->match.is_extended);
  say(s, "%sno frame of %s (", s->used ? "; " : "", m->name);
  say_id(s, m->match.id, m->match.is_extended);
  say(s, ", %s) came", width(m->match.is_extended));
  if (near && is_on_another_bus(m, near)) {
    say(s, " on bus %s, but on %s; correct `bus:`", m->bus, near->iface);
  } else if (near) {
    say(s, ", but %llu of ", (unsigned long long)near->frames);
    say_id(s, near->id, near->is_extended);
    say(s, " (%s%s); write BO_ %llu in the DBC", width(near->is_extended),
        near->id != m->match.id ? ", the same PGN" : "",
        (unsigned long long)near->id | (near->is_extended ? 1ull << 31 : 0));
  } else if (seen->count > 0) {
    say(s, "; the bus has");
    say_most(s, seen);
  } else {
    say(s, "; no data frame came at all");
  }
}

size_t wm_can_decoder_missing(const wm_can_decoder *self, const wm_can_survey *seen, char *out, size_t capacity) {
  sink s = begin(out, capacity);
  for (size_t i = 0; i < self->message_count; i++)
    if (self->messages[i].frames == 0) say_missing(&s, &self->messages[i], seen);
  return s.used;
}

static int is_of(const bound_message *m, const wm_can_seen *seen) {
  return wm_can_matches(&m->match, seen->id, seen->is_extended) && (!m->bus[0] || strcmp(m->bus, seen->iface) == 0);
}

// The next sender of the message from index *i on; the same one with another priority or destination is passed over.
static const wm_can_seen *next_sender(const bound_message *m, const wm_can_survey *seen, size_t *i) {
  for (; *i < seen->count; (*i)++) {
    const wm_can_seen *here = &seen->seen[*i];
    size_t before = 0;
    while (before < *i && !(is_of(m, &seen->seen[before]) &&
                            same_sender(seen->seen[before].id, seen->seen[before].iface, here->id, here->iface)))
      before++;
    if (before < *i || !is_of(m, here)) continue;
    (*i)++;
    return here;
  }
  return NULL;
}

// Whether one begins behind the end of the other: a unit with another address (sender.h).
static int is_in_turn(const wm_can_seen *a, const wm_can_seen *b) {
  return a->first_ns > b->last_ns || b->first_ns > a->last_ns;
}

// The first of several senders of a message is the one that is taken, or the one that has the DBC's id.
static void say_senders(sink *s, const bound_message *m, const wm_can_survey *seen) {
  const wm_can_seen *here, *taken = NULL;
  size_t count = 0;
  int is_other_bus = 0;
  for (size_t i = 0; (here = next_sender(m, seen, &i)); count++)
    if (!taken || (here->id == m->match.id && taken->id != m->match.id)) taken = here;
  size_t beside = 0;
  for (size_t i = 0; (here = next_sender(m, seen, &i));) beside += here != taken && !is_in_turn(here, taken);
  if (beside == 0) return;
  say(s, "%s%s is sent by %zu:", s->used ? "; " : "", m->name, count);
  for (size_t i = 0, named = 0; named < NAMED_IDS && (here = next_sender(m, seen, &i));) {
    say(s, named++ ? ", " : " ");
    say_id(s, here->id, here->is_extended);
    say(s, " on %s", here->iface);
    is_other_bus |= strcmp(here->iface, taken->iface) != 0;
  }
  say(s, ". Taken is ");
  say_id(s, taken->id, taken->is_extended);
  say(s, " on %s; for another one write %s", taken->iface,
      is_other_bus ? "`bus:` in can-signals.yaml" : "its whole id in the DBC's BO_ line");
}

size_t wm_can_decoder_senders(const wm_can_decoder *self, const wm_can_survey *seen, char *out, size_t capacity) {
  sink s = begin(out, capacity);
  for (size_t i = 0; i < self->message_count; i++) say_senders(&s, &self->messages[i], seen);
  return s.used;
}

#define FLOATS_LEAST 10

static void say_float(sink *s, const bound_message *m, const bound_signal *is) {
  if (is->others > 0 || is->floats < FLOATS_LEAST) return;
  const signal_bits as = {.kind = is->bits.length == 32 ? SIGNAL_FLOAT : SIGNAL_DOUBLE};
  if (s->used == 0)
    say(s, "the %u bits of all %u values of %s.%s are floating-point numbers (the first is %.6g); write in the DBC",
        is->bits.length, is->floats, m->name, is->name, signal_number(&as, is->first_float));
  say(s, " `SIG_VALTYPE_ %llu %s : %d;`", (unsigned long long)m->match.id | (m->match.is_extended ? 1ull << 31 : 0),
      is->name, is->bits.length == 32 ? 1 : 2);
}

size_t wm_can_decoder_floats(const wm_can_decoder *self, char *out, size_t capacity) {
  sink s = begin(out, capacity);
  for (size_t i = 0; i < self->message_count; i++) {
    const bound_message *m = &self->messages[i];
    for (uint32_t q = m->first_quantity; q < m->first_quantity + m->quantity_count; q++)
      for (uint32_t k = 0; k < self->quantities[q].signal_count; k++)
        say_float(&s, m, &self->signals[self->quantities[q].first_signal + k]);
  }
  return s.used;
}
