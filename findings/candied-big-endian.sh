#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# candied has no number, or any, for big-endian signals of a DBC, and integers for its floating-point ones.
# candied 2.2.0 (npm), cantools 41.0.0. Expected: what cantools has: -100, -100, -100, 1.5. Seen: -100, NaN, -199, 1069547520. Little-endian integers are right, so that half a bus seems to
# work, and a wheel of the other half has a speed that was never sent.
. "$(dirname "$0")/common.sh"
pip_packages cantools==41.0.0
npm_packages candied@2.2.0
seen='cantools: little -100, first -100, big -100, real 1.5
candied: little -100, first NaN, big -199, real 1069547520'
cd "$work/npm"
cat >robot.dbc <<'EOF'
VERSION ""
BU_: robot
BO_ 256 wheels: 8 robot
 SG_ little : 0|16@1- (1,0) [0|0] "" robot
BO_ 257 others: 8 robot
 SG_ first : 7|16@0- (1,0) [0|0] "" robot
 SG_ big : 23|16@0- (1,0) [0|0] "" robot
 SG_ real : 32|32@1- (1,0) [0|0] "" robot
SIG_VALTYPE_ 257 real : 1;
EOF
{
  "$python" - <<'EOF'
import cantools, struct
bus = cantools.database.load_file("robot.dbc")
values = {**bus.decode_message(256, struct.pack("<h", -100) + bytes(6)), **bus.decode_message(257, struct.pack(">hh", -100, -100) + struct.pack("<f", 1.5))}
print("cantools:", ", ".join(f"{name} {value}" for name, value in values.items()))
EOF
  node - <<'EOF'
const { Can, Dbc } = require("candied");
const can = new Can(), little = Buffer.alloc(8), others = Buffer.alloc(8);
little.writeInt16LE(-100, 0);
others.writeInt16BE(-100, 0);
others.writeInt16BE(-100, 2);
others.writeFloatLE(1.5, 4);
can.database = new Dbc().load(require("fs").readFileSync("robot.dbc", "utf8"));
const signals = [[256, little], [257, others]].flatMap(([id, data]) => [...can.decode(can.createFrame(id, [...data])).boundSignals]);
console.log("candied:", signals.map(([name, { value }]) => `${name} ${value}`).join(", "));
EOF
} | as_seen
