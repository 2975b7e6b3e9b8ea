// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/check/check.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "fusion/assembly.h"
#include "fusion/pipeline.h"
#include "live/robot.h"
#include "rt/arena.h"

static const char kHelp[] =
    "usage: waymark check CONFIG [RECORDING] [options]\n"
    "\n"
    "Says what can be known before driving: whether the configuration is right and can be meant; with a recording,\n"
    "whether calibration, map, landmarks and CAN binding are those of a robot, and whether its data agree with them.\n"
    "Without one, the same for the robot's devices, if it has any. Then the facts, and a line for each finding with "
    "its\n"
    "mend. Exit code 2 where something must be mended first.\n"
    "\n"
    "  --landmarks FILE    instead of the recording's map\n"
    "  --calibration FILE  instead of the recording's\n"
    "  --map FILE          a map.yaml instead of the recording's\n"
    "  --json              the findings, for programs\n"
    "\n"
    "example:\n"
    "  waymark check config/starry-night-plan.yaml RECORDING\n";

// Printed beside the findings; not with --json.
static int tells_facts = 1;
__attribute__((format(printf, 1, 2))) static void fact(const char *format, ...) {
  if (!tells_facts) return;
  va_list arguments;
  va_start(arguments, format);
  (void)vprintf(format, arguments);
  va_end(arguments);
}

static void print_start(const wm_start *start) {
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

static void print_driving(const wm_driving *driving) {
  fact("driven by    ");
  if (!(driving->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES))) {
    fact("twists (motion*.csv): a row of the trajectory at each\n");
    return;
  }
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if ((driving->quantities >> q) & 1u) fact("%s ", wm_quantity_name(q));
  fact("(CAN): a row of the trajectory at each\n");
}

static void print_quantities(uint32_t quantities) {
  if (quantities == 0) return;
  fact("CAN gives   ");
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if ((quantities >> q) & 1u) fact(" %s", wm_quantity_name(q));
  fact("\n");
}

static void print_source(const wm_assembled_source *s, const source_facts *facts) {
  double seconds = facts->events > 1 ? wm_seconds_between(facts->first_ns, facts->last_ns) : 0;
  fact("source       %-20s %8" PRIu64 " data", s->name, facts->events);
  if (seconds > 0) fact(", %.1f a second", (double)(facts->events - 1) / seconds);
  if (facts->events > 0) fact(", at most %.0f ms late", fmax(0, (double)facts->latest_ns * 1e-6));
  fact("\n");
}

// Takes the memory of a replay, because detectors need theirs while their sources are read, and returns its size.
static wm_status take_memory(wm_assembly *assembly, wm_arena *arena, wm_error *err) {
  static wm_pipeline pipeline;
  wm_arena_need needs[WM_PIPELINE_NEEDS + WM_VISION_NEEDS];
  wm_pipeline_needs(&pipeline, assembly, needs);
  size_t count = WM_PIPELINE_NEEDS + wm_vision_needs(assembly->vision, needs + WM_PIPELINE_NEEDS);
  fact("memory       %.2f MB:", (double)wm_arena_sum(needs, count) * 1e-6);
  for (size_t i = 0; i < count; i++) fact(" %s %.3f", needs[i].name, (double)needs[i].bytes * 1e-6);
  fact("\n");
  wm_status status = wm_arena_fill(arena, needs, count, 0, err);
  return status == WM_OK ? wm_vision_start(assembly->vision, err) : status;
}

static void take_note(void *context, const char *text) {
  find(context, FINDING_NOTE, "files", "mend it there, or leave it if it is meant so", "%s", text);
}

static void check_sources(const wm_assembly *assembly, uint32_t bound, findings *found) {
  for (size_t i = 0; i < assembly->source_count; i++) {
    const wm_assembled_source *s = &assembly->sources[i];
    source_facts facts;
    if (s->source->is_live) {
      fact("source       %-20s a device (`waymark doctor` finds out whether it is there)\n", s->name);
      continue;
    }
    check_source(assembly, s, bound, &facts, found);
    print_source(s, &facts);
  }
}

// With a recording's folder, or with the robot's own devices (NULL).
static void check_recording(const wm_config *config, const char *dir, findings *found) {
  wm_error err = {0};
  wm_recording *recording;
  wm_status status = dir ? wm_recording_open(dir, &config->overrides, take_note, found, &recording, &err)
                         : wm_robot_open(config, take_note, found, &recording, &err);
  if (status != WM_OK) {
    find_error(found, dir ? "recording" : "devices", &err);
    return;
  }
  static wm_assembly assembly;
  wm_arena arena = {0};
  status = wm_assemble(config, recording, 1, &assembly, &err);
  const wm_setup *setup = &assembly.setup;
  fact("recording    %s", wm_recording_name(recording));
  if (isfinite(wm_recording_duration_s(recording))) fact(", %.1f s", wm_recording_duration_s(recording));
  fact("\nsetup        %zu sensors, %zu landmarks\n", setup->sensor_count, setup->landmark_count);
  print_map(setup->map, assembly.map_path);
  print_start(&setup->start);
  check_calibration(&assembly, found);
  check_landmarks(setup, found);
  check_map(&assembly, found);
  if (status == WM_OK) {
    print_quantities(wm_recording_quantities(recording));
    print_driving(&assembly.driving);
    status = take_memory(&assembly, &arena, &err);
  }
  if (status == WM_OK) check_sources(&assembly, wm_recording_quantities(recording), found);
  if (status == WM_OK && !dir) check_computer(config, arena.bytes, found);
  for (size_t i = 0; i < assembly.unused_count; i++) fact("not used     %s\n", assembly.unused[i]);
  if (status != WM_OK) find_error(found, "setup", &err);
  wm_assembly_close(&assembly);
  wm_arena_close(&arena);
  wm_recording_close(recording);
}

static int tell(const findings *found) {
  int is_good = findings_of(found, FINDING_BAD) == 0;
  if (tells_facts) {
    findings_print(found, stdout);
    if (is_good) (void)puts("good");
  } else {
    (void)printf("{\n  \"good\": %s,\n  \"findings\": ", is_good ? "true" : "false");
    findings_json(found, stdout);
    (void)fputs("\n}\n", stdout);
  }
  return is_good ? EXIT_DONE : EXIT_USAGE;  // every finding is to be resolved before driving
}

int command_check(int argc, char *const *argv) {
  const char *words[2], *landmarks = NULL, *calibration = NULL, *map = NULL;
  int help = 0, as_json = 0;
  const option options[] = {{"--landmarks", OPTION_TEXT, &landmarks},
                            {"--calibration", OPTION_TEXT, &calibration},
                            {"--map", OPTION_TEXT, &map},
                            {"--json", OPTION_FLAG, &as_json},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  static findings found;
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
  if (wm_config_load(words[0], &config, &err) != WM_OK) {
    find_error(&found, "config", &err);
    return tell(&found);
  }
  fact("config       %s: estimator %s (%s)\n", words[0], config.estimator->name, config.estimator->about);
  wm_status status = override_path(config.overrides.landmarks, landmarks, &err);
  if (status == WM_OK) status = override_path(config.overrides.calibration, calibration, &err);
  if (status == WM_OK) status = override_path(config.overrides.map, map, &err);
  if (status != WM_OK) {
    wm_config_free(&config);
    return complain(&err);
  }
  check_config(&config, &found);
  if (count > 1 || config.devices.can_count + config.devices.camera_count > 0)
    check_recording(&config, count > 1 ? words[1] : NULL, &found);
  wm_config_free(&config);
  return tell(&found);
}
