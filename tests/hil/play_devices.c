// SPDX-License-Identifier: Apache-2.0
#define _GNU_SOURCE  // pseudo-terminals
#include "play_devices.h"

#include <fcntl.h>
#include <linux/uhid.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#define REPORT 1
#define FEATURE_BYTES 7  // number, reporting state, power state, interval in ms

// Report descriptor of a gyroscope in three axes. Source: HID Usage Tables 1.22, chapter 22 (Sensors).
static const uint8_t kDescriptor[] = {
    0x05, 0x20, 0x09, 0x76, 0xa1, 0x00, 0x85, REPORT,  // sensor, gyrometer 3D, physical collection
    0x0a, 0x16, 0x03, 0x15, 0x00, 0x25, 0x05, 0x75,   0x08, 0x95, 0x01, 0xa1, 0x02,  // reporting state, one of six
    0x0a, 0x40, 0x08, 0x0a, 0x41, 0x08, 0x0a, 0x42,   0x08, 0x0a, 0x43, 0x08, 0x0a, 0x44, 0x08, 0x0a, 0x45, 0x08,  //
    0xb1, 0x00, 0xc0,                                                                                              //
    0x0a, 0x19, 0x03, 0x15, 0x00, 0x25, 0x05, 0x75,   0x08, 0x95, 0x01, 0xa1, 0x02,  // power state, one of six
    0x0a, 0x50, 0x08, 0x0a, 0x51, 0x08, 0x0a, 0x52,   0x08, 0x0a, 0x53, 0x08, 0x0a, 0x54, 0x08, 0x0a, 0x55, 0x08,  //
    0xb1, 0x00, 0xc0,                                                                                              //
    0x0a, 0x0e, 0x03, 0x15, 0x00, 0x27, 0xff, 0xff,   0xff, 0x7f, 0x75, 0x20, 0x95, 0x01, 0xb1, 0x02,        // interval
    0x66, 0xf0, 0x12, 0x55, 0x0a, 0x17, 0x01, 0x00,   0x00, 0x80, 0x27, 0xff, 0xff, 0xff, 0x7f, 0x75, 0x20,  // urad/s
    0x0a, 0x57, 0x04, 0x81, 0x02, 0x0a, 0x58, 0x04,   0x81, 0x02, 0x0a, 0x59, 0x04, 0x81, 0x02, 0xc0,        // x, y, z
};

static int tell(int fd, const struct uhid_event *event) {
  return write(fd, event, sizeof *event) == (ssize_t)sizeof *event;
}

// The driver switches the sensor on and reads its interval: what it sets is what it gets.
static void *answer(void *context) {
  const int fd = (int)(intptr_t)context;
  static struct uhid_event asked, said;
  static uint8_t feature[FEATURE_BYTES] = {REPORT, 0, 0, 10};
  while (read(fd, &asked, sizeof asked) > 0) {
    memset(&said, 0, sizeof said);
    if (asked.type == UHID_GET_REPORT) {
      said.type = UHID_GET_REPORT_REPLY;
      said.u.get_report_reply.id = asked.u.get_report.id;
      said.u.get_report_reply.size = sizeof feature;
      memcpy(said.u.get_report_reply.data, feature, sizeof feature);
    } else if (asked.type == UHID_SET_REPORT) {
      said.type = UHID_SET_REPORT_REPLY;
      said.u.set_report_reply.id = asked.u.set_report.id;
      if (asked.u.set_report.size == sizeof feature) memcpy(feature, asked.u.set_report.data, sizeof feature);
    } else {
      continue;
    }
    if (!tell(fd, &said)) break;
  }
  return NULL;
}

int gyro_open(void) {
  static struct uhid_event made = {.type = UHID_CREATE2};
  pthread_t thread;
  const int fd = open("/dev/uhid", O_RDWR | O_CLOEXEC);
  if (fd < 0) return -1;
  memcpy(made.u.create2.name, "gyroscope", sizeof "gyroscope");
  made.u.create2.rd_size = sizeof kDescriptor;
  made.u.create2.bus = 0x18;  // BUS_I2C
  memcpy(made.u.create2.rd_data, kDescriptor, sizeof kDescriptor);
  if (pthread_create(&thread, NULL, answer, (void *)(intptr_t)fd) != 0 || !tell(fd, &made)) return -1;
  return fd;
}

int gyro_say(int fd, const int32_t rates[3]) {
  static struct uhid_event said = {.type = UHID_INPUT2};
  said.u.input2.size = 1 + 3 * sizeof *rates;
  said.u.input2.data[0] = REPORT;
  memcpy(said.u.input2.data + 1, rates, 3 * sizeof *rates);
  return tell(fd, &said);
}

int receiver_open(const char *link) {
  struct termios raw;
  const int fd = open("/dev/ptmx", O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (fd < 0 || grantpt(fd) != 0 || unlockpt(fd) != 0 || tcgetattr(fd, &raw) != 0) return -1;
  cfmakeraw(&raw);  // no echo of what is sent
  const char *other = ptsname(fd);
  if (!other || tcsetattr(fd, TCSANOW, &raw) != 0 || chmod(other, 0666) != 0) return -1;
  (void)unlink(link);
  return symlink(other, link) == 0 ? fd : -1;
}

int receiver_say(int fd, const char *text, size_t bytes) { return write(fd, text, bytes) == (ssize_t)bytes; }
