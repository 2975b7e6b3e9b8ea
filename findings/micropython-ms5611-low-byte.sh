#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# micropython-ms5611 takes the high byte of a reading for its low one.
# micropython-ms5611 0.1.0, the bus stood in for. The readings have 24 bits, the high byte first. Expected: with the data sheet's calibration its example, 100.009 kPa and 20.07 degrees, and a
# pressure for each reading. Seen: 100.0117; readings 255 apart have the same pressure, the next one 5 Pa more: heights move in steps of 0.4 m, on a sensor of 0.1 m.
. "$(dirname "$0")/common.sh"
pip_packages micropython-ms5611==0.1.0
micropython_bus
seen='9085466: 20.08 degrees, 100.0117 kPa
9085184: 20.08 degrees, 100.0068 kPa
9085439: 20.08 degrees, 100.0068 kPa
9085440: 20.08 degrees, 100.0117 kPa'
"$python" - <<'EOF' | as_seen
import time
from bus import I2C
from micropython_ms5611 import ms5611
time.sleep_ms = lambda duration: None  # MicroPython's
class Chip(I2C):
    def writeto(self, address, data): self.set(0, (self.pressure if data[0] >> 4 == 4 else 8569150).to_bytes(3, "big"))
bus = Chip(0, 0)
for register, value in zip(range(0xA2, 0xAE, 2), (40127, 36924, 23317, 23282, 33464, 28312)): bus.set(register, value.to_bytes(2, "big"))
sensor = ms5611.MS5611(bus)
for bus.pressure in (9085466, 9085184, 9085439, 9085440):
    print("{}: {:.2f} degrees, {:.4f} kPa".format(bus.pressure, *sensor.measurements))
EOF
