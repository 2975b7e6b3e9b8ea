// SPDX-License-Identifier: Apache-2.0
// faults.yaml: what is read, what is refused and with which text, and its JSON.
#include "waymark/faults.h"

#include "common/suite.h"

static wm_faults faults;
static wm_error err;

void setUp(void) { memset(&faults, 0, sizeof faults); }
void tearDown(void) { wm_faults_free(&faults); }

#define HEAD "format: waymark-faults/1\nfaults:\n"

static wm_status parse(const char *text) {
  wm_faults_free(&faults);
  return wm_faults_parse(text, strlen(text), "f.yaml", &faults, &err);
}

static void refuse(const char *text, const char *message) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, parse(text), text);
  TEST_ASSERT_EQUAL_STRING(message, err.text);
  TEST_ASSERT_NULL(faults.fault);
}

static void begins_with(const char *text, const char *message) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, parse(text), text);
  err.text[strlen(message)] = '\0';
  TEST_ASSERT_EQUAL_STRING(message, err.text);
}

TEST(a_fault_has_its_times_parameters_and_statements) {
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK,
      parse(HEAD "- name: camera drops\n  fault: camera_dropped\n  from_s: 10\n  for_s: 5\n  camera: front\n"
                 "  share: 0.2\n  health:\n"
                 "  - {source: \"edges:front\", counter: lost, at_least: 6, at_most: 28}\n"
                 "  - {flag: motion_stale, within_s: 1, cleared_within_s: 2}\n"
                 "  - {state: degraded}\n  - {cause: silent}\n  - {text: front is gone, at_least: 1}\n"
                 "  - {source: can, device: bus-off, within_s: 1}\n"
                 "  pose: {position_m: 0.5, error_sigmas: 4, within_s: 3}\n"
                 "- {name: dead, fault: process_killed, from_s: 3}\n"
                 "- {name: quiet, fault: bus_silent, from_s: 1, ids: [\"1A0\", 101]}\n"),
      err.text);
  TEST_ASSERT_EQUAL(3, faults.count);
  const wm_fault *f = &faults.fault[0];
  TEST_ASSERT_EQUAL_STRING("camera drops", f->name);
  TEST_ASSERT_EQUAL(WM_FAULT_CAMERA_DROPPED, f->kind);
  TEST_ASSERT_EQUAL_DOUBLE(10, f->from_s);
  TEST_ASSERT_EQUAL_DOUBLE(15, f->until_s);
  TEST_ASSERT_EQUAL_STRING("front", f->of);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, f->param[0]);
  TEST_ASSERT_EQUAL(6, f->state_count);
  TEST_ASSERT_EQUAL(WM_STATES_COUNTER, f->states[0].kind);
  TEST_ASSERT_EQUAL_STRING("lost", f->states[0].what);
  TEST_ASSERT_EQUAL_DOUBLE(28, f->states[0].at_most);
  TEST_ASSERT_DOUBLE_IS_NAN(f->states[0].within_s);
  TEST_ASSERT_EQUAL_STRING("motion_stale", f->states[1].what);
  TEST_ASSERT_EQUAL_STRING("degraded", f->states[2].what);
  TEST_ASSERT_EQUAL_STRING("bus-off", f->states[5].what);
  TEST_ASSERT_EQUAL_STRING("can", f->states[5].source);
  TEST_ASSERT_TRUE(f->has_pose);
  TEST_ASSERT_DOUBLE_IS_NAN(f->pose.rate_hz);
  TEST_ASSERT_EQUAL_DOUBLE(4, f->pose.error_sigmas);
  TEST_ASSERT_EQUAL_DOUBLE(3, faults.fault[1].until_s);
  TEST_ASSERT_EQUAL_STRING("waymark", faults.fault[1].text);
  TEST_ASSERT_DOUBLE_IS_INF(faults.fault[2].until_s);
  TEST_ASSERT_EQUAL_HEX32(0x1A0, faults.fault[2].ids[0]);
  TEST_ASSERT_EQUAL_HEX32(0x101, faults.fault[2].ids[1]);
}

