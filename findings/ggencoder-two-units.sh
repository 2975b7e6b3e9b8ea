#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ggencoder's speed `sog` is in knots by AIS and in m/s by NMEA, and its altitude is the compass's variation.
# ggencoder 1.0.10 (npm). Expected: one name has one unit, and an RMC, which has no altitude, gives none. Seen: 20.0 knots are 20 by AIS and 10.2 by the
# RMC; `alt` is 3.1, the magnetic variation in degrees. A boat compares its own speed with its neighbour's at half of its worth.
. "$(dirname "$0")/common.sh"
npm_packages ggencoder@1.0.10
seen='AIS: sog 20
RMC: sog 10.2, alt 3.1'
cd "$work/npm"
node - <<'EOF' | as_seen
const { AisEncode, AisDecode, NmeaDecode } = require("ggencoder");
const sent = new AisEncode({ aistype: 1, mmsi: "211000000", lat: 48.1, lon: 11.5, sog: 20, cog: 90, hdg: 90, navstatus: 0, repeat: 0 });
const sentence = (body) => `$${body}*${[...body].reduce((sum, c) => sum ^ c.charCodeAt(0), 0).toString(16).toUpperCase().padStart(2, "0")}`;
console.log(`AIS: sog ${new AisDecode(sent.nmea).sog}`);
const rmc = new NmeaDecode(sentence("GPRMC,120000.00,A,4806.000,N,01130.000,E,020.0,090.0,011226,003.1,W"));
console.log(`RMC: sog ${rmc.sog}, alt ${rmc.alt}`);
EOF
