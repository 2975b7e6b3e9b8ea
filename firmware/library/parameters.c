// SPDX-License-Identifier: Apache-2.0
// The numbers of a configuration that its estimator reads.
#include <stdio.h>
#include <string.h>
#include <waymark/waymark.h>

#include "config/config.h"
#include "waymark/estimator.h"
#include "waymark/motion.h"

typedef void (*take_fn)(void *context, const waymark_parameter *parameter);

// Of one section; of a section that estimators share, those that this one reads.
static void each(const wm_estimator *reader, const char *section, const wm_param_table *table, const void *values,
                 take_fn take, void *context) {
  char key[128];
  for (size_t i = 0; i < table->count; i++) {
    const wm_param *p = &table->params[i];
    (void)snprintf(key, sizeof key, "%s.%s", section, p->key);
    if (p->type != WM_PARAM_F64 || (reader && !wm_estimator_reads(reader, key))) continue;
    waymark_parameter out = {.key = key, .initial = p->initial, .min = p->min, .max = p->max};
    memcpy(&out.value, (const char *)values + p->offset, sizeof out.value);
    take(context, &out);
  }
}

wm_status waymark_parameters(const char *text, take_fn take, void *context, wm_error *err) {
  wm_config config;
  if (!text || !take) return wm_fail(err, WM_BAD_USAGE, "waymark_parameters: a text and a function are needed");
  const wm_status status = wm_config_parse_logged(text, strlen(text), "configuration", &config, err);
  if (status != WM_OK) return status;
  for (int i = 0; i < WM_CONFIG_SHARED; i++)
    each(config.estimator, wm_config_shared[i].name, wm_config_shared[i].table, wm_config_params(&config, i), take,
         context);
  each(NULL, config.estimator->name, &config.estimator->params, config.estimator_params, take, context);
  wm_config_free(&config);
  return WM_OK;
}
