#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# geolib's getPathLength of a robot's track is 0, or two thirds too long, by its speed.
# geolib 3.3.14 (npm). Expected: 100 steps of 0.4 m are 40 m, 100 of 0.6 m are 60 m. Seen: 0 and 100: each step is rounded to a metre before the sum.
# getDistance has an accuracy of 1 m by default, and getPathLength takes it for every step. At 5 Hz a robot of 2 m/s has not moved, one of 3 m/s has gone 5
# m/s.
. "$(dirname "$0")/common.sh"
npm_packages geolib@3.3.14
seen='100 steps of 0.4 m: getPathLength 0, from end to end 40
100 steps of 0.6 m: getPathLength 100, from end to end 60
100 steps of 0.6 m, distances to 1 mm: getPathLength 60.0'
cd "$work/npm"
node - <<'EOF' | as_seen
const { getPathLength, getDistance } = require("geolib");
const track = (step) => Array.from({ length: 101 }, (_, k) => ({ latitude: 48 + (k * step) / 111319.49, longitude: 11 }));
for (const step of [0.4, 0.6])
  console.log(`100 steps of ${step} m: getPathLength ${getPathLength(track(step))}, from end to end ${getDistance(track(step)[0], track(step)[100])}`);
const fine = getPathLength(track(0.6), (a, b) => getDistance(a, b, 0.001));
console.log(`100 steps of 0.6 m, distances to 1 mm: getPathLength ${fine.toFixed(1)}`);
EOF
