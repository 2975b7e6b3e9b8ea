#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pynmeagps puts the last 18 seconds of each GPS week's Saturday into the wrong week, and a week away on the way back.
# pynmeagps 1.1.8. GPS time is 18 s ahead of UTC. Expected: Saturday 2026-12-05 23:59:50 UTC is week 2448, 8 s, and comes back. Seen: week 2447, 604808 s,
# which is more than a week has, and wnotow2utc of that is the Saturday before. Ten seconds earlier all is right. A log that runs through the turn of the
# week has 18 s of a week ago in it.
. "$(dirname "$0")/common.sh"
pip_packages pynmeagps==1.1.8
seen='2026-12-05 23:59:40: week 2447, 604798.000 s, back 2026-12-05 23:59:40
2026-12-05 23:59:50: week 2447, 604808.000 s, back 2026-11-28 23:59:50
2026-12-06 00:00:00: week 2448, 18.000 s, back 2026-12-06 00:00:00'
"$python" - <<'EOF' | as_seen
from datetime import datetime, timedelta, timezone
from pynmeagps import utc2wnotow, wnotow2utc
for seconds in (-20, -10, 0):
    utc = datetime(2026, 12, 6, tzinfo=timezone.utc) + timedelta(seconds=seconds)
    week, milliseconds, _ = utc2wnotow(utc, modwno=False)
    print(f"{utc:%F %T}: week {week}, {milliseconds / 1000:.3f} s, back {wnotow2utc(week, milliseconds, modwno=False):%F %T}")
EOF
