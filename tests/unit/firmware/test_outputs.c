// SPDX-License-Identifier: Apache-2.0
// The estimator's thread never waits for LCM or the disk: records that find no room are counted, and a hole in the log
// is marked.
#include "common/suite.h"
#include "live/live.h"
#include "log_fixture.h"

#define SLOTS 4

static live_estimator *estimator;
static wm_output output;
static void *memory, *publish_memory;

void setUp(void) {
  estimator = aligned_alloc(WM_CACHE_LINE, (sizeof *estimator + WM_CACHE_LINE - 1) / WM_CACHE_LINE * WM_CACHE_LINE);
  memset(estimator, 0, sizeof *estimator);
  size_t slot_bytes = OUTPUT_RECORD_HEAD + wm_output_bytes(0);
  memory = malloc(wm_ring_bytes(SLOTS, slot_bytes));
  wm_ring_init(&estimator->to_disk, memory, SLOTS, slot_bytes);
  publish_memory = malloc(wm_ring_bytes(SLOTS, PUBLISH_RECORD_BYTES));
  wm_ring_init(&estimator->to_publish, publish_memory, SLOTS, PUBLISH_RECORD_BYTES);
  output = estimator_output(estimator);
}

void tearDown(void) {
  free(publish_memory);
  free(memory);
  free(estimator);
}

static void put_event(uint32_t i) {
  wm_event e = fixture_event(i);
  output.put(output.context, WM_OUTPUT_EVENT, &e, wm_event_bytes(&e));
}

static uint64_t take(uint64_t *what) {
  const output_record *record = wm_ring_front(&estimator->to_disk);
  if (!record) return 0;
  uint64_t kind = record->kind;
  *what = kind == OUTPUT_GAP ? record->as.gap : record->as.event.seq;
  wm_ring_pop(&estimator->to_disk);
  return kind;
}

TEST(events_that_found_no_room_are_marked_before_the_next_one) {
  uint64_t what;
  for (uint32_t i = 0; i < 7; i++) put_event(i);  // 4, 5 and 6 find no room
  for (uint32_t i = 0; i < SLOTS; i++) {
    TEST_ASSERT_EQUAL_UINT64(WM_OUTPUT_EVENT, take(&what));
    TEST_ASSERT_EQUAL_UINT64(i, what);
  }
  put_event(7);
  TEST_ASSERT_EQUAL_UINT64(OUTPUT_GAP, take(&what));
  TEST_ASSERT_EQUAL_UINT64(3, what);
  TEST_ASSERT_EQUAL_UINT64(WM_OUTPUT_EVENT, take(&what));
  TEST_ASSERT_EQUAL_UINT64(7, what);
  TEST_ASSERT_EQUAL_UINT64(0, take(&what));
}

// Room for the mark, but not for the event behind it: the event counts into the next mark.
TEST(a_mark_without_its_event_is_followed_by_another) {
  uint64_t what, marked = 0, events = 0;
  for (uint32_t i = 0; i < 6; i++) put_event(i);
  TEST_ASSERT_EQUAL_UINT64(WM_OUTPUT_EVENT, take(&what));
  put_event(6);
  put_event(7);
  while (take(&what)) {
  }
  put_event(8);
  for (uint64_t kind; (kind = take(&what)) != 0;) {
    if (kind == OUTPUT_GAP) marked += what;
    if (kind == WM_OUTPUT_EVENT) events++;
  }
  TEST_ASSERT_EQUAL_UINT64(2, marked);  // 6 and 7; 4 and 5 were marked before
  TEST_ASSERT_EQUAL_UINT64(1, events);
}

TEST(poses_that_find_no_room_are_counted) {
  wm_published published = {.made_ns = 1};
  for (int i = 0; i < 10; i++) output.put(output.context, WM_OUTPUT_PUBLISHED, &published, sizeof published);
  TEST_ASSERT_EQUAL_UINT64(10 - SLOTS, wm_ring_dropped(&estimator->to_disk));
  TEST_ASSERT_EQUAL_UINT64(2 * (10 - SLOTS), outputs_lost(estimator));  // neither thread took any
  TEST_ASSERT_EQUAL_UINT64(0, estimator->events_lost);
}

TEST(a_blocked_disk_holds_no_message_up) {
  int sent = 0;
  for (uint32_t i = 0; i < 10; i++) {
    wm_event e = fixture_event(i);
    e.kind = WM_EVENT_SIGHTING;
    output.put(output.context, WM_OUTPUT_EVENT, &e, wm_event_bytes(&e));
    while (wm_ring_front(&estimator->to_publish)) {
      wm_ring_pop(&estimator->to_publish);
      sent++;
    }
  }
  TEST_ASSERT_EQUAL(10, sent);
  TEST_ASSERT_EQUAL_UINT64(10 - SLOTS, estimator->events_lost);
}

// Lines of text of the publish thread and of the sources' threads wait for the same disk.
TEST(lines_that_find_no_room_are_counted_in_health) {
  static live run;
  static wm_health health;
  void *lines = malloc(wm_ring_bytes(SLOTS, 400));
  wm_ring_init(&run.publish.lines, lines, SLOTS, 400);
  for (int i = 0; i < 10; i++) live_say_later(&run, "camera: silent");
  void *of_source = malloc(wm_ring_bytes(SLOTS, 400));
  run.assembly.source_count = 1;
  wm_ring_init(&run.sources[0].lines, of_source, SLOTS, 400);
  for (int i = 0; i < SLOTS + 2; i++) live_queue_line(&run.sources[0].lines, "camera: picture %d is late", i);
  TEST_ASSERT_EQUAL_STRING("camera: picture 0 is late", wm_ring_front(&run.sources[0].lines));
  wm_histogram_add(&run.publish.send_ns, 3 * WM_NS_PER_MS);
  live_publish_health(&run, &health);
  TEST_ASSERT_EQUAL_UINT64(10 - SLOTS + 2, health.lines_lost);
  TEST_ASSERT_INT64_WITHIN(WM_NS_PER_MS, 3 * WM_NS_PER_MS, health.send_p99_ns);
  free(lines);
  free(of_source);
}
