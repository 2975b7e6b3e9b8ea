// SPDX-License-Identifier: Apache-2.0
// An IMU of Linux IIO on a tree as sysfs has it, with a FIFO as its character device: set up, read, absent, without a
// buffer, silent, doubled, late, of another clock, unplugged and back.
#include <fcntl.h>
#include <sys/stat.h>
#include <time.h>

#include "cli/doctor/doctor.h"
#include "common/folder.h"
#include "live_source.h"

static const char *root;
static int writer;

static void run(const char *format, const char *what) {
  char command[600];
  (void)snprintf(command, sizeof command, format, root, what);
  TEST_ASSERT_EQUAL_MESSAGE(0, system(command), command);
}

static void put(const char *name, const char *text) {
  char path[300];
  (void)snprintf(path, sizeof path, "%s/sys/bus/iio/devices/iio:device3/%s", root, name);
  FILE *f = fopen(path, "w");
  TEST_ASSERT_NOT_NULL_MESSAGE(f, path);
  (void)fprintf(f, "%s\n", text);
  (void)fclose(f);
}

static void expect_attribute(const char *name, const char *text) {
  char path[300], has[100] = "";
  (void)snprintf(path, sizeof path, "%s/sys/bus/iio/devices/iio:device3/%s", root, name);
  FILE *f = fopen(path, "r");
  TEST_ASSERT_NOT_NULL_MESSAGE(f, path);
  (void)fgets(has, sizeof has, f);
  (void)fclose(f);
  has[strcspn(has, "\n")] = '\0';
  TEST_ASSERT_EQUAL_STRING_MESSAGE(text, has, name);
}

static void element(const char *name, const char *index, const char *type) {
  char path[100];
  const char *const parts[] = {"en", "index", "type"}, *const values[] = {"0", index, type};
  for (int i = 0; i < 3; i++) {
    (void)snprintf(path, sizeof path, "scan_elements/in_%s_%s", name, parts[i]);
    put(path, values[i]);
  }
}

// As bmi160 has it: gyro, accelerometer, stamps.
static void plug_in(void) {
  run("mkdir -p %s/dev %s", "");
  run("cd %s && mkdir -p sys/bus/iio/devices/%s", "iio:device3/scan_elements sys/bus/iio/devices/trigger0");
  run("cd %s/sys/bus/iio/devices && mkdir -p iio:device3/buffer iio:device3/trigger && echo %s > trigger0/name",
      "bmi160-dev3");
  run("mkfifo %s/dev/%s", "iio:device3");
  put("name", "bmi160");
  static const char *const kAxes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; i++) {
    char name[20], index[4];
    (void)snprintf(name, sizeof name, "anglvel_%s", kAxes[i]);
    (void)snprintf(index, sizeof index, "%d", 3 + i);
    element(name, index, "le:s16/16>>0");
    (void)snprintf(name, sizeof name, "accel_%s", kAxes[i]);
    (void)snprintf(index, sizeof index, "%d", i);
    element(name, index, "le:s16/16>>0");
  }
  element("timestamp", "6", "le:s64/64>>0");
  put("in_anglvel_scale", "0.001");
  put("in_accel_scale", "0.01");
  put("in_anglvel_x_offset", "10");
  put("in_mount_matrix", "0, 1, 0; -1, 0, 0; 0, 0, 1");
  put("in_anglvel_sampling_frequency", "100");
  put("current_timestamp_clock", "realtime");
  put("trigger/current_trigger", "");
  put("buffer/enable", "0");
  put("buffer/length", "2");
}

static void open_writer(void) {
  char path[100];
  (void)snprintf(path, sizeof path, "%s/dev/iio:device3", root);
  writer = open(path, O_WRONLY | O_NONBLOCK);
}

static wm_iio_device_config config;

static void begin(void) {
  const wm_row_mountings level = {0};
  wm_row_device *device;
  TEST_ASSERT_EQUAL(WM_OK, wm_iio_open(&config, root, &device, &err));
  source_open(device, &level);
}

static void begin_capture(void) {
  plug_in();
  begin();
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_MESSAGE(WM_DEVICE_WORKS, source->counts.device, source->counts.device_note);
  open_writer();
  TEST_ASSERT_GREATER_OR_EQUAL(0, writer);
}

