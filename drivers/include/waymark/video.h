// SPDX-License-Identifier: Apache-2.0
// The pictures of a recording's camera: video/CAMERA.avi, video/CAMERA.mkv (MJPEG, or uncompressed Y800) or a folder
// video/CAMERA/ of NNNNNN.jpg, with the stamps of video/CAMERA.csv (frame,t_ns,exposure_ns[,arrival_ns]). The
// container's own rate, count and stamps are ignored. Colour is dropped while decoding (the luma as it is stored).
//
// Memory is fixed after the opening: two compressed pictures of the camera's largest possible size, one decoded.
// libturbojpeg has a heap of its own. No file content stops the program: unusable data is counted and skipped. One
// thread at a time per reader.
#ifndef WAYMARK_VIDEO_H
#define WAYMARK_VIDEO_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/frame.h"
#include "waymark/frame_source.h"
#include "waymark/recording.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Every picture and every row that doesn't become a frame is counted in one of these.
typedef struct wm_video_counts {
  uint64_t frames;           // handed out
  uint64_t skipped;          // skipped by the caller
  uint64_t lost;             // missing by the stamps: gaps of more than 1.5 usual periods
  uint64_t duplicated;       // the same stamp, or the same bytes, as the picture before: a camera that is stuck
  uint64_t empty;            // chunks of length 0
  uint64_t damaged;          // JPEGs that are cut or can't be decoded
  uint64_t wrong_size;       // of another size than the camera's
  uint64_t malformed;        // rows that can't be read, or whose frame goes back
  uint64_t out_of_order;     // rows with an arrival before that of the row above: arrived with that one
  uint64_t without_stamp;    // pictures without a row
  uint64_t without_picture;  // rows without a picture
  char first_problem[256];   // text of the first of these, with file and place; "" where none
} wm_video_counts;

typedef struct wm_video wm_video;

#define WM_DECODER_NAME_MAX 128

// What decodes JPEG here, so that a run can say so: "libjpeg-turbo 2.1.5 when built, libturbojpeg.so.0.2.0 (build
// b1cab8d497a983b4)". The file and its build ID are of the library that is loaded.
void wm_video_decoder(char *out, size_t capacity);

// Whether the recording has pictures of this camera (in any format, also .mp4).
int wm_video_there(const char *recording_dir, const char *camera_name);

// Opens the pictures of `camera`, at `index` of the rig (the `camera` of the frames). A camera without a size (width_px
// 0) takes that of its first picture. `warn` (may be NULL) gets problems that do not stop it. WM_NOT_FOUND: no
// pictures, or no CSV. WM_UNSUPPORTED: a format that has to be converted first. WM_BAD_CONFIG: the CSV lacks columns.
// WM_BAD_DATA: no container. Allocates.
wm_status wm_video_open(const char *recording_dir, const wm_camera *camera, int32_t index, wm_warn_fn warn,
                        void *context, wm_video **out, wm_error *err);
void wm_video_close(wm_video *self);  // NULL is fine

// From here on two readers of the same video, each with its own position and thread, decode a picture once: the first
// that needs it does. Before their first picture; more readers may join. Frames and other counts are unchanged.
wm_status wm_video_share(wm_video *self, wm_video *with, wm_error *err);

// Stamps and number of the next picture, not decoded: grey is NULL. WM_OK, WM_END, WM_IO. A few system calls.
wm_status wm_video_peek(wm_video *self, wm_frame *out, wm_error *err);
// The next picture that can be decoded. The pixels stay until the next call with this video. WM_OK, WM_END, WM_IO.
// Cost: about 2 ms for 1280x720 at a desk.
wm_status wm_video_next(wm_video *self, wm_frame *out, wm_error *err);
// The same into the caller's memory: rows of `stride_bytes` (at least the width).
wm_status wm_video_next_into(wm_video *self, uint8_t *grey, uint32_t stride_bytes, wm_frame *out, wm_error *err);
// Skips the next picture without reading it; counted. WM_OK, WM_END, WM_IO.
wm_status wm_video_skip(wm_video *self, wm_error *err);

// Skips pictures that are no longer the newest at `now_ns` (on the clock of arrival_ns): those followed by one that has
// arrived. Counted as skipped. WM_OK also at the end; WM_IO.
wm_status wm_video_skip_to(wm_video *self, wm_time_ns now_ns, wm_error *err);

const wm_video_counts *wm_video_counted(const wm_video *self);
// The same video as a frame source, whose close closes it.
wm_frame_source *wm_video_frames(wm_video *self);

#ifdef __cplusplus
}
#endif

#endif
