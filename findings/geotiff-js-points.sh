#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# geotiff.js moves a height map of points by half a cell, against what GDAL reads.
# geotiff 3.0.5 (npm), rasterio 1.4.4. A GeoTIFF says by GTRasterTypeGeoKey whether its tie point is a cell's corner or its middle. Expected: a map that
# GDAL has from 690000 m on is there in geotiff.js. Seen: for "area" it is; for "point" it begins 15 m to the east and south, though pixelIsArea() is false.
# National height models come as points: a robot's height is that of half a cell away.
. "$(dirname "$0")/common.sh"
pip_packages rasterio==1.4.4 numpy==1.26.4
npm_packages geotiff@3.0.5
seen='Area: GDAL 690000 5333000 690120 5333090
Point: GDAL 690000 5333000 690120 5333090
Area: geotiff.js 690000 5333000 690120 5333090, pixelIsArea true
Point: geotiff.js 690015 5332985 690135 5333075, pixelIsArea false'
cd "$work/npm"
{
  "$python" - 2>/dev/null <<'EOF'
import numpy as np, rasterio
from rasterio.transform import from_origin
for kind in ("Area", "Point"):
    form = {"driver": "GTiff", "height": 3, "width": 4, "count": 1, "dtype": "float32", "crs": "EPSG:32632", "transform": from_origin(690000, 5333090, 30, 30)}
    with rasterio.open(f"{kind}.tif", "w", **form) as file:
        file.update_tags(AREA_OR_POINT=kind)
        file.write(np.zeros((1, 3, 4), np.float32))
    with rasterio.open(f"{kind}.tif") as file:
        print(f"{kind}: GDAL", *(f"{edge:.0f}" for edge in file.bounds))
EOF
  node --input-type=module - <<'EOF'
import { fromFile } from "geotiff";
for (const kind of ["Area", "Point"]) {
  const image = await (await fromFile(`${kind}.tif`)).getImage();
  console.log(`${kind}: geotiff.js ${image.getBoundingBox().join(" ")}, pixelIsArea ${image.pixelIsArea()}`);
}
EOF
} | as_seen
