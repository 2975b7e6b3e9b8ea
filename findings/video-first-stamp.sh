#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A video whose first picture is of 1.4 s begins at 0 in OpenCV, and at 1.4 s if it is H.264 in Matroska.
# opencv-python-headless 5.0.0.93, av 18.1.0. Expected: container and codec do not change a picture's time. Seen: 1400 ms for H.264 in Matroska, 0 for
# H.264 in MP4 and for MPEG-4 in both; PyAV gives 1.4 s for all. A pipeline that was set up with one kind is 1.4 s off with the other: at 1 m/s the
# camera sees places that the robot has passed.
. "$(dirname "$0")/common.sh"
pip_packages av==18.1.0 opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='mp4, libx264: OpenCV 0 ms, PyAV 1400 ms
mkv, libx264: OpenCV 1400 ms, PyAV 1400 ms
mp4, mpeg4: OpenCV 0 ms, PyAV 1400 ms
mkv, mpeg4: OpenCV 0 ms, PyAV 1400 ms'
cd "$work"
"$python" - 2>/dev/null <<'EOF' | as_seen
import av, cv2, numpy as np
from fractions import Fraction
for ending, codec in (("mp4", "libx264"), ("mkv", "libx264"), ("mp4", "mpeg4"), ("mkv", "mpeg4")):
    with av.open("drive." + ending, "w") as file:
        stream = file.add_stream(codec, rate=1000)
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
        print(f"{ending}, {codec}: OpenCV {video.get(cv2.CAP_PROP_POS_MSEC):.0f} ms, PyAV {1000 * float(first.pts * first.time_base):.0f} ms")
EOF
