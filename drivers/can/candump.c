// SPDX-License-Identifier: Apache-2.0
// One line of `candump -l`, also as `candump -L`, python-can and canplayer write and read it:
//
//   (2026-01-31 07:05:09.000001) can0 123#    by `candump -L -tA`: local time, taken as UTC
//   (1.000001) can0 123#                      classic, no data; three digits are an 11-bit id
//   (1.000001) can0 12345678#DEADBEEF         classic; eight digits are a 29-bit id
//   (1.000001) can0 123#1122334455667788_9    classic with the raw DLC 9; it still carries 8 bytes
//   (1.000001) can0 123#R                     remote; 123#R8 asks for 8 bytes
//   (1.000001) can0 123##1DEADBEEF            CAN FD with the flags 1
//   (1.000001) can0 123#112233445566778899    more than 8 bytes: CAN FD, by a writer without ##
//   (1.000001) can0 20000080#0000000000000000 error frame: bit 29 of the eight digits
//   (1.000001) can0 123#DEADBEEF T            with its direction, R or T
//
// and of what candump shows on the screen with a time (-ta, -tz, -td, -tA), also with -x, -e and -a:
//
//   (1.000001)  can0  123   [2]  DE AD        [02]: CAN FD
//   (1.000001)  can0  RX - -  12345678   [8]  11 22 33 44 55 66 77 88   '.."3DUfw'
//   (1.000001)  can0  123   [8]  remote request
#include "text.h"
#include "waymark/can.h"

enum { kClassicMax = 8, kFractionDigits = 9 };
static const uint32_t kErrorFlag = 0x20000000u, kExtendedMask = 0x1FFFFFFFu, kStandardMask = 0x7FFu;

typedef struct cursor {
  const char *at, *end;
} cursor;

