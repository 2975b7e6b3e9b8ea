// SPDX-License-Identifier: Apache-2.0
// V4L2's ioctls against a driver of the test's, behind the C library's calls (--wrap): single-planar, and multi-planar
// as image processors have it. What the driver writes later doesn't change a picture that was taken.
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdarg.h>
#include <sys/mman.h>

#include "camera_io.h"
#include "common/suite.h"

#define FD 77
#define W 8
#define H 4
#define BUFFERS 3
#define OFFSET 16  // of the picture in its plane

static struct driver {
  uint32_t capabilities, planes;
  uint8_t memory[BUFFERS][OFFSET + W * H];
  int queued[BUFFERS], is_streaming, mapped, is_ready;
  int protections;
  uint32_t next;
} driver;

static uint32_t type_of(void) {
  return driver.capabilities & V4L2_CAP_VIDEO_CAPTURE ? V4L2_BUF_TYPE_VIDEO_CAPTURE
                                                      : V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
}
static int is_planar(void) { return type_of() == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

static int failed(int reason) {
  errno = reason;
  return -1;
}

static int format(struct v4l2_format *f) {
  if (f->type != type_of()) return failed(EINVAL);
  if (is_planar()) {
    f->fmt.pix_mp.width = W;
    f->fmt.pix_mp.height = H;
    f->fmt.pix_mp.pixelformat = V4L2_PIX_FMT_GREY;
    f->fmt.pix_mp.num_planes = (uint8_t)driver.planes;
    f->fmt.pix_mp.plane_fmt[0].bytesperline = W;
    f->fmt.pix_mp.plane_fmt[0].sizeimage = W * H;
  } else {
    f->fmt.pix.width = W;
    f->fmt.pix.height = H;
    f->fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
    f->fmt.pix.bytesperline = W;
    f->fmt.pix.sizeimage = W * H;
  }
  return 0;
}

static int buffer(unsigned long request, struct v4l2_buffer *b) {
  if (b->type != type_of() || b->memory != V4L2_MEMORY_MMAP) return failed(EINVAL);
  if (is_planar() && (!b->m.planes || b->length < driver.planes)) return failed(EINVAL);
  if (request == VIDIOC_DQBUF) {
    if (!driver.is_ready) return failed(EAGAIN);
    driver.is_ready = 0;
    b->index = driver.next++ % BUFFERS;
    driver.queued[b->index] = 0;
    b->sequence = driver.next;
    b->timestamp.tv_sec = 5;
    if (is_planar()) {
      b->m.planes[0].bytesused = OFFSET + W * H;
      b->m.planes[0].data_offset = OFFSET;
    } else {
      b->bytesused = W * H;
    }
    return 0;
  }
  if (b->index >= BUFFERS) return failed(EINVAL);
  if (request == VIDIOC_QBUF) driver.queued[b->index] = 1;
  if (request == VIDIOC_QUERYBUF && is_planar()) {
    b->m.planes[0].length = sizeof driver.memory[0];
    b->m.planes[0].m.mem_offset = b->index;
  } else if (request == VIDIOC_QUERYBUF) {
    b->length = sizeof driver.memory[0];
    b->m.offset = b->index;
  }
  return 0;
}

// Names that the linker asks for.
// NOLINTBEGIN(bugprone-reserved-identifier)
int __wrap_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...) {
  (void)flags;
  return strcmp(path, "/dev/video9") == 0 ? FD : failed(ENOENT);
}

int __wrap_close(int fd);
int __wrap_close(int fd) {
  TEST_ASSERT_EQUAL(FD, fd);
  return 0;
}

int __wrap_poll(struct pollfd *fds, nfds_t count, int wait_ms);
int __wrap_poll(struct pollfd *fds, nfds_t count, int wait_ms) {
  (void)count, (void)wait_ms;
  fds[0].revents = POLLIN;
  return driver.is_ready;
}

void *__wrap_mmap(void *at, size_t length, int protection, int flags, int fd, off_t offset);
void *__wrap_mmap(void *at, size_t length, int protection, int flags, int fd, off_t offset) {
  (void)at, (void)flags;
  TEST_ASSERT_EQUAL(FD, fd);
  TEST_ASSERT_EQUAL(sizeof driver.memory[0], length);
  driver.protections |= protection;
  driver.mapped++;
  return driver.memory[offset];
}

int __wrap_munmap(void *start, size_t length);
int __wrap_munmap(void *start, size_t length) {
  (void)start, (void)length;
  driver.mapped--;
  return 0;
}

