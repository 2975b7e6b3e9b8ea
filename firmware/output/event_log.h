// SPDX-License-Identifier: Apache-2.0
// events.wmlog: the fused events in their order, and the setup to fuse them again: it gives the same trajectory bit by
// bit without the recording. It holds no wall-clock time.
//
//   file    = magic (8 bytes "WMLOG 2\n") record*
//   record  = length u32, crc32 u32 (of what follows), tag u8, content (length - 1 bytes)
//   content = by tag: a text, a setup struct, an event (waymark/codec.h), a gap's count
//
// Little-endian. The head's records come first, WM_LOG_HEAD_END closes them. A file that ends within a record was
// truncated (power cut, full disk) and is valid up to there. At a record with a wrong checksum reading stops with its
// position.
#ifndef WAYMARK_OUTPUT_EVENT_LOG_H
#define WAYMARK_OUTPUT_EVENT_LOG_H

#include <stdint.h>
#include <stdio.h>

#include "fusion/assembly.h"
#include "waymark/codec.h"
#include "waymark/event.h"
#include "waymark/status.h"

typedef enum wm_log_tag {
  WM_LOG_PROGRAM = 1,    // text: version of the program that wrote it
  WM_LOG_ESTIMATOR,      // text: name
  WM_LOG_RECORDING,      // text: name of the recording or robot
  WM_LOG_SEED,           // u64
  WM_LOG_CONFIG,         // text: the whole file
  WM_LOG_CONFIG_PATH,    // text: for messages
  WM_LOG_CALIBRATION,    // text: the whole file
  WM_LOG_WHEELS,         // struct
  WM_LOG_START,          // struct
  WM_LOG_SENSOR,         // struct, one record a sensor
  WM_LOG_LANDMARK,       // struct, one record a landmark
  WM_LOG_LANDMARK_HASH,  // u64
  WM_LOG_DRIVING,        // kinds u32, quantities u32
  WM_LOG_SOURCE,         // kinds u32, name text, one record a source
  WM_LOG_RIG,            // struct: cameras
  WM_LOG_MAP_HASH,       // u64; absent where there was no map
  WM_LOG_MAP_PATH,       // text: where the map was; it is not in the log
  WM_LOG_HEAD_END,
  WM_LOG_EVENT,    // struct
  WM_LOG_GAP,      // u64: events that are missing here, because they found no room in the ring to the disk thread
  WM_LOG_CLOSED,   // u64: events in the file; regular end of the run
  WM_LOG_KEPT,     // of the head: map of an earlier run that this one began with (waymark/keeper.h); absent without one
  WM_LOG_DECODER,  // of the head, text: what decoded the run's JPEG pictures (wm_video_decoder); absent without
                   // pictures
  // Of the head, of a building with several floors:
  WM_LOG_FLOOR,           // text: name, one record a floor
  WM_LOG_FLOOR_LANDMARK,  // floor u32, struct: one record a landmark of each floor
  WM_LOG_FLOOR_END,       // floor, connection, kind u32; x, y, heading, radius f64: one record an end of a connection
  WM_LOG_START_FLOOR      // u64: floor of the start plus 1; 0: unknown
} wm_log_tag;

// ── writing ─────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct wm_log_writer {
  FILE *file;
  uint64_t events;
  int failed;  // errno of the first failure, after which nothing is written
  char buffer[1 << 16];
} wm_log_writer;

// Creates the file and writes the head. Its buffer is its own: no allocation after this.
wm_status wm_log_create(wm_log_writer *self, const char *path, const wm_assembly *assembly, wm_error *err);
void wm_log_write_event(wm_log_writer *self, const wm_event *event);
void wm_log_write_gap(wm_log_writer *self, uint64_t missing);
// Flushes to the system, so that a power cut loses at most the events since.
void wm_log_flush(wm_log_writer *self);
// Regular end. WM_IO with the reason if anything could not be written.
wm_status wm_log_close(wm_log_writer *self, wm_error *err);

// ── reading ─────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct wm_log_reader wm_log_reader;

// The head's content. Pointers live as long as the reader.
typedef struct wm_log_head {
  char program[32], estimator[WM_NAME_MAX], recording[WM_NAME_MAX + 96], config_path[WM_PATH_MAX],
      map_path[WM_PATH_MAX], decoder[WM_DECODER_NAME_MAX];  // decoder: "" without pictures
  uint64_t seed, landmark_hash;
  uint64_t map_hash;  // 0: there was no map
  const char *config_text, *calibration_text;
  size_t config_length, calibration_length;
  wm_wheels wheels;
  wm_start start;
  wm_rig rig;
  const wm_sensor *sensors;
  size_t sensor_count;
  const wm_landmark *landmarks;
  size_t landmark_count;
  wm_driving driving;
  const void *kept;  // NULL: none
  size_t kept_bytes;
  wm_building *building;  // NULL: one floor; its estimator is not set
  int start_floor;        // -1: unknown
  uint32_t source_count;
  struct {
    char name[WM_SOURCE_NAME_MAX];
    uint32_t kinds;
  } sources[WM_SOURCES_MAX];
} wm_log_head;

// Whether the file has the end record of a run that ended regularly, by its last bytes alone.
int wm_log_is_closed(const char *path);
// Reads the head. WM_BAD_DATA with file and position where it is no event log, or damaged. Allocates.
wm_status wm_log_open(const char *path, wm_log_reader **out, wm_error *err);
// The same from an open file, of which it takes ownership.
wm_status wm_log_open_file(FILE *file, const char *path, wm_log_reader **out, wm_error *err);
const wm_log_head *wm_log_reader_head(const wm_log_reader *self);
// WM_OK: an event (source below the head's source_count). WM_END: no more; *cut is 1 where the file ends within a
// record or was no regular end. WM_BAD_DATA: damaged here. `*missing` grows by gaps. No allocation.
wm_status wm_log_next(wm_log_reader *self, wm_event *out, uint64_t *missing, int *cut, wm_error *err);
void wm_log_reader_close(wm_log_reader *self);

#endif
