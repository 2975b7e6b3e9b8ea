// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/causes.h"
#include "cli/check/check.h"
#include "cli/check/facts.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "fusion/assembly.h"
#include "fusion/choice.h"
#include "fusion/pipeline.h"
#include "live/robot.h"
#include "rt/arena.h"
#include "rt/clock.h"

static const char kHelp[] =
    "usage: waymark check CONFIG [RECORDING] [options]\n"
    "\n"
    "Checks a configuration before driving: its keys and files; without a recording, the robot's devices. With a\n"
    "recording it drives the recording as a replay does and judges the fit: shares of updates that were refused and "
    "of\n"
    "time lost, size of the innovations, calibration, time spans of the sources, units, landmarks. Where observations\n"
    "contradict the poses or the calibration `waymark causes` tries the usual mistakes (signs, units, axes, "
    "mountings,\n"
    "clocks, identities, wheels) and names the one that explains them. Prints the facts, then a line for each finding\n"
    "with its fix. Exit code 2 where something has to be corrected first.\n"
    "\n"
    "  --landmarks FILE    instead of the recording's map\n"
    "  --calibration FILE  instead of the recording's\n"
    "  --map FILE          a map.yaml instead of the recording's\n"
    "  --json              facts and findings, for programs\n"
    "  --quick             without the search for the mistake that explains them\n"
    "  --apply FOLDER      a corrected copy of the recording, and of the configuration where that has the mistake,\n"
    "                      if a cause is found; the originals stay\n"
    "\n"
    "example:\n"
    "  waymark check config/datasets/starry-night-plan.yaml RECORDING\n"
    "  waymark check config/robot.yaml first-drive --apply first-drive-corrected\n";

// Printed beside the findings; not with --json.
static int tells_facts = 1;
__attribute__((format(printf, 1, 2))) static void fact(const char *format, ...) {
  if (!tells_facts) return;
  va_list arguments;
  va_start(arguments, format);
  (void)vprintf(format, arguments);
  va_end(arguments);
}

static void print_start(const wm_assembly *assembly) {
  const wm_start *start = &assembly->setup.start;
  if (wm_assembly_lacks_start(assembly)) {
    fact("start        unknown: %s\n", wm_assembly_lacks_start(assembly));
    return;
  }
  if (isnan(start->p_m[0]) || isnan(start->p_m[1]) || isnan(start->heading_rad)) {
    fact("start        unknown%s: the estimator has to find it\n", isnan(start->p_m[0]) ? "" : " in part");
    return;
  }
  fact("start        x %.3f m, y %.3f m, heading %.1f deg; sigma %.3f m, %.2f deg\n", start->p_m[0], start->p_m[1],
       start->heading_rad * 180 / M_PI, start->sigma_xy_m, start->sigma_heading_rad * 180 / M_PI);
}

static void print_map(const wm_raster *map, const char *path) {
  if (!map) return;
  fact("map          %s: %u x %u pixels of %.4f m (%.1f x %.1f m)%s%s\n", path, map->width_px, map->height_px,
       map->resolution_m, map->width_px * map->resolution_m, map->height_px * map->resolution_m,
       map->edges ? "" : ", no edges", map->drivable ? "" : ", no drivable");
}

// By its column, where a table gives it: "left of ticks.csv".
static void print_quantity(const wm_assembly *assembly, unsigned quantity, int is_first) {
  const char *between = is_first ? "" : ", ";
  for (size_t i = 0; i < assembly->source_count; i++) {
    const wm_assembled_source *s = &assembly->sources[i];
    const char *column = motion_data_column(s->name, quantity);
    if (column && !((s->drops >> quantity) & 1u)) {
      fact("%s%s of %s.csv", between, column, s->name);
      return;
    }
  }
  fact("%s%s (CAN)", between, wm_quantity_name(quantity));
}

static void print_driving(const wm_assembly *assembly) {
  const wm_driving *driving = &assembly->driving;
  int count = 0;
  fact("driven by    ");
  if (!(driving->kinds & WM_MOTION_EVENTS)) {
    fact("nothing; the velocity is estimated: a row of the trajectory at each stamp\n");
    return;
  }
  if (!(driving->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES))) {
    fact("%s: a row of the trajectory at each\n",
         driving->kinds & WM_TWIST_EVENTS ? "twists (motion*.csv)" : "increments (increments.csv)");
    return;
  }
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if ((driving->quantities >> q) & 1u) print_quantity(assembly, q, count++ == 0);
  fact(": a row of the trajectory at each\n");
}

