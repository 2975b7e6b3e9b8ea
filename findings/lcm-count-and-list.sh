#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# LCM's Python messages send as many ranges as the count says, not as there are.
# lcm 1.5.3. Expected: a list and a count that differ are refused, as wrong types are. Seen: three ranges with the count 2 arrive as two, and with
# the count left at its default they arrive as none. A scanner whose driver forgets one line has a free path ahead of it.
. "$(dirname "$0")/common.sh"
pip_packages lcm==1.5.3
seen='count 3: (1.0, 2.0, 3.0)
count 2: (1.0, 2.0)
count not set: ()'
cd "$work"
printf 'package made;\nstruct scan_t { int32_t count; float ranges[count]; }\n' >scan.lcm
"$work/venv/bin/lcm-gen" -p --ppath . scan.lcm
"$python" - <<'EOF' | as_seen
import sys
sys.path.insert(0, ".")
import made
for count in (3, 2, None):
    scan = made.scan_t()
    scan.ranges = [1.0, 2.0, 3.0]
    if count:
        scan.count = count
    print(f"count {count or 'not set'}:", made.scan_t.decode(scan.encode()).ranges)
EOF