static size_t scan(uint8_t out[24], int64_t t_ns, int wx, int wz, int az) {
  const int16_t numbers[6] = {0, 0, (int16_t)az, (int16_t)wx, 0, (int16_t)wz};
  memset(out, 0, 24);
  memcpy(out, numbers, sizeof numbers);
  memcpy(out + 16, &t_ns, sizeof t_ns);
  return 24;
}

static void sample(int64_t t_ns, int wx, int wz, int az) {
  uint8_t bytes[24];
  const size_t length = scan(bytes, t_ns, wx, wz, az);
  TEST_ASSERT_EQUAL(length, write(writer, bytes, length));
}

void setUp(void) {
  config = (wm_iio_device_config){.device = "bmi160"};
  writer = -1;
  root = folder_make();
}

void tearDown(void) {
  source_close();
  if (writer >= 0) (void)close(writer);
  folder_remove();
}

TEST(a_buffer_is_set_up_and_read) {
  config.rate_hz = 200;
  begin_capture();
  expect_attribute("scan_elements/in_anglvel_z_en", "1");
  expect_attribute("scan_elements/in_accel_x_en", "1");
  expect_attribute("scan_elements/in_timestamp_en", "1");
  expect_attribute("in_anglvel_sampling_frequency", "200");
  expect_attribute("current_timestamp_clock", "monotonic");
  expect_attribute("trigger/current_trigger", "bmi160-dev3");
  expect_attribute("buffer/enable", "1");
  const wm_time_ns t_ns = wm_monotonic_ns();
  sample(t_ns - 2 * MS, 90, -250, 981);
  sample(t_ns - 1 * MS, 90, -251, 981);
  expect(WM_OK);
  TEST_ASSERT_EQUAL_INT64(t_ns - 2 * MS, event.t_ns);
  TEST_ASSERT_EQUAL(WM_EVENT_QUANTITIES, event.kind);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.25, event.as.quantities.value[0]);
  const wm_stream_row *row = row_source_row(source);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.1, row->number[1]);  // 0.001 (90 + 10) about x, which is -y of the board
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 9.81, row->number[5]);
  TEST_ASSERT_DOUBLE_IS_NAN(row->number[12]);
  expect(WM_OK);
  TEST_ASSERT_EQUAL_INT64(t_ns - 1 * MS, event.t_ns);
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_STRING("iio:device3 (bmi160) is read", source->counts.device_note);
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.received);
}

TEST(a_scan_may_come_in_parts) {
  begin_capture();
  uint8_t bytes[24];
  (void)scan(bytes, wm_monotonic_ns() - MS, 0, 500, 0);
  TEST_ASSERT_EQUAL(10, write(writer, bytes, 10));
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL(14, write(writer, bytes + 10, 14));
  expect(WM_OK);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, event.as.quantities.value[0]);
}

static void expect_down(const char *why, unsigned state) {
  begin();
  expect(WM_AGAIN);
  expect_device(state, why);
  wm_findings found = {0};
  wm_config whole = {.devices = {.iio = config}};
  put("buffer/enable", "0");
  doctor_imu(root, &whole, &found);
  TEST_ASSERT_EQUAL(WM_FOUND_IMU_DEVICE, found.at[0].id);
  if (strstr(why, "can't be opened") || strstr(why, "no trigger")) return;  // what only a run finds
  TEST_ASSERT_EQUAL(1, found.count);
  TEST_ASSERT_EQUAL(WM_SEVERITY_BAD, found.at[0].severity);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(found.at[0].text, why), found.at[0].text);
}

TEST(another_device_is_named) {
  plug_in();
  config = (wm_iio_device_config){.device = "mpu6050"};
  expect_down("there is no IIO device 'mpu6050' (there are: bmi160)", WM_DEVICE_ABSENT);
}

TEST(without_stamps_it_is_not_used) {
  plug_in();
  run("rm %s/sys/bus/iio/devices/iio:device3/scan_elements/%s*", "in_timestamp");
  expect_down("no in_anglvel_x, _y, _z and in_timestamp", WM_DEVICE_DOWN);
}

TEST(a_mirror_is_no_mounting) {
  plug_in();
  put("in_mount_matrix", "1, 0, 0; 0, 1, 0; 0, 0, -1");
  expect_down("in_mount_matrix is not a rotation", WM_DEVICE_DOWN);
}

