// SPDX-License-Identifier: Apache-2.0
// Any bytes as a line of a velocity log. A velocity that is valid has finite numbers, and its times fit into 64 bits of
// nanoseconds.
#include <math.h>

#include "dvl_report.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  dvl_report report;
  if (dvl_report_read((const char *)data, size, &report)) return 0;
  check(report.kind >= DVL_VELOCITY && report.kind < DVL_KINDS);
  check(report.validity_us >= DVL_NO_TIME && report.validity_us <= INT64_MAX / 1000);
  check(report.transmission_us >= DVL_NO_TIME && report.transmission_us <= INT64_MAX / 1000);
  if (report.kind != DVL_VELOCITY || !report.is_valid) return 0;
  for (int i = 0; i < 3; i++) check(isfinite(report.v_mps[i]));
  check(isfinite(report.sigma_mps));
  return 0;
}
