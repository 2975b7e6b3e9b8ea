// SPDX-License-Identifier: Apache-2.0
// The CSV streams: columns by name, stamps to the last digit, and each kind of broken row.
#include "common/folder.h"
#include "common/suite.h"
#include "waymark/event_fields.h"
#include "waymark/recording.h"

static wm_recording *recording;
static wm_error err;
static char warnings[4096];

void setUp(void) {
  folder_make();
  folder_write("recording.yaml", "format: waymark-recording/1\n");
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n0,0,0\n");
  recording = NULL;
  warnings[0] = '\0';
}

void tearDown(void) {
  wm_recording_close(recording);
  folder_remove();
}

static void keep_warning(void *context, wm_note note, const char *text) {
  (void)context;
  (void)note;
  strncat(warnings, text, sizeof warnings - strlen(warnings) - 2);
  strcat(warnings, "\n");
}

static wm_source *source(const char *name) {
  if (!recording) {
    wm_status status = wm_recording_open(folder_path("."), NULL, keep_warning, NULL, &recording, &err);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
  }
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  for (size_t i = 0; i < count; i++)
    if (strcmp(sources[i]->name, name) == 0) return sources[i];
  TEST_FAIL_MESSAGE(name);
  return NULL;
}

static wm_event next(wm_source *from) {
  static wm_event event;
  memset(&event, 0xA5, sizeof event);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, from->ops->next(from, &event, &err), from->counts.first_problem);
  return event;
}

static void at_end(wm_source *from) {
  wm_event event;
  TEST_ASSERT_EQUAL(WM_END, from->ops->next(from, &event, &err));
  TEST_ASSERT_EQUAL(WM_END, from->ops->next(from, &event, &err));
}

TEST(motion_exact) {
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n9007199254740993,0.1,-0.25\n9007199254740994,-1e-3,.5\n");
  wm_source *motion = source("motion");
  wm_event event = next(motion);
  TEST_ASSERT_EQUAL_INT64(INT64_C(9007199254740993), event.t_ns);
  TEST_ASSERT_EQUAL_INT64(event.t_ns, event.arrival_ns);
  TEST_ASSERT_EQUAL_DOUBLE(0.1, event.as.twist2.v_mps);
  TEST_ASSERT_EQUAL_DOUBLE(-0.25, event.as.twist2.w_radps);
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST2, event.kind);
  TEST_ASSERT_EQUAL(0, event.seq);
  event = next(motion);
  TEST_ASSERT_EQUAL_DOUBLE(-1e-3, event.as.twist2.v_mps);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, event.as.twist2.w_radps);
  TEST_ASSERT_EQUAL(1, event.seq);
  at_end(motion);
  TEST_ASSERT_TRUE(motion->is_motion);
  TEST_ASSERT_EQUAL(2, motion->counts.received);
}

TEST(motion_sideways) {
  folder_write("motion.csv", "t_ns,v_mps,vy_mps,w_radps\n1,0.5,0.25,-0.125\n2,0.5,,-0.125\n");
  wm_source *motion = source("motion");
  TEST_ASSERT_EQUAL_HEX32(WM_EVENT_BIT(WM_EVENT_TWIST2) | WM_EVENT_BIT(WM_EVENT_TWIST6), motion->kinds);
  wm_event event = next(motion);
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST6, event.kind);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, event.as.twist6.v_mps[0]);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, event.as.twist6.v_mps[1]);
  TEST_ASSERT_EQUAL_DOUBLE(0, event.as.twist6.v_mps[2]);
  TEST_ASSERT_EQUAL_DOUBLE(-0.125, event.as.twist6.w_radps[2]);
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST2, next(motion).kind);
  at_end(motion);
}

