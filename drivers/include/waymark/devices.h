// SPDX-License-Identifier: Apache-2.0
// The robot's devices as sources. An absent device is no error: it is searched for again and again, and `counts.device`
// has its state.
#ifndef WAYMARK_DEVICES_H
#define WAYMARK_DEVICES_H

#include <stdint.h>

#include "waymark/frame.h"
#include "waymark/frame_source.h"
#include "waymark/recording.h"
#include "waymark/row_device.h"
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

// All frames of an interface of any kind, stamped on the monotonic clock, for a recorder. As the source it waits for up
// to WM_DEVICE_WAIT_MS, then WM_AGAIN; the interface may be absent. One thread.
typedef struct wm_can_listener wm_can_listener;
// Bytes that the kernel grants for the queue of a CAN socket, with the requested bytes in *wanted; 0: no CAN.
int wm_can_queue_bytes(int *wanted);
wm_status wm_can_listener_open(const char *interface, wm_can_listener **out, wm_error *err);
wm_status wm_can_listener_next(wm_can_listener *self, wm_can_frame *out, wm_error *err);
const wm_source_counts *wm_can_listener_counted(const wm_can_listener *self);
void wm_can_listener_close(wm_can_listener *self);  // NULL is fine

typedef enum wm_stamp_point { WM_STAMP_AUTO, WM_STAMP_START, WM_STAMP_END } wm_stamp_point;

#define WM_CAMERA_CONTROLS_MAX 16    // of a camera in the configuration
#define WM_CAMERA_PIPELINE_MAX 1024  // bytes of a pipeline's text
typedef struct wm_camera_device_config {
  char name[WM_NAME_MAX];            // of the camera in calibration.yaml, which gives its size
  char device[128];                  // /dev/video0, /dev/v4l/by-id/...
  char libcamera[128];               // instead: libcamera's identifier by `cam -l`; "": V4L2
  char gst[WM_CAMERA_PIPELINE_MAX];  // instead: a pipeline as gst-launch-1.0 takes it
  char card[48], bus[48];            // identity by `v4l2-ctl -D`; "": taken at the first opening
  char format[8];                    // one of wm_camera_formats; "": the driver's
  double rate_hz;                    // 0: the driver's
  double exposure_ms;                // 0: by the driver, where it reports it
  double latency_ms;                 // from the exposure's start or end to the driver's stamp
  int32_t stamp;                     // wm_stamp_point: what the driver's stamp marks
  uint32_t control_count;
  struct {
    char name[32];  // by `v4l2-ctl -l`, or libcamera's ("ExposureTime")
    int32_t value;
  } controls[WM_CAMERA_CONTROLS_MAX];
  int line;
} wm_camera_device_config;

// Every buffer of the driver is counted in one of these.
typedef struct wm_camera_counts {
  uint64_t frames;        // handed out
  uint64_t skipped;       // good, but superseded by a newer one
  uint64_t lost;          // missing by the driver's own count
  uint64_t duplicated;    // the same picture or stamp again
  uint64_t stale;         // from before the start
  uint64_t damaged;       // with an error flag, too short, no JPEG
  uint64_t out_of_order;  // stamped before the one before
  uint64_t bad_stamps;    // handed out, stamped by their arrival
  uint64_t restarts;      // stream restarted after a stall
  uint8_t device;         // wm_device_state
  char device_note[160];
  uint8_t is_foreign_clock;  // its stamps are of a clock of its own, which is mapped
  wm_time_ns clock_offset_ns, stamp_uncertainty_ns;
} wm_camera_counts;

typedef struct wm_camera_device wm_camera_device;

// Names of the formats that a camera may have, NULL-terminated.
extern const char *const wm_camera_formats[];

// Whether this build has libcamera; without it a configuration that names such a camera is refused.
int wm_camera_has_libcamera(void);
#define WM_WITHOUT_LIBCAMERA \
  "this waymark is built without libcamera; build it where libcamera-dev is installed, or name the camera by device:"

// A camera by V4L2, libcamera or GStreamer, with its calibration (`camera`, at `index` of the rig). It may be absent.
// `warn` (may be NULL) gets the driver's changes of the requested mode, once. Allocates; so does reopening.
wm_status wm_camera_device_open(const wm_camera_device_config *config, const wm_camera *camera, int32_t index,
                                wm_warn_fn warn, void *context, wm_camera_device **out, wm_error *err);
// The newest picture; older ones are counted as skipped. Waits for up to WM_DEVICE_WAIT_MS, then WM_AGAIN. `number` is
// the driver's count, from 0 at each start. The pixels stay until the next call: GREY and NV12 in the driver's buffer,
// the others decoded or copied (1 ms for 640x400 MJPEG at a desk). One thread.
wm_status wm_camera_device_next(wm_camera_device *self, wm_frame *out, wm_error *err);
// The last picture of wm_camera_device_next in the camera's format; until the next call.
void wm_camera_device_raw(const wm_camera_device *self, wm_camera_raw *out);
const wm_camera_counts *wm_camera_device_counted(const wm_camera_device *self);
// The same camera as a frame source, whose close closes it.
wm_frame_source *wm_camera_device_frames(wm_camera_device *self);
void wm_camera_device_close(wm_camera_device *self);  // NULL is fine

// Whose clock the stamps of a stream over LCM are of.
typedef enum wm_lcm_clock {
  WM_LCM_CLOCK_HERE,   // this computer's CLOCK_MONOTONIC
  WM_LCM_CLOCK_SENDER  // a monotonic clock of the sender's own, followed by the smallest delay
} wm_lcm_clock;

