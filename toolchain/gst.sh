#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# gst.sh FOLDER: compiles waymark-gst alone into FOLDER/lib/waymark, beside a waymark of the same version in FOLDER/bin: on a board whose
# waymark comes from the portable tarball. Needs a C compiler (glibc 2.34 or later) and libgstreamer-plugins-base1.0-dev.
set -euo pipefail
out=$(readlink -f "${1:?usage: gst.sh FOLDER}")/lib/waymark
cd "$(dirname "$(readlink -f "$0")")/.."
mkdir -p "$out"
# shellcheck disable=SC2046 # words are meant
"${CC:-cc}" -std=gnu17 -O2 -D_GNU_SOURCE -DCAMERA_KEY='"gst"' -DCAMERA_IO=kGstreamer -Idrivers/include -Imsgs/include \
  drivers/camera/{camera_main,gstreamer,camera_process,pixels,v4l2}.c $(pkg-config --cflags --libs gstreamer-app-1.0 gstreamer-video-1.0) -o "$out/waymark-gst"
echo "$out/waymark-gst"
