# SPDX-License-Identifier: Apache-2.0
# In the guest: edge_mcl from video and CAN.
modprobe v4l2loopback devices=1 video_nr=10 exclusive_caps=0 max_buffers=4 || exit 1
name=edges device=/dev/video10 width=640 height=360
. /host/guest/drive.sh