typedef struct wm_lcm_device_config {
  char stream[16];     // "motion": the file of the recording format without its ending
  char channel[48];    // without the prefix; "MOTION" by default
  int32_t clock;       // wm_lcm_clock
  double rate_max_hz;  // more messages than these are not read
  int line;
} wm_lcm_device_config;

// An IMU of Linux IIO, captured by its buffer.
typedef struct wm_iio_device_config {
  char device[64];   // `name` of the device in sysfs, or "iio:device0"; "": none
  char trigger[64];  // `name` of its trigger; "": its own
  double rate_hz;    // 0: the driver's
  int line;
} wm_iio_device_config;

// What a run takes from gpsd.
typedef enum wm_gpsd_from {
  WM_GPSD_POSITION,  // stream gnss
  WM_GPSD_COURSE,    // stream heading: the direction of the velocity, of a robot that drives forwards
  WM_GPSD_ANTENNAS   // stream heading: of a receiver with two antennas
} wm_gpsd_from;

typedef enum wm_gpsd_clock {
  WM_GPSD_CLOCK_RECEIVER,  // the receiver's UTC is followed as any clock, by the smallest delay
  WM_GPSD_CLOCK_UTC        // this computer's wall clock is set to UTC
} wm_gpsd_clock;

typedef struct wm_gpsd_device_config {
  int32_t from;     // wm_gpsd_from
  char host[64];    // "localhost"
  int32_t port;     // 2947
  char device[64];  // of several receivers this one: "/dev/ttyACM0"; "": any
  int32_t clock;    // wm_gpsd_clock
  double latency_ms;
  double accuracy_scale;  // sigmas in gpsd's accuracies
  double course_min_mps;  // slower the course is noise
  double sigma_deg;       // of a heading by antennas
  int line;
} wm_gpsd_device_config;

// A Doppler velocity log of Water Linked's kind, over TCP.
typedef struct wm_dvl_device_config {
  char host[64];  // "": none
  int32_t port;   // 16171
  int line;
} wm_dvl_device_config;

// The stream that it gives: "gnss" or "heading".
static inline const char *wm_gpsd_stream(const wm_gpsd_device_config *self) {
  return self->from == WM_GPSD_POSITION ? "gnss" : "heading";
}

#define WM_GPSD_DEVICES_MAX 2                                              // position and heading
#define WM_ROW_DEVICES_MAX (WM_LCM_DEVICES_MAX + WM_GPSD_DEVICES_MAX + 2)  // and an IMU and a velocity log
#define WM_CAN_DEVICES_MAX 4                                               // buses of a robot
#define WM_LCM_DEVICES_MAX 8                                               // streams over LCM
#define WM_CAMERA_DEVICES_MAX 8                                            // cameras of a robot
typedef struct wm_devices_config {
  wm_can_device_config can[WM_CAN_DEVICES_MAX];
  size_t can_count;
  wm_camera_device_config cameras[WM_CAMERA_DEVICES_MAX];
  size_t camera_count;
  wm_lcm_device_config lcm[WM_LCM_DEVICES_MAX];
  size_t lcm_count;
  wm_gpsd_device_config gpsd[WM_GPSD_DEVICES_MAX];
  size_t gpsd_count;
  wm_iio_device_config iio;
  wm_dvl_device_config dvl;
  int32_t sightings_by_lcm;  // another program on the robot sends them
} wm_devices_config;

// Devices that give rows of a stream: at most WM_ROW_DEVICES_MAX.
static inline size_t wm_devices_rows(const wm_devices_config *self) {
  return self->lcm_count + self->gpsd_count + (self->iio.device[0] != '\0') + (self->dvl.host[0] != '\0');
}
// Devices that can be recorded or localized by.
static inline size_t wm_devices_count(const wm_devices_config *self) {
  return self->can_count + self->camera_count + wm_devices_rows(self) + (self->sightings_by_lcm != 0);
}

// A SocketCAN interface: quantities by its DBC and binding, filtered by the kernel to the bound ids. *quantities: bit
// per wm_quantity that it can give. The GNSS part gives positions about the origin. *out is NULL without bindings of
// that part. WM_BAD_CONFIG for a wrong DBC or binding.
wm_status wm_can_device_open(const wm_can_device_config *config, wm_can_part part, const double gnss_origin[3],
                             wm_source **out, uint32_t *quantities, wm_error *err);

// An IMU of Linux IIO as rows of `imu`: its buffer is set up where it is not yet, which needs the right to write to
// sysfs. `root` stands before each path ("" on a real computer; a test has its own tree). Allocates.
wm_status wm_iio_open(const wm_iio_device_config *config, const char *root, wm_row_device **out, wm_error *err);
// Sets the buffer up and starts it. NULL, or in `text` the fault with its remedy. *is_there: a device of that name.
const char *wm_iio_prepare(const wm_iio_device_config *config, const char *root, int *is_there, char *text,
                           size_t room);
// The same without a change: what is missing. *is_ready: it may be read at once.
const char *wm_iio_inspect(const wm_iio_device_config *config, const char *root, int *is_there, int *is_ready,
                           char *text, size_t room);

// A receiver by gpsd as rows of `gnss` or `heading`, in metres east and north of `origin` (degrees, degrees, metres
// above the ellipsoid), WM_BAD_CONFIG without one. `ahead_m`: the antenna's x in base_link; NaN: not given. Allocates.
wm_status wm_gpsd_open(const wm_gpsd_device_config *config, const double origin[3], double ahead_m, wm_row_device **out,
                       wm_error *err);

// A velocity log as rows of `motion6` without turn rates, in its own axes (x forwards, y to the left, z upwards).
// Allocates.
wm_status wm_dvl_open(const wm_dvl_device_config *config, wm_row_device **out, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
