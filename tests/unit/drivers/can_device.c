// SPDX-License-Identifier: Apache-2.0
// A CAN interface as a source: stamps, filters, and what befalls an interface on a robot.
#include "can_device.h"

#include <time.h>

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/errqueue.h>

#include "can_clock.h"
#include "can_fixture.h"
#include "common/suite.h"
#include "fake_can.h"

static const char kDbc[] = "BO_ 256 Speed: 2 X\n SG_ V : 0|16@1+ (0.001,0) [0|65] \"m/s\" X\n";

static fake_can fake;
static wm_source *source;
static wm_event event;
static wm_error err;

void setUp(void) { source = NULL; }
void tearDown(void) {
  if (source) source->ops->close(source);
}

static void make(fake_step *steps) {
  wm_dbc *dbc;
  wm_can_decoder *decoder;
  wm_can_binding b = binding(WM_Q_VEHICLE_SPEED, "Speed", "V");
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_dbc_parse(kDbc, strlen(kDbc), "car.dbc", &dbc, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_can_decoder_make(dbc, &b, 1, &decoder, &err), err.text);
  wm_dbc_free(dbc);
  fake_can_init(&fake, steps);
  TEST_ASSERT_EQUAL(WM_OK, can_device_make("can0", decoder, &kFakeCan, &fake, &source, &err));
}

static wm_status next(void) { return source->ops->next(source, &event, &err); }

// The next event, within a time.
static void expect_speed(double speed, wm_time_ns within_ns) {
  wm_time_ns end_ns = fake.now_ns + within_ns;
  wm_status status;
  while ((status = next()) == WM_AGAIN && fake.now_ns < end_ns) {
  }
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, source->counts.device_note);
  TEST_ASSERT_EQUAL_DOUBLE(speed, event.as.quantities.value[0]);
}

static void expect_nothing_for(wm_time_ns ns) {
  for (wm_time_ns end_ns = fake.now_ns + ns; fake.now_ns < end_ns;) TEST_ASSERT_EQUAL(WM_AGAIN, next());
}

#define AT(ms) (FAKE_BOOT_NS + (ms)*WM_NS_PER_MS)
#define FRAME(ms, v) \
  { AT(ms), FAKE_FRAME, fake_frame(AT(ms), v), 0 }
#define ERROR_FRAME(ms, id, c) \
  { AT(ms), FAKE_FRAME, fake_error_frame(AT(ms), id, c), 0 }
#define STEP(ms, what) \
  { AT(ms), what, {.hardware_ns = 0}, 0 }
#define FAILS(ms, reason) \
  { AT(ms), FAKE_FAILS, {.hardware_ns = 0}, reason }
#define END \
  { INT64_MAX, FAKE_END, {.hardware_ns = 0}, 0 }

TEST(frames_become_events_with_the_kernels_stamp) {
  fake_step steps[] = {FRAME(3, 1500), FRAME(13, 1600), END};
  make(steps);
  fake.reads_late_ns = 7 * WM_NS_PER_MS;
  expect_speed(1.5, WM_NS_PER_S);
  TEST_ASSERT_EQUAL_INT64(AT(3), event.t_ns);
  TEST_ASSERT_EQUAL_INT64(AT(10), event.arrival_ns);
  expect_speed(1.6, WM_NS_PER_S);
  TEST_ASSERT_EQUAL_INT64(AT(13), event.t_ns);
  TEST_ASSERT_EQUAL_UINT32(1, event.seq);
  TEST_ASSERT_EQUAL(1, fake.filters);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
  TEST_ASSERT_LESS_OR_EQUAL_INT64(WM_NS_PER_MS, source->counts.stamp_uncertainty_ns);
  TEST_ASSERT_TRUE(source->is_live && source->in_order && source->is_motion);
}

TEST(a_wait_in_vain_ends_so_that_a_stop_is_noticed) {
  fake_step steps[] = {END};
  make(steps);
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  TEST_ASSERT_LESS_OR_EQUAL_INT64(2 * WM_DEVICE_WAIT_MS * WM_NS_PER_MS, fake.now_ns - FAKE_BOOT_NS);
}

