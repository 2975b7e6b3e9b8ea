#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A subscriber of LCM that is late for more than 30 messages gets the oldest ones, not the newest.
# lcm 1.5.3 (PyPI), UDP. Expected of a queue for live data: what is too much falls out at its old end. Seen: of 100 messages in one go the first 30
# are handed out; the newest of all is lost without a word. After a pause of a second a robot at 100 Hz steers by poses that are 0.7 s old.
. "$(dirname "$0")/common.sh"
pip_packages lcm==1.5.3
seen='default: 0 to 29 of 0 to 99
capacity 200: 0 to 99 of 0 to 99'
cat >"$work/late.py" <<'EOT'
import time
import lcm
sender = lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
for name, capacity in (("default", None), ("capacity 200", 200)):
    reader, got = lcm.LCM("udpm://239.255.76.67:7667?ttl=0"), []
    subscription = reader.subscribe("POSE", lambda _, data: got.append(data[0]))
    if capacity:
        subscription.set_queue_capacity(capacity)
    for k in range(100):
        sender.publish("POSE", bytes([k]))
    time.sleep(2)  # the pause: LCM's own thread receives meanwhile
    while reader.handle_timeout(500):
        pass
    print(f"{name}: {got[0]} to {got[-1]} of 0 to 99")
EOT
alone "$python" "$work/late.py" | as_seen
