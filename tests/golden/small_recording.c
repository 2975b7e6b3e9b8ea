// SPDX-License-Identifier: Apache-2.0
#include "small_recording.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/folder.h"
#include "output/event_log.h"
#include "unity.h"

#define LANDMARKS 8
#define ROWS_MAX 200000

static FILE *create(const char *recording, const char *file) {
  char path[256];
  (void)snprintf(path, sizeof path, "%s/%s", recording, file);
  folder_write(path, "");
  FILE *f = fopen(folder_path(path), "w");
  TEST_ASSERT_NOT_NULL_MESSAGE(f, path);
  return f;
}

// ── the world ───────────────────────────────────────────────────────────────────────────────────────────────────────

// Uniform in [-1, 1) from a counter: the same on every machine.
static double noise(uint64_t counter) {
  uint64_t z = (counter + 1) * UINT64_C(0x9e3779b97f4a7c15);
  z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
  return (double)((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1;
}

static void landmark(int i, double *x, double *y) {
  *x = 8 * cos(2 * M_PI * i / LANDMARKS);
  *y = 8 * sin(2 * M_PI * i / LANDMARKS) + 1;
}

static double turn_rate(double t_s) { return 0.5 * sin(0.2 * t_s); }
#define SPEED 0.8

// Where the robot is at t, by fine steps from the start at the origin.
static void pose_at(double t_s, double *x, double *y, double *heading) {
  static double at_s, px, py, ph;
  if (t_s < at_s) at_s = px = py = ph = 0;
  for (; at_s + 0.001 <= t_s + 1e-9; at_s += 0.001) {
    px += SPEED * cos(ph) * 0.001;
    py += SPEED * sin(ph) * 0.001;
    ph += turn_rate(at_s) * 0.001;
  }
  *x = px;
  *y = py;
  *heading = ph;
}

typedef struct row {
  wm_time_ns t_ns, arrival_ns;
  int landmark;
  double bearing, range;
  size_t order;
} row;

static int by_arrival(const void *a, const void *b) {
  const row *x = a, *y = b;
  if (x->arrival_ns != y->arrival_ns) return x->arrival_ns < y->arrival_ns ? -1 : 1;
  return x->order < y->order ? -1 : 1;
}

static size_t sightings(const small_recording *what, row *rows) {
  double rate_hz = what->frame_hz > 0 ? what->frame_hz : 10;
  size_t count = 0;
  for (size_t frame = 0; (double)frame < what->seconds * rate_hz; frame++) {
    double t_s = (double)frame / rate_hz, x, y, heading;
    if (t_s >= what->silent_from_s && t_s < what->silent_until_s) continue;
    wm_time_ns t_ns = (wm_time_ns)llround(t_s * 1e9), late_ns = what->late_ns ? what->late_ns(frame) : 0;
    pose_at(t_s, &x, &y, &heading);
    for (int i = 0; i < LANDMARKS && count < ROWS_MAX; i++) {
      double lx, ly;
      landmark(i, &lx, &ly);
      double bearing = remainder(atan2(ly - y, lx - x) - heading, 2 * M_PI), range = hypot(lx - x, ly - y);
      if (fabs(bearing) > 1.2 || range > 12) continue;
      rows[count] = (row){
          t_ns, t_ns + late_ns, i + 1, bearing + 0.01 * noise(4 * count), range + 0.05 * noise(4 * count + 1), count};
      count++;
    }
  }
  qsort(rows, count, sizeof *rows, by_arrival);
  return count;
}

const char *small_recording_write(const char *name, const small_recording *what) {
  FILE *f = create(name, "recording.yaml");
  (void)fprintf(f,
                "format: waymark-recording/1\nname: %s\nduration_s: %g\nstreams: [motion.csv, sightings.csv]\n"
                "vehicle:\n  initial_pose: {t_ns: 0, x_m: 0, y_m: 0, heading_rad: 0}\n",
                name, what->seconds);
  (void)fclose(f);

  f = create(name, "calibration.yaml");
  (void)fputs(
      "sensors:\n  eye:\n    mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}\n    bearing_sigma_rad: 0.01\n"
      "    range_sigma_m: 0.05\n",
      f);
  (void)fclose(f);

  f = create(name, "landmarks.csv");
  (void)fputs("id,x_m,y_m,z_m,sigma_m\n", f);
  for (int i = 0; i < LANDMARKS; i++) {
    double x, y;
    landmark(i, &x, &y);
    (void)fprintf(f, "%d,%.6f,%.6f,0,0.001\n", i + 1, x, y);
  }
  (void)fclose(f);

  f = create(name, "motion.csv");
  (void)fputs("t_ns,v_mps,w_radps\n", f);
  double rate_hz = what->motion_hz > 0 ? what->motion_hz : 20;
  for (size_t i = 0; (double)i < what->seconds * rate_hz; i++) {
    double t_s = (double)i / rate_hz;
    (void)fprintf(f, "%" PRId64 ",%.9f,%.9f\n", (wm_time_ns)llround(t_s * 1e9), SPEED + 0.02 * noise(4 * i + 2),
                  turn_rate(t_s + 0.5 / rate_hz) + 0.01 * noise(4 * i + 3));
  }
  (void)fclose(f);

  row *rows = malloc(ROWS_MAX * sizeof *rows);
  TEST_ASSERT_NOT_NULL(rows);
  size_t count = sightings(what, rows);
  f = create(name, "sightings.csv");
  (void)fputs("t_ns,sensor,id,bearing_rad,range_m,arrival_ns\n", f);
  for (size_t i = 0; i < count; i++)
    (void)fprintf(f, "%" PRId64 ",eye,%d,%.9f,%.9f,%" PRId64 "\n", rows[i].t_ns, rows[i].landmark, rows[i].bearing,
                  rows[i].range, rows[i].arrival_ns);
  (void)fclose(f);
  free(rows);
  return folder_path(name);
}

// ── runs ────────────────────────────────────────────────────────────────────────────────────────────────────────────

void replay_into(const char *recording, const char *config_text, const char *run, wm_run_report *report) {
  wm_error err = {0};
  wm_config config;
  wm_recording *opened = NULL;
  wm_status status = wm_config_parse(config_text, strlen(config_text), "test.yaml", &config, &err);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
  status = wm_recording_open(folder_path(recording), &config.overrides, NULL, NULL, &opened, &err);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
  const wm_replay_options options = {.out_dir = folder_path(run), .seed = 1};
  status = wm_replay_recording(&config, opened, &options, report, &err);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
  wm_recording_close(opened);
  wm_config_free(&config);
}

void replay_log_into(const char *log_path, const char *run, wm_run_report *report) {
  wm_error err = {0};
  wm_log_reader *log;
  wm_config config;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_log_open(folder_path(log_path), &log, &err), err.text);
  const wm_log_head *head = wm_log_reader_head(log);
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK, wm_config_parse_logged(head->config_text, head->config_length, head->config_path, &config, &err),
      err.text);
  const wm_replay_options options = {.out_dir = folder_path(run)};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_replay_log(&config, log, &options, report, &err), err.text);
  wm_config_free(&config);
  wm_log_reader_close(log);
}

