// SPDX-License-Identifier: Apache-2.0
// Positions by latitude and longitude (WGS84) in metres east, north and up of an origin: the tangent plane there, exact
// at any distance.
#ifndef WAYMARK_LOCAL_FRAME_H
#define WAYMARK_LOCAL_FRAME_H

#ifdef __cplusplus
extern "C" {
#endif

// Degrees, degrees, metres above the ellipsoid.
void local_frame(const double origin[3], const double place[3], double east_north_up_m[3]);

#ifdef __cplusplus
}
#endif

#endif
