#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# GPSBabel gives each place the time of the next where RMC comes before GGA, as u-blox sends them, and writes NMEA to 2 m.
# gpsbabel 1.8.0+ds-5 (Debian 12). Expected: sentences with one time are one place with that time, in either order, five of five; a place is written as
# finely as it was read. Seen: with GGA before RMC it is so; with RMC first, the place of 12:00:00 comes a second time with 12:00:01, and so on, and the last
# place is in none. Minutes have three digits. A robot is where it was a second before.
. "$(dirname "$0")/common.sh"
debian_packages gpsbabel=1.8.0+ds-5 libshp2 libqt5core5a libdouble-conversion3 libicu72 libpcre2-16-0 libglib2.0-0 libusb-1.0-0 libudev1
seen='GGA first
48.100039 12:00:00
48.100206 12:00:01
48.100372 12:00:02
48.100539 12:00:03
48.100706 12:00:04
RMC first
48.100039 12:00:00
48.100039 12:00:01
48.100206 12:00:02
48.100372 12:00:03
48.100539 12:00:04
from RMC,120000.00,A,4806.00234,N, to RMC,120000.000,A,4806.002,N,'
cd "$work"
cat >drive.py <<'EOF'
import sys
def sentence(body):
    total = 0
    for character in body: total ^= ord(character)
    return f"${body}*{total:02X}"
for k in range(5):
    place = f"4806.{k:02d}234,N,01130.00000,E"
    pair = [sentence(f"GPRMC,12000{k}.00,A,{place},3.60,000.0,011226,003.1,W,A"), sentence(f"GPGGA,12000{k}.00,{place},1,08,1.0,500.0,M,46.9,M,,")]
    print(*(pair if sys.argv[1] == "RMC" else reversed(pair)), sep="\n")
EOF
for first in GGA RMC; do
  python3 drive.py $first >$first.nmea
  echo "$first first"
  "$root/usr/bin/gpsbabel" -t -i nmea -f $first.nmea -o unicsv,utc=0 -F - | cut -d, -f2,11 | sed '1d; s/,/ /; s/\r$//'
done >table
{
  cat table
  echo "from $(grep -m1 -o 'RMC.*N,' GGA.nmea) to $("$root/usr/bin/gpsbabel" -t -i nmea -f GGA.nmea -o nmea -F - | grep -m1 -o 'RMC.*N,')"
} | as_seen