// The turn rate about base_link's z axis, by the mounting: here the IMU's x axis points up.
TEST(imu_by_its_mounting) {
  folder_write("calibration.yaml", "imu: {mounting: {rpy_deg: [0, -90, 0]}}\n");
  folder_write("imu.csv", "t_ns,wx_radps,wy_radps,wz_radps,temperature_c\n1,0.5,0.25,0.125,21\n2,0.5,2e9,0,\n");
  wm_source *imu = source("imu");
  wm_event event = next(imu);
  TEST_ASSERT_EQUAL(WM_EVENT_QUANTITIES, event.kind);
  TEST_ASSERT_EQUAL(WM_Q_YAW_RATE, event.as.quantities.id[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.5, event.as.quantities.value[0]);
  TEST_ASSERT_TRUE(imu->is_motion);
  TEST_ASSERT_EQUAL_HEX32(1u << WM_Q_YAW_RATE | 1u << WM_Q_ROLL_RATE | 1u << WM_Q_PITCH_RATE,
                          wm_recording_quantities(recording));
  at_end(imu);
  TEST_ASSERT_EQUAL(1, imu->counts.not_finite);
}

// The same data, written in the ways that the format allows.
TEST(spellings) {
  static const char *const kFiles[] = {
      "w_radps,t_ns,v_mps\n2,10,1\n4,20,3\n",
      "t_ns,v_mps,w_radps,arrival_ns\n10,1,2,\n20,3,4,20\n",
      "\xEF\xBB\xBFt_ns,v_mps,w_radps\r\n10,1,2\r\n20,3,4\r\n",
      "t_ns,v_mps,w_radps\r10,1,2\r20,3,4\r",
      "\xEF\xBB\xBFt_ns,v_mps,w_radps\r10,1,2\r20,3,4",
      " t_ns , v_mps,\tw_radps \n\n10, 1 ,2\n\r\n20,3,4",
      "t_ns,note,v_mps,w_radps\n10,fine,1,2\n20,,3,4\n",
  };
  for (size_t i = 0; i < sizeof kFiles / sizeof *kFiles; i++) {
    folder_write("motion.csv", kFiles[i]);
    wm_source *motion = source("motion");
    for (int row = 0; row < 2; row++) {
      wm_event event = next(motion);
      TEST_ASSERT_EQUAL_INT64(10 * (row + 1), event.t_ns);
      TEST_ASSERT_EQUAL_INT64(event.t_ns, event.arrival_ns);
      TEST_ASSERT_EQUAL_DOUBLE(1 + 2 * row, event.as.twist2.v_mps);
      TEST_ASSERT_EQUAL_DOUBLE(2 + 2 * row, event.as.twist2.w_radps);
    }
    at_end(motion);
    TEST_ASSERT_EQUAL(0, motion->counts.malformed + motion->counts.out_of_order);
    wm_recording_close(recording);
    recording = NULL;
  }
  TEST_ASSERT_NOT_NULL(strstr(warnings, "motion.csv:1: unknown column 'note', ignored"));
}

TEST(broken_rows) {
  static char text[200000];
  strcpy(text,
         "t_ns,v_mps,w_radps\n1,1,1\nx,1,1\n2,1\n3,1,1,1\n4,nan,0\n5,1e9,0\n6,,0\n99999999999999999999,1,1\n1.5,1,1\n");
  size_t n = strlen(text);
  memset(text + n, '7', 150000);
  strcpy(text + n + 150000, "\n7,2,2");
  folder_write("motion.csv", text);
  wm_source *motion = source("motion");
  TEST_ASSERT_EQUAL(1, next(motion).t_ns);
  wm_event event = next(motion);
  TEST_ASSERT_EQUAL(7, event.t_ns);
  TEST_ASSERT_EQUAL(1, event.seq);
  at_end(motion);
  TEST_ASSERT_EQUAL(6, motion->counts.malformed);
  TEST_ASSERT_EQUAL(3, motion->counts.not_finite);
  TEST_ASSERT_EQUAL(2, motion->counts.received);
  const char *tail = "motion.csv:3: t_ns: 'x' is not a whole number; the row is skipped";
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(motion->counts.first_problem, tail), motion->counts.first_problem);
}

// Stamps that a program held as floating point: whole ones are taken by their digits, exactly.
TEST(float_stamps) {
  folder_write("motion.csv",
               "t_ns,v_mps,w_radps\n-5.0,1,0\n1.0,1,0\n2e0,1,0\n30e-1,1,0\n1.5,1,0\n1.7000000001e1,1,0\n"
               "1700000000123456789.000,1,0\n1.700000000123456790e+18,1,0\n1.7e+25,1,0\n1e-400000,1,0\n");
  wm_source *motion = source("motion");
  static const int64_t kStamps[] = {-5, 1, 2, 3, INT64_C(1700000000123456789), INT64_C(1700000000123456790)};
  for (size_t i = 0; i < sizeof kStamps / sizeof kStamps[0]; i++)
    TEST_ASSERT_EQUAL_INT64(kStamps[i], next(motion).t_ns);
  at_end(motion);
  TEST_ASSERT_EQUAL(3, motion->counts.malformed);
  TEST_ASSERT_EQUAL(1, motion->counts.not_finite);
}

