#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pyrtcm scales some fields of a message, leaves others of it as integers, and multiplies one pair by a million where the standard divides.
# pyrtcm 1.2.1, whose values are scaled by default. RTCM 10403: DF062 and DF063 are steps of 25e-6 degrees, up to 13.1 degrees; GLONASS's clock has steps of
# 2^-30 s (DF124) and 2^-40 (DF121). Expected: an auxiliary station 0.1 degrees to the north, a clock that is 0.1 ms off, both to the step. Seen: 1e11
# degrees; x in km, and the clock as -107374. A network's stations are nowhere, and a satellite's clock is 30 h off.
. "$(dirname "$0")/common.sh"
pip_packages pyrtcm==1.2.1
seen='1014: DF062 (latitude from the master) 1e+11, DF063 (longitude) -5e+10, DF064 (height) 1234
1020: DF112 (x) 12345.5, DF124 (clock) -107374, DF121 (its drift) 1000'
"$python" - <<'EOF' | as_seen
from pyrtcm import RTCMReader
def frame(*fields):  # (value, bits); a tuple as value is a sign and a magnitude
    bits = "".join(f"{value & (1 << count) - 1:0{count}b}" for value, count in fields)
    bits += "0" * (-len(bits) % 8)
    body = int(bits, 2).to_bytes(len(bits) // 8, "big")
    data = b"\xd3" + len(body).to_bytes(2, "big") + body
    crc = 0
    for byte in data:  # CRC-24Q
        crc ^= byte << 16
        for _ in range(8):
            crc = crc << 1 ^ (0x1864CFB if crc & 0x800000 else 0)
    return RTCMReader.parse(data + crc.to_bytes(3, "big"))
def signed(value, bits):  # GLONASS has a sign and a magnitude
    return (abs(value) | (1 << bits - 1 if value < 0 else 0), bits)
near = frame((1014, 12), (1, 8), (0, 4), (1, 5), (10, 12), (11, 12), (4000, 20), (-2000, 21), (1234, 23))
print(f"1014: DF062 (latitude from the master) {near.DF062:g}, DF063 (longitude) {near.DF063:g}, DF064 (height) {near.DF064:g}")
axis = lambda place: [signed(0, 24), signed(round(place * 2**11), 27), signed(0, 5)]
satellite = frame((1020, 12), (1, 6), (8, 5), (0, 4), (0, 12), (0, 1), (0, 1), (45, 7), *axis(12345.5), *axis(0), *axis(0),
    (0, 1), signed(1000, 11), (0, 2), (0, 1), signed(round(-1e-4 * 2**30), 22), signed(0, 5), (0, 5), (0, 1), (0, 4), (0, 11), (1, 2),
    (0, 1), (0, 11), signed(0, 32), (0, 5), signed(0, 22), (0, 1), (0, 7))
print(f"1020: DF112 (x) {satellite.DF112:g}, DF124 (clock) {satellite.DF124:g}, DF121 (its drift) {satellite.DF121:g}")
EOF
