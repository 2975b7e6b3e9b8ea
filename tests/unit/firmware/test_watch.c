// SPDX-License-Identifier: Apache-2.0
// What a person sees of a run, from its messages.
#include "cli/watch/metrics.h"
#include "cli/watch/watch.h"
#include "common/suite.h"
#include "waymark/lcm_messages.h"

static watch seen;
static wm_health health;
static wm_published pose;
static uint8_t bytes[WM_LCM_MESSAGE_MAX];
static char why[240], shown[20000];

void setUp(void) {
  memset(&seen, 0, sizeof seen);
  memset(&pose, 0, sizeof pose);
  memset(&health, 0, sizeof health);
  health.state = WM_STATE_TRACKING;
  health.source_count = 2;
  (void)snprintf(health.sources[0].name, WM_HEALTH_NAME_MAX, "can");
  (void)snprintf(health.sources[1].name, WM_HEALTH_NAME_MAX, "edges:front");
  health.sources[0].device = health.sources[1].device = WM_DEVICE_WORKS;
  health.sources[1].rejected[WM_REJECTED_GATE] = 7;
  health.reckoning_left_m = 41.6;
  health.reckoning_left_s = (double)INFINITY;
}

static const char *state_of_health(void) {
  size_t length = wm_lcm_health(&health, bytes, sizeof bytes);
  TEST_ASSERT_GREATER_THAN(0, length);
  watch_health(&seen, bytes, length, 10 * WM_NS_PER_S);
  return watch_state(&seen, 10 * WM_NS_PER_S, why, sizeof why);
}

TEST(the_state_says_what_is_wrong) {
  TEST_ASSERT_EQUAL_STRING("waiting", watch_state(&seen, 0, why, sizeof why));
  TEST_ASSERT_EQUAL_STRING("tracking", state_of_health());
  TEST_ASSERT_EQUAL_STRING("", why);
  health.sources[1].device = WM_DEVICE_STALLED;
  TEST_ASSERT_EQUAL_STRING("degraded", state_of_health());
  TEST_ASSERT_EQUAL_STRING("edges:front stalled", why);
  health.sources[0].device = WM_DEVICE_ABSENT;
  health.state = WM_STATE_SEARCHING;
  TEST_ASSERT_EQUAL_STRING("waiting for sensors", state_of_health());
  TEST_ASSERT_EQUAL_STRING("can absent, edges:front stalled", why);
  health.state = WM_STATE_LOST;
  TEST_ASSERT_EQUAL_STRING("lost", state_of_health());
  TEST_ASSERT_EQUAL_STRING("silent", watch_state(&seen, 20 * WM_NS_PER_S, why, sizeof why));
}

