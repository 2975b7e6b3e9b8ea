// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "waymark/event_fields.h"

static wm_status check_number(const char *name, double value, int is_needed, double least, double most, wm_error *err) {
  if (isnan(value) && !is_needed) return WM_OK;
  if (!isfinite(value)) return wm_fail(err, WM_NOT_FINITE, "%s is not a finite number", name);
  if (value >= least && value <= most) return WM_OK;
  return wm_fail(err, WM_OUT_OF_RANGE, "%s: %.10g is outside of what can be (%s%.10g to %.10g)", name, value,
                 least == DBL_MIN ? "above " : "", least == DBL_MIN ? 0.0 : least, most);
}

// other_* of a marker with one pose may be anything.
static int is_unread(const wm_event *event, const wm_event_field *field) {
  return event->kind == WM_EVENT_MARKER && event->as.marker.poses != 2 && strncmp(field->name, "other_", 6) == 0;
}

static wm_status check_fields(const wm_event *event, wm_error *err) {
  size_t count;
  wm_status status = WM_OK;
  const wm_event_field *field = wm_event_fields(event->kind, &count);
  for (const wm_event_field *end = field + count; status == WM_OK && field < end; field++) {
    if (field->type != WM_FIELD_F64 || is_unread(event, field)) continue;
    for (size_t i = 0; status == WM_OK && i < field->count; i++) {
      double value;
      memcpy(&value, (const char *)event + field->offset + i * sizeof value, sizeof value);
      status = check_number(field->name, value, i < field->needed, field->least, field->most, err);
    }
  }
  return status;
}

double wm_quantity_most(unsigned quantity) {
  switch (quantity) {
    case WM_Q_WHEEL_TICKS_LEFT:
    case WM_Q_WHEEL_TICKS_RIGHT: return 1e15;  // doubles still count singly there
    case WM_Q_ROLL_RATE:
    case WM_Q_PITCH_RATE:
    case WM_Q_YAW_RATE: return WM_RATE_MOST_RADPS;
    case WM_Q_ACCELERATION_X:
    case WM_Q_ACCELERATION_Y:
    case WM_Q_ACCELERATION_Z: return WM_ACCELERATION_MOST_MPS2;
    case WM_Q_STEERING_WHEEL:
    case WM_Q_ROAD_WHEEL: return 200.0;        // rad, of a steering wheel: 32 turns
    case WM_Q_STEERING_ACTUATOR: return 10.0;  // m
    case WM_Q_GEAR: return 1.0;
    default: return WM_SPEED_MOST_MPS;
  }
}

static wm_status check_quantities(const wm_quantities *q, wm_error *err) {
  wm_status status = WM_OK;
  if (q->count > WM_QUANTITIES_MAX)
    return wm_fail(err, WM_BAD_DATA, "%u quantities; an event has %d at most", q->count, WM_QUANTITIES_MAX);
  for (size_t i = 0; status == WM_OK && i < q->count; i++) {
    if (q->id[i] >= WM_Q_COUNT) return wm_fail(err, WM_BAD_DATA, "%u is not a quantity", q->id[i]);
    const double most = wm_quantity_most(q->id[i]);
    status = check_number(wm_quantity_name(q->id[i]), q->value[i], 1, -most, most, err);
  }
  return status;
}

static wm_status check_points(const wm_points *p, wm_error *err) {
  wm_status status = WM_OK;
  if (p->count > WM_POINTS_MAX)
    return wm_fail(err, WM_BAD_DATA, "%u points; an event has %d at most", p->count, WM_POINTS_MAX);
  for (size_t i = 0; status == WM_OK && i < p->count; i++) {
    status = check_number("x_m", (double)p->x_m[i], 1, WM_PLACE_LIMITS, err);
    if (status == WM_OK) status = check_number("y_m", (double)p->y_m[i], 1, WM_PLACE_LIMITS, err);
    if (status == WM_OK) status = check_number("normal_rad", (double)p->normal_rad[i], 0, WM_ANGLE_LIMITS, err);
    if (status == WM_OK) status = check_number("sigma_m", (double)p->sigma_m[i], 0, WM_SIGMA_LIMITS, err);
  }
  return status;
}

wm_status wm_event_check(const wm_event *event, wm_error *err) {
  if (event->kind == WM_EVENT_NONE || event->kind >= WM_EVENT_KIND_COUNT)
    return wm_fail(err, WM_BAD_DATA, "%u is not a kind of event", event->kind);
  if (event->kind == WM_EVENT_QUANTITIES) return check_quantities(&event->as.quantities, err);
  if (event->kind == WM_EVENT_POINTS) return check_points(&event->as.points, err);
  if (event->kind == WM_EVENT_SIGHTING && isnan(event->as.sighting.bearing_rad) && isnan(event->as.sighting.range_m))
    return wm_fail(err, WM_BAD_DATA, "bearing_rad and range_m are both absent");
  if (event->kind == WM_EVENT_INCREMENT && event->as.increment.from_ns >= event->t_ns)
    return wm_fail(err, WM_BAD_DATA, "from_ns is not before t_ns");
  if (event->kind == WM_EVENT_MARKER && event->as.marker.poses != 1 && event->as.marker.poses != 2)
    return wm_fail(err, WM_BAD_DATA, "%u poses; a marker has 1, or 2 that look alike", event->as.marker.poses);
  wm_status status = check_fields(event, err);
  if (status != WM_OK || event->kind != WM_EVENT_SET_POSE) return status;
  const double *q = event->as.set_pose.pose_map_base.q_xyzw;
  const double norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return fabs(norm - 1.0) <= WM_UNIT_NORM
             ? WM_OK
             : wm_fail(err, WM_OUT_OF_RANGE, "q_xyzw: its length is %.4g, of a rotation it is 1", sqrt(norm));
}
