// SPDX-License-Identifier: Apache-2.0
// Findings that a health or the records of a drive make, a row each: what is broken, and the finding that follows.
// A health in order makes none.
#include "common/suite.h"
#include "output/drive_evidence.h"

static wm_health health;
static wm_findings found;
static wm_said said;
static char log_text[4000];
static drive_evidence evidence;
static wm_config config;
static wm_assembly assembly;

void setUp(void) {
  memset(&health, 0, sizeof health);
  memset(&found, 0, sizeof found);
  memset(&said, 0, sizeof said);
  memset(&evidence, 0, sizeof evidence);
  memset(&config, 0, sizeof config);
  memset(&assembly, 0, sizeof assembly);
  assembly.config = &config;
  assembly.source_count = 1;
  assembly.setup.start.p_m[0] = (double)NAN;
  (void)snprintf(assembly.sources[0].name, sizeof assembly.sources[0].name, "eye");
  log_text[0] = '\0';
  health.state = WM_STATE_TRACKING;
  health.source_count = 1;
  health.loops = 10000;
  wm_source_health *s = &health.sources[0];
  (void)snprintf(s->name, sizeof s->name, "eye");
  s->device = WM_DEVICE_WORKS;
  s->received = s->fused = 1000;
  s->lateness_max_ns = 200 * WM_NS_PER_MS;
  s->lateness_p99_ns = 20 * WM_NS_PER_MS;
  s->lateness_worst_ns = 30 * WM_NS_PER_MS;
}

static void judge(uint64_t messages) { evidence_judge(&evidence, &assembly, &health, messages, &found); }

#define EYE (&health.sources[0])
static void late(void) { EYE->late = 5; }
static void lost(void) { EYE->lost = 5; }
static void overflown(void) { EYE->overflows = 5; }
static void malformed(void) { EYE->malformed = 5; }
static void out_of_order(void) { EYE->out_of_order = 5; }
static void from_the_future(void) { EYE->future = 5; }
static void frozen(void) { EYE->frozen = 5; }
static void silent(void) { EYE->stale = 1; }
static void never_there(void) {
  EYE->stale = 1;
  EYE->received = EYE->fused = 0;
}
static void unplugged(void) { EYE->device = WM_DEVICE_ABSENT; }
static void refused(void) {
  EYE->fused = 500;
  EYE->rejected[WM_REJECTED_GATE] = 500;
}
static void unknown(void) {
  EYE->fused = 0;
  EYE->rejected[WM_REJECTED_UNKNOWN_ID] = 1000;
}
static void doubtful(void) {
  health.state = WM_STATE_DEGRADED;
  health.cause = WM_CAUSE_BIASED;
}
static void dead_encoder(void) { health.motion_health = 1; }
static void counter(wm_counter_kind kind) {
  health.counter_count = 1;
  health.counters[0] = (wm_counter){.kind = kind, .landmark_id = 7, .count = 3};
}
static void moved(void) { counter(WM_COUNTER_LANDMARKS_MOVED); }
static void ambiguous(void) { counter(WM_COUNTER_IDENTITIES_AMBIGUOUS); }
static void full(void) { counter(WM_COUNTER_MAP_FULL); }
static void two_runs(void) { health.other_runs_total = 1; }
static void slow_disk(void) { health.outputs_lost = 12; }
static void slow_computer(void) { health.deadlines_missed = 500; }

static const struct {
  void (*breaks)(void);
  wm_finding_id id;
  const char *about;
} kBroken[] = {{late, WM_FOUND_DATA_LATE, "eye"},
               {lost, WM_FOUND_DATA_MISSING, "eye"},
               {overflown, WM_FOUND_DATA_MISSING, "eye"},
               {malformed, WM_FOUND_ROWS_SKIPPED, "eye"},
               {out_of_order, WM_FOUND_ROWS_DISORDERED, "eye"},
               {from_the_future, WM_FOUND_CLOCKS_APART, "eye"},
               {frozen, WM_FOUND_VALUES_FROZEN, "eye"},
               {silent, WM_FOUND_SOURCE_SILENT, "eye"},
               {never_there, WM_FOUND_NO_DATA, "eye"},
               {unplugged, WM_FOUND_DEVICE_TROUBLE, "eye"},
               {refused, WM_FOUND_OBSERVATIONS_REFUSED, "eye"},
               {unknown, WM_FOUND_IDENTITIES_UNKNOWN, "eye"},
               {doubtful, WM_FOUND_POSE_DOUBTFUL, "eye"},
               {dead_encoder, WM_FOUND_MOTION_SENSOR, "motion"},
               {moved, WM_FOUND_LANDMARK_MOVED, "map"},
               {ambiguous, WM_FOUND_IDENTITIES_AMBIGUOUS, "map"},
               {full, WM_FOUND_CAPACITY_REACHED, "map"},
               {two_runs, WM_FOUND_OTHER_RUN, "messages"},
               {slow_disk, WM_FOUND_OUTPUTS_LOST, "outputs"},
               {slow_computer, WM_FOUND_DEADLINES_MISSED, "computer"}};

