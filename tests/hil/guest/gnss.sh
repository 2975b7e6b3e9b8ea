# SPDX-License-Identifier: Apache-2.0
# In the guest: landmark_ekf from twists over LCM, and positions of gpsd, which reads NMEA from a serial line.
name=gnss device=- width=0 height=0 record=1 wait=10 # the receiver is on before
beside() {
  until [ -e /run/receiver ]; do sleep 0.1; done
  gpsd -n -N /run/receiver &
}
. /host/guest/drive.sh
