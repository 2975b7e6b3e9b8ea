// SPDX-License-Identifier: Apache-2.0
// What a recording's small files say, and what happens when they say it otherwise.
#include <unistd.h>
#include <zlib.h>

#include "common/folder.h"
#include "common/suite.h"
#include "waymark/can.h"
#include "waymark/recording.h"

static wm_recording *recording;
static wm_error err;
static char warnings[4096];
static unsigned noted;  // bits of wm_note
static wm_recording_overrides overrides;

#define ABOUT "format: waymark-recording/1\nname: drive\nduration_s: 12.5\nsomething_else: [1, 2]\n"

void setUp(void) {
  folder_make();
  folder_write("recording.yaml", ABOUT);
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n0,0,0\n");
  recording = NULL;
  warnings[0] = '\0';
  noted = 0;
  memset(&overrides, 0, sizeof overrides);
}

void tearDown(void) {
  wm_recording_close(recording);
  folder_remove();
}

static void keep_warning(void *context, wm_note note, const char *text) {
  (void)context;
  noted |= 1u << note;
  strncat(warnings, text, sizeof warnings - strlen(warnings) - 2);
  strcat(warnings, "\n");
}

static wm_status try_open(void) {
  wm_recording_close(recording);
  char dir[512];
  snprintf(dir, sizeof dir, "%s", folder_path(""));
  return wm_recording_open(dir, &overrides, keep_warning, NULL, &recording, &err);
}

static void open_it(void) { TEST_ASSERT_EQUAL_MESSAGE(WM_OK, try_open(), err.text); }

static void refused(const char *tail) {
  TEST_ASSERT_NOT_EQUAL(WM_OK, try_open());
  TEST_ASSERT_NULL(recording);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, tail), err.text);
}

TEST(bare) {
  open_it();
  TEST_ASSERT_EQUAL_STRING("drive", wm_recording_name(recording));
  TEST_ASSERT_EQUAL_DOUBLE(12.5, wm_recording_duration_s(recording));
  const wm_start *start = wm_site_start(wm_recording_site(recording));
  TEST_ASSERT_EQUAL_INT64(WM_TIME_NONE, start->t_ns);
  TEST_ASSERT_DOUBLE_IS_NAN(start->p_m[0]);
  TEST_ASSERT_DOUBLE_IS_NAN(start->heading_rad);
  TEST_ASSERT_DOUBLE_IS_NAN(wm_site_wheels(wm_recording_site(recording))->radius_m);
  size_t count;
  wm_site_sensors(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(0, count);
  wm_site_landmarks(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(0, count);
  TEST_ASSERT_EQUAL_STRING("", wm_site_calibration_text(wm_recording_site(recording), &count));
  TEST_ASSERT_EQUAL(0, wm_recording_quantities(recording));
  TEST_ASSERT_EQUAL_STRING("", warnings);
}

TEST(name_of_the_folder) {
  folder_write("recording.yaml", "format: waymark-recording/1\n");
  open_it();
  TEST_ASSERT_EQUAL_STRING_LEN("waymark-test-", wm_recording_name(recording), 13);
  TEST_ASSERT_DOUBLE_IS_NAN(wm_recording_duration_s(recording));
}

TEST(start_pose) {
  folder_write("recording.yaml",
               ABOUT "vehicle:\n  initial_pose: {t_ns: 5, x_m: 1, y_m: 2, heading_rad: 4, sigma_heading_deg: 9}\n");
  open_it();
  const wm_start *start = wm_site_start(wm_recording_site(recording));
  TEST_ASSERT_EQUAL_INT64(5, start->t_ns);
  TEST_ASSERT_EQUAL_DOUBLE(2, start->p_m[1]);
  TEST_ASSERT_DOUBLE_IS_NAN(start->p_m[2]);
  TEST_ASSERT_DOUBLE_IS_NAN(start->q_xyzw[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 4 - 2 * M_PI, start->heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 20, start->sigma_heading_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.05, start->sigma_xy_m);
  folder_write("recording.yaml", ABOUT
               "vehicle:\n  initial_pose: {x_m: 1, z_m: 3, qx: 0, qy: 0, qz: 0.70711, qw: 0.70711, hedaing_rad: "
               "1}\ninitial_pose: {}\n");
  open_it();
  start = wm_site_start(wm_recording_site(recording));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(0.5), start->q_xyzw[2]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, M_PI / 2, start->heading_rad);
  TEST_ASSERT_NOT_NULL(strstr(warnings, "recording.yaml:7: initial_pose: belongs under vehicle; here it is ignored"));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warnings, "hedaing_rad: unknown key; did you mean 'heading_rad'?"), warnings);
  TEST_ASSERT_BITS(1u << WM_NOTE_MISSPELT, 1u << WM_NOTE_MISSPELT, noted);
}

