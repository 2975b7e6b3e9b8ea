// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "fusion/merge.h"

#define MS WM_NS_PER_MS
#define QUEUE 512

static _Alignas(64) uint8_t memory[1 << 21];
static wm_merge *merge;
static uint32_t next_seq;

static const wm_merge_source kMotion = {.rank = 0, .is_motion = 1, .in_order = 1, .lateness_max_ns = 150 * MS};
static const wm_merge_source kCamera = {.rank = 1, .in_order = 1, .lateness_max_ns = 150 * MS};

static void open_merge(const wm_merge_source *sources, size_t count) {
  size_t slot = wm_merge_slot_bytes(WM_EVENT_BIT(WM_EVENT_TWIST2));
  TEST_ASSERT_LESS_OR_EQUAL(sizeof memory, wm_merge_bytes(count, QUEUE, slot));
  memset(memory, 0xA5, sizeof memory);  // it may hold anything
  merge = wm_merge_init(memory, sources, count, QUEUE, slot, 300 * MS);
}

void setUp(void) {
  next_seq = 0;
  open_merge((wm_merge_source[]){kMotion, kCamera}, 2);
}

static wm_merge_verdict arrive(int source, wm_time_ns t_ns, wm_time_ns arrival_ns) {
  wm_event e;
  memset(&e, 0, sizeof e);
  e.t_ns = t_ns;
  e.arrival_ns = arrival_ns;
  e.source = (uint16_t)source;
  e.seq = next_seq++;
  e.kind = WM_EVENT_SIGHTING;
  e.as.sighting.bearing_rad = (double)e.seq;
  wm_merge_verdict verdict = wm_merge_push(merge, &e);
  wm_merge_advance(merge, arrival_ns);
  return verdict;
}

// Stamps (ms) that are final now, in their order, as text.
static const char *final_ms(void) {
  static char text[4096];
  text[0] = '\0';
  for (wm_event e; wm_merge_take(merge, &e);)
    (void)snprintf(text + strlen(text), sizeof text - strlen(text), "%s%lld/%u", text[0] ? " " : "",
                   (long long)(e.t_ns / MS), e.source);
  return text;
}

TEST(nothing_is_handed_out_before_the_others_have_spoken_past_it) {
  arrive(0, 0, 0);
  arrive(0, 10 * MS, 10 * MS);
  TEST_ASSERT_EQUAL_STRING("", final_ms());
  arrive(1, 5 * MS, 12 * MS);
  TEST_ASSERT_EQUAL_STRING("0/0", final_ms());  // 5 itself may get more rows
  arrive(1, 15 * MS, 20 * MS);
  TEST_ASSERT_EQUAL_STRING("5/1", final_ms());
  arrive(0, 20 * MS, 20 * MS);
  TEST_ASSERT_EQUAL_STRING("10/0", final_ms());
}

// A source that does not keep its order: the newest stamp is that of no later arrival, and a stamp counts once.
TEST(newest_first_and_distinct_stamps_are_counted) {
  wm_merge_source loose = kCamera;
  loose.in_order = 0;
  open_merge((wm_merge_source[]){kMotion, loose}, 2);
  const wm_merge_counts *counts = wm_merge_source_counts(merge, 1);
  TEST_ASSERT_EQUAL_INT64(WM_TIME_NONE, counts->newest_ns);
  arrive(1, 10 * MS, 12 * MS);
  TEST_ASSERT_EQUAL_INT64(10 * MS, counts->first_ns);
  arrive(1, 20 * MS, 22 * MS);
  arrive(1, 15 * MS, 23 * MS);
  arrive(1, 20 * MS, 24 * MS);
  TEST_ASSERT_EQUAL_INT64(20 * MS, counts->newest_ns);
  TEST_ASSERT_EQUAL_INT64(10 * MS, counts->first_ns);
  TEST_ASSERT_EQUAL_UINT64(2, counts->stamps);
}

