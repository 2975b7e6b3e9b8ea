// SPDX-License-Identifier: Apache-2.0
// The runtime in a program of its own: libwaymark.so. The same objects as `waymark run` and `waymark replay`, and so
// the same poses to the bit.
//
// A session takes what a robot measures and gives poses. It has no thread and reads no device: the program's own loop
// pushes data. A replay localizes from a recording or from the event log of a run, in one call.
//
// Threads: a handle is for one thread at a time; different handles may be in different threads. Callbacks are called on
// the thread that called the library, before that call returns, and may ask for names; other functions of the same
// handle answer WM_BAD_USAGE there, as they do in a second thread.
//
// Errors: a function returns a wm_status; where it is neither WM_OK, WM_END nor WM_AGAIN, *err (may be NULL) has a
// text. A refused call changes nothing but counts. The library ends no program and prints nothing.
//
// Handles: WM_BAD_USAGE for NULL, for one that was closed, and for any other value; a function that gives a name
// answers "". WM_BAD_USAGE for other pointers that are NULL and needed. WM_FULL: 1024 handles are open.
//
// Sizes: a struct is passed with its size (`bytes`, sizeof of the caller's struct). Options may be shorter than the
// library's, of a program compiled with an older header, or longer, of a newer header, where the part beyond is zero.
// Results and events have exactly the library's size, else WM_BAD_USAGE. wm_error never changes under one SONAME.
//
// A newer library may use further kinds of records, states, verdicts and names: a program leaves unknown ones out.
#ifndef WAYMARK_WAYMARK_H
#define WAYMARK_WAYMARK_H

#include <stddef.h>
#include <stdint.h>

#include <waymark/bound.h>
#include <waymark/event.h>
#include <waymark/frame.h>
#include <waymark/health.h>
#include <waymark/pose.h>
#include <waymark/status.h>
#include <waymark/time.h>

