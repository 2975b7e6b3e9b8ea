#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tf2::Quaternion::setEuler(yaw, pitch, roll) turns "yaw" about the y axis.
# libtf2-dev 0.7.6-1+b2 (Debian 12). Expected: setEuler(0.5, 0, 0) is a turn about z, as setRPY(0, 0, 0.5) is. Seen: it is one about y, and the
# constructor with three angles does the same. A heading that is passed this way pitches the robot.
. "$(dirname "$0")/common.sh"
debian_packages libtf2-dev=0.7.6-1+b2 libroscpp-core-dev=0.7.2-8+b2
seen='setEuler(0.5, 0, 0): x 0.000 y 0.247 z 0.000 w 0.969
Quaternion(0.5, 0, 0): x 0.000 y 0.247 z 0.000 w 0.969
setRPY(0, 0, 0.5): x 0.000 y 0.000 z 0.247 w 0.969'
cat >"$work/main.cpp" <<'EOF'
#include <tf2/LinearMath/Quaternion.h>
#include <cstdio>
static void print(const char *name, const tf2::Quaternion &q) {
  printf("%s: x %.3f y %.3f z %.3f w %.3f\n", name, q.x(), q.y(), q.z(), q.w());
}
int main() {
  tf2::Quaternion q;
  q.setEuler(0.5, 0, 0);
  print("setEuler(0.5, 0, 0)", q);
  print("Quaternion(0.5, 0, 0)", tf2::Quaternion(0.5, 0, 0));
  q.setRPY(0, 0, 0.5);
  print("setRPY(0, 0, 0.5)", q);
}
EOF
g++ -w -I "$root/usr/include" "$work/main.cpp" -o "$work/main"
"$work/main" | as_seen