TEST(whole_calibration) {
  folder_write(
      "calibration.yaml",
      "sensors:\n  laser: {mounting: {xyz_m: [1, 2, 3], rpy_deg: [0, 90, -45]}, bearing_sigma_deg: 1, range_sigma_m: "
      "0.1, max_range_m: 30, range_is: depth}\n  sonar: {x_maker: Acme}\n  f: {range_sigma_m: 1}\n"
      "wheels: {radius_m: 0.1, ticks_per_turn: 2048, track_m: 0.6, wheelbase_m: 1.0, steering_ratio: 13.0, "
      "encoder_offset_m: -0.2,\n"
      "  steering_table: {actuator_mm: [98, 50, 8], road_wheel_deg: [30, 0, -30]}}\n"
      "cameras:\n  a: {model: equidistant, size: [640, 480], intrinsics: [3, 3, 320, 240], distortion: [0, 0, 0, 0], "
      "readout_ns: 10}\n"
      "  b: {model: pinhole-radtan, size: [640, 480], intrinsics: [3, 3, 320, 240], distortion: [0, 0, 0, 0, 0], "
      "mounting: {}}\n"
      "  c: {model: omni, size: [640, 480], intrinsics: [1.2, 3, 3, 320, 240]}\n"
      "  d: {model: double-sphere, size: [640, 480], intrinsics: [-0.2, 0.6, 3, 3, 320, 240]}\n"
      "  e: {model: ocam, size: [640, 480], intrinsics: [1, 2, 3, 4, 5]}\n"
      "  f: {model: equidistant, size: [640, 480], intrinsics: [3, 3, 320, 240], mounting: {xyz_m: [9, 0, 0]}}\n"
      "stereo: {left: a, right: b, baseline_m: 0.2, rectified: [3, 3, 320, 240], sigma_px: [1, 1, 1, 1]}\n"
      "markers: {family: tag36h11, size_m: 0.2}\nmotion6: {sigma_v_mps: [1, 1, 1], sigma_w_radps: [1, 1, 1]}\nlidar_x: "
      "5\n");
  open_it();
  size_t count;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(3 + 5, count);  // with coded markers the other cameras are sensors, too
  TEST_ASSERT_EQUAL_STRING("a", sensors[3].name);
  TEST_ASSERT_EQUAL_DOUBLE(9, sensors[2].mounting.xyz_m[0]);  // the camera's of the same name
  TEST_ASSERT_EQUAL_STRING("laser", sensors[0].name);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 2, sensors[0].mounting.rpy_rad[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 180, sensors[0].bearing_sigma_rad);
  TEST_ASSERT_EQUAL_DOUBLE(3, sensors[0].mounting.xyz_m[2]);
  TEST_ASSERT_EQUAL_DOUBLE(30, sensors[0].max_range_m);
  TEST_ASSERT_TRUE(sensors[0].range_is_depth);
  TEST_ASSERT_DOUBLE_IS_NAN(sensors[1].range_sigma_m);
  TEST_ASSERT_DOUBLE_IS_INF(sensors[1].max_range_m);
  TEST_ASSERT_TRUE(!sensors[1].range_is_depth);
  const wm_wheels *wheels = wm_site_wheels(wm_recording_site(recording));
  TEST_ASSERT_EQUAL_DOUBLE(2048, wheels->ticks_per_turn);
  TEST_ASSERT_EQUAL_DOUBLE(-0.2, wheels->encoder_offset_m);
  TEST_ASSERT_EQUAL_DOUBLE(13, wheels->steering_ratio);
  TEST_ASSERT_EQUAL(3, wheels->steering_table_count);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.008, wheels->actuator_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, -M_PI / 6, wheels->road_wheel_rad[0]);
  TEST_ASSERT_NOT_NULL(strstr(warnings, "lidar_x: unknown key, ignored"));
  TEST_ASSERT_NULL(strstr(warnings, "x_maker"));
  TEST_ASSERT_NOT_NULL(strstr(warnings, "sensors.sonar: no mounting given; it is taken to sit at base_link"));
  const char *text = wm_site_calibration_text(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(strlen(text), count);
  TEST_ASSERT_EQUAL_STRING_LEN("sensors:\n", text, 9);
}

