// SPDX-License-Identifier: Apache-2.0
// The robot's own devices as sources. Opening one never fails because the device isn't there: it is looked for again
// and again, and `counts.device` says how it does.
#ifndef WAYMARK_DEVICES_H
#define WAYMARK_DEVICES_H

#include <stdint.h>

#include "waymark/frame.h"
#include "waymark/frame_source.h"
#include "waymark/recording.h"
#include "waymark/source.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_can_device_config {
  char interface[WM_CAN_IFACE_MAX];  // "can0"
  char dbc[WM_PATH_MAX], can_signals[WM_PATH_MAX];
  int line;
} wm_can_device_config;

// All frames of an interface, of whatever kind, stamped on the monotonic clock: for a recorder. As the source: it waits
// for up to WM_DEVICE_WAIT_MS, then WM_AGAIN; the interface needn't be there. One thread.
typedef struct wm_can_listener wm_can_listener;
// Bytes that the kernel grants the queue of a CAN socket, asked for *wanted; 0: it has no CAN.
int wm_can_queue_bytes(int *wanted);
wm_status wm_can_listener_open(const char *interface, wm_can_listener **out, wm_error *err);
wm_status wm_can_listener_next(wm_can_listener *self, wm_can_frame *out, wm_error *err);
const wm_source_counts *wm_can_listener_counted(const wm_can_listener *self);
void wm_can_listener_close(wm_can_listener *self);  // NULL is fine

typedef enum wm_stamp_point { WM_STAMP_AUTO, WM_STAMP_START, WM_STAMP_END } wm_stamp_point;

#define WM_CAMERA_CONTROLS_MAX 16
typedef struct wm_camera_device_config {
  char name[WM_NAME_MAX];  // of the camera in calibration.yaml, which has its size
  char device[128];        // /dev/video0, /dev/v4l/by-id/...
  char libcamera[128];     // instead of it: libcamera's identifier, as `cam -l` says; "": V4L2
  char card[48], bus[48];  // who it is, as `v4l2-ctl -D` says; "": as it is when it is opened first
  char format[8];          // one of wm_camera_formats; "": the driver's
  double rate_hz;          // 0: the driver's
  double exposure_ms;      // 0: as the driver says, where it does
  double latency_ms;       // from the exposure's start or end to the driver's stamp
  int32_t stamp;           // wm_stamp_point: what the driver's stamp is of
  uint32_t control_count;
  struct {
    char name[32];  // as `v4l2-ctl -l` writes it, or libcamera ("ExposureTime")
    int32_t value;
  } controls[WM_CAMERA_CONTROLS_MAX];
  int line;
} wm_camera_device_config;

// Every buffer of the driver is in one of these.
typedef struct wm_camera_counts {
  uint64_t frames;        // handed out
  uint64_t skipped;       // good, but a newer one was there
  uint64_t lost;          // missing by the driver's own count
  uint64_t duplicated;    // the same picture or stamp again
  uint64_t stale;         // from before the start
  uint64_t damaged;       // with an error flag, too short, no JPEG
  uint64_t out_of_order;  // stamped before the one before
  uint64_t bad_stamps;    // handed out, stamped by their arrival
  uint64_t restarts;      // switched off and on because it gave nothing
  uint8_t device;         // wm_device_state
  char device_note[160];
  uint8_t is_foreign_clock;  // its stamps are of a clock of its own, which is followed
  wm_time_ns clock_offset_ns, stamp_uncertainty_ns;
} wm_camera_counts;

typedef struct wm_camera_device wm_camera_device;

// Names of the formats that a camera may have, NULL-terminated.
extern const char *const wm_camera_formats[];

// Whether this build has libcamera's driver; without it a configuration that names such a camera is wrong.
int wm_camera_has_libcamera(void);
#define WM_WITHOUT_LIBCAMERA \
  "this waymark is built without libcamera; build it where libcamera-dev is installed, or name the camera by device:"

// A camera by V4L2 or libcamera, as calibration.yaml knows it (`camera`, at `index` of the rig). It needn't be there
// yet. What the driver changes of the wishes is told to `warn` (may be NULL), once. Allocates; reopening does, too.
wm_status wm_camera_device_open(const wm_camera_device_config *config, const wm_camera *camera, int32_t index,
                                wm_warn_fn warn, void *context, wm_camera_device **out, wm_error *err);
// The newest picture; what came before it is counted as skipped. Waits for up to WM_DEVICE_WAIT_MS, then WM_AGAIN.
// `number` is the driver's count, from 0 at each start. The pixels stay until the next call: GREY and NV12 as the
// driver has them, the others decoded or copied (1 ms for 640x400 MJPEG at a desk). One thread.
wm_status wm_camera_device_next(wm_camera_device *self, wm_frame *out, wm_error *err);
// The picture that wm_camera_device_next gave last, as the camera sent it; until the next call.
void wm_camera_device_raw(const wm_camera_device *self, wm_camera_raw *out);
const wm_camera_counts *wm_camera_device_counted(const wm_camera_device *self);
// The same camera as a frame source, which closes it.
wm_frame_source *wm_camera_device_frames(wm_camera_device *self);
void wm_camera_device_close(wm_camera_device *self);  // NULL is fine

#define WM_CAN_DEVICES_MAX 4
#define WM_CAMERA_DEVICES_MAX 8
typedef struct wm_devices_config {
  wm_can_device_config can[WM_CAN_DEVICES_MAX];
  size_t can_count;
  wm_camera_device_config cameras[WM_CAMERA_DEVICES_MAX];
  size_t camera_count;
  int32_t sightings_by_lcm;  // another program on the robot sends them
} wm_devices_config;

// A SocketCAN interface: quantities as its DBC and binding say, filtered by the kernel to the ids that are needed.
// *quantities: bit per wm_quantity that it can give. The part of a GNSS receiver gives positions about the origin. *out
// is NULL where nothing of that part is bound. WM_BAD_CONFIG where DBC or binding are wrong.
wm_status wm_can_device_open(const wm_can_device_config *config, wm_can_part part, const double gnss_origin[3],
                             wm_source **out, uint32_t *quantities, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
