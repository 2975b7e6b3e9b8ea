// SPDX-License-Identifier: Apache-2.0
// feed DEVICE WIDTH HEIGHT RATE COUNT: writes grey pictures, each another one, to a v4l2loopback node.
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

int main(int argc, char **argv) {
  if (argc != 6) return 2;
  int width = atoi(argv[2]), height = atoi(argv[3]), count = atoi(argv[5]);
  double rate = atof(argv[4]);
  size_t bytes = (size_t)width * (size_t)height;
  static unsigned char picture[1920 * 1080];
  int fd = open(argv[1], O_RDWR);
  if (fd < 0 || bytes > sizeof picture) return 1;
  struct v4l2_capability can;
  (void)ioctl(fd, VIDIOC_QUERYCAP, &can);
  struct v4l2_format f = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
  f.fmt.pix.width = (unsigned)width;
  f.fmt.pix.height = (unsigned)height;
  f.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
  f.fmt.pix.field = V4L2_FIELD_NONE;
  f.fmt.pix.bytesperline = (unsigned)width;
  f.fmt.pix.sizeimage = (unsigned)bytes;
  if (ioctl(fd, VIDIOC_S_FMT, &f) != 0) return 1;
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  for (int i = 0; i < count; i++) {
    memset(picture, i, bytes);
    if (write(fd, picture, bytes) != (ssize_t)bytes) return 1;
    t.tv_nsec += (long)(1e9 / rate);
    while (t.tv_nsec >= 1000000000) {
      t.tv_nsec -= 1000000000;
      t.tv_sec++;
    }
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
  }
  return 0;
}
