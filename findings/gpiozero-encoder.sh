#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# gpiozero's RotaryEncoder stops counting at 16 and counts four edges as one.
# gpiozero 2.0.1.post3, its own mock pins. Expected: 40 cycles of a wheel's encoder are 160 steps, or 40. Seen: 16, and 3 cycles back are 13; with
# max_steps=0 there are 40. A wheel's odometry ends after a hand's breadth of driving and comes back from there.
. "$(dirname "$0")/common.sh"
pip_packages gpiozero==2.0.1.post3
seen='as it comes: 40 cycles forward 16, then 3 back 13
max_steps=0: 40 cycles forward 40, then 3 back 37'
"$python" - <<'EOF' | as_seen
from gpiozero import Device, RotaryEncoder
from gpiozero.pins.mock import MockFactory
Device.pin_factory = MockFactory()
def turn(first, second, cycles):
    for _ in range(cycles):
        first.drive_low(), second.drive_low(), first.drive_high(), second.drive_high()
for name, pins, options in (("as it comes", (2, 3), {}), ("max_steps=0", (4, 5), {"max_steps": 0})):
    encoder = RotaryEncoder(*pins, **options)
    a, b = (Device.pin_factory.pin(pin) for pin in pins)
    a.drive_high(), b.drive_high()
    turn(a, b, 40)
    forward = encoder.steps
    turn(b, a, 3)
    print(f"{name}: 40 cycles forward {forward}, then 3 back {encoder.steps}")
EOF
