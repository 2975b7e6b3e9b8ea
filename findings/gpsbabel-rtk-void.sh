#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# GPSBabel makes the places of an RTK receiver void: what has a fix of 1 cm comes out of NMEA as no fix.
# gpsbabel 1.8.0+ds-5 (Debian 12). NMEA's quality in GGA: 1 GPS, 2 differential, 4 RTK, 5 RTK float; RMC's status: A valid, V void. Expected: from NMEA to
# NMEA a valid place stays valid. Seen: 4 and 5 become V and 0, "no fix". A reader that heeds the status, as it must, has no place from the best receiver.
. "$(dirname "$0")/common.sh"
debian_packages gpsbabel=1.8.0+ds-5 libshp2 libqt5core5a libdouble-conversion3 libicu72 libpcre2-16-0 libglib2.0-0 libusb-1.0-0 libudev1
seen='GGA 1, RMC A: GGA 1, RMC A
GGA 2, RMC A: GGA 2, RMC A
GGA 4, RMC A: GGA 0, RMC V
GGA 5, RMC A: GGA 0, RMC V'
cd "$work"
cat >place.py <<'EOF'
import sys
for body in f"GPGGA,120000.00,4806.00234,N,01130.00000,E,{sys.argv[1]},08,1.0,500.0,M,46.9,M,,", "GPRMC,120000.00,A,4806.00234,N,01130.00000,E,3.60,000.0,011226,003.1,W,A":
    total = 0
    for character in body: total ^= ord(character)
    print(f"${body}*{total:02X}")
EOF
for quality in 1 2 4 5; do
  python3 place.py $quality >in.nmea
  "$root/usr/bin/gpsbabel" -t -i nmea -f in.nmea -o nmea -F out.nmea
  echo "GGA $quality, RMC A: GGA $(grep GGA out.nmea | cut -d, -f7), RMC $(grep RMC out.nmea | cut -d, -f3)"
done | as_seen
