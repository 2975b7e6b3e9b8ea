#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# TinyGo's driver of the MPU-6050 leaves the ranges at 2 g and 250 degrees/s when others are set.
# tinygo.org/x/drivers v0.37.0 (Go), the bus stood in for by a table of registers. The ranges are bits 4 and 3 of registers 1Bh and 1Ch. Expected: after
# SetFullScaleAccelRange(AFS_RANGE_8G) and SetFullScaleGyroRange(FS_RANGE_1000) 5 g are 5 g and 400 degrees/s are 400. Seen: 2 g and 250, as before: the numbers are written to
# bits 1 and 0. Moved by three bits they are set, and the scales stay: 5 g are 1.25 g. A robot that spins turns less than it does.
. "$(dirname "$0")/common.sh"
go_modules tinygo.org/x/drivers@v0.37.0
seen='as it comes: 5 g are 2.00 g, 400 degrees/s are 250
8 g and 1000 degrees/s: 5 g are 2.00 g, 400 degrees/s are 250
the same moved by three bits: 5 g are 1.25 g, 400 degrees/s are 100'
cat >main.go <<'EOF'
package main

import (
	"fmt"
	"tinygo.org/x/drivers/mpu6050"
)

type bus struct{ registers [256]byte }

func (b *bus) Tx(_ uint16, out, in []byte) error {
	if len(out) > 1 {
		copy(b.registers[out[0]:], out[1:])
	}
	copy(in, b.registers[out[0]:])
	return nil
}

// What the chip gives for a part of its smallest range, in the range that its configuration has.
func (b *bus) measure(configuration, register int, part float64) {
	counts := part * 32768 / float64(int(1)<<(b.registers[configuration]>>3&3))
	if counts > 32767 {
		counts = 32767
	}
	b.registers[register], b.registers[register+1] = byte(int(counts)>>8), byte(int(counts))
}

func show(name string, b *bus, sensor mpu6050.Device) {
	b.measure(0x1C, 0x3B, 5.0/2)
	b.measure(0x1B, 0x43, 400.0/250)
	x, _, _ := sensor.ReadAcceleration()
	rate, _, _ := sensor.ReadRotation()
	fmt.Printf("%s: 5 g are %.2f g, 400 degrees/s are %.0f\n", name, float64(x)/1e6, float64(rate)/1e6)
}

func main() {
	b := &bus{}
	sensor := mpu6050.New(b)
	sensor.Configure()
	show("as it comes", b, sensor)
	sensor.SetFullScaleAccelRange(mpu6050.AFS_RANGE_8G)
	sensor.SetFullScaleGyroRange(mpu6050.FS_RANGE_1000)
	show("8 g and 1000 degrees/s", b, sensor)
	sensor.SetFullScaleAccelRange(mpu6050.AFS_RANGE_8G << 3)
	sensor.SetFullScaleGyroRange(mpu6050.FS_RANGE_1000 << 3)
	show("the same moved by three bits", b, sensor)
}
EOF
go run . | as_seen
