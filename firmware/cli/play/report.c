// SPDX-License-Identifier: Apache-2.0
#include "cli/play/report.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "waymark/text.h"

static double us(const player_counts *counts, double quantile) {
  return (double)wm_histogram_quantile(&counts->late, quantile) * 1e-3;
}

static int is_ours(const wm_fault *f) { return (wm_fault_kind_of(f->kind)->by & WM_FAULT_BY_PLAYER) != 0; }

// A fault that lasts to the end is done with it.
static int is_done(const play_report *self, size_t i) {
  const int progress = self->player->progress[i];
  if (!is_ours(&self->player->faults->fault[i]) || self->player->fault_failure[i]) return 0;
  return progress == FAULT_DONE || (progress == FAULT_LASTS && strcmp(self->state, "done") == 0);
}

void report_left_out(const play_report *self, FILE *to) {
  const wm_faults *faults = self->player->faults;
  for (size_t i = 0; faults && i < faults->count; i++) {
    const wm_fault *f = &faults->fault[i];
    const wm_fault_kind_row *row = wm_fault_kind_of(f->kind);
    if (is_ours(f)) continue;
    if (row->by & WM_FAULT_BY_RUNNER)
      (void)fprintf(to, "note: '%s' (%s at %g s) is left to the runner\n", f->name, row->name, f->from_s);
    else
      (void)fprintf(to, "note: '%s' (%s at %g s) is not played: only a played driver can do it\n", f->name, row->name,
                    f->from_s);
  }
}

static void print_stream(const play_report *self, size_t i, const wm_play_stream *s, FILE *to) {
  const player_counts *c = &self->player->counts[i];
  const play_sink *sink = self->player->sink[i];
  if (!sink) return;
  (void)fprintf(to, "  %-22s %8" PRIu64 " sent to %-28s late: p50 %.0f us, p99 %.0f us, largest %.0f us\n", s->name,
                c->sent, sink->where, us(c, 0.5), us(c, 0.99), (double)c->late.max_ns * 1e-3);
  if (c->failed) (void)fprintf(to, "  %-22s %8" PRIu64 " NOT sent: %s\n", "", c->failed, strerror(c->first_failure));
}

static void print_faults(const play_report *self, FILE *to) {
  const wm_faults *faults = self->player->faults;
  for (size_t i = 0; faults && i < faults->count; i++) {
    const wm_fault *f = &faults->fault[i];
    const int failure = self->player->fault_failure[i];
    const char *how = !is_ours(f)                                ? "not played"
                      : failure                                  ? strerror(failure)
                      : is_done(self, i)                         ? "done"
                      : self->player->progress[i] == FAULT_LASTS ? "interrupted"
                                                                 : "not reached";
    (void)fprintf(to, "  fault '%s' (%s), %g to %g s: %s\n", f->name, wm_fault_kind_of(f->kind)->name, f->from_s,
                  f->until_s, how);
  }
}

void report_print(const play_report *self, FILE *to) {
  size_t count;
  const char *problem;
  const wm_play_stream *streams = wm_play_streams(self->player->play, &count);
  const uint64_t unreadable = wm_play_unreadable(self->player->play, &problem);
  (void)fprintf(to, "%s: %s after %.1f s\n", self->recording, self->state, self->took_s);
  for (size_t i = 0; i < count; i++) print_stream(self, i, &streams[i], to);
  for (size_t i = 0; i < count; i++)
    if (!self->player->sink[i])
      (void)fprintf(to, "  %-22s not played: %s\n", streams[i].name, self->places->why_not[i]);
  if (unreadable) (void)fprintf(to, "  %" PRIu64 " data could not be read; the first: %s\n", unreadable, problem);
  print_faults(self, to);
}

// ── JSON ────────────────────────────────────────────────────────────────────────────────────────────────────────────

static void put_streams(const play_report *self, const wm_play_stream *streams, size_t count, FILE *to) {
  const char *before = "";
  (void)fputs(",\n\"streams\": [", to);
  for (size_t i = 0; i < count; i++) {
    const player_counts *c = &self->player->counts[i];
    if (!self->player->sink[i]) continue;
    (void)fprintf(to, "%s\n  {\"name\": ", before);
    wm_json_text(streams[i].name, to);
    (void)fputs(", \"to\": ", to);
    wm_json_text(self->player->sink[i]->where, to);
    (void)fprintf(
        to, ", \"sent\": %" PRIu64 ", \"failed\": %" PRIu64 ", \"p50_us\": %.1f, \"p99_us\": %.1f, \"max_us\": %.1f}",
        c->sent, c->failed, us(c, 0.5), us(c, 0.99), (double)c->late.max_ns * 1e-3);
    before = ",";
  }
  (void)fputs("\n],\n\"not_placed\": [", to);
  before = "";
  for (size_t i = 0; i < count; i++) {
    if (self->player->sink[i]) continue;
    (void)fputs(before, to);
    wm_json_text(streams[i].name, to);
    before = ", ";
  }
  (void)fputs("],\n\"why_not_placed\": {", to);
  before = "";
  for (size_t i = 0; i < count; i++) {
    if (self->player->sink[i]) continue;
    (void)fputs(before, to);
    wm_json_text(streams[i].name, to);
    (void)fputs(": ", to);
    wm_json_text(self->places->why_not[i], to);
    before = ", ";
  }
  (void)fputs("}", to);
}