#ifdef __cplusplus
extern "C" {
#endif

// Version of the library, "0.1.0".
const char *waymark_version(void);

// ── what comes out ──────────────────────────────────────────────────────────────────────────────────────────────────

typedef enum waymark_record {
  WAYMARK_RECORD_EVENT = 1,   // wm_event: handed to the estimator, in the order of the stamps
  WAYMARK_RECORD_FUSED,       // wm_estimate: pose after all observations up to its stamp, one a row of motion
  WAYMARK_RECORD_INNOVATION,  // wm_innovation: one a scalar update, fused or refused
  WAYMARK_RECORD_PUBLISHED,   // wm_published: pose of now, as the robot has it
  WAYMARK_RECORD_BOUND        // wm_bound: of the published pose that follows
} waymark_record;

// A record; it belongs to the library and is valid during the call. `bytes` is what of it is in use.
typedef void (*waymark_take_fn)(void *context, waymark_record kind, const void *record, size_t bytes);
// A note for people: one line, without a line feed.
typedef void (*waymark_note_fn)(void *context, const char *text);

// ── session ─────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct waymark_session waymark_session;

typedef struct waymark_options {
  size_t bytes;        // sizeof(waymark_options)
  const char *config;  // path of the configuration
  const char
      *changes;      // values in place of the configuration's, a line each: "KEY: VALUE", "odometry.x: 1"; NULL: none
  const char *site;  // folder with calibration.yaml, landmarks.csv, map/, start; NULL: files of the configuration
  const char *out;   // folder for the files of the run; NULL: none is written
  uint64_t seed;     // of random numbers; 1 is what the commands take
  waymark_take_fn take;  // NULL: none
  waymark_note_fn note;  // NULL: none
  void *context;         // of take and note
} waymark_options;

// Reads configuration and site. WM_BAD_CONFIG with file, line and key.
wm_status waymark_open(const waymark_options *options, waymark_session **out, wm_error *err);

// Adds a source before the start; *out is its number for pushing. Its name is as in `sources:` of a configuration:
// "motion", "motion6", "ticks", "speeds", "steering", "imu", "heading", "depth", "gnss", "localizer", "increments",
// "stereo", "points", "sightings:SENSOR", "markers:SENSOR", "commands", or "can" (the DBC of `devices: can` or of the
// site; "can:can1" where there are several). WM_NOT_FOUND: no such name. waymark_start refuses one that the estimator
// has no use for.
wm_status waymark_add_source(waymark_session *session, const char *name, uint32_t *out, wm_error *err);

// After the sources: allocates, prepares the estimator, opens the files. From here on data are taken.
wm_status waymark_start(waymark_session *session, wm_error *err);

// Data. `t_ns` is when a datum was true, `arrival_ns` when it came, both on one monotonic clock of the program's choice
// (WM_TIME_NONE: it comes at its stamp). Sources of motion and CAN are pushed in the order of their stamps; any order
// between sources, and within the others, is right up to lateness_max_ms. One datum is refused, counted in the health,
// and the session goes on:
//   WM_BAD_DATA       it contradicts itself, or was pushed before
//   WM_NOT_FINITE     NaN or infinity where a number is needed
//   WM_OUT_OF_RANGE   a number or a time that can't be
//   WM_TIME_RAN_BACK  newer data were fused already, or the datum is of another clock than the session's first one
//   WM_FULL           the queue is full
// WM_OK: it waits for its turn, and is in the health as fused or rejected then. A source's first datum of a landmark
// that is not in the map, or that the estimator refuses, is a note, and `refused_because` of the health. A time may be
// 10 s ahead of the newest one that the session was given: programs seldom stand still for longer, and UTC, TAI and GPS
// differ by 18 s and more. A stamp may be merge.horizon_ms ahead of its arrival. After a pause of the whole program all
// times are farther ahead: they are taken again once they went on for 1 s without one that is nearer. The first datum
// sets the session's clock; waymark_advance and waymark_pose before it do not.
//
// A row of "motion", "motion6", "ticks", "speeds", "steering", "imu", "heading", "depth", "gnss" or "localizer": the
// numbers of the table's columns behind the stamps (docs/recording-format.md), NaN where absent; missing ones at the
// end are absent.
wm_status waymark_push_row(waymark_session *session, uint32_t source, wm_time_ns t_ns, wm_time_ns arrival_ns,
                           const double *numbers, size_t count, wm_error *err);
// Any event of a kind that the source gives. `source`, `seq` and, with "NAME:SENSOR", the sensor are set here.
wm_status waymark_push_event(waymark_session *session, uint32_t source, const wm_event *event, size_t bytes,
                             wm_error *err);
// A CAN frame of `interface`, for all CAN sources of it; ids that they don't bind are left out. `length` up to 64.
// WM_NOT_FOUND: the session has no CAN source of that interface.
wm_status waymark_push_can(waymark_session *session, wm_time_ns t_ns, const char *interface, uint32_t id,
                           int is_extended, const void *data, size_t length, wm_error *err);
// A grey picture for the detectors of `vision:` on that camera; they are done when this returns. frame->camera and
// number are set here. The pixels are read during the call; of a stereo pair, until its other picture was pushed.
// WM_NOT_FOUND: no such camera, or no detector that looks at it.
wm_status waymark_push_picture(waymark_session *session, const char *camera, const wm_frame *frame, size_t bytes,
                               wm_error *err);
// The clock is at `now_ns`, without a datum: what waits and is final is fused. WM_TIME_RAN_BACK, as of waymark_pose: it
// is more than 10 s behind the newest time, and so of another clock.
wm_status waymark_advance(waymark_session *session, wm_time_ns now_ns, wm_error *err);

// The pose of `now_ns`, by the odometry since the fused one. WM_AGAIN: there is none yet, or it was asked for already.
wm_status waymark_pose(waymark_session *session, wm_time_ns now_ns, wm_published *out, size_t bytes, wm_error *err);
// How far the robot may be from the last pose that waymark_pose gave, for integrity.risk_per_pose, and whether it is
// usable (docs/usable.md). WM_AGAIN: there was none.
wm_status waymark_bound(waymark_session *session, wm_bound *out, size_t bytes, wm_error *err);
// Counts of the sources, calibration states, state of the pose. Tens of microseconds.
wm_status waymark_health(waymark_session *session, wm_health *out, size_t bytes, wm_error *err);
// A floor of the configuration's site by its index, as in WM_EVENT_SET_FLOOR and WM_PUB_FLOOR; "" beyond.
const char *waymark_floor_name(const waymark_session *session, uint32_t floor);
// Name of a source of a wm_innovation or wm_health, "" beyond.
const char *waymark_source_name(const waymark_session *session, uint32_t source);

// Fuses what waits, completes the files and frees the session, also where it fails. NULL is fine.
wm_status waymark_close(waymark_session *session, wm_error *err);

// ── replay ──────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct waymark_replay_options {
  size_t bytes;                                  // sizeof(waymark_replay_options)
  const char *input;                             // folder of a recording, or events.wmlog of a run
  const char *config;                            // path of a configuration; NULL: the event log's own
  const char *changes;                           // as in waymark_options
  const char *out;                               // folder for the files of the run; NULL: none is written
  const char *landmarks;                         // in place of the recording's; NULL
  const char *calibration;                       // likewise
  const char *map;                               // likewise; of an event log: where its map is now
  uint64_t seed;                                 // an event log has its own
  double from_s, until_s;                        // this part of a recording, s from its first stamp; 0, 0: all of it
  int32_t lost;                                  // 1: the start pose of the recording is not used
  waymark_take_fn take;                          // NULL: none
  waymark_note_fn note;                          // NULL: none
  void (*progress)(void *context, double done);  // 0 to 1, a few times a second; NULL
  void *context;                                 // of take, note, progress and keeps
  // Event log only: 0 withholds an observation from the estimator; not called for motion. NULL: none is withheld.
  int32_t (*keeps)(void *context, const wm_event *observation);
} waymark_replay_options;

