#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A video whose first picture is of 1.4 s begins at 0 in OpenCV if it is an MP4, and at 1.4 s if it is a Matroska.
# opencv-python-headless 5.0.0.93, av 18.1.0. Expected: the container does not change a picture's time. Seen: 0 and 1400 ms; PyAV gives 1.4 s for both. A
# pipeline that was set up with one ending is 1.4 s off with the other: at 1 m/s the camera sees places that the robot has passed.
. "$(dirname "$0")/common.sh"
pip_packages av==18.1.0 opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='mp4: OpenCV 0 ms, PyAV 1400 ms
mkv: OpenCV 1400 ms, PyAV 1400 ms'
cd "$work"
"$python" - 2>/dev/null <<'EOF' | as_seen
import av, cv2, numpy as np
from fractions import Fraction
for ending in ("mp4", "mkv"):
    with av.open("drive." + ending, "w") as file:
        stream = file.add_stream("libx264", rate=1000)
        stream.width, stream.height, stream.pix_fmt, stream.codec_context.time_base = 64, 48, "yuv420p", Fraction(1, 1000)
        for ms in (1400, 1500, 1600):
            frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 99, np.uint8), format="rgb24")
            frame.pts, frame.time_base = ms, Fraction(1, 1000)
            file.mux(stream.encode(frame))
        file.mux(stream.encode())
    video = cv2.VideoCapture("drive." + ending)
    video.read()
    with av.open("drive." + ending) as file:
        first = next(file.decode(video=0))
        print(f"{ending}: OpenCV {video.get(cv2.CAP_PROP_POS_MSEC):.0f} ms, PyAV {1000 * float(first.pts * first.time_base):.0f} ms")
EOF
