// SPDX-License-Identifier: Apache-2.0
// Pictures of one camera, one after another. A recorded video, a camera on a device, and one of several readers of such
// a camera are implementations of this. A frame source is used by one thread.
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

// A picture as the camera sent it.
typedef struct wm_camera_raw {
  const uint8_t *data;
  uint32_t bytes;
  int is_jpeg;
  double rate_hz;  // 0: unknown
} wm_camera_raw;

typedef struct wm_frame_source_ops {
  // Stamps and number of the next picture, which stays the next one; grey is NULL. WM_OK, WM_END, WM_IO; WM_AGAIN where
  // nothing came for a while (a device).
  wm_status (*peek)(wm_frame_source *self, wm_frame *out, wm_error *err);
  // The next picture. The pixels stay until the next call. Statuses as above.
  wm_status (*next)(wm_frame_source *self, wm_frame *out, wm_error *err);
  // Passes over the next picture, and counts it.
  wm_status (*skip)(wm_frame_source *self, wm_error *err);
  // Passes over pictures that are no longer the newest at `now_ns`, on the clock of arrival_ns; counted. NULL where
  // only the newest is handed out anyway.
  wm_status (*skip_to)(wm_frame_source *self, wm_time_ns now_ns, wm_error *err);
  // The picture that `next` handed out last, as the camera sent it, until the next call; data is NULL where that isn't
  // kept.
  void (*raw)(const wm_frame_source *self, wm_camera_raw *out);
  // What it counted, in the terms of a source.
  void (*counts)(const wm_frame_source *self, wm_source_counts *out);
  void (*close)(wm_frame_source *self);
} wm_frame_source_ops;

struct wm_frame_source {
  const wm_frame_source_ops *ops;
  uint8_t is_live;           // its pictures come when they come; a recorded one's are there
  uint8_t *into;             // where `next` puts the pixels, rows of width_px bytes; NULL: into memory of its own
  wm_time_ns decoded_in_ns;  // what decoding took another thread, of the picture that `next` handed out last
};

// What a reader of a camera with several readers wants; a recorded video has one reader, and takes no notice.
typedef struct wm_frame_wishes {
  uint32_t
      waiting_max;  // pictures that may wait for it, at least 1; with another one the oldest is dropped, and counted
  int wait_ms;      // how long `peek` waits for a picture
  int wants_raw;    // as the camera sent it, too
} wm_frame_wishes;

// The cameras whose pictures may be read: a recording's videos, or a robot's devices.
typedef struct wm_pictures wm_pictures;
typedef struct wm_pictures_ops {
  int (*has)(const wm_pictures *self, const char *camera);
  // A reader of the pictures of `camera`, at `index` of the rig; it is closed before these are. WM_BAD_CONFIG: there is
  // no such camera.
  wm_status (*open)(wm_pictures *self, const wm_camera *camera, int32_t index, const wm_frame_wishes *wishes,
                    wm_frame_source **out, wm_error *err);
  // From here on pictures come; also of cameras that were opened since. Any thread.
  wm_status (*start)(wm_pictures *self, wm_error *err);
  void (*close)(wm_pictures *self);
} wm_pictures_ops;
struct wm_pictures {
  const wm_pictures_ops *ops;
  const char *lacking;  // for a message, where there are none: what is to be done
};

#ifdef __cplusplus
}
#endif

#endif
