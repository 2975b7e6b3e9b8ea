// SPDX-License-Identifier: Apache-2.0
// Life cycle of a camera: searched for, set up, streaming, stalled or frozen, gone, searched for again.
#include "camera_device.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "camera_process.h"
#include "frame_clock.h"
#include "jpeg.h"
#include "pixels.h"

#define BUFFERS 4                           // of the driver's ring: one filled, one ready, two in transfer
#define LOOK_EVERY_NS (500 * WM_NS_PER_MS)  // search for an absent camera: opening nodes is slow
#define STALL_NS WM_NS_PER_S                // without a buffer, or ten periods where those are longer
#define RESTART_NS (3 * WM_NS_PER_S)        // of stalling: the stream is restarted
#define FROZEN_NS WM_NS_PER_S               // of an unchanged picture
#define EXPOSURE_EVERY_NS WM_NS_PER_S       // automatic exposure changes slowly

struct wm_camera_device {
  wm_frame_source base;
  wm_camera_device_config config;
  uint32_t width, height;  // as calibrated
  int32_t index;
  wm_warn_fn warn;
  void *warn_context;
  const camera_io *io;
  void *io_context;
  camera_identity identity;
  void *camera;  // NULL: not open
  camera_mode mode;
  int format;
  int has_held, was_told;
  int has_head;  // of the held buffer, whose pixels have not been handed out
  wm_frame head;
  camera_buffer newest;
  uint32_t held;   // the buffer whose pixels the caller has
  uint32_t stale;  // buffers that may still be from before the stream's begin
  wm_time_ns begun_ns;
  frame_clock clock;
  frame_count count;
  uint64_t fingerprint;
  wm_time_ns last_stamp_ns, last_t_ns, last_buffer_ns, last_new_ns, next_look_ns, next_exposure_ns, exposure_ns;
  uint8_t *grey;  // for formats that are not grey
  jpeg_decoder jpeg;
  wm_camera_counts counts;
};

__attribute__((format(printf, 3, 4))) static void set_state(wm_camera_device *self, wm_device_state state,
                                                            const char *format, ...) {
  if (self->counts.device == state) return;
  self->counts.device = (uint8_t)state;
  char text[120];
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  (void)snprintf(self->counts.device_note, sizeof self->counts.device_note, "%s %s", self->config.name, text);
}

__attribute__((format(printf, 2, 3))) static void tell(const wm_camera_device *self, const char *format, ...) {
  if (!self->warn || self->was_told) return;
  char text[240], line[300];
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  (void)snprintf(line, sizeof line, "camera %s: %s", self->config.name, text);
  self->warn(self->warn_context, WM_NOTE_FILE, line);
}

// ── set up ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void close_camera(wm_camera_device *self) {
  if (self->camera) self->io->close(self->camera);
  self->camera = NULL;
  self->has_held = self->has_head = 0;
}

// Reports the driver's changes of the mode; another size than the calibration's can't be used.
static int mode_is_usable(wm_camera_device *self, const camera_mode *wanted) {
  const camera_mode *got = &self->mode;
  self->format = pixels_of_fourcc(got->fourcc);
  if (wanted->fourcc && got->fourcc != wanted->fourcc)
    tell(self, "the driver gives %.4s instead of %.4s", (const char *)&got->fourcc, (const char *)&wanted->fourcc);
  if (wanted->rate_hz > 0 && got->rate_hz > 0 &&
      (got->rate_hz < wanted->rate_hz * 0.98 || got->rate_hz > wanted->rate_hz * 1.02))
    tell(self, "the driver gives %.4g pictures a second instead of %.4g", got->rate_hz, wanted->rate_hz);
  if (self->format < 0) {
    set_state(self, WM_DEVICE_DOWN,
              "gives the format %.4s; GREY, YUYV, UYVY, NV12, Y10, Y16, MJPG, RGB3 or BGR3 is needed",
              (const char *)&got->fourcc);
    return 0;
  }
  uint32_t least = (uint32_t)pixels_bytes(self->format, got->width, 1, 0);
  if (self->mode.stride < least) self->mode.stride = least;  // some drivers leave it at 0
  if (got->width == self->width && got->height == self->height) return 1;
  set_state(self, WM_DEVICE_DOWN, "gives %ux%u pixels, but is calibrated for %ux%u", got->width, got->height,
            self->width, self->height);
  return 0;
}

