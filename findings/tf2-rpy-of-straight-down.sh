#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tf2's roll, pitch and yaw of something that points straight down are another rotation.
# libtf2-dev 0.7.6-1+b2 (Debian 12). Expected: at a pitch of 90 degrees one of roll and yaw is free, but together they give the rotation back.
# Seen: yaw becomes 0 and the turn that it had is lost: setRPY of getRPY is up to 1.3 rad away. A camera that looks at the floor has its
# heading replaced by that.
. "$(dirname "$0")/common.sh"
debian_packages libtf2-dev=0.7.6-1+b2 libroscpp-core-dev=0.7.2-8+b2
seen='yaw 1.2 and pitch 90: yaw 0.0, rotation 1.1 rad away
yaw 1.2 and pitch -90: yaw 0.0, rotation 1.3 rad away
yaw 1.2 and pitch 80: yaw 1.2, rotation 0.0 rad away'
cat >"$work/main.cpp" <<'EOF'
#include <tf2/LinearMath/Matrix3x3.h>
#include <tf2/LinearMath/Quaternion.h>
#include <cmath>
#include <cstdio>
int main() {
  const double pitches[] = {M_PI / 2, -M_PI / 2, 80 * M_PI / 180};
  for (int i = 0; i < 3; i++) {
    tf2::Quaternion given, again;
    double roll, pitch, yaw;
    given.setRPY(0.1, pitches[i], 1.2);
    tf2::Matrix3x3(given).getRPY(roll, pitch, yaw);
    again.setRPY(roll, pitch, yaw);
    printf("yaw 1.2 and pitch %.0f: yaw %.1f, rotation %.1f rad away\n", pitches[i] * 180 / M_PI, yaw, given.angleShortestPath(again));
  }
}
EOF
g++ -w -I "$root/usr/include" "$work/main.cpp" -o "$work/main"
"$work/main" | as_seen
