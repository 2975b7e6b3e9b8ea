#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Where LCM's EventLog.seek_to_timestamp ends depends on the bytes of the log: before the stamp or after it.
# lcm 1.5.3. Expected: after seek_to_timestamp(4.5 s) in a log of one event a second the next event is always the same one. Seen: with messages of 1 byte
# it is that of 4 s, with those of 8 bytes that of 5 s, and in a log twice as long the other way round. An analysis from a stamp on has one event more or less, and two channels of one moment may
# begin on both sides of it.
. "$(dirname "$0")/common.sh"
pip_packages lcm==1.5.3
seen='10 events of 1 byte: 4 s
10 events of 8 bytes: 5 s
20 events of 1 byte: 5 s
20 events of 8 bytes: 4 s'
cd "$work"
"$python" - <<'EOF' | as_seen
import lcm
for count, size in ((10, 1), (10, 8), (20, 1), (20, 8)):
    log = lcm.EventLog("drive", "w", overwrite=True)
    for k in range(count):
        log.write_event(1000000 * k, "A", b"x" * size)
    log.close()
    log = lcm.EventLog("drive", "r")
    log.seek_to_timestamp(4500000)
    print(f"{count} events of {size} byte{'s' if size > 1 else ''}: {log.read_next_event().timestamp // 1000000} s")
EOF