static void put_faults(const play_report *self, FILE *to) {
  const wm_faults *faults = self->player->faults;
  (void)fputs(",\n\"faults\": [", to);
  for (size_t i = 0; faults && i < faults->count; i++) {
    const wm_fault *f = &faults->fault[i];
    const int failure = self->player->fault_failure[i];
    (void)fprintf(to, "%s\n  {\"name\": ", i ? "," : "");
    wm_json_text(f->name, to);
    (void)fprintf(
        to, ", \"kind\": \"%s\", \"by\": \"%s\", \"from_s\": %.12g, \"until_s\": ", wm_fault_kind_of(f->kind)->name,
        is_ours(f)                                           ? "player"
        : wm_fault_kind_of(f->kind)->by & WM_FAULT_BY_RUNNER ? "runner"
                                                             : "played driver",
        f->from_s);
    if (isfinite(f->until_s))
      (void)fprintf(to, "%.12g", f->until_s);
    else
      (void)fputs("null", to);
    (void)fprintf(to, ", \"done\": %s, \"failure\": ", is_done(self, i) ? "true" : "false");
    if (failure)
      wm_json_text(strerror(failure), to);
    else
      (void)fputs("null", to);
    (void)fputc('}', to);
  }
  (void)fputs("\n]", to);
}

static void put_all(const play_report *self, FILE *to) {
  size_t count;
  const char *problem;
  const player *p = self->player;
  const wm_play_stream *streams = wm_play_streams(p->play, &count);
  const wm_time_ns first_ns = wm_play_first_ns(p->play);
  const uint64_t unreadable = wm_play_unreadable(p->play, &problem);
  (void)fputs("{\"format\": \"waymark-play/1\", \"state\": ", to);
  wm_json_text(self->state, to);
  (void)fputs(", \"recording\": ", to);
  wm_json_text(self->recording, to);
  (void)fprintf(to,
                ",\n\"offset_ns\": %" PRId64 ", \"begin_ns\": %" PRId64 ", \"first_ns\": %" PRId64
                ", \"from_s\": %.12g, \"speed\": %.12g, \"played_s\": %.6f, \"unreadable\": %" PRIu64,
                p->begin_ns - first_ns - wm_ns_from_seconds(p->from_s), p->begin_ns, first_ns, p->from_s, p->speed,
                self->took_s, unreadable);
  put_streams(self, streams, count, to);
  put_faults(self, to);
  (void)fputs("}\n", to);
}

wm_status report_write_json(const play_report *self, const char *path, wm_error *err) {
  char beside[WM_PATH_MAX + 8];
  if (snprintf(beside, sizeof beside, "%s.new", path) >= (int)sizeof beside)
    return wm_fail(err, WM_BAD_USAGE, "--json: '%.60s...': the path is too long", path);
  FILE *to = fopen(beside, "w");
  if (!to) return wm_fail(err, WM_IO, "--json: %s: %s", beside, strerror(errno));
  put_all(self, to);
  const int failed = ferror(to) != 0;
  if (fclose(to) != 0 || failed || rename(beside, path) != 0)
    return wm_fail(err, WM_IO, "--json: %s: can't be written: %s", path, strerror(errno));
  return WM_OK;
}

void report_streams(const wm_play *play, const char *recording, FILE *to) {
  static const char *const kKinds[] = {
      [WM_PLAY_CAN] = "can", [WM_PLAY_PICTURE] = "picture", [WM_PLAY_MESSAGE] = "message"};
  size_t count;
  const wm_play_stream *streams = wm_play_streams(play, &count);
  const double duration_s = wm_play_duration_s(play);
  (void)fputs("{\"format\": \"waymark-play-streams/1\", \"recording\": ", to);
  wm_json_text(recording, to);
  (void)fprintf(to, ", \"first_ns\": %" PRId64 ", \"duration_s\": ", wm_play_first_ns(play));
  if (isfinite(duration_s))
    (void)fprintf(to, "%.12g", duration_s);
  else
    (void)fputs("null", to);
  (void)fputs(", \"streams\": [", to);
  for (size_t i = 0; i < count; i++) {
    const wm_play_stream *s = &streams[i];
    (void)fprintf(to, "%s\n  {\"name\": ", i ? "," : "");
    wm_json_text(s->name, to);
    (void)fprintf(to, ", \"kind\": \"%s\", \"of\": ", kKinds[s->kind]);
    wm_json_text(s->of, to);
    if (s->kind == WM_PLAY_PICTURE)
      (void)fprintf(to, ", \"format\": \"%s\", \"size\": [%u, %u]", s->format, s->width_px, s->height_px);
    (void)fprintf(to, ", \"can_be_played\": %s}", s->lacking ? "false" : "true");
  }
  (void)fputs("\n]}\n", to);
}
