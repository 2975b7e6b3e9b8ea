// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "config/config.h"
#include "config_registry.h"

static wm_config config;
static wm_error err;

void setUp(void) { memset(&config, 0, sizeof config); }
void tearDown(void) { wm_config_free(&config); }

#define HEAD "format: waymark-config/1\nestimator: pole_filter\n"

static void start_anew(void) {
  tearDown();
  setUp();
}

static void parse(const char *text) {
  start_anew();
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), "dir/x.yaml", &config, &err), err.text);
}

static void refused(const char *text, const char *message) {
  start_anew();
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, wm_config_parse(text, strlen(text), "dir/x.yaml", &config, &err), text);
  TEST_ASSERT_EQUAL_STRING(message, err.text);
  TEST_ASSERT_NULL(config.text);
}

static const registry_params *params(void) { return config.estimator_params; }

TEST(empty_sections) {
  parse(HEAD "merge:\npole_filter:\n  states:\nmotion:\n  # noise: {speed_mps: 1}\nsources:\n");
  TEST_ASSERT_EQUAL(2, params()->slots);
  TEST_ASSERT_EQUAL(0, config.source_count);
}

TEST(defaults) {
  parse(HEAD);
  TEST_ASSERT_EQUAL_STRING("pole_filter", config.estimator->name);
  TEST_ASSERT_EQUAL_DOUBLE(9.0, params()->gate);
  TEST_ASSERT_EQUAL(2, params()->slots);
  TEST_ASSERT_EQUAL(1, params()->on);
  TEST_ASSERT_EQUAL(0, params()->model);
  TEST_ASSERT_EQUAL_DOUBLE(300, config.runtime.merge_horizon_ms);
  TEST_ASSERT_EQUAL_DOUBLE(50, config.runtime.publish_rate_hz);
  TEST_ASSERT_EQUAL_STRING("WAYMARK_", config.channel_prefix);
  TEST_ASSERT_EQUAL_STRING("", config.lcm_url);
  TEST_ASSERT_FALSE(config.has_initial_pose);
  TEST_ASSERT_EQUAL_STRING("", config.overrides.dbc);
  TEST_ASSERT_EQUAL_STRING(HEAD, config.text);
  TEST_ASSERT_EQUAL(strlen(HEAD), config.text_length);
}

TEST(a_renamed_key_is_read_with_a_warning) {
  parse(HEAD "pole_filter: {gate_sigmas: 4, states: {places: 3}, walls.weight: robust}\n");
  TEST_ASSERT_EQUAL_DOUBLE(4, params()->gate);
  TEST_ASSERT_EQUAL(3, params()->slots);
  TEST_ASSERT_EQUAL(1, params()->model);
  TEST_ASSERT_EQUAL_STRING(
      "dir/x.yaml:3: pole_filter.gate_sigmas: is now 'pole_filter.gate', and read as that\n"
      "dir/x.yaml:3: pole_filter.states.places: is now 'pole_filter.states.slots', and read as that; at most 16 by "
      "now\n"
      "dir/x.yaml:3: pole_filter.walls.weight: is now 'pole_filter.model', and read as that\n",
      config.warnings);
  parse(HEAD "pole_filter: {gate: 4}\n");
  TEST_ASSERT_EQUAL_STRING("", config.warnings);
  refused(HEAD "pole_filter:\n  gate_sigmas: -4\n",
          "dir/x.yaml:4: pole_filter.gate_sigmas: '-4' is out of range; a number from 0 to 1000 is needed");
}

TEST(a_removed_key_is_ignored_with_a_warning) {
  parse(HEAD "pole_filter:\n  walls: {image_share: any}\n");
  TEST_ASSERT_EQUAL_STRING(
      "dir/x.yaml:4: pole_filter.walls.image_share: is not a parameter any more and is ignored: images are found by "
      "their number.\n",
      config.warnings);
}

TEST(a_key_by_old_and_new_name_is_refused) {
  refused(HEAD "pole_filter:\n  gate: 4\n  gate_sigmas: 4\n",
          "dir/x.yaml:5: pole_filter.gate_sigmas: 'pole_filter.gate' is given on line 4, too; keep one of them");
  refused(
      HEAD "pole_filter:\n  states.places: 3\n  states: {slots: 3}\n",
      "dir/x.yaml:5: pole_filter.states.slots: 'pole_filter.states.slots' is given on line 4, too; keep one of them");
}

