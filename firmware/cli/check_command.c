// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "options.h"
#include "waymark/arena.h"
#include "waymark/assembly.h"
#include "waymark/pipeline.h"
#include "waymark/robot.h"

static const char kHelp[] =
    "usage: waymark check CONFIG [RECORDING]\n"
    "\n"
    "Says what can be known before driving: whether the configuration is right and, with a recording, whether its\n"
    "calibration, map and CAN binding are, which sources there are and how often they speak, the start pose, the "
    "motion\n"
    "model's input and the memory that is needed. Without one, the same for the robot's devices, if it has any. Exit "
    "code 2 where something must be mended first.\n"
    "\n"
    "  --landmarks FILE    instead of the recording's map\n"
    "  --calibration FILE  instead of the recording's\n"
    "  --map FILE          a map.yaml instead of the recording's\n"
    "\n"
    "example:\n"
    "  waymark check config/starry-night-plan.yaml RECORDING\n";

static void print_start(const wm_start *start) {
  if (isnan(start->p_m[0]) || isnan(start->p_m[1]) || isnan(start->heading_rad)) {
    (void)printf("start        unknown%s: the estimator has to find it\n", isnan(start->p_m[0]) ? "" : " in part");
    return;
  }
  (void)printf("start        x %.3f m, y %.3f m, heading %.1f deg; sigma %.3f m, %.2f deg\n", start->p_m[0],
               start->p_m[1], start->heading_rad * 180 / M_PI, start->sigma_xy_m,
               start->sigma_heading_rad * 180 / M_PI);
}

static void print_map(const wm_raster *map, const char *path) {
  if (!map) return;
  (void)printf("map          %s: %u x %u pixels of %.4f m (%.1f x %.1f m)%s%s\n", path, map->width_px, map->height_px,
               map->resolution_m, map->width_px * map->resolution_m, map->height_px * map->resolution_m,
               map->edges ? "" : ", no edges", map->drivable ? "" : ", no drivable");
}

static void print_driving(const wm_driving *driving) {
  (void)printf("driven by    ");
  if (!(driving->kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES))) {
    (void)puts("twists (motion*.csv): a row of the trajectory at each");
    return;
  }
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if ((driving->quantities >> q) & 1u) (void)printf("%s ", wm_quantity_name(q));
  (void)puts("(CAN): a row of the trajectory at each");
}

static void print_quantities(uint32_t quantities) {
  if (quantities == 0) return;
  (void)printf("CAN gives   ");
  for (unsigned q = 0; q < WM_Q_COUNT; q++)
    if ((quantities >> q) & 1u) (void)printf(" %s", wm_quantity_name(q));
  (void)putchar('\n');
}

typedef struct source_facts {
  uint64_t events;
  wm_time_ns first_ns, last_ns, latest_ns;
} source_facts;

// Reads the source to its end: what it counts is then known.
static wm_status read_all(wm_source *source, source_facts *facts, wm_error *err) {
  *facts = (source_facts){0, WM_TIME_NONE, WM_TIME_NONE, INT64_MIN};
  static wm_event event;
  wm_status status;
  while ((status = source->ops->next(source, &event, err)) == WM_OK) {
    if (facts->events++ == 0) facts->first_ns = event.t_ns;
    facts->last_ns = event.t_ns;
    wm_time_ns late_ns;
    if (!__builtin_sub_overflow(event.arrival_ns, event.t_ns, &late_ns) && late_ns > facts->latest_ns)
      facts->latest_ns = late_ns;
  }
  return status == WM_END || status == WM_AGAIN ? WM_OK : status;
}

static wm_status print_source(const wm_assembled_source *s, wm_error *err) {
  source_facts facts;
  if (s->source->is_live) {
    (void)printf("source       %-20s a device (`waymark doctor` says whether it is there)\n", s->name);
    return WM_OK;
  }
  wm_status status = read_all(s->source, &facts, err);
  if (status != WM_OK) return status;
  double seconds = facts.events > 1 ? wm_seconds_between(facts.first_ns, facts.last_ns) : 0;
  (void)printf("source       %-20s %8" PRIu64 " data", s->name, facts.events);
  if (seconds > 0) (void)printf(", %.1f a second", (double)(facts.events - 1) / seconds);
  if (facts.events > 0) (void)printf(", at most %.0f ms late", fmax(0, (double)facts.latest_ns * 1e-6));
  (void)putchar('\n');
  const wm_source_counts *c = &s->source->counts;
  if (c->first_problem[0]) (void)printf("  note       %s (%" PRIu64 " like it)\n", c->first_problem, c->malformed);
  if (facts.events > 0 && facts.latest_ns > s->merge.lateness_max_ns)
    (void)printf("  note       later than lateness_max_ms (%.0f): %.0f would do\n",
                 (double)s->merge.lateness_max_ns * 1e-6, ceil((double)facts.latest_ns * 1e-7) * 10);
  return WM_OK;
}

