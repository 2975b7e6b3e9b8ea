// SPDX-License-Identifier: Apache-2.0
// Reads faults.yaml. All keys are checked against the tables of fault_kinds.c and of the health message.
#include "waymark/faults.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "waymark/health.h"
#include "waymark/pose.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define DURATION_MAX_S 1e7  // a third of a year
#define NAMES_MAX 40

static const char *const kFlags[] = {"motion_stale", "fusion_stale", "jumped", NULL};
// Of source_health_t.
static const char *const kCounters[] = {"received",  "fused",      "late",         "dropped",    "duplicates",
                                        "future",    "lost",       "malformed",    "ignored",    "frozen",
                                        "overflows", "not_finite", "out_of_order", "bus_errors", NULL};

static wm_status number(const wm_yaml_node *map, const char *key, double min, double max, double *out, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(map, key);
  return wm_yaml_there(&node) ? wm_yaml_f64(&node, min, max, out, err) : WM_OK;
}

static wm_status text(const wm_yaml_node *map, const char *key, char out[WM_FAULT_TEXT_MAX], wm_error *err) {
  wm_yaml_node node = wm_yaml_get(map, key);
  return wm_yaml_there(&node) ? wm_yaml_string(&node, out, WM_FAULT_TEXT_MAX, err) : WM_OK;
}

// ── what health states ──────────────────────────────────────────────────────────────────────────────────────────────

// Names of a table that is asked by number, from `first` on.
static void names_of(const char *(*name)(unsigned), unsigned first, unsigned count, const char *out[NAMES_MAX]) {
  size_t n = 0;
  for (unsigned i = first; i < count && n + 1 < NAMES_MAX; i++) out[n++] = name(i);
  out[n] = NULL;
}

static const char *const kStatementKeys[] = {"device", "flag", "state", "cause", "counter", "text", NULL};

// One of kStatementKeys, which is also its wm_statement_kind.
static wm_status statement_kind(const wm_yaml_node *item, wm_yaml_node *value, wm_statement *out, wm_error *err) {
  int found = -1;
  for (int i = 0; kStatementKeys[i]; i++) {
    wm_yaml_node node = wm_yaml_get(item, kStatementKeys[i]);
    if (!wm_yaml_there(&node)) continue;
    if (found >= 0)
      return wm_yaml_fail(&node, err, "'%s' is given, too; write one entry of health for each", kStatementKeys[found]);
    found = i;
    *value = node;
  }
  if (found < 0) return wm_yaml_fail(item, err, "one of device, flag, state, cause, counter and text is needed");
  out->kind = (wm_statement_kind)found;
  return WM_OK;
}

static wm_status statement_value(const wm_yaml_node *value, wm_statement *out, wm_error *err) {
  const char *names[NAMES_MAX];
  int32_t chosen = 0;
  const char *const *list = names;
  switch (out->kind) {
    case WM_STATES_DEVICE: names_of(wm_device_state_name, 1, WM_DEVICE_STATE_COUNT, names); break;
    case WM_STATES_STATE: names_of(wm_state_name, 0, WM_STATE_COUNT, names); break;
    case WM_STATES_CAUSE: names_of(wm_cause_name, 1, WM_CAUSE_COUNT, names); break;
    case WM_STATES_FLAG: list = kFlags; break;
    case WM_STATES_COUNTER: list = kCounters; break;
    case WM_STATES_TEXT: return wm_yaml_string(value, out->what, sizeof out->what, err);
  }
  wm_status status = wm_yaml_choice(value, list, &chosen, err);
  if (status == WM_OK) (void)snprintf(out->what, sizeof out->what, "%s", list[chosen]);
  return status;
}

