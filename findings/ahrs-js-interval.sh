#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The "sample interval, in Hz" of npm's ahrs is in milliseconds.
# ahrs 1.3.3 (npm). Expected by its README: with sampleInterval 100 the filter takes 100 samples for one second, with 20, its default, 20 samples. Seen: the
# second's turn of 0.5 rad comes out as 5 rad at 100 Hz and as 0.2 rad at 20 Hz, with both algorithms. At 31.6 Hz alone the two meanings agree. A robot's
# heading runs away, or lags, by a factor that looks like a gyroscope's scale.
. "$(dirname "$0")/common.sh"
npm_packages ahrs@1.3.3
seen='Madgwick, 100 samples of 0.5 rad/s, sampleInterval 100: 5.00 rad
Madgwick, 20 samples of 0.5 rad/s, sampleInterval 20: 0.20 rad
Mahony, 100 samples of 0.5 rad/s, sampleInterval 100: 5.00 rad
Mahony, 20 samples of 0.5 rad/s, sampleInterval 20: 0.20 rad'
cd "$work/npm"
node - <<'EOF' | as_seen
const AHRS = require("ahrs");
for (const algorithm of ["Madgwick", "Mahony"]) {
  for (const rate of [100, 20]) {
    const filter = new AHRS({ sampleInterval: rate, algorithm });
    let turned = 0, before = 0;
    for (let k = 0; k < rate; k++) {
      filter.update(0, 0, 0.5, 0.001, 0.001, 1); // level, without a magnetometer
      const heading = filter.getEulerAngles().heading;
      turned += Math.atan2(Math.sin(heading - before), Math.cos(heading - before));
      before = heading;
    }
    console.log(`${algorithm}, ${rate} samples of 0.5 rad/s, sampleInterval ${rate}: ${turned.toFixed(2)} rad`);
  }
}
EOF
