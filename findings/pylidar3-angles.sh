#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# PyLidar3 puts what stands near in a YDLIDAR's scan 4 degrees aside, and its metres are millimetres.
# PyLidar3 1.6, the serial port stood in for. YDLIDAR's manual of the X4: angle (k - 1) / (LSN - 1) of the way from FSA to LSA, and each point's own
# correction by its distance. Its text: "distance(meters)". Expected: a wall of 3 m, 41 points from 10 to 50 degrees, is from 2.4 to 42.4; a post before its
# point at 40 degrees, 0.3 m off, is at 36.1. Seen: 41, 31, 3000 and 300: a step is 40/41 of a degree, and each point has the correction of the wall's ends.
. "$(dirname "$0")/common.sh"
pip_packages PyLidar3==1.6
seen='the wall from 2 to 41 degrees, 3000
the post at 31 degrees, 300'
cd "$work"
cat >serial.py <<'EOF'
import struct
def packet(first, distances):  # angles and distances without correction, in degrees and mm
    count = len(distances)
    words = [first * 64 << 1 | 1, (first + count - 1) * 64 << 1 | 1, *(4 * distance for distance in distances)]
    total = 0x55AA ^ count << 8
    for word in words: total ^= word
    return struct.pack(f"<HBBHHH{count}H", 0x55AA, 0, count, words[0], words[1], total, *words[2:])
class Serial:
    def __init__(self, *arguments, **named): self.is_open = True
    def __getattr__(self, name): return lambda *arguments, **named: None
    def read(self, count):
        if count < 100: return bytes(count)
        wall = [3000] * 41
        wall[30] = 300
        return packet(0, wall[:1]) + packet(10, wall) + packet(0, wall[:1])
EOF
"$python" - <<'EOF' | as_seen
import PyLidar3
lidar = PyLidar3.YdLidarX4("/dev/ttyUSB0")
lidar.Connect()
scan = next(lidar.StartScanning())
for name, distance in ("wall", 3000), ("post", 300):
    angles = [angle for angle in scan if scan[angle] == distance and angle < 180]  # whole degrees, rounded down
    print(f"the {name} " + (f"at {angles[0]}" if len(angles) == 1 else f"from {angles[0]} to {angles[-1]}") + f" degrees, {distance}")
EOF
