// SPDX-License-Identifier: Apache-2.0
// A camera's entry in calibration.yaml: reads and checks the fields of each model; the models themselves are vision's.
#include <float.h>
#include <math.h>
#include <string.h>

#include "calibration.h"

typedef struct camera_model {
  size_t intrinsics_min, intrinsics_max;
  int focal;  // index of fx; fy, cx, cy follow; -1: a polynomial (ocam)
  size_t distortion_min, distortion_max;
  const char *fields;
} camera_model;

static const char *const kModels[] = {"equidistant", "pinhole-radtan", "omni", "double-sphere", "ocam", NULL};
static const camera_model kFields[] = {
    {4, 4, 0, 4, 4, "[fx, fy, cx, cy]"},
    {4, 4, 0, 4, 5, "[fx, fy, cx, cy]"},
    {5, 5, 1, 4, 5, "[xi, fx, fy, cx, cy]"},
    {6, 6, 2, 0, 0, "[xi, alpha, fx, fy, cx, cy]"},
    {5, WM_INTRINSICS_MAX, -1, 0, WM_INTRINSICS_MAX, "the polynomial, centre and affine values"},
};

static wm_status read_size(const wm_yaml_node *node, double size[2], wm_error *err) {
  wm_yaml_node list = wm_yaml_get(node, "size");
  if (!wm_yaml_is_list(&list) || wm_yaml_count(&list) != 2)
    return wm_yaml_fail(wm_yaml_there(&list) ? &list : node, err, "size: [width, height] in pixels is needed");
  for (size_t i = 0; i < 2; i++) {
    int64_t value;
    wm_yaml_node item = wm_yaml_item(&list, i);
    wm_status status = wm_yaml_i64(&item, 1, 65535, &value, err);
    if (status != WM_OK) return status;
    size[i] = (double)value;
  }
  return WM_OK;
}

static wm_status read_intrinsics(const wm_yaml_node *node, const camera_model *model, const double size[2],
                                 wm_camera *out, wm_error *err) {
  double *values = out->intrinsics;
  wm_yaml_node list = wm_yaml_get(node, "intrinsics");
  if (!wm_yaml_there(&list)) return wm_yaml_fail(node, err, "intrinsics: %s is needed", model->fields);
  size_t n = wm_yaml_count(&list);
  if (!wm_yaml_is_list(&list) || n < model->intrinsics_min || n > model->intrinsics_max)
    return wm_yaml_fail(&list, err, "has %zu values; this model needs %s", n, model->fields);
  wm_status status = wm_yaml_f64_list(&list, n, n, values, NULL, err);
  out->intrinsics_count = (uint32_t)n;
  for (size_t i = 0; status == WM_OK && model->focal >= 0 && i < n; i++) {
    size_t focal = (size_t)model->focal;
    wm_yaml_node item = wm_yaml_item(&list, i);
    if (i == focal || i == focal + 1) status = wm_yaml_f64(&item, DBL_MIN, 1e6, &values[i], err);
    // The centre may lie outside of a cropped picture, but not a whole picture away.
    if (i >= focal + 2) status = wm_yaml_f64(&item, -size[i - focal - 2], 2 * size[i - focal - 2], &values[i], err);
    if (focal == 2 && i == 0) status = wm_yaml_f64(&item, -1, 1, &values[i], err);
    if (focal == 2 && i == 1) status = wm_yaml_f64(&item, 0, 1, &values[i], err);
    if (focal == 1 && i == 0) status = wm_yaml_f64(&item, 0, 100, &values[i], err);
  }
  return status;
}

static wm_status read_distortion(const wm_yaml_node *node, const camera_model *model, wm_camera *out, wm_error *err) {
  size_t count;
  wm_yaml_node list = wm_yaml_get(node, "distortion");
  if (!wm_yaml_there(&list) || (wm_yaml_is_list(&list) && wm_yaml_count(&list) == 0)) return WM_OK;  // none: zeros
  wm_status status =
      wm_yaml_f64_list(&list, model->distortion_min, model->distortion_max, out->distortion, &count, err);
  if (status == WM_OK) out->distortion_count = (uint32_t)count;
  return status;
}

wm_status calibration_camera(const wm_yaml_node *node, const warner *warn, wm_camera *out, wm_error *err) {
  static const char *const kKeys[] = {"model", "size", "intrinsics", "distortion", "mounting", "readout_ns", NULL};
  int32_t kind;
  double size[2] = {0, 0};
  if (!wm_yaml_is_map(node)) return wm_yaml_fail(node, err, "a map with model, size, intrinsics ... is needed");
  wm_status status = calibration_keys(node, kKeys, warn, err);
  if (status != WM_OK) return status;
  wm_yaml_node model = wm_yaml_get(node, "model"), readout = wm_yaml_get(node, "readout_ns");
  if (!wm_yaml_there(&model))
    return wm_yaml_fail(node, err, "model: one of equidistant, pinhole-radtan, omni, double-sphere, ocam is needed");
  status = wm_yaml_choice(&model, kModels, &kind, err);
  if (status == WM_OK) status = read_size(node, size, err);
  if (status == WM_OK) status = read_intrinsics(node, &kFields[kind], size, out, err);
  if (status == WM_OK) status = read_distortion(node, &kFields[kind], out, err);
  out->model = kind;  // the names stand in the order of wm_camera_model
  out->width_px = (uint32_t)size[0];
  out->height_px = (uint32_t)size[1];
  if (status == WM_OK && wm_yaml_there(&readout)) status = wm_yaml_i64(&readout, 0, 1000000000, &out->readout_ns, err);
  return status == WM_OK ? calibration_mounting(node, NULL, warn, &out->mounting, err) : status;
}