TEST(bad_calibrations) {
  static const char *const kBad[][2] = {
      {"cameras: {a: {model: double-sphere, size: [640, 480], intrinsics: [0, 1.5, 3, 3, 320, 240]}}",
       "cameras.a.intrinsics[1]: '1.5' is out of range; a number from 0 to 1 is needed"},
      {"cameras: {a: {model: equidistant, size: [640], intrinsics: [3, 3, 320, 240]}}",
       "size: [width, height] in pixels is needed"},
      {"cameras: {a: {model: equidistant, size: [640, 480], intrinsics: [0, 3, 320, 240]}}", "a number above 0"},
      {"cameras: {a: {model: equidistant, size: [640, 480], intrinsics: [3, 3, 320, 240], distortion: [1, 2]}}",
       "has 2 values"},
      {"cameras: {a: {size: [640, 480]}}", "model: one of equidistant, pinhole-radtan"},
      {"cameras: 5", "a map of cameras by their names is needed"},
      {"sensors: {'a b': {}}", "a name has 1 to 31 letters without blank, comma or colon"},
      {"sensors: {a: 5}", "a map with mounting"},
      {"wheels: [1]", "a list is not a map"},
      {"wheels: {steering_table: {actuator_mm: [1, 2]}}", "actuator_mm and road_wheel_rad are both needed"},
      {"wheels: {steering_table: {actuator_mm: [1], road_wheel_rad: [1]}}", "has 1 values; a list of 2 to 64"},
      {"markers: {size_m: -1}", "a number above 0"},
      {"motion6: {sigma_v_mps: [1, 1]}", "a list of 3 numbers"},
      {"whels: {}", "unknown key; did you mean 'wheels'?"},
      {"sensors: {a: {mounting: {xyz_m: [1, 2, .nan]}}}", "is not a finite number"},
  };
  for (size_t i = 0; i < sizeof kBad / sizeof *kBad; i++) {
    folder_write("calibration.yaml", kBad[i][0]);
    refused(kBad[i][1]);
  }
}

