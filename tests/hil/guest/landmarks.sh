# SPDX-License-Identifier: Apache-2.0
# In the guest: landmark_ekf from CAN and from sightings over LCM.
name=landmarks device=- width=0 height=0
. /host/guest/drive.sh
