# SPDX-License-Identifier: Apache-2.0
"""Places on the earth."""

import math

import mgrs
import numpy as np
import pymap3d
import pyproj
import utm
from geographiclib.geodesic import Geodesic

PROJ, UTM, MAP3D = f"pyproj {pyproj.__version__}, PROJ {pyproj.proj_version_str}", "utm 0.9.0", "pymap3d 3.2.0"
METRES_A_DEGREE = 111194.0  # of latitude, near enough for tenths of metres


def rows():
    plane = "metres in the plane that touches the ellipsoid at `gnss.origin`, east-north-up; no grid"
    t = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32632")
    east, north = t.transform(48.1, 11.5)
    yield "pyproj EPSG:4326: order of its arguments", "latitude, longitude" if 5e6 < north < 6e6 else "longitude, latitude", PROJ, "`origin: [latitude, longitude, altitude]`"
    grid, ground = utm.from_latlon(48, 9, 32)[1] - utm.from_latlon(47, 9, 32)[1], Geodesic.WGS84.Inverse(47, 9, 48, 9)["s12"]
    yield "UTM on its middle meridian: 1 km on the ground", f"{1000 * grid / ground:.1f} m in the grid", UTM, plane
    a, b = utm.from_latlon(48.0, 11.5), utm.from_latlon(48.01, 11.5)
    yield "UTM at 48 N, 2.5 degrees off that meridian: direction of true north", f"{math.degrees(math.atan2(b[0] - a[0], b[1] - a[1])):.2f} degrees from the grid's", UTM, plane
    east, _, zone, _ = utm.from_latlon(np.array([48.0, 48.0]), np.array([11.99, 12.01]))
    yield "utm.from_latlon of an array across a zone's border", f"one zone: {zone} for both", UTM, "no zones"
    proj = pyproj.Proj(proj="utm", zone=32, ellps="WGS84")
    for degrees in (3, 12):
        yield f"utm against PROJ, {degrees} degrees off the middle meridian", f"{abs(utm.from_latlon(48.0, 9.0 + degrees, 32)[0] - proj(9.0 + degrees, 48.0)[0]):.3f} m", UTM, "no series: earth-centred coordinates"
    yield "utm: the zone of 60 N, 5 E, where Norway's is wider", f"{utm.from_latlon(60.0, 5.0)[2]}; the formula for all others gives 31", UTM, "no zones"
    m = mgrs.MGRS()
    back = m.toLatLon(m.toMGRS(48.117312, 11.516678))
    yield "mgrs: a place to a metre and back", f"{abs(back[0] - 48.117312) * METRES_A_DEGREE:.1f} m north, {abs(back[1] - 11.516678) * METRES_A_DEGREE * math.cos(math.radians(48)):.1f} m east", "mgrs 1.6.0", "not read"
    t = pyproj.Transformer.from_crs("EPSG:4326+5773", "EPSG:4979", always_xy=True)
    yield "pyproj: 545.4 m above EGM96 as a height above the ellipsoid, without the grid", f"{t.transform(11.5, 48.1, 545.4)[2]:.1f} m, without a warning", PROJ, "heights above the ellipsoid where gpsd has them (`altHAE`)"
    t = pyproj.Transformer.from_crs("EPSG:4258", "EPSG:4326", always_xy=True)
    yield "pyproj: ETRS89 to WGS84", "no change: the plates' drift since 1989 is left out" if t.transform(11.5, 48.1) == (11.5, 48.1) else "changes", PROJ, "corrections of one reference only: the base's is the map's"
    _, back_azimuth, _ = pyproj.Geod(ellps="WGS84").inv(11, 48, 12, 49)
    azi2 = Geodesic.WGS84.Inverse(48, 11, 49, 12)["azi2"]
    yield "pyproj Geod.inv's third azimuth against geographiclib's azi2", f"{abs(back_azimuth - azi2):.0f} degrees apart", f"{PROJ}, geographiclib 2.1", "-"
    worst = max(abs(pymap3d.ecef2geodetic(*pymap3d.geodetic2ecef(lat, 20, h))[2] - h) for lat in (-80, -45, 0, 30, 89) for h in (-5000, -100, 0, 10000))
    yield "pymap3d ecef2geodetic: worst height from -5 km to 10 km", f"{worst:.0e} m", MAP3D, "-"
    enu = pymap3d.geodetic2enu(49.1, 12.5, 500, 48.1, 11.5, 500)
    yield "pymap3d geodetic2enu of 49.1 N, 12.5 E from 48.1 N, 11.5 E: up", f"{enu[2]:.1f} m: the earth curves away", MAP3D, "the same: up -1396.1 m"
    ned = pymap3d.geodetic2ned(48.001, 11.501, 600, 48, 11.5, 500)
    yield "pymap3d geodetic2ned of a place 100 m higher: third number", f"{ned[2]:.0f}", MAP3D, "z is up"
    yield "pymap3d enu2aer of a place to the east: azimuth", f"{pymap3d.enu2aer(1, 0, 0)[0]:.0f}, clockwise from north", MAP3D, "headings are counter-clockwise from east"
