#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Four libraries take the local zone of NMEA's ZDA with the opposite sign, and two of them make noon UTC 13:00 UTC.
# pynmea2 1.19.0, nmea 0.7.0 (0.8.0 is the same and takes a newer Rust) and nmea-parser 0.10.0, marineapi 0.12.0 (Java). NMEA 0183 has the zone as what is
# added to the local time to have UTC, negative east of Greenwich; its example is 234500 with -12,45 for 12:30 on Chatham Island. (The standard is not free;
# comments of readers of NMEA repeat it. Trimble's manual has the opposite.) Expected: -01 is 13:00+01:00. Seen: 11:00-01:00, a zone of -01:00, and
# 12:00-01:00, which is another moment by either sign: an hour late. Logs of two robots are hours apart.
. "$(dirname "$0")/common.sh"
pip_packages pynmea2==1.19.0
maven_artifacts net.sf.marineapi:marineapi:0.12.0
crates nmea@0.7.0 nmea-parser@0.10.0
seen='pynmea2: 11:00-01:00
nmea: 12:00-01:00
nmea-parser: zone -01:00
marineapi: 12:00-01:00'
sentence='$GPZDA,120000.00,01,12,2026,-01,00*4D'
cat >src/main.rs <<'EOF'
fn main() {
    let sentence = std::env::args().nth(1).unwrap();
    if let Ok(nmea::ParseResult::ZDA(zda)) = nmea::parse_str(&sentence) {
        println!("nmea: {}", zda.local_date_time().unwrap().format("%H:%M%:z"));
    }
    if let Ok(nmea_parser::ParsedMessage::Zda(zda)) = nmea_parser::NmeaParser::new().parse_sentence(&sentence) {
        println!("nmea-parser: zone {}", zda.timezone_local.unwrap());
    }
}
EOF
cat >"$work/Main.java" <<'EOF'
import net.sf.marineapi.nmea.parser.SentenceFactory;
import net.sf.marineapi.nmea.sentence.ZDASentence;
class Main {
  public static void main(String[] arguments) {
    var zda = (ZDASentence) SentenceFactory.getInstance().createParser(arguments[0]);
    System.out.println("marineapi: " + zda.getDate().toISO8601(zda.getTime()).replaceAll(".*T(..:..):00", "$1"));
  }
}
EOF
{
  "$python" -c 'import pynmea2, sys; text = pynmea2.parse(sys.argv[1]).localdatetime.isoformat(); print("pynmea2:", text[11:16] + text[-6:])' "$sentence"
  cargo -q run -- "$sentence"
  "${java[@]}" "$work/Main.java" "$sentence"
} | as_seen
