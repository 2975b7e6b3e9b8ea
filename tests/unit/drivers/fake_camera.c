// SPDX-License-Identifier: Apache-2.0
#include "fake_camera.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

void fake_camera_init(fake_camera *self, const fake_step *steps) {
  memset(self, 0, sizeof *self);
  self->now_ns = FAKE_BOOT_NS;
  self->steps = steps;
  self->is_there = 1;
  (void)snprintf(self->card, sizeof self->card, "OV9281");
  (void)snprintf(self->bus, sizeof self->bus, "usb-1");
}

static void let_happen(fake_camera *self) {
  for (; self->steps[self->next].at_ns <= self->now_ns; self->next++) {
    fake_what what = self->steps[self->next].what;
    if (what != FAKE_REMOVED && what != FAKE_BACK) return;
    self->is_there = what == FAKE_BACK;
  }
}

static int open_camera(void *context, camera_identity *wanted, void **camera) {
  fake_camera *self = context;
  let_happen(self);
  if (!self->is_there) return -ENODEV;
  if ((wanted->card[0] && strcmp(wanted->card, self->card) != 0) ||
      (wanted->bus[0] && strcmp(wanted->bus, self->bus) != 0))
    return -ENODEV;
  memcpy(wanted->card, self->card, sizeof wanted->card);
  memcpy(wanted->bus, self->bus, sizeof wanted->bus);
  self->is_open = 1;
  self->opened++;
  *camera = self;
  return 0;
}

static int set_mode(void *camera, camera_mode *mode) {
  fake_camera *self = camera;
  if (self->changes_to.width) *mode = self->changes_to;
  if (!mode->fourcc) memcpy(&mode->fourcc, "GREY", 4);
  mode->stride = FAKE_STRIDE;
  return 0;
}

static int set_control(void *camera, camera_control *control) {
  fake_camera *self = camera;
  if (strcmp(control->name, "gain") == 0 && control->value > 100) {
    control->value = 100;
    return -ERANGE;
  }
  if (strcmp(control->name, "gain") != 0 && strcmp(control->name, "auto_exposure") != 0) return -EINVAL;
  self->set[self->set_count++] = *control;
  return 0;
}

static wm_time_ns exposure_ns(void *camera) { return ((fake_camera *)camera)->exposure_ns; }

static int start(void *camera, uint32_t buffers) {
  (void)buffers;
  ((fake_camera *)camera)->started++;
  ((fake_camera *)camera)->now_ns += ((fake_camera *)camera)->start_takes_ns;
  return 0;
}

static int take(void *camera, int wait_ms, camera_buffer *out) {
  fake_camera *self = camera;
  wm_time_ns until_ns = self->now_ns + wait_ms * WM_NS_PER_MS;
  let_happen(self);
  const fake_step *step = &self->steps[self->next];
  if (step->what == FAKE_END || step->at_ns > until_ns) {
    self->now_ns = until_ns;
    let_happen(self);
    return 0;
  }
  if (step->at_ns > self->now_ns) self->now_ns = step->at_ns;
  if (step->what != FAKE_PICTURE && step->what != FAKE_FAILS) return 0;
  self->next++;
  if (step->what == FAKE_FAILS) return -step->reason;
  uint32_t index = self->given++ % CAMERA_BUFFERS_MAX;
  memset(self->pixels[index], step->grey, sizeof self->pixels[index]);
  *out = (camera_buffer){.index = index,
                         .bytes = step->bytes ? step->bytes : FAKE_STRIDE * FAKE_HEIGHT,
                         .sequence = step->sequence,
                         .flags = step->flags,
                         .stamp_ns = step->stamp_ns,
                         .data = self->pixels[index]};
  if (self->jpeg && !step->bytes) {
    out->data = self->jpeg;
    out->bytes = self->jpeg_bytes;
  }
  return 1;
}

static int give_back(void *camera, uint32_t index) {
  (void)index;
  ((fake_camera *)camera)->taken_back++;
  return 0;
}

static void close_camera(void *camera) { ((fake_camera *)camera)->is_open = 0; }
static void sleep_ms(void *context, int ms) { ((fake_camera *)context)->now_ns += ms * WM_NS_PER_MS; }
static wm_time_ns monotonic_ns(void *context) { return ((fake_camera *)context)->now_ns; }

const camera_io kFakeCamera = {open_camera, set_mode,  set_control,  exposure_ns, start,
                               take,        give_back, close_camera, sleep_ms,    monotonic_ns};
