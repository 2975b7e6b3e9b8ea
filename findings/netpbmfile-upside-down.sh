#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# netpbmfile reads a PFM upside down.
# netpbmfile 2026.1.29, Pillow 13.0.0, opencv-python-headless 5.0.0.93. PFM's rows go from the lowest to the uppermost one. Expected: the first row of the
# file is the last of the picture. Seen: in Pillow and OpenCV it is, in netpbmfile it is the first. A depth picture from it has the ceiling where the floor
# is.
. "$(dirname "$0")/common.sh"
pip_packages netpbmfile==2026.1.29 pillow==13.0.0 opencv-python-headless==5.0.0.93
seen='netpbmfile: 1 2 3 from above
Pillow: 3 2 1 from above
OpenCV: 3 2 1 from above'
cd "$work"
"$python" - <<'EOF' | as_seen
import struct
import cv2, netpbmfile, numpy as np
from PIL import Image
open("depth.pfm", "wb").write(b"Pf\n1 3\n-1.0\n" + struct.pack("<fff", 1, 2, 3))
def show(name, picture): print(f"{name}:", *(f"{v:g}" for v in np.ravel(picture)), "from above")
show("netpbmfile", netpbmfile.imread("depth.pfm"))
show("Pillow", Image.open("depth.pfm"))
show("OpenCV", cv2.imread("depth.pfm", cv2.IMREAD_UNCHANGED))
EOF
