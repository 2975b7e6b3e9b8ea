// SPDX-License-Identifier: Apache-2.0
// Any bytes as a configuration: it is read, or refused with a message.
#include <string.h>

#include "config/config.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static wm_config config;
  wm_error err;
  if (wm_config_parse((const char *)data, size, "fuzz.yaml", &config, &err) != WM_OK) {
    if (strlen(err.text) < 10) abort();
    return 0;
  }
  wm_source_config settings;
  int rank;
  wm_config_source(&config, "sightings:laser", &settings, &rank);
  if (!config.estimator || rank < 0 || config.text_length != size) abort();
  if (!(config.runtime.merge_lateness_max_ms <= config.runtime.merge_horizon_ms)) abort();
  wm_config_free(&config);
  return 0;
}
