#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# asammdf's table has values before a signal's first sample and after its last, and headings between 358 and 2 that are 180.
# asammdf 8.8.28. Expected: to_dataframe has no value where a signal has none. Seen: the heading that begins at 0.5 s has its first value at 0 s and
# keeps its last to the end; with a raster the heading goes through 180 degrees. Time begins at 0 unless time_from_zero=False. A robot that is
# placed by the table stands still before it is switched on, and turns round at north.
. "$(dirname "$0")/common.sh"
pip_packages asammdf==8.8.28 numpy==2.4.6
seen='times 0.0 0.5 1.0 1.5
heading 358 358 180 2
speed 1 2 2 2'
"$python" - 2>/dev/null <<'EOF' | as_seen
import numpy as np
from asammdf import MDF, Signal
log = MDF()
log.append([Signal(np.array([1.0, 2.0]), np.array([100.0, 100.5]), name="speed")])
log.append([Signal(np.array([358.0, 2.0]), np.array([100.5, 101.5]), name="heading")])
table = log.to_dataframe(raster=0.5)
print("times", *table.index)
print("heading", *(f"{x:.0f}" for x in table["heading"]))
print("speed", *(f"{x:.0f}" for x in table["speed"]))
EOF