TEST(landmarks) {
  folder_write("landmarks.csv", "id,x_m,y_m,z_m,sigma_m,yaw_rad\r\n7,1,2,,0.5,\r\n3,4,5,6,,1.5\r\n");
  open_it();
  size_t count;
  const wm_landmark *all = wm_site_landmarks(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_EQUAL(7, all[0].id);
  TEST_ASSERT_EQUAL_DOUBLE(0, all[0].p_m[2]);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, all[0].sigma_m);
  TEST_ASSERT_DOUBLE_IS_NAN(all[0].yaw_rad);
  TEST_ASSERT_EQUAL(3, all[1].id);
  TEST_ASSERT_EQUAL_DOUBLE(6, all[1].p_m[2]);
  TEST_ASSERT_DOUBLE_IS_NAN(all[1].sigma_m);
  TEST_ASSERT_EQUAL_DOUBLE(1.5, all[1].yaw_rad);
  TEST_ASSERT_NOT_NULL(strstr(warnings, "z_m: empty for 1 of 2 landmarks; taken as 0"));
  // As a run writes its map; what is no covariance is none.
  folder_write("landmarks.csv",
               "id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt\n"
               "1,1,2,3,0.2,0.04,0.01,0.01,0.5,0.0004\n2,1,2,3,0.2,0.04,0.03,0.01,,\n");
  open_it();
  all = wm_site_landmarks(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL_DOUBLE(0.04, all[0].cov_m2[0]);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, all[0].cov_m2[1]);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, all[0].cov_m2[2]);
  TEST_ASSERT_EQUAL_DOUBLE(0.02, all[0].yaw_sigma_rad);
  TEST_ASSERT_DOUBLE_IS_NAN(all[1].cov_m2[0]);
  TEST_ASSERT_DOUBLE_IS_NAN(all[1].cov_m2[1]);
  TEST_ASSERT_DOUBLE_IS_NAN(all[1].yaw_sigma_rad);

  folder_write("landmarks.csv", "id,x_m,y_m\n1,0,0\n2,0\n");
  refused("landmarks.csv:3: 2 fields where the header has 3");
}

TEST(overridden) {
  folder_write("landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n1,0,0,0,0\n");
  folder_write("other.csv", "id,x_m,y_m,z_m,sigma_m\n1,0,0,0,0\n2,0,0,0,0\n");
  snprintf(overrides.landmarks, sizeof overrides.landmarks, "%s", folder_path("other.csv"));
  open_it();
  size_t count;
  wm_site_landmarks(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(2, count);
  snprintf(overrides.calibration, sizeof overrides.calibration, "no/such.yaml");
  refused("no/such.yaml: there is no such file");
}

TEST(unlisted_streams) {
  folder_write("recording.yaml", ABOUT "streams: [motion.csv]\n");
  folder_write("gnss.csv", "t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m\n");
  open_it();
  size_t count;
  wm_recording_sources(recording, &count);
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_NOT_NULL(
      strstr(warnings, "gnss.csv: is not listed under streams in recording.yaml, but there: it is read"));
}

TEST(can_and_its_binding) {
  folder_write("vehicle.dbc",
               "BU_: CAR\nBO_ 291 SPEED: 4 CAR\n SG_ A : 0|8@1+ (1,0) [0|0] \"m/s\" CAR\n SG_ B : 8|8@1+ (0.1,0) [0|0] "
               "\"m/s\" CAR\n"
               " SG_ G : 16|8@1+ (1,0) [0|0] \"\" CAR\n");
  folder_write("can-signals.yaml",
               "- {quantity: vehicle_speed, message: SPEED, signal: [A, B], scale: -1, offset: 0.5}\n"
               "- {quantity: gear, message: SPEED, signal: G, values: {forward: [4, 5], reverse: 2, neutral: [3]}}\n");
  folder_write("can.log",
               "(1.000001) can0 123#03020400\nrubbish\n\n# word\n(900000.5) can0 123#00000000\n(1.000000) can0 "
               "123#01000200\n(1.5) can0 7FF#00\n");
  (void)unlink(folder_path("motion.csv"));
  open_it();
  TEST_ASSERT_EQUAL((1u << WM_Q_VEHICLE_SPEED) | (1u << WM_Q_GEAR), wm_recording_quantities(recording));
  size_t count;
  wm_source *can = wm_recording_sources(recording, &count)[0];
  wm_event event;
  TEST_ASSERT_EQUAL(WM_OK, can->ops->next(can, &event, &err));
  TEST_ASSERT_EQUAL(1000001000, event.t_ns);
  TEST_ASSERT_EQUAL(2, event.as.quantities.count);
  double speed =
      event.as.quantities.id[0] == WM_Q_VEHICLE_SPEED ? event.as.quantities.value[0] : event.as.quantities.value[1];
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -3.2 + 0.5, speed);
  TEST_ASSERT_EQUAL(WM_OK, can->ops->next(can, &event, &err));
  TEST_ASSERT_EQUAL(1000001000, event.arrival_ns);
  TEST_ASSERT_EQUAL(1, can->counts.out_of_order);
  TEST_ASSERT_EQUAL(WM_END, can->ops->next(can, &event, &err));
  TEST_ASSERT_EQUAL(1, can->counts.malformed);
  TEST_ASSERT_EQUAL(1, can->counts.not_finite);  // 900000.5 s
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(can->counts.first_problem, "can.log:2: "), can->counts.first_problem);
  (void)unlink(folder_path("vehicle.dbc"));
  refused("vehicle.dbc: is not there, but needed to read can.log");
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n0,0,0\n");
  open_it();
  TEST_ASSERT_NOT_NULL(strstr(warnings, "vehicle.dbc: is not there; can.log is not read"));
}

