// SPDX-License-Identifier: Apache-2.0
// Reports of a Doppler velocity log: a line of JSON each, format json_v1 to json_v3.x [WaterLinkedND]. No sockets here.
#ifndef WM_DVL_DVL_REPORT_H
#define WM_DVL_DVL_REPORT_H

#include <stddef.h>
#include <stdint.h>

typedef enum dvl_kind {
  DVL_VELOCITY,  // over ground
  DVL_WATER,     // against a layer of water
  DVL_POSITION,  // the log's own dead reckoning
  DVL_RESPONSE,  // to a command
  DVL_OTHER,
  DVL_KINDS
} dvl_kind;

#define DVL_NO_TIME (-1)

typedef struct dvl_report {
  dvl_kind kind;
  // Of velocities alone. NaN: the report has none.
  double v_mps[3];                       // forwards, to the right, down, in the log's axes
  double sigma_mps;                      // figure of merit: the root of the covariance's largest eigenvalue
  double since_ms;                       // since the last report
  int is_valid;                          // it has a lock on the bottom; otherwise no number is a measurement
  int is_hot;                            // it will switch off soon
  int64_t validity_us, transmission_us;  // of the log's clock: the echo, and the sending. DVL_NO_TIME: none
} dvl_report;

// NULL, or the fault of the line. Allocates: not for a real-time thread.
const char *dvl_report_read(const char *line, size_t length, dvl_report *out);

#endif
