#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# python-can's playback shortens pauses, and can.player does it by default from 60 s on.
# python-can 4.6.1, MessageSync. Expected: frames are played at the distances they were recorded at. Seen: a pause of 0.5 s with skip=0.3 lasts 0.3 s;
# skip is 60 s by default. A replay of a robot that waited for two minutes is 60 s ahead of its video from there on.
. "$(dirname "$0")/common.sh"
pip_packages python-can==4.6.1
seen='default skip 60.0
pause of 0.5 s with skip 0.3: 0.3 s'
"$python" - <<'EOF' | as_seen
import inspect, time, can
print("default skip", inspect.signature(can.MessageSync).parameters["skip"].default)
frames = [can.Message(timestamp=t) for t in (0.0, 0.5)]
played = [time.monotonic() for _ in can.MessageSync(frames, skip=0.3)]
print(f"pause of 0.5 s with skip 0.3: {played[1] - played[0]:.1f} s")
EOF
