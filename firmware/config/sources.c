// SPDX-License-Identifier: Apache-2.0
// `sources:` of a configuration.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "config/detectors.h"
#include "config/keys.h"
#include "config/sources.h"
#include "waymark/streams.h"
#include "waymark/text.h"

static wm_source_config defaults(const wm_config *config) {
  return (wm_source_config){.use = 1,
                            .lateness_max_ms = config->runtime.merge_lateness_max_ms,
                            .lateness_is_stated = config->lateness_is_stated,
                            .from_s = -HUGE_VAL,
                            .until_s = HUGE_VAL};
}

static wm_status read_name(const wm_yaml_node *item, const wm_config *config, wm_source_config *out, wm_error *err) {
  char base[WM_SOURCE_NAME_MAX];
  int32_t kind;
  wm_yaml_node name = wm_yaml_get(item, "name");
  if (!wm_yaml_there(&name)) return wm_yaml_fail(item, err, "name: is missing");
  wm_status status = wm_yaml_string(&name, out->name, sizeof out->name, err);
  if (status != WM_OK) return status;
  snprintf(base, sizeof base, "%.*s", (int)strcspn(out->name, ":"), out->name);
  // With a sensor's name after the colon, the part before it is checked; the message shows the whole.
  int is_detector = config_detector_find(base) != NULL;  // DETECTOR, or DETECTOR:CAMERA
  if (!is_detector && strcmp(base, out->name) == 0) {
    status = wm_yaml_choice(&name, wm_source_names, &kind, err);
    if (status != WM_OK) return status;
  } else if (!is_detector && strcmp(base, "sightings") != 0 && strcmp(base, "markers") != 0 &&
             strcmp(base, "can") != 0) {
    return wm_yaml_fail(
        &name, err, "'%s' has a sensor's name; only sightings:SENSOR, markers:SENSOR and can:INTERFACE are possible",
        out->name);
  }
  for (size_t i = 0; i < config->source_count; i++)
    if (strcmp(config->sources[i].name, out->name) == 0)
      return wm_yaml_fail(&name, err, "'%s' appears twice (first in line %d)", out->name, config->sources[i].line);
  return WM_OK;
}

static wm_status check_lateness(const wm_yaml_node *node, double lateness_ms, double horizon_ms, wm_error *err) {
  if (lateness_ms <= horizon_ms) return WM_OK;
  return wm_yaml_fail(
      node, err, "%.10g is above merge.horizon_ms (%.10g); at most %.10g is possible, or set merge.horizon_ms to %.10g",
      lateness_ms, horizon_ms, horizon_ms, lateness_ms);
}

// The time of detection on the robot, where another computer replays.
static wm_status read_ready_after(const wm_yaml_node *item, wm_source_config *out, wm_error *err) {
  char base[WM_SOURCE_NAME_MAX];
  wm_yaml_node node = wm_yaml_get(item, "ready_after_ms");
  if (!wm_yaml_there(&node)) return WM_OK;
  snprintf(base, sizeof base, "%.*s", (int)strcspn(out->name, ":"), out->name);
  if (!config_detector_find(base)) return wm_yaml_fail(&node, err, "only a detector's observations take time");
  return config_number(item, kConfigSourceKeys, "ready_after_ms", &out->ready_after_ms, err);
}

// A file's convention for the stamps of its rows; other sources stamp their measurements.
static wm_status read_sample_at(const wm_yaml_node *item, wm_source_config *out, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(item, "sample_at");
  if (!wm_yaml_there(&node)) return WM_OK;
  if (strcmp(out->name, "motion") != 0 && strcmp(out->name, "motion6") != 0)
    return wm_yaml_fail(&node, err, "only `motion` and `motion6` have rows whose values can get the next row's stamp");
  return config_choice(item, kConfigSourceKeys, "sample_at", &out->sample_at_next, err);
}

