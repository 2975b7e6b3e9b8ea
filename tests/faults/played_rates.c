// SPDX-License-Identifier: Apache-2.0
// Reads the played drivers as fast as they give: played_rates SECONDS DEVICE ... (with WM_PLAYED). Frames of interfaces
// are printed as candump writes them; at the end for each device how many came, how many are missing by the driver's
// count, and how late they were taken. Devices begin with "/dev/": cameras.
#include <linux/videodev2.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "camera_io.h"
#include "can_io.h"
#include "played_world.h"

#define DEVICES_MAX 8
#define LATE_MAX 100000

typedef struct reader {
  const char *device;
  wm_time_ns end_ns;
  size_t count, missing;
  double late_us[LATE_MAX];
  pthread_t thread;
} reader;

static reader readers[DEVICES_MAX];
static pthread_mutex_t printing = PTHREAD_MUTEX_INITIALIZER;

static void note(reader *self, wm_time_ns late_ns) {
  if (self->count < LATE_MAX) self->late_us[self->count] = (double)late_ns * 1e-3;
  self->count++;
}

static void read_can(reader *self) {
  int is_up;
  char line[256];
  can_received got;
  const int fd = kSocketCan.open(NULL, kSocketCan.find(NULL, self->device, &is_up), NULL, 0);
  while (played_now_ns() < self->end_ns) {
    if (kSocketCan.receive(NULL, fd, 50, &got) != 1) continue;
    note(self, kSocketCan.realtime_ns(NULL) - got.software_ns);
    got.frame.t_ns = got.software_ns;
    (void)snprintf(got.frame.iface, sizeof got.frame.iface, "%s", self->device);
    (void)pthread_mutex_lock(&printing);
    if (wm_candump_write(&got.frame, line, sizeof line) > 0) (void)fputs(line, stdout);
    (void)pthread_mutex_unlock(&printing);
  }
  kSocketCan.close(NULL, fd);
}

static void read_camera(reader *self) {
  camera_identity wanted = {{0}, {0}, {0}};
  camera_mode mode = {.fourcc = 0};
  camera_buffer b;
  uint32_t next = 0;
  void *camera;
  (void)snprintf(wanted.path, sizeof wanted.path, "%s", self->device);
  if (kV4l2.open(NULL, &wanted, &camera) != 0 || kV4l2.set_mode(camera, &mode) != 0 || kV4l2.start(camera, 4) != 0)
    return;
  while (played_now_ns() < self->end_ns) {
    if (kV4l2.take(camera, 50, &b) != 1) continue;
    note(self, played_now_ns() - b.stamp_ns);
    self->missing += b.sequence - next;
    next = b.sequence + 1;
    (void)kV4l2.give_back(camera, b.index);
  }
  kV4l2.close(camera);
}

static void *read_device(void *context) {
  reader *self = context;
  if (strncmp(self->device, "/dev/", 5) == 0)
    read_camera(self);
  else
    read_can(self);
  return NULL;
}

static int by_size(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int argc, char **argv) {
  const int count = argc - 2 < DEVICES_MAX ? argc - 2 : DEVICES_MAX;
  if (count < 1) return 2;
  for (int i = 0; i < count; i++) {
    readers[i].device = argv[2 + i];
    readers[i].end_ns = played_now_ns() + wm_ns_from_seconds(atof(argv[1]));
    if (pthread_create(&readers[i].thread, NULL, read_device, &readers[i]) != 0) return 1;
  }
  for (int i = 0; i < count; i++) (void)pthread_join(readers[i].thread, NULL);
  for (int i = 0; i < count; i++) {
    reader *r = &readers[i];
    const size_t n = r->count < LATE_MAX ? r->count : LATE_MAX;
    qsort(r->late_us, n, sizeof r->late_us[0], by_size);
    (void)fprintf(stderr, "%s %zu came %zu missing %.0f %.0f %.0f us late (p50 p99 largest)\n", r->device, r->count,
                  r->missing, n ? r->late_us[n / 2] : 0, n ? r->late_us[n * 99 / 100] : 0, n ? r->late_us[n - 1] : 0);
  }
  return 0;
}