int __wrap_ioctl(int fd, unsigned long request, ...);
int __wrap_ioctl(int fd, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void *argument = va_arg(arguments, void *);
  va_end(arguments);
  TEST_ASSERT_EQUAL(FD, fd);
  if (request == VIDIOC_QUERYCAP) {
    ((struct v4l2_capability *)argument)->capabilities = driver.capabilities;
    return 0;
  }
  if (request == VIDIOC_G_FMT || request == VIDIOC_S_FMT) return format(argument);
  if (request == VIDIOC_REQBUFS) {
    struct v4l2_requestbuffers *r = argument;
    r->count = BUFFERS;
    return r->type == type_of() ? 0 : failed(EINVAL);
  }
  if (request == VIDIOC_STREAMON || request == VIDIOC_STREAMOFF) {
    driver.is_streaming = request == VIDIOC_STREAMON;
    return *(uint32_t *)argument == type_of() ? 0 : failed(EINVAL);
  }
  if (request == VIDIOC_QUERYBUF || request == VIDIOC_QBUF || request == VIDIOC_DQBUF) return buffer(request, argument);
  return failed(ENOTTY);
}

// NOLINTEND(bugprone-reserved-identifier)

void setUp(void) { memset(&driver, 0, sizeof driver); }

static void *open_camera(uint32_t capabilities, uint32_t planes, int expected) {
  void *camera = NULL;
  camera_identity identity = {.path = "/dev/video9"};
  camera_mode mode = {.width = W, .height = H, .fourcc = V4L2_PIX_FMT_GREY};
  driver.capabilities = capabilities | V4L2_CAP_STREAMING;
  driver.planes = planes;
  TEST_ASSERT_EQUAL(0, kV4l2.open(NULL, &identity, &camera));
  TEST_ASSERT_EQUAL(expected, kV4l2.set_mode(camera, &mode));
  if (expected == 0) {
    TEST_ASSERT_EQUAL(W, mode.stride);
    TEST_ASSERT_EQUAL(W * H, mode.image_bytes);
  }
  return camera;
}

static void take_pictures(void *camera, size_t offset) {
  camera_buffer first, second;
  TEST_ASSERT_EQUAL(0, kV4l2.start(camera, BUFFERS));
  TEST_ASSERT_TRUE(driver.is_streaming && driver.queued[0] && driver.queued[2]);
  TEST_ASSERT_EQUAL(PROT_READ, driver.protections);
  TEST_ASSERT_EQUAL(0, kV4l2.take(camera, 1, &first));
  memset(driver.memory[0] + offset, 11, W * H);
  memset(driver.memory[1] + offset, 22, W * H);
  driver.is_ready = 1;
  TEST_ASSERT_EQUAL(1, kV4l2.take(camera, 1, &first));
  driver.is_ready = 1;
  TEST_ASSERT_EQUAL(1, kV4l2.take(camera, 1, &second));
  TEST_ASSERT_EQUAL(W * H, first.bytes);
  memset(driver.memory, 99, sizeof driver.memory);  // the driver writes on
  TEST_ASSERT_EACH_EQUAL_UINT8(11, first.data, W * H);
  TEST_ASSERT_EACH_EQUAL_UINT8(22, second.data, W * H);
  TEST_ASSERT_FALSE(driver.queued[0]);
  TEST_ASSERT_EQUAL(0, kV4l2.give_back(camera, first.index));
  TEST_ASSERT_TRUE(driver.queued[0]);
  kV4l2.close(camera);
  TEST_ASSERT_EQUAL(0, driver.mapped);
  TEST_ASSERT_FALSE(driver.is_streaming);
}

TEST(single_planar) { take_pictures(open_camera(V4L2_CAP_VIDEO_CAPTURE, 0, 0), 0); }
TEST(multi_planar_of_one_plane) { take_pictures(open_camera(V4L2_CAP_VIDEO_CAPTURE_MPLANE, 1, 0), OFFSET); }

TEST(several_planes_are_refused) { kV4l2.close(open_camera(V4L2_CAP_VIDEO_CAPTURE_MPLANE, 2, -EOPNOTSUPP)); }

TEST(what_captures_nothing_is_no_camera) {
  void *camera;
  camera_identity identity = {.path = "/dev/video9"};
  driver.capabilities = V4L2_CAP_STREAMING | V4L2_CAP_VIDEO_OUTPUT_MPLANE;
  TEST_ASSERT_EQUAL(-ENOTTY, kV4l2.open(NULL, &identity, &camera));
}
