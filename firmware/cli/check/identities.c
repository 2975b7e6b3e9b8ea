// SPDX-License-Identifier: Apache-2.0
#include "cli/check/identities.h"

#include <math.h>
#include <stdlib.h>

// Fewer sightings of an identity are left as they are; of more, the larger part has to fit one landmark.
#define VOTES_MIN 4
#define SHARE_MIN 0.5

void given_ids_take(given_ids *self, const wm_event *event) {
  const size_t s = event->source, at = event->seq;
  if (event->kind != WM_EVENT_SIGHTING || s >= WM_SOURCES_MAX || at > 100000000) return;
  if (at >= self->capacity[s]) {
    const size_t capacity = at < 4096 ? 8192 : 2 * at;
    int32_t *more = realloc(self->ids[s], capacity * sizeof *more);
    if (!more) return;
    for (size_t i = self->capacity[s]; i < capacity; i++) more[i] = -1;
    self->ids[s] = more;
    self->capacity[s] = capacity;
  }
  self->ids[s][at] = event->as.sighting.landmark_id;
  if (at >= self->count[s]) self->count[s] = at + 1;
}

void given_ids_free(given_ids *self) {
  for (size_t s = 0; s < WM_SOURCES_MAX; s++) free(self->ids[s]);
  *self = (given_ids){0};
}

void id_votes_arrived(id_votes *self, const wm_event *event) {
  const size_t s = event->source;
  if (event->kind != WM_EVENT_SIGHTING || s >= WM_SOURCES_MAX || event->seq >= self->given->count[s]) return;
  const size_t at = self->latest_count++ % LATEST_MAX;
  self->latest[at].t_ns = event->t_ns;
  self->latest[at].source = event->source;
  self->latest[at].id = self->given->ids[s][event->seq];
  self->latest[at].bearing_rad = event->as.sighting.bearing_rad;
  self->latest[at].range_m = event->as.sighting.range_m;
}

static void vote(id_votes *self, int32_t from, int32_t to) {
  for (size_t i = 0; i < self->vote_count; i++)
    if (self->votes[i].from == from && self->votes[i].to == to) {
      self->votes[i].count++;
      return;
    }
  if (self->vote_count == VOTES_MAX) return;
  self->votes[self->vote_count].from = from;
  self->votes[self->vote_count].to = to;
  self->votes[self->vote_count++].count = 1;
}

void id_votes_take(id_votes *self, const wm_innovation *in) {
  if (in->verdict != WM_FUSED || in->landmark_id < 0) return;
  if (in->residual != WM_RESIDUAL_BEARING && in->residual != WM_RESIDUAL_RANGE) return;
  const size_t count = self->latest_count < LATEST_MAX ? self->latest_count : LATEST_MAX;
  double nearest = 1e-6;  // the same number, after a sum with a correction that is 0
  int32_t from = -1;
  for (size_t i = 0; i < count; i++) {
    if (self->latest[i].t_ns != in->t_ns || self->latest[i].source != in->source) continue;
    const double value = in->residual == WM_RESIDUAL_BEARING ? self->latest[i].bearing_rad : self->latest[i].range_m;
    const double away = fabs(value - in->observed);
    if (!(away < nearest)) continue;
    nearest = away;
    from = self->latest[i].id;
  }
  if (from >= 0) vote(self, from, in->landmark_id);
}

static int best_of(const id_votes *self, size_t i) {
  uint32_t all = 0;
  for (size_t k = 0; k < self->vote_count; k++) {
    if (self->votes[k].from == self->votes[i].from) all += self->votes[k].count;
    if (self->votes[k].to == self->votes[i].to && self->votes[k].count > self->votes[i].count) return 0;
  }
  return self->votes[i].count >= VOTES_MIN && self->votes[i].count > SHARE_MIN * all;
}

void id_votes_table(const id_votes *self, id_table *out) {
  out->count = 0;
  for (size_t i = 0; i < self->vote_count && out->count < ID_PAIRS_MAX; i++) {
    if (self->votes[i].from == self->votes[i].to || !best_of(self, i)) continue;
    out->from[out->count] = self->votes[i].from;
    out->to[out->count++] = self->votes[i].to;
  }
}
