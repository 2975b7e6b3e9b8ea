#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tf2::Quaternion::angle(q) is half the angle between two rotations; angleShortestPath(q) is the whole.
# libtf2-dev 0.7.6-1+b2 (Debian 12). Expected: both are 90 degrees for rotations that are 90 degrees apart. Seen: angle gives 45. A tolerance
# of the goal's heading that is checked with it is twice as wide as its number.
. "$(dirname "$0")/common.sh"
debian_packages libtf2-dev=0.7.6-1+b2 libroscpp-core-dev=0.7.2-8+b2
seen='angle 45, angleShortestPath 90'
cat >"$work/main.cpp" <<'EOF'
#include <tf2/LinearMath/Quaternion.h>
#include <cmath>
#include <cstdio>
int main() {
  tf2::Quaternion still(0, 0, 0, 1), turned;
  turned.setRPY(0, 0, M_PI / 2);
  printf("angle %.0f, angleShortestPath %.0f\n", still.angle(turned) * 180 / M_PI, still.angleShortestPath(turned) * 180 / M_PI);
}
EOF
g++ -w -I "$root/usr/include" "$work/main.cpp" -o "$work/main"
"$work/main" | as_seen
