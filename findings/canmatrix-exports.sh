#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# canmatrix writes a factor of 0.01 as 0.0 into ARXML, and a floating-point signal as an integer into SYM.
# canmatrix 1.3.3. Expected: a frame has the same values by the DBC and by what it is converted to. Seen: its ARXML, which its README calls basic, has
# factors of one decimal, so that 0.25 is 0.2 and 0.01 is 0.0, which is read as 1, and no sign; SYM's signal of 1.5 is 1069547520. KCD and JSON are right. A
# wheel that turns backwards at 0.43 m/s is at 65493 m/s.
. "$(dirname "$0")/common.sh"
pip_packages canmatrix==1.3.3 lxml==6.1.3
seen='dbc: wheel -0.43, steering -2.5, range 1.5
kcd: wheel -0.43, steering -2.5, range 1.5
json: wheel -0.43, steering -2.5, range 1.5
arxml: wheel 65493, steering 13105.2, range 1.5
sym: wheel -0.43, steering -2.5, range 1069547520
factors in the ARXML: 0.0 0.2 1.0'
cd "$work"
cat >robot.dbc <<'EOF'
VERSION ""
NS_ :
BS_:
BU_: base
BO_ 256 motion: 8 base
 SG_ wheel : 0|16@1- (0.01,0) [-327.68|327.67] "m/s" base
 SG_ steering : 16|16@1- (0.25,0) [-8192|8191.75] "deg" base
 SG_ range : 32|32@1- (1,0) [0|100] "m" base
SIG_VALTYPE_ 256 range : 1;
EOF
"$python" - 2>/dev/null <<'EOF' | as_seen
import re, struct
import canmatrix.formats
frame = struct.pack("<hhf", -43, -10, 1.5)
matrix = canmatrix.formats.loadp_flat("robot.dbc")
for kind in ("dbc", "kcd", "json", "arxml", "sym"):
    if kind != "dbc":
        canmatrix.formats.dumpp({"": matrix}, f"robot.{kind}")
    values = canmatrix.formats.loadp_flat(f"robot.{kind}").frames[0].decode(frame)
    print(f"{kind}: " + ", ".join(f"{name} {float(values[name].phys_value):.10g}" for name in ("wheel", "steering", "range")))
print("factors in the ARXML:", *re.findall(r"<COMPU-NUMERATOR>\s*<V>0.0</V>\s*<V>([^<]*)</V>", open("robot.arxml").read()))
EOF
