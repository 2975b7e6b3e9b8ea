#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# GPS.js has km/h, and keeps the last speed when the fix is gone.
# gps 0.9.0 (npm). Expected: the speed of an RMC is in knots as in the sentence, or in m/s. Seen: 10 knots are 18.52; after an RMC without a fix the
# state has no place, but the speed and the course of before. A robot that stands in a tunnel is said to drive on.
. "$(dirname "$0")/common.sh"
npm_packages gps@0.9.0
seen='10 knots: speed 18.52 track 350 lat 48.1173
no fix: speed 18.52 track 350 lat null'
cd "$work/npm"
node - <<'EOF' | as_seen
const { GPS } = require("gps");
const gps = new GPS();
const say = name => console.log(`${name}: speed ${gps.state.speed} track ${gps.state.track} lat ${gps.state.lat}`);
gps.update("$GPRMC,120000.05,A,4807.0380,N,01131.0000,E,10.0,350.0,230324,3.1,W*7F");
say("10 knots");
gps.update("$GPRMC,120001.00,V,,,,,,,230324,,,N*7B");
say("no fix");
EOF
