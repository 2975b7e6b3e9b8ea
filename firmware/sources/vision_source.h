// SPDX-License-Identifier: Apache-2.0
// One detector on one camera, or on a pair: a source of events.
#ifndef WAYMARK_SOURCES_VISION_SOURCE_H
#define WAYMARK_SOURCES_VISION_SOURCE_H

#include <pthread.h>

#include "sources/newest_pose.h"
#include "sources/onlooker.h"
#include "sources/search_outcomes.h"
#include "sources/vision.h"
#include "waymark/detector.h"
#include "waymark/frame_source.h"

#define PICTURES_MAX 2                        // a stereo pair
#define PAIR_TOLERANCE_NS (2 * WM_NS_PER_MS)  // pictures of a pair are triggered together
#define PREFETCH_EVENTS 8                     // some pictures ahead of the replay; not swept

typedef struct vision_source vision_source;

// Events that a prefetch thread has made for a replay.
typedef struct vision_prefetch {
  pthread_t thread;
  pthread_mutex_t lock;
  pthread_cond_t changed;
  int started, stop, ended;
  size_t first, count;
  wm_event *events;  // PREFETCH_EVENTS
  wm_status status;  // that ended it
  wm_error error;
  wm_source_counts counts;  // as of the newest event
} vision_prefetch;

struct vision_source {
  wm_source base;
  const wm_detector *detector;
  const void *params;
  wm_view view;
  int32_t cameras[PICTURES_MAX];
  wm_frame_source *pictures[PICTURES_MAX];  // of each camera; those of a pair are taken at the same instant
  uint16_t sensor;                          // of WM_EVENT_LOOKED
  int gives_looked;
  size_t state_bytes, capacity;
  void *state, *events_memory;
  wm_event *events;  // of the newest picture: `capacity`, then the prefetched ones
  size_t event_count, next_event;
  wm_time_ns newest_ns;
  uint32_t seq;
  wm_source_counts counts;                     // of the working thread
  uint64_t went_back, refused;                 // pictures older than the one before; pictures that the detector refused
  wm_histogram decode_ns, detect_ns, look_ns;  // look: of a picture, both together
  search_outcomes outcomes;
  wm_seen *only;  // the only pictures to be processed, rising; NULL: all
  size_t only_count;
  wm_time_ns only_tolerance_ns;
  newest_pose *newest;       // NULL: the detector isn't guided
  wm_time_ns busy_until_ns;  // recorded: end of the detector's work on the picture before
  int looks_at_arrival;      // recorded: detection at the picture's arrival (wm_vision_look_at_arrival)
  int announced;             // with it: the next picture's arrival was handed out
  vision_prefetch prefetch;
  onlooker shown;
};

// The next event, on the calling thread.
wm_status vision_next(vision_source *self, wm_event *out, wm_error *err);
// Skips pictures that are no longer the newest at `now_ns`.
void vision_skip_to(vision_source *self, wm_time_ns now_ns);

// Takes ownership of `seen` (rising, from malloc).
void vision_look_only_at(vision_source *self, wm_seen *seen, size_t count);

wm_status vision_prefetch_start(vision_source *self, wm_error *err);
void vision_prefetch_stop(vision_source *self);
wm_status vision_prefetch_next(vision_source *self, wm_event *out, wm_error *err);

#endif
