#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# gpsd 3.22 reports a heading (HDT) as an attitude whose accelerations are the position's deviations (GST), in a line that is no JSON.
# gpsd-clients and libgps28 3.22-4.1+deb12u1 (Debian 12), gpsdecode. Expected: an ATT with the heading alone. Seen: after a GST the same ATT has
# acc_len, acc_x, acc_y and acc_z: the numbers of the GST; and a comma too many and one too few around "time". Strict readers of JSON lose the
# heading, lenient ones get an accelerometer that no receiver has.
. "$(dirname "$0")/common.sh"
debian_packages gpsd-clients=3.22-4.1+deb12u1 libgps28=3.22-4.1+deb12u1 libdbus-1-3 libusb-1.0-0 libbluetooth3
seen='GST rms 0.020 major 0.030 minor 0.010 orient 45.000
ATT heading 123.400 acc_len 0.020 acc_x 0.030 acc_y 0.010 acc_z 45.000
ATT is JSON: no'
python3 - >"$work/nmea" <<'EOF'
from functools import reduce
for text in ("GPRMC,120000.00,A,4807.0380,N,01131.0000,E,10.0,350.0,230324,3.1,W,A", "GPGST,120000.00,0.020,0.030,0.010,45.0,0.021,0.022,0.040", "GPHDT,123.4,T"):
    print(f"${text}*{reduce(lambda a, b: a ^ b, text.encode()):02X}\r")
EOF
"$root/usr/bin/gpsdecode" <"$work/nmea" >"$work/reports"
python3 - "$work/reports" <<'EOF' | as_seen
import json, re, sys
for line in open(sys.argv[1]):
    kind = re.search(r'"class":"(\w+)"', line)[1]
    names = {"GST": ("rms", "major", "minor", "orient"), "ATT": ("heading", "acc_len", "acc_x", "acc_y", "acc_z")}.get(kind)
    if names:
        print(kind, *(f'{name} {re.search(chr(34) + name + chr(34) + ":([0-9.]+)", line)[1]}' for name in names))
    if kind == "ATT":
        try:
            json.loads(line)
            print("ATT is JSON: yes")
        except ValueError:
            print("ATT is JSON: no")
EOF
