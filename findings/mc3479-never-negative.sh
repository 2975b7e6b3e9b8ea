#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# circuitpython-mc3479 has no negative accelerations: -1 g is 3 g.
# circuitpython-mc3479 0.2.1, the bus stood in for by a table of registers. Its own text calls the registers signed, two's complement. Expected: 1 g upright
# and -1 g upside down, at its range of 2 g. Seen: 1 and 3; a small -0.01 g is 3.99 g. A robot that leans one way is level, the other way it has fallen.
. "$(dirname "$0")/common.sh"
pip_packages circuitpython-mc3479==0.2.1
seen='1 g is read as 1.00 g
-1 g is read as 3.00 g
-0.01 g is read as 3.99 g'
"$python" - <<'EOF' | as_seen
import mc3479
class I2C:
    def __init__(self):
        self.registers = bytearray(256)
        self.registers[0x98] = 0xA4  # its identity
    def try_lock(self): return True
    def unlock(self): pass
    def writeto(self, address, buffer, start=0, end=None):
        for k, byte in enumerate(buffer[start + 1:end]): self.registers[buffer[start] + k] = byte
    def writeto_then_readfrom(self, address, out, into, out_start=0, out_end=None, in_start=0, in_end=None):
        for k in range(in_start, len(into) if in_end is None else in_end):
            into[k] = self.registers[out[out_start] + k - in_start]
bus = I2C()
sensor = mc3479.MC3479(bus)
for g in (1, -1, -0.01):
    bus.registers[0x0D:0x0F] = round(g * 16384).to_bytes(2, "little", signed=True)
    print(f"{g} g is read as {sensor.acceleration[0]:.2f} g")
EOF
