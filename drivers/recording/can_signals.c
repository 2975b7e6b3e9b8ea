// SPDX-License-Identifier: Apache-2.0
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration.h"
#include "waymark/text.h"

#define BINDINGS_MAX 256  // lines of can-signals.yaml

static wm_status needed(const wm_yaml_node *item, const char *key, char *out, size_t capacity, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, key);
  if (!wm_yaml_there(&node)) return wm_yaml_fail(item, err, "%s: is missing", key);
  return wm_yaml_string(&node, out, capacity, err);
}

static wm_status optional(const wm_yaml_node *item, const char *key, char *out, size_t capacity, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, key);
  return wm_yaml_there(&node) ? wm_yaml_string(&node, out, capacity, err) : WM_OK;
}

static wm_status read_quantity(const wm_yaml_node *item, wm_can_binding *out, wm_error *err) {
  const char *names[WM_CAN_COUNT + 1] = {NULL};
  for (unsigned q = 0; q < WM_CAN_COUNT; q++) names[q] = wm_can_quantity_name(q);
  wm_yaml_node node = wm_yaml_get(item, "quantity");
  if (!wm_yaml_there(&node)) return wm_yaml_fail(item, err, "quantity: is missing");
  int32_t quantity;
  wm_status status = wm_yaml_choice(&node, names, &quantity, err);
  out->quantity = quantity;
  return status;
}

static wm_status read_signals(const wm_yaml_node *item, wm_can_binding *out, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, "signal");
  if (!wm_yaml_is_list(&node)) {
    out->signal_count = 1;
    return needed(item, "signal", out->signal[0], sizeof out->signal[0], err);
  }
  size_t count = wm_yaml_count(&node);
  if (count < 1 || count > WM_CAN_SUM_MAX)
    return wm_yaml_fail(&node, err, "has %zu signals; a sum of 1 to %d is possible", count, WM_CAN_SUM_MAX);
  for (size_t i = 0; i < count; i++) {
    wm_yaml_node name = wm_yaml_item(&node, i);
    wm_status status = wm_yaml_string(&name, out->signal[i], sizeof out->signal[i], err);
    if (status != WM_OK) return status;
  }
  out->signal_count = (uint32_t)count;
  return WM_OK;
}

static wm_status add_gear(const wm_yaml_node *raw, double direction, wm_can_binding *out, wm_error *err) {
  double value;
  wm_status status = wm_yaml_f64(raw, -DBL_MAX, DBL_MAX, &value, err);
  if (status != WM_OK) return status;
  for (uint32_t i = 0; i < out->gear_count; i++)
    if (out->gear[i].raw == value) return wm_yaml_fail(raw, err, "the value %.10g appears twice", value);
  if (out->gear_count == WM_CAN_VALUES_MAX) return wm_yaml_fail(raw, err, "more than %d values", WM_CAN_VALUES_MAX);
  out->gear[out->gear_count].raw = value;
  out->gear[out->gear_count++].direction = direction;
  return WM_OK;
}

static wm_status read_gears(const wm_yaml_node *item, wm_can_binding *out, wm_error *err) {
  static const char *const kDirections[] = {"reverse", "neutral", "forward", NULL};  // -1, 0, 1
  wm_yaml_node values = wm_yaml_get(item, "values");
  if (!wm_yaml_there(&values)) return WM_OK;
  if (out->quantity != WM_Q_GEAR) return wm_yaml_fail(&values, err, "only the quantity gear has values");
  wm_status status = wm_yaml_check_keys(&values, kDirections, WM_YAML_STRICT, NULL, err);
  for (int d = 0; status == WM_OK && kDirections[d]; d++) {
    wm_yaml_node raw = wm_yaml_get(&values, kDirections[d]);
    if (!wm_yaml_there(&raw)) continue;
    if (!wm_yaml_is_list(&raw)) status = add_gear(&raw, d - 1.0, out, err);
    for (size_t i = 0; status == WM_OK && i < wm_yaml_count(&raw); i++) {
      wm_yaml_node one = wm_yaml_item(&raw, i);
      status = add_gear(&one, d - 1.0, out, err);
    }
  }
  return status;
}