static double motion_param(int i) { return ((const double *)(const void *)config.motion)[i]; }
static double sighting_param(int i) { return ((const double *)(const void *)config.sightings)[i]; }

// A parameter that several estimators had is in a section of its own now.
TEST(an_old_key_leads_to_another_section) {
  parse(HEAD "pole_filter: {states: {scale_sigma: 0.3, yaw_walk_rad: 0.4, slots: 3}, lasting.tau_s: 5}\n");
  TEST_ASSERT_EQUAL_DOUBLE(0.3, motion_param(2));
  TEST_ASSERT_EQUAL_DOUBLE(0.4, sighting_param(1));
  TEST_ASSERT_EQUAL_DOUBLE(5, sighting_param(0));
  TEST_ASSERT_EQUAL(3, params()->slots);
  TEST_ASSERT_EQUAL_STRING(
      "dir/x.yaml:3: pole_filter.states.scale_sigma: is now 'motion.states.scale_sigma', and read as that\n"
      "dir/x.yaml:3: pole_filter.states.yaw_walk_rad: is now 'sightings.states.yaw_walk_rad', and read as that\n"
      "dir/x.yaml:3: pole_filter.lasting.tau_s: is now 'sightings.correlated.tau_s', and read as that\n",
      config.warnings);
  refused(HEAD "pole_filter: {states: {places_sigma: 1}}\n",
          "dir/x.yaml:3: pole_filter.states.places_sigma: unknown key; known here: yaw_sigma_rad, slots, deep");
  refused(HEAD "pole_filter: {lasting: {tau_s: 50}}\n",
          "dir/x.yaml:3: pole_filter.lasting.tau_s: '50' is out of range; a number from 0 to 10 is needed");
}

// In whichever order they stand.
TEST(both_sections_together_are_refused) {
  refused(HEAD "motion:\n  states: {scale_sigma: 0.1}\npole_filter:\n  states: {scale_sigma: 0.3}\n",
          "dir/x.yaml:6: pole_filter.states.scale_sigma: 'motion.states.scale_sigma' is given on line 4, too; keep one "
          "of them");
  refused(
      HEAD "pole_filter:\n  states: {scale_sigma: 0.3}\nmotion:\n  states: {scale_sigma: 0.1}\n",
      "dir/x.yaml:6: motion.states.scale_sigma: 'motion.states.scale_sigma' is given on line 4, too; keep one of them");
}

TEST(a_shared_parameter_that_the_estimator_does_not_take_is_warned_of) {
  parse(HEAD "motion: {states: {lag_sigma_s: 0.2, scale_sigma: 0.1}}\n");
  TEST_ASSERT_EQUAL_STRING("dir/x.yaml:3: motion.states.lag_sigma_s: estimator pole_filter does not take it\n",
                           config.warnings);
}

// The section of an estimator that isn't chosen changes nothing of what the chosen one reads.
TEST(an_old_key_of_another_estimator_is_not_taken) {
  parse(
      "format: waymark-config/1\nestimator: cloud_filter\npole_filter: {states: {scale_sigma: 0.3}}\n"
      "motion: {states.scale_sigma: 0.1}\n");
  TEST_ASSERT_EQUAL_DOUBLE(0.1, motion_param(2));
  TEST_ASSERT_EQUAL_STRING(
      "dir/x.yaml:3: pole_filter.states.scale_sigma: is now 'motion.states.scale_sigma', and not read of an estimator "
      "that isn't chosen\n"
      "dir/x.yaml:4: motion.states.scale_sigma: estimator cloud_filter does not take it; these do: pole_filter\n",
      config.warnings);
}

static void keep_line(void *context, const char *line) { (void)snprintf(context, 100, "%s", line); }

TEST(warnings_come_line_by_line) {
  char last[100] = "";
  (void)snprintf(config.warnings, sizeof config.warnings, "one\ntwo\n");
  wm_config_each_warning(&config, keep_line, last);
  TEST_ASSERT_EQUAL_STRING("two", last);
}

// Thousands of them: what does not fit is cut, nothing else is written.
TEST(many_warnings_are_cut) {
  static char text[40000] = HEAD "pole_filter:\n";
  for (size_t used = strlen(text); used + 60 < sizeof text; used = strlen(text))
    (void)snprintf(text + used, sizeof text - used, "  walls.image_share: %d\n", (int)used);
  start_anew();
  (void)wm_config_parse(text, strlen(text), "dir/x.yaml", &config, &err);
  TEST_ASSERT_LESS_THAN(sizeof config.warnings, strlen(config.warnings));
}