TEST(a_wrong_file_is_refused_with_its_line) {
  refuse("faults: []\n", "f.yaml:1: format: is missing; 'format: waymark-faults/1' is needed");
  refuse("format: waymark-faults/2\nfaults: []\n",
         "f.yaml:1: format: 'waymark-faults/2' is not a format that this program reads; it reads waymark-faults/1");
  refuse("format: waymark-faults/1\n", "f.yaml:1: faults: is missing: a list of faults");
  refuse("format: waymark-faults/1\nfault: []\n", "f.yaml:2: fault: unknown key; did you mean 'faults'?");
  begins_with(HEAD "- {name: a, fault: camera_unpluged, from_s: 1}\n",
              "f.yaml:3: faults[0].fault: 'camera_unpluged' is unknown; did you mean 'camera_unplugged'?");
  refuse(HEAD "- {name: a, from_s: 1}\n",
         "f.yaml:3: faults[0]: fault: is missing: what breaks, e.g. camera_unplugged (docs/faults.md has all)");
  refuse(HEAD "- {fault: bus_off, from_s: 1}\n", "f.yaml:3: faults[0]: name: is missing: how a report names it");
  refuse(HEAD "- {name: a, fault: bus_off}\n",
         "f.yaml:3: faults[0]: from_s: is missing: seconds since the recording's first datum");
  refuse(HEAD "- name: a\n  fault: bus_off\n  from_s: 5\n  until_s: 4\n",
         "f.yaml:6: faults[0].until_s: 4 is not after from_s (5)");
  refuse(HEAD "- {name: a, fault: bus_off, from_s: 5, until_s: 6, for_s: 1}\n",
         "f.yaml:3: faults[0].for_s: until_s is given, too; give one of them");
  refuse(HEAD "- {name: a, fault: bus_off, from_s: 5, camera: front}\n",
         "f.yaml:3: faults[0].camera: unknown key; known are: name, fault, from_s, until_s, for_s, health, pose, bus");
  refuse(HEAD "- {name: a, fault: camera_dropped, from_s: 5}\n",
         "f.yaml:3: faults[0]: share: is missing; 'camera_dropped' needs it");
  refuse(HEAD "- {name: a, fault: camera_dropped, from_s: 5, share: 20}\n",
         "f.yaml:3: faults[0].share: '20' is out of range; a number above 0 and up to 1 is needed");
  refuse(HEAD "- {name: a, fault: bus_silent, from_s: 5, ids: [xyz]}\n",
         "f.yaml:3: faults[0].ids[0]: 'xyz' is not a CAN id in hexadecimal digits, 0 to 1FFFFFFF");
}

TEST(statements_and_bounds_are_checked) {
#define WITH(health) HEAD "- name: a\n  fault: bus_off\n  from_s: 5\n  health:\n  - " health "\n"
  refuse(WITH("{device: down}"),
         "f.yaml:7: faults[0].health[0]: source: is missing; device is of a source (a name in health.json, e.g. can or "
         "edges:front)");
  begins_with(WITH("{source: can, device: dwon}"),
              "f.yaml:7: faults[0].health[0].device: 'dwon' is unknown; did you mean 'down'?");
  refuse(WITH("{flag: jumped, state: lost}"),
         "f.yaml:7: faults[0].health[0].state: 'flag' is given, too; write one entry of health for each");
  refuse(WITH("{within_s: 1}"),
         "f.yaml:7: faults[0].health[0]: one of device, flag, state, cause, counter and text is needed");
  refuse(WITH("{flag: jumped, at_least: 1}"),
         "f.yaml:7: faults[0].health[0]: at_least and at_most are of a counter or a text");
  refuse(WITH("{source: can, counter: lost}"),
         "f.yaml:7: faults[0].health[0]: at_least or at_most is needed: by how much the counter grows");
  refuse(WITH("{source: can, counter: lost, at_least: 5, at_most: 4}"),
         "f.yaml:7: faults[0].health[0]: at_least is above at_most");
  refuse(WITH("{flag: jumped, source: can}"), "f.yaml:7: faults[0].health[0]: source: a flag is of the whole run");
  refuse(HEAD "- {name: a, fault: bus_off, from_s: 5, pose: {postion_m: 1}}\n",
         "f.yaml:3: faults[0].pose.postion_m: unknown key; did you mean 'position_m'?");
}

TEST(two_that_contradict_are_refused) {
  refuse(HEAD "- {name: a, fault: bus_off, from_s: 5}\n- {name: a, fault: bus_down, from_s: 9}\n",
         "f.yaml:4: faults[1]: the name 'a' appears twice (first in line 3)");
  refuse(HEAD "- {name: a, fault: bus_off, from_s: 5}\n- {name: b, fault: bus_off, bus: can0, from_s: 9}\n",
         "f.yaml:4: faults[1]: 'b' lasts at the same time as 'a' (line 3), and is of the same kind");
  TEST_ASSERT_EQUAL(WM_OK, parse(HEAD "- {name: a, fault: bus_off, bus: can1, from_s: 5}\n"
                                      "- {name: b, fault: bus_off, bus: can0, from_s: 9}\n"));
}

