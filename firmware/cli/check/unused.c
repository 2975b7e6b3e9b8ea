// SPDX-License-Identifier: Apache-2.0
// What the recording has and the run does not use, and why.
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

// motion.model as configured.
static int32_t model_of(const wm_assembly *assembly) {
  const wm_param_table *table = &wm_motion_params_table;
  int32_t model = WM_MOTION_AUTO;
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, "model") == 0)
      memcpy(&model, (const char *)assembly->setup.motion + table->params[i].offset, sizeof model);
  return model;
}

// A gyro is worth more than any other motion sensor: bound, but not taken, it is a mistake of the configuration.
static void gyro(const wm_assembly *assembly, uint32_t bound, wm_findings *out) {
  const int32_t model = model_of(assembly);
  const int is_read = model == WM_MOTION_AUTO ? !(assembly->kinds & WM_EVENT_BIT(WM_EVENT_INCREMENT))
                                              : model == WM_MOTION_SPEED_YAW_RATE;
  if (!((bound >> WM_Q_YAW_RATE) & 1u) || is_read) return;
  wm_find(out, WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE, "can",
          "motion: {model: auto} takes the best that is there; or leave the signal out of can-signals.yaml",
          "yaw_rate is bound, but motion.model does not read it");
}

static void sources(const wm_assembly *assembly, wm_findings *out) {
  for (size_t i = 0; i < assembly->unused_count; i++) {
    const char *line = assembly->unused[i], *why = strstr(line, ": ");
    char name[WM_FINDING_ABOUT_MAX];
    if (!why || strstr(why, "use: false")) continue;  // wanted so
    (void)snprintf(name, sizeof name, "%.*s", (int)(why - line), line);
    wm_find(out, WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE, name,
            "choose an estimator that takes them (docs/estimators.md), or write `use: false` for this source",
            "is not used: %s", why + 2);
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

void check_unused(const drive_evidence *evidence, const wm_assembly *assembly, const wm_health *health, uint32_t bound,
                  wm_findings *out) {
  sources(assembly, out);
  if (assembly->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES)) gyro(assembly, bound, out);
  observations(evidence, assembly, health, out);
}