TEST(an_interface_that_goes_down_keeps_its_socket_and_comes_up_again) {
  fake_step steps[] = {FRAME(3, 1500),      STEP(20, FAKE_DOWN), FAILS(20, ENETDOWN),
                       STEP(2000, FAKE_UP), FRAME(2100, 1700),   END};
  make(steps);
  expect_speed(1.5, WM_NS_PER_S);
  expect_nothing_for(WM_NS_PER_S);
  TEST_ASSERT_EQUAL(WM_DEVICE_DOWN, source->counts.device);
  expect_speed(1.7, 2 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
  TEST_ASSERT_EQUAL(1, fake.opened);
}

TEST(an_adapter_that_is_unplugged_and_comes_back_is_opened_anew) {
  fake_step steps[] = {FRAME(3, 1500),        STEP(20, FAKE_REMOVED), FAILS(20, ENODEV),
                       STEP(3000, FAKE_BACK), FRAME(4000, 1800),      END};
  make(steps);
  expect_speed(1.5, WM_NS_PER_S);
  expect_nothing_for(WM_NS_PER_S);
  TEST_ASSERT_EQUAL(WM_DEVICE_ABSENT, source->counts.device);
  TEST_ASSERT_FALSE(fake.is_open);
  expect_speed(1.8, 4 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL(2, fake.opened);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
}

// Without a word from the kernel: the name has another index now.
TEST(an_adapter_that_was_changed_silently_is_noticed) {
  fake_step steps[] = {FRAME(3, 1500), STEP(20, FAKE_BACK), FRAME(2000, 1900), END};
  make(steps);
  expect_speed(1.5, WM_NS_PER_S);
  expect_speed(1.9, 3 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL(2, fake.opened);
}

// The interface is looked for before its socket fails: the same is stated.
TEST(an_adapter_that_is_missed_before_its_socket_fails_is_gone) {
  fake_step steps[] = {FRAME(3, 1500), STEP(20, FAKE_REMOVED), STEP(3000, FAKE_BACK), FRAME(4000, 1800), END};
  make(steps);
  expect_speed(1.5, WM_NS_PER_S);
  while (source->counts.device != WM_DEVICE_ABSENT) expect_nothing_for(50 * WM_NS_PER_MS);
  TEST_ASSERT_EQUAL_STRING("can0 is gone (No such device); looking for it", source->counts.device_note);
  expect_speed(1.8, 4 * WM_NS_PER_S);
  TEST_ASSERT_EQUAL(2, fake.opened);
}

TEST(an_interface_that_was_never_there_is_waited_for) {
  fake_step steps[] = {STEP(0, FAKE_REMOVED), STEP(5000, FAKE_BACK), FRAME(6000, 1500), END};
  make(steps);
  expect_nothing_for(WM_NS_PER_S);
  TEST_ASSERT_EQUAL(WM_DEVICE_ABSENT, source->counts.device);
  TEST_ASSERT_NOT_NULL(strstr(source->counts.device_note, "can0 is not there"));
  expect_speed(1.5, 7 * WM_NS_PER_S);
}

TEST(error_frames_say_how_the_controller_is) {
  fake_step steps[] = {FRAME(1, 1500),
                       ERROR_FRAME(10, CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE),
                       FRAME(20, 1501),
                       ERROR_FRAME(30, CAN_ERR_BUSOFF, 0),
                       ERROR_FRAME(500, CAN_ERR_RESTARTED, 0),
                       ERROR_FRAME(510, CAN_ERR_CRTL | 0x200, CAN_ERR_CRTL_RX_OVERFLOW),
                       FRAME(520, 1502),
                       END};
  make(steps);
  expect_speed(1.5, WM_NS_PER_S);
  expect_speed(1.501, WM_NS_PER_S);
  TEST_ASSERT_EQUAL(WM_DEVICE_PASSIVE, source->counts.device);
  expect_nothing_for(300 * WM_NS_PER_MS);
  TEST_ASSERT_EQUAL(WM_DEVICE_BUS_OFF, source->counts.device);
  expect_speed(1.502, WM_NS_PER_S);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
  TEST_ASSERT_EQUAL_UINT64(4, source->counts.bus_errors);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.overflows);
}

TEST(what_the_sockets_queue_lost_is_counted) {
  fake_step steps[] = {FRAME(1, 1500), FRAME(2, 1500), FRAME(3, 1500), END};
  for (int i = 0; i < 3; i++) steps[i].received.has_queue_dropped = 1;
  steps[0].received.queue_dropped = 2;
  steps[1].received.queue_dropped = 2;
  steps[2].received.queue_dropped = 9;
  make(steps);
  for (int i = 0; i < 3; i++) expect_speed(1.5, WM_NS_PER_S);
  TEST_ASSERT_EQUAL_UINT64(9, source->counts.overflows);
}

// The kernel counts with 32 bits.
TEST(the_count_of_what_the_sockets_queue_lost_wraps) {
  fake_step steps[] = {FRAME(1, 1500), FRAME(2, 1500), END};
  for (int i = 0; i < 2; i++) steps[i].received.has_queue_dropped = 1;
  steps[0].received.queue_dropped = UINT32_MAX - 1;
  steps[1].received.queue_dropped = 3;
  make(steps);
  expect_speed(1.5, WM_NS_PER_S);
  TEST_ASSERT_EQUAL_UINT64(UINT32_MAX - 1, source->counts.overflows);
  expect_speed(1.5, WM_NS_PER_S);
  TEST_ASSERT_EQUAL_UINT64(UINT64_C(4294967299), source->counts.overflows);
}

// ── stamps ──────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(without_a_stamp_the_time_of_reading_is_taken) {
  can_clock clock = {0};
  can_received none = {0};
  TEST_ASSERT_EQUAL_INT64(AT(5), can_clock_stamp(&clock, &none, AT(5), AT(5) + FAKE_UTC_NS));
  TEST_ASSERT_EQUAL_INT64(10 * WM_NS_PER_MS, clock.uncertainty_ns);
}

TEST(a_wall_clock_that_is_set_between_stamp_and_reading_does_no_harm) {
  can_clock clock = {0};
  can_received a = fake_frame(AT(1), 0), b = fake_frame(AT(2), 0), c = fake_frame(AT(3), 0);
  TEST_ASSERT_EQUAL_INT64(AT(1), can_clock_stamp(&clock, &a, AT(4), AT(4) + FAKE_UTC_NS));
  const wm_time_ns leap_ns = 3600 * WM_NS_PER_S;  // set forwards after b was stamped
  TEST_ASSERT_EQUAL_INT64(AT(2), can_clock_stamp(&clock, &b, AT(5), AT(5) + FAKE_UTC_NS + leap_ns));
  c.software_ns += leap_ns;  // stamped by the new time
  TEST_ASSERT_EQUAL_INT64(AT(3), can_clock_stamp(&clock, &c, AT(6), AT(6) + FAKE_UTC_NS + leap_ns));
  TEST_ASSERT_EQUAL_UINT64(0, clock.implausible);
}

// The two clocks are read one after the other.
TEST(a_stamp_that_is_slightly_in_the_future_is_now) {
  can_clock clock = {0};
  can_received soon = fake_frame(AT(7) + WM_NS_PER_MS / 2, 0), later = fake_frame(AT(9), 0);
  TEST_ASSERT_EQUAL_INT64(AT(7), can_clock_stamp(&clock, &soon, AT(7), AT(7) + FAKE_UTC_NS));
  TEST_ASSERT_EQUAL_INT64(250 * WM_NS_PER_US, clock.uncertainty_ns);
  TEST_ASSERT_EQUAL_UINT64(0, clock.implausible);
  TEST_ASSERT_EQUAL_INT64(AT(8),
                          can_clock_stamp(&clock, &later, AT(8), AT(8) + FAKE_UTC_NS));  // by a whole millisecond
  TEST_ASSERT_EQUAL_UINT64(1, clock.implausible);
}

TEST(an_absurd_stamp_is_not_believed) {
  can_clock clock = {0};
  can_received absurd = {.software_ns = 12345};
  TEST_ASSERT_EQUAL_INT64(AT(7), can_clock_stamp(&clock, &absurd, AT(7), AT(7) + FAKE_UTC_NS));
  TEST_ASSERT_EQUAL_UINT64(1, clock.implausible);
}

// An adapter of 40 ppm whose frames reach the kernel 0.1 to 3 ms late, a long stall, and a restart of its clock.
TEST(an_adapters_own_clock_is_followed) {
  can_clock clock = {0};
  wm_time_ns worst_ns = 0, boot_ns = 77 * WM_NS_PER_S;
  uint32_t dice = 1;
  for (int i = 0; i < 60000; i++) {
    wm_time_ns true_ns = AT(10 * i);
    dice = dice * 1664525u + 1013904223u;
    wm_time_ns late_ns = 100 * WM_NS_PER_US + (wm_time_ns)(dice >> 12) % (3 * WM_NS_PER_MS);
    if (i == 20000) late_ns = 300 * WM_NS_PER_MS;
    if (i == 40000) boot_ns = 0;  // the adapter began anew
    can_received r = fake_frame(true_ns + late_ns, 0);
    r.hardware_ns = boot_ns + (true_ns - FAKE_BOOT_NS) + (true_ns - FAKE_BOOT_NS) / 25000;
    wm_time_ns now_ns = true_ns + late_ns + WM_NS_PER_MS;
    wm_time_ns off_ns = can_clock_stamp(&clock, &r, now_ns, now_ns + FAKE_UTC_NS) - true_ns;
    int settled = (i > 100 && i < 39990) || i > 40100;
    if (settled && llabs(off_ns) > worst_ns) worst_ns = llabs(off_ns);
  }
  TEST_ASSERT_LESS_OR_EQUAL_INT64(500 * WM_NS_PER_US, worst_ns);
  TEST_ASSERT_EQUAL_UINT64(1, clock.adapter.restarts);
  TEST_ASSERT_LESS_OR_EQUAL_INT64(WM_NS_PER_MS, clock.uncertainty_ns);
}

// A clock of 32 bits in microseconds, as adapters have it, wraps after 71.6 minutes: no frame's stamp is held back.
TEST(an_adapters_clock_of_32_bits_wraps) {
  can_clock clock = {0};
  const wm_time_ns wrap_ns = (INT64_C(1) << 32) * WM_NS_PER_US, period_ns = 10 * WM_NS_PER_MS;
  for (int i = 0; i < 2000; i++) {
    const wm_time_ns true_ns = AT(10 * i), now_ns = true_ns + WM_NS_PER_MS;
    can_received r = fake_frame(true_ns + 200 * WM_NS_PER_US, 0);
    r.hardware_ns = (wrap_ns - 1000 * period_ns + i * period_ns + WM_NS_PER_MS) % wrap_ns;
    const wm_time_ns late_ns = true_ns - can_clock_stamp(&clock, &r, now_ns, now_ns + FAKE_UTC_NS);
    TEST_ASSERT_INT64_WITHIN(WM_NS_PER_MS, 0, late_ns);
  }
  TEST_ASSERT_EQUAL_UINT64(0, clock.adapter.restarts);
}

// ── what the kernel hands out ───────────────────────────────────────────────────────────────────────────────────────

TEST(a_message_of_the_kernel_is_read_with_its_stamps) {
  struct canfd_frame raw = {.can_id = 0x12345678u | CAN_EFF_FLAG, .len = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  _Alignas(struct cmsghdr) char beside[256] = {0};
  struct iovec io = {&raw, sizeof raw};
  struct msghdr message = {.msg_iov = &io, .msg_iovlen = 1, .msg_control = beside, .msg_controllen = sizeof beside};
  struct cmsghdr *c = CMSG_FIRSTHDR(&message);
  struct scm_timestamping stamps = {.ts = {{1700000000, 5}, {0, 0}, {12, 7}}};
  *c = (struct cmsghdr){.cmsg_len = CMSG_LEN(sizeof stamps), .cmsg_level = SOL_SOCKET, .cmsg_type = SO_TIMESTAMPING};
  memcpy(CMSG_DATA(c), &stamps, sizeof stamps);
  c = CMSG_NXTHDR(&message, c);
  uint32_t dropped = 42;
  *c = (struct cmsghdr){.cmsg_len = CMSG_LEN(sizeof dropped), .cmsg_level = SOL_SOCKET, .cmsg_type = SO_RXQ_OVFL};
  memcpy(CMSG_DATA(c), &dropped, sizeof dropped);
  message.msg_controllen = CMSG_SPACE(sizeof stamps) + CMSG_SPACE(sizeof dropped);

  can_received got;
  TEST_ASSERT_TRUE(can_message_read(&message, CAN_MTU, &got));
  TEST_ASSERT_EQUAL_HEX32(0x12345678u, got.frame.id);
  TEST_ASSERT_TRUE(got.frame.is_extended && !got.frame.is_fd && !got.frame.is_error);
  TEST_ASSERT_EQUAL(8, got.frame.length);
  TEST_ASSERT_EQUAL_HEX8(8, got.frame.data[7]);
  TEST_ASSERT_EQUAL_INT64(1700000000 * WM_NS_PER_S + 5, got.software_ns);
  TEST_ASSERT_EQUAL_INT64(12 * WM_NS_PER_S + 7, got.hardware_ns);
  TEST_ASSERT_EQUAL_UINT32(42, got.queue_dropped);

  raw.len = 64;
  raw.flags = CANFD_BRS;
  raw.data[63] = 9;
  TEST_ASSERT_TRUE(can_message_read(&message, CANFD_MTU, &got));
  TEST_ASSERT_EQUAL(64, got.frame.length);
  TEST_ASSERT_EQUAL_HEX8(9, got.frame.data[63]);
  TEST_ASSERT_TRUE(got.frame.is_fd);
  raw.len = 255;  // whatever a driver says
  TEST_ASSERT_TRUE(can_message_read(&message, CAN_MTU, &got));
  TEST_ASSERT_EQUAL(8, got.frame.length);
  TEST_ASSERT_FALSE(can_message_read(&message, 3, &got));
}