// The text in an event log is read the same way.
TEST(an_old_logs_configuration_is_read) {
  static const char kText[] = HEAD "map: gone.yaml\npole_filter: {gate_sigmas: 4}\n";
  start_anew();
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse_logged(kText, sizeof kText - 1, "x.yaml", &config, &err), err.text);
  TEST_ASSERT_EQUAL_DOUBLE(4, params()->gate);
}

TEST(everything) {
  parse(HEAD
        "sources:\n  - {name: gnss, until_s: 25, from_s: -1}\n  - {name: sightings, lateness_max_ms: 300}\n"
        "  - {name: 'sightings:laser', use: false, period_ms: 90}\n"
        "initial_pose: {x_m: 1, heading_deg: 90, sigma_xy_m: 0.2}\n"
        "merge: {horizon_ms: 400, lateness_max_ms: 200, queue_events: 100}\n"
        "publish: {rate_hz: 20, lcm: false, lcm_url: 'memq://', channel_prefix: R1_}\n"
        "realtime:\n  cpu: 1\n"
        "motion: {noise: {speed_mps: 0.5}}\n"
        "pole_filter: {gate: 4, states: {slots: 3, deep: {on: false}}, model: robust, states.yaw_sigma_rad: 0.3}\n"
        "cloud_filter: {window_s: 7}\n");
  TEST_ASSERT_EQUAL_DOUBLE(4, params()->gate);
  TEST_ASSERT_EQUAL(3, params()->slots);
  TEST_ASSERT_EQUAL(0, params()->on);
  TEST_ASSERT_EQUAL(1, params()->model);
  TEST_ASSERT_EQUAL_DOUBLE(0.3, params()->yaw_sigma_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, *(const double *)(const void *)config.motion);
  TEST_ASSERT_EQUAL_DOUBLE(400, config.runtime.merge_horizon_ms);
  TEST_ASSERT_EQUAL(100, config.runtime.merge_queue_events);
  TEST_ASSERT_EQUAL(0, config.runtime.publish_lcm);
  TEST_ASSERT_EQUAL(1, config.runtime.realtime_cpu);
  TEST_ASSERT_EQUAL_STRING("memq://", config.lcm_url);
  TEST_ASSERT_EQUAL_STRING("R1_", config.channel_prefix);
  TEST_ASSERT_TRUE(config.has_initial_pose);
  TEST_ASSERT_EQUAL_DOUBLE(1, config.initial_pose.p_m[0]);
  TEST_ASSERT_DOUBLE_IS_NAN(config.initial_pose.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 2, config.initial_pose.heading_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, config.initial_pose.sigma_xy_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.05, config.initial_pose.sigma_heading_rad);
}

TEST(source_settings) {
  parse(HEAD
        "merge: {lateness_max_ms: 100}\n"
        "sources:\n  - {name: gnss, until_s: 25}\n  - {name: sightings, lateness_max_ms: 300}\n"
        "  - {name: 'sightings:laser', use: false}\n");
  wm_source_config s;
  int rank;
  wm_config_source(&config, "gnss", &s, &rank);
  TEST_ASSERT_EQUAL(0, rank);
  TEST_ASSERT_EQUAL_DOUBLE(25, s.until_s);
  TEST_ASSERT_EQUAL_DOUBLE(100, s.lateness_max_ms);
  TEST_ASSERT_DOUBLE_IS_NEG_INF(s.from_s);
  wm_config_source(&config, "sightings:radar", &s, &rank);
  TEST_ASSERT_EQUAL(1, rank);
  TEST_ASSERT_EQUAL_DOUBLE(300, s.lateness_max_ms);
  TEST_ASSERT_TRUE(s.use);
  TEST_ASSERT_EQUAL_STRING("sightings:radar", s.name);
  wm_config_source(&config, "sightings:laser", &s, &rank);
  TEST_ASSERT_EQUAL(2, rank);
  TEST_ASSERT_TRUE(!s.use);
  wm_config_source(&config, "can", &s, &rank);
  TEST_ASSERT_EQUAL(3, rank);
  TEST_ASSERT_TRUE(s.use);
  TEST_ASSERT_EQUAL_DOUBLE(100, s.lateness_max_ms);
  TEST_ASSERT_DOUBLE_IS_INF(s.until_s);
}