TEST(zero_bytes) {
  static const char kText[] = "t_ns,v_mps,w_radps\n1,1,1\n2,\0,1\n\0\0\0\n3,1,1\n";
  folder_write_bytes("motion.csv", kText, sizeof kText - 1);
  wm_source *motion = source("motion");
  next(motion);
  TEST_ASSERT_EQUAL(3, next(motion).t_ns);
  at_end(motion);
  TEST_ASSERT_EQUAL(2, motion->counts.malformed);
}

// Many buffers' worth of rows, so that lines fall across the buffer's end.
TEST(long_file) {
  enum { ROWS = 20000 };
  char *text = malloc(ROWS * 48);
  size_t n = (size_t)sprintf(text, "t_ns,v_mps,w_radps\n");
  for (int i = 0; i < ROWS; i++) n += (size_t)sprintf(text + n, "%lld,%d.%d,%d\n", i * 1000003LL, i % 7, i, i % 3);
  folder_write_bytes("motion.csv", text, n);
  free(text);
  wm_source *motion = source("motion");
  for (int i = 0; i < ROWS; i++) {
    wm_event event = next(motion);
    TEST_ASSERT_EQUAL_INT64(i * INT64_C(1000003), event.t_ns);
    TEST_ASSERT_EQUAL_DOUBLE(i % 3, event.as.twist2.w_radps);
  }
  at_end(motion);
}

TEST(order_of_arrival) {
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n10,1,0\n30,2,0\n20,3,0\n40,4,0\n");
  folder_write("gnss.csv",
               "t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m,arrival_ns\n10,1,1,,2,,200\n5,2,2,3,2,4,210\n20,3,3,,2,,205\n");
  wm_source *motion = source("motion"), *gnss = source("gnss");
  static const int kStamps[] = {10, 30, 20, 40}, kArrivals[] = {10, 30, 30, 40};
  for (int i = 0; i < 4; i++) {
    wm_event event = next(motion);
    TEST_ASSERT_EQUAL(kStamps[i], event.t_ns);
    TEST_ASSERT_EQUAL(kArrivals[i], event.arrival_ns);
  }
  TEST_ASSERT_EQUAL(1, motion->counts.out_of_order);
  wm_event event = next(gnss);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.position.p_m[2]);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.position.sigma_z_m);
  TEST_ASSERT_EQUAL(200, event.arrival_ns);
  event = next(gnss);
  TEST_ASSERT_EQUAL(5, event.t_ns);
  TEST_ASSERT_EQUAL(210, event.arrival_ns);
  TEST_ASSERT_EQUAL_DOUBLE(4, event.as.position.sigma_z_m);
  TEST_ASSERT_EQUAL(210, next(gnss).arrival_ns);
  TEST_ASSERT_EQUAL(1, gnss->counts.out_of_order);
}

// Rows stamped with the beginning of their interval: each row's values get the stamp of the next good row.
TEST(values_of_the_row_before) {
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n10,1,0\n20,2,0\n9000000000000000,9,0\n35,3,0\n50,4,0\n");
  wm_source *motion = source("motion");
  motion->sample_at_next = 1;
  static const int kStamps[] = {20, 35, 50};
  for (int i = 0; i < 3; i++) {
    wm_event event = next(motion);
    TEST_ASSERT_EQUAL(kStamps[i], event.t_ns);
    TEST_ASSERT_EQUAL(kStamps[i], event.arrival_ns);
    TEST_ASSERT_EQUAL_DOUBLE(i + 1, event.as.twist2.v_mps);
  }
  at_end(motion);
}

// One stamp far ahead must not make the rest of the drive late.
TEST(leaping_stamps) {
  folder_write(
      "motion.csv",
      "t_ns,v_mps,w_radps\n900000000000000,1,0\n0,1,0\n100,2,0\n3000000000000000000,3,0\n300,4,0\n60000000300,5,0\n"
      "60000000200,6,0\n0,7,0\n60000000400,8,0\n");
  wm_source *motion = source("motion");
  static const int64_t kStamps[] = {0, 100, 300, 60000000300, 60000000200, 60000000400};
  for (int i = 0; i < 6; i++) TEST_ASSERT_EQUAL_INT64(kStamps[i], next(motion).t_ns);
  at_end(motion);
  TEST_ASSERT_EQUAL(3, motion->counts.not_finite);    // two ahead of their neighbours, one far behind
  TEST_ASSERT_EQUAL(1, motion->counts.out_of_order);  // a tenth of a microsecond back is no leap
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(motion->counts.first_problem,
                                      "motion.csv:2: t_ns: lies 900000 s after the next row's; the row is skipped"),
                               motion->counts.first_problem);
}

