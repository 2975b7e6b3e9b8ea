#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Perl's Geo::Coordinates::Transform has no sign for what is less than a degree south or west, and 60 minutes and seconds.
# libgeo-coordinates-transform-perl 0.10-3 (Debian 12). Its text: degrees, degrees and minutes, degrees, minutes and seconds are made of each other.
# Expected: -0.5 comes back as -0.5; minutes and seconds are below 60. Seen: 0.5, which is 111 km away; 48 60.00000; and 53 minutes 60 seconds for 54.
. "$(dirname "$0")/common.sh"
debian_packages libgeo-coordinates-transform-perl=0.10-3
seen='-0.5: 0 30.00000, 0 30 0.00000, and back 0.5000000
-33.9: -33 54.00000, -33 53 60.00000, and back -33.9000000
48.9999999999: 48 60.00000, 48 59 60.00000, and back 49.0000000'
PERL5LIB=$root/usr/share/perl5 perl - <<'EOF' | as_seen
use Geo::Coordinates::Transform;
my $transform = Geo::Coordinates::Transform->new;
for my $degrees (-0.5, -33.9, 48.9999999999) {
    my $minutes = $transform->cnv_to_ddm([$degrees])->[0];
    print "$degrees: $minutes, ", $transform->cnv_to_dms([$degrees])->[0], ", and back ", $transform->cnv_to_dd([$minutes])->[0], "\n";
}
EOF