char *read_all(const char *path, size_t *length) {
  FILE *f = fopen(path, "rb");
  TEST_ASSERT_NOT_NULL_MESSAGE(f, path);
  TEST_ASSERT_EQUAL(0, fseek(f, 0, SEEK_END));
  long size = ftell(f);
  TEST_ASSERT_GREATER_OR_EQUAL(0, size);
  rewind(f);
  char *bytes = malloc((size_t)size + 1);
  TEST_ASSERT_NOT_NULL(bytes);
  TEST_ASSERT_EQUAL(size, fread(bytes, 1, (size_t)size, f));
  bytes[size] = '\0';
  *length = (size_t)size;
  (void)fclose(f);
  return bytes;
}

void assert_same_file(const char *a, const char *b, const char *file) {
  char path[512];
  size_t length_a, length_b;
  (void)snprintf(path, sizeof path, "%s/%s", a, file);
  char *bytes_a = read_all(folder_path(path), &length_a);
  (void)snprintf(path, sizeof path, "%s/%s", b, file);
  char *bytes_b = read_all(folder_path(path), &length_b);
  TEST_ASSERT_GREATER_THAN_MESSAGE(0, length_a, file);
  TEST_ASSERT_EQUAL_MESSAGE(length_a, length_b, file);
  TEST_ASSERT_TRUE_MESSAGE(memcmp(bytes_a, bytes_b, length_a) == 0, file);
  free(bytes_a);
  free(bytes_b);
}