static void set_controls(wm_camera_device *self) {
  for (uint32_t i = 0; i < self->config.control_count; i++) {
    camera_control control = {.value = self->config.controls[i].value};
    (void)snprintf(control.name, sizeof control.name, "%s", self->config.controls[i].name);
    int failed = self->io->set_control(self->camera, &control);
    if (failed == -EINVAL) {
      tell(self, "has no control '%s' (`%s` lists them)", control.name,
           self->config.libcamera[0] ? "cam -c 1 --list-controls" : "v4l2-ctl -l");
    } else if (failed == -ERANGE) {
      tell(self, "control '%s': %d is beyond its limits; %d was set", control.name, self->config.controls[i].value,
           control.value);
    } else if (failed) {
      tell(self, "control '%s' can't be set: %s", control.name, strerror(-failed));
    }
  }
}

// After the start: v4l2loopback stamps all buffers that it has anew while a reader sets it up.
static void begin_stream(wm_camera_device *self) {
  const wm_time_ns now_ns = self->io->monotonic_ns(self->io_context);
  self->stale = BUFFERS;
  self->begun_ns = now_ns;
  self->count.is_set = 0;
  self->clock.is_foreign = 0;
  self->clock.doubtful = 0;
  self->last_stamp_ns = self->next_exposure_ns = 0;
  self->fingerprint = 0;
  self->last_buffer_ns = self->last_new_ns = now_ns;
  self->was_told = 1;
}

static int configure(wm_camera_device *self) {
  camera_mode wanted = {.width = self->width, .height = self->height, .rate_hz = self->config.rate_hz};
  if (self->config.format[0]) wanted.fourcc = pixels_fourcc(pixels_find(self->config.format));
  self->mode = wanted;
  int failed = self->io->set_mode(self->camera, &self->mode);
  if (failed) {
    set_state(self, WM_DEVICE_DOWN, "can't be set up: %s", strerror(-failed));
    return 0;
  }
  if (!mode_is_usable(self, &wanted)) return 0;
  set_controls(self);
  failed = self->io->start(self->camera, BUFFERS);
  if (failed) set_state(self, WM_DEVICE_DOWN, "doesn't start: %s (in use by another program?)", strerror(-failed));
  return !failed;
}