static void print_quantities(uint32_t quantities) {
  if (quantities == 0) return;
  fact("measured    ");
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if ((quantities >> q) & 1u) fact(" %s", wm_quantity_name(q));
  fact("\n");
}

// A name that is nearly a known one is a mistake; other notes may be intended.
static void take_note(void *context, wm_note note, const char *text) {
  static const struct {
    wm_finding_id id;
    wm_severity severity;
  } kOf[] = {[WM_NOTE_FILE] = {WM_FOUND_FILE_NOTE, WM_SEVERITY_NOTE},
             [WM_NOTE_UNUSED] = {WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE},
             [WM_NOTE_MISSPELT] = {WM_FOUND_MISSPELT_NAME, WM_SEVERITY_BAD},
             [WM_NOTE_SENSOR_UNKNOWN] = {WM_FOUND_SENSOR_UNKNOWN, WM_SEVERITY_NOTE},
             [WM_NOTE_SENSOR_MISSPELT] = {WM_FOUND_SENSOR_UNKNOWN, WM_SEVERITY_BAD}};
  wm_find(context, kOf[note].id, kOf[note].severity, "files", NULL, "%s", text);
}

// With --json: the facts as an object, printed at the end; NULL: none.
static char *json_facts;
static char *json_causes;  // likewise: the answer of the engine for causes, as it gave it
static void keep_facts(const drive_facts *facts) {
  size_t bytes;
  FILE *to = open_memstream(&json_facts, &bytes);
  if (!to) return;
  facts_json(facts, to);
  (void)fclose(to);
}

// ── a recording, driven ─────────────────────────────────────────────────────────────────────────────────────────────

typedef struct checked {
  wm_recording *recording;
  wm_findings *found;
  int is_quick;  // without the search for causes
  causes_question question;
  source_data sources;
  drive_evidence evidence;
} checked;

static void print_setup(const wm_assembly *assembly, wm_recording *recording) {
  fact("recording    %s", wm_recording_name(recording));
  if (isfinite(wm_recording_duration_s(recording))) fact(", %.1f s", wm_recording_duration_s(recording));
  fact("\nsetup        %zu sensors, %zu landmarks\n", assembly->setup.sensor_count, assembly->setup.landmark_count);
  print_map(assembly->setup.map, assembly->map_path);
  print_start(assembly);
}

static void check_setup(const wm_assembly *assembly, wm_recording *recording, wm_status status, wm_findings *found) {
  print_setup(assembly, recording);
  check_calibration(assembly, found);
  check_landmarks(&assembly->setup, found);
  check_map(assembly, found);
  if (status != WM_OK) return;
  print_quantities(wm_recording_quantities(recording));
  print_driving(assembly);
}

static void assembled(void *context, const wm_assembly *assembly, wm_status status) {
  checked *self = context;
  check_setup(assembly, self->recording, status, self->found);
  source_data_init(&self->sources, assembly);
}

static void print_memory(void *context, const wm_arena_need *needs, size_t count) {
  (void)context;
  fact("memory       %.2f MB:", (double)wm_arena_sum(needs, count) * 1e-6);
  for (size_t i = 0; i < count; i++) fact(" %s %.3f", needs[i].name, (double)needs[i].bytes * 1e-6);
  fact("\n");
}

static void arrived(void *context, const wm_event *event) {
  checked *self = context;
  source_data_take(&self->sources, event);
}

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)bytes;
  evidence_put(&((checked *)context)->evidence, kind, record);
}

// Which mistake in the files explains what was found? The engine that answers is the desk's.
static void ask_for_causes(checked *self) {
  causes_answer answer;
  const size_t consequences = self->found->count;
  for (size_t i = 0; i < consequences; i++)
    self->question.clocks_apart |= self->found->at[i].id == WM_FOUND_CLOCK_DRIFTS;
  causes_ask(&self->question, self->found, &answer);
  if (!answer.is_installed) {
    fact(
        "causes       not searched: waymark-causes is not installed here; at a desk with Waymark's Python package, "
        "check\n"
        "             tries the usual mistakes in the files, and names the one that explains these findings\n");
    return;
  }
  if (!answer.is_answered) {
    fact("causes       not searched: waymark-causes ended without an answer\n");
    return;
  }
  fact("trials       %" PRIu64 " usual mistakes tried: %s\n", answer.rows,
       answer.is_found       ? "found what explains the observations"
       : answer.is_undecided ? "several explain the observations alike"
                             : "none of them explains the observations");
  if (answer.applied[0][0])
    fact("applied      %s: the corrected recording; all other files are links\n", answer.applied[0]);
  if (answer.applied[1][0]) fact("applied      %s: the configuration for it\n", answer.applied[1]);
  wm_findings_to_front(self->found, consequences);
  json_causes = answer.json;
}