TEST(a_trigger_is_needed) {
  plug_in();
  config.trigger[0] = 't';
  expect_down("no trigger 't' (there are: bmi160-dev3)", WM_DEVICE_DOWN);
}

TEST(without_a_buffer_it_is_not_used) {
  plug_in();
  run("rm -r %s/sys/bus/iio/devices/iio:device3/%s", "buffer");
  begin();
  expect(WM_AGAIN);
  expect_device(WM_DEVICE_DOWN, "iio:device3 (bmi160) has no buffer");
}

TEST(stamps_of_the_wall_clock_are_moved) {
  plug_in();
  run("rm %s/sys/bus/iio/devices/iio:device3/%s", "current_timestamp_clock");
  begin();
  (void)next();
  open_writer();
  struct timespec now;
  (void)clock_gettime(CLOCK_REALTIME, &now);
  const wm_time_ns before_ns = wm_monotonic_ns();
  sample((int64_t)now.tv_sec * WM_NS_PER_S + now.tv_nsec, 0, 1, 0);
  expect(WM_OK);
  TEST_ASSERT_INT64_WITHIN(5 * MS, before_ns, event.t_ns);
}

// A sensor's own clock that starts at 0 and leaps.
TEST(stamps_of_another_clock_are_followed) {
  begin_capture();
  for (int i = 1; i < 20; i++) {
    sample((i < 10 ? 0 : -5000) * MS * 100 + i * 10 * MS, 0, i, 0);
    const wm_status status = next();
    if (i < 10) TEST_ASSERT_EQUAL(WM_OK, status);
    if (status == WM_OK) TEST_ASSERT_INT64_WITHIN(300 * MS, wm_monotonic_ns(), event.t_ns);
  }
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(12, source->counts.received);
}

TEST(doubled_and_older_samples_are_counted) {
  begin_capture();
  const wm_time_ns t_ns = wm_monotonic_ns() - 500 * MS;  // late: fused at its stamp
  const wm_time_ns stamps[] = {t_ns, t_ns, t_ns - 10 * MS, t_ns + MS};
  for (int i = 0; i < 4; i++) sample(stamps[i], 0, i, 0);
  for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL(i == 0 || i == 3 ? WM_OK : WM_AGAIN, next());
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.ignored);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.out_of_order);
}

TEST(a_scale_that_is_no_number_is_refused) {
  plug_in();
  put("in_anglvel_scale", "nan");
  begin();
  (void)next();
  open_writer();
  sample(wm_monotonic_ns(), 0, 1, 0);
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.not_finite);
  expect_problem("bmi160: wx_radps is not a finite number");
}

TEST(unplugged_and_back) {
  begin_capture();
  sample(wm_monotonic_ns(), 0, 1, 0);
  expect(WM_OK);
  run("mv %s/sys/bus/iio/devices/iio:device3 %s", root);
  (void)close(writer);
  wait_for(WM_DEVICE_ABSENT, "");
  run("mv %s/iio:device3 %s/sys/bus/iio/devices/", root);
  put("buffer/enable", "0");
  wait_for(WM_DEVICE_WORKS, "");
  expect_attribute("buffer/enable", "1");
  open_writer();
  sample(wm_monotonic_ns(), 0, 1, 0);
  expect(WM_OK);
}

TEST(silence_is_reported) {
  begin_capture();
  wait_for(WM_DEVICE_STALLED, "does its trigger or its interrupt fire?");
  sample(wm_monotonic_ns(), 0, 1, 0);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
}

// A recorder beside a run takes the run's rows: the kernel has one reader.
TEST(rows_are_copied_for_a_recorder) {
  begin_capture();
  wm_stream_row row;
  uint64_t lost = 0;
  TEST_ASSERT_TRUE(row_source_is_exclusive(source));
  TEST_ASSERT_FALSE(row_source_copy(source, &row, &lost));
  const wm_time_ns t_ns = wm_monotonic_ns() - 400 * MS;
  for (int i = 0; i < 300; i++) {
    sample(t_ns + i * MS, 0, i, 0);
    expect(WM_OK);
  }
  int count = 0;
  while (row_source_copy(source, &row, &lost)) TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.001 * count++, row.number[2]);
  TEST_ASSERT_EQUAL(256, count);
  TEST_ASSERT_EQUAL_UINT64(44, lost);
}