static wm_status read_source(const wm_yaml_node *item, const wm_config *config, wm_source_config *out, wm_error *err) {
  *out = defaults(config);
  out->line = wm_yaml_line(item);
  if (!wm_yaml_is_map(item)) return wm_yaml_fail(item, err, "a map {name: NAME, ...} is needed");
  wm_status status = config_check_keys(item, kConfigSourceKeys, err);
  if (status == WM_OK) status = read_name(item, config, out, err);
  wm_yaml_node use = wm_yaml_get(item, "use"), lateness = wm_yaml_get(item, "lateness_max_ms"),
               until = wm_yaml_get(item, "until_s");
  int yes = 1;
  if (status == WM_OK && wm_yaml_there(&use)) status = wm_yaml_bool(&use, &yes, err);
  out->use = yes;
  if (status == WM_OK) status = config_number(item, kConfigSourceKeys, "lateness_max_ms", &out->lateness_max_ms, err);
  if (wm_yaml_there(&lateness)) out->lateness_is_stated = 1;
  if (status == WM_OK && wm_yaml_there(&lateness))
    status = check_lateness(&lateness, out->lateness_max_ms, config->runtime.merge_horizon_ms, err);
  if (status == WM_OK) status = config_number(item, kConfigSourceKeys, "period_ms", &out->period_ms, err);
  if (status == WM_OK) status = read_ready_after(item, out, err);
  if (status == WM_OK) status = read_sample_at(item, out, err);
  if (status == WM_OK) status = config_number(item, kConfigSourceKeys, "from_s", &out->from_s, err);
  if (status == WM_OK) status = config_number(item, kConfigSourceKeys, "until_s", &out->until_s, err);
  if (status == WM_OK && out->until_s <= out->from_s)
    return wm_yaml_fail(&until, err, "%.10g is not after from_s (%.10g): nothing would be taken", out->until_s,
                        out->from_s);
  return status;
}

wm_status config_read_sources(const wm_yaml_node *root, wm_config *out, wm_error *err) {
  wm_yaml_node lateness = wm_yaml_get(root, "merge.lateness_max_ms"), list = wm_yaml_get(root, "sources");
  out->lateness_is_stated = wm_yaml_there(&lateness);
  // Where the horizon is set too small, the error is shown there.
  if (!wm_yaml_there(&lateness)) lateness = wm_yaml_get(root, "merge.horizon_ms");
  wm_status status = WM_OK;
  if (wm_yaml_there(&lateness) && out->runtime.merge_lateness_max_ms > out->runtime.merge_horizon_ms)
    return wm_yaml_fail(&lateness, err,
                        "merge.lateness_max_ms (%.10g) is above merge.horizon_ms (%.10g); set lateness_max_ms to at "
                        "most %.10g, or horizon_ms to %.10g",
                        out->runtime.merge_lateness_max_ms, out->runtime.merge_horizon_ms,
                        out->runtime.merge_horizon_ms, out->runtime.merge_lateness_max_ms);
  if (!wm_yaml_there(&list)) return WM_OK;
  if (!wm_yaml_is_list(&list)) return wm_yaml_fail(&list, err, "a list of {name: NAME, ...} is needed");
  if (wm_yaml_count(&list) > WM_SOURCES_MAX) return wm_yaml_fail(&list, err, "more than %d sources", WM_SOURCES_MAX);
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(&list); i++) {
    wm_yaml_node item = wm_yaml_item(&list, i);
    status = read_source(&item, out, &out->sources[i], err);
    if (status == WM_OK) out->source_count = i + 1;
  }
  return status;
}

void wm_config_source(const wm_config *config, const char *name, wm_source_config *out, int *rank) {
  size_t base = strcspn(name, ":"), chosen = config->source_count;
  for (size_t i = config->source_count; i-- > 0;) {
    const char *listed = config->sources[i].name;
    if (strcmp(listed, name) == 0) {
      chosen = i;
      break;
    }
    if (strlen(listed) == base && strncmp(listed, name, base) == 0) chosen = i;
  }
  *rank = (int)chosen;
  *out = chosen < config->source_count ? config->sources[chosen] : defaults(config);
  snprintf(out->name, sizeof out->name, "%s", name);
}