TEST(sightings_by_sensor) {
  folder_write("calibration.yaml",
               "sensors:\n  right: {mounting: {xyz_m: [0, -1, 0], rpy_deg: [0, 0, 90]}, bearing_sigma_rad: 0.01}\n"
               "cameras:\n  front: {model: equidistant, size: [640, 480], intrinsics: [300, 300, 320, 240], mounting: "
               "{xyz_m: [2, 0, 1]}}\n");
  folder_write("sightings.csv",
               "t_ns,sensor,id,bearing_rad,range_m\n1,left,7,0.5,\n1,right,8,,2.5\n2,left,,4.0,1\n3,front,9,,\n3,front,"
               "9,0.1,\n4,right,1\n"
               "5,,1,0,1\n6,left,-2,0,1\n7,right,3,0,0\n");
  wm_source *left = source("sightings:left"), *right = source("sightings:right"), *front = source("sightings:front");
  size_t count;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(recording), &count);
  TEST_ASSERT_EQUAL(3, count);
  wm_event event = next(left);
  TEST_ASSERT_EQUAL_STRING("left", sensors[event.as.sighting.sensor].name);
  TEST_ASSERT_EQUAL(7, event.as.sighting.landmark_id);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, event.as.sighting.bearing_rad);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.sighting.range_m);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.sighting.bearing_sigma_rad);
  event = next(left);
  TEST_ASSERT_EQUAL(-1, event.as.sighting.landmark_id);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 4.0 - 2 * M_PI, event.as.sighting.bearing_rad);
  at_end(left);
  event = next(right);
  TEST_ASSERT_EQUAL(0, event.as.sighting.sensor);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.sighting.bearing_rad);
  TEST_ASSERT_EQUAL_DOUBLE(2.5, event.as.sighting.range_m);
  at_end(right);
  event = next(front);
  TEST_ASSERT_EQUAL_DOUBLE(2.0, sensors[event.as.sighting.sensor].mounting.xyz_m[0]);
  at_end(front);
  TEST_ASSERT_EQUAL(1, left->counts.malformed);   // the row without a sensor is the first source's
  TEST_ASSERT_EQUAL(1, left->counts.not_finite);  // id -2
  TEST_ASSERT_EQUAL(1, right->counts.malformed);
  TEST_ASSERT_EQUAL(1, right->counts.not_finite);  // range 0
  TEST_ASSERT_EQUAL(1, front->counts.malformed);
  TEST_ASSERT_NOT_NULL(strstr(warnings, "the sensor 'left' is not in calibration.yaml"));
  TEST_ASSERT_NULL(strstr(warnings, "'front'"));
}