static wm_status read_statement(const wm_yaml_node *item, wm_statement *out, wm_error *err) {
  static const char *const kKeys[] = {"source",   "device",           "flag",     "state",   "cause", "counter", "text",
                                      "within_s", "cleared_within_s", "at_least", "at_most", NULL};
  wm_yaml_node value = *item;
  *out = (wm_statement){
      .within_s = (double)NAN, .cleared_within_s = (double)NAN, .at_least = (double)NAN, .at_most = (double)NAN};
  wm_status status = wm_yaml_check_keys(item, kKeys, WM_YAML_STRICT, NULL, err);
  if (status == WM_OK && !wm_yaml_is_map(item))
    status = wm_yaml_fail(item, err, "a map {source: can, device: down, within_s: 1} is needed");
  if (status == WM_OK) status = statement_kind(item, &value, out, err);
  if (status == WM_OK) status = statement_value(&value, out, err);
  if (status == WM_OK) status = text(item, "source", out->source, err);
  if (status == WM_OK) status = number(item, "within_s", 0, DURATION_MAX_S, &out->within_s, err);
  if (status == WM_OK) status = number(item, "cleared_within_s", 0, DURATION_MAX_S, &out->cleared_within_s, err);
  if (status == WM_OK) status = number(item, "at_least", 0, 1e15, &out->at_least, err);
  if (status == WM_OK) status = number(item, "at_most", 0, 1e15, &out->at_most, err);
  if (status != WM_OK) return status;
  const int has_source = out->kind == WM_STATES_DEVICE || out->kind == WM_STATES_COUNTER;
  if (has_source && !out->source[0])
    return wm_yaml_fail(item, err,
                        "source: is missing; %s is of a source (a name in health.json, e.g. can or edges:front)",
                        kStatementKeys[out->kind]);
  if (!has_source && out->source[0])
    return wm_yaml_fail(item, err, "source: a %s is of the whole run", kStatementKeys[out->kind]);
  const int counts = out->kind == WM_STATES_COUNTER || out->kind == WM_STATES_TEXT;
  if (!counts && (!isnan(out->at_least) || !isnan(out->at_most)))
    return wm_yaml_fail(item, err, "at_least and at_most are of a counter or a text");
  if (out->kind == WM_STATES_COUNTER && isnan(out->at_least) && isnan(out->at_most))
    return wm_yaml_fail(item, err, "at_least or at_most is needed: by how much the counter grows");
  if (out->at_least > out->at_most) return wm_yaml_fail(item, err, "at_least is above at_most");
  return WM_OK;
}

static wm_status read_health(const wm_yaml_node *map, wm_fault *out, wm_error *err) {
  wm_yaml_node list = wm_yaml_get(map, "health");
  if (!wm_yaml_there(&list)) return WM_OK;
  if (!wm_yaml_is_list(&list)) return wm_yaml_fail(&list, err, "a list of statements is needed");
  if (wm_yaml_count(&list) > WM_FAULT_STATEMENTS_MAX)
    return wm_yaml_fail(&list, err, "more than %d statements", WM_FAULT_STATEMENTS_MAX);
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < wm_yaml_count(&list); i++) {
    wm_yaml_node item = wm_yaml_item(&list, i);
    status = read_statement(&item, &out->states[i], err);
    out->state_count++;
  }
  return status;
}

// ── the pose ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status read_pose(const wm_yaml_node *map, wm_fault *out, wm_error *err) {
  static const char *const kKeys[] = {"position_m",  "heading_deg", "error_sigmas", "sigma_m",  "sigma_deg",
                                      "sigma_grows", "rate_hz",     "gap_max_s",    "within_s", NULL};
  wm_yaml_node node = wm_yaml_get(map, "pose");
  wm_pose_bound *pose = &out->pose;
  double *const values[] = {&pose->position_m, &pose->heading_deg, &pose->error_sigmas,
                            &pose->sigma_m,    &pose->sigma_deg,   &pose->sigma_grows,
                            &pose->rate_hz,    &pose->gap_max_s,   &pose->within_s};
  for (size_t i = 0; kKeys[i]; i++) *values[i] = (double)NAN;
  if (!wm_yaml_there(&node)) return WM_OK;
  out->has_pose = 1;
  if (!wm_yaml_is_map(&node)) return wm_yaml_fail(&node, err, "a map {position_m: 0.5, within_s: 3} is needed");
  wm_status status = wm_yaml_check_keys(&node, kKeys, WM_YAML_STRICT, NULL, err);
  for (size_t i = 0; status == WM_OK && kKeys[i]; i++) status = number(&node, kKeys[i], 0, 1e6, values[i], err);
  return status;
}

// ── a fault ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status read_kind(const wm_yaml_node *item, wm_fault *out, wm_error *err) {
  const char *names[WM_FAULT_KIND_COUNT + 1] = {NULL};
  int32_t kind = 0;
  for (int i = 0; i < WM_FAULT_KIND_COUNT; i++) names[i] = wm_fault_kind_of((wm_fault_kind)i)->name;
  wm_yaml_node node = wm_yaml_get(item, "fault");
  if (!wm_yaml_there(&node))
    return wm_yaml_fail(item, err, "fault: is missing: what breaks, e.g. camera_unplugged (docs/faults.md has all)");
  wm_status status = wm_yaml_choice(&node, names, &kind, err);
  out->kind = (wm_fault_kind)kind;
  return status;
}