TEST(a_health_in_order_makes_no_finding) {
  wm_health_findings(&health, &found);
  TEST_ASSERT_EQUAL_MESSAGE(0, found.count, found.at[0].text);
}

// Kept for a search: there is no pose to contradict.
TEST(observations_that_wait_for_a_pose_do_not_contradict_one) {
  EYE->fused = 0;
  EYE->rejected[WM_REJECTED_SEARCHING] = 1000;
  wm_health_findings(&health, &found);
  TEST_ASSERT_FALSE(wm_findings_has(&found, WM_FOUND_OBSERVATIONS_REFUSED, "eye"));
}

TEST(each_broken_health_makes_its_finding_alone) {
  for (size_t i = 0; i < sizeof kBroken / sizeof kBroken[0]; i++) {
    setUp();
    kBroken[i].breaks();
    wm_health_findings(&health, &found);
    const char *name = kFindingKinds[kBroken[i].id].identifier;
    TEST_ASSERT_TRUE_MESSAGE(wm_findings_has(&found, kBroken[i].id, kBroken[i].about), name);
    TEST_ASSERT_EQUAL_MESSAGE(1, found.count, name);
    TEST_ASSERT_TRUE_MESSAGE(found.at[0].fix[0] != '\0', name);
  }
}

// A thousand updates of this residual, 10 m, each this many of its sigmas (0.1 m) off and the mean of them, too.
static void drive_of(int residual, double sigmas, double mean_sigmas, wm_verdict verdict) {
  static double positions[32];
  wm_params_defaults(&wm_position_params_table, positions);
  config.positions = (void *)positions;
  memset(&evidence, 0, sizeof evidence);
  for (int i = 0; i < 1000; i++) {
    const wm_innovation in = {.residual = (uint8_t)residual,
                              .expected = 10,
                              .landmark_id = -1,
                              .observed = 10 + ((i % 2 ? 1 : -1) * sigmas + mean_sigmas) * 0.1,
                              .variance = 0.01,
                              .verdict = (uint8_t)verdict};
    evidence_put(&evidence, WM_OUTPUT_INNOVATION, &in);
  }
  judge(0);
}

static void drive_with_mean(double sigmas, double mean_sigmas, wm_verdict verdict) {
  drive_of(WM_RESIDUAL_RANGE, sigmas, mean_sigmas, verdict);
}

static void drive_with(double sigmas, wm_verdict verdict) { drive_with_mean(sigmas, 0, verdict); }

TEST(innovations_with_a_mean_are_found) {
  drive_with_mean(0.8, 0.2, WM_FUSED);
  TEST_ASSERT_EQUAL(0, found.count);
  drive_with_mean(0.8, 0.9, WM_FUSED);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_OBSERVATIONS_BIASED, "eye"));
  TEST_ASSERT_NOT_NULL(strstr(found.at[0].text, "is too large"));
}

// Ranges that are 7 % too long, whether they were fused or refused.
TEST(ranges_that_are_too_long_are_found_with_their_factor) {
  drive_with_mean(0.5, 7, WM_REJECTED_GATE);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_OBSERVATIONS_BIASED, "eye"));
  TEST_ASSERT_EQUAL_STRING("its ranges are 7.0 % longer than the map has them, on average",
                           found.at[found.count - 1].text);
  TEST_ASSERT_NOT_NULL(strstr(found.at[found.count - 1].fix, "multiply range_m by 0.935"));
}

TEST(innovations_of_their_sigma_are_good_and_larger_ones_are_found) {
  drive_with(1, WM_FUSED);
  TEST_ASSERT_EQUAL(0, found.count);
  drive_with(2.5, WM_FUSED);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_NOISE_TOO_SMALL, "eye"));
  TEST_ASSERT_EQUAL_DOUBLE(2.5, round(found.at[0].size * 1e6) / 1e6);
}

