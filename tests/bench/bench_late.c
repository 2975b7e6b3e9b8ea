// SPDX-License-Identifier: Apache-2.0
// A frame that arrives 150 or 250 ms late costs what a fresh one costs: no rollback, no second filter. The whole
// estimator's side (merge, odometry, landmark EKF, poses at 50 Hz) over the same minute of driving, its frames fresh or
// late; medians over interleaved rounds, and their ratios. Fails above 1.2.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fusion/pipeline.h"
#include "rt/arena.h"
#include "rt/clock.h"

#define MS WM_NS_PER_MS
#define SECONDS 60
#define MOTION_HZ 50
#define FRAME_HZ 10
#define SEEN 4
#define EVENTS (SECONDS * (MOTION_HZ + FRAME_HZ * SEEN))
#define ROUNDS 41  // one where the tests run it (WM_BENCH_SHORT), which judge no times

static const char kConfig[] =
    "format: waymark-config/1\nestimator: landmark_ekf\nmerge: {horizon_ms: 300, lateness_max_ms: 300}\n";
static wm_landmark landmarks[SEEN] = {{.id = 0, .p_m = {6, 0, 0}, .sigma_m = 0.01, .yaw_rad = NAN},
                                      {.id = 1, .p_m = {0, 6, 0}, .sigma_m = 0.01, .yaw_rad = NAN},
                                      {.id = 2, .p_m = {-6, 0, 0}, .sigma_m = 0.01, .yaw_rad = NAN},
                                      {.id = 3, .p_m = {0, -6, 0}, .sigma_m = 0.01, .yaw_rad = NAN}};
static wm_sensor sensor = {.name = "eye", .bearing_sigma_rad = 0.01, .range_sigma_m = 0.05};

static wm_event *events;

static int by_arrival(const void *a, const void *b) {
  const wm_event *x = a, *y = b;
  if (x->arrival_ns != y->arrival_ns) return x->arrival_ns < y->arrival_ns ? -1 : 1;
  if (x->source != y->source) return x->source < y->source ? -1 : 1;
  return x->seq < y->seq ? -1 : 1;
}

static void make_events(wm_time_ns late_ns) {
  const double v = 0.5, w = 0.25;
  size_t n = 0;
  for (uint32_t i = 0; i < SECONDS * MOTION_HZ; i++) {
    wm_event *e = &events[n++];
    memset(e, 0, WM_EVENT_SMALL_BYTES);
    e->kind = WM_EVENT_TWIST2;
    e->seq = i;
    e->t_ns = e->arrival_ns = (wm_time_ns)i * (WM_NS_PER_S / MOTION_HZ);
    e->as.twist2 = (wm_twist2){v, w};
  }
  for (uint32_t i = 0; i < SECONDS * FRAME_HZ; i++) {
    double t_s = (double)i / FRAME_HZ, h = w * t_s, x = v / w * sin(h), y = v / w * (1 - cos(h));
    for (uint32_t k = 0; k < SEEN; k++) {
      wm_event *e = &events[n++];
      memset(e, 0, WM_EVENT_SMALL_BYTES);
      e->kind = WM_EVENT_SIGHTING;
      e->source = 1;
      e->seq = i * SEEN + k;
      e->t_ns = (wm_time_ns)i * (WM_NS_PER_S / FRAME_HZ) + 3 * MS;
      e->arrival_ns = e->t_ns + late_ns;
      double dx = landmarks[k].p_m[0] - x, dy = landmarks[k].p_m[1] - y;
      e->as.sighting = wm_sighting_without_numbers();
      e->as.sighting.landmark_id = (int32_t)k;
      e->as.sighting.bearing_rad = remainder(atan2(dy, dx) - h, 2 * M_PI);
      e->as.sighting.range_m = sqrt(dx * dx + dy * dy);
    }
  }
  qsort(events, n, sizeof *events, by_arrival);
}

static void forget(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)context, (void)kind, (void)record, (void)bytes;
}

