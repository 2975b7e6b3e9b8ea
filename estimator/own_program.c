// SPDX-License-Identifier: Apache-2.0
#include "waymark/own_program.h"

#include <math.h>
#include <string.h>

static const wm_param *find(const wm_param_table *table, const char *key) {
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, key) == 0) return &table->params[i];
  return NULL;
}

static void write_whole(const wm_param *p, void *params, int32_t value) {
  memcpy((char *)params + p->offset, &value, sizeof value);
}

const char *wm_params_set(const wm_param_table *table, void *params, const char *key, double value) {
  const wm_param *p = find(table, key);
  if (!p) return "there is no parameter of this key";
  if (!(value >= p->min && value <= p->max)) return "the value is outside of the parameter's range";
  if (p->type == WM_PARAM_F64) {
    memcpy((char *)params + p->offset, &value, sizeof value);
    return NULL;
  }
  if (value < INT32_MIN || value > INT32_MAX || floor(value) < value) return "the parameter is a whole number";
  write_whole(p, params, (int32_t)value);
  return NULL;
}

const char *wm_params_set_name(const wm_param_table *table, void *params, const char *key, const char *name) {
  const wm_param *p = find(table, key);
  if (!p) return "there is no parameter of this key";
  if (p->type != WM_PARAM_ENUM) return "the parameter is a number";
  for (int32_t i = 0; p->names[i]; i++) {
    if (strcmp(p->names[i], name) != 0) continue;
    write_whole(p, params, i);
    return NULL;
  }
  return "the parameter has no value of this name";
}

void wm_wheels_init(wm_wheels *out) {
  memset(out, 0, sizeof *out);
  out->radius_m = out->ticks_per_turn = out->track_m = out->wheelbase_m = (double)NAN;
  out->steering_ratio = out->encoder_offset_m = (double)NAN;
}

void wm_sensor_init(wm_sensor *out, const char *name) {
  memset(out, 0, sizeof *out);
  const size_t length = strlen(name);
  memcpy(out->name, name, length < sizeof out->name ? length : sizeof out->name - 1);
  out->bearing_sigma_rad = out->range_sigma_m = (double)NAN;
  out->max_range_m = (double)INFINITY;
}

void wm_landmark_init(wm_landmark *out, int32_t id) {
  memset(out, 0, sizeof *out);
  out->id = id;
  out->sigma_m = out->yaw_rad = out->yaw_sigma_rad = (double)NAN;
  for (int i = 0; i < 3; i++) out->p_m[i] = out->cov_m2[i] = (double)NAN;
}

#define START_SIGMA 0.05  // m and rad, as of an initial_pose without sigmas

void wm_setup_init(wm_setup *out) {
  memset(out, 0, sizeof *out);
  wm_wheels_init(&out->wheels);
  wm_start *s = &out->start;
  s->t_ns = WM_TIME_NONE;
  for (int i = 0; i < 3; i++) s->p_m[i] = (double)NAN;
  for (int i = 0; i < 4; i++) s->q_xyzw[i] = (double)NAN;
  s->heading_rad = (double)NAN;
  s->sigma_xy_m = s->sigma_heading_rad = START_SIGMA;
  out->seed = 1;
}
