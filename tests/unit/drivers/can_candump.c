// SPDX-License-Identifier: Apache-2.0
// candump's log lines: each form, exact times, and the limits.
#include "common/suite.h"
#include "waymark/can.h"

static wm_can_frame frame;
static wm_error err;

static wm_status parse(const char *line) {
  err.text[0] = '\0';
  return wm_candump_parse(line, strlen(line), &frame, &err);
}

static void good(const char *line) { TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse(line), err.text); }

static void expect(const char *line, uint32_t id, int extended, int remote, int error, int fd, int length) {
  good(line);
  TEST_ASSERT_EQUAL_HEX32_MESSAGE(id, frame.id, line);
  TEST_ASSERT_EQUAL_MESSAGE(extended, frame.is_extended, line);
  TEST_ASSERT_EQUAL_MESSAGE(remote, frame.is_remote, line);
  TEST_ASSERT_EQUAL_MESSAGE(error, frame.is_error, line);
  TEST_ASSERT_EQUAL_MESSAGE(fd, frame.is_fd, line);
  TEST_ASSERT_EQUAL_MESSAGE(length, frame.length, line);
}

TEST(forms) {
  //                                                          id        ext rem err fd length
  expect("(1700000000.000000) can0 123#", 0x123, 0, 0, 0, 0, 0);
  expect("(1700000000.000100) can0 123#00", 0x123, 0, 0, 0, 0, 1);
  expect("(1700000000.000200) can0 7FF#0011223344556677\n", 0x7FF, 0, 0, 0, 0, 8);
  expect("(1700000000.000300) can0 12345678#DEADBEEF\r\n", 0x12345678, 1, 0, 0, 0, 4);
  expect("(1700000000.000400) can0 00000123#deadbeef", 0x123, 1, 0, 0, 0, 4);
  expect("(1700000000.000500) can0 123#R", 0x123, 0, 1, 0, 0, 0);
  expect("(1700000000.000600) can0 123#R8", 0x123, 0, 1, 0, 0, 8);
  expect("(2.520002) can2 200#R T", 0x200, 0, 1, 0, 0, 0);
  expect("(2.520002) can2 200#R3 R", 0x200, 0, 1, 0, 0, 3);
  expect("(1700000000.000800) can0 123##0", 0x123, 0, 0, 0, 1, 0);
  expect("(1700000000.000900) can0 123##1DEADBEEF", 0x123, 0, 0, 0, 1, 4);
  expect("(1700000000.001200) can0 20000004#0004000000000000", 0x4, 0, 0, 1, 0, 8);
  expect("(30.806898) can4 20000080##0", 0x80, 0, 0, 1, 1, 0);
  expect("(1700000000.001500) can0 123#1122334455667788_9", 0x123, 0, 0, 0, 0, 8);
  expect("(1700000000.001500) can0 123#R8_F", 0x123, 0, 1, 0, 0, 8);
  expect("(1700000000.001600) can0 123#DEADBEEF R", 0x123, 0, 0, 0, 0, 4);
  expect("(1700000000.001700)    can0  1FFFFFFF#DE.AD.BE.EF T\n", 0x1FFFFFFF, 1, 0, 0, 0, 4);
  expect("(1594172462.126542) vcan0 064#F001FFFFFFFFFFFFFFFF", 0x64, 0, 0, 0, 1, 10);
  expect("(1.0) abcdefghijklmno 123#00", 0x123, 0, 0, 0, 0, 1);
  expect("(1.0) received_messages 123#00", 0x123, 0, 0, 0, 0, 1);
  expect("(1.0) /dev/serial/by-id/usb-Adapter_0123456789-if00 123#00", 0x123, 0, 0, 0, 0, 1);
}

