# SPDX-License-Identifier: Apache-2.0
# In the guest: landmark_ekf from twists and sightings over LCM; nothing comes over CAN.
name=motion device=- width=0 height=0
. /host/guest/drive.sh
