// SPDX-License-Identifier: Apache-2.0
// A configuration with changed values.
#ifndef WAYMARK_LIBRARY_CHANGED_CONFIG_H
#define WAYMARK_LIBRARY_CHANGED_CONFIG_H

#include <waymark/waymark.h>

#include "config/config.h"

typedef wm_status (*config_parse_fn)(const char *text, size_t length, const char *path, wm_config *out, wm_error *err);

// `changes`: lines "KEY: VALUE", or NULL. Warnings go to `note`.
wm_status changed_config_parse(const char *text, size_t length, const char *path, const char *changes,
                               config_parse_fn parse, waymark_note_fn note, void *context, wm_config *out,
                               wm_error *err);
wm_status changed_config_load(const char *path, const char *changes, waymark_note_fn note, void *context,
                              wm_config *out, wm_error *err);

#endif
