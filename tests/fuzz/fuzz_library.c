// SPDX-License-Identifier: Apache-2.0
// Any stream of calls of libwaymark.so's interface: sources, rows, events, frames, pictures and times in any order. A
// refused call has a text; what comes out is finite. The first byte picks the estimator.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fuzz.h"
#include "waymark/waymark.h"

static const char *const kEstimators[] = {"landmark_ekf", "slam", "odometry", "stereo_ekf"};
static const char *const kSources[] = {"motion",     "imu",     "gnss",     "sightings:front", "markers:front",
                                       "commands",   "stereo",  "heading",  "increments",      "points",
                                       "sightings:", "nothing", "localizer"};
enum { ESTIMATORS = sizeof kEstimators / sizeof kEstimators[0], SOURCES = sizeof kSources / sizeof kSources[0] };

typedef struct input {
  const uint8_t *at;
  size_t left;
} input;

static void check_call(wm_status status, const wm_error *err) {
  check(status == WM_OK || status == WM_END || status == WM_AGAIN || err->text[0] != '\0');
}

// Zeros behind the end.
static void get(input *in, void *out, size_t bytes) {
  const size_t n = bytes < in->left ? bytes : in->left;
  memset(out, 0, bytes);
  memcpy(out, in->at, n);
  in->at += n, in->left -= n;
}

static uint8_t get_u8(input *in) {
  uint8_t out;
  get(in, &out, sizeof out);
  return out;
}

// A stamp near the last one, or any.
static wm_time_ns get_time(input *in, wm_time_ns *now_ns) {
  const uint8_t how = get_u8(in);
  if (how == 255) {
    wm_time_ns any;
    get(in, &any, sizeof any);
    return any;
  }
  *now_ns += ((wm_time_ns)how - 20) * 1000000;
  return *now_ns;
}

static void write_file(const char *folder, const char *name, const char *text) {
  char path[256];
  (void)snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "w");
  check(file && fputs(text, file) >= 0 && fclose(file) == 0);
}

// The configurations and the site, made once.
static const char *site(void) {
  static char folder[] = "/tmp/waymark-fuzz-library-XXXXXX";
  static int is_made;
  if (is_made) return folder;
  check(mkdtemp(folder) != NULL);
  for (size_t i = 0; i < ESTIMATORS; i++) {
    char name[64], text[256];
    (void)snprintf(name, sizeof name, "%s.yaml", kEstimators[i]);
    (void)snprintf(text, sizeof text,
                   "format: waymark-config/1\nestimator: %s\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n",
                   kEstimators[i]);
    write_file(folder, name, text);
  }
  write_file(folder, "landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n1,3,0,0,0.01\n2,0,3,0,0.01\n3,-3,-1,0,0.01\n");
  write_file(folder, "calibration.yaml",
             "sensors: {front: {mounting: {xyz_m: [0.1, 0, 0]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05}}\n");
  is_made = 1;
  return folder;
}

static void take(void *context, waymark_record kind, const void *record, size_t bytes) {
  (void)context;
  check(kind >= WAYMARK_RECORD_EVENT && kind <= WAYMARK_RECORD_PUBLISHED && record && bytes > 0);
  if (kind != WAYMARK_RECORD_FUSED) return;
  const wm_estimate *estimate = record;
  if (estimate->state == WM_STATE_SEARCHING) return;
  for (size_t i = 0; i < 3; i++) check(isfinite(estimate->pose_map_base.p_m[i]));
}

static void push_row(waymark_session *session, input *in, wm_time_ns *now_ns, wm_error *err) {
  double numbers[20];
  const uint32_t source = get_u8(in) % (SOURCES + 2);
  const wm_time_ns t_ns = get_time(in, now_ns);
  const size_t count = get_u8(in) % 20;
  for (size_t i = 0; i < count; i++) {
    const uint8_t how = get_u8(in);
    if (how < 250)
      numbers[i] = ((double)how - 125) / 50;
    else
      get(in, &numbers[i], sizeof numbers[i]);
  }
  check_call(waymark_push_row(session, source, t_ns, WM_TIME_NONE, numbers, count, err), err);
}

static void push_event(waymark_session *session, input *in, wm_time_ns *now_ns, wm_error *err) {
  static wm_event event;
  memset(&event, 0, sizeof event);
  const uint32_t source = get_u8(in) % (SOURCES + 2);
  event.kind = get_u8(in) % (WM_EVENT_KIND_COUNT + 2);
  event.t_ns = get_time(in, now_ns);
  event.arrival_ns = WM_TIME_NONE;
  get(in, &event.as, get_u8(in));
  check_call(waymark_push_event(session, source, &event, sizeof event, err), err);
}

static void push_frame(waymark_session *session, input *in, wm_time_ns *now_ns, wm_error *err) {
  uint8_t bytes[64];
  uint32_t id;
  const wm_time_ns t_ns = get_time(in, now_ns);
  const size_t length = get_u8(in) % 72;
  get(in, &id, sizeof id);
  get(in, bytes, sizeof bytes);
  check_call(waymark_push_can(session, t_ns, "can0", id, id & 1, bytes, length, err), err);
}

static void ask(waymark_session *session, input *in, wm_time_ns *now_ns, wm_error *err) {
  static wm_published published;
  static wm_health health;
  const wm_time_ns t_ns = get_time(in, now_ns);
  wm_status status = waymark_pose(session, t_ns, &published, sizeof published, err);
  check_call(status, err);
  if (status == WM_OK && published.now.state != WM_STATE_SEARCHING)
    check(isfinite(published.now.pose_map_base.p_m[0]) && isfinite(published.pose_odom_base.x_m));
  check_call(waymark_health(session, &health, sizeof health, err), err);
  check(waymark_source_name(session, get_u8(in)) != NULL);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  input in = {data, size};
  wm_error err = {WM_OK, ""};
  wm_time_ns now_ns = 1000000000;
  char config[256];
  const char *folder = site();
  (void)snprintf(config, sizeof config, "%s/%s.yaml", folder, kEstimators[get_u8(&in) % ESTIMATORS]);
  waymark_session *session;
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = folder, .seed = 1, .take = take};
  check(waymark_open(&options, &session, &err) == WM_OK);
  uint16_t chosen;
  get(&in, &chosen, sizeof chosen);
  for (size_t i = 0; i < SOURCES; i++) {
    uint32_t number;
    if (chosen >> i & 1) check_call(waymark_add_source(session, kSources[i], &number, &err), &err);
  }
  if ((chosen & 0x8000) == 0) check_call(waymark_start(session, &err), &err);
  while (in.left > 0) {
    err = (wm_error){WM_OK, ""};
    switch (get_u8(&in) % 8) {
      case 0:
      case 1:
      case 2: push_row(session, &in, &now_ns, &err); break;
      case 3:
      case 4: push_event(session, &in, &now_ns, &err); break;
      case 5: push_frame(session, &in, &now_ns, &err); break;
      case 6: ask(session, &in, &now_ns, &err); break;
      default: check_call(waymark_advance(session, get_time(&in, &now_ns), &err), &err); break;
    }
  }
  check_call(waymark_close(session, &err), &err);
  return 0;
}
