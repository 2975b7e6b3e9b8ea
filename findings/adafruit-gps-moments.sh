#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# adafruit_gps drops the fraction of a second, and drops an RMC of old receivers whole.
# adafruit-circuitpython-gps 4.0.0. Expected: the time of 12:00:01.75 has 0.75 s, and an RMC of NMEA 2.0 (no mode at its end) moves the place. Seen: whole
# seconds; the old RMC changes nothing, and the place, its time and has_fix stay those of before. At 5 Hz five places have one time; with an old
# receiver the robot stands still.
. "$(dirname "$0")/common.sh"
pip_packages adafruit-circuitpython-gps==4.0.0
seen='RMC with a mode: fix True latitude 48.133966 second 1
RMC without: fix True latitude 48.133966 second 1'
"$python" - <<'EOF' | as_seen
import adafruit_gps
lines = [b"$GPRMC,120001.75,A,4808.0380,N,01131.0000,E,20.0,10.0,230324,,,A*%02X\r\n", b"$GPRMC,120002.75,A,4809.0380,N,01131.0000,E,20.0,10.0,230324,3.1,W*%02X\r\n"]
class Serial:
    in_waiting = 100
    def readline(self):
        text, check = lines.pop(0), 0
        for byte in text[1:text.index(b"*")]:
            check ^= byte
        return text % check
gps = adafruit_gps.GPS(Serial())
for name in ("RMC with a mode", "RMC without"):
    gps.update()
    print(f"{name}: fix {gps.has_fix} latitude {gps.latitude:.6f} second {gps.timestamp_utc.tm_sec}")
EOF
