// SPDX-License-Identifier: Apache-2.0
// What the recording has and the run does not use, and why.
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

// A choice of the motion's parameters as configured, `otherwise` where there is none of this name.
static int32_t choice_of(const wm_assembly *assembly, const char *key, int32_t otherwise) {
  const wm_param_table *table = &wm_motion_params_table;
  int32_t choice = otherwise;
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, key) == 0)
      memcpy(&choice, (const char *)assembly->setup.motion + table->params[i].offset, sizeof choice);
  return choice;
}

static int is_choice(const wm_assembly *assembly, const char *key, const char *name) {
  const wm_param_table *table = &wm_motion_params_table;
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, key) == 0)
      return strcmp(table->params[i].names[choice_of(assembly, key, 0)], name) == 0;
  return 0;
}

// A robot obeys a command late and in part, so that no gyro is taken beside one.
static void gyro_beside_commands(const wm_assembly *assembly, const channels *seen, wm_findings *out) {
  const channel *gyro = NULL, *commands = NULL;
  for (size_t i = 0; i < seen->count; i++) {
    const channel *c = &seen->at[i];
    if (c->kind == CHANNEL_YAW_RATE) gyro = c;
    if (c->kind == CHANNEL_TWIST_TURN && seen->twists[c->source].kind == WM_ROWS_COMMANDS) commands = c;
  }
  if (!gyro || !commands || is_choice(assembly, "twist", "measured")) return;
  wm_find(out, WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE, wm_assembly_source_name(assembly, gyro->source),
          "`motion: {twist: measured}` if the rows are measured; else give what the wheels measure",
          "the gyro is not used: the rows of %s repeat until they change, and are taken for commands",
          wm_assembly_source_name(assembly, commands->source));
}

// A gyro is worth more than any other motion sensor: bound, but not taken, it is a mistake of the configuration.
static void gyro(const wm_assembly *assembly, uint32_t bound, wm_findings *out) {
  const int32_t model = choice_of(assembly, "model", WM_MOTION_AUTO);
  const int is_read = model == WM_MOTION_AUTO ? !(assembly->kinds & WM_EVENT_BIT(WM_EVENT_INCREMENT))
                                              : model == WM_MOTION_SPEED_YAW_RATE;
  if (!((bound >> WM_Q_YAW_RATE) & 1u) || is_read) return;
  wm_find(out, WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE, "can",
          "motion: {model: auto} takes the best that is there; or leave the signal out of can-signals.yaml",
          "yaw_rate is bound, but motion.model does not read it");
}

static void sources(const wm_assembly *assembly, wm_findings *out) {
  const int takes_observations = wm_assembly_observes(assembly);
  for (size_t i = 0; i < assembly->unused_count; i++) {
    const wm_unused *one = &assembly->unused[i];
    char fix[WM_FINDING_FIX_MAX];
    if (one->why == WM_UNUSED_WANTED) continue;
    (void)snprintf(fix, sizeof fix,
                   "choose an estimator that takes it (docs/choose.md), or write `sources: [{name: %s, use: false}]`",
                   one->name);
    wm_find(out, WM_FOUND_DATA_UNUSED,
            one->why == WM_UNUSED_BY_ESTIMATOR && takes_observations ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, one->name,
            one->why == WM_UNUSED_BY_ESTIMATOR ? fix : "leave its signal out of can-signals.yaml, if that is intended",
            "is not used: %s", one->text);
  }
}

// Observations that arrive, of which none was ever fused or refused: they have nothing to be compared with.
static void observations(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health,
                         wm_findings *out) {
  for (size_t i = 0; i < assembly->source_count && i < health->source_count; i++) {
    const wm_source_health *s = &health->sources[i];
    uint64_t used = s->fused;
    for (unsigned k = 0; k < WM_RESIDUAL_COUNT; k++)
      used += self->residuals[i][k].fused + self->residuals[i][k].refused;
    if ((assembly->sources[i].kinds & WM_MOTION_EVENTS) || s->received < 20 || used > 0) continue;
    unsigned verdict = 1;
    for (unsigned k = 2; k < WM_VERDICT_COUNT; k++)
      if (s->rejected[k] > s->rejected[verdict]) verdict = k;
    wm_find(out, WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE, s->name,
            assembly->setup.landmark_count == 0
                ? "give landmarks.csv (docs/landmarks.md), or map them: `estimator: slam`"
                : NULL,
            "none of its %" PRIu64 " observations was used (%s)", s->received,
            s->rejected[verdict] > 0 ? wm_verdict_name(verdict) : "no pose, or nothing to compare them with");
  }
}

void check_unused(const drive_evidence *evidence, const source_data *data, const wm_health *health, uint32_t bound,
                  wm_findings *out) {
  const wm_assembly *assembly = data->assembly;
  gyro_beside_commands(assembly, &data->channels, out);
  sources(assembly, out);
  if (assembly->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES)) gyro(assembly, bound, out);
  observations(evidence, assembly, health, out);
}