TEST(the_screen_with_a_time) {
  expect(" (1700000000.000000)  can0  123   [2]  11 22", 0x123, 0, 0, 0, 0, 2);
  TEST_ASSERT_EQUAL_HEX8(0x22, frame.data[1]);
  TEST_ASSERT_EQUAL_INT64(INT64_C(1700000000000000000), frame.t_ns);
  expect(" (2024-01-01 12:00:00.123456)  can0       123   [0]", 0x123, 0, 0, 0, 0, 0);
  TEST_ASSERT_EQUAL_INT64(INT64_C(1704110400123456000), frame.t_ns);
  expect(" (1.0)  vcan0  18FEF100   [8]  01 02 03 04 05 06 07 FF   '........'", 0x18FEF100, 1, 0, 0, 0, 8);
  TEST_ASSERT_EQUAL_HEX8(0xFF, frame.data[7]);
  expect(" (1.0)  can0  RX - -  123   [1]  7F", 0x123, 0, 0, 0, 0, 1);
  expect(" (1.0)  can0  TX B E  123  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B", 0x123, 0, 0, 0, 1, 12);
  expect(" (1.0)  can0  123  [02]  00 01", 0x123, 0, 0, 0, 1, 2);
  expect(" (1.0)  can0  123   [8]  remote request", 0x123, 0, 1, 0, 0, 8);
  expect(" (1.0)  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME", 0x4, 0, 0, 1, 0, 8);
}

TEST(contents) {
  good("(30.005041) vcan1 1C4D80A7##B12C20304 T");
  TEST_ASSERT_EQUAL_STRING("vcan1", frame.iface);
  TEST_ASSERT_EQUAL_HEX8(0xB, frame.fd_flags);
  const uint8_t data[4] = {0x12, 0xC2, 0x03, 0x04};
  TEST_ASSERT_EQUAL_HEX8_ARRAY(data, frame.data, 4);
  char line[256] = "(1.5) can0 123##0";
  for (int i = 0; i < 64; i++) (void)snprintf(line + strlen(line), sizeof line - strlen(line), "%02X", i);
  good(line);
  TEST_ASSERT_EQUAL(64, frame.length);
  for (int i = 0; i < 64; i++) TEST_ASSERT_EQUAL_HEX8(i, frame.data[i]);
  (void)snprintf(line + strlen(line), sizeof line - strlen(line), "00");
  TEST_ASSERT_EQUAL(WM_BAD_DATA, parse(line));
}

TEST(times_are_exact) {
  static const struct {
    const char *line;
    int64_t t_ns;
  } cases[] = {
      {"(1579857014.345944) c 1FF#", INT64_C(1579857014345944000)},
      {"(0.1) c 1FF#", INT64_C(100000000)},
      {"(2020-12-19 12:04:45.485261) c 1FF#", INT64_C(1608379485485261000)},
      {"(2000-02-29 00:00:00.000001) c 1FF#", INT64_C(951782400000001000)},
      {"(1970-01-01 00:00:01.5) c 1FF#", INT64_C(1500000000)},
      {"(2100-03-01 00:00:00) c 1FF#", INT64_C(4107542400000000000)},
      {"(1.000001) c 1FF#", INT64_C(1000001000)},
      {"(1752918539.123456789) c 1FF#", INT64_C(1752918539123456789)},
      {"(7) c 1FF#", INT64_C(7000000000)},
      {"(0000000000.000000) c 1FF#", 0},
      {"(-0.100000) c 1FF#", INT64_C(-100000000)},
      {"(9223372035.999999999) c 1FF#", INT64_C(9223372035999999999)},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    good(cases[i].line);
    TEST_ASSERT_EQUAL_INT64_MESSAGE(cases[i].t_ns, frame.t_ns, cases[i].line);
  }
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, parse("(9223372036.0) c 1FF#"));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, parse("(99999999999999999999999999.0) c 1FF#"));
}

TEST(nothing_there) {
  TEST_ASSERT_EQUAL(WM_AGAIN, parse(""));
  TEST_ASSERT_EQUAL(WM_AGAIN, parse(" \t\r\n"));
  TEST_ASSERT_EQUAL(WM_AGAIN, parse("# recorded on the red robot"));
}

// Whatever is cut off, the parser says so and reads nothing behind the end: each prefix in a block of its own.
TEST(every_prefix) {
  const char *whole = "(1700000000.001500) can0 12345678##1122334455667788 T";
  for (size_t n = 0; n <= strlen(whole); n++) {
    char *prefix = malloc(n + 1);
    memcpy(prefix, whole, n);
    wm_status status = wm_candump_parse(prefix, n, &frame, &err);
    free(prefix);
    TEST_ASSERT_TRUE(status == WM_OK || status == WM_AGAIN || status == WM_BAD_DATA);
    if (n < strlen("(1700000000.001500) can0 12345678#")) TEST_ASSERT_NOT_EQUAL(WM_OK, status);
  }
}
