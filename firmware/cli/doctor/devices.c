// SPDX-License-Identifier: Apache-2.0
// LCM, CAN, cameras, IMU, GNSS, velocity log.
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli/doctor/doctor.h"
#include "live/lcm_connect.h"
#include "rt/clock.h"

void doctor_lcm(const char *url, wm_findings *out) {
  const char *why;
  lcm_t *lcm = lcm_connect(url, &why);
  if (!lcm) {
    wm_find(out, WM_FOUND_LCM_ROUTE, WM_SEVERITY_BAD, "lcm", "ip route add 224.0.0.0/4 dev lo",
            "no route for LCM's %.80s: %s", url, why);
    return;
  }
  lcm_destroy(lcm);
  const char *ttl = strstr(url, "ttl=");
  if (strncmp(url, "udpm://", 7) == 0 && ttl && strtol(ttl + 4, NULL, 10) > 0)
    wm_find(out, WM_FOUND_LCM_ROUTE, WM_SEVERITY_NOTE, "lcm",
            "publish: {lcm_url: \"udpm://239.255.76.67:7667?ttl=0\"} keeps messages on this computer",
            "%.80s: poses go out into the network, and commands may come from it", url);
  else
    wm_find(out, WM_FOUND_LCM_ROUTE, WM_SEVERITY_GOOD, "lcm", "", "messages can be sent on %.80s", url);
}

// 1: a number was found.
static int number_of(const char *root, const char *interface, const char *what, long *out) {
  char path[512], text[64];
  (void)snprintf(path, sizeof path, "%s/sys/class/net/%s/%s", root, interface, what);
  FILE *f = fopen(path, "re");
  if (!f) return 0;
  int got = fgets(text, sizeof text, f) != NULL;
  (void)fclose(f);
  if (got) *out = strtol(text, NULL, 0);
  return got;
}

#define ARPHRD_OF_CAN 280  // ARPHRD_CAN of linux/if_arp.h
#define IS_UP 1            // IFF_UP of linux/if.h

static void can_interface(const char *root, const char *interface, wm_findings *out) {
  char about[32], mend[160];
  long type = 0, flags = 0, errors = 0, overruns = 0;
  (void)snprintf(about, sizeof about, "can %s", interface);
  if (!number_of(root, interface, "type", &type)) {
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_BAD, about, "plug the adapter in; `lsusb`, `dmesg | grep -i can`",
            "there is no interface of this name");
    return;
  }
  if (type != ARPHRD_OF_CAN) {
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_BAD, about, "`ip -br link show type can` lists CAN interfaces",
            "is not a CAN interface");
    return;
  }
  (void)number_of(root, interface, "flags", &flags);
  if (!(flags & IS_UP)) {
    (void)snprintf(mend, sizeof mend, "ip link set %s up type can bitrate 500000 restart-ms 100", interface);
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_BAD, about, mend, "is down");
    return;
  }
  (void)number_of(root, interface, "statistics/rx_errors", &errors);
  (void)number_of(root, interface, "statistics/rx_over_errors", &overruns);
  if (overruns > 0)
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_BAD, about,
            "raise the priority of its interrupt thread above other work (chrt -f -p 60 PID)",
            "its controller lost %ld frames because they were not read in time", overruns);
  else if (errors > 0)
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_NOTE, about,
            "look at wiring, termination (60 ohms) and bit rate: `ip -d -s link show`",
            "is up, with %ld receive errors since it came up", errors);
  else
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_GOOD, about, "", "is up, without errors");
}

// The kernel's size of a queued frame of eight bytes, and the rate of such frames on a full bus of 500 kbit/s.
#define FRAME_QUEUE_BYTES 768
#define FRAMES_PER_S 4000

void doctor_can_queue(int wanted, int granted, wm_findings *out) {
  char mend[120];
  const double queue_ms =
      2e3 * granted / FRAME_QUEUE_BYTES / FRAMES_PER_S;  // the kernel reports half of the bytes that it reserves
  if (granted >= wanted) {
    wm_find(out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_GOOD, "can queue", "", "a socket holds %.0f ms of a full bus",
            queue_ms);
    return;
  }
  (void)snprintf(mend, sizeof mend, "sysctl -w net.core.rmem_max=%d, and the same in /etc/sysctl.d/waymark.conf",
                 wanted);
  wm_find(
      out, WM_FOUND_CAN_INTERFACE, WM_SEVERITY_NOTE, "can queue", mend,
      "a socket holds %.0f ms of a full bus (%d kB of the %d that are asked for): frames are lost when a thread waits "
      "longer",
      queue_ms, granted / 1024, wanted / 1024);
}