// Says how much memory a replay takes, and takes it: detectors need theirs to read their sources.
static wm_status take_memory(wm_assembly *assembly, wm_arena *arena, wm_error *err) {
  static wm_pipeline pipeline;
  wm_arena_need needs[WM_PIPELINE_NEEDS + WM_VISION_NEEDS];
  wm_pipeline_needs(&pipeline, assembly, needs);
  size_t count = WM_PIPELINE_NEEDS + wm_vision_needs(assembly->vision, needs + WM_PIPELINE_NEEDS);
  (void)printf("memory       %.2f MB:", (double)wm_arena_sum(needs, count) * 1e-6);
  for (size_t i = 0; i < count; i++) (void)printf(" %s %.3f", needs[i].name, (double)needs[i].bytes * 1e-6);
  (void)putchar('\n');
  wm_status status = wm_arena_fill(arena, needs, count, 0, err);
  return status == WM_OK ? wm_vision_start(assembly->vision, err) : status;
}

// With a recording's folder, or with the robot's own devices (NULL).
static wm_status check_recording(const wm_config *config, const char *dir, wm_error *err) {
  wm_recording *recording;
  wm_status status = dir ? wm_recording_open(dir, &config->overrides, print_note, NULL, &recording, err)
                         : wm_robot_open(config, print_note, NULL, &recording, err);
  if (status != WM_OK) return status;
  static wm_assembly assembly;
  wm_arena arena = {0};
  status = wm_assemble(config, recording, 1, &assembly, err);
  if (status == WM_OK) {
    (void)printf("recording    %s", wm_recording_name(recording));
    if (isfinite(wm_recording_duration_s(recording))) (void)printf(", %.1f s", wm_recording_duration_s(recording));
    (void)putchar('\n');
    (void)printf("setup        %zu sensors, %zu landmarks\n", assembly.setup.sensor_count,
                 assembly.setup.landmark_count);
    print_map(assembly.setup.map, assembly.map_path);
    print_start(&assembly.setup.start);
    print_quantities(wm_recording_quantities(recording));
    print_driving(&assembly.driving);
    status = take_memory(&assembly, &arena, err);
    for (size_t i = 0; status == WM_OK && i < assembly.source_count; i++)
      status = print_source(&assembly.sources[i], err);
    for (size_t i = 0; i < assembly.unused_count; i++) (void)printf("not used     %s\n", assembly.unused[i]);
  }
  wm_assembly_close(&assembly);
  wm_arena_close(&arena);
  wm_recording_close(recording);
  return status;
}

int command_check(int argc, char *const *argv) {
  const char *words[2], *landmarks = NULL, *calibration = NULL, *map = NULL;
  int help = 0;
  const option options[] = {{"--landmarks", OPTION_TEXT, &landmarks},
                            {"--calibration", OPTION_TEXT, &calibration},
                            {"--map", OPTION_TEXT, &map},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
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
  wm_config config;
  wm_status status = wm_config_load(words[0], &config, &err);
  if (status != WM_OK) {
    (void)complain(&err);
    return EXIT_USAGE;
  }
  (void)printf("config       %s: estimator %s (%s)\n", words[0], config.estimator->name, config.estimator->about);
  status = override_path(config.overrides.landmarks, landmarks, &err);
  if (status == WM_OK) status = override_path(config.overrides.calibration, calibration, &err);
  if (status == WM_OK) status = override_path(config.overrides.map, map, &err);
  int has_devices = config.devices.can_count + config.devices.camera_count > 0;
  if (status == WM_OK && (count > 1 || has_devices))
    status = check_recording(&config, count > 1 ? words[1] : NULL, &err);
  wm_config_free(&config);
  if (status == WM_OK) {
    (void)puts("good");
    return EXIT_DONE;
  }
  (void)fflush(stdout);
  (void)complain(&err);
  return EXIT_USAGE;  // whatever it is, it has to be mended before driving
}
