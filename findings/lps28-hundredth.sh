#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# circuitpython-lps28 has a hundredth of the pressure.
# circuitpython-lps28 0.1.1, the bus stood in for by a table of registers. Its text has hPa; ST's data sheet: 4096 counts for 1 hPa. Expected: 1013.25. Seen: 10.13, and a height of
# 26 km by the standard atmosphere.
. "$(dirname "$0")/common.sh"
pip_packages circuitpython-lps28==0.1.1
seen='its text: Pressure value in hPa
1013.25 hPa: 10.1325
900 hPa: 9.0000'
"$python" - <<'EOF' | as_seen
import lps28
class I2C:
    def __init__(self):
        self.registers = bytearray(256)
        self.registers[0x0F] = 0xB4  # its identity
    def try_lock(self): return True
    def unlock(self): pass
    def writeto(self, address, buffer, start=0, end=None):
        for k, byte in enumerate(buffer[start + 1:end]): self.registers[buffer[start] + k] = byte
    def writeto_then_readfrom(self, address, out, into, out_start=0, out_end=None, in_start=0, in_end=None):
        for k in range(in_start, len(into) if in_end is None else in_end):
            into[k] = self.registers[out[out_start] + k - in_start]
bus = I2C()
sensor = lps28.LPS28(bus)
print("its text:", lps28.LPS28.pressure.__doc__.strip())
for pressure in (1013.25, 900):
    bus.registers[0x28:0x2B] = round(pressure * 4096).to_bytes(3, "little")
    print(f"{pressure} hPa: {sensor.pressure:.4f}")
EOF
