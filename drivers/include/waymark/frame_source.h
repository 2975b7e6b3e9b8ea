// SPDX-License-Identifier: Apache-2.0
// A stream of pictures of one camera. Implemented by a recorded video, a camera device, and a subscription to a camera
// with several readers. Used by one thread.
#ifndef WAYMARK_FRAME_SOURCE_H
#define WAYMARK_FRAME_SOURCE_H

#include <stdint.h>

#include "waymark/frame.h"
#include "waymark/setup.h"
#include "waymark/source.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_frame_source wm_frame_source;

// A picture in the camera's format.
typedef struct wm_camera_raw {
  const uint8_t *data;
  uint32_t bytes;
  int is_jpeg;
  double rate_hz;  // 0: unknown
} wm_camera_raw;

typedef struct wm_frame_source_ops {
  // Stamps and number of the next picture, which stays the next one; grey is NULL. WM_OK, WM_END, WM_IO; WM_AGAIN
  // without a picture for a while (a device).
  wm_status (*peek)(wm_frame_source *self, wm_frame *out, wm_error *err);
  // The next picture. The pixels stay until the next call. Statuses as above.
  wm_status (*next)(wm_frame_source *self, wm_frame *out, wm_error *err);
  // Skips the next picture and counts it.
  wm_status (*skip)(wm_frame_source *self, wm_error *err);
  // Skips pictures that are no longer the newest at `now_ns`, on the clock of arrival_ns; counted. NULL where only the
  // newest is handed out.
  wm_status (*skip_to)(wm_frame_source *self, wm_time_ns now_ns, wm_error *err);
  // The last picture of `next` in the camera's format, until the next call; data is NULL where it isn't kept.
  void (*raw)(const wm_frame_source *self, wm_camera_raw *out);
  // Its counts, as those of a source.
  void (*counts)(const wm_frame_source *self, wm_source_counts *out);
  void (*close)(wm_frame_source *self);
} wm_frame_source_ops;

struct wm_frame_source {
  const wm_frame_source_ops *ops;
  uint8_t is_live;           // pictures arrive in real time; recorded ones are available at once
  uint8_t *into;             // destination of the pixels of `next`, rows of width_px bytes; NULL: memory of its own
  wm_time_ns decoded_in_ns;  // time that another thread took to decode the last picture of `next`
};

// Options of a subscription to a camera; a recorded video ignores them.
typedef struct wm_frame_wishes {
  uint32_t waiting_max;  // pictures that may wait, at least 1; beyond it the oldest is dropped and counted
  int wait_ms;           // how long `peek` waits for a picture
  int wants_raw;         // also in the camera's format
} wm_frame_wishes;

// The cameras with pictures: a recording's videos, or a robot's devices.
typedef struct wm_pictures wm_pictures;
typedef struct wm_pictures_ops {
  int (*has)(const wm_pictures *self, const char *camera);
  // A reader of the pictures of `camera`, at `index` of the rig; to be closed before these are. WM_BAD_CONFIG: no such
  // camera.
  wm_status (*open)(wm_pictures *self, const wm_camera *camera, int32_t index, const wm_frame_wishes *wishes,
                    wm_frame_source **out, wm_error *err);
  // Starts the cameras that are open, also those opened since the last call. Any thread.
  wm_status (*start)(wm_pictures *self, wm_error *err);
  void (*close)(wm_pictures *self);
} wm_pictures_ops;
struct wm_pictures {
  const wm_pictures_ops *ops;
  const char *lacking;  // for a message where there are none: the remedy
};

#ifdef __cplusplus
}
#endif

#endif
