// SPDX-License-Identifier: Apache-2.0
// A table of identities by place: the recording is driven with all identities unknown, the filter associates the
// sightings by their place, and each identity that was given gets the landmark that most of its sightings fit.
#ifndef WAYMARK_CLI_CHECK_IDENTITIES_H
#define WAYMARK_CLI_CHECK_IDENTITIES_H

#include "cli/check/edits.h"
#include "waymark/event.h"
#include "waymark/pose.h"
#include "waymark/source.h"

// The identities that each source gave, by the events' number within it.
typedef struct given_ids {
  int32_t *ids[WM_SOURCES_MAX];
  size_t capacity[WM_SOURCES_MAX], count[WM_SOURCES_MAX];
} given_ids;
void given_ids_take(given_ids *self, const wm_event *event);
void given_ids_free(given_ids *self);

#define VOTES_MAX 2048  // pairs of identities
#define LATEST_MAX 512  // sightings that may still be fused
typedef struct id_votes {
  const given_ids *given;
  struct {
    wm_time_ns t_ns;
    uint16_t source;
    int32_t id;
    double bearing_rad, range_m;
  } latest[LATEST_MAX];
  size_t latest_count;
  struct {
    int32_t from, to;
    uint32_t count;
  } votes[VOTES_MAX];
  size_t vote_count;
} id_votes;
// A sighting without its identity arrives, and an innovation of one.
void id_votes_arrived(id_votes *self, const wm_event *event);
void id_votes_take(id_votes *self, const wm_innovation *in);
// Identities that have to be another one; count 0 where there are none, or too few sightings.
void id_votes_table(const id_votes *self, id_table *out);

#endif
