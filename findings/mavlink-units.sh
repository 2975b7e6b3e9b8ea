#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Two sources of MAVLink's definition "common" agree in every byte of the messages, and not in what their numbers mean.
# pymavlink 2.4.50, mavlink-mappings 1.0.22-20260311 (npm). Expected: the same units. Seen: of 1729 fields 12 differ: RAW_IMU in mG and mrad/s
# against none (its text: "true raw values without any scaling"), OPTICAL_FLOW.flow_x in rad/s against dpix. A program that takes units from
# the definition turns a robot by counts of its converter, or by pixels.
. "$(dirname "$0")/common.sh"
pip_packages pymavlink==2.4.50
npm_packages mavlink-mappings@1.0.22-20260311
seen='equal CRCs: True
OPTICAL_FLOW flow_x: rad/s, dpix
RAW_IMU xacc: mG, none
RAW_IMU zgyro: mrad/s, none
SCALED_IMU zgyro: mrad/s, mrad/s'
cd "$work/npm"
node -e '
const { common, minimal } = require("mavlink-mappings"), out = {}
for (const library of [minimal, common]) for (const message of Object.values(library))
  if (message && message.MSG_NAME && message.FIELDS)
    out[message.MSG_NAME] = [message.MAGIC_NUMBER, Object.fromEntries(message.FIELDS.map(field => [field.source, field.units]))]
console.log(JSON.stringify(out))' >"$work/units.json"
"$python" - "$work/units.json" <<'EOT' | as_seen
import json, sys
from pymavlink.dialects.v20 import common
other = json.load(open(sys.argv[1]))
kinds = {kind.msgname: kind for name, kind in vars(common).items() if name.startswith("MAVLink_") and getattr(kind, "msgname", None) in other}
print("equal CRCs:", len(kinds) > 100 and all(kind.crc_extra == other[name][0] for name, kind in kinds.items()))
for message, field in (("OPTICAL_FLOW", "flow_x"), ("RAW_IMU", "xacc"), ("RAW_IMU", "zgyro"), ("SCALED_IMU", "zgyro")):
    print(f"{message} {field}: {kinds[message].fieldunits_by_name.get(field) or 'none'}, {other[message][1][field] or 'none'}")
EOT
