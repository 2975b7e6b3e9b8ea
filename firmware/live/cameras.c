// SPDX-License-Identifier: Apache-2.0
#include "live/cameras.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "live/run_clock.h"
#include "live/threads.h"
#include "rt/memory.h"
#include "sources/frame_hub.h"
#include "waymark/devices.h"

#define AFTER_ERROR_NS (100 * WM_NS_PER_MS)  // a source that only fails must not spin

typedef struct cameras cameras;

typedef struct camera {
  cameras *all;
  frame_hub *hub;  // NULL: no reader
  pthread_t thread;
  int is_started;
} camera;

struct cameras {
  wm_pictures base;
  const wm_config *config;
  wm_warn_fn warn;
  void *warn_context;
  pthread_mutex_t lock;  // of `devices`, for readers on several threads
  camera devices[WM_CAMERA_DEVICES_MAX];
  atomic_int stop;
};

static void *take_pictures(void *argument) {
  camera *self = argument;
  wm_prefault_stack(THREAD_TOUCHED_BYTES);
  while (!atomic_load_explicit(&self->all->stop, memory_order_relaxed)) {
    wm_status status = frame_hub_take(self->hub, NULL);
    if (status != WM_OK && status != WM_AGAIN) sleep_until(wm_monotonic_ns() + AFTER_ERROR_NS);
  }
  return NULL;
}

// Index of the device, or the count of all.
static size_t find(const cameras *self, const char *name) {
  size_t i = 0;
  while (i < self->config->devices.camera_count && strcmp(self->config->devices.cameras[i].name, name) != 0) i++;
  return i;
}

static int has(const wm_pictures *base, const char *name) {
  const cameras *self = (const cameras *)base;
  return find(self, name) < self->config->devices.camera_count;
}

static wm_status open_device(cameras *self, size_t i, const wm_camera *calibrated, int32_t index, wm_error *err) {
  wm_camera_device *device;
  if (self->devices[i].hub) return WM_OK;
  wm_status status = wm_camera_device_open(&self->config->devices.cameras[i], calibrated, index, self->warn,
                                           self->warn_context, &device, err);
  if (status != WM_OK) return status;
  return frame_hub_open(wm_camera_device_frames(device), calibrated->width_px, calibrated->height_px,
                        &self->devices[i].hub, err);
}

static wm_status open_reader(wm_pictures *base, const wm_camera *calibrated, int32_t index,
                             const wm_frame_wishes *wishes, wm_frame_source **out, wm_error *err) {
  cameras *self = (cameras *)base;
  size_t i = find(self, calibrated->name);
  *out = NULL;
  if (i == self->config->devices.camera_count)
    return wm_fail(err, WM_BAD_CONFIG, "%s: the camera '%s' is not in devices.cameras", self->config->path,
                   calibrated->name);
  (void)pthread_mutex_lock(&self->lock);
  wm_status status = open_device(self, i, calibrated, index, err);
  if (status == WM_OK) status = frame_hub_subscribe(self->devices[i].hub, wishes, out, err);
  (void)pthread_mutex_unlock(&self->lock);
  return status;
}

static wm_status start(wm_pictures *base, wm_error *err) {
  cameras *self = (cameras *)base;
  wm_status status = WM_OK;
  int is_realtime;
  (void)pthread_mutex_lock(&self->lock);
  for (size_t i = 0; status == WM_OK && i < WM_CAMERA_DEVICES_MAX; i++) {
    camera *c = &self->devices[i];
    if (!c->hub || c->is_started) continue;
    c->all = self;
    status = thread_start(THREAD_CAMERA, i, self->config, take_pictures, c, &c->thread, &is_realtime, err);
    c->is_started = status == WM_OK;
  }
  (void)pthread_mutex_unlock(&self->lock);
  return status;
}

static void close_all(wm_pictures *base) {
  cameras *self = (cameras *)base;
  atomic_store(&self->stop, 1);
  for (size_t i = 0; i < WM_CAMERA_DEVICES_MAX; i++)
    if (self->devices[i].is_started) (void)pthread_join(self->devices[i].thread, NULL);
  for (size_t i = 0; i < WM_CAMERA_DEVICES_MAX; i++) frame_hub_close(self->devices[i].hub);
  (void)pthread_mutex_destroy(&self->lock);
  free(self);
}

static const wm_pictures_ops kCameras = {has, open_reader, start, close_all};

wm_status cameras_open(const wm_config *config, wm_warn_fn warn, void *context, wm_pictures **out, wm_error *err) {
  *out = NULL;
  cameras *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for cameras");
  self->base = (wm_pictures){&kCameras, "has no pictures: devices.cameras names no camera of calibration.yaml"};
  self->config = config;
  self->warn = warn;
  self->warn_context = context;
  (void)pthread_mutex_init(&self->lock, NULL);
  *out = &self->base;
  return WM_OK;
}
