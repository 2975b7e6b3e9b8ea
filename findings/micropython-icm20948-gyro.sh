#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# micropython-icm20948's gyroscope is documented in degrees/s and gives rad/s.
# micropython-icm20948 0.2.3, the bus stood in for by a table of registers. Expected: 90 degrees/s are 90, as its text has it. Seen: 1.57. A robot that takes it at its word
# has 57 times too little of each turn.
. "$(dirname "$0")/common.sh"
pip_packages micropython-icm20948==0.2.3
micropython_bus
seen='its text: degrees / second
90 degrees/s at a range of 500: 1.57'
"$python" - <<'EOF' | as_seen
import re
from bus import I2C
from micropython_icm20948 import icm20948
bus = I2C(0, 0xEA)
sensor = icm20948.ICM20948(bus)
print("its text:", re.search(r"`(degrees / second)`", icm20948.ICM20948.gyro.__doc__)[1])
sensor.gyro_full_scale = icm20948.FS_500_DPS
bus.set(0x33, round(90 * 65.5).to_bytes(2, "big"))
print(f"90 degrees/s at a range of 500: {sensor.gyro[0]:.2f}")
EOF
