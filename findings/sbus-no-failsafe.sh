#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The crate sbus has no failsafe and no lost frame: its flags are false whatever the receiver sends.
# sbus 0.2.2 (Rust). Bit 2 of a frame's byte 23 is a lost frame, bit 3 the failsafe. Expected: true when they are set, as its first channel of one bit is.
# Seen: only bit 0 is ever true, and what it prints of a packet with the failsafe equals that without. A robot whose transmitter is off goes on with the
# channels that the receiver makes up.
. "$(dirname "$0")/common.sh"
crates sbus@0.2.2
seen='0b0000: d1: false, d2: false, failsafe: false, frame_lost: false
0b0001: d1: true, d2: false, failsafe: false, frame_lost: false
0b0010: d1: false, d2: false, failsafe: false, frame_lost: false
0b0100: d1: false, d2: false, failsafe: false, frame_lost: false
0b1100: d1: false, d2: false, failsafe: false, frame_lost: false'
cat >src/main.rs <<'EOF'
fn main() {
    for flags in [0, 1, 2, 4, 12] {
        let mut frame = [0u8; 25];
        frame[0] = 0x0F;
        frame[23] = flags;
        let mut parser = sbus::SBusPacketParser::new();
        parser.push_bytes(&frame);
        let text = format!("{:?}", parser.try_parse().unwrap());
        println!("{flags:#06b}: {}", &text[text.find("d1").unwrap()..text.len() - 2]);
    }
}
EOF
cargo -q run | as_seen
