// SPDX-License-Identifier: Apache-2.0
// What faults do to the data. All depends on the time of a datum and its number alone.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "player.h"

#define LOAD_ID 0x7FF  // the lowest priority, so that frames of the robot are only delayed

static const wm_fault *at(const wm_play *self, wm_fault_kind kind, uint16_t stream, double at_s) {
  return wm_faults_at(self->options.faults, kind, self->stream[stream].of, at_s);
}

static int has_id(const wm_fault *f, uint32_t id) {
  for (size_t i = 0; i < f->id_count; i++)
    if (f->ids[i] == id) return 1;
  return f->id_count == 0;
}

// As `at`, for a frame's identity: a fault of other ids does not hide one behind it.
static const wm_fault *at_id(const wm_play *self, wm_fault_kind kind, uint16_t stream, double at_s, uint32_t id) {
  const wm_faults *faults = self->options.faults;
  for (size_t i = 0; faults && i < faults->count; i++) {
    const wm_fault *f = &faults->fault[i];
    if (f->kind == kind && at_s >= f->from_s && at_s < f->until_s && has_id(f, id) &&
        (!f->of[0] || strcmp(f->of, self->stream[stream].of) == 0))
      return f;
  }
  return NULL;
}

// ── CAN ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

static void reverse_words(wm_can_frame *frame, unsigned word) {
  for (unsigned from = 0; from + word <= frame->length; from += word)
    for (unsigned i = 0; i < word / 2; i++) {
      const uint8_t kept = frame->data[from + i];
      frame->data[from + i] = frame->data[from + word - 1 - i];
      frame->data[from + word - 1 - i] = kept;
    }
}

static int apply_to_frame(wm_play *self, uint16_t stream, double at_s, wm_play_item *out) {
  static const wm_fault_kind kNothing[] = {WM_FAULT_BUS_DOWN, WM_FAULT_BUS_REMOVED, WM_FAULT_BUS_OFF};
  wm_can_frame *frame = &out->frame;
  *frame = self->datum.frame;
  for (size_t i = 0; i < sizeof kNothing / sizeof kNothing[0]; i++)
    if (at(self, kNothing[i], stream, at_s)) return 0;
  if (at_id(self, WM_FAULT_BUS_SILENT, stream, at_s, frame->id)) return 0;
  const wm_fault *f = at_id(self, WM_FAULT_BUS_DROPPED, stream, at_s, frame->id);
  if (f && wm_fault_hits(out->number, f->param[0])) return 0;
  f = at_id(self, WM_FAULT_BUS_BYTE_ORDER, stream, at_s, frame->id);
  if (f && !frame->is_error && !frame->is_remote) reverse_words(frame, (unsigned)f->param[0]);
  f = at_id(self, WM_FAULT_BUS_DUPLICATED, stream, at_s, frame->id);
  if (f && wm_fault_hits(out->number, f->param[0]) && !self->state[stream].is_left_out &&
      out->due_ns >= self->from_ns) {
    self->again = *out;
    self->has_again = 1;
  }
  return 1;
}

// ── pictures and messages ───────────────────────────────────────────────────────────────────────────────────────────

// The last picture before it freezes is kept, also where that one was left out.
static void hold(wm_play *self, uint16_t stream, double at_s) {
  play_state *state = &self->state[stream];
  const int is_frozen = at(self, WM_FAULT_CAMERA_FROZEN, stream, at_s) != NULL;
  if (is_frozen && state->held.length > 0) {
    state->has_held = 1;
    return;
  }
  state->has_held = 0;
  state->held = self->datum.picture;
}

static int apply_to_picture(wm_play *self, uint16_t stream, double at_s, wm_play_item *out) {
  hold(self, stream, at_s);
  if (at(self, WM_FAULT_CAMERA_UNPLUGGED, stream, at_s) || at(self, WM_FAULT_CAMERA_STALLED, stream, at_s)) return 0;
  const wm_fault *f = at(self, WM_FAULT_CAMERA_DROPPED, stream, at_s);
  if (f && wm_fault_hits(out->number, f->param[0])) return 0;
  f = at(self, WM_FAULT_CAMERA_DAMAGED, stream, at_s);
  out->is_damaged = f && wm_fault_hits(out->number, f->param[0]);
  f = at(self, WM_FAULT_CAMERA_CLOCK_AHEAD, stream, at_s);
  if (f) out->ahead_ns = wm_ns_from_seconds(f->param[0]);
  return 1;
}