// By the table: each number has a column of its name, which takes its limits.
TEST(each_number_of_a_sighting_has_a_column) {
  char header[1000] = "t_ns,sensor,id", row[1000] = "1,eye,7";
  wm_sighting given = wm_sighting_without_numbers();
  double step = 0;
  folder_write("calibration.yaml", "sensors:\n  eye: {bearing_sigma_rad: 0.01}\n");
#define ADD(member, need, least, most, limits, since, zero_until, message) \
  given.member = 0.5 * (fmax(least, -1) + fmin(most, 2)) + (step += 0.01); \
  strcat(header, "," #member);                                             \
  (void)snprintf(row + strlen(row), sizeof row - strlen(row), ",%.17g", given.member);
  WM_SIGHTING_NUMBERS(ADD)
  (void)snprintf(header + strlen(header), sizeof header - strlen(header), "\n%s\n", row);
  folder_write("sightings.csv", header);
  const wm_sighting s = next(source("sightings:eye")).as.sighting;
#define COMPARE(member, need, least, most, limits, since, zero_until, message) \
  TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(given.member, s.member, #member);
  WM_SIGHTING_NUMBERS(COMPARE)
}

// Sigmas of a row, its covariance on axes turned by the bearing, and what is not whole.
TEST(sightings_with_their_own_noise) {
  folder_write("calibration.yaml", "sensors:\n  eye: {bearing_sigma_rad: 0.01}\n");
  folder_write(
      "sightings.csv",
      "t_ns,sensor,id,bearing_rad,range_m,bearing_sigma_rad,range_sigma_m,cov_xx_m2,cov_xy_m2,cov_yy_m2,"
      "elevation_rad,elevation_sigma_rad\n"
      "1,eye,1,0,2,0.03,0.2,,,,0.1,0.02\n"
      "2,eye,1,1.5707963267948966,2,,,0.04,0,0.09,,\n"
      "3,eye,1,0.78539816339744831,2,,,0.04,0.03,0.04,,\n"
      "4,eye,1,0,2,,,0.04,,0.09,,\n5,eye,1,0,,,,0.04,0,0.09,,\n6,eye,1,0,2,,,1,2,1,,\n7,eye,1,0,2,,,,,,0.1,\n");
  wm_source *eye = source("sightings:eye");
  wm_sighting s = next(eye).as.sighting;
  TEST_ASSERT_EQUAL_DOUBLE(0.03, s.bearing_sigma_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, s.range_sigma_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.1, s.elevation_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.02, s.elevation_sigma_rad);
  s = next(eye).as.sighting;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, s.range_sigma_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.2 / 2, s.bearing_sigma_rad);
  TEST_ASSERT_FALSE(wm_sighting_has_elevation(&s));
  s = next(eye).as.sighting;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(0.07), s.range_sigma_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(0.01) / 2, s.bearing_sigma_rad);
  at_end(eye);
  TEST_ASSERT_EQUAL(4, eye->counts.malformed);
}

TEST(increments_with_and_without_covariance) {
  folder_write("increments.csv",
               "t_ns,from_ns,dx_m,dy_m,dheading_rad,cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt\n"
               "5,0,0.1,0.2,0.3,1,0.1,2,0.2,0.3,3\n10,5,0.1,0,0.01,,,,,,\n15,15,1,0,0,,,,,,\n20,15,1,0,0,1,0,1,0,0,\n");
  wm_source *increments = source("increments");
  TEST_ASSERT_TRUE(increments->is_motion);
  wm_event event = next(increments);
  const wm_increment *i = &event.as.increment;
  TEST_ASSERT_EQUAL(WM_EVENT_INCREMENT, event.kind);
  TEST_ASSERT_EQUAL_INT64(5, event.t_ns);
  TEST_ASSERT_EQUAL_INT64(0, i->from_ns);
  TEST_ASSERT_EQUAL_DOUBLE(0.1, i->dx_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, i->dy_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.3, i->dheading_rad);
  const double covariance[6] = {1, 0.1, 2, 0.2, 0.3, 3};
  TEST_ASSERT_EQUAL_MEMORY(covariance, i->covariance, sizeof covariance);
  event = next(increments);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.increment.covariance[0]);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.increment.covariance[5]);
  at_end(increments);
  TEST_ASSERT_EQUAL(2, increments->counts.malformed);
}

TEST(points_by_stamp) {
  folder_write("points.csv", "t_ns,x_m,y_m\n1,1,2\n1,3,4\n2,5,6\n");
  wm_source *points = source("points");
  wm_event event = next(points);
  TEST_ASSERT_EQUAL(2, event.as.points.count);
  TEST_ASSERT_EQUAL_FLOAT(3, event.as.points.x_m[1]);
  event = next(points);
  TEST_ASSERT_EQUAL(2, event.t_ns);
  TEST_ASSERT_EQUAL(1, event.as.points.count);
  TEST_ASSERT_EQUAL_FLOAT(6, event.as.points.y_m[0]);
  at_end(points);
}

TEST(too_many_points) {
  char *text = malloc(20000);
  size_t n = (size_t)sprintf(text, "t_ns,x_m,y_m\n");
  for (int i = 0; i < WM_POINTS_MAX + 5; i++) n += (size_t)sprintf(text + n, "1,%d,0\n", i);
  folder_write_bytes("points.csv", text, n);
  free(text);
  wm_event event = next(source("points"));
  TEST_ASSERT_EQUAL(WM_POINTS_MAX, event.as.points.count);
  TEST_ASSERT_EQUAL(5, event.as.points.dropped);
}

