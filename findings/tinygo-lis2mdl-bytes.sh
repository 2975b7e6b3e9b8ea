#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# TinyGo's driver of the LIS2MDL magnetometer takes the two bytes of each axis in the wrong order.
# tinygo.org/x/drivers v0.37.0 (Go), the bus stood in for by a table of registers. ST's data sheet has the low byte at 68h (OUTX_L), the high one at 69h,
# and leaves it so unless BLE of CFG_REG_C is set; the driver clears BLE. Expected: 300 counts (450 mG) are 300. Seen: 11265, and 1 count is 256. A heading of
# 34 degrees is one of 308.
. "$(dirname "$0")/common.sh"
go_modules tinygo.org/x/drivers@v0.37.0
seen='x 300 counts, y 300: read as 11265 11265, compass 45
x 300 counts, y 1: read as 11265 256, compass 1
x 300 counts, y 200: read as 11265 -14336, compass 308
CFG_REG_C: BLE false'
cat >main.go <<'EOF'
package main

import (
	"fmt"
	"tinygo.org/x/drivers/lis2mdl"
)

type bus struct{ registers [256]byte }

func (b *bus) Tx(_ uint16, out, in []byte) error {
	if len(out) > 1 {
		copy(b.registers[out[0]:], out[1:])
	}
	copy(in, b.registers[out[0]:])
	return nil
}

func main() {
	b := &bus{}
	sensor := lis2mdl.New(b)
	sensor.Configure(lis2mdl.Configuration{})
	for _, field := range [][2]int16{{300, 300}, {300, 1}, {300, 200}} {
		for k, counts := range field {
			b.registers[0x68+2*k], b.registers[0x69+2*k] = byte(counts), byte(counts>>8)
		}
		x, y, _ := sensor.ReadMagneticField()
		fmt.Printf("x %d counts, y %d: read as %d %d, compass %d\n", field[0], field[1], x, y, sensor.ReadCompass())
	}
	fmt.Println("CFG_REG_C: BLE", b.registers[0x62]&8 != 0)
}
EOF
go run . | as_seen
