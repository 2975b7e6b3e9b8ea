#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pandas fills gaps by the number of rows, not by their stamps, and beyond the end as well.
# pandas 3.1.1. Expected: interpolate() of a series with a time index follows the time. Seen: between 0 s and 10 s the value at 9 s is the middle; with
# method="time" it is 9. After the last value the gap gets that value. Poses at uneven stamps bend between the cameras' pictures.
. "$(dirname "$0")/common.sh"
pip_packages pandas==3.1.1 numpy==2.4.6
seen='at 9 s: 5.0, with method="time" 9.0
after the end: 10.0'
"$python" - <<'EOF' | as_seen
import numpy as np, pandas as pd
x = pd.Series([0, np.nan, 10.0, np.nan], index=pd.to_datetime([0, 9, 10, 11], unit="s"))
print(f'at 9 s: {x.interpolate().iloc[1]}, with method="time" {x.interpolate("time").iloc[1]}')
print("after the end:", x.interpolate().iloc[3])
EOF
