#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# In pandas 3 the integer behind a time is microseconds or nanoseconds by the number of digits in the text.
# pandas 3.1.1. Expected: astype("int64") of times is in one unit. Seen: for a text with 1 or 6 decimals microseconds, for one with 9 nanoseconds. Of two
# logs of one drive one is joined at 1/1000 of its time, and which one changes with the logger's format.
. "$(dirname "$0")/common.sh"
pip_packages pandas==3.1.1 numpy==2.4.6
seen='2026-01-01T00:00:00.5: 1767225600500000
2026-01-01T00:00:00.500000: 1767225600500000
2026-01-01T00:00:00.500000001: 1767225600500000001'
"$python" - <<'EOF' | as_seen
import pandas as pd
for text in ("2026-01-01T00:00:00.5", "2026-01-01T00:00:00.500000", "2026-01-01T00:00:00.500000001"):
    print(f"{text}:", pd.to_datetime([text]).astype("int64")[0])
EOF
