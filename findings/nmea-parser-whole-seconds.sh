#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The crate nmea-parser cuts the fraction of a second from places, and keeps that of the time without a place.
# nmea-parser 0.10.0 (Rust; 0.11.0 is the same). Expected: 12:00:00.90 is 12:00:00.9 in each sentence. Seen: 12:00:00 in RMC, GGA, GLL and GNS; ZDA has
# 12:00:00.9. At 10 Hz ten places share a moment, and at 10 m/s the oldest of them is 9 m behind its stamp.
. "$(dirname "$0")/common.sh"
crates nmea-parser@0.10.0
seen='GPRMC: 12:00:00Z
GPGGA: 12:00:00Z
GPGLL: 12:00:00Z
GNGNS: 12:00:00Z
GPZDA: 12:00:00.900Z'
cat >src/main.rs <<'EOF'
fn main() {
    for body in [
        "GPRMC,120000.90,A,4806.000,N,01130.000,E,020.0,090.0,011226,003.1,W,A",
        "GPGGA,120000.90,4806.000,N,01130.000,E,4,08,1.0,500.0,M,46.9,M,1.5,0001",
        "GPGLL,4806.000,N,01130.000,E,120000.90,A,A",
        "GNGNS,120000.90,4806.000,N,01130.000,E,RR,12,0.8,500.0,46.9,1.5,0001",
        "GPZDA,120000.90,01,12,2026,00,00",
    ] {
        let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
        let text = format!("{:?}", nmea_parser::NmeaParser::new().parse_sentence(&format!("${body}*{sum:02X}")).unwrap());
        let time = text.find("T12").unwrap() + 1;
        println!("{}: {}", &body[..5], &text[time..=time + text[time..].find('Z').unwrap()]);
    }
}
EOF
cargo -q run | as_seen