typedef struct waymark_report {
  uint64_t poses, events;   // fused
  double recorded_s;        // from the first stamp to the last
  uint64_t events_missing;  // of an event log: lost by the run that wrote it
  int32_t log_was_cut;      // of an event log: without its regular end
  int32_t reserved;
} waymark_report;

wm_status waymark_replay(const waymark_replay_options *options, waymark_report *out, size_t bytes, wm_error *err);

// A number of a configuration that its estimator reads: under motion, sightings or the estimator's name.
typedef struct waymark_parameter {
  const char *key;  // "motion.noise.speed_mps"
  double value, initial, min, max;
} waymark_parameter;

// Calls `take` for each parameter that the estimator of the configuration `text` reads. Its files are not opened.
wm_status waymark_parameters(const char *text, void (*take)(void *context, const waymark_parameter *parameter),
                             void *context, wm_error *err);

// ── event logs ──────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct waymark_log waymark_log;
typedef enum waymark_log_text {
  WAYMARK_LOG_PROGRAM = 0,  // version of the program that wrote it
  WAYMARK_LOG_ESTIMATOR,
  WAYMARK_LOG_RECORDING,   // name of the recording or robot
  WAYMARK_LOG_CONFIG,      // the whole configuration
  WAYMARK_LOG_CALIBRATION  // the whole calibration.yaml
} waymark_log_text;

wm_status waymark_log_open(const char *path, waymark_log **out, wm_error *err);
// Lives as long as the log; never NULL.
const char *waymark_log_get_text(const waymark_log *log, waymark_log_text which);
// "" beyond the last one.
const char *waymark_log_source_name(const waymark_log *log, uint32_t source);
const char *waymark_log_sensor_name(const waymark_log *log, uint32_t sensor);
// The next event; WM_END behind the last one. `*missing` (may be NULL) counts events that the run lost.
wm_status waymark_log_next(waymark_log *log, wm_event *out, size_t bytes, uint64_t *missing, wm_error *err);
void waymark_log_close(waymark_log *log);  // NULL is fine

// ── messages of a live run, names ───────────────────────────────────────────────────────────────────────────────────

// Messages as they come over LCM (docs/lcm.md): POSE, POSE_BOUND, HEALTH and INNOVATION. One thread at a time in all of
// a program.
wm_status waymark_read_pose(const void *message, size_t length, wm_published *out, size_t bytes, wm_error *err);
wm_status waymark_read_bound(const void *message, size_t length, wm_bound *out, size_t bytes, wm_error *err);
wm_status waymark_read_health(const void *message, size_t length, wm_health *out, size_t bytes, wm_error *err);
wm_status waymark_read_innovation(const void *message, size_t length, wm_innovation *out, size_t bytes, wm_error *err);

typedef enum waymark_names {
  WAYMARK_NAMES_STATE = 0,
  WAYMARK_NAMES_CAUSE,
  WAYMARK_NAMES_RESIDUAL,
  WAYMARK_NAMES_VERDICT,
  WAYMARK_NAMES_EVENT,
  WAYMARK_NAMES_QUANTITY,
  WAYMARK_NAMES_STATUS,
  WAYMARK_NAMES_UNUSABLE
} waymark_names;
// Word of a number in the structs: "tracking", "fused" ...; "?" beyond.
const char *waymark_name(waymark_names of, uint32_t number);

#ifdef __cplusplus
}
#endif

#endif
