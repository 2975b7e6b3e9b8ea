#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# micropython-lsm6dsox changes a gyroscope's scale and not its range, and the accelerometer's range by its data rate.
# micropython-lsm6dsox 0.1.0, the bus stood in for by a table of registers. ST's data sheet: the range of the gyroscope is bits 3 and 2 of 11h, the accelerometer's rate
# bits 7 to 4 of 10h and its range bits 3 and 2. Expected: 90 degrees/s and 1 g after gyro_range and acceleration_data_rate were set. Seen: 720 degrees/s, since 11h is as it
# was; 0.5 g, since the rate is written two bits too low, over the range.
. "$(dirname "$0")/common.sh"
pip_packages micropython-lsm6dsox==0.1.0
micropython_bus
seen='as it comes: 90 degrees/s are 90, 1 g is 1.00 g at a rate of 12.5 Hz
gyro_range 2000 degrees/s: 90 degrees/s are 720, 1 g is 1.00 g at a rate of 12.5 Hz
acceleration_data_rate 833 Hz: 90 degrees/s are 720, 1 g is 0.50 g at a rate of 12.5 Hz'
"$python" - <<'EOF' | as_seen
from math import degrees
from bus import I2C
from micropython_lsm6dsox import lsm6dsox
class Chip(I2C):
    def writeto_mem(self, address, register, data):
        super().writeto_mem(address, register, data)
        self.registers[0x12] &= 0xFE  # its reset is over at once
bus = Chip(0x0F, 0x6C)
def show(name):
    mdps = (8.75, 17.5, 35, 70)[bus.registers[0x11] >> 2 & 3]
    mg = (0.061, 0.488, 0.122, 0.244)[bus.registers[0x10] >> 2 & 3]
    bus.set(0x22, round(90000 / mdps).to_bytes(2, "little"))
    bus.set(0x28, round(1000 / mg).to_bytes(2, "little"))
    rate = {1: 12.5, 2: 26, 3: 52, 4: 104, 7: 833}[bus.registers[0x10] >> 4]
    print(f"{name}: 90 degrees/s are {degrees(sensor.gyro[0]):.0f}, 1 g is {sensor.acceleration[0] / 9.80665:.2f} g at a rate of {rate} Hz")
sensor = lsm6dsox.LSM6DSOX(bus)
show("as it comes")
sensor.gyro_range = lsm6dsox.RANGE_2000_DPS
show("gyro_range 2000 degrees/s")
sensor.acceleration_data_rate = lsm6dsox.RATE_833_HZ
show("acceleration_data_rate 833 Hz")
EOF
