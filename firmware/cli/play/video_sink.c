// SPDX-License-Identifier: Apache-2.0
// Pictures into a V4L2 output device, as v4l2loopback makes them.
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/play/sink.h"

typedef struct video_sink {
  play_sink base;
  char device[128];
  uint32_t fourcc, width_px, height_px, bytes_max;
  int fd;       // -1: closed by a fault, or not there
  int is_away;  // a fault has it unplugged
} video_sink;

static wm_status check_device(const video_sink *self, wm_error *err) {
  struct v4l2_capability can = {0};
  if (ioctl(self->fd, VIDIOC_QUERYCAP, &can) != 0)
    return wm_fail(err, WM_BAD_USAGE, "%s: is not a video device", self->device);
  const uint32_t has = can.capabilities & V4L2_CAP_DEVICE_CAPS ? can.device_caps : can.capabilities;
  if (!(has & V4L2_CAP_VIDEO_OUTPUT))
    return wm_fail(err, WM_BAD_USAGE,
                   "%s: is a camera, not an output; `modprobe v4l2loopback` makes devices that take pictures",
                   self->device);
  return WM_OK;
}

static wm_status set_format(const video_sink *self, wm_error *err) {
  struct v4l2_format f = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
  f.fmt.pix.width = self->width_px;
  f.fmt.pix.height = self->height_px;
  f.fmt.pix.pixelformat = self->fourcc;
  f.fmt.pix.field = V4L2_FIELD_NONE;
  f.fmt.pix.sizeimage = self->bytes_max;
  if (self->fourcc == V4L2_PIX_FMT_GREY) f.fmt.pix.bytesperline = self->width_px;
  if (self->fourcc == V4L2_PIX_FMT_YUYV) f.fmt.pix.bytesperline = 2 * self->width_px;
  if (ioctl(self->fd, VIDIOC_S_FMT, &f) != 0)
    return wm_fail(err, WM_IO, "%s: does not take pictures of this format: %s", self->device, strerror(errno));
  if (f.fmt.pix.width == self->width_px && f.fmt.pix.height == self->height_px &&
      f.fmt.pix.pixelformat == self->fourcc) {
    // v4l2loopback lets readers in from here on, not only from the first picture on; other drivers may refuse it.
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    (void)ioctl(self->fd, VIDIOC_STREAMON, &type);
    return WM_OK;
  }
  return wm_fail(err, WM_IO,
                 "%s: keeps %u x %u and another format, as another program has it open; end that program, or make the "
                 "device anew (`modprobe -r v4l2loopback`)",
                 self->device, f.fmt.pix.width, f.fmt.pix.height);
}

static wm_status open_device(video_sink *self, wm_error *err) {
  self->fd = open(self->device, O_RDWR | O_CLOEXEC);
  if (self->fd < 0)
    return wm_fail(err, errno == ENOENT ? WM_NOT_FOUND : WM_IO, "%s: can't be opened: %s%s", self->device,
                   strerror(errno), errno == ENOENT ? " (`modprobe v4l2loopback video_nr=10` makes /dev/video10)" : "");
  wm_status status = check_device(self, err);
  if (status == WM_OK) status = set_format(self, err);
  if (status == WM_OK) return WM_OK;
  (void)close(self->fd);
  self->fd = -1;
  return status;
}

static int send_picture(play_sink *base, wm_play_item *item, wm_time_ns stamp_ns) {
  video_sink *self = (video_sink *)base;
  wm_error err;
  (void)stamp_ns;
  if (self->is_away) return -ENODEV;
  if (self->fd < 0 && open_device(self, &err) != WM_OK) return -ENODEV;
  if (item->bytes > self->bytes_max) return -EMSGSIZE;
  const ssize_t written = write(self->fd, item->data, item->bytes);
  if (written < 0) return -errno;
  return written == (ssize_t)item->bytes ? 0 : -EIO;
}

static int cause(play_sink *base, const wm_fault *fault, int begins) {
  video_sink *self = (video_sink *)base;
  if (fault->kind != WM_FAULT_CAMERA_UNPLUGGED) return 0;
  self->is_away = begins;
  if (begins && self->fd >= 0) (void)close(self->fd);
  if (begins) self->fd = -1;
  return 0;  // it is opened again with its next picture
}

static void close_sink(play_sink *base) {
  video_sink *self = (video_sink *)base;
  if (self->fd >= 0) (void)close(self->fd);
  free(self);
}

static const play_sink_ops kVideo = {send_picture, cause, NULL, close_sink};

wm_status video_sink_open(const char *device, const char *format, uint32_t width_px, uint32_t height_px,
                          play_sink **out, wm_error *err) {
  *out = NULL;
  video_sink *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to open it", device);
  const int is_grey = strcmp(format, "GREY") == 0, is_jpeg = strcmp(format, "MJPG") == 0;
  self->base.ops = &kVideo;
  (void)snprintf(self->device, sizeof self->device, "%s", device);
  (void)snprintf(self->base.where, sizeof self->base.where, "%.120s (%s)", device, format);
  self->fourcc = is_grey ? V4L2_PIX_FMT_GREY : is_jpeg ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_YUYV;
  self->width_px = width_px;
  self->height_px = height_px;
  self->bytes_max = width_px * height_px * (is_grey ? 1 : 2);
  wm_status status = open_device(self, err);
  if (status == WM_OK)
    *out = &self->base;
  else
    free(self);
  return status;
}
