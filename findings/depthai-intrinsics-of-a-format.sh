#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# depthai's camera matrix of another format follows the width alone.
# depthai 3.12.0. Expected: of a 1280 x 800 camera the 640 x 480 picture, which is cut at the sides to fill it, has the focal length times 0.6. Seen: times
# 0.5 and cy 240: the matrix of a picture with bars above and below. Distances from the picture's middle are 20 % off for a picture that was cut.
. "$(dirname "$0")/common.sh"
pip_packages depthai==3.12.0
seen='1280 x 800: f 800 cx 640 cy 400
640 x 400: f 400 cx 320 cy 200
640 x 480: f 400 cx 320 cy 240
1280 x 720: f 800 cx 640 cy 360'
"$python" - <<'EOF' | grep ' x ' | as_seen
import depthai
calibration, socket = depthai.CalibrationHandler(), depthai.CameraBoardSocket.CAM_A
calibration.setCameraIntrinsics(socket, [[800.0, 0, 640], [0, 800, 400], [0, 0, 1]], 1280, 800)
for width, height in ((1280, 800), (640, 400), (640, 480), (1280, 720)):
    K = calibration.getCameraIntrinsics(socket, width, height)
    print(f"{width} x {height}: f {K[0][0]:.0f} cx {K[0][2]:.0f} cy {K[1][2]:.0f}", flush=True)
EOF