// Nanoseconds a drive; *fused says what became of its sightings.
static wm_time_ns drive(const wm_assembly *assembly, uint64_t *fused) {
  static wm_pipeline pipeline;
  wm_arena arena;
  wm_arena_need needs[WM_PIPELINE_NEEDS];
  wm_error err;
  wm_pipeline_needs(&pipeline, assembly, needs);
  if (wm_arena_fill(&arena, needs, WM_PIPELINE_NEEDS, 0, &err) != WM_OK ||
      wm_pipeline_start(&pipeline, (wm_output){forget, NULL}, &err) != WM_OK) {
    (void)fprintf(stderr, "%s\n", err.text);
    exit(2);
  }
  wm_time_ns tick_ns = 0, begin_ns = wm_monotonic_ns();
  for (size_t i = 0; i < EVENTS; i++) {
    for (; tick_ns < events[i].arrival_ns; tick_ns += 20 * MS) {
      wm_published published;
      wm_pipeline_advance(&pipeline, tick_ns);
      (void)wm_pipeline_publish(&pipeline, tick_ns, &published);
    }
    wm_pipeline_advance(&pipeline, events[i].arrival_ns);
    wm_pipeline_arrive(&pipeline, &events[i]);
  }
  wm_pipeline_finish(&pipeline);
  wm_time_ns took_ns = wm_monotonic_ns() - begin_ns;
  *fused = pipeline.fuser.counts[1].fused;
  wm_arena_close(&arena);
  return took_ns;
}

static int by_size(const void *a, const void *b) {
  wm_time_ns x = *(const wm_time_ns *)a, y = *(const wm_time_ns *)b;
  return (x > y) - (x < y);
}

int main(void) {
  static const wm_time_ns kLate_ns[3] = {0, 150 * MS, 250 * MS};
  static wm_time_ns took_ns[3][ROUNDS];
  uint64_t fused[3];
  wm_config config;
  wm_error err;
  events = calloc(EVENTS, sizeof *events);
  if (!events || wm_config_parse(kConfig, strlen(kConfig), "bench", &config, &err) != WM_OK) return 2;
  static wm_assembly assembly;
  assembly.config = &config;
  assembly.setup = (wm_setup){.sensors = &sensor,
                              .sensor_count = 1,
                              .landmarks = landmarks,
                              .landmark_count = SEEN,
                              .seed = 1,
                              .start = {.t_ns = 0, .sigma_xy_m = 0.05, .sigma_heading_rad = 0.05}};
  wm_config_give_params(&config, &assembly.setup);
  sensor.max_range_m = INFINITY;
  wm_wheels *wheels = &assembly.setup.wheels;  // unknown: it is driven by twists
  wheels->radius_m = wheels->ticks_per_turn = wheels->track_m = wheels->wheelbase_m = wheels->steering_ratio = NAN;
  assembly.kinds = WM_EVENT_BIT(WM_EVENT_TWIST2) | WM_EVENT_BIT(WM_EVENT_SIGHTING);
  assembly.driving = wm_driving_choose(assembly.kinds, 0);
  assembly.source_count = 2;
  assembly.sources[0].merge = (wm_merge_source){.is_motion = 1, .in_order = 1, .lateness_max_ns = 300 * MS};
  assembly.sources[1].merge = (wm_merge_source){.rank = 1, .in_order = 1, .lateness_max_ns = 300 * MS};
  const int is_short = getenv("WM_BENCH_SHORT") != NULL, rounds = is_short ? 1 : ROUNDS;
  for (int round = 0; round < rounds; round++)
    for (int k = 0; k < 3; k++) {
      make_events(kLate_ns[k]);
      took_ns[k][round] = drive(&assembly, &fused[k]);
    }
  int bad = 0;
  double median_ns[3];
  for (int k = 0; k < 3; k++) {
    qsort(took_ns[k], (size_t)rounds, sizeof took_ns[k][0], by_size);
    median_ns[k] = (double)took_ns[k][rounds / 2];
    double ratio = median_ns[k] / median_ns[0];
    (void)printf(
        "frames %3lld ms late: %6.0f ns a frame of %d sightings with its motion and poses, ratio %.3f, %llu fused\n",
        (long long)(kLate_ns[k] / MS), median_ns[k] / (SECONDS * FRAME_HZ), SEEN, ratio, (unsigned long long)fused[k]);
    bad |= (ratio > 1.2 && !is_short) || fused[k] != SECONDS * FRAME_HZ * SEEN;
  }
  if (bad) (void)puts("FAILED: a late frame costs more than 1.2 times a fresh one, or isn't fused");
  free(events);
  wm_config_free(&config);
  return bad;
}
