#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Three MicroPython drivers of Bosch's accelerometers have 0.1 m/s2 for 1 g: they divide by 9.8 where they should multiply.
# micropython-bma220 0.1.2, -bma400 0.1.2, -bmi160 0.1.2, the bus stood in for by a table of registers. The first two name m/s2 in their texts; micropython-bmi270 0.1.0 of the same
# author does it. Expected: 9.8. Seen: 0.10. A robot at rest falls freely.
. "$(dirname "$0")/common.sh"
pip_packages micropython-bma220==0.1.2 micropython-bma400==0.1.2 micropython-bmi160==0.1.2
seen='bma220, 2 g: 1 g is 0.10 m/s2
bma400, 2 g: 1 g is 0.10 m/s2
bmi160, 2 g: 1 g is 0.10 m/s2'
micropython_bus
"$python" - <<'EOF' | as_seen
import importlib
from bus import I2C
for name, identity, register, counts in (("bma220", 0xDD, 4, bytes([16 << 2])), ("bma400", 0x90, 4, (1024).to_bytes(2, "little")), ("bmi160", 0xD1, 18, (16384).to_bytes(2, "little"))):
    module = importlib.import_module(f"micropython_{name}.{name}")
    bus = I2C(0, identity)
    sensor = getattr(module, name.upper())(bus)
    sensor.acceleration_range = module.ACCEL_RANGE_2G if name == "bmi160" else module.ACC_RANGE_2
    bus.set(register, counts)
    print(f"{name}, 2 g: 1 g is {sensor.acceleration[0]:.2f} m/s2")
EOF
