#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Pimoroni's driver of the MSA301 accelerometer puts the offset of x on z, that of z on x, and takes no positive one.
# msa301 0.0.2, the bus stood in for by a table of registers. MEMSensing's data sheet: offsets of x, y, z at 38h, 39h, 3Ah. Its own bounds: -0.5 to 0.5 g.
# Expected: an offset of -0.1 g of x is 25 in 38h. Seen: in 3Ah; the three bytes are one number whose upper byte is called z; and a positive offset is a
# negative byte, which it refuses. An error of x that was calibrated stays, and z, the vertical, has it as well.
. "$(dirname "$0")/common.sh"
pip_packages msa301==0.0.2 smbus2==0.5.0
seen='-0.1 g of x: 38h to 3Ah are 0 0 25
-0.1 g of y: 38h to 3Ah are 0 25 0
-0.1 g of z: 38h to 3Ah are 25 0 0
0.1 g of x: Offset must be between -128 to 128'
cd "$work"
"$python" - <<'EOF' | as_seen
from msa301 import MSA301
class Bus:
    registers = bytearray(256)
    registers[0x01] = 0x13  # who it is
    def write_i2c_block_data(self, address, register, data): self.registers[register:register + len(data)] = bytes(data)
    def read_i2c_block_data(self, address, register, count): return list(self.registers[register:register + count])
sensor = MSA301(i2c_dev=Bus())
for axis, g in ("x", -0.1), ("y", -0.1), ("z", -0.1), ("x", 0.1):
    try: sensor.set_offsets(**{f"offset_{axis}": g})
    except ValueError as error: print(f"{g} g of {axis}: {error}")
    else: print(f"{g} g of {axis}: 38h to 3Ah are", *Bus.registers[0x38:0x3B])
EOF
