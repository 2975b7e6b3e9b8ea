#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# mpu6050-pi sets an eighth of the rate that it is asked for.
# mpu6050-PI 0.0.2, the bus stood in for by a table of registers. InvenSense's register map of the MPU-6050: rate = gyro's rate / (1 + SMPLRT_DIV), and the
# gyro's rate is 8 kHz without the low-pass filter, 1 kHz with it. Expected: the rate of the argument. Seen: with up to 1000 Hz the filter is on and the
# divisor that for 8 kHz. Who integrates with the rate that was asked for turns eight times too little.
. "$(dirname "$0")/common.sh"
pip_packages mpu6050-PI==0.0.2
seen='2000 Hz: low-pass off, 2000 Hz
1000 Hz: low-pass on, 125 Hz
500 Hz: low-pass on, 62.5 Hz
100 Hz: low-pass on, 12.5 Hz'
cd "$work"
cat >smbus.py <<'EOF'
class SMBus:
    registers = bytearray(256)
    def __init__(self, number): pass
    def write_byte_data(self, address, register, value): self.registers[register] = value
    def read_byte_data(self, address, register): return self.registers[register]
EOF
"$python" - <<'EOF' | as_seen
import smbus
from MPU6050 import MPU6050
sensor = MPU6050.MPU6050(0x68)
for asked in 2000, 1000, 500, 100:
    sensor.sample_rate(asked)
    divisor, configuration = smbus.SMBus.registers[0x19:0x1B]
    filtered = configuration & 7 not in (0, 7)
    print(f"{asked} Hz: low-pass {'on' if filtered else 'off'}, {(1000 if filtered else 8000) / (1 + divisor):g} Hz")
EOF
