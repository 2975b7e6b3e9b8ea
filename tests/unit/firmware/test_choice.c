// SPDX-License-Identifier: Apache-2.0
// A configuration that names no estimator: each row of the table that chooses one, what is read then, and what is said.
#include "common/folder.h"
#include "common/suite.h"
#include "fusion/assembly.h"
#include "fusion/choice.h"

#define BIT(kind) WM_EVENT_BIT(WM_EVENT_##kind)
#define HEAD "format: waymark-config/1\n"

static wm_error err;
static wm_config config;
static wm_recording *recording;
static wm_assembly assembly;
static char said[2000];

void setUp(void) {
  folder_make();
  memset(&config, 0, sizeof config);
  recording = NULL;
  memset(&assembly, 0, sizeof assembly);
  said[0] = '\0';
}

void tearDown(void) {
  wm_assembly_close(&assembly);
  wm_recording_close(recording);
  wm_config_free(&config);
  folder_remove();
}

#define WHEELS BIT(QUANTITIES)

// What a robot has, and the estimator that is chosen; "": none, for the reason that has these words.
static const struct {
  const char *robot, *chosen, *words;
  wm_choice_facts has;
} kRobots[] = {
    {"edge points and a map", "edge_mcl", "", {.kinds = WHEELS | BIT(POINTS), .has_map = 1}},
    {"edge points, a map and all else",
     "edge_mcl",
     "",
     {.kinds = WHEELS | BIT(POINTS) | BIT(MARKER) | BIT(SIGHTING) | BIT(POSITION) | BIT(HEADING),
      .has_map = 1,
      .has_landmarks = 1}},
    {"edge points without a map", "", "map: FILE", {.kinds = WHEELS | BIT(POINTS) | BIT(MARKER), .has_landmarks = 1}},
    {"a map, but no edge points",
     "landmark_ekf",
     "",
     {.kinds = WHEELS | BIT(MARKER), .has_map = 1, .has_landmarks = 1}},
    {"a stereo pair", "stereo_ekf", "", {.kinds = BIT(TWIST6) | BIT(STEREO)}},
    {"a stereo pair on wheels", "stereo_ekf", "", {.kinds = WHEELS | BIT(STEREO) | BIT(POSITION), .has_landmarks = 1}},
    {"a velocity log and positions", "stereo_ekf", "", {.kinds = BIT(TWIST6) | BIT(POSITION)}},
    {"a velocity log and sightings", "stereo_ekf", "", {.kinds = BIT(TWIST6) | BIT(SIGHTING), .has_landmarks = 1}},
    {"positions with a depth", "stereo_ekf", "", {.kinds = WHEELS | BIT(POSITION), .measures_depth = 1}},
    {"visual odometry beside wheels", "landmark_ekf", "", {.kinds = WHEELS | BIT(TWIST6) | BIT(POSITION)}},
    {"upright lines", "slam", "", {.kinds = WHEELS | BIT(SIGHTING), .has_landmarks = 1, .tracks_unknown = 1}},
    {"known landmarks", "landmark_ekf", "", {.kinds = WHEELS | BIT(SIGHTING), .has_landmarks = 1}},
    {"known markers and positions",
     "landmark_ekf",
     "",
     {.kinds = BIT(TWIST2) | BIT(MARKER) | BIT(POSITION), .has_landmarks = 1}},
    {"unknown landmarks", "slam", "", {.kinds = WHEELS | BIT(SIGHTING)}},
    {"unknown markers", "slam", "", {.kinds = BIT(INCREMENT) | BIT(MARKER)}},
    {"positions", "landmark_ekf", "", {.kinds = WHEELS | BIT(POSITION)}},
    {"headings", "landmark_ekf", "", {.kinds = BIT(TWIST2) | BIT(HEADING)}},
    {"positions without motion", "landmark_ekf", "", {.kinds = BIT(POSITION)}},
    {"motion alone", "odometry", "", {.kinds = WHEELS, .has_landmarks = 1}},
    {"nothing", "", "devices", {.has_map = 1, .has_landmarks = 1}}};

TEST(each_robot_gets_its_estimator) {
  for (size_t i = 0; i < sizeof kRobots / sizeof kRobots[0]; i++) {
    const char *why = NULL;
    const wm_estimator *chosen = wm_choose(&kRobots[i].has, &why);
    TEST_ASSERT_NOT_NULL_MESSAGE(why, kRobots[i].robot);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(kRobots[i].chosen, chosen ? chosen->name : "", kRobots[i].robot);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, kRobots[i].words), why);
  }
}