static int apply_to_message(wm_play *self, uint16_t stream, double at_s, wm_play_item *out) {
  out->t_ns = self->datum.t_ns - self->first_ns + self->base_ns;
  out->data = self->datum.message;
  out->bytes = self->datum.bytes;
  if (at(self, WM_FAULT_STREAM_SILENT, stream, at_s)) return 0;
  const wm_fault *f = at(self, WM_FAULT_STREAM_DROPPED, stream, at_s);
  if (f && wm_fault_hits(out->number, f->param[0])) return 0;
  f = at(self, WM_FAULT_STREAM_CLOCK_AHEAD, stream, at_s);
  if (f) out->t_ns += wm_ns_from_seconds(f->param[0]);
  return 1;
}

int play_apply(wm_play *self, uint16_t stream, uint32_t number, wm_time_ns due_ns, wm_play_item *out) {
  const double at_s = (double)due_ns * 1e-9;
  *out = (wm_play_item){.kind = self->stream[stream].kind, .due_ns = due_ns, .stream = stream, .number = number};
  switch (out->kind) {
    case WM_PLAY_CAN: return apply_to_frame(self, stream, at_s, out);
    case WM_PLAY_PICTURE: return apply_to_picture(self, stream, at_s, out);
    case WM_PLAY_MESSAGE: return apply_to_message(self, stream, at_s, out);
    case WM_PLAY_FAULT: break;
  }
  return 0;
}

// ── begins, ends, and frames that are added ─────────────────────────────────────────────────────────────────────────

// What a fault of this kind may name; NULL: of no stream.
static int names_stream(const wm_fault_kind_row *row, const wm_play_stream *s, const char *of) {
  static const char *const kOf[] = {[WM_PLAY_CAN] = "bus", [WM_PLAY_PICTURE] = "camera", [WM_PLAY_MESSAGE] = "stream"};
  return strcmp(row->of, kOf[s->kind]) == 0 && (!of[0] || strcmp(of, s->of) == 0);
}

static wm_status check_of(const wm_play *self, const wm_fault *f, wm_error *err) {
  const wm_fault_kind_row *row = wm_fault_kind_of(f->kind);
  char there[256] = "";
  if (!row->of) return WM_OK;
  for (size_t i = 0; i < self->stream_count; i++) {
    const wm_play_stream *s = &self->stream[i];
    if (names_stream(row, s, f->of)) return WM_OK;
    const size_t used = strlen(there);
    if (names_stream(row, s, "") && !strstr(there, s->of))
      (void)snprintf(there + used, sizeof there - used, "%s%s", used ? ", " : "", s->of);
  }
  if (!f->of[0]) return WM_OK;  // of all, and there is none: nothing happens
  return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s: %s has no %s '%s'%s%s", self->options.faults->path, f->line, f->name,
                 self->dir, row->of, f->of, there[0] ? "; it has " : "", there);
}

static int by_time(const void *a, const void *b) {
  const play_edge *x = a, *y = b;
  if (x->due_ns != y->due_ns) return x->due_ns < y->due_ns ? -1 : 1;
  if (x->begins != y->begins) return x->begins - y->begins;  // what ends, ends before another begins
  return (x->fault > y->fault) - (x->fault < y->fault);
}

