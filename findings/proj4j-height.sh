#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proj4J takes no height on the way in: 500 m are no number, or as 0 m.
# org.locationtech.proj4j:proj4j 1.3.0 (Java), pyproj 3.7.2. Expected: a place of 500 m keeps them in UTM, and in a datum with a shift of seven parameters
# they are changed by some 50 m, as PROJ does it. Seen: NaN; and -52 m, the same as for a place of 0 m. A drone flies 500 m lower. 1.4.1 is right.
. "$(dirname "$0")/common.sh"
pip_packages pyproj==3.7.2
maven_artifacts org.locationtech.proj4j:proj4j:1.3.0
seen='Proj4J, UTM: 0 m is NaN, 500 m is NaN
Proj4J, Gauss-Krueger: 0 m is -52.1, 500 m is -52.1
PROJ, UTM: 0 m is 0.0, 500 m is 500.0
PROJ, Gauss-Krueger: 0 m is -52.1, 500 m is 447.9'
cat >"$work/systems" <<'EOF'
UTM:+proj=utm +zone=32 +datum=WGS84
Gauss-Krueger:+proj=tmerc +lat_0=0 +lon_0=12 +k=1 +x_0=4500000 +y_0=0 +ellps=bessel +towgs84=598.1,73.7,418.2,0.202,0.045,-2.455,6.7 +units=m
EOF
cat >"$work/Main.java" <<'EOF'
import java.nio.file.*;
import org.locationtech.proj4j.*;
class Main {
  public static void main(String[] arguments) throws Exception {
    var systems = new CRSFactory();
    var from = systems.createFromParameters("WGS 84", "+proj=longlat +datum=WGS84 +no_defs");
    for (String line : Files.readAllLines(Path.of(arguments[0]))) {
      String[] parts = line.split(":", 2);
      var way = new CoordinateTransformFactory().createTransform(from, systems.createFromParameters(parts[0], parts[1]));
      double[] heights = {0, 500};
      for (int k = 0; k < 2; k++) heights[k] = way.transform(new ProjCoordinate(11.5, 48.1, heights[k]), new ProjCoordinate()).z;
      System.out.printf("Proj4J, %s: 0 m is %.1f, 500 m is %.1f%n", parts[0], heights[0], heights[1]);
    }
  }
}
EOF
{
  "${java[@]}" "$work/Main.java" "$work/systems"
  "$python" - "$work/systems" <<'EOF'
import sys, warnings
from pyproj import CRS, Transformer
warnings.simplefilter("ignore")
for line in open(sys.argv[1]):
    name, system = line.strip().split(":", 1)
    way = Transformer.from_pipeline(f"+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad "
        + ("" if name == "UTM" else "+step +proj=cart +ellps=WGS84 +step +inv +proj=helmert +x=598.1 +y=73.7 +z=418.2 +rx=0.202 +ry=0.045 +rz=-2.455 +s=6.7 "
           "+convention=position_vector +step +inv +proj=cart +ellps=bessel ") + "+step " + system.split(" +towgs84")[0].split(" +units")[0])
    print(f"PROJ, {name}: " + ", ".join("{} m is {:.1f}".format(height, way.transform(11.5, 48.1, height)[2]) for height in (0, 500)))
EOF
} | as_seen
