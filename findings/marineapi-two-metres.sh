#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# marineapi writes places to 2 m, speeds to 0.05 m/s, and 60 seconds or minutes.
# net.sf.marineapi:marineapi 0.12.0 (Java). Expected: a place in an RMC is written as finely as receivers do (to 1 cm or less), a second is below 60. Seen:
# minutes to three digits, so that a robot which creeps 1 m stands; 4860.000 is 49 degrees; 59.9996 s are 60.000. The date with its time loses the half
# second, too.
. "$(dirname "$0")/common.sh"
maven_artifacts net.sf.marineapi:marineapi:0.12.0
seen='48.1000000: $GPRMC,010259.000,,4806.000,N,01130.000,E,0.1,360.0,,,,*6C
48.1000080: $GPRMC,010259.000,,4806.000,N,01130.000,E,0.1,360.0,,,,*6C
48.9999999: $GPRMC,010260.000,,4860.000,N,01130.000,E,0.1,360.0,,,,*66
120000.50: 2026-12-01T12:00:00+00:00'
cat >"$work/Main.java" <<'EOF'
import net.sf.marineapi.nmea.parser.SentenceFactory;
import net.sf.marineapi.nmea.sentence.*;
import net.sf.marineapi.nmea.util.*;
class Main {
  public static void main(String[] arguments) {
    var factory = SentenceFactory.getInstance();
    for (double latitude : new double[] {48.1, 48.100008, 48.9999999}) {
      var rmc = (RMCSentence) factory.createParser(TalkerId.GP, "RMC");
      rmc.setPosition(new Position(latitude, 11.5));
      rmc.setTime(new Time(1, 2, latitude < 48.5 ? 59 : 59.9996));
      rmc.setSpeed(0.14); // knots
      rmc.setCourse(359.96);
      System.out.printf("%.7f: %s%n", latitude, rmc.toSentence());
    }
    var rmc = (RMCSentence) factory.createParser("$GPRMC,120000.50,A,4806.000,N,01130.000,E,000.0,090.0,011226,,,A");
    System.out.println("120000.50: " + rmc.getDate().toISO8601(rmc.getTime()));
  }
}
EOF
"${java[@]}" "$work/Main.java" | as_seen
