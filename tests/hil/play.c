// SPDX-License-Identifier: Apache-2.0
// play TIMELINE PICTURES CAN DEVICE WIDTH HEIGHT DELAY [FROM UNTIL]: a recording's CAN frames, pictures and sightings,
// each at its own time, by one clock, which neither canplayer nor a camera's steady rate can do. A line of TIMELINE is
// "NANOSECONDS c ID HEXDATA", "NANOSECONDS p OFFSET BYTES" (of PICTURES, an MJPEG picture) or "NANOSECONDS l STAMP
// OFFSET BYTES [CHANNEL]" (of PICTURES, a message for LCM, by default of sightings, stamped anew), "NANOSECONDS x" (the
// device is closed) or "NANOSECONDS o" (it is opened again as soon as it is there), "NANOSECONDS g X Y Z" (a gyro's
// rates in 1e-6 rad/s, by the kernel's driver of HID sensors) or "NANOSECONDS n OFFSET BYTES" (of PICTURES, what a GNSS
// receiver writes; /run/receiver leads to its line), rising; lines before FROM and from UNTIL on are left out. The
// formats are set at once (DEVICE "-": there are no pictures); the first line is due after DELAY seconds. Prints how
// far CLOCK_MONOTONIC is ahead of the timeline, and at the end how late it was at most.
#include <arpa/inet.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/videodev2.h>
#include <net/if.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "play_devices.h"

typedef struct item {
  long long t_ns;
  char kind;
  struct can_frame frame;
  size_t offset, bytes;
  long long stamp_ns;
  char channel[32];
  int32_t rates[3];
} item;

static char *read_file(const char *path, size_t *length) {
  FILE *f = fopen(path, "rb");
  if (!f) return NULL;
  (void)fseek(f, 0, SEEK_END);
  *length = (size_t)ftell(f);
  rewind(f);
  char *data = calloc(*length + 1, 1);
  if (data && fread(data, 1, *length, f) != *length) data = NULL;
  (void)fclose(f);
  return data;
}

static int parse(const char *line, item *out) {
  int used = 0;
  char data[32] = "";
  unsigned id = 0;
  memset(out, 0, sizeof *out);
  if (sscanf(line, "%lld %c%n", &out->t_ns, &out->kind, &used) != 2) return 0;
  if (out->kind == 'x' || out->kind == 'o') return 1;
  if (out->kind == 'l') {
    (void)snprintf(out->channel, sizeof out->channel, "WAYMARK_SIGHTINGS");
    return sscanf(line + used, "%lld %zu %zu %31s", &out->stamp_ns, &out->offset, &out->bytes, out->channel) >= 3;
  }
  if (out->kind == 'p' || out->kind == 'n') return sscanf(line + used, "%zu %zu", &out->offset, &out->bytes) == 2;
  if (out->kind == 'g') return sscanf(line + used, "%d %d %d", &out->rates[0], &out->rates[1], &out->rates[2]) == 3;
  if (sscanf(line + used, "%x %16s", &id, data) < 1) return 0;
  out->frame.can_id = id;
  out->frame.can_dlc = (unsigned char)(strlen(data) / 2);
  for (int i = 0; i < out->frame.can_dlc; i++) {
    unsigned byte = 0;
    (void)sscanf(data + 2 * i, "%2x", &byte);
    out->frame.data[i] = (unsigned char)byte;
  }
  return 1;
}

static int open_can(const char *interface) {
  int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  struct sockaddr_can at = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(interface)};
  return fd >= 0 && bind(fd, (struct sockaddr *)&at, sizeof at) == 0 ? fd : -1;
}

static int open_video(const char *device, unsigned width, unsigned height) {
  int fd = open(device, O_RDWR);
  struct v4l2_capability can;
  struct v4l2_format f = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
  if (fd < 0 || ioctl(fd, VIDIOC_QUERYCAP, &can) != 0) return -1;
  f.fmt.pix.width = width;
  f.fmt.pix.height = height;
  f.fmt.pix.pixelformat = V4L2_PIX_FMT_MJPEG;
  f.fmt.pix.field = V4L2_FIELD_NONE;
  f.fmt.pix.sizeimage = width * height * 2;
  return ioctl(fd, VIDIOC_S_FMT, &f) == 0 ? fd : -1;
}

