// SPDX-License-Identifier: Apache-2.0
// The parts of a live run and what its threads share (docs/runtime.md): rings, and atomics for flags and counts.
// Everything else belongs to one thread at a time.
//
//   source threads ── events ──► estimator ──┬─ to_publish, healths ──► publish thread: LCM, watchdog
//                                            └─ to_disk, maps ───────► disk thread: files, standard error
//   source threads, publish thread ── lines of text ──────────────────────────┘
#ifndef WAYMARK_LIVE_LIVE_H
#define WAYMARK_LIVE_LIVE_H

#include <stdatomic.h>

#include "fusion/pipeline.h"
#include "fusion/source_reader.h"
#include "live/lcm_group.h"
#include "live/lcm_sink.h"
#include "live/notify.h"
#include "live/other_runs.h"
#include "live/picture_server.h"
#include "live/run.h"
#include "live/run_clock.h"
#include "live/views.h"
#include "output/black_box.h"
#include "output/run_folder.h"
#include "output/saved_map.h"
#include "rt/arena.h"
#include "rt/ring.h"

typedef struct live live;

// A source's thread and its ring to the estimator's thread.
typedef struct live_source {
  live *run;
  wm_source_reader *reader;  // of the source's thread while it runs
  wm_ring ring;
  void *ring_memory;
  wm_ring lines;  // of text, to the disk thread
  atomic_int done;
  wm_status status;  // of the thread, after its end
  wm_error error;
  // Counts of the source, for the health message.
  _Atomic uint64_t lost, malformed, not_finite, out_of_order, ignored, frozen, overflows, bus_errors;
  _Atomic uint64_t looks[WM_LOOK_COUNT];
  _Atomic int64_t stamp_uncertainty_ns;
  atomic_uint device;  // wm_device_state
  // Why its first unusable datum was refused: stays as it is once has_reason is set.
  char reason[WM_HEALTH_REASON_MAX];
  atomic_int has_reason;
  // Last reported; of the source's thread.
  uint8_t said_device;
  uint32_t said_news;
} live_source;

// A health record, and the merge's watermark for the watchdog.
typedef struct health_record {
  wm_health health;
  wm_time_ns watermark_ns;  // wm_merge_watermark
} health_record;

// The estimator's map as wm_keeper writes it: one slot, free again once the map is on the disk.
typedef struct kept_map {
  size_t bytes;
  uint8_t image[];
} kept_map;

// The estimator's thread. It fills four rings.
typedef struct live_estimator {
  wm_pipeline pipeline;
  wm_ring to_publish, to_disk, healths, maps;
  void *to_publish_memory, *to_disk_memory, *healths_memory;
  void *maps_memory;  // NULL: no map is saved
  views views;        // rings of their own
  wm_time_ns loop_ns, publish_ns, next_publish_ns, next_health_ns, next_map_ns;
  uint64_t loops, deadlines_missed;
  uint64_t events_lost;  // not marked in the log yet
  wm_histogram wake_ns, cycle_ns, age_ns, keep_ns;
  int64_t allocations, page_faults;  // after start
  atomic_int done;
} live_estimator;

// The publish thread: LCM and the service manager. It touches no file, so that a slow disk delays no pose.
typedef struct live_publish {
  lcm_sink lcm;
  notify notify;
  other_runs others;
  lcm_group group;
  wm_ring lines;  // of text, to the disk thread, which writes them to standard error
  wm_time_ns next_landmarks_ns;
  int has_published;
  wm_estimate last_published;
  int last_floor;        // of it (wm_published_floor)
  wm_histogram send_ns;  // from a pose made to its message handed to LCM
  // As last reported, so that only changes are reported.
  uint8_t said_stale[WM_SOURCES_MAX];
  uint32_t said_motion_health;
  wm_findings found;  // of the newest health
  wm_said said;
  atomic_int done;
} live_publish;

// The disk thread: run folder, event log, black box, saved pose, and standard error.
typedef struct live_disk {
  wm_run_folder *folder;  // NULL: no output
  black_box box;
  wm_time_ns next_flush_ns, next_save_ns;
  int said_unwritable, said_slow, said_unsaved;
  uint64_t said_lines_lost;
  // The last pose that can be saved, and whether it is on the disk.
  wm_estimate last_pose;
  int last_floor;  // of it (wm_published_floor)
  int keeps_pose, has_last_pose;
  int keeps_map, said_map;
  wm_map_identity map_identity;
  uint64_t said_maps_late;
} live_disk;

struct live {
  const wm_config *config;
  const wm_run_options *options;
  wm_assembly assembly;
  wm_arena arena;
  run_clock clock;
  wm_source_reader *readers;
  live_source sources[WM_SOURCES_MAX];
  live_estimator estimator;
  live_publish publish;
  live_disk disk;
  picture_server *pictures;  // NULL: none is wanted
  wm_saved_map map;          // of an earlier run; no image: none
  void *lines_memory;        // rings of text: of the publish thread, then of the sources' threads
  atomic_int stop;           // ends the sources' threads
  atomic_int restarting;     // a reload: STOPPING=1 is not sent
};

// One record in a ring of outputs. A slot of `to_disk` has the size that the run's sources require (wm_output_bytes),
// one of `to_publish` the size of the kinds that go over LCM.
typedef struct output_record {
  uint64_t kind;  // wm_output_kind, or OUTPUT_GAP
  union {
    wm_event event;
    wm_estimate pose;
    wm_innovation innovation;
    wm_published published;
    wm_bound bound;
    wm_particle_set particles;
    wm_hypothesis_set hypotheses;
    uint64_t gap;
  } as;
} output_record;
#define OUTPUT_GAP 100
#define OUTPUT_RECORD_HEAD offsetof(output_record, as)
#define PUBLISH_RECORD_BYTES (OUTPUT_RECORD_HEAD + sizeof(wm_published))
_Static_assert(sizeof(wm_innovation) <= sizeof(wm_published) && WM_EVENT_SMALL_BYTES <= sizeof(wm_published),
               "a slot of to_publish holds each kind that goes over LCM");

// The consumer of the estimator's records: the rings to the publish and the disk thread.
wm_output estimator_output(live_estimator *self);
// Records dropped by either ring.
uint64_t outputs_lost(const live_estimator *self);
// The publish thread's part of a health record.
void live_publish_health(const live *run, wm_health *health);

// Writes a map to the disk; errors are reported once. On the disk thread, and on the main thread after its end.
// Then nothing changes of what the robot goes on with.
int live_is_on_trial(const live *run);
void live_save_map(live *self, const void *image, size_t bytes);
// This computer's UTC in seconds.
double live_utc_s(void);

void *source_thread(void *live_source_pointer);
void *estimator_thread(void *live_pointer);
void *publish_thread(void *live_pointer);
void *disk_thread(void *live_pointer);

// A line for standard error or the service's log. It blocks where their reader does: on main and the disk thread alone.
void live_say(live *self, const char *format, ...) __attribute__((format(printf, 2, 3)));
// The same by a thread's ring of lines; the disk thread prints it.
void live_queue_line(wm_ring *lines, const char *format, ...) __attribute__((format(printf, 2, 3)));
// By that of the publish thread. `line` as wm_line_fn, `context` is the run.
void live_say_later(void *context, const char *line);
// Lines that found no room. Any thread.
uint64_t live_lines_lost(const live *run);

#endif
