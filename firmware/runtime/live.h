// SPDX-License-Identifier: Apache-2.0
// A live run's parts and what its threads share: rings, and flags that are atomics. Everything else belongs to one
// thread at a time.
#ifndef WAYMARK_FIRMWARE_LIVE_H
#define WAYMARK_FIRMWARE_LIVE_H

#include <stdatomic.h>

#include "black_box.h"
#include "lcm_sink.h"
#include "notify.h"
#include "run_clock.h"
#include "waymark/arena.h"
#include "waymark/feed.h"
#include "waymark/pipeline.h"
#include "waymark/ring.h"
#include "waymark/run.h"
#include "waymark/run_folder.h"

typedef struct live live;

// A source's thread and its ring to the estimator's thread.
typedef struct live_source {
  live *run;
  wm_feed *feed;  // the thread's own while it runs
  wm_ring ring;
  void *ring_memory;
  atomic_int done;
  wm_status status;  // of the thread, once it is done
  wm_error error;
  // What the source counted, for the health message.
  _Atomic uint64_t lost, malformed, not_finite, out_of_order, ignored, frozen, overflows, bus_errors;
  _Atomic uint64_t looks[WM_LOOK_COUNT];
  _Atomic int64_t stamp_uncertainty_ns;
  atomic_uint device;   // wm_device_state
  uint8_t said_device;  // the thread's own
} live_source;

// The estimator's thread.
typedef struct live_estimator {
  wm_pipeline pipeline;
  wm_ring outputs, healths;
  void *outputs_memory, *healths_memory;
  wm_time_ns loop_ns, publish_ns, next_publish_ns, next_health_ns;
  uint64_t loops, deadlines_missed;
  uint64_t events_lost;  // not yet marked in the log
  wm_histogram wake_ns, cycle_ns, age_ns;
  int64_t allocations, page_faults;  // after start
  atomic_int done;
} live_estimator;

// The sink's thread.
typedef struct live_sink {
  wm_run_folder *folder;  // NULL: nothing is written
  lcm_sink lcm;
  black_box box;
  notify notify;
  wm_time_ns next_flush_ns, next_landmarks_ns;
  int said_unwritable;
  // The last pose that was worth keeping, and whether it is on the disk.
  wm_estimate last_pose;
  int keeps_pose, has_last_pose, said_unsaved;
  int has_published;
  wm_estimate last_published;
  wm_time_ns next_save_ns;
  // What was said of the sources and the motion sensors, so that only a change is said.
  uint8_t said_stale[WM_SOURCES_MAX];
  uint32_t said_motion_health;
} live_sink;

struct live {
  const wm_config *config;
  const wm_run_options *options;
  wm_assembly assembly;
  wm_arena arena;
  run_clock clock;
  wm_feed *feeds;
  live_source sources[WM_SOURCES_MAX];
  live_estimator estimator;
  live_sink sink;
  atomic_int stop;        // sources: say no more
  atomic_int restarting;  // it goes on with another configuration: no end for the service manager
};

// One record in the output ring.
typedef struct output_record {
  uint64_t kind;  // wm_output_kind, or OUTPUT_GAP
  union {
    wm_event event;
    wm_estimate pose;
    wm_innovation innovation;
    wm_published published;
    wm_particle_set particles;
    wm_hypothesis_set hypotheses;
    uint64_t gap;
  } as;
} output_record;
#define OUTPUT_GAP 100
#define OUTPUT_RECORD_HEAD offsetof(output_record, as)

// Where the estimator's side puts its records: into the ring to the sinks.
wm_output estimator_output(live_estimator *self);

void *source_thread(void *live_source_pointer);
void *estimator_thread(void *live_pointer);
void *sink_thread(void *live_pointer);

void live_say(live *self, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
