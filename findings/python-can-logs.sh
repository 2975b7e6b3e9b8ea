#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A CAN log that python-can writes and reads again has lost its bus or its time, by the ending of its name.
# python-can 4.6.1. Expected: frames of bus 0 and bus 1 at 2023-11-14 22:13:20 UTC come back as such. Seen: .csv and .db have no bus, .trc counts buses
# from 1; .asc begins at 0 s, and with relative_timestamp=False its time is that of the reader's time zone: 5 h off where the log was written
# in UTC and is read in New York. Wheel speeds of two buses with the same identities become one wheel's.
. "$(dirname "$0")/common.sh"
pip_packages python-can==4.6.1
seen='.log: buses can0 can1, 0 s off
.blf: buses 0 1, 0 s off
.csv: buses None None, 0 s off
.db: buses None None, 0 s off
.trc: buses 1 2, 0 s off
.asc: buses 0 1, -1700000000 s off
.asc with relative_timestamp=False: buses 0 1, 18000 s off'
cd "$work"
"$python" - 2>/dev/null <<'EOF' | as_seen
import os, time, can
def zone(name):
    os.environ["TZ"] = name
    time.tzset()
sent = [can.Message(timestamp=1700000000 + 0.01 * k, arbitration_id=0x100, data=[k], is_extended_id=False, channel=k) for k in (0, 1)]
def say(name, read): print(f"{name}: buses {read[0].channel} {read[1].channel}, {read[0].timestamp - 1700000000:.0f} s off")
for ending in ("log", "blf", "csv", "db", "trc", "asc"):
    zone("UTC")
    with can.Logger("drive." + ending) as log:
        for message in sent:
            log(message)
    zone("America/New_York")
    say("." + ending, list(can.LogReader("drive." + ending)))
say(".asc with relative_timestamp=False", list(can.ASCReader("drive.asc", relative_timestamp=False)))
EOF
