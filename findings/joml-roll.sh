#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# JOML's Quaterniond.getEulerAnglesZYX has less roll than there is: 30 degrees are 28.7, and 12.6 at a pitch of 50.
# org.joml:joml 1.10.5 (Java). Its own text: the angles of a rotation by z, y, x, as rotationZYX takes them. Expected: what rotationZYX was given, as
# Matrix4d.getEulerAnglesZYX has it. Seen: pitch and yaw come back, roll is too small, the more the steeper. 1.10.8 is right. A robot that leans stands more
# level than it does.
. "$(dirname "$0")/common.sh"
maven_artifacts org.joml:joml:1.10.5
seen='roll 30, pitch 0, yaw 50: the quaternion has 28.7 0.0 50.0, the matrix 30.0 0.0 50.0
roll 30, pitch 20, yaw 50: the quaternion has 23.4 20.0 50.0, the matrix 30.0 20.0 50.0
roll 30, pitch 50, yaw 50: the quaternion has 12.6 50.0 50.0, the matrix 30.0 50.0 50.0'
cat >"$work/Main.java" <<'EOF'
import org.joml.*;
class Main {
  public static void main(String[] arguments) {
    for (int pitch : new int[] {0, 20, 50}) {
      double roll = java.lang.Math.toRadians(30), yaw = java.lang.Math.toRadians(50), middle = java.lang.Math.toRadians(pitch);
      System.out.printf("roll 30, pitch %d, yaw 50: the quaternion has %s, the matrix %s%n", pitch,
        text(new Quaterniond().rotationZYX(yaw, middle, roll).getEulerAnglesZYX(new Vector3d())),
        text(new Matrix4d().rotationZYX(yaw, middle, roll).getEulerAnglesZYX(new Vector3d())));
    }
  }
  static String text(Vector3d angles) {
    angles.mul(180 / java.lang.Math.PI).add(1e-9, 1e-9, 1e-9);
    return String.format("%.1f %.1f %.1f", angles.x, angles.y, angles.z);
  }
}
EOF
"${java[@]}" "$work/Main.java" | as_seen
