#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# can-utils' asc2log does not read the date that log2asc of the same package writes.
# can-utils 2020.11.0-1 (Debian 12), LC_ALL=C. Expected: log2asc, then asc2log gives the stamps back. Seen: asc2log says that it uses the current
# time and does so. A drive that was kept as .asc cannot be joined by time with the camera's any more.
. "$(dirname "$0")/common.sh"
debian_packages can-utils=2020.11.0-1
seen='date Tue Nov 14 22:13:20 2023
not of 2023: yes
second frame 0.10 s later'
export LC_ALL=C TZ=UTC
printf '(1700000000.123456) can0 123#0011\n(1700000000.223456) can0 123#0022\n' >"$work/in.log"
"$root/usr/bin/log2asc" -I "$work/in.log" can0 >"$work/drive.asc"
"$root/usr/bin/asc2log" -I "$work/drive.asc" >"$work/out.log" 2>"$work/said"
{
  head -1 "$work/drive.asc"
  awk -F'[()]' 'NR == 1 { print "not of 2023:", ($2 > 1704067200 ? "yes" : "no"); first = $2 }
                NR == 2 { printf "second frame %.2f s later\n", $2 - first }' "$work/out.log"
} | as_seen
