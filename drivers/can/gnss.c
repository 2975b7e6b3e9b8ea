// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "waymark/can.h"

// WGS84: semi-major axis and the square of the eccentricity.
#define WGS84_A_M 6378137.0
#define WGS84_E2 6.69437999014e-3
#define SIGMA_M 5.0  // of a receiver without a stated accuracy: a common figure of data sheets
#define DEGREE (M_PI / 180.0)

enum { LATITUDE, LONGITUDE, ALTITUDE, XY, Z, VALID, ALTITUDE_VALID };

static const char *const kNames[] = {"gnss_latitude", "gnss_longitude", "gnss_altitude",      "gnss_sigma_xy",
                                     "gnss_sigma_z",  "gnss_valid",     "gnss_altitude_valid"};

const char *wm_can_quantity_name(unsigned quantity) {
  return quantity >= WM_CAN_LATITUDE && quantity < WM_CAN_COUNT ? kNames[quantity - WM_CAN_LATITUDE]
                                                                : wm_quantity_name(quantity);
}

void wm_can_gnss_init(wm_can_gnss *self, const double origin[3]) {
  *self = (wm_can_gnss){.origin = {origin[0] * DEGREE, origin[1] * DEGREE, origin[2]},
                        .level_m = isnan(origin[2]) ? 0.0 : origin[2]};
  for (size_t i = 0; i < sizeof self->value / sizeof self->value[0]; i++) self->value[i] = (double)NAN;
}

// A receiver without a fix gives no position, or 0 and 0.
static int is_fix(const double *value) {
  if (value[VALID] == 0.0 || (value[LATITUDE] == 0.0 && value[LONGITUDE] == 0.0)) return 0;
  return fabs(value[LATITUDE]) < 0.5 * M_PI && fabs(value[LONGITUDE]) <= M_PI;
}

int wm_can_gnss_take(wm_can_gnss *self, const wm_quantities *values, wm_position *out) {
  const uint32_t needed = 1u << LATITUDE | 1u << LONGITUDE;
  double *value = self->value;
  for (uint8_t i = 0; i < values->count; i++) {
    if (values->id[i] < WM_CAN_LATITUDE || values->id[i] >= WM_CAN_COUNT) continue;
    const int which = values->id[i] - WM_CAN_LATITUDE;
    value[which] = values->value[i];
    self->fresh |= 1u << which;
  }
  if ((self->fresh & needed) != needed) return 0;
  self->fresh = 0;
  if (!is_fix(value)) return 0;
  double *origin = self->origin;
  if (isnan(origin[LATITUDE])) memcpy(origin, value, 2 * sizeof *origin);
  const double altitude_m = value[ALTITUDE_VALID] == 0.0 ? (double)NAN : value[ALTITUDE];
  if (isnan(origin[ALTITUDE])) origin[ALTITUDE] = altitude_m;
  const double sine = sin(origin[LATITUDE]), w = 1.0 - WGS84_E2 * sine * sine;
  const double across_m = WGS84_A_M / sqrt(w) + self->level_m,
               along_m = WGS84_A_M * (1.0 - WGS84_E2) / (w * sqrt(w)) + self->level_m;
  const double turn = remainder(value[LONGITUDE] - origin[LONGITUDE], 2.0 * M_PI);
  out->p_m[0] = across_m * cos(origin[LATITUDE]) * turn;
  out->p_m[1] = along_m * (value[LATITUDE] - origin[LATITUDE]);
  out->p_m[2] = altitude_m - origin[ALTITUDE];
  out->sigma_xy_m = value[XY] > 0.0 ? value[XY] : SIGMA_M;
  out->sigma_z_m = isnan(altitude_m) ? (double)NAN : value[Z] > 0.0 ? value[Z] : 2.0 * out->sigma_xy_m;
  return 1;
}

wm_status wm_can_event(wm_can_decoder *self, wm_can_part part, wm_can_gnss *gnss, const wm_can_frame *frame,
                       wm_event *out, wm_source_counts *counts, wm_error *err) {
  wm_quantities values;
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  wm_status status = wm_can_decode(self, frame, &values, counts, err);
  if (status != WM_OK) return status;  // counted by the decoder
  out->kind = part == WM_CAN_GNSS ? WM_EVENT_POSITION : WM_EVENT_QUANTITIES;
  out->t_ns = frame->t_ns;
  if (part == WM_CAN_GNSS) return wm_can_gnss_take(gnss, &values, &out->as.position) ? WM_OK : WM_AGAIN;
  out->as.quantities = values;
  return WM_OK;
}
