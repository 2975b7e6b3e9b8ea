// SPDX-License-Identifier: Apache-2.0
// A configuration and a recording (or the head of an event log) put together: estimator, setup, and the sources in
// their order. Made once at start; allocates.
#ifndef WAYMARK_FUSION_ASSEMBLY_H
#define WAYMARK_FUSION_ASSEMBLY_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "fusion/building.h"
#include "fusion/fuser.h"
#include "fusion/merge.h"
#include "sources/vision.h"
#include "waymark/estimator.h"
#include "waymark/recording.h"
#include "waymark/source.h"
#include "waymark/video.h"

// A source that is used; its place in the table is the `source` of its events.
typedef struct wm_assembled_source {
  char name[WM_SOURCE_NAME_MAX];
  wm_source *source;  // NULL where only the table is known (event log)
  uint32_t kinds;
  uint32_t drops;  // bit per wm_quantity that is another source's
  wm_merge_source merge;
  double from_s, until_s;
} wm_assembled_source;

// A source that is not used, and why.
typedef enum wm_unused_why {
  WM_UNUSED_WANTED,        // `use: false`
  WM_UNUSED_BY_ESTIMATOR,  // which takes no such data
  WM_UNUSED_QUANTITY,      // of it, a quantity that another source gives
} wm_unused_why;

typedef struct wm_unused {
  wm_unused_why why;
  uint8_t is_device, is_detector, is_listed;  // of the configuration: `devices`, `vision`, `sources`
  char name[WM_SOURCE_NAME_MAX];
  char text[128];  // "the estimator 'slam' doesn't take it; landmark_ekf does"
} wm_unused;

typedef struct wm_assembly {
  const wm_config *config;
  wm_setup setup;
  wm_motion_params *own_motion;  // a copy with what the sources settle (wm_motion_choose)
  wm_driving driving;
  uint32_t kinds;  // of all used sources
  wm_assembled_source sources[WM_SOURCES_MAX];
  size_t source_count;
  wm_unused unused[WM_SOURCES_MAX + WM_VISION_MAX];
  size_t unused_count;
  const char *calibration_text;
  size_t calibration_length;
  const wm_mounting *imu;  // of calibration.yaml
  wm_vision *vision;       // sources of pictures; NULL where there are none
  wm_building *building;   // of a site with several floors; NULL: one floor
  int start_floor;         // of setup.start; -1: unknown
  const void *kept;        // map of an earlier run for the estimator (waymark/keeper.h); NULL: none
  size_t kept_bytes;
  const char *map_path;               // NULL where the estimator takes no map
  char recording[WM_NAME_MAX + 96];   // the recording's name
  char decoder[WM_DECODER_NAME_MAX];  // of JPEG pictures, where the run has pictures; else ""
} wm_assembly;

// `config` and `recording` outlive the assembly. WM_BAD_CONFIG where they don't match: no data, a source of the
// configuration that no recording has, an estimator that can't work with this setup or doesn't take a device or a
// detector of the configuration. wm_assembly_close is also due after a failure.
wm_status wm_assemble(const wm_config *config, wm_recording *recording, uint64_t seed, wm_assembly *out, wm_error *err);
// Parameters of the motion by the sources (wm_motion_choose).
wm_status wm_assembly_choose_motion(wm_assembly *self, wm_error *err);
// Closes the pictures. Before the recording and the run's memory are closed.
void wm_assembly_close(wm_assembly *self);

// The estimator of the run: the configuration's, or the one over the floors of a building.
const wm_estimator *wm_assembly_estimator(const wm_assembly *self);
// The floors' setups follow the assembly's, which may have changed. Before the estimator's state is made.
void wm_assembly_follow(wm_assembly *self);
// Whether the estimator takes any observation; one that takes none is chosen for dead reckoning.
int wm_assembly_observes(const wm_assembly *self);
// Of an estimator that can't find a pose, where no start is known: why there is none, and what to write. NULL: fine.
const char *wm_assembly_lacks_start(const wm_assembly *self);
// Bit for each source that gives observations for the estimator.
uint64_t wm_assembly_observers(const wm_assembly *self);
// "can", "sightings:laser" ... by index; "?" beyond.
const char *wm_assembly_source_name(const wm_assembly *self, size_t source);
const char *wm_assembly_sensor_name(const wm_assembly *self, size_t sensor);

#endif
