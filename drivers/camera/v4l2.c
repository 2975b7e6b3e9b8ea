// SPDX-License-Identifier: Apache-2.0
// V4L2 by system calls: memory-mapped streaming, single-planar and multi-planar (of one plane, as most image processors
// have it). Source: the kernel's Documentation/userspace-api/media/v4l.
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "camera_io.h"

#define NODES_MAX 64  // of /dev/videoN that are searched

typedef struct v4l2_camera {
  int fd;
  uint32_t type;    // V4L2_BUF_TYPE_VIDEO_CAPTURE, or _MPLANE
  uint32_t planes;  // of a multi-planar buffer
  uint32_t count;
  struct {
    void *start;  // the driver's memory, on many boards uncached: read once, in order
    size_t length;
    uint8_t *copy;  // the cached copy that is handed out
  } buffer[CAMERA_BUFFERS_MAX];
} v4l2_camera;

// A buffer as the ioctls require it, with room for the description of its planes.
typedef struct described {
  struct v4l2_buffer b;
  struct v4l2_plane planes[VIDEO_MAX_PLANES];
} described;

static int is_multi_planar(const v4l2_camera *self) { return self->type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

static struct v4l2_buffer *describe(const v4l2_camera *self, uint32_t index, described *out) {
  memset(out, 0, sizeof *out);
  out->b = (struct v4l2_buffer){.type = self->type, .memory = V4L2_MEMORY_MMAP, .index = index};
  if (is_multi_planar(self)) {
    out->b.m.planes = out->planes;
    out->b.length = VIDEO_MAX_PLANES;
  }
  return &out->b;
}

static int call(int fd, unsigned long request, void *argument) {
  int result;
  do result = ioctl(fd, request, argument);
  while (result < 0 && errno == EINTR);
  return result < 0 ? -errno : 0;
}

// ── which one ───────────────────────────────────────────────────────────────────────────────────────────────────────

// Opens a node that captures and streams; its identity into *is, and the type of its buffers. The descriptor, or
// -errno.
static int open_node(const char *path, camera_identity *is, uint32_t *type) {
  struct v4l2_capability can = {0};
  int fd = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT || errno == ENXIO ? -ENODEV : -errno;
  int failed = call(fd, VIDIOC_QUERYCAP, &can);
  uint32_t caps = can.capabilities & V4L2_CAP_DEVICE_CAPS ? can.device_caps : can.capabilities;
  *type = caps & V4L2_CAP_VIDEO_CAPTURE ? V4L2_BUF_TYPE_VIDEO_CAPTURE : V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
  const uint32_t captures = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE;
  if (!failed && !((caps & captures) && (caps & V4L2_CAP_STREAMING))) failed = -ENOTTY;
  if (failed) {
    (void)close(fd);
    return failed;
  }
  (void)snprintf(is->card, sizeof is->card, "%.32s", (const char *)can.card);
  (void)snprintf(is->bus, sizeof is->bus, "%.32s", (const char *)can.bus_info);
  return fd;
}

static int is_wanted(const camera_identity *wanted, const camera_identity *is) {
  return (!wanted->card[0] || strcmp(wanted->card, is->card) == 0) &&
         (!wanted->bus[0] || strcmp(wanted->bus, is->bus) == 0);
}

// By its path; else by its identity, under any number: an unplugged camera may come back under another one.
static int find_node(camera_identity *wanted, uint32_t *type) {
  camera_identity is;
  int fd = wanted->path[0] ? open_node(wanted->path, &is, type) : -ENODEV;
  if (fd >= 0 && is_wanted(wanted, &is)) {
    memcpy(wanted->card, is.card, sizeof wanted->card);
    memcpy(wanted->bus, is.bus, sizeof wanted->bus);
    return fd;
  }
  if (fd >= 0) (void)close(fd);
  if (fd < 0 && fd != -ENODEV) return fd;
  if (!wanted->card[0] && !wanted->bus[0]) return -ENODEV;
  for (int i = 0; i < NODES_MAX; i++) {
    char path[32];
    (void)snprintf(path, sizeof path, "/dev/video%d", i);
    fd = open_node(path, &is, type);
    if (fd >= 0 && is_wanted(wanted, &is)) return fd;
    if (fd >= 0) (void)close(fd);
  }
  return -ENODEV;
}

static int open_camera(void *context, camera_identity *wanted, void **camera) {
  (void)context;
  uint32_t type = 0;
  int fd = find_node(wanted, &type);
  if (fd < 0) return fd;
  v4l2_camera *self = calloc(1, sizeof *self);
  if (!self) {
    (void)close(fd);
    return -ENOMEM;
  }
  self->fd = fd;
  self->type = type;
  *camera = self;
  return 0;
}

// ── mode and controls ───────────────────────────────────────────────────────────────────────────────────────────────

static void set_rate(const v4l2_camera *self, double *rate_hz) {
  const int fd = self->fd;
  struct v4l2_streamparm p = {.type = self->type};
  if (*rate_hz > 0) {
    p.parm.capture.timeperframe = (struct v4l2_fract){1000, (uint32_t)(*rate_hz * 1000 + 0.5)};
    (void)call(fd, VIDIOC_S_PARM, &p);
  }
  *rate_hz = 0;
  const struct v4l2_fract *period = &p.parm.capture.timeperframe;
  if (call(fd, VIDIOC_G_PARM, &p) == 0 && period->numerator > 0)
    *rate_hz = (double)period->denominator / period->numerator;
}

// With several planes the colour is in another plane; only the first would be read.
static int set_planes(v4l2_camera *self, camera_mode *mode) {
  struct v4l2_format f = {.type = self->type};
  struct v4l2_pix_format_mplane *pix = &f.fmt.pix_mp;
  (void)call(self->fd, VIDIOC_G_FMT, &f);  // fields without a wish stay
  if (mode->width) pix->width = mode->width;
  if (mode->height) pix->height = mode->height;
  if (mode->fourcc) pix->pixelformat = mode->fourcc;
  pix->field = V4L2_FIELD_ANY;
  memset(pix->plane_fmt, 0, sizeof pix->plane_fmt);
  int failed = call(self->fd, VIDIOC_S_FMT, &f);
  if (failed) return failed;
  self->planes = pix->num_planes;
  if (self->planes != 1) return -EOPNOTSUPP;
  mode->fourcc = pix->pixelformat;
  mode->width = pix->width;
  mode->height = pix->height;
  mode->stride = pix->plane_fmt[0].bytesperline;
  mode->image_bytes = pix->plane_fmt[0].sizeimage;
  set_rate(self, &mode->rate_hz);
  return 0;
}

static int set_mode(void *camera, camera_mode *mode) {
  v4l2_camera *self = camera;
  struct v4l2_format f = {.type = self->type};
  if (is_multi_planar(self)) return set_planes(self, mode);
  (void)call(self->fd, VIDIOC_G_FMT, &f);  // fields without a wish stay
  if (mode->width) f.fmt.pix.width = mode->width;
  if (mode->height) f.fmt.pix.height = mode->height;
  if (mode->fourcc) f.fmt.pix.pixelformat = mode->fourcc;
  f.fmt.pix.field = V4L2_FIELD_ANY;
  f.fmt.pix.bytesperline = f.fmt.pix.sizeimage = 0;
  int failed = call(self->fd, VIDIOC_S_FMT, &f);
  if (failed) return failed;
  mode->fourcc = f.fmt.pix.pixelformat;
  mode->width = f.fmt.pix.width;
  mode->height = f.fmt.pix.height;
  mode->stride = f.fmt.pix.bytesperline;
  mode->image_bytes = f.fmt.pix.sizeimage;
  set_rate(self, &mode->rate_hz);
  return 0;
}

// v4l2-ctl's spelling of a name: lower case letters and digits, one underscore for all between them.
static void plain_name(const char *from, size_t length, char *to, size_t capacity) {
  size_t used = 0;
  for (size_t i = 0; i < length && from[i] && used + 1 < capacity; i++) {
    if (isalnum((unsigned char)from[i]))
      to[used++] = (char)tolower((unsigned char)from[i]);
    else if (used > 0 && to[used - 1] != '_')
      to[used++] = '_';
  }
  while (used > 0 && to[used - 1] == '_') used--;
  to[used] = '\0';
}

static int set_control(void *camera, camera_control *control) {
  v4l2_camera *self = camera;
  struct v4l2_queryctrl q = {.id = V4L2_CTRL_FLAG_NEXT_CTRL};
  for (; call(self->fd, VIDIOC_QUERYCTRL, &q) == 0; q.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
    char name[40];
    plain_name((const char *)q.name, sizeof q.name, name, sizeof name);
    if (q.flags & V4L2_CTRL_FLAG_DISABLED || strcmp(name, control->name) != 0) continue;
    int32_t wanted = control->value;
    if (wanted < q.minimum) control->value = q.minimum;
    if (wanted > q.maximum) control->value = q.maximum;
    struct v4l2_control c = {.id = q.id, .value = control->value};
    int failed = call(self->fd, VIDIOC_S_CTRL, &c);
    return failed ? failed : wanted == control->value ? 0 : -ERANGE;
  }
  return -EINVAL;
}

static wm_time_ns exposure_ns(void *camera) {
  v4l2_camera *self = camera;
  struct v4l2_control c = {.id = V4L2_CID_EXPOSURE_ABSOLUTE};  // in 100 us
  if (call(self->fd, VIDIOC_G_CTRL, &c) != 0 || c.value <= 0) return 0;
  return (wm_time_ns)c.value * 100 * WM_NS_PER_US;
}

// ── streaming ───────────────────────────────────────────────────────────────────────────────────────────────────────

static int give_back(void *camera, uint32_t index) {
  const v4l2_camera *self = camera;
  described d;
  struct v4l2_buffer *b = describe(self, index, &d);
  if (is_multi_planar(self)) b->length = self->planes;
  return call(self->fd, VIDIOC_QBUF, b);
}

static int map_buffer(v4l2_camera *self, uint32_t i) {
  described d;
  const struct v4l2_buffer *b = describe(self, i, &d);
  int failed = call(self->fd, VIDIOC_QUERYBUF, &d.b);
  if (failed) return failed;
  const size_t length = is_multi_planar(self) ? d.planes[0].length : b->length;
  const off_t offset = is_multi_planar(self) ? d.planes[0].m.mem_offset : b->m.offset;
  void *start = mmap(NULL, length, PROT_READ, MAP_SHARED, self->fd, offset);
  if (start == MAP_FAILED) return -errno;
  self->buffer[i].start = start;
  self->buffer[i].length = length;
  self->count = i + 1;
  self->buffer[i].copy = malloc(length);
  return self->buffer[i].copy ? give_back(self, i) : -ENOMEM;
}

static int start(void *camera, uint32_t buffers) {
  v4l2_camera *self = camera;
  struct v4l2_requestbuffers r = {.count = buffers, .type = self->type, .memory = V4L2_MEMORY_MMAP};
  int failed = call(self->fd, VIDIOC_REQBUFS, &r);
  if (!failed && r.count == 0) failed = -ENOMEM;
  for (uint32_t i = 0; !failed && i < r.count && i < CAMERA_BUFFERS_MAX; i++) failed = map_buffer(self, i);
  return failed ? failed : call(self->fd, VIDIOC_STREAMON, &self->type);
}

// The only place where the driver's memory is read.
static void fill(const v4l2_camera *self, const struct v4l2_buffer *b, camera_buffer *out) {
  const size_t length = self->buffer[b->index].length;
  size_t used = b->bytesused, offset = 0;
  if (is_multi_planar(self)) {  // bytesused counts from the plane's beginning
    offset = b->m.planes[0].data_offset < length ? b->m.planes[0].data_offset : length;
    used = b->m.planes[0].bytesused > offset ? b->m.planes[0].bytesused - offset : 0;
  }
  if (used > length - offset) used = length - offset;
  *out = (camera_buffer){.index = b->index, .bytes = (uint32_t)used, .sequence = b->sequence};
  out->stamp_ns = (wm_time_ns)b->timestamp.tv_sec * WM_NS_PER_S + (wm_time_ns)b->timestamp.tv_usec * WM_NS_PER_US;
  if ((b->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE) out->flags |= CAMERA_STAMP_START;
  if (b->flags & V4L2_BUF_FLAG_ERROR) out->flags |= CAMERA_BUFFER_ERROR;
  memcpy(self->buffer[b->index].copy, (const uint8_t *)self->buffer[b->index].start + offset, used);
  out->data = self->buffer[b->index].copy;
}

static int take(void *camera, int wait_ms, camera_buffer *out) {
  v4l2_camera *self = camera;
  struct pollfd waiting = {.fd = self->fd, .events = POLLIN};
  int ready = poll(&waiting, 1, wait_ms);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return 0;
  if (ready < 0) return -errno;
  described d;
  struct v4l2_buffer *b = describe(self, 0, &d);
  int failed = call(self->fd, VIDIOC_DQBUF, b);
  if (failed == -EAGAIN) return waiting.revents & (POLLERR | POLLHUP) ? -EIO : 0;
  if (failed) return failed;
  if (b->index >= self->count) return -EIO;
  fill(self, b, out);
  return 1;
}

static void close_camera(void *camera) {
  v4l2_camera *self = camera;
  (void)call(self->fd, VIDIOC_STREAMOFF, &self->type);
  for (uint32_t i = 0; i < self->count; i++) {
    (void)munmap(self->buffer[i].start, self->buffer[i].length);
    free(self->buffer[i].copy);
  }
  (void)close(self->fd);
  free(self);
}

static void sleep_ms(void *context, int ms) {
  (void)context;
  struct timespec duration = {.tv_sec = ms / 1000, .tv_nsec = (long)(ms % 1000) * 1000000};
  (void)nanosleep(&duration, NULL);
}

static wm_time_ns monotonic_ns(void *context) {
  (void)context;
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

const camera_io kV4l2 = {open_camera, set_mode,  set_control,  exposure_ns, start,
                         take,        give_back, close_camera, sleep_ms,    monotonic_ns};
