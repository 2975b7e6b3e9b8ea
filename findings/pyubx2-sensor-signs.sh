#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pyubx2 has no negative measurements of u-blox's sensors: -1 is 16777215.
# pyubx2 1.4.0. In ESF-MEAS a gyroscope's rate is 24 bits, signed, in steps of 2^-12 degrees/s, an acceleration in steps of 2^-10 m/s2. Expected: -1, or the
# rate. Seen: an unsigned number; ESF-INS of the same receiver has signs, and is scaled. A slow turn to one side is 4091 degrees/s.
. "$(dirname "$0")/common.sh"
pip_packages pyubx2==1.4.0
seen='ESF-MEAS: type 5, value 20480 (5.0 degrees/s)
ESF-MEAS: type 5, value 16756736 (4091.0 degrees/s)
ESF-INS: zAngRate -5.0'
"$python" - <<'EOF' | as_seen
import struct
from pyubx2 import UBXReader
def message(number, payload):
    body = b"\x10" + bytes([number]) + struct.pack("<H", len(payload)) + payload
    a = b = 0
    for byte in body:
        a, b = a + byte & 255, b + a + byte & 255
    return UBXReader.parse(b"\xb5b" + body + bytes([a, b]))
for rate in (5, -5):  # degrees/s about z
    m = message(2, struct.pack("<IHHI", 1000, 1 << 11, 0, rate * 4096 & 0xFFFFFF | 5 << 24))
    print(f"ESF-MEAS: type {m.dataType_01}, value {m.dataField_01} ({m.dataField_01 / 4096} degrees/s)")
print("ESF-INS: zAngRate", message(0x15, struct.pack("<IIIiiiiii", 0x3F01, 0, 1000, 0, 0, -5000, 0, 0, 0)).zAngRate)
EOF
