// SPDX-License-Identifier: Apache-2.0
// An IIO device in sysfs: found by its name, its buffer set up, its attributes read.
#ifndef WM_IIO_SETUP_H
#define WM_IIO_SETUP_H

#include <time.h>

#include "scan.h"
#include "waymark/devices.h"

// Numbers of a row of imu.csv that a scan gives.
enum { IIO_WX, IIO_WY, IIO_WZ, IIO_AX, IIO_AY, IIO_AZ, IIO_TEMPERATURE, IIO_TIMESTAMP, IIO_CHANNELS };

typedef struct iio_channel {
  int is_there;
  iio_element element;
  double scale, offset;  // SI = scale (raw + offset)
} iio_channel;

typedef struct iio_setup {
  const char *root;
  char name[32];     // "iio:device0"
  char folder[400];  // in sysfs
  int is_there;      // a device of that name
  int is_ready;      // its buffer runs
  iio_channel channels[IIO_CHANNELS];
  size_t scan_bytes;
  double gyro_to_board[9], acceleration_to_board[9];
  clockid_t clock;  // of its stamps
} iio_setup;

// Finds it and reads its attributes; where the buffer does not run and `changes` is 1, sets it up and starts it. NULL,
// or in `text` the fault with its remedy.
const char *iio_setup_read(const wm_iio_device_config *config, const char *root, int changes, iio_setup *out,
                           char *text, size_t room);

#endif