// By default half of a position's stated sigma is new in each: a receiver without lasting errors has innovations of 2.
TEST(positions_are_judged_by_what_was_stated) {
  drive_of(WM_RESIDUAL_Y, 2.0, 0, WM_FUSED);
  TEST_ASSERT_EQUAL(0, found.count);
  drive_of(WM_RESIDUAL_Y, 5.0, 0, WM_FUSED);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_NOISE_TOO_SMALL, "eye"));
  TEST_ASSERT_EQUAL_DOUBLE(2.5, round(found.at[0].size * 1e6) / 1e6);
}

// A hundred messages of a drive in this state and for this reason.
static void drive_in(wm_state state, wm_cause cause, int source, uint64_t fused) {
  static const wm_estimator kSeeing = {.takes = WM_EVENT_BIT(WM_EVENT_SIGHTING)};
  wm_published message = {.now = {.state = (uint8_t)state, .cause = (uint8_t)cause, .cause_source = (int8_t)source}};
  memset(&evidence, 0, sizeof evidence);
  memset(&found, 0, sizeof found);
  config.estimator = &kSeeing;
  assembly.sources[0].kinds = WM_EVENT_BIT(WM_EVENT_SIGHTING);
  evidence.fused = fused;
  for (int i = 0; i < 100; i++) evidence_put(&evidence, WM_OUTPUT_PUBLISHED, &message);
  judge(100);
}

TEST(the_cause_of_a_lost_or_degraded_drive_is_named) {
  static const struct {
    wm_state state;
    wm_cause cause;
    int source;
    wm_finding_id id;
    const char *about, *text;
  } kDrives[] = {
      {WM_STATE_LOST, WM_CAUSE_REFUSED, 0, WM_FOUND_POSE_LOST, "drive", "eye is refused"},
      {WM_STATE_LOST, WM_CAUSE_CONTRADICTED, -1, WM_FOUND_POSE_LOST, "drive", "what is observed contradicts the pose"},
      {WM_STATE_DEGRADED, WM_CAUSE_BIASED, 0, WM_FOUND_POSE_DOUBTFUL, "eye", "has biased innovations"},
      {WM_STATE_DEGRADED, WM_CAUSE_OFF_MAP, -1, WM_FOUND_POSE_DOUBTFUL, "map", "does not reach the pose"},
      {WM_STATE_DEGRADED, WM_CAUSE_UNKNOWN, 0, WM_FOUND_POSE_DOUBTFUL, "eye", "has unknown identities"},
      {WM_STATE_DEGRADED, WM_CAUSE_LOST_AGAIN, -1, WM_FOUND_POSE_DOUBTFUL, "observations",
       "contradicted the last pose; the one found since is on probation"},
      {WM_STATE_DEGRADED, WM_CAUSE_TURN, -1, WM_FOUND_POSE_DOUBTFUL, "observations", "turns to the other side"}};
  for (size_t i = 0; i < sizeof kDrives / sizeof kDrives[0]; i++) {
    drive_in(kDrives[i].state, kDrives[i].cause, kDrives[i].source, 1000);
    TEST_ASSERT_EQUAL(1, found.count);
    TEST_ASSERT_TRUE(wm_findings_has(&found, kDrives[i].id, kDrives[i].about));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(found.at[0].text, kDrives[i].text), found.at[0].text);
  }
  drive_in(WM_STATE_TRACKING, WM_CAUSE_NONE, -1, 1000);
  TEST_ASSERT_EQUAL(0, found.count);
}

// A camera that never sees a marker, and one that saw some.
TEST(a_drive_that_no_observation_reaches_is_not_good) {
  drive_in(WM_STATE_DEAD_RECKONING, WM_CAUSE_NONE, -1, 0);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_POSE_DOUBTFUL, "observations"));
  TEST_ASSERT_EQUAL(WM_SEVERITY_BAD, found.at[0].severity);
  drive_in(WM_STATE_DEAD_RECKONING, WM_CAUSE_NONE, -1, 30);
  TEST_ASSERT_EQUAL(0, found.count);
  EYE->fused = 30;  // of a thousand
  drive_in(WM_STATE_DEAD_RECKONING, WM_CAUSE_NONE, -1, 30);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_POSE_DOUBTFUL, "observations"));
  EYE->received = 20;
  EYE->fused = 0;
  drive_in(WM_STATE_DEAD_RECKONING, WM_CAUSE_NONE, -1, 0);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_POSE_DOUBTFUL, "observations"));
  EYE->received = 19;  // it may have seen nothing yet
  drive_in(WM_STATE_DEAD_RECKONING, WM_CAUSE_NONE, -1, 0);
  TEST_ASSERT_EQUAL(0, found.count);
}