static wm_status add_load(wm_play *self, size_t fault, wm_error *err) {
  const wm_fault *f = &self->options.faults->fault[fault];
  for (size_t i = 0; i < self->stream_count; i++) {
    if (!names_stream(wm_fault_kind_of(f->kind), &self->stream[i], f->of)) continue;
    if (self->load_count == PLAY_LOADS_MAX)
      return wm_fail(err, WM_FULL, "%s: more than %d faults and buses with bus_load", self->options.faults->path,
                     PLAY_LOADS_MAX);
    const double before_s = (double)self->from_ns * 1e-9 - f->from_s;
    self->load[self->load_count++] =
        (play_load){fault, (uint16_t)i, before_s > 0 ? (uint64_t)ceil(before_s * f->param[0]) : 0};
  }
  return WM_OK;
}

wm_status play_faults_begin(wm_play *self, wm_error *err) {
  const wm_faults *faults = self->options.faults;
  if (!faults || faults->count == 0) return WM_OK;
  self->edge = calloc(2 * faults->count, sizeof *self->edge);
  if (!self->edge) return wm_fail(err, WM_IO, "%s: no memory for its faults", self->dir);
  for (size_t i = 0; i < faults->count; i++) {
    const wm_fault *f = &faults->fault[i];
    wm_status status = check_of(self, f, err);
    if (status == WM_OK && f->kind == WM_FAULT_BUS_LOAD) status = add_load(self, i, err);
    if (status != WM_OK) return status;
    const wm_time_ns from_ns = wm_ns_from_seconds(f->from_s);
    const wm_time_ns until_ns = isfinite(f->until_s) ? wm_ns_from_seconds(f->until_s) : INT64_MAX;
    if (until_ns <= self->from_ns && from_ns < self->from_ns) continue;  // over
    self->edge[self->edge_count++] = (play_edge){from_ns > self->from_ns ? from_ns : self->from_ns, i, 1};
    if (until_ns < INT64_MAX && until_ns > from_ns) self->edge[self->edge_count++] = (play_edge){until_ns, i, 0};
  }
  qsort(self->edge, self->edge_count, sizeof *self->edge, by_time);
  return WM_OK;
}

static wm_time_ns load_due_ns(const wm_play *self, const play_load *load) {
  const wm_fault *f = &self->options.faults->fault[load->fault];
  const double at_s = f->from_s + (double)load->next / f->param[0];
  if (at_s >= f->until_s || self->state[load->stream].is_left_out) return INT64_MAX;
  return wm_ns_from_seconds(at_s);
}

static const play_load *next_load(const wm_play *self, wm_time_ns *due_ns) {
  const play_load *best = NULL;
  *due_ns = INT64_MAX;
  for (size_t i = 0; i < self->load_count; i++) {
    const wm_time_ns at_ns = load_due_ns(self, &self->load[i]);
    if (at_ns >= *due_ns) continue;
    best = &self->load[i];
    *due_ns = at_ns;
  }
  return best;
}

wm_time_ns play_fault_due_ns(const wm_play *self) {
  wm_time_ns due_ns;
  (void)next_load(self, &due_ns);
  if (self->next_edge < self->edge_count && self->edge[self->next_edge].due_ns < due_ns)
    due_ns = self->edge[self->next_edge].due_ns;
  return due_ns;
}

void play_fault_item(wm_play *self, wm_play_item *out) {
  wm_time_ns due_ns;
  const play_load *load = next_load(self, &due_ns);
  memset(out, 0, sizeof *out);
  if (self->next_edge < self->edge_count && self->edge[self->next_edge].due_ns <= due_ns) {
    const play_edge *edge = &self->edge[self->next_edge++];
    out->kind = WM_PLAY_FAULT;
    out->due_ns = edge->due_ns;
    out->fault = edge->fault;
    out->begins = edge->begins;
    return;
  }
  const wm_fault *f = &self->options.faults->fault[load->fault];
  out->kind = WM_PLAY_CAN;
  out->due_ns = due_ns;
  out->stream = load->stream;
  out->number = (uint32_t)load->next;
  out->frame.id = f->id_count ? f->ids[0] : LOAD_ID;
  out->frame.is_extended = out->frame.id > LOAD_ID;
  out->frame.length = 8;
  (void)strncpy(out->frame.iface, self->stream[load->stream].of, sizeof out->frame.iface - 1);
  self->load[load - self->load].next++;
}