// The keys that this kind takes.
static wm_status check_keys(const wm_yaml_node *item, const wm_fault_kind_row *row, wm_error *err) {
  const char *known[16] = {"name", "fault", "from_s", "until_s", "for_s", "health", "pose"};
  size_t n = 7;
  if (row->of) known[n++] = row->of;
  if (row->text_key) known[n++] = row->text_key;
  if (row->takes_ids) known[n++] = "ids";
  for (size_t i = 0; i < WM_FAULT_PARAMS_MAX && row->params[i].name; i++) known[n++] = row->params[i].name;
  known[n] = NULL;
  return wm_yaml_check_keys(item, known, WM_YAML_STRICT, NULL, err);
}

static wm_status read_times(const wm_yaml_node *item, const wm_fault_kind_row *row, wm_fault *out, wm_error *err) {
  wm_yaml_node from = wm_yaml_get(item, "from_s"), until = wm_yaml_get(item, "until_s"),
               lasts = wm_yaml_get(item, "for_s");
  double for_s = 0;
  if (!wm_yaml_there(&from))
    return wm_yaml_fail(item, err, "from_s: is missing: seconds since the recording's first datum");
  if (wm_yaml_there(&until) && wm_yaml_there(&lasts))
    return wm_yaml_fail(&lasts, err, "until_s is given, too; give one of them");
  wm_status status = wm_yaml_f64(&from, 0, DURATION_MAX_S, &out->from_s, err);
  out->until_s = row->is_instant ? out->from_s : (double)INFINITY;
  if (status == WM_OK && wm_yaml_there(&until)) {
    status = wm_yaml_f64(&until, 0, DURATION_MAX_S, &out->until_s, err);
    if (status == WM_OK && out->until_s <= out->from_s)
      return wm_yaml_fail(&until, err, "%g is not after from_s (%g)", out->until_s, out->from_s);
  }
  if (status == WM_OK && wm_yaml_there(&lasts)) {
    status = wm_yaml_f64(&lasts, DBL_MIN, DURATION_MAX_S, &for_s, err);
    out->until_s = out->from_s + for_s;
  }
  return status;
}

static wm_status read_ids(const wm_yaml_node *item, wm_fault *out, wm_error *err) {
  wm_yaml_node list = wm_yaml_get(item, "ids");
  if (!wm_yaml_there(&list)) return WM_OK;
  if (!wm_yaml_is_list(&list) || wm_yaml_count(&list) == 0)
    return wm_yaml_fail(&list, err, "a list of CAN ids is needed, e.g. [\"101\", \"1A0\"] in hexadecimal digits");
  if (wm_yaml_count(&list) > WM_FAULT_IDS_MAX) return wm_yaml_fail(&list, err, "more than %d ids", WM_FAULT_IDS_MAX);
  for (size_t i = 0; i < wm_yaml_count(&list); i++) {
    char digits[WM_FAULT_TEXT_MAX], *rest;
    wm_yaml_node node = wm_yaml_item(&list, i);
    wm_status status = wm_yaml_string(&node, digits, sizeof digits, err);
    if (status != WM_OK) return status;
    const unsigned long id = strtoul(digits, &rest, 16);
    if (!strchr("0123456789abcdefABCDEF", digits[0]) || *rest || id > 0x1FFFFFFF)
      return wm_yaml_fail(&node, err, "'%s' is not a CAN id in hexadecimal digits, 0 to 1FFFFFFF", digits);
    out->ids[out->id_count++] = (uint32_t)id;
  }
  return WM_OK;
}

static wm_status read_params(const wm_yaml_node *item, const wm_fault_kind_row *row, wm_fault *out, wm_error *err) {
  wm_status status = row->of ? text(item, row->of, out->of, err) : WM_OK;
  for (size_t i = 0; status == WM_OK && i < WM_FAULT_PARAMS_MAX && row->params[i].name; i++) {
    const wm_fault_param *p = &row->params[i];
    out->param[i] = p->when_absent;
    status = number(item, p->name, p->min, p->max, &out->param[i], err);
    if (status == WM_OK && isnan(out->param[i]))
      return wm_yaml_fail(item, err, "%s: is missing; '%s' needs it", p->name, row->name);
  }
  if (status == WM_OK && row->text_key) {
    (void)snprintf(out->text, sizeof out->text, "%s", row->text_when_absent);
    status = text(item, row->text_key, out->text, err);
  }
  if (status == WM_OK && row->takes_ids) status = read_ids(item, out, err);
  return status;
}

