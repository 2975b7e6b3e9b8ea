// SPDX-License-Identifier: Apache-2.0
// Devices that a program in user space is: an IMU's gyro for the kernel's own driver, and a receiver's serial line.
#pragma once

#include <stddef.h>
#include <stdint.h>

// A HID sensor by /dev/uhid, which hid-sensor-gyro-3d drives: the IIO device gyro_3d. -1: errno.
int gyro_open(void);
// One report: rates in 1e-6 rad/s.
int gyro_say(int fd, const int32_t rates[3]);

// A pseudo-terminal; `link` leads to its other side, which gpsd reads. -1: errno.
int receiver_open(const char *link);
int receiver_say(int fd, const char *text, size_t bytes);
