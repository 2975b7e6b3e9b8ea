// SPDX-License-Identifier: Apache-2.0
// The usual mistakes that check tries: which are listed for a recording and its configuration, their changes of files,
// their words.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../drivers/folder.h"
#include "cli/check/changed_copy.h"
#include "cli/check/check.h"
#include "cli/check/suspects.h"
#include "unity.h"
#include "waymark/text.h"

static wm_error err;
static wm_config config;
static wm_assembly assembly;
static suspect_files files;
static source_seen seen[WM_SOURCES_MAX];
static suspect list[SUSPECTS_MAX];
static const char *dir;

static const char kConfig[] =
    "format: waymark-config/1\n"
    "estimator: landmark_ekf\n"
    "sightings:\n"
    "  noise:\n"
    "    bearing_default_rad: 1.15  # 0.02 taken for degrees\n"
    "vision:\n"
    "  apriltag:\n"
    "    family: tag25h9\n";

void setUp(void) {
  dir = folder_make();
  memset(&assembly, 0, sizeof assembly);
  memset(seen, 0, sizeof seen);
  folder_write("config.yaml", kConfig);
  folder_write("can-signals.yaml",
               "- {quantity: gnss_latitude, message: GNSS, signal: LAT}\n"
               "- {quantity: gnss_longitude, message: GNSS, signal: LON}\n");
  folder_write("calibration.yaml", "gnss: {origin: [11.5, 48.1, 500]}\n");
  TEST_ASSERT_EQUAL(WM_OK, wm_config_load(folder_path("config.yaml"), &config, &err));
  assembly.config = &config;
}

void tearDown(void) {
  wm_config_free(&config);
  folder_remove();
}

static void read_files(void) { suspect_files_read(&files, &config, dir); }

static size_t list_all(void) {
  read_files();
  return suspects_list(&assembly, &files, seen, list);
}

static const suspect *find(suspect_kind kind, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (list[i].kind == kind) return &list[i];
  return NULL;
}

static void is_changed_to(const suspect *one, size_t count, const char *file, const char *name, const char *text) {
  file_edit edits[SUSPECT_EDITS_MAX];
  const size_t edit_count = suspect_edits(one, &assembly, &files, edits);
  TEST_ASSERT_EQUAL(count, edit_count);
  TEST_ASSERT_EQUAL_STRING(file, edits[0].file);
  TEST_ASSERT_EQUAL_STRING(name, edits[0].name);
  TEST_ASSERT_EQUAL_STRING(text, edits[0].text);
}

static void is_called(const suspect *one, const char *text) {
  char what[200];
  suspect_text(one, &assembly, &files, what, sizeof what);
  TEST_ASSERT_EQUAL_STRING(text, what);
}

static void settings_of_the_configuration(void) {
  const size_t count = list_all();
  const suspect *one = find(SUSPECT_SETTING, count);
  TEST_ASSERT_NOT_NULL(one);
  is_changed_to(one, 1, folder_path("config.yaml"), "sightings.noise.bearing_default_rad", "0.02");
  is_called(one,
            "sightings.noise.bearing_default_rad is 1.15 in the configuration, 57.5 times its default: is its unit "
            "right?");
}

static void latitude_and_longitude(void) {
  const size_t count = list_all();
  const suspect *origin = find(SUSPECT_ORIGIN_SWAP, count), *signals = find(SUSPECT_LATITUDE_SWAP, count);
  TEST_ASSERT_NOT_NULL(origin);
  TEST_ASSERT_NOT_NULL(signals);
  is_changed_to(origin, 1, "calibration.yaml", "gnss.origin", "[48.1, 11.5, 500]");
  is_called(origin, "latitude and longitude of gnss.origin are swapped");
  is_changed_to(signals, 2, "can-signals.yaml", "[0].quantity", "gnss_longitude");
}

// Of a detector that found nothing, all families; of one that found markers, none.
static void families_of_markers(void) {
  (void)strcpy(assembly.sources[0].name, "apriltag:front");
  assembly.source_count = 1;
  size_t count = list_all();
  const suspect *one = find(SUSPECT_TAG_FAMILY, count);
  TEST_ASSERT_NOT_NULL(one);
  is_changed_to(one, 1, folder_path("config.yaml"), "vision.apriltag.family", "tag16h5");
  is_called(one, "the markers are of the family tag16h5");
  seen[0].kinds = WM_EVENT_BIT(WM_EVENT_MARKER);
  count = list_all();
  TEST_ASSERT_NULL(find(SUSPECT_TAG_FAMILY, count));
}

