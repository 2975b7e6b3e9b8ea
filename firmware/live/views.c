// SPDX-License-Identifier: Apache-2.0
#include "live/views.h"

#include <math.h>
#include <string.h>

#include "waymark/lcm_views.h"

#define MAP_EVERY_NS WM_NS_PER_S
#define PLACES_SLOTS 4  // particles and other places of a second, twice

typedef struct place_record {
  uint64_t kind;  // wm_output_kind
  union {
    wm_particle_set particles;
    wm_hypothesis_set hypotheses;
  } as;
} place_record;

_Static_assert(WM_PARTICLES_MAX <= WM_LCM_PLACES_MAX && WM_HYPOTHESES_MAX <= WM_LCM_PLACES_MAX, "one message a set");

size_t views_needs(views *self, const wm_estimator *estimator, int is_on, wm_arena_need *needs) {
  size_t n = 0;
  memset(self, 0, sizeof *self);
  if (is_on && (estimator->particles || estimator->hypotheses))
    needs[n++] =
        (wm_arena_need){"places ring", wm_ring_bytes(PLACES_SLOTS, sizeof(place_record)), &self->places_memory};
  if (is_on && estimator->landmarks)
    needs[n++] = (wm_arena_need){"view of the map", wm_ring_bytes(1, sizeof(own_map)), &self->maps_memory};
  return n;
}

void views_init(views *self) {
  if (self->places_memory) wm_ring_init(&self->places, self->places_memory, PLACES_SLOTS, sizeof(place_record));
  if (self->maps_memory) wm_ring_init(&self->maps, self->maps_memory, 1, sizeof(own_map));
}

void views_put(views *self, wm_output_kind kind, const void *record, size_t bytes) {
  if (!self->places_memory || (kind != WM_OUTPUT_PARTICLES && kind != WM_OUTPUT_HYPOTHESES)) return;
  place_record *slot = wm_ring_reserve(&self->places, offsetof(place_record, as) + bytes);
  if (!slot) return;  // the next one comes in a second
  slot->kind = (uint64_t)kind;
  memcpy(&slot->as, record, bytes);
  wm_ring_commit(&self->places);
}

void views_take_map(views *self, const wm_fuser *fuser, wm_time_ns now_ns) {
  if (!self->maps_memory || now_ns < self->next_map_ns) return;
  self->next_map_ns = now_ns + MAP_EVERY_NS;
  own_map *slot = wm_ring_reserve(&self->maps, sizeof *slot);
  if (!slot) return;
  slot->t_ns = now_ns;
  size_t count = fuser->estimator->landmarks(fuser->state, slot->landmarks, slot->covariance, VIEW_LANDMARKS_MAX);
  slot->count = count < VIEW_LANDMARKS_MAX ? count : VIEW_LANDMARKS_MAX;
  wm_ring_commit(&self->maps);
}

// ── the publish thread ──────────────────────────────────────────────────────────────────────────────────────────────

static void send_particles(const wm_particle_set *set, lcm_sink *sink) {
  wm_place places[WM_PARTICLES_MAX];
  for (uint32_t i = 0; i < set->count; i++) {
    const wm_particle *p = &set->particles[i];
    places[i] = (wm_place){p->x_m, p->y_m, p->heading_rad, p->weight, {0}};
    for (int k = 0; k < 6; k++) places[i].covariance[k] = (double)NAN;
  }
  lcm_sink_places(sink, "PARTICLES", places, set->count, set->total, set->t_ns);
}

static void send_hypotheses(const wm_hypothesis_set *set, lcm_sink *sink) {
  wm_place places[WM_HYPOTHESES_MAX];
  for (uint64_t i = 0; i < set->count; i++) {
    const wm_hypothesis *h = &set->places[i];
    places[i] = (wm_place){h->x_m, h->y_m, h->heading_rad, h->weight, {0}};
    memcpy(places[i].covariance, h->covariance, sizeof places[i].covariance);
  }
  lcm_sink_places(sink, "HYPOTHESES", places, set->count, set->count, set->t_ns);
}

void views_send(views *self, lcm_sink *sink) {
  if (self->places_memory)
    for (const place_record *record; (record = wm_ring_front(&self->places)) != NULL; wm_ring_pop(&self->places)) {
      if (record->kind == WM_OUTPUT_PARTICLES) send_particles(&record->as.particles, sink);
      if (record->kind == WM_OUTPUT_HYPOTHESES) send_hypotheses(&record->as.hypotheses, sink);
    }
  if (!self->maps_memory) return;
  const own_map *map = wm_ring_front(&self->maps);
  if (!map) return;
  lcm_sink_map(sink, map->landmarks, map->covariance, map->count, map->t_ns);
  wm_ring_pop(&self->maps);
}