TEST(a_source_that_is_there_only_in_places_is_no_fault) {
  health.sources[1].stale = 1;
  TEST_ASSERT_EQUAL_STRING("tracking", state_of_health());
  TEST_ASSERT_EQUAL_STRING("edges:front never spoke", why);
  health.state = WM_STATE_DEAD_RECKONING;
  health.sources[1].received = 5;
  TEST_ASSERT_EQUAL_STRING("dead reckoning", state_of_health());
  TEST_ASSERT_EQUAL_STRING("edges:front silent", why);
  // The motion's silence is one.
  health.state = WM_STATE_TRACKING;
  health.sources[0].stale = health.sources[0].received = 1;
  pose.status_flags = WM_PUB_MOTION_STALE;
  watch_pose(&seen, bytes, wm_lcm_pose(&pose, 0, bytes, sizeof bytes), 10 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL_STRING("degraded", state_of_health());
  TEST_ASSERT_EQUAL_STRING("can silent, edges:front silent, motion stale", why);
}

TEST(a_message_is_read_as_it_was_sent) {
  wm_health read;
  wm_published read_pose;
  health.sources[1].overflows = 5;
  health.sources[1].stamp_uncertainty_ns = 77;
  for (int i = 0; i < WM_LOOK_COUNT; i++) health.sources[1].looks[i] = (uint64_t)(100 + i);
  health.calibration_count = 1;
  (void)snprintf(health.calibration[0].name, sizeof health.calibration[0].name, "laser.yaw_rad");
  health.calibration[0].value = 0.25;
  health.lost_probability = 0.125;
  health.cause = WM_CAUSE_REFUSED;
  health.cause_source = 1;
  health.counter_count = 1;
  health.counters[0] = (wm_counter){WM_COUNTER_LANDMARKS_MOVED, 7, 3};
  size_t length = wm_lcm_health(&health, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_health(bytes, length, &read));
  TEST_ASSERT_EQUAL_MEMORY(&health, &read, sizeof read);
  pose.now.t_ns = 5;
  pose.now.lost_probability = 0.5;
  pose.now.covariance[7] = 0.5;
  pose.now.v_mps[0] = 1.5;
  pose.now.cause = WM_CAUSE_BIASED;
  pose.now.cause_source = -1;  // health has it
  pose.status_flags = WM_PUB_JUMPED | WM_CAUSE_BIASED << WM_PUB_CAUSE_SHIFT;
  length = wm_lcm_pose(&pose, 0, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_pose(bytes, length, &read_pose));
  TEST_ASSERT_EQUAL_MEMORY(&pose, &read_pose, sizeof pose);
  TEST_ASSERT_NOT_NULL(wm_lcm_read_pose("rubbish", 7, &read_pose));
  TEST_ASSERT_NOT_NULL(wm_lcm_read_health(bytes, 20, &read));
}

TEST(the_view_has_pose_sources_and_what_is_left) {
  pose.now.pose_map_base = (wm_pose3){{12.5, -3, 0}, {0, 0, sqrt(0.5), sqrt(0.5)}};
  watch_pose(&seen, bytes, wm_lcm_pose(&pose, 0, bytes, sizeof bytes), 10 * WM_NS_PER_S);
  health.lost_probability = 0.25;
  health.counter_count = 1;
  health.counters[0] = (wm_counter){WM_COUNTER_ALIASED_POSES, -1, 3};
  (void)state_of_health();
  FILE *f = fmemopen(shown, sizeof shown, "w");
  watch_print(&seen, 10 * WM_NS_PER_S, f);
  (void)fclose(f);
  const char *const parts[] = {"(lost with probability 0.25)",
                               "aliased    3 other places",
                               "state      tracking",
                               "x    12.50 m",
                               "heading    90.0 deg",
                               "useful for 42 m",
                               "as long as it stands",
                               "edges:front",
                               "7 rejected"};
  for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, parts[i]), shown);
}

TEST(landmarks_that_are_not_found_have_a_reason) {
  uint64_t looks[WM_LOOK_COUNT] = {0};
  char text[200];
  TEST_ASSERT_EQUAL(0, wm_looks_text(looks, text, sizeof text));
  TEST_ASSERT_EQUAL_STRING("", text);
  looks[WM_LOOK_FOUND] = 40;
  TEST_ASSERT_EQUAL(strlen("expected 40: 40 found"), wm_looks_text(looks, text, sizeof text));
  looks[WM_LOOK_LOW_CONTRAST] = 2;
  looks[WM_LOOK_UNLIKE] = 7;
  looks[WM_LOOK_NOT_IN_VIEW] = 900;
  looks[WM_LOOK_UNCERTAIN] = 3;
  (void)wm_looks_text(looks, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING("expected 49: 40 found, 2 low contrast, 7 unlike; else 900 not in view, 3 uncertain", text);
  for (size_t capacity = 1; capacity < 60; capacity++) {
    char small[60];
    memset(small, 'x', sizeof small);
    TEST_ASSERT_LESS_THAN(capacity, wm_looks_text(looks, small, capacity));
    TEST_ASSERT_EQUAL(0, strncmp(small, text, strlen(small)));
  }
  memcpy(health.sources[1].looks, looks, sizeof looks);
  (void)state_of_health();
  FILE *f = fmemopen(shown, sizeof shown, "w");
  watch_print(&seen, 10 * WM_NS_PER_S, f);
  (void)fclose(f);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, text), shown);
}

TEST(innovations_give_a_verdict) {
  wm_innovation i = {.verdict = WM_FUSED, .residual = WM_RESIDUAL_RANGE, .variance = 0.01};
  TEST_ASSERT_EQUAL_STRING("too few observations to tell", watch_consistency(&seen));
  for (int n = 0; n < 200; n++) {
    i.observed = n % 2 ? 0.1 : -0.1;
    watch_innovation(&seen, bytes, wm_lcm_innovation(&i, bytes, sizeof bytes));
  }
  TEST_ASSERT_EQUAL_STRING("consistent", watch_consistency(&seen));
  i.observed = 0.3;
  for (int n = 0; n < 200; n++) watch_innovation(&seen, bytes, wm_lcm_innovation(&i, bytes, sizeof bytes));
  TEST_ASSERT_EQUAL_STRING("observations are further off than the covariance allows", watch_consistency(&seen));
  i.verdict = WM_REJECTED_GATE;
  i.observed = 0;
  for (int n = 0; n < 2000; n++) watch_innovation(&seen, bytes, wm_lcm_innovation(&i, bytes, sizeof bytes));
  TEST_ASSERT_EQUAL_STRING("observations are further off than the covariance allows", watch_consistency(&seen));
}