// Whether a finding from this place on is one that a mistake of the setup may explain: a state of calibration that
// ended far off, a pose that is doubted, or what is bad. Not one of a clock, of a counter, or of data that are not
// used, which name what is wrong themselves.
static int may_have_a_cause(const wm_findings *found, size_t from) {
  for (size_t i = from; i < found->count; i++) {
    const wm_finding_id id = found->at[i].id;
    const int says_it = id == WM_FOUND_DATA_UNUSED || id == WM_FOUND_ROWS_UNUSED || id == WM_FOUND_CLOCK_JUMPED ||
                        id == WM_FOUND_CLOCK_COARSE || id == WM_FOUND_COUNTER_RESTARTS;
    const int is_bad = found->at[i].severity == WM_SEVERITY_BAD && !says_it;
    if (is_bad || id == WM_FOUND_CALIBRATION_OFF || id == WM_FOUND_POSE_DOUBTFUL) return 1;
  }
  return 0;
}

static void ended(void *context, const wm_assembly *assembly, const wm_run_report *report) {
  checked *self = context;
  const size_t before = self->found->count;
  source_data_judge(&self->sources, wm_recording_quantities(self->recording), &report->health, self->found);
  const uint64_t due = report->messages_due;
  const drive_facts facts = {assembly, self->sources.facts, &self->evidence, report->recorded_s, due};
  if (tells_facts)
    facts_print(&facts, stdout);
  else
    keep_facts(&facts);
  if (tells_facts) comparisons_print(&self->sources.channels, assembly, stdout);
  evidence_judge(&self->evidence, assembly, &report->health, due, self->found);
  check_observable(&self->evidence, assembly, &report->health, self->found);
  wm_health_map_findings(&report->health, self->found);
  clock_data_judge_unused(&self->sources.clocks, &report->health, self->found);
  check_unused(&self->evidence, &self->sources, &report->health, wm_recording_quantities(self->recording), self->found);
  if (may_have_a_cause(self->found, before) && !self->is_quick) ask_for_causes(self);
}

// Where the configuration names no estimator: which one it is, and what is wrong with its parameters.
static wm_status choose_estimator(wm_config *config, wm_recording *recording, wm_findings *found, wm_error *err) {
  if (config->estimator) return WM_OK;
  const wm_status status = wm_choose_estimator(config, recording, NULL, NULL, err);
  if (status != WM_OK) return status;
  fact("estimator    %s (%s); chosen: %s\n", config->estimator->name, config->estimator->about,
       config->estimator_because);
  check_config(config, found);
  return WM_OK;
}

static void check_recording(wm_config *config, const causes_question *question, int is_quick, wm_findings *found) {
  static checked self;
  static wm_run_report report;
  wm_error err = {0};
  self.found = found;
  self.question = *question;
  self.is_quick = is_quick;
  wm_status status =
      wm_recording_open(question->recording, &config->overrides, take_note, found, &self.recording, &err);
  if (status != WM_OK) {
    wm_find_error(found, "recording", &err);
    return;
  }
  status = choose_estimator(config, self.recording, found, &err);
  if (status != WM_OK) {
    wm_find_error(found, "config", &err);
    wm_recording_close(self.recording);
    return;
  }
  progress_line progress;
  progress_begin(&progress);
  const wm_replay_watch watch = {
      .context = &self, .assembled = assembled, .memory = print_memory, .arrived = arrived, .put = put, .ended = ended};
  const wm_replay_options options = {
      .watch = &watch, .seed = 1, .progress = progress_show, .progress_context = &progress};
  status = wm_replay_recording(config, self.recording, &options, &report, &err);
  progress_end(&progress);
  if (status != WM_OK) wm_find_error(found, "setup", &err);
  wm_recording_close(self.recording);
  source_data_free(&self.sources);
}

// ── a robot's own devices ───────────────────────────────────────────────────────────────────────────────────────────

// How much memory a run takes, and takes it: detectors need theirs to start.
static wm_status take_memory(wm_assembly *assembly, wm_arena *arena, wm_error *err) {
  static wm_pipeline pipeline;
  wm_arena_need needs[WM_PIPELINE_NEEDS + WM_VISION_NEEDS];
  wm_pipeline_needs(&pipeline, assembly, needs);
  size_t count = WM_PIPELINE_NEEDS + wm_vision_needs(assembly->vision, needs + WM_PIPELINE_NEEDS);
  print_memory(NULL, needs, count);
  wm_status status = wm_arena_fill(arena, needs, count, 0, err);
  return status == WM_OK ? wm_vision_start(assembly->vision, err) : status;
}

