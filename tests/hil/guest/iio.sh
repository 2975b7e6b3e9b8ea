# SPDX-License-Identifier: Apache-2.0
# In the guest: landmark_ekf from twists and sightings over LCM, and the gyro of an IIO device whose samples come from user space.
modprobe -a uhid hid-sensor-hub hid-sensor-gyro-3d || exit 1
name=iio device=- width=0 height=0
. /host/guest/drive.sh
