#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# loaders.gl takes half a double for a point of a PCD, and red for blue.
# @loaders.gl/pcd 4.4.2 with @loaders.gl/core 4.4.2 (npm), pypcd4 1.5.1. PCD's description: the size of a field is 1, 2, 4 or 8 bytes, rgb has red in bits 16 to 23. Expected: the points
# that pypcd4 has, and 255 128 0 for the colour FF8000. Seen: 2, 0, 0 for 690000, 5333000, 500, without an error, and 0 128 255. A map in UTM, which needs doubles, is gone.
. "$(dirname "$0")/common.sh"
pip_packages pypcd4==1.5.1
npm_packages @loaders.gl/pcd@4.4.2 @loaders.gl/core@4.4.2 @math.gl/types@4.1.0
seen='floats.pcd pypcd4: 1.000 2.000 3.000; pypcd4: 4.000 5.000 6.000;
doubles.pcd pypcd4: 690000.125 5333000.250 500.000; pypcd4: 690001.000 5333001.000 501.000;
floats.pcd loaders.gl: POSITION 1 2 3 4 5 6
floats.pcd loaders.gl: COLOR_0 0 128 255 255 0 0
doubles.pcd loaders.gl: POSITION 2 2.524354896707238e-29 0 0 2 0'
cd "$work/npm"
{
  "$python" - <<'EOF'
import struct
from pypcd4 import PointCloud
def write(name, fields, sizes, types, body):
    head = f"VERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {' '.join('1' for _ in fields.split())}\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA binary\n"
    open(name, "wb").write(head.encode() + body)
    print(name, *(f"pypcd4: {' '.join(f'{value:.3f}' for value in point)};" for point in PointCloud.from_path(name).numpy(("x", "y", "z")).tolist()))
write("floats.pcd", "x y z rgb", "4 4 4 4", "F F F U", struct.pack("<fffIfffI", 1, 2, 3, 0xFF8000, 4, 5, 6, 0xFF))
write("doubles.pcd", "x y z", "8 8 8", "F F F", struct.pack("<6d", 690000.125, 5333000.25, 500, 690001, 5333001, 501))
EOF
  node --input-type=module - <<'EOF'
import { readFileSync } from "fs";
import { parse } from "@loaders.gl/core";
import { PCDLoader } from "@loaders.gl/pcd";
for (const name of ["floats.pcd", "doubles.pcd"]) {
  const bytes = readFileSync(name);
  const { attributes } = await parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), PCDLoader, { worker: false });
  for (const [key, { value }] of Object.entries(attributes)) console.log(`${name} loaders.gl: ${key} ${value.join(" ")}`);
}
EOF
} | as_seen
