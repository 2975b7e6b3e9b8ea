// SPDX-License-Identifier: Apache-2.0
#include "waymark/local_frame.h"

#include <math.h>

// WGS84: semi-major axis and the square of the eccentricity.
#define WGS84_A_M 6378137.0
#define WGS84_E2 6.69437999014e-3

// Earth-centred, earth-fixed: NIMA TR8350.2, equation 4-14.
static void earth_centred(double latitude_rad, double longitude_rad, double height_m, double out_m[3]) {
  const double sine = sin(latitude_rad), across_m = WGS84_A_M / sqrt(1.0 - WGS84_E2 * sine * sine);
  out_m[0] = (across_m + height_m) * cos(latitude_rad) * cos(longitude_rad);
  out_m[1] = (across_m + height_m) * cos(latitude_rad) * sin(longitude_rad);
  out_m[2] = (across_m * (1.0 - WGS84_E2) + height_m) * sine;
}

void local_frame(const double origin[3], const double place[3], double east_north_up_m[3]) {
  const double degree = M_PI / 180.0, latitude = origin[0] * degree, longitude = origin[1] * degree;
  double from[3], to[3], way[3];
  earth_centred(latitude, longitude, origin[2], from);
  earth_centred(place[0] * degree, place[1] * degree, place[2], to);
  for (int i = 0; i < 3; i++) way[i] = to[i] - from[i];
  const double outward_m = cos(longitude) * way[0] + sin(longitude) * way[1];  // away from the earth's axis
  east_north_up_m[0] = cos(longitude) * way[1] - sin(longitude) * way[0];
  east_north_up_m[1] = cos(latitude) * way[2] - sin(latitude) * outward_m;
  east_north_up_m[2] = cos(latitude) * outward_m + sin(latitude) * way[2];
}