static void look_for_camera(wm_camera_device *self, wm_time_ns now_ns) {
  if (now_ns < self->next_look_ns) return;
  self->next_look_ns = now_ns + LOOK_EVERY_NS;
  int failed = self->io->open(self->io_context, &self->identity, &self->camera);
  if (failed) {
    self->camera = NULL;
    set_state(self, WM_DEVICE_ABSENT, "is not there (%s): %s; looking for it", self->identity.path,
              failed == -ENODEV ? "unplugged?" : strerror(-failed));
    return;
  }
  if (!configure(self)) {
    close_camera(self);
    return;
  }
  begin_stream(self);
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

static int is_whole(const wm_camera_device *self, const camera_buffer *b) {
  if (b->flags & CAMERA_BUFFER_ERROR || b->bytes == 0) return 0;
  return b->bytes >= pixels_bytes(self->format, self->mode.width, self->mode.height, self->mode.stride);
}

// The same pixels or the same stamp: the camera is stuck, and gives no new information.
static int is_again(wm_camera_device *self, const camera_buffer *b, wm_time_ns now_ns) {
  uint64_t before = self->fingerprint;
  self->fingerprint = pixels_fingerprint(b->data, b->bytes);
  int again = self->fingerprint == before || (b->stamp_ns != 0 && b->stamp_ns == self->last_stamp_ns);
  self->last_stamp_ns = b->stamp_ns;
  if (!again) {
    self->last_new_ns = now_ns;
    return 0;
  }
  self->counts.duplicated++;
  if (now_ns - self->last_new_ns > FROZEN_NS)
    set_state(self, WM_DEVICE_FROZEN, "gives the same picture again and again");
  return 1;
}

static void look_at_exposure(wm_camera_device *self, wm_time_ns now_ns) {
  if (now_ns < self->next_exposure_ns) return;
  self->next_exposure_ns = now_ns + EXPOSURE_EVERY_NS;
  self->exposure_ns = self->config.exposure_ms > 0 ? wm_ns_from_seconds(self->config.exposure_ms * 1e-3)
                                                   : self->io->exposure_ns(self->camera);
}

static int stamp(wm_camera_device *self, const camera_buffer *b, wm_time_ns arrival_ns, wm_frame *out) {
  stamp_point point = b->flags & CAMERA_STAMP_START ? STAMP_START : STAMP_END;
  if (self->config.stamp != WM_STAMP_AUTO) point = self->config.stamp == WM_STAMP_START ? STAMP_START : STAMP_END;
  stamp_verdict verdict =
      frame_clock_stamp(&self->clock, b->stamp_ns, point, arrival_ns, self->exposure_ns, &out->t_ns);
  self->counts.stamp_uncertainty_ns = self->clock.uncertainty_ns;
  if (verdict == STAMP_GUESSED) self->counts.bad_stamps++;
  self->counts.is_foreign_clock = (uint8_t)self->clock.is_foreign;
  self->counts.clock_offset_ns = self->clock.is_foreign ? self->clock.camera.offset_ns : 0;
  if (out->t_ns <= self->last_t_ns) {
    self->counts.out_of_order++;
    return 0;
  }
  self->last_t_ns = out->t_ns;
  return 1;
}

// What a driver had in its ring before the start. A stamp of this computer's clock shows that nothing is left of it;
// else the first pictures are thrown away, as many as the ring holds.
static int is_stale(wm_camera_device *self, const camera_buffer *b, wm_time_ns now_ns) {
  if (b->stamp_ns > self->begun_ns && b->stamp_ns <= now_ns) self->stale = 0;
  if (self->stale == 0) return 0;
  self->stale--;
  self->counts.stale++;
  return 1;
}

// 1: a usable picture; all of *out but its pixels is filled.
static int accept_buffer(wm_camera_device *self, const camera_buffer *b, wm_frame *out) {
  wm_time_ns now_ns = self->io->monotonic_ns(self->io_context);
  self->last_buffer_ns = now_ns;
  if (is_stale(self, b, now_ns)) return 0;
  uint64_t lost;
  (void)frame_count_take(&self->count, b->sequence, &lost);
  self->counts.lost += lost;
  if (!is_whole(self, b)) {
    self->counts.damaged++;
    return 0;
  }
  if (is_again(self, b, now_ns)) return 0;
  look_at_exposure(self, now_ns);
  *out = (wm_frame){.arrival_ns = now_ns,
                    .exposure_ns = self->exposure_ns,
                    .number = self->count.number,
                    .camera = self->index,
                    .width_px = self->width,
                    .height_px = self->height,
                    .stride_bytes = self->width};
  return stamp(self, b, now_ns, out);
}

static void give_back(wm_camera_device *self, uint32_t buffer) { (void)self->io->give_back(self->camera, buffer); }

// Copies the rows of a driver's buffer, which may be slow to read: each byte once.
static void copy_rows(const uint8_t *from, uint32_t stride, uint32_t width, uint32_t height, uint8_t *to) {
  for (uint32_t y = 0; y < height; y++) memcpy(to + (size_t)y * width, from + (size_t)y * stride, width);
}

// Grey pixels of the held buffer.
static int convert_to_grey(wm_camera_device *self, const camera_buffer *b, wm_frame *out) {
  char why[120];
  uint8_t *grey = self->base.into ? self->base.into : self->grey;
  out->grey = grey;
  if (pixels_are_grey(self->format)) {
    if (self->base.into) {
      copy_rows(b->data, self->mode.stride, self->width, self->height, grey);
    } else {
      out->grey = b->data;
      out->stride_bytes = self->mode.stride;
    }
  } else if (self->format == PIXELS_MJPEG) {
    if (jpeg_decode(&self->jpeg, b->data, b->bytes, self->width, self->height, grey, self->width, why, sizeof why) !=
        JPEG_GOOD) {
      self->counts.damaged++;
      return 0;
    }
  } else {
    pixels_to_grey(self->format, b->data, self->width, self->height, self->mode.stride, grey);
  }
  return 1;
}

static void device_lost(wm_camera_device *self, int reason) {
  close_camera(self);
  set_state(self, WM_DEVICE_ABSENT, "is gone (%s); looking for it", strerror(reason));
  self->next_look_ns = self->io->monotonic_ns(self->io_context) + LOOK_EVERY_NS / 5;
}

// Called without a buffer: a camera with a loose cable or hanging firmware gives no error at all.
static void look_for_stall(wm_camera_device *self) {
  wm_time_ns now_ns = self->io->monotonic_ns(self->io_context), silent_ns = now_ns - self->last_buffer_ns;
  wm_time_ns periods_ns = self->mode.rate_hz > 0 ? wm_ns_from_seconds(10 / self->mode.rate_hz) : 0;
  wm_time_ns stall_ns = periods_ns > STALL_NS ? periods_ns : STALL_NS;
  if (silent_ns > stall_ns) set_state(self, WM_DEVICE_STALLED, "gives no pictures");
  if (silent_ns > stall_ns + RESTART_NS) {
    close_camera(self);
    self->next_look_ns = now_ns;
    self->counts.restarts++;
  }
}

// Takes all buffers that are ready and keeps the newest good one in *kept. 1: there is one; 0; -errno.
static int take_newest(wm_camera_device *self, camera_buffer *kept, wm_frame *frame) {
  int have = 0, wait_ms = WM_DEVICE_WAIT_MS;
  for (uint32_t i = 0; i < 2 * BUFFERS; i++, wait_ms = 0) {
    camera_buffer b;
    wm_frame f;
    int got = self->io->take(self->camera, wait_ms, &b);
    if (got < 0 && !have) return got;
    if (got <= 0) break;
    if (!accept_buffer(self, &b, &f)) {
      give_back(self, b.index);
      continue;
    }
    if (have) {
      give_back(self, kept->index);
      self->counts.skipped++;
    }
    have = 1;
    *kept = b;
    *frame = f;
  }
  return have;
}

// The newest picture, not handed out yet: self->head.
static wm_status find_head(wm_camera_device *self) {
  if (self->has_head) return WM_OK;
  if (self->has_held) give_back(self, self->held);
  self->has_held = 0;
  if (!self->camera) look_for_camera(self, self->io->monotonic_ns(self->io_context));
  if (!self->camera) {
    self->io->sleep_ms(self->io_context, WM_DEVICE_WAIT_MS);
    return WM_AGAIN;
  }
  camera_buffer kept = {0};
  int got = take_newest(self, &kept, &self->head);
  if (got < 0) {
    device_lost(self, -got);
    return WM_AGAIN;
  }
  if (got == 0) {
    look_for_stall(self);
    return WM_AGAIN;
  }
  self->held = kept.index;
  self->newest = kept;
  self->has_held = self->has_head = 1;
  return WM_OK;
}

wm_status wm_camera_device_next(wm_camera_device *self, wm_frame *out, wm_error *err) {
  (void)err;
  wm_status status = find_head(self);
  if (status != WM_OK) return status;
  self->has_head = 0;
  *out = self->head;
  if (!convert_to_grey(self, &self->newest, out)) return WM_AGAIN;
  set_state(self, WM_DEVICE_WORKS, "gives pictures");
  self->counts.frames++;
  return WM_OK;
}

void wm_camera_device_raw(const wm_camera_device *self, wm_camera_raw *out) {
  *out = (wm_camera_raw){self->newest.data, self->newest.bytes, self->format == PIXELS_MJPEG, self->mode.rate_hz};
}

const wm_camera_counts *wm_camera_device_counted(const wm_camera_device *self) { return &self->counts; }

// ── as a frame source ───────────────────────────────────────────────────────────────────────────────────────────────

static wm_status peek(wm_frame_source *base, wm_frame *out, wm_error *err) {
  wm_camera_device *self = (wm_camera_device *)base;
  (void)err;
  wm_status status = find_head(self);
  if (status == WM_OK) *out = self->head;
  return status;
}

static wm_status next(wm_frame_source *base, wm_frame *out, wm_error *err) {
  return wm_camera_device_next((wm_camera_device *)base, out, err);
}

static wm_status skip(wm_frame_source *base, wm_error *err) {
  wm_camera_device *self = (wm_camera_device *)base;
  (void)err;
  wm_status status = find_head(self);
  self->counts.skipped += status == WM_OK;
  self->has_head = 0;
  return status;
}

static void raw(const wm_frame_source *base, wm_camera_raw *out) {
  wm_camera_device_raw((const wm_camera_device *)base, out);
}

static void count(const wm_frame_source *base, wm_source_counts *out) {
  const wm_camera_counts *c = &((const wm_camera_device *)base)->counts;
  *out = (wm_source_counts){.lost = c->lost,
                            .malformed = c->damaged,
                            .not_finite = c->bad_stamps,
                            .out_of_order = c->out_of_order,
                            .frozen = c->duplicated,
                            .overflows = c->skipped,
                            .device = c->device,
                            .stamp_uncertainty_ns = c->stamp_uncertainty_ns};
  memcpy(out->device_note, c->device_note, sizeof out->device_note);
}

static void close_device(wm_frame_source *base) { wm_camera_device_close((wm_camera_device *)base); }

static const wm_frame_source_ops kFrames = {peek, next, skip, NULL, raw, count, close_device};

wm_frame_source *wm_camera_device_frames(wm_camera_device *self) { return &self->base; }

void wm_camera_device_close(wm_camera_device *self) {
  if (!self) return;
  close_camera(self);
  jpeg_close(&self->jpeg);
  free(self->grey);
  free(self);
}

wm_status camera_device_make(const wm_camera_device_config *config, const wm_camera *camera, int32_t index,
                             wm_warn_fn warn, void *context, const camera_io *io, void *io_context,
                             wm_camera_device **out, wm_error *err) {
  *out = NULL;
  wm_camera_device *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "camera %s: no memory for it", config->name);
  self->base = (wm_frame_source){.ops = &kFrames, .is_live = 1};
  self->config = *config;
  self->width = camera->width_px;
  self->height = camera->height_px;
  self->index = index;
  self->warn = warn;
  self->warn_context = context;
  self->io = io;
  self->io_context = io_context;
  self->clock.readout_ns = camera->readout_ns;
  self->clock.latency_ns = wm_ns_from_seconds(config->latency_ms * 1e-3);
  _Static_assert(sizeof self->identity.path == sizeof config->gst, "a pipeline fits");
  (void)snprintf(self->identity.path, sizeof self->identity.path, "%s",
                 config->libcamera[0] ? config->libcamera
                 : config->gst[0]     ? config->gst
                                      : config->device);
  (void)snprintf(self->identity.card, sizeof self->identity.card, "%s", config->card);
  (void)snprintf(self->identity.bus, sizeof self->identity.bus, "%s", config->bus);
  self->grey = calloc((size_t)self->width * self->height + 1, 1);
  wm_status status = self->grey ? jpeg_open(&self->jpeg, err)
                                : wm_fail(err, WM_IO, "camera %s: no memory for its picture", config->name);
  if (status != WM_OK) {
    wm_camera_device_close(self);
    return status;
  }
  *out = self;
  return WM_OK;
}

int wm_camera_has_libcamera(void) {
#ifdef WM_WITH_LIBCAMERA
  return 1;
#else
  return 0;
#endif
}

wm_status wm_camera_device_open(const wm_camera_device_config *config, const wm_camera *camera, int32_t index,
                                wm_warn_fn warn, void *context, wm_camera_device **out, wm_error *err) {
  *out = NULL;
  const camera_io *io = config->libcamera[0] || config->gst[0] ? &kCameraProcess : &kV4l2;
  const char *program = config->gst[0] ? CAMERA_BY_GSTREAMER : CAMERA_BY_LIBCAMERA;
  if (config->libcamera[0] && !wm_camera_has_libcamera())
    return wm_fail(err, WM_BAD_CONFIG, "camera %s: " WM_WITHOUT_LIBCAMERA, config->name);
  if (config->gst[0] && !camera_process_is_there(program))
    return wm_fail(
        err, WM_BAD_CONFIG,
        "camera %s: gst: the program waymark-gst is missing: install the package waymark-gst, or build where "
        "libgstreamer-plugins-base1.0-dev is installed",
        config->name);
  // A process only reads its context.
  return camera_device_make(config, camera, index, warn, context, io, (void *)program, out, err);
}