TEST(innovations_of_a_tenth_of_their_sigma_are_not_good) {
  drive_with(0.2, WM_FUSED);
  TEST_ASSERT_EQUAL(0, found.count);
  drive_with(0.05, WM_FUSED);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_NOISE_TOO_LARGE, "eye"));
  TEST_ASSERT_EQUAL(WM_SEVERITY_BAD, found.at[0].severity);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.05, found.at[0].size);
}

// A tenth of a per cent of the motion's data, and 2 %.
TEST(motion_that_no_robot_can_do_is_found) {
  static const struct {
    uint64_t count;
    size_t findings;
    wm_severity severity;
  } kCases[] = {{19, 0, 0}, {100, 1, WM_SEVERITY_NOTE}, {253, 1, WM_SEVERITY_BAD}};
  for (size_t i = 0; i < sizeof kCases / sizeof kCases[0]; i++) {
    setUp();
    assembly.sources[0].kinds = WM_EVENT_BIT(WM_EVENT_TWIST2);
    EYE->received = 10000;
    counter(WM_COUNTER_MOTION_OUTLIERS);
    health.counters[0].count = kCases[i].count;
    judge(0);
    TEST_ASSERT_EQUAL(kCases[i].findings, found.count);
    if (found.count > 0) TEST_ASSERT_EQUAL(kCases[i].severity, found.at[0].severity);
  }
}

// A number is advised where a transport can be so late; of a clock none.
TEST(no_lateness_is_advised_that_no_transport_has) {
  EYE->late = 5;
  EYE->lateness_p99_ns = EYE->lateness_worst_ns = 400 * WM_NS_PER_MS;
  wm_health_findings(&health, &found);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(found.at[0].fix, "lateness_max_ms: 400"), found.at[0].fix);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(found.at[0].fix, "merge.horizon_ms"), found.at[0].fix);
  found.count = 0;
  EYE->lateness_p99_ns = EYE->lateness_worst_ns = 3600 * WM_NS_PER_S;
  wm_health_findings(&health, &found);
  TEST_ASSERT_NULL_MESSAGE(strstr(found.at[0].fix, "lateness_max_ms"), found.at[0].fix);
}

// A start that is given is not asked for.
TEST(a_start_that_is_given_is_not_asked_for) {
  assembly.source_count = 0;
  assembly.setup.start.p_m[0] = 0;
  judge(100);  // at (0, 0), heading 0
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_POSE_NOT_FOUND, "drive"));
  TEST_ASSERT_NULL_MESSAGE(strstr(found.at[0].fix, "give x_m"), found.at[0].fix);
}

// An hour without a datum, which a replay skips, is no time without a pose.
TEST(a_silence_that_is_skipped_is_not_due) {
  for (int i = 0; i <= 200; i++) {
    const wm_event event = {.t_ns = i * 100 * WM_NS_PER_MS + (i > 100 ? 3600 * WM_NS_PER_S : 0)};
    evidence_put(&evidence, WM_OUTPUT_EVENT, &event);
  }
  TEST_ASSERT_UINT64_WITHIN(1, 995, evidence_due(&evidence, 50));
}

// A scale within 1.8 is a note, unless the estimator has an alarm about it: also one behind the first values.
TEST(a_scale_with_an_alarm_is_bad) {
  static const wm_estimator kAny = {.name = "landmark_ekf"};
  assembly.source_count = 0;
  config.estimator = &kAny;
  for (int i = 0; i < 4; i++) {
    memset(&health, 0, sizeof health);
    memset(&found, 0, sizeof found);
    const uint32_t at = i < 2 ? 0 : WM_HEALTH_CALIBRATION_MAX;
    health.calibration_count = i < 2 ? 1 : WM_HEALTH_CALIBRATION_MAX;
    health.more_count = i >= 2;
    *(i < 2 ? &health.calibration[0] : &health.more_calibration[0]) =
        (wm_calibration_value){.name = "motion.left_scale", .value = 1.25, .sigma = 0.003};
    health.alarm_count = 1;
    health.alarms[0] = (wm_alarm){i % 2 ? WM_ALARM_STATED : WM_ALARM_NOISE, (int32_t)at, 1.25};
    judge(0);
    TEST_ASSERT_EQUAL(1, found.count);
    TEST_ASSERT_EQUAL(WM_FOUND_CALIBRATION_OFF, found.at[0].id);
    TEST_ASSERT_EQUAL(i % 2 ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, found.at[0].severity);
  }
}

