#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# rosbags-image takes the bytes at the end of an image's rows for pixels.
# rosbags-image 0.10.4, rosbags 0.11.9. A row of sensor_msgs/Image has `step` bytes, more than its pixels where a camera aligns its rows. Expected: 1 2 3 in
# each row. Seen: the filling bytes are in the picture, and each row begins later than the one before. A straight wall leans, and the lower rows are
# missing.
. "$(dirname "$0")/common.sh"
pip_packages rosbags-image==0.10.4 rosbags==0.11.9 opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='3 columns, step 3: | 1 2 3 | 1 2 3 | 1 2 3
3 columns, step 4: | 1 2 3 | 99 1 2 | 3 99 1'
"$python" - <<'EOF' | as_seen
import numpy as np
from rosbags.image import message_to_cvimage
from rosbags.typesys import Stores, get_typestore
types = get_typestore(Stores.ROS2_HUMBLE).types
header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "camera")
rows = np.tile(np.uint8([1, 2, 3, 99]), (3, 1))
for step, data in ((3, rows[:, :3]), (4, rows)):
    image = types["sensor_msgs/msg/Image"](header, 3, 3, "mono8", 0, step, np.ascontiguousarray(data).ravel())
    print(f"3 columns, step {step}:", *(" ".join(str(v) for v in row) for row in message_to_cvimage(image)), sep=" | ")
EOF
