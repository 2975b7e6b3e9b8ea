// SPDX-License-Identifier: Apache-2.0
// JSON is a subset of YAML, whose reader is here already.
#include "dvl_report.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "waymark/yaml.h"

#define TIME_MOST_US INT64_C(9000000000000000)  // the year 2255: in nanoseconds it fits into 64 bits

static double number(const wm_yaml_node *report, const char *key) {
  double out;
  wm_error ignored;
  const wm_yaml_node value = wm_yaml_get(report, key);
  return wm_yaml_there(&value) && wm_yaml_f64(&value, -DBL_MAX, DBL_MAX, &out, &ignored) == WM_OK ? out : (double)NAN;
}

static int64_t whole(const wm_yaml_node *report, const char *key, int64_t otherwise) {
  int64_t out;
  wm_error ignored;
  const wm_yaml_node value = wm_yaml_get(report, key);
  return wm_yaml_there(&value) && wm_yaml_i64(&value, 0, TIME_MOST_US, &out, &ignored) == WM_OK ? out : otherwise;
}

static int text_is(const wm_yaml_node *report, const char *key, const char *wanted) {
  char text[24];
  wm_error ignored;
  const wm_yaml_node value = wm_yaml_get(report, key);
  return wm_yaml_there(&value) && wm_yaml_string(&value, text, sizeof text, &ignored) == WM_OK &&
         strcmp(text, wanted) == 0;
}

// Formats before json_v2 have no type, and nothing but velocities.
static dvl_kind kind_of(const wm_yaml_node *report) {
  const wm_yaml_node type = wm_yaml_get(report, "type"), valid = wm_yaml_get(report, "velocity_valid");
  if (text_is(report, "type", "velocity") || (!wm_yaml_there(&type) && wm_yaml_there(&valid)))
    return text_is(report, "tracking_mode", "water") ? DVL_WATER : DVL_VELOCITY;
  if (text_is(report, "type", "velocity_water")) return DVL_WATER;
  if (text_is(report, "type", "position_local")) return DVL_POSITION;
  return text_is(report, "type", "response") ? DVL_RESPONSE : DVL_OTHER;
}

static const char *read_velocity(const wm_yaml_node *report, dvl_report *out) {
  static const char *const kAxes[] = {"vx", "vy", "vz"};
  wm_error ignored;
  const wm_yaml_node valid = wm_yaml_get(report, "velocity_valid");
  if (!wm_yaml_there(&valid) || wm_yaml_bool(&valid, &out->is_valid, &ignored) != WM_OK)
    return "a velocity without velocity_valid: true or false";
  for (int i = 0; i < 3; i++) out->v_mps[i] = number(report, kAxes[i]);
  out->sigma_mps = number(report, "fom");
  out->since_ms = number(report, "time");
  out->is_hot = (int)(whole(report, "status", 0) & 1);
  out->validity_us = whole(report, "time_of_validity", DVL_NO_TIME);
  out->transmission_us = whole(report, "time_of_transmission", DVL_NO_TIME);
  if (!out->is_valid) return NULL;
  return isnan(out->v_mps[0] + out->v_mps[1] + out->v_mps[2] + out->sigma_mps)
             ? "a valid velocity lacks one of vx, vy, vz and fom"
             : NULL;
}

const char *dvl_report_read(const char *line, size_t length, dvl_report *out) {
  wm_yaml *document;
  wm_error ignored;
  *out = (dvl_report){.kind = DVL_OTHER, .validity_us = DVL_NO_TIME, .transmission_us = DVL_NO_TIME};
  const char *fault = "is no line of JSON: is it a velocity log's port (16171)?";
  if (length == 0 || line[0] != '{' || wm_yaml_parse(line, length, "dvl", &document, &ignored) != WM_OK) return fault;
  const wm_yaml_node report = wm_yaml_root(document);
  if (wm_yaml_is_map(&report)) {
    out->kind = kind_of(&report);
    fault = out->kind == DVL_VELOCITY ? read_velocity(&report, out) : NULL;
  }
  wm_yaml_free(document);
  return fault;
}