// ── of a configuration and a recording ──────────────────────────────────────────────────────────────────────────────

static void say(void *context, const char *line) {
  (void)context;
  const size_t used = strlen(said);
  (void)snprintf(said + used, sizeof said - used, "%s\n", line);
}

static void open_it(const char *text) {
  folder_write("recording.yaml", "format: waymark-recording/1\n");
  folder_write("motion.csv", "t_ns,v_mps,w_radps\n0,0,0\n");
  folder_write("gnss.csv", "t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m\n0,0,0,0,1,1\n");
  folder_write("calibration.yaml", "sensors: {laser: {mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}}}\n");
  folder_write("sightings.csv", "t_ns,sensor,id,bearing_rad,range_m\n0,laser,1,0,1\n");
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse_undecided(text, strlen(text), "x.yaml", &config, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(folder_path(""), NULL, NULL, NULL, &recording, &err), err.text);
}

static void choose_it(const char *text) {
  open_it(text);
  TEST_ASSERT_NULL(config.estimator);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_choose_estimator(&config, recording, say, NULL, &err), err.text);
}

TEST(the_chosen_one_is_said) {
  choose_it(HEAD);
  TEST_ASSERT_EQUAL_STRING("slam", config.estimator->name);
  TEST_ASSERT_EQUAL_STRING("estimator slam is chosen: landmarks whose places are unknown\n", said);
  TEST_ASSERT_EQUAL_STRING("landmarks whose places are unknown", config.estimator_because);
}

TEST(its_parameters_are_read) {
  wm_config named;
  const char *text = HEAD "estimator: slam\nsightings: {gate: {hard: 21}}\nslam: {landmarks: {confirm_seen: 5}}\n";
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse(text, strlen(text), "x.yaml", &named, &err), err.text);
  choose_it(HEAD "sightings: {gate: {hard: 21}}\nslam: {landmarks: {confirm_seen: 5}}");
  TEST_ASSERT_EQUAL_MEMORY(named.estimator_params, config.estimator_params, named.estimator->params.bytes);
  TEST_ASSERT_EQUAL_MEMORY(named.sightings, config.sightings, wm_sighting_params_table.bytes);
  wm_config_free(&named);
}

// An event log has the text, and names the estimator.
TEST(the_text_names_it) {
  wm_config again;
  choose_it(HEAD "slam: {landmarks: {confirm_seen: 5}}");
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_parse_logged(config.text, config.text_length, "x.yaml", &again, &err),
                            err.text);
  TEST_ASSERT_EQUAL_STRING("slam", again.estimator->name);
  wm_config_free(&again);
}

TEST(its_warnings_are_said) {
  choose_it(HEAD "sources: [{name: sightings, use: false}, {name: gnss, use: false}]\nsightings: {gate: {hard: 21}}\n");
  TEST_ASSERT_EQUAL_STRING("odometry", config.estimator->name);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "estimator odometry does not take it"), said);
}

TEST(files_and_start_stay) {
  open_it(HEAD);
  (void)strcpy(config.overrides.landmarks, "given-by-the-command");
  config.has_initial_pose = 1;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_choose_estimator(&config, recording, NULL, NULL, &err), err.text);
  TEST_ASSERT_EQUAL_STRING("given-by-the-command", config.overrides.landmarks);
  TEST_ASSERT_TRUE(config.has_initial_pose);
}

TEST(other_sources_choose_anew) {
  choose_it(HEAD);
  wm_recording_close(recording);
  TEST_ASSERT_EQUAL(0, remove(folder_path("sightings.csv")));
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(folder_path(""), NULL, NULL, NULL, &recording, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_choose_estimator(&config, recording, say, NULL, &err), err.text);
  TEST_ASSERT_EQUAL_STRING("landmark_ekf", config.estimator->name);
}

TEST(a_named_one_stays) {
  open_it(HEAD "estimator: odometry\n");
  TEST_ASSERT_EQUAL(WM_OK, wm_choose_estimator(&config, recording, say, NULL, &err));
  TEST_ASSERT_EQUAL_STRING("odometry", config.estimator->name);
  TEST_ASSERT_EQUAL_STRING("", config.estimator_because);
  TEST_ASSERT_EQUAL_STRING("", said);
}

