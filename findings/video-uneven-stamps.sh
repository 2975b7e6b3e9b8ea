#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Two readers of video go by the mean rate where pictures came unevenly: one doubles pictures, one seeks the wrong one.
# imageio 2.38.1 with imageio-ffmpeg 0.8.1, opencv-python-headless 5.0.0.93; the video is made by av 18.1.0. Six pictures at 0, 0.1, 0.2, 1.0, 1.1, 1.2 s.
# Expected: six pictures, and at 1.0 s the one of 1.0 s. Seen: imageio gives more than twice as many, at even times; VideoCapture, told to go to
# 1000 ms, gives the picture of 1200 ms, though it knows the stamps when it reads one by one. Cameras that adapt their exposure make such videos.
. "$(dirname "$0")/common.sh"
pip_packages imageio==2.38.1 imageio-ffmpeg==0.8.1 av==18.1.0 opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='imageio: more than 12 pictures of 6
OpenCV one by one: 0 100 200 1000 1100 1200
OpenCV at 1000 ms: the picture of 1200 ms'
cd "$work"
"$python" - 2>/dev/null <<'EOF' | as_seen
import av, cv2, imageio.v2, numpy as np
from fractions import Fraction
with av.open("drive.mp4", "w") as file:
    stream = file.add_stream("mpeg4", rate=100)
    stream.width, stream.height, stream.pix_fmt, stream.codec_context.time_base = 64, 48, "yuv420p", Fraction(1, 1000)
    for k, ms in enumerate((0, 100, 200, 1000, 1100, 1200)):
        frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 20 + 30 * k, np.uint8), format="rgb24")
        frame.pts, frame.time_base = ms, Fraction(1, 1000)
        file.mux(stream.encode(frame))
    file.mux(stream.encode())
count = sum(1 for _ in imageio.v2.get_reader("drive.mp4", "ffmpeg"))
print("imageio:", "more than 12" if count > 12 else count, "pictures of 6")
video, stamps = cv2.VideoCapture("drive.mp4"), []
while video.read()[0]:
    stamps.append(round(video.get(cv2.CAP_PROP_POS_MSEC)))
print("OpenCV one by one:", *stamps)
video = cv2.VideoCapture("drive.mp4")
video.set(cv2.CAP_PROP_POS_MSEC, 1000)
video.read()
print("OpenCV at 1000 ms: the picture of", round(video.get(cv2.CAP_PROP_POS_MSEC)), "ms")
EOF