// A log that is packed by gzip is read as it is, up to where it is cut.
TEST(packed_can_log) {
  enum { kFrames = 3000 };
  static char packed[1 << 16];
  folder_write("vehicle.dbc", "BU_: CAR\nBO_ 291 SPEED: 4 CAR\n SG_ A : 0|16@1+ (1,0) [0|0] \"m/s\" CAR\n");
  folder_write("can-signals.yaml", "- {quantity: vehicle_speed, message: SPEED, signal: A}\n");
  gzFile file = gzopen(folder_path("can.log"), "wb");
  for (int i = 0; i < kFrames; i++)
    TEST_ASSERT_GREATER_THAN(
        0, gzprintf(file, "(%d.%06d) can0 123#%04X0000\n", 1 + i / 100, i % 100 * 9973, i * 7919 % 65536));
  TEST_ASSERT_EQUAL(Z_OK, gzclose(file));
  FILE *from = fopen(folder_path("can.log"), "rb");
  const size_t length = fread(packed, 1, sizeof packed, from);
  (void)fclose(from);
  TEST_ASSERT_LESS_THAN(sizeof packed, length);
  for (int is_cut = 0; is_cut < 2; is_cut++) {
    size_t sources, count = 0;
    wm_event event;
    wm_status status;
    folder_write_bytes("can.log", packed, is_cut ? length / 2 : length);
    open_it();
    wm_source *can = wm_recording_sources(recording, &sources)[0];
    while ((status = can->ops->next(can, &event, &err)) == WM_OK) count++;
    TEST_ASSERT_EQUAL(WM_END, status);
    TEST_ASSERT_EQUAL(is_cut, can->counts.malformed);
    if (!is_cut) TEST_ASSERT_EQUAL(kFrames, count);
    if (!is_cut) continue;
    TEST_ASSERT_GREATER_THAN(kFrames / 4, count);
    TEST_ASSERT_LESS_THAN(kFrames, count);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(can->counts.first_problem, "is packed by gzip, and ends too early"),
                                 can->counts.first_problem);
  }
}