TEST(p99_of_the_lateness) {
  for (int i = 0; i < 99; i++) arrive(1, i * 10 * MS, i * 10 * MS + 5 * MS);
  arrive(1, 990 * MS, 1040 * MS);
  TEST_ASSERT_EQUAL_INT64(6 * MS, wm_merge_lateness_p99(merge, 1));  // 99 of 100 are below
  arrive(1, 1100 * MS, 1150 * MS);
  TEST_ASSERT_EQUAL_INT64(51 * MS, wm_merge_lateness_p99(merge, 1));
  open_merge((wm_merge_source[]){kMotion, kCamera}, 2);
  arrive(1, 0, (WM_MERGE_LATENESS_BINS - 2) * MS + 1);  // up to the last bin: the next whole ms
  TEST_ASSERT_EQUAL_INT64((WM_MERGE_LATENESS_BINS - 1) * MS, wm_merge_lateness_p99(merge, 1));
  open_merge((wm_merge_source[]){kMotion, kCamera}, 2);
  arrive(1, 0, 2000 * MS);  // beyond the last bin: as it was
  TEST_ASSERT_EQUAL_INT64(2000 * MS, wm_merge_lateness_p99(merge, 1));
  open_merge((wm_merge_source[]){kMotion, kCamera}, 2);
  arrive(1, 0, 0);
  TEST_ASSERT_EQUAL_INT64(0, wm_merge_lateness_p99(merge, 1));
}

TEST(motion_comes_first_then_the_rank_then_the_file) {
  wm_merge_source second = kCamera;
  second.rank = 7;
  open_merge((wm_merge_source[]){second, kCamera, kMotion}, 3);
  arrive(0, 5 * MS, 5 * MS);
  arrive(1, 5 * MS, 5 * MS);
  arrive(0, 5 * MS, 5 * MS);
  arrive(2, 5 * MS, 5 * MS);
  wm_merge_flush(merge);
  TEST_ASSERT_EQUAL_STRING("5/2 5/1 5/0 5/0", final_ms());
}

// Two cameras of one rank whose rows have the same stamps and numbers, the one or the other first.
TEST(of_equal_ranks_the_lower_source_comes_first) {
  for (int first = 1; first <= 2; first++) {
    open_merge((wm_merge_source[]){kMotion, kCamera, kCamera}, 3);
    for (int i = 0; i < 3; i++) {
      next_seq = (uint32_t)i;
      arrive(first, 10 * i * MS, 10 * i * MS);
      next_seq = (uint32_t)i;
      arrive(3 - first, 10 * i * MS, 10 * i * MS);
    }
    wm_merge_advance(merge, 1000 * MS);
    TEST_ASSERT_EQUAL_STRING("0/1 0/2 10/1 10/2 20/1 20/2", final_ms());
  }
}

// The number of an event within its source has 32 bits: at 1 kHz it wraps after 50 days.
TEST(the_numbers_of_events_wrap) {
  next_seq = UINT32_MAX - 3;
  for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(i % 2, (10 + i) * MS, (10 + i) * MS));
  TEST_ASSERT_EQUAL_UINT32(0, next_seq);
  for (int i = 4; i < 8; i++) TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(i % 2, (10 + i) * MS, (10 + i) * MS));
  wm_merge_flush(merge);
  TEST_ASSERT_EQUAL_STRING("10/0 11/1 12/0 13/1 14/0 15/1 16/0 17/1", final_ms());
}

// Events with one stamp stay as they were numbered, also where their numbers wrap between them.
TEST(events_of_one_stamp_keep_their_order_where_numbers_wrap) {
  next_seq = UINT32_MAX - 2;
  for (int i = 0; i < 6; i++) TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(1, 10 * MS, 10 * MS));
  wm_merge_flush(merge);
  const uint32_t numbers[] = {UINT32_MAX - 2, UINT32_MAX - 1, UINT32_MAX, 0, 1, 2};
  for (int i = 0; i < 6; i++) {
    wm_event e;
    TEST_ASSERT_TRUE(wm_merge_take(merge, &e));
    TEST_ASSERT_EQUAL_UINT32(numbers[i], e.seq);
  }
}

