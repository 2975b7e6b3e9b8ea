#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# allantools takes a gyroscope's rates for phases unless it is told otherwise.
# AllanTools 2024.6. Expected: oadev of rates gives the gyroscope's Allan deviation: 0.01 at 1 s for white noise of 0.1 at 100 Hz. Seen: 0.17; with
# data_type="freq" 0.01. The noise density that goes into a filter is 17 times too large, and so is the sigma of the heading.
. "$(dirname "$0")/common.sh"
pip_packages allantools==2024.6 numpy==2.4.6 scipy==1.17.1
seen='default 0.17
freq 0.01'
"$python" - <<'EOF' | as_seen
import numpy as np, allantools
rates = np.random.RandomState(1).randn(100000) * 0.1
print(f"default {allantools.oadev(rates, rate=100, taus=[1])[1][0]:.2f}")
print(f"freq {allantools.oadev(rates, rate=100, taus=[1], data_type='freq')[1][0]:.2f}")
EOF