// One datagram. Source: LCM's protocol, "LC02", sequence number, channel, message; a message is its type's fingerprint
// and, here, a stamp, in network order.
static int say(int fd, const char *channel, char *message, size_t bytes, long long stamp_ns) {
  static unsigned sequence;
  static char packet[4096];
  const size_t named = strlen(channel) + 1;
  const struct sockaddr_in to = {
      .sin_family = AF_INET, .sin_port = htons(7667), .sin_addr.s_addr = inet_addr("239.255.76.67")};
  unsigned head[2] = {htonl(0x4c433032), htonl(sequence++)};
  size_t length = sizeof head + named + bytes;
  if (bytes < 16 || length > sizeof packet) return 0;
  for (int i = 0; i < 8; i++) message[8 + i] = (char)(stamp_ns >> (56 - 8 * i));
  memcpy(packet, head, sizeof head);
  memcpy(packet + sizeof head, channel, named);
  memcpy(packet + sizeof head + named, message, bytes);
  return sendto(fd, packet, length, 0, (const struct sockaddr *)&to, sizeof to) == (ssize_t)length;
}

static int is_among(const item *items, size_t count, char kind) {
  for (size_t i = 0; i < count; i++)
    if (items[i].kind == kind) return 1;
  return 0;
}

static long long now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1000000000LL + t.tv_nsec;
}

int main(int argc, char **argv) {
  if (argc != 8 && argc != 10) return 2;
  size_t text_length = 0, pictures_length = 0, count = 0;
  char *text = read_file(argv[1], &text_length), *pictures = read_file(argv[2], &pictures_length);
  item *items = calloc(text_length / 4 + 1, sizeof *items);
  int can = open_can(argv[3]),
      video = !strcmp(argv[4], "-") ? -2 : open_video(argv[4], (unsigned)atoi(argv[5]), (unsigned)atoi(argv[6])),
      lcm = socket(AF_INET, SOCK_DGRAM, 0);
  if (!text || !pictures || !items || can < 0 || video == -1 || lcm < 0) {
    perror("play");
    return 1;
  }
  const long long from_ns = argc == 10 ? atoll(argv[8]) : LLONG_MIN, until_ns = argc == 10 ? atoll(argv[9]) : LLONG_MAX;
  for (char *rest = text, *line; (line = strsep(&rest, "\n"));)
    count += parse(line, &items[count]) && items[count].t_ns >= from_ns && items[count].t_ns < until_ns;
  const int gyro = is_among(items, count, 'g') ? gyro_open() : -2,
            receiver = is_among(items, count, 'n') ? receiver_open("/run/receiver") : -2;
  if (gyro == -1 || receiver == -1) {
    perror("play: gyro, receiver");
    return 1;
  }
  long long begin_ns = now_ns() + (long long)(atof(argv[7]) * 1e9), worst_ns = 0, failed = 0;
  printf("ahead %lld ns\n", begin_ns - items[0].t_ns);
  (void)fflush(stdout);
  for (size_t i = 0; i < count; i++) {
    const item *it = &items[i];
    long long due_ns = begin_ns + it->t_ns - items[0].t_ns;
    struct timespec due = {due_ns / 1000000000, due_ns % 1000000000};
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
    long long late_ns = now_ns() - due_ns;
    if (late_ns > worst_ns) worst_ns = late_ns;
    if (it->kind == 'c') failed += write(can, &it->frame, sizeof it->frame) != sizeof it->frame;
    if (it->kind == 'g') failed += !gyro_say(gyro, it->rates);
    if (it->kind == 'n') failed += !receiver_say(receiver, pictures + it->offset, it->bytes);
    if (it->kind == 'x') (void)close(video);
    if (it->kind == 'x' || it->kind == 'o') video = -1;
    for (int tries = 0; it->kind == 'o' && video == -1 && tries < 100; tries++) {
      (void)usleep(10000);
      video = open_video(argv[4], (unsigned)atoi(argv[5]), (unsigned)atoi(argv[6]));
    }
    if (it->kind == 'p' && it->offset + it->bytes <= pictures_length)
      failed += write(video, pictures + it->offset, it->bytes) != (ssize_t)it->bytes;
    if (it->kind == 'l' && it->offset + it->bytes <= pictures_length)
      failed += !say(lcm, it->channel, pictures + it->offset, it->bytes, begin_ns + it->stamp_ns - items[0].t_ns);
  }
  printf("played %zu, %lld not written, %.3f ms late at most\n", count, failed, (double)worst_ns * 1e-6);
  return failed != 0;
}