TEST(a_silent_source_costs_its_lateness_and_its_first_datum_after_that_is_fused) {
  for (int i = 0; i <= 100; i++) arrive(0, i * 10 * MS, i * 10 * MS);
  TEST_ASSERT_EQUAL_INT64(850 * MS, wm_merge_watermark(merge));  // now - 150 ms
  (void)final_ms();
  TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(1, 855 * MS, 1000 * MS));  // 145 ms late
  arrive(0, 1010 * MS, 1010 * MS);
  TEST_ASSERT_EQUAL_STRING("850/0 855/1", final_ms());
  arrive(0, 1020 * MS, 1020 * MS);
  TEST_ASSERT_EQUAL_STRING("860/0", final_ms());
}

TEST(what_is_late_is_counted_and_dropped) {
  for (int i = 0; i <= 100; i++) arrive(0, i * 10 * MS, i * 10 * MS);
  TEST_ASSERT_EQUAL(WM_MERGE_LATE, arrive(1, 849 * MS, 1000 * MS));
  TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(1, 850 * MS, 1000 * MS));  // exactly lateness_max is in time
  TEST_ASSERT_EQUAL_UINT64(1, wm_merge_source_counts(merge, 1)->late);
  TEST_ASSERT_EQUAL_UINT64(2, wm_merge_source_counts(merge, 1)->received);
  TEST_ASSERT_EQUAL_INT64(151 * MS, wm_merge_lateness_p99(merge, 1) - MS);
}

// Data of a receiver that is 200 ms late, beside motion to `end_ms`: how many are late.
static uint64_t late_of_a_receiver(wm_time_ns lateness_most_ns, wm_time_ns late_ns, int end_ms) {
  wm_merge_source receiver = kCamera;
  receiver.lateness_most_ns = lateness_most_ns;
  open_merge((wm_merge_source[]){kMotion, receiver}, 2);
  for (int ms = 0; ms <= end_ms; ms += 10) {
    arrive(0, ms * MS, ms * MS);
    if (ms % 200 == 0 && ms * MS >= late_ns) arrive(1, ms * MS - late_ns, ms * MS);
    (void)final_ms();
  }
  return wm_merge_source_counts(merge, 1)->late;
}

TEST(the_bound_rises_with_a_source_that_is_usually_late) {
  TEST_ASSERT_EQUAL_UINT64(3, late_of_a_receiver(300 * MS, 200 * MS, 5000));
  TEST_ASSERT_EQUAL_INT64(220 * MS, wm_merge_lateness_max(merge, 1));  // a tenth more
  TEST_ASSERT_EQUAL_INT64(150 * MS, wm_merge_lateness_max(merge, 0));
  TEST_ASSERT_EQUAL_UINT64(3, late_of_a_receiver(205 * MS, 200 * MS, 5000));
  TEST_ASSERT_EQUAL_INT64(205 * MS, wm_merge_lateness_max(merge, 1));  // no further than it may
}

TEST(a_stated_bound_and_a_later_source_keep_their_bound) {
  TEST_ASSERT_EQUAL_UINT64(24, late_of_a_receiver(0, 200 * MS, 4800));
  TEST_ASSERT_EQUAL_INT64(150 * MS, wm_merge_lateness_max(merge, 1));
  TEST_ASSERT_EQUAL_UINT64(24, late_of_a_receiver(190 * MS, 200 * MS, 4800));
  TEST_ASSERT_EQUAL_INT64(150 * MS, wm_merge_lateness_max(merge, 1));
}

TEST(what_is_late_by_chance_raises_no_bound) {
  wm_merge_source receiver = kCamera;
  receiver.lateness_most_ns = 300 * MS;
  open_merge((wm_merge_source[]){kMotion, receiver}, 2);
  for (int i = 30; i < 200; i++) {
    arrive(0, i * 10 * MS, i * 10 * MS);
    (void)final_ms();
    if (i % 3) arrive(1, i * 10 * MS - 200 * MS, i * 10 * MS);  // two in a row
    if (i % 3 == 0) arrive(1, i * 10 * MS - 100 * MS, i * 10 * MS);
  }
  TEST_ASSERT_EQUAL_INT64(150 * MS, wm_merge_lateness_max(merge, 1));
}

