#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# gpxgo has the year 1 for a time with an offset, UTC for one that has a fraction as well, and no fractions.
# github.com/tkrajina/gpxgo v1.4.0 (Go). GPX 1.1's times are xsd:dateTime: an offset and a fraction are valid. Expected: 12:00:00+02:00 is 10:00 UTC, and a quarter
# of a second comes back. Seen: the year 1, without an error; with .5 s 12:00 UTC, two hours late; fractions are neither read nor written. A track at 10 Hz has ten
# places in a moment.
. "$(dirname "$0")/common.sh"
go_modules github.com/tkrajina/gpxgo@v1.4.0
seen='2026-12-01T12:00:00Z: 2026-12-01T12:00:00Z
2026-12-01T12:00:00.250Z: 2026-12-01T12:00:00Z
2026-12-01T12:00:00+02:00: 0001-01-01T00:00:00Z
2026-12-01T12:00:00.5+02:00: 2026-12-01T12:00:00Z
written: <time>2026-12-01T12:00:00Z</time>'
cat >main.go <<'EOF'
package main

import (
	"fmt"
	"github.com/tkrajina/gpxgo/gpx"
	"regexp"
	"time"
)

func main() {
	for _, text := range []string{"2026-12-01T12:00:00Z", "2026-12-01T12:00:00.250Z", "2026-12-01T12:00:00+02:00", "2026-12-01T12:00:00.5+02:00"} {
		track, err := gpx.ParseBytes([]byte(`<gpx version="1.1" creator="robot" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg><trkpt lat="48" lon="11"><time>` +
			text + `</time></trkpt></trkseg></trk></gpx>`))
		if err != nil {
			panic(err)
		}
		fmt.Println(text+":", track.Tracks[0].Segments[0].Points[0].Timestamp.UTC().Format(time.RFC3339Nano))
	}
	track := gpx.GPX{}
	track.AppendPoint(&gpx.GPXPoint{Timestamp: time.Date(2026, 12, 1, 12, 0, 0, 250000000, time.UTC)})
	text, err := track.ToXml(gpx.ToXmlParams{Version: "1.1"})
	if err != nil {
		panic(err)
	}
	fmt.Println("written:", regexp.MustCompile(`<time>.*</time>`).FindString(string(text)))
}
EOF
go run . | as_seen