void doctor_can(const char *root, const wm_config *config, wm_findings *out) {
  for (size_t i = 0; config && i < config->devices.can_count; i++)
    can_interface(root, config->devices.can[i].interface, out);
}

static void camera(const wm_camera_device_config *c, wm_findings *out) {
  char about[32];
  (void)snprintf(about, sizeof about, "camera %.20s", c->name);
  if (!c->device[0]) return;  // by card and bus, or libcamera: only a run searches for it
  int fd = open(c->device, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd >= 0) {
    struct stat is;
    int is_device = fstat(fd, &is) == 0 && S_ISCHR(is.st_mode);
    (void)close(fd);
    wm_find(out, WM_FOUND_CAMERA_DEVICE, is_device ? WM_SEVERITY_GOOD : WM_SEVERITY_BAD, about,
            is_device ? "" : "`v4l2-ctl --list-devices` lists cameras",
            is_device ? "%.100s is present" : "%.100s is not a device", c->device);
  } else if (errno == EACCES) {
    wm_find(out, WM_FOUND_CAMERA_DEVICE, WM_SEVERITY_BAD, about,
            "SupplementaryGroups=video in the unit, or usermod -aG video USER", "%.100s: no permission", c->device);
  } else {
    wm_find(out, WM_FOUND_CAMERA_DEVICE, WM_SEVERITY_BAD, about, "`v4l2-ctl --list-devices` lists cameras",
            "%.100s: %s", c->device, strerror(errno));
  }
}

void doctor_cameras(const wm_config *config, wm_findings *out) {
  for (size_t i = 0; config && i < config->devices.camera_count; i++) camera(&config->devices.cameras[i], out);
}

void doctor_imu(const char *root, const wm_config *config, wm_findings *out) {
  char text[160];
  int is_there, is_ready;
  if (!config || !config->devices.iio.device[0]) return;
  const wm_iio_device_config *device = &config->devices.iio;
  const char *why = wm_iio_inspect(device, root, &is_there, &is_ready, text, sizeof text);
  if (why)
    wm_find(out, WM_FOUND_IMU_DEVICE, WM_SEVERITY_BAD, "imu", NULL, "%s", why);
  else if (is_ready)
    wm_find(out, WM_FOUND_IMU_DEVICE, WM_SEVERITY_GOOD, "imu", "", "the buffer of %s runs", device->device);
  else
    wm_find(out, WM_FOUND_IMU_DEVICE, WM_SEVERITY_NOTE, "imu",
            "ExecStartPre=+/usr/bin/waymark stamps CONFIG in the unit, or a run with the right to write to /sys",
            "%s is present, but its buffer is not set up", device->device);
}

// Listens to an opened device, and closes it.
static void listen_to(wm_row_device *device, double seconds, wm_finding_id id, wm_findings *out) {
  wm_stream_row row;
  wm_source_counts counts = {0};
  char text[160];
  int has_come = 0;
  const wm_time_ns until_ns = wm_monotonic_ns() + wm_ns_from_seconds(seconds);
  while (!has_come && wm_monotonic_ns() < until_ns) has_come = device->ops->next(device, &row, &counts) == WM_OK;
  unsigned state = counts.device;
  if (state == WM_DEVICE_WORKS && !has_come) state = WM_DEVICE_STALLED;
  (void)device->ops->note(device, state, has_come, text, sizeof text);
  wm_find(out, id, has_come ? WM_SEVERITY_GOOD : WM_SEVERITY_BAD, device->stream, has_come ? "" : NULL, "%s", text);
  device->ops->close(device);
}

void doctor_gnss(const wm_config *config, double seconds, wm_findings *out) {
  const double anywhere[3] = {0};
  wm_row_device *device;
  wm_error err;
  for (size_t i = 0; config && i < config->devices.gpsd_count; i++)
    if (wm_gpsd_open(&config->devices.gpsd[i], anywhere, (double)NAN, &device, &err) == WM_OK)
      listen_to(device, seconds, WM_FOUND_GNSS_RECEIVER, out);
    else
      wm_find_error(out, "gnss", &err);
}

void doctor_dvl(const wm_config *config, double seconds, wm_findings *out) {
  wm_row_device *device;
  wm_error err;
  if (!config || !config->devices.dvl.host[0]) return;
  if (wm_dvl_open(&config->devices.dvl, &device, &err) == WM_OK)
    listen_to(device, seconds, WM_FOUND_VELOCITY_LOG, out);
  else
    wm_find_error(out, "motion6", &err);
}
