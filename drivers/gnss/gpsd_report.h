// SPDX-License-Identifier: Apache-2.0
// gpsd's reports: a line of JSON each (gpsd_json(5), protocol 3). No sockets here.
#ifndef WM_GNSS_GPSD_REPORT_H
#define WM_GNSS_GPSD_REPORT_H

#include <stddef.h>

#include "waymark/time.h"

typedef enum gpsd_class { GPSD_OTHER, GPSD_TPV, GPSD_GST, GPSD_ATT, GPSD_DEVICE, GPSD_ERROR } gpsd_class;

// Fix types of gpsd_json(5), `status` of TPV.
typedef enum gpsd_fix {
  GPSD_FIX_UNKNOWN,
  GPSD_FIX_PLAIN,
  GPSD_FIX_DGPS,
  GPSD_FIX_RTK_FIXED,
  GPSD_FIX_RTK_FLOAT,
  GPSD_FIX_RECKONED,
  GPSD_FIX_AIDED,
  GPSD_FIX_TIME,
  GPSD_FIX_SIMULATED,
  GPSD_FIX_PRECISE,
  GPSD_FIX_COUNT
} gpsd_fix;
const char *gpsd_fix_name(int fix);  // "RTK fixed"; "fix" where it is unknown

// Fields that a report lacks are NaN.
typedef struct gpsd_report {
  gpsd_class kind;
  char device[64];                         // path of the receiver
  wm_time_ns time_ns;                      // UTC since 1970; WM_TIME_NONE: none
  double mode, status;                     // 2: a position, 3: with an altitude; a gpsd_fix
  double latitude_deg, longitude_deg;      // of GST: their standard deviations, m
  double ellipsoid_m, alt_m;               // altitude above the ellipsoid; `alt`, of GST its standard deviation
  double east_m, north_m, across_m, up_m;  // accuracies: epx, epy, eph, epv
  double speed_mps, track_deg;             // over ground; from true north, clockwise
  double speed_error_mps, track_error_deg;
  double heading_deg;  // ATT: from true north, clockwise
  double activated;    // DEVICE: 0 where the receiver is gone
  char message[96];    // ERROR
} gpsd_report;

// NULL, or the fault of the line. Allocates: not for a real-time thread.
const char *gpsd_report_read(const char *line, size_t length, gpsd_report *out);

#endif