// The log looks to the left, 0.3 m behind base_link.
TEST(a_velocity_log_has_no_rates) {
  folder_write("calibration.yaml", "motion6: {mounting: {xyz_m: [-0.3, 0, 0.1], rpy_deg: [0, 0, 90]}}\n");
  folder_write("motion6.csv",
               "t_ns,vx_mps,vy_mps,vz_mps,wx_radps,wy_radps,wz_radps,sigma_v_mps\n1,1,2,3,,,,0.02\n2,1,2,3,4,5,6,\n"
               "3,1,2,3,4,,6,0.02\n4,1,2,3,,,,0.02\n");
  wm_source *log = source("motion6");
  for (int i = 0; i < 3; i++) {
    const wm_event event = next(log);
    const wm_twist6 *twist = &event.as.twist6;
    TEST_ASSERT_EQUAL(i == 2 ? 4 : i + 1, event.t_ns);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -2, twist->v_mps[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, twist->v_mps[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3, twist->v_mps[2]);
    TEST_ASSERT_EQUAL_DOUBLE(-0.3, twist->arm_m[0]);
    TEST_ASSERT_EQUAL_DOUBLE(0.1, twist->arm_m[2]);
    if (i == 1) TEST_ASSERT_DOUBLE_WITHIN(1e-12, -5, twist->w_radps[0]);
    for (int k = 0; k < 3; k++) TEST_ASSERT_EQUAL(i != 1, isnan(twist->w_radps[k]));
    TEST_ASSERT_EQUAL(i == 1, isnan(twist->v_sigma_mps));
  }
  TEST_ASSERT_EQUAL_UINT64(1, log->counts.malformed);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(log->counts.first_problem, "all or none are empty"), log->counts.first_problem);
}

TEST(columns_of_rates_may_be_absent) {
  folder_write("motion6.csv", "t_ns,vx_mps,vy_mps,vz_mps\n1,1,2,3\n");
  const wm_event event = next(source("motion6"));
  TEST_ASSERT_EQUAL_DOUBLE(1, event.as.twist6.v_mps[0]);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.twist6.w_radps[2]);
  TEST_ASSERT_EQUAL_DOUBLE(0, event.as.twist6.arm_m[0]);
}

TEST(a_marker_has_sigmas_and_a_second_pose_where_the_file_has) {
  folder_write(
      "markers.csv",
      "t_ns,sensor,id,x_m,y_m,z_m,yaw_rad,along_sigma_m,yaw_sigma_rad,other_x_m,other_y_m,other_z_m,other_yaw_rad\n"
      "1,up,10,1,2,3,0.4,0.05,0.06,5,6,7,-3.2\n2,up,10,1,2,3,0.4,,,5,6,,0.3\n3,up,10,1,2,3,0.4,,,,,,\n");
  wm_source *markers = source("markers:up");
  wm_event event = next(markers);
  TEST_ASSERT_EQUAL(2, event.as.marker.poses);
  TEST_ASSERT_EQUAL_DOUBLE(0.05, event.as.marker.along_sigma_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.06, event.as.marker.yaw_sigma_rad);
  for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL_DOUBLE(5 + i, event.as.marker.other_p_m[i]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 2 * M_PI - 3.2, event.as.marker.other_yaw_rad);
  event = next(markers);
  TEST_ASSERT_EQUAL(3, event.t_ns);
  TEST_ASSERT_EQUAL(0, event.as.marker.poses);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.marker.along_sigma_m);
  TEST_ASSERT_EQUAL_UINT64(1, markers->counts.malformed);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(markers->counts.first_problem, "one of other_x_m"),
                               markers->counts.first_problem);
}

