// SPDX-License-Identifier: Apache-2.0
#include "fusion/choice.h"

#include <stdio.h>
#include <string.h>

#define BIT(kind) WM_EVENT_BIT(WM_EVENT_##kind)
#define SEEN (BIT(SIGHTING) | BIT(MARKER))
#define OBSERVED (SEEN | BIT(POSITION) | BIT(HEADING) | BIT(LOCALIZED) | BIT(STEREO) | BIT(POINTS))
#define ON_WHEELS (BIT(QUANTITIES) | BIT(TWIST2) | BIT(INCREMENT))

// What a row asks of the facts beside an observation.
typedef enum { ALWAYS, WITH_MAP, WITHOUT_MAP, WITH_LANDMARKS, WITHOUT_LANDMARKS, IN_SPACE, WITH_LINES } condition;

typedef struct row {
  uint32_t any_of;  // WM_EVENT_BIT; one of these is observed. 0: nothing need be
  condition when;
  const char *estimator;  // NULL: it can't be decided
  const char *why;        // or what to write
} row;

// The first row that fits. Edge points come first: their estimator alone searches a floor plan.
static const row kRows[] = {
    {BIT(POINTS), WITH_MAP, "edge_mcl", "edge points on the floor, and a floor plan"},
    {BIT(POINTS), WITHOUT_MAP, NULL,
     "edge points need a floor plan: write `map: FILE` (a map.yaml), or leave their detector out"},
    {BIT(STEREO), ALWAYS, "stereo_ekf", "points in the pictures of a stereo pair"},
    {OBSERVED, IN_SPACE, "stereo_ekf", "depths, or motion in six degrees of freedom alone: a vehicle in space"},
    {SEEN, WITH_LINES, "slam", "upright lines, whose places are unknown"},
    {SEEN, WITH_LANDMARKS, "landmark_ekf", "landmarks whose places are known"},
    {SEEN, WITHOUT_LANDMARKS, "slam", "landmarks whose places are unknown"},
    {BIT(POSITION) | BIT(HEADING) | BIT(LOCALIZED), ALWAYS, "landmark_ekf",
     "positions, headings or another localizer's poses, without landmarks"},
    {WM_MOTION_EVENTS, ALWAYS, "odometry", "motion alone: no source observes a place"},
    {0, ALWAYS, NULL, "no source is bound: name the robot's `devices`, give a recording, or write `estimator: NAME`"},
};

static int fulfils(const wm_choice_facts *facts, condition when) {
  switch (when) {
    case WITH_MAP: return facts->has_map;
    case WITHOUT_MAP: return !facts->has_map;
    case WITH_LANDMARKS: return facts->has_landmarks;
    case WITHOUT_LANDMARKS: return !facts->has_landmarks;
    case WITH_LINES: return facts->tracks_unknown;
    case IN_SPACE: return facts->measures_depth || ((facts->kinds & BIT(TWIST6)) && !(facts->kinds & ON_WHEELS));
    case ALWAYS: break;
  }
  return 1;
}

const wm_estimator *wm_choose(const wm_choice_facts *facts, const char **why) {
  const row *at = kRows;
  while (at->any_of && (!(facts->kinds & at->any_of) || !fulfils(facts, at->when))) at++;
  *why = at->why;
  return at->estimator ? wm_estimator_find(at->estimator) : NULL;
}

static void add_sources(const wm_config *config, wm_recording *recording, wm_choice_facts *out) {
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  for (size_t i = 0; i < count; i++) {
    wm_source_config wanted;
    int rank;
    wm_config_source(config, sources[i]->name, &wanted, &rank);
    if (!wanted.use) continue;
    out->kinds |= sources[i]->kinds;
    out->measures_depth |= strcmp(sources[i]->name, "depth") == 0;
  }
  if (config->devices.sightings_by_lcm) out->kinds |= BIT(SIGHTING);  // a run opens it later
}

wm_status wm_choose_estimator(wm_config *config, wm_recording *recording, void (*say)(void *context, const char *line),
                              void *context, wm_error *err) {
  if (config->estimator && !config->estimator_because[0]) return WM_OK;
  wm_site *site = wm_recording_site(recording);
  size_t landmarks;
  (void)wm_site_landmarks(site, &landmarks);
  wm_choice_facts facts = {.has_map = wm_site_map_path(site)[0] != '\0', .has_landmarks = landmarks > 0};
  add_sources(config, recording, &facts);
  for (size_t i = 0; i < config->vision_count; i++) {
    facts.kinds |= config->vision[i].detector->gives;
    facts.tracks_unknown |= strcmp(config->vision[i].detector->name, "lines") == 0;
  }
  const char *why;
  const wm_estimator *chosen = wm_choose(&facts, &why);
  if (!chosen)
    return wm_fail(err, WM_BAD_CONFIG, "%s: estimator: is left out, and can't be chosen: %s", config->path, why);
  const wm_status status = wm_config_decide(config, chosen, why, err);
  if (status != WM_OK || !say) return status;
  char line[sizeof config->estimator_because + 64];
  (void)snprintf(line, sizeof line, "estimator %s is chosen: %s", chosen->name, why);
  say(context, line);
  wm_config_each_warning(config, say, context);
  return WM_OK;
}
