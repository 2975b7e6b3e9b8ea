// SPDX-License-Identifier: Apache-2.0
// `vision:` of a configuration: detectors and their cameras.
#include "config/vision.h"
#include "config/detectors.h"

#include <stdlib.h>
#include <string.h>

#include "config/devices.h"
#include "config/keys.h"
#include "waymark/cascade_file.h"

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

static wm_status read_class(const wm_yaml_node *item, int must_be_there, const wm_config *config, wm_vision_config *out,
                            wm_error *err) {
  wm_status status = config_check_keys(item, kConfigClassKeys, err);
  if (status != WM_OK) return status;
  wm_yaml_node file = wm_yaml_get(item, "file"), height = wm_yaml_get(item, "height_m");
  if (!wm_yaml_there(&file)) return wm_yaml_fail(item, err, "file: is missing; a cascade in OpenCV's format (XML)");
  if (!wm_yaml_there(&height))
    return wm_yaml_fail(item, err, "height_m: is missing; metres of height that the cascade's window shows");
  char path[WM_PATH_MAX];
  double height_m = 0;
  status = config_path(&file, config->path, path, err);
  if (status == WM_OK) status = config_number(item, kConfigClassKeys, "height_m", &height_m, err);
  if (status != WM_OK || !must_be_there) return status;
  wm_error said = {0};
  if (wm_cascade_load(path, &out->cascades[out->cascade_count], &said) != WM_OK)
    return wm_yaml_fail(&file, err, "%s", said.text);
  out->cascades[out->cascade_count++].height_m = height_m;
  return WM_OK;
}

static wm_status read_classes(const wm_yaml_node *section, int must_be_there, const wm_config *config,
                              wm_vision_config *out, wm_error *err) {
  if (strcmp(out->detector->name, "cascade") != 0) return WM_OK;
  wm_yaml_node list = wm_yaml_get(section, "classes");
  if (!wm_yaml_is_list(&list) || wm_yaml_count(&list) == 0)
    return wm_yaml_fail(
        section, err,
        "classes: is missing: name the classes to detect: classes: [{file: cascades/street-sign.xml, height_m: "
        "0.91}]");
  if (wm_yaml_count(&list) > WM_CONFIG_CASCADES_MAX)
    return wm_yaml_fail(&list, err, "more than %d classes", WM_CONFIG_CASCADES_MAX);
  for (size_t i = 0; i < wm_yaml_count(&list); i++) {
    wm_yaml_node item = wm_yaml_item(&list, i);
    wm_status status = read_class(&item, must_be_there, config, out, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}

static wm_status read_detector(const wm_yaml_node *section, const wm_detector *detector, int line, int must_be_there,
                               wm_config *out, wm_error *err) {
  if (out->vision_count == WM_VISION_MAX) return wm_yaml_fail(section, err, "more than %d detectors", WM_VISION_MAX);
  wm_vision_config *v = &out->vision[out->vision_count];
  v->detector = detector;
  v->line = line;
  v->params = calloc(1, detector->params.bytes + 1);
  if (!v->params) return wm_fail(err, WM_IO, "%s: no memory to read it", wm_yaml_file(section));
  out->vision_count++;
  wm_params_defaults(&detector->params, v->params);
  char prefix[WM_NAME_MAX + 10];
  snprintf(prefix, sizeof prefix, "vision.%s.", detector->name);
  config_filling own = {.prefix = prefix, .table = &detector->params, .out = v->params};
  wm_status status = config_fill(section, &own, "", NULL, out->warnings, err);
  if (status == WM_OK) status = read_classes(section, must_be_there, out, v, err);
  return status == WM_OK ? read_cameras(section, v, err) : status;
}

wm_status config_read_vision(const wm_yaml_node *root, int files_must_be_there, wm_config *out, wm_error *err) {
  wm_yaml_node vision = wm_yaml_get(root, "vision");
  if (!wm_yaml_there(&vision)) return WM_OK;
  if (!wm_yaml_is_map(&vision))
    return wm_yaml_fail(&vision, err, "a map of detectors, {NAME: {KEY: VALUE}}, is needed");
  for (size_t i = 0; i < wm_yaml_count(&vision); i++) {
    const char *name;
    int line;
    wm_yaml_node section = wm_yaml_value(&vision, i, &name, &line);
    const wm_detector *detector = config_detector_find(name);
    wm_status status = detector ? read_detector(&section, detector, line, files_must_be_there, out, err)
                                : config_unknown(&section, line, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}