static void sides_of_a_pair(void) {
  (void)strcpy(assembly.sources[0].name, "stereo");
  assembly.source_count = 1;
  TEST_ASSERT_NULL(find(SUSPECT_STEREO_SWAP, list_all()));
  seen[0].kinds = WM_EVENT_BIT(WM_EVENT_STEREO);
  const suspect *one = find(SUSPECT_STEREO_SWAP, list_all());
  TEST_ASSERT_NOT_NULL(one);
  is_changed_to(one, 2, "stereo.csv", "ul_px", "ur_px");
}

// Points are compared with a plan; its pictures are those of map/map.yaml.
static void mirrored_plan(void) {
  (void)strcpy(assembly.sources[0].name, "points:front");
  assembly.source_count = 1;
  seen[0].kinds = WM_EVENT_BIT(WM_EVENT_POINTS);
  TEST_ASSERT_NULL(find(SUSPECT_PLAN_MIRROR, list_all()));
  read_files();
  (void)strcpy(files.plan_pictures[0], "map/edges.png");
  files.plan_picture_count = 1;
  const suspect *one = find(SUSPECT_PLAN_MIRROR, suspects_list(&assembly, &files, seen, list));
  TEST_ASSERT_NOT_NULL(one);
  is_changed_to(one, 1, "map/edges.png", "", "");
  is_called(one, "the floor plan is mirrored: left and right are swapped");
}

// The corrected configuration is in the copy, and the files that it names are found from there.
static void corrected_configuration(void) {
  char written[WM_PATH_MAX], real[WM_PATH_MAX + 32];
  char *text;
  size_t length;
  file_edit edits[SUSPECT_EDITS_MAX];
  const suspect *one = find(SUSPECT_SETTING, list_all());
  TEST_ASSERT_NOT_NULL(one);
  const size_t edit_count = suspect_edits(one, &assembly, &files, edits);
  changed_copy copy = {.dir = dir, .overrides = config.overrides};
  (void)snprintf(copy.out, sizeof copy.out, "%s/copy", dir);
  (void)snprintf(copy.overrides.calibration, WM_PATH_MAX, "%s", folder_path("calibration.yaml"));
  (void)snprintf(config.overrides.calibration, WM_PATH_MAX, "%s", folder_path("calibration.yaml"));
  TEST_ASSERT_EQUAL(WM_OK, changed_copy_make(&copy, &config.overrides, edits, edit_count, "", &err));
  TEST_ASSERT_EQUAL(WM_OK, changed_copy_config(&copy, &config, edits, edit_count, "by check", written, &err));
  TEST_ASSERT_EQUAL(WM_OK, wm_text_read_file(written, 1 << 16, &text, &length, &err));
  TEST_ASSERT_NOT_NULL(strstr(text, "bearing_default_rad: 0.02"));
  char *resolved = realpath(folder_path("calibration.yaml"), NULL);
  (void)snprintf(real, sizeof real, "calibration: \"%s\"", resolved);
  TEST_ASSERT_NOT_NULL(strstr(text, real));
  free(resolved);
  free(text);
  // Without a change of it, none is written.
  TEST_ASSERT_EQUAL(WM_OK, changed_copy_config(&copy, &config, edits, 0, "by check", written, &err));
  TEST_ASSERT_EQUAL_STRING("", written);
  changed_copy_remove(&copy);
}

// Turn rates of a gyro and of wheels, `ratio` apart, with noise of the wheels' alone.
static double ratio_found(double ratio, double noise) {
  agreement both = {0};
  for (int i = 0; i < 2000; i++) {
    const double turn = sin(0.01 * i), error = noise * (i % 2 ? 1 : -1);
    agreement_add(&both, ratio * turn, turn + error);
  }
  return agreement_ratio(&both, 1.5);
}

static void noise_of_a_sensor_is_no_ratio(void) {
  TEST_ASSERT_EQUAL_DOUBLE(1, ratio_found(1, 0));
  TEST_ASSERT_EQUAL_DOUBLE(1, ratio_found(1, 0.8));  // makes ab / bb 0.44
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5, ratio_found(0.5, 0));
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.0, ratio_found(2, 0.2));
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(settings_of_the_configuration);
  RUN_TEST(latitude_and_longitude);
  RUN_TEST(families_of_markers);
  RUN_TEST(sides_of_a_pair);
  RUN_TEST(mirrored_plan);
  RUN_TEST(corrected_configuration);
  RUN_TEST(noise_of_a_sensor_is_no_ratio);
  return UNITY_END();
}