TEST(it_is_known_what_lasts_when) {
  TEST_ASSERT_EQUAL(WM_OK, parse(HEAD "- {name: a, fault: bus_off, bus: can1, from_s: 5, until_s: 6}\n"
                                      "- {name: b, fault: bus_silent, from_s: 5, until_s: 6}\n"));
  TEST_ASSERT_NULL(wm_faults_at(&faults, WM_FAULT_BUS_OFF, "can1", 4.999));
  TEST_ASSERT_EQUAL_PTR(&faults.fault[0], wm_faults_at(&faults, WM_FAULT_BUS_OFF, "can1", 5));
  TEST_ASSERT_NULL(wm_faults_at(&faults, WM_FAULT_BUS_OFF, "can0", 5));
  TEST_ASSERT_NULL(wm_faults_at(&faults, WM_FAULT_BUS_OFF, "can1", 6));
  TEST_ASSERT_EQUAL_PTR(&faults.fault[1], wm_faults_at(&faults, WM_FAULT_BUS_SILENT, "can0", 5));
  TEST_ASSERT_NULL(wm_faults_at(NULL, WM_FAULT_BUS_SILENT, "can0", 5));
}

TEST(a_share_is_hit_as_often_as_it_is_large) {
  static const double kShares[] = {0.01, 0.2, 0.5, 1};
  for (size_t k = 0; k < sizeof kShares / sizeof kShares[0]; k++) {
    int hits = 0;
    for (uint32_t i = 0; i < 100000; i++) hits += wm_fault_hits(i, kShares[k]);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, kShares[k], hits / 1e5);
  }
}

TEST(its_json_has_the_defaults) {
  char *text = NULL;
  size_t length;
  TEST_ASSERT_EQUAL(WM_OK, parse(HEAD "- {name: 'a \"b\"', fault: camera_dark, from_s: 5, health: [{state: lost}], "
                                      "pose: {rate_hz: 50}}\n- {name: c, fault: power_cut, from_s: 7}\n"));
  FILE *to = open_memstream(&text, &length);
  wm_faults_json(&faults, to);
  (void)fclose(to);
  TEST_ASSERT_EQUAL_STRING(
      "{\"format\": \"waymark-faults/1\", \"file\": \"f.yaml\", \"faults\": [\n"
      "  {\"name\": \"a \\\"b\\\"\", \"fault\": \"camera_dark\", \"by\": \"player\", \"by_played_driver\": true, "
      "\"line\": 3, \"from_s\": 5, \"until_s\": null, \"camera\": null, \"brightness\": 0.02, \"health\": "
      "[{\"what\": \"state\", \"value\": \"lost\", \"source\": null, \"within_s\": null, \"cleared_within_s\": null, "
      "\"at_least\": null, \"at_most\": null}], \"pose\": {\"position_m\": null, \"heading_deg\": null, "
      "\"error_sigmas\": null, \"sigma_m\": null, \"sigma_deg\": null, \"sigma_grows\": null, \"rate_hz\": 50, "
      "\"gap_max_s\": null, \"within_s\": null}},\n"
      "  {\"name\": \"c\", \"fault\": \"power_cut\", \"by\": \"runner\", \"by_played_driver\": false, \"line\": 4, "
      "\"from_s\": 7, \"until_s\": 7, \"health\": [], \"pose\": null}\n]}\n",
      text);
  free(text);
}

// The player does what happens to data, the runner what happens to the computer: no kind is left without one.
TEST(each_kind_is_caused_by_someone) {
  for (int i = 0; i < WM_FAULT_KIND_COUNT; i++) {
    const wm_fault_kind_row *row = wm_fault_kind_of((wm_fault_kind)i);
    TEST_ASSERT_TRUE_MESSAGE(row->by != 0, row->name);
    TEST_ASSERT_TRUE_MESSAGE((row->of != NULL) == ((row->by & WM_FAULT_BY_PLAYED_DRIVER) != 0), row->name);
    TEST_ASSERT_TRUE_MESSAGE(strlen(row->about) > 20, row->name);
  }
}
