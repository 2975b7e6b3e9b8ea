// SPDX-License-Identifier: Apache-2.0
// V4L2's place: one camera of MJPEG pictures, stamped at the end of the exposure. Faults: unplugged, frozen, stalled,
// dropped PERCENT, damaged PERCENT, camera_clock SECONDS.
#include <errno.h>
#include <linux/videodev2.h>
#include <string.h>

#include "camera_io.h"
#include "played_world.h"

static size_t next;  // one camera, one thread
static const played_item *shown;
static wm_time_ns opened_ns;

static int open_camera(void *context, camera_identity *wanted, void **camera) {
  (void)context, (void)wanted;
  if (played_fault("unplugged", NULL)) return -ENODEV;
  *camera = &next;
  return 0;
}

static int set_mode(void *camera, camera_mode *mode) {
  (void)camera;
  mode->fourcc = V4L2_PIX_FMT_MJPEG;
  mode->stride = 0;
  mode->image_bytes = mode->width * mode->height * 2;
  return 0;
}

static int set_control(void *camera, camera_control *control) {
  (void)camera, (void)control;
  return 0;
}

static wm_time_ns exposure_ns(void *camera) {
  (void)camera;
  return 0;
}

static int start(void *camera, uint32_t buffers) {
  (void)camera, (void)buffers;
  opened_ns = played_now_ns();
  return 0;
}

static int take(void *camera, int wait_ms, camera_buffer *out) {
  (void)camera;
  double value = 0;
  if (played_fault("unplugged", NULL)) return -ENODEV;
  const played_item *item = played_next('p', opened_ns, &next);
  int is_stalled = played_fault("stalled", NULL);
  if (!item || is_stalled || !played_sleep(played_due_ns(item), wait_ms)) {
    if (!item || is_stalled) (void)played_sleep(INT64_MAX, wait_ms);
    if (is_stalled) opened_ns = played_now_ns();  // nobody kept what came meanwhile
    return 0;
  }
  next++;
  if (played_fault("dropped", &value) && played_is_hit(item->number, value)) return 0;
  if (!shown || !played_fault("frozen", NULL)) shown = item;
  *out = (camera_buffer){.index = item->number % CAMERA_BUFFERS_MAX,
                         .bytes = shown->bytes,
                         .sequence = item->number,
                         .stamp_ns = played_due_ns(item),
                         .data = shown->data};
  if (played_fault("damaged", &value) && played_is_hit(item->number, value)) out->flags |= CAMERA_BUFFER_ERROR;
  if (played_fault("camera_clock", &value)) out->stamp_ns += wm_ns_from_seconds(value);
  return 1;
}

static int give_back(void *camera, uint32_t index) {
  (void)camera, (void)index;
  return 0;
}

static void close_camera(void *camera) { (void)camera; }

static void sleep_ms(void *context, int ms) {
  (void)context;
  (void)played_sleep(INT64_MAX, ms);
}

static wm_time_ns monotonic_ns(void *context) {
  (void)context;
  return played_now_ns();
}

const camera_io kV4l2 = {open_camera, set_mode,  set_control,  exposure_ns, start,
                         take,        give_back, close_camera, sleep_ms,    monotonic_ns};