static int peek(const cursor *in) { return in->at < in->end ? (unsigned char)*in->at : -1; }
static int is_blank(int c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
static int is_digit(int c) { return c >= '0' && c <= '9'; }

static void skip_blanks(cursor *in) {
  while (is_blank(peek(in))) in->at++;
}

static wm_text next_word(cursor *in) {
  skip_blanks(in);
  const char *from = in->at;
  while (in->at < in->end && !is_blank(peek(in))) in->at++;
  return (wm_text){from, (size_t)(in->at - from)};
}

static int hex_value(int c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

// Days from 1970-01-01 to a date of the Gregorian calendar. A year begins with March, so that a leap day is its last;
// 400 years have 146097 days, and 719468 days lie between 0000-03-01 and 1970-01-01.
static int64_t days_to(int year, int month, int day) {
  const int64_t y = month > 2 ? year : year - 1, era = y / 400, of_era = y % 400;
  const int64_t of_year = (153 * (month > 2 ? month - 3 : month + 9) + 2) / 5 + day - 1;
  return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

// `count` digits as a number; -1 where there are others.
static int fixed_digits(cursor *in, int count) {
  int value = 0;
  for (; count > 0 && is_digit(peek(in)); count--) value = value * 10 + (*in->at++ - '0');
  return count == 0 ? value : -1;
}

static int passed(cursor *in, char mark) { return peek(in) == mark && in->at++ != NULL; }

// "2020-12-19 12:04:45" as seconds since 1970, as if it were UTC; 0 where there is none.
static int take_date(cursor *in, uint64_t *seconds) {
  cursor at = *in;
  const int year = fixed_digits(&at, 4), month = passed(&at, '-') ? fixed_digits(&at, 2) : -1;
  const int day = passed(&at, '-') ? fixed_digits(&at, 2) : -1;
  const int hour = passed(&at, ' ') || passed(&at, 'T') ? fixed_digits(&at, 2) : -1;
  const int minute = passed(&at, ':') ? fixed_digits(&at, 2) : -1,
            second = passed(&at, ':') ? fixed_digits(&at, 2) : -1;
  if (year < 1970 || year > 2200 || month < 1 || month > 12 || day < 1 || day > 31) return 0;
  if (hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60) return 0;
  *seconds = (uint64_t)(days_to(year, month, day) * 86400 + hour * 3600 + minute * 60 + second);
  *in = at;
  return 1;
}

// How logs of other programs begin. Those that python-can reads become candump's by its logconvert.
#define CONVERTS "`python -m can.logconvert LOG can.log` makes one of it (python-can)"
static const struct {
  const char *begin, *is;
} kOthers[] = {
    {"date ", "a log of Vector (ASC); " CONVERTS},
    {"LOGG", "a log of Vector (BLF); " CONVERTS},
    {"base ", "a log of Vector (ASC); " CONVERTS},
    {"// ", "a log of Vector (ASC); " CONVERTS},
    {";", "a trace of PEAK (TRC) or another program's; " CONVERTS},
    {"***BUSMASTER", "a log of BUSMASTER: save it there as ASC, and " CONVERTS},
    {"Kvaser", "a log of Kvaser: save it there as ASC, and " CONVERTS},
    {"version https://git-lfs", "a pointer of Git LFS: `git lfs pull` fetches the file that it stands for"},
    {"<", "a web page or XML: did the download go wrong?"},
    {"MDF ", "a measurement in ASAM's MDF; " CONVERTS},
    {"timestamp,", "a table of python-can; " CONVERTS},
    {"Time Stamp,", "a table of SavvyCAN: save it there as candump's log"},
    {"\xFF\xFE", "in UTF-16, as a PowerShell's `>` writes: write it by `candump -l any`, or save it in UTF-8"},
};

static wm_status no_time(const cursor *in, wm_error *err) {
  for (size_t i = 0; i < sizeof kOthers / sizeof *kOthers; i++) {
    const size_t length = strlen(kOthers[i].begin);
    if ((size_t)(in->end - in->at) >= length && memcmp(in->at, kOthers[i].begin, length) == 0)
      return wm_fail(err, WM_BAD_DATA, "this is no log of candump, but %s", kOthers[i].is);
  }
  return wm_fail(err, WM_BAD_DATA, "a line begins with its time, (SECONDS.MICROS)");
}

// "(SECONDS[.FRACTION])" or "(DATE TIME[.FRACTION])" into nanoseconds, exactly: no floating point.
static wm_status parse_time(cursor *in, wm_time_ns *out, wm_error *err) {
  if (peek(in) != '(') return no_time(in, err);
  in->at++;
  const char *from = in->at;
  const char *close = memchr(in->at, ')', (size_t)(in->end - in->at));
  if (!close) return wm_fail(err, WM_BAD_DATA, "the time's closing bracket is missing: (SECONDS.MICROS)");
  shown whole = wm_text_shown((wm_text){from, (size_t)(close - from)});
  int negative = peek(in) == '-';
  if (negative) in->at++;
  uint64_t seconds = 0, nanos = 0;
  const uint64_t most = (uint64_t)(INT64_MAX / WM_NS_PER_S) - 1;
  const int is_date = !negative && take_date(in, &seconds);
  int digits = is_date;
  for (; !is_date && is_digit(peek(in)); in->at++, digits++) {
    seconds = seconds * 10 + (uint64_t)(*in->at - '0');
    if (seconds > most)
      return wm_fail(err, WM_OUT_OF_RANGE, "time (%s) does not fit into 64-bit nanoseconds (292 years)", whole.text);
  }
  if (digits == 0) return wm_fail(err, WM_BAD_DATA, "time (%s) is not (SECONDS.MICROS)", whole.text);
  if (peek(in) == '.') {
    in->at++;
    uint64_t unit = (uint64_t)WM_NS_PER_S;
    for (digits = 0; is_digit(peek(in)); in->at++, digits++) {
      unit /= 10;
      nanos += unit * (uint64_t)(*in->at - '0');
    }
    if (digits == 0 || digits > kFractionDigits)
      return wm_fail(err, WM_BAD_DATA, "time (%s) needs 1 to 9 digits behind its point", whole.text);
  }
  if (in->at != close) return wm_fail(err, WM_BAD_DATA, "time (%s) is not (SECONDS.MICROS)", whole.text);
  in->at++;
  wm_time_ns t_ns = (wm_time_ns)(seconds * (uint64_t)WM_NS_PER_S + nanos);
  *out = negative ? -t_ns : t_ns;
  return WM_OK;
}

// Whether "   [LENGTH]" follows: the screen's form.
static int is_screen(const cursor *in) {
  cursor rest = *in;
  skip_blanks(&rest);
  return rest.at > in->at && peek(&rest) == '[';
}

static wm_status parse_id(cursor *in, wm_can_frame *out, wm_error *err) {
  const char *from = in->at;
  uint64_t id = 0;
  size_t digits = 0;
  for (int v; (v = hex_value(peek(in))) >= 0 && digits <= 8; in->at++, digits++) id = id * 16 + (uint64_t)v;
  shown whole = wm_text_shown((wm_text){from, (size_t)(in->at - from)});
  if (peek(in) != '#' && !(digits > 0 && is_screen(in))) {
    return wm_fail(err, WM_BAD_DATA, "after the interface comes ID#DATA; there is no # behind '%s'",
                   wm_text_shown((wm_text){from, (size_t)(in->end - from)}).text);
  }
  if (digits == 5) return wm_fail(err, WM_UNSUPPORTED, "id %s: CAN XL frames are not taken", whole.text);
  if (digits != 3 && digits != 8)
    return wm_fail(err, WM_BAD_DATA, "id '%s' has %zu digits; 3 are an 11-bit id, 8 a 29-bit one", whole.text, digits);
  out->is_extended = digits == 8;
  out->is_error = digits == 8 && (id & kErrorFlag);
  if (out->is_error) {
    out->is_extended = 0;
    id &= ~(uint64_t)kErrorFlag;
  }
  if (id > (digits == 8 ? kExtendedMask : kStandardMask))
    return wm_fail(err, WM_OUT_OF_RANGE, "id %s is above %s", whole.text, digits == 8 ? "1FFFFFFF" : "7FF");
  out->id = (uint32_t)id;
  return WM_OK;
}

// Two hex digits a byte, a dot between bytes allowed.
static wm_status parse_bytes(cursor *in, wm_can_frame *out, wm_error *err) {
  while (hex_value(peek(in)) >= 0 || (peek(in) == '.' && out->length > 0)) {
    if (peek(in) == '.') in->at++;
    int high = hex_value(peek(in));
    if (high >= 0) in->at++;
    int low = hex_value(peek(in));
    if (high < 0 || low < 0)
      return wm_fail(err, WM_BAD_DATA, "id %X: byte %u has no second hex digit", out->id, out->length);
    in->at++;
    if (out->length == WM_CAN_DATA_MAX)
      return wm_fail(err, WM_BAD_DATA, "id %X: more than %d bytes; CAN FD has no longer frames", out->id,
                     WM_CAN_DATA_MAX);
    out->data[out->length++] = (uint8_t)(high * 16 + low);
  }
  return WM_OK;
}

static wm_status parse_payload(cursor *in, wm_can_frame *out, wm_error *err) {
  in->at++;  // '#'
  if (peek(in) == '#') {
    in->at++;
    int flags = hex_value(peek(in));
    if (flags < 0) return wm_fail(err, WM_BAD_DATA, "id %X: behind ## comes one hex digit of CAN FD flags", out->id);
    in->at++;
    out->is_fd = 1;
    out->fd_flags = (uint8_t)flags;
    return parse_bytes(in, out, err);
  }
  if (peek(in) == 'R' || peek(in) == 'r') {
    in->at++;
    out->is_remote = 1;
    if (is_digit(peek(in)) && peek(in) <= '8') out->length = (uint8_t)(*in->at++ - '0');
  } else {
    wm_status status = parse_bytes(in, out, err);
    if (status != WM_OK) return status;
    out->is_fd = out->length > kClassicMax;
  }
  if (peek(in) == '_') {
    in->at++;
    if (hex_value(peek(in)) < 9 || out->length != kClassicMax)
      return wm_fail(err, WM_BAD_DATA, "id %X: a raw DLC _9 to _F is allowed after 8 bytes only", out->id);
    in->at++;
  }
  return WM_OK;
}

// "   [LENGTH]  BYTES", and what candump adds behind them: ERRORFRAME, the bytes as letters.
static wm_status parse_screen(cursor *in, wm_can_frame *out, wm_error *err) {
  skip_blanks(in);
  in->at++;  // '['
  const char *from = in->at;
  unsigned length = 0;
  for (; is_digit(peek(in)) && length <= WM_CAN_DATA_MAX; in->at++) length = length * 10 + (unsigned)(*in->at - '0');
  const size_t digits = (size_t)(in->at - from);
  if (digits < 1 || digits > 2 || length > WM_CAN_DATA_MAX || !passed(in, ']'))
    return wm_fail(err, WM_BAD_DATA, "id %X: [LENGTH] is 0 to %d bytes", out->id, WM_CAN_DATA_MAX);
  out->is_fd = digits == 2;
  cursor rest = *in;
  if (text_is(next_word(&rest), "remote")) {
    out->is_remote = 1;
    out->length = (uint8_t)length;
    in->at = in->end;
    return WM_OK;
  }
  for (wm_text byte; out->length < length;
       out->data[out->length++] = (uint8_t)(hex_value(byte.at[0]) * 16 + hex_value(byte.at[1]))) {
    byte = next_word(in);
    if (byte.length != 2 || hex_value(byte.at[0]) < 0 || hex_value(byte.at[1]) < 0)
      return wm_fail(err, WM_BAD_DATA, "id %X: [%u] says %u bytes, two hex digits each; '%s' is none", out->id, length,
                     length, wm_text_shown(byte).text);
  }
  rest = *in;
  const wm_text more = next_word(&rest);
  if (text_is(more, "ERRORFRAME") || (more.length > 0 && more.at[0] == '\'')) in->at = in->end;
  return WM_OK;
}

// "RX - -" of candump -x, before the id.
static void skip_direction(cursor *in) {
  cursor rest = *in;
  const wm_text direction = next_word(&rest);
  if (!text_is(direction, "RX") && !text_is(direction, "TX")) return;
  for (int i = 0; i < 2; i++) (void)next_word(&rest);
  *in = rest;
  skip_blanks(in);
}

static int is_interface(wm_text name) {
  for (size_t i = 0; i < name.length; i++)
    if (name.at[i] <= ' ' || name.at[i] > '~') return 0;
  return name.length > 0 && name.length < WM_CAN_BUS_MAX;
}

wm_status wm_candump_parse(const char *line, size_t length, wm_can_frame *out, wm_error *err) {
  cursor in = {line, line + length};
  memset(out, 0, sizeof *out);
  skip_blanks(&in);
  if (peek(&in) < 0 || peek(&in) == '#') return WM_AGAIN;

  if (peek(&in) != '(') {  // IFACE ID [LENGTH] BYTES
    cursor rest = in;
    next_word(&rest);
    wm_text id = next_word(&rest);
    skip_blanks(&rest);
    if (id.length > 0 && hex_value((unsigned char)id.at[0]) >= 0 && peek(&rest) == '[')
      return wm_fail(err, WM_BAD_DATA,
                     "this is what candump shows on the screen, without a time; record with `candump -l any`, or "
                     "`candump -L any > can.log`");
  }
  wm_status status = parse_time(&in, &out->t_ns, err);
  if (status != WM_OK) return status;

  wm_text iface = next_word(&in);
  if (!is_interface(iface))
    return wm_fail(err, WM_BAD_DATA, "behind the time comes the interface's name, 1 to %d letters; '%s' is not one",
                   WM_CAN_BUS_MAX - 1, wm_text_shown(iface).text);
  memcpy(out->iface, iface.at, iface.length);

  skip_blanks(&in);
  skip_direction(&in);
  if ((status = parse_id(&in, out, err)) != WM_OK) return status;
  status = peek(&in) == '#' ? parse_payload(&in, out, err) : parse_screen(&in, out, err);
  if (status != WM_OK) return status;

  wm_text direction = in.at < in.end && !is_blank(peek(&in)) ? (wm_text){0} : next_word(&in);
  if (text_is(direction, "R") || text_is(direction, "T")) direction.length = 0;
  skip_blanks(&in);
  if (direction.length > 0 || in.at < in.end) {
    const char *from = direction.length > 0 ? direction.at : in.at;
    return wm_fail(err, WM_BAD_DATA, "id %X: unexpected '%s' behind the data", out->id,
                   wm_text_shown((wm_text){from, (size_t)(in.end - from)}).text);
  }
  return WM_OK;
}
