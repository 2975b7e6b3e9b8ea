// SPDX-License-Identifier: Apache-2.0
// Any bytes as YAML: every place is visited with every getter; then as calibration.yaml.
#include <math.h>
#include <string.h>

#include "calibration.h"
#include "fuzz.h"
#include "waymark/yaml.h"

static size_t visited;

static void visit(const wm_yaml_node *node, int depth) {
  static const char *const kNames[] = {"distance", "depth", NULL};
  double number, list[8];
  int64_t whole;
  int yes;
  int32_t choice;
  char text[32];
  size_t count;
  wm_error err;
  if (depth > 128) abort();  // the parser promises 64
  if (++visited > 5000) return;
  (void)wm_yaml_f64(node, -1, HUGE_VAL, &number, &err);
  (void)wm_yaml_i64(node, -5, 5, &whole, &err);
  (void)wm_yaml_bool(node, &yes, &err);
  (void)wm_yaml_choice(node, kNames, &choice, &err);
  (void)wm_yaml_string(node, text, sizeof text, &err);
  (void)wm_yaml_f64_list(node, 1, 8, list, &count, &err);
  (void)wm_yaml_check_keys(node, kNames, WM_YAML_NEAR, &count, &err);
  for (size_t i = 0; i < wm_yaml_count(node); i++) {
    const char *key = "";
    wm_yaml_node child = wm_yaml_is_map(node) ? wm_yaml_value(node, i, &key, NULL) : wm_yaml_item(node, i);
    if (!wm_yaml_there(&child) || wm_yaml_line(&child) < 1) abort();
    if (wm_yaml_is_map(node)) (void)wm_yaml_get(node, key);
    visit(&child, depth + 1);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static calibration known;
  wm_yaml *doc;
  wm_error err;
  warner quiet = {NULL, NULL};
  if (wm_yaml_parse((const char *)data, size, "fuzz.yaml", &doc, &err) != WM_OK) {
    if (strlen(err.text) < 10) abort();
    return 0;
  }
  wm_yaml_node root = wm_yaml_root(doc);
  visited = 0;
  visit(&root, 0);
  (void)calibration_read(doc, &quiet, &known, &err);
  wm_yaml_free(doc);
  return 0;
}
