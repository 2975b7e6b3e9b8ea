#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# dpkt reads the stamps of a pcapng's second interface in the unit of the first.
# dpkt 1.9.8. Expected: each interface's if_tsresol holds for its packets. Seen: packets of the same moment on an interface of microseconds and on one of
# nanoseconds are at 1700000000 s and at 1700000000123 s. A LiDAR's packets, captured beside a camera's, lie 54 thousand years later.
. "$(dirname "$0")/common.sh"
pip_packages dpkt==1.9.8
seen='interface of microseconds: 1700000000 s
interface of nanoseconds: 1700000000123 s
nanoseconds alone: 1700000000 s'
"$python" - <<'EOF' | as_seen
import io, struct, dpkt
def block(kind, body): return struct.pack("<II", kind, len(body) + 12) + body + struct.pack("<I", len(body) + 12)
def interface(resolution): return block(1, struct.pack("<HHI", 1, 0, 65535) + struct.pack("<HHB3xHH", 9, 1, resolution, 0, 0))
def packet(number, stamp): return block(6, struct.pack("<IIIII", number, stamp >> 32, stamp & 0xFFFFFFFF, 4, 4) + b"abcd")
def read(*blocks): return [int(t) for t, _ in dpkt.pcapng.Reader(io.BytesIO(b"".join(blocks)))]
head, ns = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)), 1700000000123456789
both = read(head, interface(6), interface(9), packet(0, ns // 1000), packet(1, ns))
print(f"interface of microseconds: {both[0]} s\ninterface of nanoseconds: {both[1]} s")
print(f"nanoseconds alone: {read(head, interface(9), packet(0, ns))[0]} s")
EOF
