// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "waymark/can.h"
#include "waymark/local_frame.h"

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
  *self = (wm_can_gnss){.level_m = isnan(origin[2]) ? 0.0 : origin[2]};
  memcpy(self->origin, origin, sizeof self->origin);
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
  const double latitude = value[LATITUDE] / DEGREE, longitude = value[LONGITUDE] / DEGREE;
  const double altitude_m = value[ALTITUDE_VALID] == 0.0 ? (double)NAN : value[ALTITUDE];
  if (isnan(origin[LATITUDE])) {
    origin[LATITUDE] = latitude;
    origin[LONGITUDE] = longitude;
  }
  if (isnan(origin[ALTITUDE])) origin[ALTITUDE] = altitude_m;
  const double above_m = isnan(altitude_m) ? 0.0 : altitude_m - origin[ALTITUDE];
  local_frame((const double[3]){origin[LATITUDE], origin[LONGITUDE], self->level_m},
              (const double[3]){latitude, longitude, self->level_m + above_m}, out->p_m);
  if (isnan(altitude_m)) out->p_m[2] = (double)NAN;
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
