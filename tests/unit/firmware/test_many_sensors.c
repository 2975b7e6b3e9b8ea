// SPDX-License-Identifier: Apache-2.0
// As many sensors as the filter takes, each with all its calibration states: no value and no alarm is lost on the way
// from the estimator to health, health.json and LCM.
#include "common/folder.h"
#include "common/suite.h"
#include "fusion/fuser.h"
#include "output/json_files.h"
#include "waymark/lcm_messages.h"

#define SENSORS 16
#define STATES 12  // of a sensor: rows of estimator/sensors/sensor_states.h
#define LANDMARKS 4

static wm_fuser fuser;
static wm_health health;
static wm_sensor sensors[SENSORS];
static wm_landmark landmarks[LANDMARKS];
static void *motion, *sightings, *params, *state;

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)context, (void)kind, (void)record, (void)bytes;
}

static void *defaults(const wm_param_table *table) {
  void *out = malloc(table->bytes);
  TEST_ASSERT_NOT_NULL(out);
  wm_params_defaults(table, out);
  return out;
}

static void all_states_on(const wm_param_table *table, void *values) {
  const double sigma = 0.01;
  for (size_t i = 0; i < table->count; i++)
    if (strncmp(table->params[i].key, "states.", 7) == 0 && strstr(table->params[i].key, "_sigma"))
      memcpy((char *)values + table->params[i].offset, &sigma, sizeof sigma);
}

void setUp(void) {
  const wm_estimator *ekf = wm_estimator_find("landmark_ekf");
  motion = defaults(&wm_motion_params_table);
  sightings = defaults(&wm_sighting_params_table);
  params = defaults(&ekf->params);
  all_states_on(&wm_sighting_params_table, sightings);
  for (int i = 0; i < SENSORS; i++) {
    sensors[i] = (wm_sensor){.bearing_sigma_rad = 0.02, .range_sigma_m = 0.05, .max_range_m = 100};
    (void)snprintf(sensors[i].name, sizeof sensors[i].name, "eye%02d", i);
  }
  for (int i = 0; i < LANDMARKS; i++)
    landmarks[i] = (wm_landmark){
        .id = i, .p_m = {6 * cos(M_PI_2 * i), 6 * sin(M_PI_2 * i), 0}, .sigma_m = 0.01, .yaw_rad = (double)NAN};
  const double none = (double)NAN;
  static wm_setup setup;
  setup = (wm_setup){.motion = motion,
                     .sightings = sightings,
                     .wheels = {none, none, none, none, none, none, 0, {0}, {0}},
                     .sensors = sensors,
                     .sensor_count = SENSORS,
                     .landmarks = landmarks,
                     .landmark_count = LANDMARKS,
                     .start = {WM_TIME_NONE, {3, 0, 0}, {0, 0, 0, 1}, M_PI_2, 0.05, 0.05}};
  const char *why = "";
  const size_t bytes = ekf->state_bytes(params, &setup, &why);
  TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
  state = aligned_alloc(64, (bytes + 63) / 64 * 64);
  TEST_ASSERT_NOT_NULL(state);
  TEST_ASSERT_EQUAL(WM_OK, ekf->init(state, params, &setup));
  wm_fuser_init(&fuser, ekf, state, wm_driving_choose(WM_EVENT_BIT(WM_EVENT_TWIST2), 0), (wm_output){put, NULL});
  memset(&health, 0, sizeof health);
}

void tearDown(void) {
  free(state);
  free(params);
  free(sightings);
  free(motion);
}

// A circle of 3 m to the left, each step a landmark by the next sensor. `sign` of the measured turn.
static void drive(double seconds, double sign) {
  for (int i = 0; i < 50 * seconds; i++) {
    const double t_s = 0.02 * i, heading = M_PI_2 + 0.3 * t_s;
    wm_event twist = {.t_ns = wm_ns_from_seconds(t_s), .kind = WM_EVENT_TWIST2};
    twist.as.twist2 = (wm_twist2){0.9, sign * 0.3};
    wm_fuser_feed(&fuser, &twist);
    const wm_landmark *l = &landmarks[i % LANDMARKS];
    const double dx = l->p_m[0] - 3 * sin(heading), dy = l->p_m[1] + 3 * cos(heading);
    wm_event seen = {.t_ns = twist.t_ns, .source = 1, .kind = WM_EVENT_SIGHTING};
    seen.as.sighting = wm_sighting_without_numbers();
    seen.as.sighting.sensor = (uint16_t)(i % SENSORS);
    seen.as.sighting.landmark_id = l->id;
    seen.as.sighting.bearing_rad = remainder(atan2(dy, dx) - heading, 2 * M_PI);
    seen.as.sighting.range_m = hypot(dx, dy);
    wm_fuser_feed(&fuser, &seen);
  }
  wm_fuser_health(&fuser, &health);
}

