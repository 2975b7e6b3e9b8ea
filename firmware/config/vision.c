// SPDX-License-Identifier: Apache-2.0
// `vision:` of a configuration: the detectors that look at pictures, and at whose.
#include "vision.h"
#include "detectors.h"

#include <stdlib.h>
#include <string.h>

#include "keys.h"

static wm_status read_cameras(const wm_yaml_node *section, wm_vision_config *out, wm_error *err) {
  wm_yaml_node list = wm_yaml_get(section, "cameras");
  if (!wm_yaml_there(&list)) return WM_OK;
  if (!wm_yaml_is_list(&list)) return wm_yaml_fail(&list, err, "a list of cameras of calibration.yaml is needed");
  if (out->detector->pictures == 2)
    return wm_yaml_fail(&list, err, "this detector looks at the pair that `stereo` of calibration.yaml names");
  if (wm_yaml_count(&list) > WM_CAMERAS_MAX) return wm_yaml_fail(&list, err, "more than %d", WM_CAMERAS_MAX);
  for (size_t i = 0; i < wm_yaml_count(&list); i++) {
    wm_yaml_node item = wm_yaml_item(&list, i);
    wm_status status = wm_yaml_string(&item, out->cameras[i], sizeof out->cameras[i], err);
    if (status != WM_OK) return status;
    out->camera_count = (uint32_t)i + 1;
  }
  return WM_OK;
}

static wm_status read_detector(const wm_yaml_node *section, const wm_detector *detector, int line, wm_config *out,
                               wm_error *err) {
  if (out->vision_count == WM_VISION_MAX) return wm_yaml_fail(section, err, "more than %d detectors", WM_VISION_MAX);
  wm_vision_config *v = &out->vision[out->vision_count];
  v->detector = detector;
  v->line = line;
  v->params = calloc(1, detector->params.bytes + 1);
  if (!v->params) return wm_fail(err, WM_IO, "%s: no memory to read it", wm_yaml_file(section));
  out->vision_count++;
  wm_params_defaults(&detector->params, v->params);
  wm_status status = config_fill(section, &detector->params, "", v->params, err);
  return status == WM_OK ? read_cameras(section, v, err) : status;
}

wm_status config_read_vision(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  wm_yaml_node vision = wm_yaml_get(root, "vision");
  if (!wm_yaml_there(&vision)) return WM_OK;
  if (!wm_yaml_is_map(&vision))
    return wm_yaml_fail(&vision, err, "a map of detectors, {NAME: {KEY: VALUE}}, is needed");
  for (size_t i = 0; i < wm_yaml_count(&vision); i++) {
    const char *name;
    int line;
    wm_yaml_node section = wm_yaml_value(&vision, i, &name, &line);
    const wm_detector *detector = config_detector_find(name);
    wm_status status =
        detector ? read_detector(&section, detector, line, out, err) : config_unknown(&section, line, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}