TEST(detectors_count) {
  open_it(HEAD "vision: {edges: {}}\n");
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_choose_estimator(&config, recording, NULL, NULL, &err));
  TEST_ASSERT_EQUAL_STRING(
      "x.yaml: estimator: is left out, and can't be chosen: edge points need a floor plan: write `map: FILE` (a "
      "map.yaml), or leave their detector out",
      err.text);
}

TEST(text_that_takes_no_further_key) {
  open_it("{format: waymark-config/1}\n");
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_choose_estimator(&config, recording, NULL, NULL, &err));
  TEST_ASSERT_EQUAL_STRING(
      "x.yaml: estimator: is left out, and can't be added at the file's end; write `estimator: slam`", err.text);
}

TEST(only_who_asks_gets_an_undecided_one) {
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_config_parse(HEAD, strlen(HEAD), "x.yaml", &config, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "estimator"), err.text);
}

// ── what is bound and not taken ─────────────────────────────────────────────────────────────────────────────────────

TEST(a_listed_source_has_a_use) {
  open_it(HEAD "estimator: pf_edges\nsources: [{name: motion}, {name: gnss, lateness_max_ms: 100}]\n");
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_assemble(&config, recording, 1, &assembly, &err));
  const char *begin =
      "x.yaml: sources: 'gnss' is for nothing: the estimator 'pf_edges' doesn't take its data; these do: "
      "landmark_ekf, ";
  const char *end = "; leave its entry out, take another estimator, or write `use: false` there";
  TEST_ASSERT_EQUAL_STRING_LEN(begin, err.text, strlen(begin));
  TEST_ASSERT_EQUAL_STRING(end, err.text + strlen(err.text) - strlen(end));
}

TEST(what_a_recording_has_beside_is_a_note) {
  open_it(HEAD "estimator: odometry\nsources: [{name: gnss}]\n");  // takes no observation: chosen for that
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_assemble(&config, recording, 1, &assembly, &err), err.text);
  TEST_ASSERT_EQUAL(2, assembly.unused_count);
}

// ── the page ────────────────────────────────────────────────────────────────────────────────────────────────────────

// The cell of a table's row at this place, from 0, cut at its end.
static const char *cell_of(const char *line, int place, char *out, size_t capacity) {
  for (int bars = 0; bars <= place; bars++) {
    line = strchr(line, '|');
    if (!line) return "";
    line += 1;
  }
  line += strspn(line, " ");
  (void)snprintf(out, capacity, "%.*s", (int)strcspn(line, "|"), line);
  return out;
}

// docs/estimators.md has a number in each cell that works, and nothing else begins with one.
TEST(the_page_says_what_each_takes) {
  static const struct {
    const char *row;
    wm_event_kind kind;
  } kRows[] = {{"| sightings:", WM_EVENT_SIGHTING},  {"| tags with", WM_EVENT_MARKER},
               {"| positions |", WM_EVENT_POSITION}, {"| headings |", WM_EVENT_HEADING},
               {"| edge points |", WM_EVENT_POINTS}, {"| points of", WM_EVENT_STEREO}};
  static const char *const kColumns[] = {"landmark_ekf", "slam", "edge_mcl", "stereo_ekf"};
  char line[1024], cell[512], which[80];
  size_t found = 0;
  FILE *page = fopen("docs/estimators.md", "r");
  TEST_ASSERT_NOT_NULL(page);
  while (fgets(line, sizeof line, page))
    for (size_t r = 0; r < sizeof kRows / sizeof kRows[0]; r++) {
      if (strncmp(line, kRows[r].row, strlen(kRows[r].row)) != 0) continue;
      found++;
      for (int c = 0; c < 4; c++) {
        const int takes = (wm_estimator_find(kColumns[c])->takes & WM_EVENT_BIT(kRows[r].kind)) != 0;
        const char first = cell_of(line, 1 + c, cell, sizeof cell)[0];
        (void)snprintf(which, sizeof which, "docs/estimators.md, '%s' of %s", kRows[r].row, kColumns[c]);
        TEST_ASSERT_EQUAL_MESSAGE(takes, first >= '0' && first <= '9', which);
      }
    }
  (void)fclose(page);
  TEST_ASSERT_EQUAL(sizeof kRows / sizeof kRows[0], found);
}