static const wm_alarm *alarm_of(wm_alarm_kind kind) {
  for (uint32_t i = 0; i < health.alarm_count; i++)
    if (health.alarms[i].kind == (uint32_t)kind) return &health.alarms[i];
  return NULL;
}

TEST(health_has_each_state_of_each_sensor) {
  drive(5, 1);
  TEST_ASSERT_EQUAL(WM_HEALTH_CALIBRATION_MAX, health.calibration_count);
  for (int s = 0; s < SENSORS; s++) {
    int states = 0;
    const size_t length = strlen(sensors[s].name);
    for (uint32_t i = 0; i < wm_health_calibration_count(&health); i++) {
      const char *name = wm_health_calibration(&health, i)->name;
      states += strncmp(name, sensors[s].name, length) == 0 && name[length] == '.';
    }
    TEST_ASSERT_EQUAL_MESSAGE(STATES, states, sensors[s].name);
  }
  TEST_ASSERT_EQUAL(0, health.alarm_count);
}

static char *file_text(const char *name) {
  FILE *f = fopen(folder_path(name), "r");
  TEST_ASSERT_NOT_NULL(f);
  char *text = calloc(1, 1 << 16);
  TEST_ASSERT_NOT_NULL(text);
  TEST_ASSERT_LESS_THAN((1 << 16) - 1, fread(text, 1, (1 << 16) - 1, f));
  (void)fclose(f);
  return text;
}

// A turn with the wrong sign raises its noise to the limit; that factor stands behind some two hundred values.
TEST(an_alarm_behind_the_values_of_all_sensors_is_noticed) {
  drive(20, -1);
  const wm_alarm *noise = alarm_of(WM_ALARM_NOISE);
  TEST_ASSERT_NOT_NULL(noise);
  TEST_ASSERT_DOUBLE_WITHIN(0.2, 16, noise->value);
  TEST_ASSERT_GREATER_THAN(SENSORS * STATES, noise->calibration);
  TEST_ASSERT_EQUAL_STRING("noise.turn_factor", wm_health_calibration(&health, (uint32_t)noise->calibration)->name);
  TEST_ASSERT_EQUAL(WM_CAUSE_INCONSISTENT, health.cause);

  static wm_config config;
  static wm_findings findings;
  const wm_assembly assembly = {.config = &config};
  config.estimator = fuser.estimator;
  wm_error err;
  TEST_ASSERT_EQUAL(WM_OK, wm_write_health_json(folder_make(), &assembly, &health, &findings, &err));
  char *json = file_text("health.json");
  TEST_ASSERT_NOT_NULL(strstr(json, "{\"kind\": \"noise\", \"value\": 15."));
  TEST_ASSERT_NOT_NULL(strstr(json, "\"calibration\": \"noise.turn_factor\"}]"));
  for (uint32_t i = 0; i < wm_health_calibration_count(&health); i++) {
    char named[64];
    (void)snprintf(named, sizeof named, "\"%s\": {\"value\":", wm_health_calibration(&health, i)->name);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(json, named), named);
  }
  free(json);
  folder_remove();

  static uint8_t message[WM_LCM_MESSAGE_MAX];
  static wm_health read;
  TEST_ASSERT_NULL(wm_lcm_read_health(message, wm_lcm_health(&health, message, sizeof message), &read));
  // Values with an alarm come first.
  for (uint32_t i = 0; i < health.alarm_count; i++)
    TEST_ASSERT_EQUAL_STRING(wm_health_calibration(&health, (uint32_t)health.alarms[i].calibration)->name,
                             read.calibration[i].name);
  const wm_calibration_value *last = &read.calibration[read.calibration_count - 1];
  TEST_ASSERT_EQUAL_STRING(WM_LCM_CALIBRATION_LEFT, last->name);
  TEST_ASSERT_EQUAL_DOUBLE(wm_health_calibration_count(&health) - (WM_HEALTH_CALIBRATION_MAX - 1.0), last->value);
}