TEST(a_periodic_source_lets_time_pass_until_its_next_datum) {
  wm_merge_source periodic = kCamera;
  periodic.period_ns = 100 * MS;
  open_merge((wm_merge_source[]){kMotion, periodic}, 2);
  arrive(1, 0, 0);
  for (int i = 1; i <= 12; i++) arrive(0, i * 10 * MS, i * 10 * MS);
  TEST_ASSERT_EQUAL_INT64(100 * MS, wm_merge_watermark(merge));  // not 0, and not past its next datum
  TEST_ASSERT_EQUAL_STRING("0/1 10/0 20/0 30/0 40/0 50/0 60/0 70/0 80/0 90/0", final_ms());
}

// Rows of one frame arrive within 1 ms of each other: until then another one with this stamp, or one before the next
// period, is taken; from then on there is none.
TEST(rows_of_one_frame_arrive_within_a_millisecond) {
  wm_merge_source periodic = kCamera;
  periodic.period_ns = 100 * MS;
  open_merge((wm_merge_source[]){periodic}, 1);
  arrive(0, 0, 5 * MS);
  wm_merge_advance(merge, 6 * MS - 1);
  TEST_ASSERT_EQUAL_INT64(0, wm_merge_watermark(merge));
  TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(0, 0, 6 * MS - 1));
  wm_merge_advance(merge, 7 * MS - 1);
  TEST_ASSERT_EQUAL_INT64(100 * MS, wm_merge_watermark(merge));
  TEST_ASSERT_EQUAL_STRING("0/0 0/0", final_ms());
}

TEST(a_datum_sent_twice_is_fused_once) {
  open_merge(&kMotion, 1);
  wm_event e;
  memset(&e, 0, sizeof e);
  e.kind = WM_EVENT_SIGHTING;
  e.as.sighting.bearing_rad = 0.5;
  TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, wm_merge_push(merge, &e));
  e.seq = 1;
  e.arrival_ns = 3;
  TEST_ASSERT_EQUAL(WM_MERGE_DUPLICATE, wm_merge_push(merge, &e));
  e.as.sighting.landmark_id = 1;
  TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, wm_merge_push(merge, &e));
  TEST_ASSERT_EQUAL_UINT64(1, wm_merge_source_counts(merge, 0)->duplicates);
}

TEST(a_full_queue_drops_the_newest_and_counts) {
  open_merge(&kMotion, 1);
  for (int i = 0; i < QUEUE; i++) {
    wm_event e = {.t_ns = i, .arrival_ns = i, .seq = (uint32_t)i, .kind = WM_EVENT_LOOKED};
    TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, wm_merge_push(merge, &e));
  }
  wm_event e = {.t_ns = QUEUE, .arrival_ns = QUEUE, .seq = QUEUE, .kind = WM_EVENT_LOOKED};
  TEST_ASSERT_EQUAL(WM_MERGE_DROPPED, wm_merge_push(merge, &e));
  TEST_ASSERT_EQUAL_UINT64(1, wm_merge_source_counts(merge, 0)->dropped);
  TEST_ASSERT_EQUAL(QUEUE, wm_merge_waiting(merge));
  wm_merge_flush(merge);
  int count = 0;
  while (wm_merge_take(merge, &e)) count++;
  TEST_ASSERT_EQUAL(QUEUE, count);
}

TEST(stamps_from_the_future_and_absurd_ones_are_refused) {
  open_merge(&kMotion, 1);
  TEST_ASSERT_EQUAL(WM_MERGE_FUTURE, arrive(0, 2000 * MS, 1000 * MS));
  TEST_ASSERT_EQUAL(WM_MERGE_FUTURE, arrive(0, INT64_MAX, 1000 * MS));
  TEST_ASSERT_EQUAL(WM_MERGE_LATE, arrive(0, INT64_MIN, 1000 * MS));
  TEST_ASSERT_EQUAL(WM_MERGE_TAKEN, arrive(0, 1200 * MS, 1000 * MS));
  TEST_ASSERT_EQUAL_UINT64(2, wm_merge_source_counts(merge, 0)->future);
}

