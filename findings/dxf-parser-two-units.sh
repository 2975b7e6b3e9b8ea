#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# dxf-parser gives an arc's angles in radians and a text's or a block's in degrees, of a file that has degrees for all.
# dxf-parser 1.1.2 (npm). Expected: one unit. Seen: 90 degrees are 1.571 in an ARC, and 90 in a TEXT and an INSERT. Doors, which are arcs in a plan, become
# slits where the reader takes the unit from the blocks; or blocks are turned by 90 radians.
. "$(dirname "$0")/common.sh"
npm_packages dxf-parser@1.1.2
seen='ARC: startAngle 1.571
TEXT: rotation 90.000
INSERT: rotation 90.000'
cd "$work/npm"
node - <<'EOF' | as_seen
const DxfParser = require("dxf-parser");
const drawing = `0 SECTION 2 ENTITIES
0 ARC 8 0 10 5.0 20 2.0 40 1.0 50 90.0 51 180.0
0 TEXT 8 0 10 1.0 20 2.0 40 1.0 1 A 50 90.0
0 INSERT 8 0 2 B 10 1.0 20 2.0 50 90.0
0 ENDSEC 0 EOF`;
for (const e of new DxfParser().parseSync(drawing.split(/\s+/).join("\n") + "\n").entities)
  console.log(`${e.type}: ${e.type === "ARC" ? "startAngle " + e.startAngle.toFixed(3) : "rotation " + e.rotation.toFixed(3)}`);
EOF