TEST(devices) {
  parse(HEAD
        "devices:\n  can:\n    - {interface: can0, dbc: car.dbc, can_signals: /etc/s.yaml}\n"
        "    - {interface: can1, dbc: b.dbc, can_signals: c.yaml}\n");
  TEST_ASSERT_EQUAL(2, config.devices.can_count);
  TEST_ASSERT_EQUAL_STRING("can0", config.devices.can[0].interface);
  TEST_ASSERT_EQUAL_STRING("dir/car.dbc", config.devices.can[0].dbc);
  TEST_ASSERT_EQUAL_STRING("/etc/s.yaml", config.devices.can[0].can_signals);
  TEST_ASSERT_EQUAL_STRING("can1", config.devices.can[1].interface);
  parse(HEAD
        "devices:\n  cameras:\n    - name: front\n      device: /dev/video2\n      format: Y10\n      stamp: start\n"
        "      exposure_ms: 4.5\n      controls: {auto_exposure: 1, gain: -3}\n");
  const wm_camera_device_config *camera = &config.devices.cameras[0];
  TEST_ASSERT_EQUAL(1, config.devices.camera_count);
  TEST_ASSERT_EQUAL_STRING("Y10", camera->format);
  TEST_ASSERT_EQUAL(WM_STAMP_START, camera->stamp);
  TEST_ASSERT_EQUAL_DOUBLE(4.5, camera->exposure_ms);
  TEST_ASSERT_EQUAL_DOUBLE(0, camera->rate_hz);
  TEST_ASSERT_EQUAL(2, camera->control_count);
  TEST_ASSERT_EQUAL_STRING("gain", camera->controls[1].name);
  TEST_ASSERT_EQUAL_INT32(-3, camera->controls[1].value);
  refused(HEAD "devices: {cameras: [{name: a, device: b, format: H264}]}\n",
          "dir/x.yaml:3: devices.cameras[0].format: 'H264' is unknown; one of these is needed: GREY, YUYV, UYVY, NV12, "
          "Y10, Y16, MJPG, RGB3, BGR3");
  refused(HEAD "devices: {cameras: [{name: a, device: b}, {name: c, device: b}]}\n",
          "dir/x.yaml:3: devices.cameras[1]: the device 'b' appears twice (first in line 3)");
  refused(HEAD "devices:\n  can:\n    - {interfce: can0}\n",
          "dir/x.yaml:5: devices.can[0].interfce: unknown key; did you mean 'interface'?");
  refused(HEAD "devices:\n  can:\n    - {interface: can0, dbc: a}\n",
          "dir/x.yaml:5: devices.can[0]: can_signals: is missing; name one here or at the top of the configuration");
  refused(HEAD "devices: {can: {interface: can0}}\n",
          "dir/x.yaml:3: devices.can: a list of {interface: NAME, ...} is needed");
  refused(HEAD
          "devices:\n  can:\n    - {interface: can0, dbc: a, can_signals: b}\n"
          "    - {interface: can0, dbc: a, can_signals: b}\n",
          "dir/x.yaml:6: devices.can[1].interface: 'can0' appears twice (first in line 5)");
}

TEST(cameras_of_libcamera) {
  if (wm_camera_has_libcamera()) {
    parse(HEAD "devices: {cameras: [{name: front, libcamera: platform/vimc.0 Sensor B}]}\n");
    TEST_ASSERT_EQUAL_STRING("platform/vimc.0 Sensor B", config.devices.cameras[0].libcamera);
    TEST_ASSERT_EQUAL_STRING("", config.devices.cameras[0].device);
    refused(HEAD "devices: {cameras: [{name: a, libcamera: b}, {name: c, libcamera: b}]}\n",
            "dir/x.yaml:3: devices.cameras[1]: libcamera's 'b' appears twice (first in line 3)");
  } else {
    refused(HEAD "devices: {cameras: [{name: front, libcamera: b}]}\n",
            "dir/x.yaml:3: devices.cameras[0].libcamera: " WM_WITHOUT_LIBCAMERA);
  }
  refused(HEAD "devices: {cameras: [{name: a, device: /dev/video0, libcamera: b}]}\n",
          "dir/x.yaml:3: devices.cameras[0].libcamera: device, card and bus are V4L2's; name the camera by them, or by "
          "libcamera:, or by gst:");
}

