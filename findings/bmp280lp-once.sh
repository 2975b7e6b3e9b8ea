#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# bmp280lp measures once by default, and turns pressure and temperature of a BME280 off.
# bmp280lp 0.1.6, the bus stood in for by a table of registers that measures where Bosch's data sheets have it: once for each write of mode 01b to F4h,
# always in mode 11b, and not what has no oversampling there. Expected: the pressure of now at each read. Seen: with the default mode, that of the
# construction for ever; with a BME280 none, since the humidity's oversampling goes to F4h for F2h. A robot in a lift stays on its floor.
. "$(dirname "$0")/common.sh"
pip_packages bmp280lp==0.1.6 smbus2==0.5.0
seen='BMP280, mode as it is: 1006.5 hPa, then 1006.5
BMP280, normal mode: 1006.5 hPa, then 1004.8
BME280, normal mode: 820.4 hPa, then 820.4'
cd "$work"
"$python" - <<'EOF' | as_seen
import smbus2
# Bosch's example: T1 to P9, and readings of 25.08 C and 1006.53 hPa.
CALIBRATION = 27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000
TEMPERATURE, PRESSURE, NONE = 519888, 415148, 0x80000
class Bus:
    identity = 0x58
    def __init__(self, port):
        self.registers = bytearray(256)
        self.registers[0xD0] = self.identity
        for k, value in enumerate(CALIBRATION): self.registers[0x88 + 2 * k:0x8A + 2 * k] = (value & 0xFFFF).to_bytes(2, "little")
        self.pressure = PRESSURE
    def measure(self):
        control = self.registers[0xF4]
        for register, value, oversampling in (0xF7, self.pressure, control >> 2 & 7), (0xFA, TEMPERATURE, control >> 5):
            self.registers[register:register + 3] = ((value if oversampling else NONE) << 4).to_bytes(3, "big")
    def write_byte_data(self, address, register, value):
        self.registers[register] = value
        if register == 0xF4 and value & 3: self.measure()
    def read_byte_data(self, address, register): return self.registers[register]
    def read_word_data(self, address, register): return int.from_bytes(self.registers[register:register + 2], "little")
    def read_i2c_block_data(self, address, register, count):
        if self.registers[0xF4] & 3 == 3: self.measure()
        return list(self.registers[register:register + count])
smbus2.SMBus = Bus
from bmp280lp import BMP280
for name, identity, mode in ("BMP280, mode as it is", 0x58, {}), ("BMP280, normal mode", 0x58, {"mode": BMP280.NORMAL_MODE}), ("BME280, normal mode", 0x60, {"mode": BMP280.NORMAL_MODE}):
    Bus.identity = identity
    sensor = BMP280(**mode)
    before = sensor.read_pressure()
    sensor.bus.pressure += 1000  # some floors up
    print(f"{name}: {before:.1f} hPa, then {sensor.read_pressure():.1f}")
EOF
