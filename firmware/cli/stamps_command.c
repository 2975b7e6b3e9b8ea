// SPDX-License-Identifier: Apache-2.0
// Switches the hardware clocks of CAN adapters on, and sets up the buffer of an IMU. It needs rights that a run does
// not have.
#include <errno.h>
#include <linux/net_tstamp.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/options.h"

static const char kHelp[] =
    "usage: waymark stamps CONFIG\n"
    "\n"
    "Asks each CAN adapter of the configuration's `devices:` to stamp frames by its own clock. Before a run, with the\n"
    "right to it (CAP_NET_ADMIN): in a systemd unit `ExecStartPre=+/usr/bin/waymark stamps /etc/waymark/robot.yaml`.\n"
    "An adapter without a clock is not an error: the kernel's stamps are taken then. Of `devices: {iio}` the buffer is "
    "set "
    "up\n"
    "and started (as root). Exit code 1 where the right is missing, or where the IMU can't be set up.\n"
    "\n"
    "example:\n"
    "  waymark stamps /etc/waymark/robot.yaml\n";

// 0, or errno. Source: Linux, Documentation/networking/timestamping.rst; CAN drivers take this pair alone.
static int switch_on(int fd, const char *interface) {
  struct hwtstamp_config wanted = {.tx_type = HWTSTAMP_TX_ON, .rx_filter = HWTSTAMP_FILTER_ALL};
  struct ifreq request = {.ifr_data = (char *)&wanted};
  (void)snprintf(request.ifr_name, sizeof request.ifr_name, "%s", interface);
  return ioctl(fd, SIOCSHWTSTAMP, &request) == 0 ? 0 : errno;
}

// 1: an error for the user.
static int say(const char *interface, int reason) {
  if (reason == 0) {
    (void)printf("%s: stamps by the adapter's clock\n", interface);
  } else if (reason == EPERM) {
    (void)fprintf(stderr, "waymark: %s: no right to switch its clock on; as root, or ExecStartPre=+... in the unit\n",
                  interface);
  } else if (reason == ENODEV) {
    (void)printf("%s: is not there; its stamps are as it comes up\n", interface);
  } else {
    (void)printf("%s: has no clock that can be switched on (%s); stamps by the kernel\n", interface, strerror(reason));
  }
  return reason == EPERM;
}

// 1: an error for the user.
static int prepare_imu(const wm_iio_device_config *imu) {
  char text[160];
  int is_there;
  if (!imu->device[0]) return 0;
  const char *why = wm_iio_prepare(imu, "", &is_there, text, sizeof text);
  if (!why) (void)printf("%s: its buffer runs\n", imu->device);
  if (why) (void)fprintf(stderr, "waymark: %s: %s\n", imu->device, why);
  return why && is_there;
}

int command_stamps(int argc, char *const *argv) {
  const char *words[1];
  int help = 0, failed = 0;
  const option options[] = {{"--help", OPTION_FLAG, &help}, {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t count;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], words, 1, &count, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (count == 0) {
    (void)fprintf(stderr, "waymark: stamps needs a configuration\n\n%s", kHelp);
    return EXIT_USAGE;
  }
  wm_config config;
  if (wm_config_load_undecided(words[0], &config, &err) != WM_OK) {
    (void)complain(&err);
    return EXIT_USAGE;
  }
  wm_config_each_warning(&config, print_note, NULL);
  int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  for (size_t i = 0; i < config.devices.can_count; i++) {
    const char *interface = config.devices.can[i].interface;
    failed |= say(interface, fd < 0 ? errno : switch_on(fd, interface));
  }
  if (fd >= 0) (void)close(fd);
  failed |= prepare_imu(&config.devices.iio);
  wm_config_free(&config);
  return failed ? EXIT_WORK_FAILED : EXIT_DONE;
}