TEST(cameras_of_gstreamer) {
  parse(HEAD "devices: {cameras: [{name: front, gst: \"v4l2src ! appsink\"}]}\n");
  TEST_ASSERT_EQUAL_STRING("v4l2src ! appsink", config.devices.cameras[0].gst);
  refused(HEAD "devices: {cameras: [{name: a, gst: b}, {name: c, gst: b}]}\n",
          "dir/x.yaml:3: devices.cameras[1]: the pipeline 'b' appears twice (first in line 3)");
  refused(HEAD "devices: {cameras: [{name: a, device: /dev/video0, gst: b}]}\n",
          "dir/x.yaml:3: devices.cameras[0].gst: device, card and bus are V4L2's; name the camera by them, or by "
          "libcamera:, or by gst:");
}

TEST(misspelt) {
  refused(HEAD "pole_filter:\n  gaet: 5\n",
          "dir/x.yaml:4: pole_filter.gaet: unknown key; did you mean 'pole_filter.gate'?");
  refused(HEAD "pole_filtr: {gate: 5}\n", "dir/x.yaml:3: pole_filtr: unknown key; did you mean 'pole_filter'?");
  refused(HEAD "horizon_ms: 5\n", "dir/x.yaml:3: horizon_ms: unknown key; did you mean 'merge.horizon_ms'?");
  refused(HEAD "publish: {lcm_ulr: x}\n",
          "dir/x.yaml:3: publish.lcm_ulr: unknown key; did you mean 'publish.lcm_url'?");
  refused(HEAD "pole_filter: {slots: 3}\n",
          "dir/x.yaml:3: pole_filter.slots: unknown key; did you mean 'pole_filter.states.slots'?");
  refused(HEAD "motion: {noise: {sped_mps: 1}}\n",
          "dir/x.yaml:3: motion.noise.sped_mps: unknown key; did you mean 'motion.noise.speed_mps'?");
  refused(HEAD "cloud_filter: {windows: 1}\n",
          "dir/x.yaml:3: cloud_filter.windows: unknown key; did you mean 'cloud_filter.window_s'?");
  refused(HEAD "something: 1\n",
          "dir/x.yaml:3: something: unknown key; known here: format, estimator, sources, calibration, landmarks, dbc, "
          "can_signals, devices, map, site, initial_pose, vision, start, black_box, publish, commands, merge, "
          "integrity, realtime, motion, sightings, pole_filter, cloud_filter");
  refused(HEAD "pole_filter: {states: {other: 1}}\n",
          "dir/x.yaml:3: pole_filter.states.other: unknown key; known here: yaw_sigma_rad, slots, deep");
  refused("format: waymark-config/1\nestimator: pole_filtre\n",
          "dir/x.yaml:2: estimator: 'pole_filtre' is unknown; did you mean 'pole_filter'? (one of: pole_filter, "
          "cloud_filter)");
  refused("format: waymark-config/1\nmerge: {}\n",
          "dir/x.yaml:1: estimator: is missing; one of these is needed: pole_filter, cloud_filter");
}

TEST(wrong_values) {
  refused(HEAD "pole_filter: {gate: abc}\n",
          "dir/x.yaml:3: pole_filter.gate: 'abc' is not a number; a number from 0 to 1000 is needed");
  refused(HEAD "pole_filter: {states: {slots: 17}}\n",
          "dir/x.yaml:3: pole_filter.states.slots: '17' is out of range; a whole number from 0 to 16 is needed");
  refused(HEAD "pole_filter: {model: rubust}\n",
          "dir/x.yaml:3: pole_filter.model: 'rubust' is unknown; did you mean 'robust'? (one of: plain, robust)");
  refused(HEAD "pole_filter: {gate: }\n",
          "dir/x.yaml:3: pole_filter.gate: has no value; a number from 0 to 1000 is needed");
  refused(HEAD "pole_filter: 3\n", "dir/x.yaml:3: pole_filter: a map of parameters (KEY: VALUE) is needed");
  refused(HEAD "pole_filter: {states: 3}\n",
          "dir/x.yaml:3: pole_filter.states: a map of parameters (KEY: VALUE) is needed");
  refused(HEAD "publish: {rate_hz: 0}\n",
          "dir/x.yaml:3: publish.rate_hz: '0' is out of range; a number from 0.1 to 1000 is needed");
  refused("estimator: pole_filter\n", "dir/x.yaml:1: format: is missing; 'format: waymark-config/1' is needed");
  refused("", "dir/x.yaml:1: a map that begins with 'format: waymark-config/1' is needed");
}

