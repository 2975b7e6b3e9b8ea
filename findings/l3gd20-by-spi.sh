#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Adafruit's driver of the L3GD20 gyroscope turns 57 times slower by SPI than by I2C.
# adafruit-circuitpython-l3gd20 2.3.27, both buses stood in for by a table of registers. Expected: 100 degrees/s are 1.745 rad/s on both. Seen: on SPI
# 0.030: degrees become radians twice. A robot that is rewired from one bus to the other has a heading that hardly moves.
. "$(dirname "$0")/common.sh"
pip_packages adafruit-circuitpython-l3gd20==2.3.27
seen='I2C: 1.745 rad/s
SPI: 0.030 rad/s'
"$python" - <<'EOF' | as_seen
import struct
import adafruit_l3gd20
registers = bytearray(128)
registers[0x0F] = 0xD7  # its identity
registers[0x28:0x2E] = struct.pack("<hhh", 0, 0, round(100 / 0.00875))  # 8.75 mdps a step at 250 dps
class Bus:
    def try_lock(self): return True
    def unlock(self): pass
class I2C(Bus):
    def writeto(self, address, buffer, start=0, end=None): pass
    def writeto_then_readfrom(self, address, out, into, out_start=0, out_end=None, in_start=0, in_end=None):
        for k in range(in_start, len(into) if in_end is None else in_end):
            into[k] = registers[(out[out_start] & 0x7F) + k - in_start]
class SPI(Bus):
    def configure(self, **_): pass
    def write(self, buffer): self.register = buffer[0] & 0x3F
    def readinto(self, buffer): buffer[:] = registers[self.register:self.register + len(buffer)]
class Pin:
    def switch_to_output(self, value): pass
print(f"I2C: {adafruit_l3gd20.L3GD20_I2C(I2C()).gyro[2]:.3f} rad/s")
print(f"SPI: {adafruit_l3gd20.L3GD20_SPI(SPI(), Pin()).gyro[2]:.3f} rad/s")
EOF