TEST(other_streams) {
  folder_write("motion6.csv", "t_ns,vx_mps,vy_mps,vz_mps,wx_radps,wy_radps,wz_radps\n1,1,2,3,4,5,6\n");
  folder_write("markers.csv", "t_ns,sensor,id,x_m,y_m,z_m,yaw_rad\n1,up,10,1,2,3,-3.2\n");
#define DIGITS_48 "0000000000000001000000000000000000000000000000ff"
  folder_write("stereo.csv",
               "t_ns,id,ul_px,vl_px,ur_px,vr_px,appearance\n1,4,1,2,,,\n2,4,1,,3,4,\n3,4,,,,,\n"
               "4,4,1,2,3,4," DIGITS_48 "8000000000000000\n5,4,1,2,3,4,0f\n6,4,1,2,3,4," DIGITS_48
               "800000000000000G\n"
               "7,4,1,2,3,4,\n");
  wm_event event = next(source("motion6"));
  TEST_ASSERT_EQUAL_DOUBLE(3, event.as.twist6.v_mps[2]);
  TEST_ASSERT_EQUAL_DOUBLE(4, event.as.twist6.w_radps[0]);
  event = next(source("markers:up"));
  TEST_ASSERT_EQUAL(10, event.as.marker.id);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 2 * M_PI - 3.2, event.as.marker.yaw_rad);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.marker.along_sigma_m);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.marker.yaw_sigma_rad);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.marker.bloom_px);
  wm_source *stereo = source("stereo");
  event = next(stereo);
  TEST_ASSERT_EQUAL_DOUBLE(2, event.as.stereo.left_px[1]);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.stereo.right_px[0]);
  static const uint64_t kAppearance[] = {1, 0, 0xff, UINT64_C(1) << 63}, kNone[4] = {0};
  event = next(stereo);
  TEST_ASSERT_EQUAL(4, event.t_ns);
  TEST_ASSERT_EQUAL_MEMORY(kAppearance, event.as.stereo.appearance, sizeof kAppearance);
  event = next(stereo);
  TEST_ASSERT_EQUAL(7, event.t_ns);
  TEST_ASSERT_EQUAL_MEMORY(kNone, event.as.stereo.appearance, sizeof kNone);
  TEST_ASSERT_EQUAL(4, stereo->counts.malformed);
  static const char *const kOrder[] = {"motion", "motion6", "markers:up", "stereo"};
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  TEST_ASSERT_EQUAL(4, count);
  for (size_t i = 0; i < count; i++) {
    TEST_ASSERT_EQUAL_STRING(kOrder[i], sources[i]->name);
    TEST_ASSERT_EQUAL(i, sources[i]->index);
  }
}

// Raw corners of a print 2 m ahead on a wall, seen askew by 0.5 rad: the pose of the print, with sigmas by its size.
TEST(marker_corners) {
  const double place[3] = {2, 0.3, 0.1}, askew = 0.5, half_m = 0.1, focal = 500;  // x forward, y left, z up
  const int right[4] = {-1, 1, 1, -1}, down[4] = {-1, -1, 1, 1};
  char text[1024], row[512] = "";
  size_t n = 0;
  for (int i = 0; i < 4; i++) {
    const double x = place[0] + half_m * right[i] * sin(askew), y = place[1] - half_m * right[i] * cos(askew);
    const double z = place[2] - half_m * down[i];
    n += (size_t)snprintf(row + n, sizeof row - n, ",%.6f,%.6f", 320 - focal * y / x, 240 - focal * z / x);
  }
  (void)snprintf(
      text, sizeof text,
      "t_ns,sensor,id,u0_px,v0_px,u1_px,v1_px,u2_px,v2_px,u3_px,v3_px,sigma_px\n1,front,7%s,0.1\n2,front,7%s,\n"
      "3,front,7,10,10,10,10,10,10,10,10,\n",
      row, row);
  folder_write("marker-corners.csv", text);
  folder_write("calibration.yaml",
               "cameras:\n  front: {model: pinhole-radtan, size: [640, 480], intrinsics: [500, 500, 320, 240],\n"
               "    mounting: {xyz_m: [0, 0, 0.3], rpy_deg: [0, 0, 0]}}\nmarkers: {family: tag36h11, size_m: 0.2}\n");
  wm_source *corners = source("corners:front");
  wm_event event = next(corners);
  const wm_marker sharp = event.as.marker;
  TEST_ASSERT_EQUAL(WM_EVENT_MARKER, event.kind);
  TEST_ASSERT_EQUAL(7, sharp.id);
  for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(0.005, place[i], sharp.p_m[i]);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, atan2(-cos(askew), sin(askew)), sharp.yaw_rad);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.001, sharp.along_sigma_m);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, sharp.along_sigma_m);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0, sharp.yaw_sigma_rad);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.5 * sharp.along_sigma_m, next(corners).as.marker.along_sigma_m);
  at_end(corners);
  TEST_ASSERT_EQUAL(1, corners->counts.malformed);
}

TEST(corners_need_a_camera) {
  folder_write("marker-corners.csv",
               "t_ns,sensor,id,u0_px,v0_px,u1_px,v1_px,u2_px,v2_px,u3_px,v3_px\n"
               "1,front,7,1,1,2,1,2,2,1,2\n");
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_recording_open(folder_path("."), NULL, keep_warning, NULL, &recording, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "'front' is not a camera"));
}
