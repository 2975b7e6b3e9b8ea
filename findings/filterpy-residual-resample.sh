#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# filterpy's residual_resample never draws light particles.
# filterpy 2.0.0. Expected: particles survive in proportion to their weights 0.1, 0.2, 0.3, 0.4, as with its other resamplers. Seen: the lighter
# two never survive, in 20,000 draws. A particle filter loses each hypothesis that is behind for a moment, and stays in the wrong corridor.
. "$(dirname "$0")/common.sh"
pip_packages filterpy==2.0.0 numpy==2.4.6
seen='weights of the lighter two: 0.1 0.2
systematic_resample: 0.1 0.2
residual_resample: 0.0 0.0'
"$python" - <<'EOF' | as_seen
import numpy as np
from filterpy import monte_carlo
np.random.seed(1)
weights = np.array([0.1, 0.2, 0.3, 0.4])
print("weights of the lighter two:", *weights[:2])
for name in ("systematic_resample", "residual_resample"):
    drawn = np.concatenate([getattr(monte_carlo, name)(weights) for _ in range(5000)])
    print(name + ":", *np.round(np.bincount(drawn, minlength=4) / len(drawn), 1)[:2])
EOF
