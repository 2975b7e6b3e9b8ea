#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pygpmf-oz writes the speed of a block's first place at each place of it.
# pygpmf-oz 0.3.2: telemetry of a GoPro as GPX. Its text: with speeds_as_extensions, 2d and 3d speeds are extensions of the points. Expected: a camera that
# speeds up by 1 m/s from place to place has its speed at each. Seen: places and times are each one's, the speed is the first one's: 18 places, a second,
# share one.
. "$(dirname "$0")/common.sh"
pip_packages pygpmf-oz==0.3.2 gpxpy==1.6.2
seen='0 m/s: 48.10000, speed_2d 0, speed_3d 0
1 m/s: 48.10001, speed_2d 0, speed_3d 0
2 m/s: 48.10002, speed_2d 0, speed_3d 0
3 m/s: 48.10003, speed_2d 0, speed_3d 0'
cd "$work"
"$python" - <<'EOF' | as_seen
import struct
from gpmf import gps
def item(key, kind, size, count, data): return key + struct.pack(">cBH", kind, size, count) + data + bytes(-len(data) % 4)
def text(key, value): return item(key, b"c", 1, len(value), value.encode())
places = [(481000000 + 100 * k, 115000000, 500000, 1000 * k, 100 * k) for k in range(4)]  # 1e-7 degrees, mm, mm/s, cm/s
stream = (text(b"STNM", "GPS") + item(b"GPSF", b"L", 4, 1, struct.pack(">I", 3)) + item(b"GPSU", b"U", 16, 1, b"261201120000.000")
    + item(b"GPSP", b"S", 2, 1, struct.pack(">H", 150)) + item(b"UNIT", b"c", 3, 5, b"degdegm\0\0m/sm/s")
    + item(b"SCAL", b"l", 4, 5, struct.pack(">5i", 10000000, 10000000, 1000, 1000, 100)) + item(b"GPS5", b"l", 20, 4, b"".join(struct.pack(">5i", *place) for place in places)))
blocks = [gps.parse_gps_block(block) for block in gps.extract_gps_blocks(item(b"STRM", b"\0", 1, len(stream), stream))]
for k, point in enumerate(gps.make_pgx_segment(blocks).points):
    print(f"{k} m/s: {point.latitude:.5f}, " + ", ".join(f"{extension.tag} {extension[0].text}" for extension in point.extensions))
EOF