TEST(a_source_that_fell_silent_is_stale_against_its_own_rate) {
  for (int i = 0; i <= 100; i++) arrive(0, i * 10 * MS, i * 10 * MS);
  TEST_ASSERT_EQUAL(0, wm_merge_is_stale(merge, 0, 1900 * MS));
  TEST_ASSERT_EQUAL(1, wm_merge_is_stale(merge, 0, 2001 * MS));
  TEST_ASSERT_EQUAL(1, wm_merge_is_stale(merge, 1, 2001 * MS));  // never spoke
}

// A source without any datum is silent since the run's clock began, whatever time that is.
TEST(a_source_without_data_is_silent_since_the_start) {
  TEST_ASSERT_EQUAL_INT64(0, wm_merge_silent_ns(merge, 1, 3600 * WM_NS_PER_S));  // no clock yet
  for (int i = 0; i < 10; i++) arrive(0, 3600 * WM_NS_PER_S + i * 10 * MS, 3600 * WM_NS_PER_S + i * 10 * MS);
  TEST_ASSERT_EQUAL_INT64(900 * MS, wm_merge_silent_ns(merge, 1, 3600 * WM_NS_PER_S + 900 * MS));
  TEST_ASSERT_EQUAL_INT64(810 * MS, wm_merge_silent_ns(merge, 0, 3600 * WM_NS_PER_S + 900 * MS));
  TEST_ASSERT_EQUAL(0, wm_merge_is_stale(merge, 1, 3600 * WM_NS_PER_S + 900 * MS));
}

// Three data in 4 s are two periods of 2 s: ten of these without a datum are none too many, eleven are.
TEST(a_slow_source_is_stale_after_ten_of_its_periods) {
  open_merge(&kCamera, 1);
  for (int i = 0; i < 3; i++) arrive(0, i * 2000 * MS, i * 2000 * MS);
  TEST_ASSERT_EQUAL(0, wm_merge_is_stale(merge, 0, 4000 * MS + 20000 * MS));
  TEST_ASSERT_EQUAL(1, wm_merge_is_stale(merge, 0, 4000 * MS + 22000 * MS));
}

// ── property: any lateness below the bound gives exactly the sorted stream ──────────────────────────────────────────

static uint64_t random_state;
static uint32_t random_below(uint32_t n) {
  random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
  return (uint32_t)((random_state >> 33) % n);
}

typedef struct datum {
  wm_time_ns t_ns, arrival_ns;
  int source, motion, rank;
  uint32_t seq;
} datum;

static int by_arrival(const void *a, const void *b) {
  const datum *x = a, *y = b;
  if (x->arrival_ns != y->arrival_ns) return x->arrival_ns < y->arrival_ns ? -1 : 1;
  if (x->source != y->source) return x->source - y->source;
  return x->seq < y->seq ? -1 : 1;
}

static int by_stamp(const void *a, const void *b) {
  const datum *x = a, *y = b;
  if (x->t_ns != y->t_ns) return x->t_ns < y->t_ns ? -1 : 1;
  if (x->motion != y->motion) return y->motion - x->motion;
  if (x->rank != y->rank) return x->rank - y->rank;
  return x->seq < y->seq ? -1 : 1;
}