static wm_status read_fault(const wm_yaml_node *item, wm_fault *out, wm_error *err) {
  *out = (wm_fault){.line = wm_yaml_line(item)};
  if (!wm_yaml_is_map(item))
    return wm_yaml_fail(item, err, "a map {name: NAME, fault: KIND, from_s: S, until_s: S, ...} is needed");
  wm_status status = read_kind(item, out, err);
  if (status != WM_OK) return status;
  const wm_fault_kind_row *row = wm_fault_kind_of(out->kind);
  status = check_keys(item, row, err);
  if (status == WM_OK) status = text(item, "name", out->name, err);
  if (status == WM_OK && !out->name[0]) status = wm_yaml_fail(item, err, "name: is missing: how a report names it");
  if (status == WM_OK) status = read_times(item, row, out, err);
  if (status == WM_OK) status = read_params(item, row, out, err);
  if (status == WM_OK) status = read_health(item, out, err);
  if (status == WM_OK) status = read_pose(item, out, err);
  return status;
}

// ── the file ────────────────────────────────────────────────────────────────────────────────────────────────────────

// Names are unique. Faults of one kind on one device must not overlap.
static wm_status check_others(const wm_yaml_node *item, const wm_faults *self, const wm_fault *f, wm_error *err) {
  for (size_t i = 0; i < self->count; i++) {
    const wm_fault *other = &self->fault[i];
    if (strcmp(other->name, f->name) == 0)
      return wm_yaml_fail(item, err, "the name '%s' appears twice (first in line %d)", f->name, other->line);
    if (other->kind == f->kind && (!other->of[0] || !f->of[0] || strcmp(other->of, f->of) == 0) &&
        other->id_count == 0 && f->id_count == 0 && other->from_s < f->until_s && f->from_s < other->until_s)
      return wm_yaml_fail(item, err, "'%s' lasts at the same time as '%s' (line %d), and is of the same kind", f->name,
                          other->name, other->line);
  }
  return WM_OK;
}

static wm_status read_list(const wm_yaml_node *list, wm_faults *out, wm_error *err) {
  const size_t count = wm_yaml_count(list);
  if (!wm_yaml_is_list(list)) return wm_yaml_fail(list, err, "a list of faults is needed");
  if (count > WM_FAULTS_MAX) return wm_yaml_fail(list, err, "more than %d faults", WM_FAULTS_MAX);
  out->fault = calloc(count ? count : 1, sizeof *out->fault);
  if (!out->fault) return wm_yaml_fail(list, err, "no memory for %zu faults", count);
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < count; i++) {
    wm_yaml_node item = wm_yaml_item(list, i);
    status = read_fault(&item, &out->fault[i], err);
    if (status == WM_OK) status = check_others(&item, out, &out->fault[i], err);
    out->count++;
  }
  return status;
}

static wm_status read_root(const wm_yaml *doc, wm_faults *out, wm_error *err) {
  static const char *const kKeys[] = {"format", "faults", NULL};
  char format[64] = "";
  const wm_yaml_node root = wm_yaml_root(doc);
  if (!wm_yaml_is_map(&root))
    return wm_yaml_fail(&root, err, "a map that begins with 'format: waymark-faults/1' is needed");
  wm_status status = wm_yaml_check_keys(&root, kKeys, WM_YAML_STRICT, NULL, err);
  if (status != WM_OK) return status;
  wm_yaml_node node = wm_yaml_get(&root, "format"), list = wm_yaml_get(&root, "faults");
  if (!wm_yaml_there(&node))
    return wm_yaml_fail(&root, err, "format: is missing; 'format: waymark-faults/1' is needed");
  status = wm_yaml_string(&node, format, sizeof format, err);
  if (status == WM_OK && strcmp(format, "waymark-faults/1") != 0)
    return wm_yaml_fail(&node, err, "'%s' is not a format that this program reads; it reads waymark-faults/1", format);
  if (status == WM_OK && !wm_yaml_there(&list)) return wm_yaml_fail(&root, err, "faults: is missing: a list of faults");
  return status == WM_OK ? read_list(&list, out, err) : status;
}

static wm_status read_doc(const char *path, wm_yaml *doc, wm_faults *out, wm_error *err) {
  (void)snprintf(out->path, sizeof out->path, "%s", path);
  wm_status status = read_root(doc, out, err);
  wm_yaml_free(doc);
  if (status != WM_OK) wm_faults_free(out);
  return status;
}

wm_status wm_faults_load(const char *path, wm_faults *out, wm_error *err) {
  wm_yaml *doc;
  memset(out, 0, sizeof *out);
  wm_status status = wm_yaml_load(path, &doc, err);
  return status == WM_OK ? read_doc(path, doc, out, err) : status;
}

wm_status wm_faults_parse(const char *text_, size_t length, const char *path, wm_faults *out, wm_error *err) {
  wm_yaml *doc;
  memset(out, 0, sizeof *out);
  wm_status status = wm_yaml_parse(text_, length, path, &doc, err);
  return status == WM_OK ? read_doc(path, doc, out, err) : status;
}

void wm_faults_free(wm_faults *self) {
  free(self->fault);
  memset(self, 0, sizeof *self);
}