// A map that the configuration names and does not use, one that it uses, and a recording's own.
TEST(a_map_that_is_named_and_not_read_is_found) {
  static const char *const kUses[] = {"none", "extend", NULL};
  static const wm_param kMap = {.key = "landmarks.map", .type = WM_PARAM_ENUM, .names = kUses};
  static const wm_estimator kMapping = {.name = "slam", .params = {&kMap, 1, sizeof(int32_t), NULL}};
  const struct {
    const char *named;
    int32_t use;
    size_t findings;
  } kCases[] = {{"hall.csv", 0, 1}, {"hall.csv", 1, 0}, {"", 0, 0}};
  for (size_t i = 0; i < sizeof kCases / sizeof kCases[0]; i++) {
    int32_t use = kCases[i].use;
    assembly.source_count = 0;
    memset(&found, 0, sizeof found);
    config.estimator = &kMapping;
    config.estimator_params = &use;
    (void)snprintf(config.overrides.landmarks, sizeof config.overrides.landmarks, "%s", kCases[i].named);
    judge(0);
    TEST_ASSERT_EQUAL(kCases[i].findings, found.count);
    TEST_ASSERT_EQUAL(kCases[i].findings, wm_findings_has(&found, WM_FOUND_DATA_UNUSED, "landmarks"));
  }
}

TEST(a_finding_of_the_drive_is_not_repeated_by_the_health) {
  drive_with(5, WM_REJECTED_GATE);
  TEST_ASSERT_TRUE(wm_findings_has(&found, WM_FOUND_OBSERVATIONS_REFUSED, "eye"));
  refused();
  wm_health_findings(&health, &found);
  size_t refusals = 0;
  for (size_t i = 0; i < found.count; i++) refusals += found.at[i].id == WM_FOUND_OBSERVATIONS_REFUSED;
  TEST_ASSERT_EQUAL(1, refusals);
}

static void write_log(void *context, const char *line) {
  (void)context;
  (void)strncat(log_text, line, sizeof log_text - strlen(log_text) - 1);
}

TEST(a_log_has_each_finding_once_in_ten_minutes) {
  moved();
  wm_health_findings(&health, &found);
  for (int s = 0; s < 599; s++) wm_said_take(&said, &found, s * WM_NS_PER_S, write_log, NULL);
  TEST_ASSERT_EQUAL_STRING(
      "map: 3 times a landmark was elsewhere than before; the last one is 7; fix: `waymark map survey RUN --poses RUN` "
      "lists what moved [landmark-moved]",
      log_text);
  log_text[0] = '\0';
  wm_said_take(&said, &found, 600 * WM_NS_PER_S, write_log, NULL);
  TEST_ASSERT_TRUE(log_text[0] != '\0');
}

TEST(a_full_list_counts_what_it_drops) {
  for (int i = 0; i < WM_FINDINGS_MAX + 3; i++)
    wm_find(&found, WM_FOUND_FILE_NOTE, WM_SEVERITY_NOTE, "files", NULL, "%d", i)->size = i;
  TEST_ASSERT_EQUAL(WM_FINDINGS_MAX, found.count);
  TEST_ASSERT_EQUAL(3, found.dropped);
  TEST_ASSERT_EQUAL_STRING("63", found.at[63].text);
}

TEST(every_kind_has_its_words) {
  for (size_t i = 0; i < WM_FOUND_COUNT; i++) {
    const wm_finding_kind *kind = &kFindingKinds[i];
    TEST_ASSERT_TRUE(kind->identifier && kind->identifier[0] && kind->cause[0] && kind->fix[0]);
    TEST_ASSERT_TRUE_MESSAGE(strlen(kind->fix) < WM_FINDING_FIX_MAX, kind->identifier);
    for (size_t k = 0; k < i; k++) TEST_ASSERT_TRUE(strcmp(kind->identifier, kFindingKinds[k].identifier) != 0);
  }
}

// A receiver's sigma of 30 m: the density of a position that fits is below that of an outlier over 50 m.
static double score_of(double off_m) {
  memset(&evidence, 0, sizeof evidence);
  const wm_innovation in = {
      .residual = WM_RESIDUAL_X, .verdict = WM_FUSED, .landmark_id = -1, .observed = off_m, .variance = 900};
  evidence_put(&evidence, WM_OUTPUT_INNOVATION, &in);
  return evidence_score(&evidence);
}
TEST(positions_with_a_large_sigma_tell_good_poses_from_wrong_ones) {
  TEST_ASSERT_GREATER_THAN_DOUBLE(score_of(30) + 0.4, score_of(0));
  TEST_ASSERT_TRUE(score_of(30) > score_of(60) + 1);
}
