#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Two readers of NMEA put a receiver without a fix at latitude 0, longitude 0.
# pynmea2 1.19.0 (Python), nmea-simple 3.3.0 (npm). Expected: a GGA with empty fields has no place. Seen: 0.0, 0.0 in both, and nmea-simple has an
# altitude of 0 as well. Until the first fix the robot is in the Gulf of Guinea, and an origin that is taken from the first message stays there.
. "$(dirname "$0")/common.sh"
pip_packages pynmea2==1.19.0
npm_packages nmea-simple@3.3.0
seen='pynmea2: latitude 0.0, longitude 0.0, altitude None
nmea-simple: latitude 0, longitude 0, altitude 0'
cd "$work/npm"
{
  "$python" - <<'EOF'
import pynmea2
gga = pynmea2.parse("$GPGGA,120000.00,,,,,0,00,99.99,,M,,M,,*65")
print(f"pynmea2: latitude {gga.latitude}, longitude {gga.longitude}, altitude {gga.altitude}")
EOF
  node - <<'EOF'
const gga = require("nmea-simple").parseNmeaSentence("$GPGGA,120000.00,,,,,0,00,99.99,,M,,M,,*65");
console.log(`nmea-simple: latitude ${gga.latitude}, longitude ${gga.longitude}, altitude ${gga.altitudeMeters}`);
EOF
} | as_seen