TEST(refused_data_have_their_reason) {
  char source[WM_HEALTH_NAME_MAX], reason[WM_HEALTH_REASON_MAX];
  health.sources[0].malformed = 235;
  health.sources[0].device = WM_DEVICE_ABSENT;
  (void)snprintf(health.refused_because[0], sizeof health.refused_because[0], "T_CAN: t_ns is 3600 s ahead\033[2J");
  size_t length = wm_lcm_refused(&health, 0, bytes, sizeof bytes);
  TEST_ASSERT_NULL(wm_lcm_read_refused(bytes, length, source, reason));
  TEST_ASSERT_EQUAL_STRING("can", source);
  TEST_ASSERT_EQUAL_STRING("T_CAN: t_ns is 3600 s ahead?[2J", reason);  // no control character reaches a terminal
  TEST_ASSERT_NOT_NULL(wm_lcm_read_refused(bytes, length - 1, source, reason));
  watch_refused(&seen, bytes, length);
  watch_refused(&seen, "rubbish", 7);
  TEST_ASSERT_EQUAL_UINT64(1, seen.not_understood);
  (void)state_of_health();
  FILE *f = fmemopen(shown, sizeof shown, "w");
  watch_print(&seen, 10 * WM_NS_PER_S, f);
  (void)fclose(f);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, "235 of 235 could not be read; the first: T_CAN: t_ns is 3600 s ahead"),
                               shown);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, "nothing that came from it is usable"), shown);
  for (int i = 0; i < 100; i++) {  // any number of senders
    (void)snprintf(health.sources[0].name, WM_HEALTH_NAME_MAX, "%d", i);
    watch_refused(&seen, bytes, wm_lcm_refused(&health, 0, bytes, sizeof bytes));
  }
}

static const char *shown_with(const wm_bound *bound, const wm_health *of) {
  memset(&seen, 0, sizeof seen);
  if (of) seen.health = *of;
  seen.has_health = of != NULL;
  watch_bound(&seen, bytes, wm_lcm_bound(bound, bytes, sizeof bytes));
  FILE *f = fmemopen(shown, sizeof shown, "w");
  watch_print(&seen, 10 * WM_NS_PER_S, f);
  (void)fclose(f);
  return shown;
}

static const char *shown_of(const wm_bound *bound) { return shown_with(bound, NULL); }

TEST(a_doubted_pose_says_how_much_and_why) {
  static wm_health doubted;
  const wm_bound bound = {.risk = 1e-4, .horizontal_m = (double)INFINITY, .why = WM_UNUSABLE_DOUBT};
  doubted.lost_probability = 0.0123;
  TEST_ASSERT_NOT_NULL_MESSAGE(
      strstr(shown_with(&bound, &doubted),
             "not usable: the pose may be wrong with probability 0.012: each observation that fits makes it less\n"),
      shown);
  doubted.cause = WM_CAUSE_BIASED;
  TEST_ASSERT_NOT_NULL_MESSAGE(
      strstr(shown_with(&bound, &doubted), "may be wrong with probability 0.012: has biased innovations\n"), shown);
}

TEST(a_bound_says_whether_the_pose_is_usable) {
  wm_bound bound = {.risk = 1e-4, .horizontal_m = 0.25, .heading_rad = 0.1, .usable = 1};
  TEST_ASSERT_NOT_NULL_MESSAGE(
      strstr(shown_of(&bound), "bound      position 0.25 m, heading 5.73 deg at a risk of 0.0001: usable\n"), shown);
  TEST_ASSERT_NULL_MESSAGE(strstr(shown, "straight on"), shown);
  bound.heading_rad = (double)INFINITY;
  bound.usable = 0;
  bound.why = WM_UNUSABLE_HEADING;
  bound.heading_after_m = 2.04;
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown_of(&bound),
                                      "heading no bound at a risk of 0.0001: not usable: the heading "
                                      "is not known well enough\n"),
                               shown);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, "heading    not known well enough: drive 2.0 m straight on\n"), shown);
  bound.why = WM_UNUSABLE_COUNT;  // of a newer version
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown_of(&bound), ": not usable\n"), shown);
  watch_bound(&seen, "rubbish", 7);
  TEST_ASSERT_EQUAL_UINT64(1, seen.not_understood);
}

