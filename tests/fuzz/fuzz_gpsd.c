// SPDX-License-Identifier: Apache-2.0
// Any bytes as a line of gpsd. Numbers are finite or absent, texts end, and a position is some place in the map.
#include <math.h>
#include <string.h>

#include "fuzz.h"
#include "gpsd_report.h"
#include "waymark/local_frame.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static const double kOrigin[3] = {48, 11, 500};
  gpsd_report report;
  if (gpsd_report_read((const char *)data, size, &report)) return 0;
  check(memchr(report.device, '\0', sizeof report.device) && memchr(report.message, '\0', sizeof report.message));
  check(!isinf(report.mode) && !isinf(report.status) && !isinf(report.latitude_deg) && !isinf(report.speed_mps));
  check(report.time_ns == WM_TIME_NONE || report.time_ns >= 0);
  if (!(fabs(report.latitude_deg) < 90.0) || !(fabs(report.longitude_deg) <= 180.0)) return 0;
  const double place[3] = {report.latitude_deg, report.longitude_deg, 500};
  double at_m[3];
  local_frame(kOrigin, place, at_m);
  for (int i = 0; i < 3; i++) check(fabs(at_m[i]) < 1.3e7);  // the earth's diameter
  return 0;
}