// Positions of a receiver on the bus: about the origin of calibration.yaml, with its own accuracy, none without a fix.
TEST(gnss_over_can) {
  folder_write("vehicle.dbc",
               "BU_: CAR\nBO_ 3 GPS: 8 CAR\n SG_ LAT : 0|32@1- (1e-07,0) [0|0] \"deg\" CAR\n"
               " SG_ LON : 32|32@1- (1e-07,0) [0|0] \"deg\" CAR\n"
               "BO_ 4 FIX: 4 CAR\n SG_ OK : 0|8@1+ (1,0) [0|0] \"\" CAR\n SG_ ACC : 8|8@1+ (0.1,0) [0|0] \"m\" CAR\n"
               " SG_ ALT : 16|16@1- (0.1,0) [0|0] \"m\" CAR\n");
  folder_write("can-signals.yaml",
               "- {quantity: gnss_latitude, message: GPS, signal: LAT}\n"
               "- {quantity: gnss_longitude, message: GPS, signal: LON}\n"
               "- {quantity: gnss_valid, message: FIX, signal: OK}\n"
               "- {quantity: gnss_sigma_xy, message: FIX, signal: ACC}\n"
               "- {quantity: gnss_altitude, message: FIX, signal: ALT}\n");
  folder_write("calibration.yaml", "gnss: {origin: [52.5, 13.4, 30]}\n");
  folder_write("can.log",
               "(1.0) can0 004#01195E01\n(1.1) can0 003#40DD4A1F80ADFC07\n(2.0) can0 003#50044B1F80ADFC07\n"
               "(3.0) can0 004#00195E01\n(3.1) can0 003#50044B1F80ADFC07\n(4.0) can0 7FF#00\n");
  open_it();
  TEST_ASSERT_EQUAL(0, wm_recording_quantities(recording));
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  TEST_ASSERT_EQUAL(2, count);  // and motion.csv
  wm_source *gnss = sources[0];
  TEST_ASSERT_EQUAL_STRING("can-gnss", gnss->name);
  TEST_ASSERT_FALSE(gnss->is_motion);
  wm_event event;
  TEST_ASSERT_EQUAL(WM_OK, gnss->ops->next(gnss, &event, &err));
  TEST_ASSERT_EQUAL(WM_EVENT_POSITION, event.kind);
  TEST_ASSERT_EQUAL(1100000000, event.t_ns);
  const double first[3] = {0, 0, 5};
  for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-6, first[i], event.as.position.p_m[i]);
  TEST_ASSERT_EQUAL_DOUBLE(2.5, event.as.position.sigma_xy_m);
  TEST_ASSERT_EQUAL_DOUBLE(5.0, event.as.position.sigma_z_m);
  TEST_ASSERT_EQUAL(WM_OK, gnss->ops->next(gnss, &event, &err));
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 111.27, event.as.position.p_m[1]);  // 0.001 degrees of the meridian there
  TEST_ASSERT_EQUAL(WM_END, gnss->ops->next(gnss, &event, &err));
}

// A fix without an altitude: the last altitude is not of this position.
TEST(gnss_altitude_over_can) {
  const double origin[3] = {52.5, 13.4, 30};
  wm_can_gnss gnss;
  wm_can_gnss_init(&gnss, origin);
  for (int valid = 1; valid >= 0; valid--) {
    const wm_quantities values = {.count = 4,
                                  .id = {WM_CAN_ALTITUDE_VALID, WM_CAN_ALTITUDE, WM_CAN_LATITUDE, WM_CAN_LONGITUDE},
                                  .value = {valid, 35.0, 52.5 * M_PI / 180, 13.4 * M_PI / 180}};
    wm_position p;
    TEST_ASSERT_EQUAL(1, wm_can_gnss_take(&gnss, &values, &p));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, p.p_m[0]);
    if (valid) TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5, p.p_m[2]);
    TEST_ASSERT_EQUAL(valid, !isnan(p.p_m[2]));
    TEST_ASSERT_EQUAL(valid, !isnan(p.sigma_z_m));
  }
}

TEST(too_many_sensors) {
  char text[8192] = "t_ns,sensor,id,bearing_rad,range_m\n";
  for (int i = 0; i < 33; i++) sprintf(text + strlen(text), "%d,s%d,1,0,1\n", i, i);
  folder_write("sightings.csv", text);
  refused("sightings.csv:34: more than 32 different sensors");
}

TEST(motion_kind_is_refused_by_name) {
  open_it();
  TEST_ASSERT_NULL(strstr(warnings, "motion_kind"));
  folder_write("recording.yaml", ABOUT "vehicle:\n  motion_kind: commands, not encoders\n");
  open_it();
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warnings, "recording.yaml:6: vehicle.motion_kind: is not read"), warnings);
  TEST_ASSERT_NOT_NULL(strstr(warnings, "motion.twist"));
}