TEST(parameters_that_do_not_go_together) {
  parse(HEAD "motion:\n  noise:\n    speed_mps: 6.6\n");
  refused(HEAD "motion:\n  noise:\n    speed_mps: 6.5\n",
          "dir/x.yaml:5: motion.noise.speed_mps: doesn't go with another");
  refused(HEAD "motion:\n  noise.speed_mps: 6.5\n", "dir/x.yaml:4: motion.noise.speed_mps: doesn't go with another");
  refused(HEAD "motion: {noise: {speed_mps: 6.5, sped_mps: 1}}\n",
          "dir/x.yaml:3: motion.noise.sped_mps: unknown key; did you mean 'motion.noise.speed_mps'?");
}

TEST(wrong_sources) {
  refused(HEAD "sources: [{name: gnss, lateness_max_ms: 500}]\n",
          "dir/x.yaml:3: sources[0].lateness_max_ms: 500 is above merge.horizon_ms (300); at most 300 is possible, or "
          "set merge.horizon_ms to 500");
  refused(HEAD "merge: {lateness_max_ms: 500}\n",
          "dir/x.yaml:3: merge.lateness_max_ms: merge.lateness_max_ms (500) is above merge.horizon_ms (300); set "
          "lateness_max_ms to at most 300, or horizon_ms to 500");
  refused(HEAD "merge: {horizon_ms: 100}\n",
          "dir/x.yaml:3: merge.horizon_ms: merge.lateness_max_ms (150) is above merge.horizon_ms (100); set "
          "lateness_max_ms to at most 100, or horizon_ms to 150");
  refused(HEAD "sources:\n- {name: gnss}\n- {name: gnss}\n",
          "dir/x.yaml:5: sources[1].name: 'gnss' appears twice (first in line 4)");
  refused(HEAD "sources: [{name: gnss, sample_at: next_stamp}]\n",
          "dir/x.yaml:3: sources[0].sample_at: only `motion` and `motion6` have rows whose values can get the next "
          "row's stamp");
  refused(HEAD "sources: [{name: gnss, from_s: 5, until_s: 2}]\n",
          "dir/x.yaml:3: sources[0].until_s: 2 is not after from_s (5): nothing would be taken");
  refused(HEAD "sources: [{name: 'gnss:top'}]\n",
          "dir/x.yaml:3: sources[0].name: 'gnss:top' has a sensor's name; only sightings:SENSOR, markers:SENSOR and "
          "can:INTERFACE are possible");
  refused(HEAD "sources: [{nmae: gnss}]\n", "dir/x.yaml:3: sources[0].nmae: unknown key; did you mean 'name'?");
  refused(HEAD "sources: gnss\n", "dir/x.yaml:3: sources: a list of {name: NAME, ...} is needed");
}

TEST(files) {
  refused(HEAD "dbc: car.dbc\n", "dir/x.yaml:3: dbc: 'car.dbc' cannot be read (looked for dir/car.dbc)");
  static const char kText[] = HEAD "dbc: ../LICENSE\ncalibration: LICENSE\n";
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, wm_config_parse(kText, sizeof kText - 1, "docs/x.yaml", &config, &err),
                            err.text);
  TEST_ASSERT_EQUAL_STRING("docs/x.yaml:4: calibration: 'LICENSE' cannot be read (looked for docs/LICENSE)", err.text);
  static const char kGood[] = HEAD "dbc: ../LICENSE\n";
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(kGood, sizeof kGood - 1, "docs/x.yaml", &config, &err), err.text);
  TEST_ASSERT_EQUAL_STRING("docs/../LICENSE", config.overrides.dbc);
  wm_config_free(&config);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_config_load("no/such.yaml", &config, &err));
  TEST_ASSERT_EQUAL_STRING("no/such.yaml: there is no such file", err.text);
}

TEST(reference_names_all) {
  char *text = NULL;
  size_t length;
  FILE *to = open_memstream(&text, &length);
  wm_config_reference(to);
  fclose(to);
  static const char *const kRows[] = {"| `pole_filter.states.deep.on` | true or false | true | On. |",
                                      "| `pole_filter.gate` | number from 0 to 1000 | 9 | Gate. |",
                                      "| `pole_filter.model` | `plain`, `robust` | plain | Model. |",
                                      "| `pole_filter.states.slots` | whole number from 0 to 16 | 2 | Slots. |",
                                      "| `merge.horizon_ms` | number from 1 to 60000 | 300 |",
                                      "| `motion.noise.speed_mps` |",
                                      "| `lateness_max_ms` |",
                                      "| `initial_pose` |"};
  for (size_t i = 0; i < sizeof kRows / sizeof *kRows; i++)
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, kRows[i]), kRows[i]);
  free(text);
}
