#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# imu-bmi088 reads no negative acceleration or rate, and 276 degrees where it is 20.
# imu-bmi088 1.0.1 with numpy 2, which it asks for; the bus stood in for by a table of registers. Bosch's data sheet: accelerations and rates are signed
# numbers of 16 bits, the temperature one of 11 bits in steps of 0.125 from 23 degrees. Expected: -1 g, 20 degrees. Seen: OverflowError, and 276 degrees for
# each that is below 23.
. "$(dirname "$0")/common.sh"
pip_packages imu-bmi088==1.0.1 numpy==2.3.5 ahrs==0.4.0 smbus3==0.5.5
seen='1 g: 1.0
-1 g: Python integer 54616 out of bounds for int16
26 degrees: 26.0
20 degrees: 276.0'
cd "$work"
"$python" - <<'EOF' | as_seen
import smbus3
class Bus:
    registers = {0x18: bytearray(256), 0x69: bytearray(256)}
    def __init__(self, number): pass
    def write_byte_data(self, address, register, value): self.registers[address][register] = value
    def read_byte_data(self, address, register): return self.registers[address][register]
    def read_i2c_block_data(self, address, register, count): return list(self.registers[address][register:register + count])
smbus3.SMBus = Bus
from bmi088.bmi088 import BMI088
sensor = BMI088(1)
for g in 1, -1:
    Bus.registers[0x18][0x16:0x18] = (g * 10920).to_bytes(2, "little", signed=True)
    try: print(f"{g} g: {sensor.read_accelerometer()[2]:.1f}")
    except OverflowError as error: print(f"{g} g: {error}")
for degrees in 26, 20:
    steps = round((degrees - 23) / 0.125) & 0x7FF
    Bus.registers[0x18][0x22:0x24] = steps >> 3, (steps & 7) << 5
    print(f"{degrees} degrees: {sensor.read_temperature():.1f}")
EOF