TEST(random_lateness_below_the_bound_gives_exactly_the_sorted_stream) {
  for (int run = 0; run < 300; run++) {
    random_state = (uint64_t)run + 1;
    enum { SOURCES = 4, EACH = 120 };
    static datum data[SOURCES * EACH];
    wm_merge_source sources[SOURCES];
    size_t count = 0;
    for (int s = 0; s < SOURCES; s++) {
      sources[s] = (wm_merge_source){.rank = (s * 2 + run) % 5,
                                     .is_motion = s == 0 || (s == 3 && run % 3 == 0),
                                     .in_order = (uint8_t)(s < 2),
                                     .lateness_max_ns = (wm_time_ns)(20 + random_below(280)) * MS};
      wm_time_ns t = random_below(50) * MS, last_arrival = 0;
      for (uint32_t i = 0; i < EACH; i++) {
        t += (wm_time_ns)random_below(3) * random_below(25) * MS;  // also equal stamps
        if (random_below(60) == 0) t += 900 * MS;                  // and silence
        wm_time_ns late = (wm_time_ns)random_below((uint32_t)(sources[s].lateness_max_ns / 1000)) * 1000;
        if (run % 7 == 0) late = sources[s].lateness_max_ns;  // on the bound
        wm_time_ns arrival = t + late;
        if (sources[s].in_order && arrival < last_arrival) arrival = last_arrival;  // keeps its order
        if (arrival - t > sources[s].lateness_max_ns) arrival = t + sources[s].lateness_max_ns;
        last_arrival = arrival;
        data[count++] = (datum){t, arrival, s, sources[s].is_motion, sources[s].rank, i};
      }
    }
    // A source's own order is that of its arrival, as a recording's rows are.
    qsort(data, count, sizeof data[0], by_arrival);
    uint32_t seq[SOURCES] = {0};
    for (size_t i = 0; i < count; i++) data[i].seq = seq[data[i].source]++;

    open_merge(sources, SOURCES);
    static datum out[SOURCES * EACH];
    size_t given = 0;
    for (size_t i = 0; i < count; i++) {
      wm_event e;
      memset(&e, 0, sizeof e);
      e.t_ns = data[i].t_ns;
      e.arrival_ns = data[i].arrival_ns;
      e.source = (uint16_t)data[i].source;
      e.seq = data[i].seq;
      e.kind = WM_EVENT_SIGHTING;
      e.as.sighting.bearing_rad = data[i].seq;
      wm_merge_advance(merge, e.arrival_ns);
      TEST_ASSERT_EQUAL_MESSAGE(WM_MERGE_TAKEN, wm_merge_push(merge, &e), "in time, and yet not taken");
      if (random_below(3)) wm_merge_advance(merge, e.arrival_ns);  // how often one looks doesn't matter
      if (i + 1 == count) wm_merge_flush(merge);
      for (wm_event f; wm_merge_take(merge, &f);) out[given++] = (datum){f.t_ns, f.arrival_ns, f.source, 0, 0, f.seq};
    }
    TEST_ASSERT_EQUAL(count, given);
    qsort(data, count, sizeof data[0], by_stamp);
    for (size_t i = 0; i < count; i++) {
      TEST_ASSERT_EQUAL_INT64(data[i].t_ns, out[i].t_ns);
      TEST_ASSERT_EQUAL(data[i].source, out[i].source);
      TEST_ASSERT_EQUAL_UINT32(data[i].seq, out[i].seq);
    }
  }
}

// Whatever comes, stamps never run back and every datum is somewhere.
TEST(any_input_comes_out_in_order_and_is_accounted_for) {
  for (int run = 0; run < 200; run++) {
    random_state = 7000 + (uint64_t)run;
    open_merge((wm_merge_source[]){kMotion, kCamera, {.rank = 2, .lateness_max_ns = 50 * MS}}, 3);
    wm_time_ns now = 0, last = INT64_MIN;
    uint64_t given = 0, pushed = 0;
    for (int i = 0; i < 2000; i++) {
      now += random_below(4) * MS;
      wm_time_ns t = now - (wm_time_ns)random_below(400) * MS + (random_below(50) == 0 ? 500 * MS : 0);
      arrive((int)random_below(3), t, now);
      pushed++;
      for (wm_event e; wm_merge_take(merge, &e);) {
        TEST_ASSERT_GREATER_OR_EQUAL_INT64(last, e.t_ns);
        last = e.t_ns;
        given++;
      }
    }
    uint64_t lost = 0, received = 0;
    for (size_t s = 0; s < 3; s++) {
      const wm_merge_counts *c = wm_merge_source_counts(merge, s);
      lost += c->late + c->dropped + c->duplicates + c->future;
      received += c->received;
    }
    TEST_ASSERT_EQUAL_UINT64(pushed, received);
    TEST_ASSERT_EQUAL_UINT64(pushed, given + lost + wm_merge_waiting(merge));
    TEST_ASSERT_EQUAL(wm_merge_waiting(merge),
                      wm_merge_waiting_of(merge, 0) + wm_merge_waiting_of(merge, 1) + wm_merge_waiting_of(merge, 2));
  }
}
