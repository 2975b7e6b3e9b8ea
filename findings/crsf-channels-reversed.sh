#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# crsf-parser's channel 0 is the remote control's channel 16.
# crsf-parser 0.3.2. CRSF packs 16 channels of 11 bits, the first one in the lowest bits of the first byte. Expected: channels[0] is channel 1. Seen: the
# list begins with channel 16 and ends with channel 1. Throttle and steering are read from switches, and the other way round.
. "$(dirname "$0")/common.sh"
pip_packages --no-deps crsf-parser==0.3.2 construct==2.10.70 construct-typing==0.5.6 # wheels of what it needs
seen='status VALID
channels 1015 1014 1013 1012 1011 1010 1009 1008 1007 1006 1005 1004 1003 1002 1001 1000'
"$python" - <<'EOF' | as_seen
from crsf_parser import CRSFParser
def crc8(data):  # of polynomial D5
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (0xD5 if crc & 0x80 else 0)) & 0xFF
    return crc
packed = sum(1000 + k << 11 * k for k in range(16)).to_bytes(22, "little")  # channel k + 1 has 1000 + k
def show(frame, status):
    print("status", status.name)
    print("channels", *frame.payload.channels)
body = b"\x16" + packed
CRSFParser(show).parse_stream(bytearray(bytes([0xC8, len(body) + 1]) + body + bytes([crc8(body)])))
EOF