static const char *metrics_at(wm_time_ns now_ns) {
  FILE *f = fmemopen(shown, sizeof shown, "w");
  watch_metrics(&seen, now_ns, f);
  TEST_ASSERT_LESS_THAN((long)sizeof shown, ftell(f));
  (void)fclose(f);
  return shown;
}

TEST(a_run_is_metrics) {
  TEST_ASSERT_EQUAL_STRING("# HELP waymark_up 1 where a run is heard.\n# TYPE waymark_up gauge\nwaymark_up 0\n",
                           metrics_at(0));
  pose.now.covariance[wm_cov_index(0, 0)] = 0.0009, pose.now.covariance[wm_cov_index(1, 1)] = 0.0016;
  pose.now.pose_map_base = (wm_pose3){{1.5, -2, 0}, {0, 0, 0.6, 0.8}};
  watch_pose(&seen, bytes, wm_lcm_pose(&pose, 0, bytes, sizeof bytes), 10 * WM_NS_PER_S);
  (void)snprintf(health.sources[1].name, WM_HEALTH_NAME_MAX, "a\"b\\c");
  health.sources[0].silent_ns = -1, health.sources[0].lateness_p99_ns = 25 * WM_NS_PER_MS;
  health.deadlines_missed = 12;
  health.sources[0].received = UINT64_C(9007199254740993);  // whole, beyond what a double holds
  health.sources[0].refused[WM_OUT_OF_RANGE] = 3;
  const wm_bound bound = {.risk = 1e-4, .horizontal_m = 0.25, .heading_rad = HUGE_VAL, .usable = 0};
  watch_bound(&seen, bytes, wm_lcm_bound(&bound, bytes, sizeof bytes));
  health.lost_probability = (double)NAN;
  (void)snprintf(health.host, sizeof health.host, "robot-7");
  health.pid = 42, health.run_id = 0xabc;
  (void)state_of_health();
  const char *const lines[] = {"\nwaymark_up 1\n",
                               "\nwaymark_state{state=\"tracking\"} 1\n",
                               "\nwaymark_state{state=\"lost\"} 0\n",
                               "\nwaymark_pose_sigma_meters 0.05\n",
                               "\nwaymark_pose_age_seconds 1\n",
                               "\nwaymark_pose_x_meters 1.5\n",
                               "\nwaymark_pose_y_meters -2\n",
                               "\nwaymark_pose_heading_radians 1.28700221",
                               "\nwaymark_source_silent_seconds{source=\"can\"} -1e-09\n",
                               "\nwaymark_source_lateness_p99_seconds{source=\"can\"} 0.025\n",
                               "\n# TYPE waymark_deadlines_missed_total counter\nwaymark_deadlines_missed_total 12\n",
                               "\nwaymark_lost_probability NaN\n",
                               "\nwaymark_reckoning_left_meters 41.6\n",
                               "\nwaymark_source_received_total{source=\"can\"} 9007199254740993\n",
                               "\nwaymark_source_rejected_total{source=\"a\\\"b\\\\c\",verdict=\"gate\"} 7\n",
                               "\nwaymark_source_refused_total{source=\"can\",status=\"out of range\"} 3\n",
                               "\nwaymark_pose_usable 0\n",
                               "\nwaymark_pose_bound_meters 0.25\n",
                               "\nwaymark_pose_bound_heading_radians +Inf\n",
                               "\nwaymark_source_device{source=\"can\",state=\"works\"} 1\n",
                               "\nwaymark_run_info{host=\"robot-7\",pid=\"42\",run=\"0000000000000abc\"} 1\n"};
  const char *text = metrics_at(11 * WM_NS_PER_S);
  for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, lines[i]), lines[i]);
  for (const char *at = text; (at = strstr(at, "# TYPE ")) != NULL; at++) {  // each name once
    char name[80];
    TEST_ASSERT_EQUAL(1, sscanf(at, "# TYPE %70s", name));
    (void)strcat(name, " ");
    const char *again = strstr(at + 7 + strlen(name), name);
    TEST_ASSERT_TRUE_MESSAGE(!again || strncmp(again - 7, "# TYPE ", 7) != 0, name);
  }
  TEST_ASSERT_NOT_NULL(strstr(metrics_at(13 * WM_NS_PER_S), "waymark_up 0"));  // a run that fell silent
  TEST_ASSERT_NULL(strstr(shown, "waymark_state"));
}