static wm_status read_binding(const wm_yaml_node *item, wm_can_binding *out, wm_error *err) {
  static const char *const kKeys[] = {"quantity", "message", "signal", "bus", "unit",
                                      "scale",    "offset",  "values", NULL};
  *out = (wm_can_binding){.scale = 1.0, .line = wm_yaml_line(item)};
  snprintf(out->file, sizeof out->file, "%s", wm_yaml_file(item));
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {quantity, message, signal} is needed");
  wm_status status = wm_yaml_check_keys(item, kKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK) status = read_quantity(item, out, err);
  if (status == WM_OK) status = needed(item, "message", out->message, sizeof out->message, err);
  if (status == WM_OK) status = read_signals(item, out, err);
  if (status == WM_OK) status = optional(item, "bus", out->bus, sizeof out->bus, err);
  if (status == WM_OK) status = optional(item, "unit", out->unit, sizeof out->unit, err);
  if (status == WM_OK) status = read_gears(item, out, err);
  wm_yaml_node scale = wm_yaml_get(item, "scale"), offset = wm_yaml_get(item, "offset");
  if (status == WM_OK && wm_yaml_there(&scale)) status = wm_yaml_f64(&scale, -1e9, 1e9, &out->scale, err);
  if (status == WM_OK && out->scale == 0.0)
    return wm_yaml_fail(&scale, err, "0 would make everything 0; leave it out for 1");
  if (status == WM_OK && wm_yaml_there(&offset)) status = wm_yaml_f64(&offset, -1e9, 1e9, &out->offset, err);
  return status;
}

static wm_status read_bindings(const wm_yaml_node *list, wm_can_binding *out, wm_error *err) {
  int line_of[WM_CAN_COUNT] = {0};
  for (size_t i = 0; i < wm_yaml_count(list); i++) {
    wm_yaml_node item = wm_yaml_item(list, i);
    wm_status status = read_binding(&item, &out[i], err);
    if (status != WM_OK) return status;
    int *before = &line_of[out[i].quantity];
    if (*before)
      return wm_yaml_fail(&item, err, "%s is bound twice (first in line %d)",
                          wm_can_quantity_name((unsigned)out[i].quantity), *before);
    *before = out[i].line;
  }
  return WM_OK;
}

static wm_status read_list(const wm_yaml_node *root, wm_can_binding **out, size_t *count, wm_error *err) {
  size_t n = wm_yaml_count(root);
  if (!wm_yaml_is_list(root) || n < 1 || n > BINDINGS_MAX)
    return wm_yaml_fail(root, err, "a list of {quantity, message, signal} is needed, with 1 to %d entries",
                        BINDINGS_MAX);
  wm_can_binding *bindings = calloc(BINDINGS_MAX, sizeof *bindings);
  if (!bindings) return wm_fail(err, WM_IO, "%s: no memory to read it", wm_yaml_file(root));
  wm_status status = read_bindings(root, bindings, err);
  if (status != WM_OK) {
    free(bindings);
    return status;
  }
  *out = bindings;
  *count = n;
  return WM_OK;
}

wm_status can_signals_read(const char *path, wm_can_binding **out, size_t *count, wm_error *err) {
  wm_yaml *doc;
  *out = NULL;
  *count = 0;
  wm_status status = wm_yaml_load(path, &doc, err);
  if (status != WM_OK) return status;
  wm_yaml_node root = wm_yaml_root(doc);
  status = read_list(&root, out, count, err);
  wm_yaml_free(doc);
  return status;
}

// Keeps the bindings of one part.
static size_t keep_part(wm_can_binding *bindings, size_t count, wm_can_part part) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++)
    if ((bindings[i].quantity >= WM_CAN_LATITUDE) == (part == WM_CAN_GNSS)) bindings[kept++] = bindings[i];
  return kept;
}

wm_status wm_can_decoder_load(const char *dbc_path, const char *signals_path, wm_can_part part, wm_can_decoder **out,
                              wm_error *err) {
  wm_dbc *dbc = NULL;
  wm_can_binding *bindings = NULL;
  size_t count = 0;
  *out = NULL;
  wm_status status = wm_dbc_load(dbc_path, &dbc, err);
  if (status == WM_OK) status = can_signals_read(signals_path, &bindings, &count, err);
  if (status == WM_OK) count = keep_part(bindings, count, part);
  if (status == WM_OK && count > 0) status = wm_can_decoder_make(dbc, bindings, count, out, err);
  free(bindings);
  wm_dbc_free(dbc);
  return status;
}
