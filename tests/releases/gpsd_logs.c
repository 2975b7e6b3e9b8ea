// SPDX-License-Identifier: Apache-2.0
// Lines of gpsd on standard input: of each what the reader has, or "! WHY".
#include <stdio.h>
#include <string.h>

#include "gpsd_report.h"

int main(void) {
  static char line[1 << 20];
  gpsd_report r;
  while (fgets(line, sizeof line, stdin)) {
    const char *why = gpsd_report_read(line, strcspn(line, "\n"), &r);
    if (why)
      printf("! %s\n", why);
    else
      printf("%d %lld %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n",
             (int)r.kind, (long long)r.time_ns, r.mode, r.status, r.latitude_deg, r.longitude_deg, r.ellipsoid_m,
             r.alt_m, r.east_m, r.north_m, r.across_m, r.up_m, r.speed_mps, r.track_deg, r.speed_error_mps,
             r.track_error_deg, r.heading_deg);
  }
}
