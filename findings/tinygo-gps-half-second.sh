#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# TinyGo's GPS driver makes nanoseconds of the fraction of a second, and has places in steps of 0.4 m.
# tinygo.org/x/drivers v0.37.0 (Go). NMEA's time is hhmmss.ss, a decimal number of seconds. Expected: .50 is half a second, .5 the same; five places
# in steps of 0.1 m are in steps of 0.1 m. Seen: 50 ns and 5 ns, and two places for the five: degrees are 32-bit numbers. A robot at 10 Hz has ten fixes in the
# same moment.
. "$(dirname "$0")/common.sh"
go_modules tinygo.org/x/drivers@v0.37.0
seen='120000.50: 12:00:00.00000005
120000.5: 12:00:00.000000005
120000.900: 12:00:00.0000009
0.1 m apart: 0.00 0.42 0.42 0.42 0.42'
cat >main.go <<'EOF'
package main

import (
	"fmt"
	"tinygo.org/x/drivers/gps"
)

func fix(time, minutes string) gps.Fix {
	parser := gps.NewParser()
	fix, err := parser.Parse("$GPRMC," + time + ",A,48" + minutes + ",N,01130.000000,E,000.0,090.0,011226,,,A*00")
	if err != nil {
		panic(err)
	}
	return fix
}

func main() {
	for _, time := range []string{"120000.50", "120000.5", "120000.900"} {
		fmt.Println(time+":", fix(time, "06.000000").Time.Format("15:04:05.999999999"))
	}
	fmt.Print("0.1 m apart:")
	for k := 0; k < 5; k++ { // 0.000054 minutes are 0.1 m
		fmt.Printf(" %.2f", float64(fix("120000.00", fmt.Sprintf("06.%06d", 54*k)).Latitude-fix("120000.00", "06.000000").Latitude)*111200)
	}
	fmt.Println()
}
EOF
go run . | as_seen