static void check_devices(wm_config *config, wm_findings *found) {
  static wm_assembly assembly;
  static const source_facts kNone;
  wm_error err = {0};
  wm_recording *recording;
  wm_status status = wm_robot_open(config, take_note, found, &recording, &err);
  if (status != WM_OK) {
    wm_find_error(found, "devices", &err);
    return;
  }
  wm_arena arena = {0};
  status = choose_estimator(config, recording, found, &err);
  if (status != WM_OK) {
    wm_find_error(found, "config", &err);
    wm_recording_close(recording);
    return;
  }
  status = wm_assemble(config, recording, 1, &assembly, &err);
  check_setup(&assembly, recording, status, found);
  if (status == WM_OK) status = take_memory(&assembly, &arena, &err);
  for (size_t i = 0; status == WM_OK && tells_facts && i < assembly.source_count; i++)
    facts_print_source(&assembly.sources[i], &kNone, stdout);
  if (status == WM_OK)
    check_computer(config, arena.bytes, found);
  else
    wm_find_error(found, "setup", &err);
  wm_assembly_close(&assembly);
  wm_arena_close(&arena);
  wm_recording_close(recording);
}

static int tell(const wm_findings *found) {
  int is_good = wm_findings_of(found, WM_SEVERITY_BAD) == 0;
  if (tells_facts) {
    wm_findings_print(found, stdout);
    if (is_good) (void)puts("good");
  } else {
    (void)printf("{\n  \"good\": %s,\n  \"facts\": %s,\n  \"causes\": %s,\n  \"findings\": ",
                 is_good ? "true" : "false", json_facts ? json_facts : "null", json_causes ? json_causes : "null");
    free(json_facts);
    free(json_causes);
    json_facts = json_causes = NULL;
    wm_findings_json(found, stdout);
    (void)fputs("\n}\n", stdout);
  }
  return is_good ? EXIT_DONE : EXIT_USAGE;  // every finding is to be resolved before driving
}

int command_check(int argc, char *const *argv) {
  const char *words[2], *landmarks = NULL, *calibration = NULL, *map = NULL, *apply_to = NULL;
  int help = 0, as_json = 0, is_quick = 0;
  const option options[] = {{"--landmarks", OPTION_TEXT, &landmarks},
                            {"--calibration", OPTION_TEXT, &calibration},
                            {"--map", OPTION_TEXT, &map},
                            {"--json", OPTION_FLAG, &as_json},
                            {"--quick", OPTION_FLAG, &is_quick},
                            {"--apply", OPTION_TEXT, &apply_to},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  static wm_findings found;
  wm_error err = {0};
  size_t count;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], words, 2, &count, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (count == 0) {
    (void)fprintf(stderr, "waymark: check needs a configuration\n\n%s", kHelp);
    return EXIT_USAGE;
  }
  tells_facts = !as_json;
  wm_config config;
  if (wm_config_load_undecided(words[0], &config, &err) != WM_OK) {
    wm_find_error(&found, "config", &err);
    return tell(&found);
  }
  if (config.estimator)
    fact("config       %s: estimator %s (%s)\n", words[0], config.estimator->name, config.estimator->about);
  else
    fact("config       %s: estimator by sources and maps\n", words[0]);
  if (config.floor.floor.name[0])
    fact("floor        %s%s%s\n", config.floor.index < 0 ? "unknown" : config.floor.floor.name,
         config.floor.version[0] ? ", version " : ", without versions", config.floor.version);
  wm_status status = override_path(config.overrides.landmarks, landmarks, &err);
  if (status == WM_OK) status = override_path(config.overrides.calibration, calibration, &err);
  if (status == WM_OK) status = override_path(config.overrides.map, map, &err);
  if (status != WM_OK) {
    wm_config_free(&config);
    return complain(&err);
  }
  if (config.estimator || (count == 1 && wm_devices_count(&config.devices) == 0)) check_config(&config, &found);
  if (count > 1)
    check_recording(&config, &(causes_question){words[0], words[1], landmarks, calibration, map, apply_to, 0}, is_quick,
                    &found);
  else if (wm_devices_count(&config.devices) > 0)
    check_devices(&config, &found);
  wm_config_free(&config);
  return tell(&found);
}
