#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The distance of two places in nav-types has the heights added to the way over ground: 30 m to the north and 40 m up are 70 m.
# nav-types 0.5.2 (Rust). Its text names the formula of half the angle (haversine), and no height. Expected: 50 m, as the vector between the same places has
# it, or 30 m over ground. Seen: 70.0 m. A drone above its landing place is farther off the more it is aside.
. "$(dirname "$0")/common.sh"
crates nav-types@0.5.2
seen='30 m north, 0 m up: the vector is 30.0 m, distance 30.0 m
30 m north, 40 m up: the vector is 50.0 m, distance 70.0 m
0 m north, 40 m up: the vector is 40.0 m, distance 40.0 m'
cat >src/main.rs <<'EOF'
use nav_types::{ENU, WGS84};
fn main() {
    let here = WGS84::from_degrees_and_meters(48.0, 11.0, 500.0);
    for (north, up) in [(30.0, 0.0), (30.0, 40.0), (0.0, 40.0)] {
        let there: WGS84<f64> = here + ENU::new(0.0, north, up);
        let vector: ENU<f64> = there - here;
        println!("{north} m north, {up} m up: the vector is {:.1} m, distance {:.1} m", vector.norm(), here.distance(&there));
    }
}
EOF
cargo -q run | as_seen
