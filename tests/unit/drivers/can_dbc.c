// SPDX-License-Identifier: Apache-2.0
// DBC files as they come: what is passed over, what is read across it, and that parts of a file never crash the reader.
#include "common/suite.h"
#include "dbc.h"

static wm_dbc *dbc;
static wm_error err;

void tearDown(void) {
  wm_dbc_free(dbc);
  dbc = NULL;
}

static void load(const char *source) {
  tearDown();
  err.text[0] = '\0';
  wm_status status = wm_dbc_parse(source, strlen(source), "car.dbc", &dbc, &err);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
}

static const dbc_signal *signal_of(uint32_t id, int is_extended, const char *name) {
  const dbc_message *m = wm_dbc_find(dbc, dbc_key(id, is_extended));
  TEST_ASSERT_NOT_NULL(m);
  const dbc_signal *s = wm_dbc_find_signal(dbc, m, text_of(name));
  TEST_ASSERT_NOT_NULL_MESSAGE(s, name);
  return s;
}

// Every section that Waymark has no use for, with the traps in it: quotes, line ends and keywords inside of strings, a
// semicolon too many and one too few, blanks where others have none, Windows' line ends, both encodings.
static const char kOdd[] =
    "\xEF\xBB\xBFVERSION \"a \\\"b\\\" // no comment\"\r\n"
    "NS_ :\r\n\tCM_\r\n\tBA_\r\n\tSG_MUL_VAL_\r\n"
    "BS_:\r\n"
    "BU_: ESP GATEWAY\r\n"
    "VAL_TABLE_ Gears 1 \"BO_ 7 X: 8 Y\" 0 \"no\" ;\r\n"
    "// BO_ 99 COMMENT: 8 X\r\n"
    "BO_ 291 WHEELS:8 ESP\r\n"
    " SG_ SPEED: 0|16@1+ (1E-02,-1.5e+1) [0|655.35] \"km/h\"  GATEWAY,ESP\r\n"
    "SG_   TEMPERATURE  :  16 | 8 @ 1- ( 1 , 0 ) [ -40 | 85 ] \"\xB0"
    "C\" Vector__XXX\r\n"
    "\r\n"
    "BO_ 2566831872 J1939: 8 Vector__XXX\r\n"
    " SG_ SHORT_NAME : 7|8@0+ (1,0) [0|0] \"\xC2\xB0/s\" Vector__XXX\r\n"
    "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\r\n"
    " SG_ FLOATING : 0|16@1+ (1,0) [0|0] \"\" Vector__XXX\r\n"
    "BO_TX_BU_ 291 : ESP,GATEWAY;\r\n"
    "EV_ Variable: 0 [0|0] \"\" 0 1 DUMMY_NODE_VECTOR0 Vector__XXX;;\r\n"
    "CM_ \"two\r\nBO_ 291 lines: 8 X\r\n SG_ \\\"in\\\" one; comment\";\r\n"
    "CM_ SG_ 291 SPEED \"no semicolon\"\r\n"
    "BA_DEF_ BO_  \"GenMsgSendType\" ENUM  \"cyclic\",\"IfActive\";\r\n"
    "BA_DEF_DEF_  \"GenMsgSendType\" \"cyclic\";\r\n"
    "BA_ \"SystemSignalLongSymbol\" SG_ 2566831872 SHORT_NAME \"A_NAME_OF_MORE_THAN_THIRTY_TWO_LETTERS\";\r\n"
    "BA_ \"SystemMessageLongSymbol\" BO_ 2566831872 \"A_MESSAGE_OF_MORE_THAN_THIRTY_TWO_LETTERS\";\r\n"
    "SIG_GROUP_ 291 Group 1 : SPEED TEMPERATURE;\r\n"
    "VAL_ Variable 0 \"an environment variable\" ;\r\n"
    "VAL_ 291 SPEED 65535 \"SNA\" -1 \"minus\" 2.0 \"two\" 2.5 \"between\" ;\r\n"
    "VAL_ 291 NOBODY 0 \"x\" ;\r\n"
    "VAL_ 4711 NOBODY 0 \"x\" ;\r\n"
    "SIG_VALTYPE_ 4711 NOBODY : 1;\r\n"
    "MADE_UP_SECTION_ 1 2 \"3\" ;";

TEST(odd_but_right) {
  load(kOdd);
  TEST_ASSERT_EQUAL_size_t(2, dbc->message_count);
  TEST_ASSERT_EQUAL_size_t(3, dbc->signal_count);
  const dbc_signal *speed = signal_of(291, 0, "SPEED");
  TEST_ASSERT_EQUAL_DOUBLE(0.01, speed->factor);
  TEST_ASSERT_EQUAL_DOUBLE(-15.0, speed->offset);
  TEST_ASSERT_EQUAL(11, speed->line);
  TEST_ASSERT_EQUAL_UINT(3, speed->value_count);
  TEST_ASSERT_EQUAL_INT64(-1, dbc->values[speed->first_value + 1].raw);
  const dbc_signal *temperature = signal_of(291, 0, "TEMPERATURE");
  TEST_ASSERT_EQUAL_UINT(2, temperature->unit.length);
  TEST_ASSERT_EQUAL(SIGNAL_SIGNED, temperature->bits.kind);
  const dbc_signal *renamed = signal_of(0x18FEBF00, 1, "SHORT_NAME");
  TEST_ASSERT_TRUE(text_is(renamed->long_name, "A_NAME_OF_MORE_THAN_THIRTY_TWO_LETTERS"));
}

// With CR alone as line end, and with LF alone: the same content, in the same lines.
TEST(line_ends_of_other_editors) {
  static const char kEnds[] = {'\r', '\n'};
  for (size_t k = 0; k < sizeof kEnds; k++) {
    char text[sizeof kOdd];
    size_t n = 0;
    for (const char *c = kOdd; *c; c++)
      if (*c != '\r') text[n++] = *c == '\n' ? kEnds[k] : *c;
    text[n] = '\0';
    load(text);
    TEST_ASSERT_EQUAL_size_t(2, dbc->message_count);
    TEST_ASSERT_EQUAL_size_t(3, dbc->signal_count);
    TEST_ASSERT_EQUAL(11, signal_of(291, 0, "SPEED")->line);
  }
}

// An attribute without a message's number, or with one that is too large, names no message.
TEST(long_names_of_no_message) {
  load("BO_ 0 M: 8 X\nBA_ \"SystemMessageLongSymbol\" BO_ \"WITHOUT_A_NUMBER\";\n");
  TEST_ASSERT_EQUAL_size_t(0, wm_dbc_find(dbc, dbc_key(0, 0))->long_name.length);
  load("BO_ 1 M: 8 X\nBA_ \"SystemMessageLongSymbol\" BO_ 4294967297 \"2_TO_THE_32_AND_1\";\n");
  TEST_ASSERT_EQUAL_size_t(0, wm_dbc_find(dbc, dbc_key(1, 0))->long_name.length);
}

// A list of new symbols without a name, before the first message.
TEST(a_message_right_behind_an_empty_list) {
  load("NS_ :\nBO_ 291 WHEELS: 8 ESP\n SG_ SPEED : 0|16@1+ (1,0) [0|0] \"\" X\n");
  TEST_ASSERT_NOT_NULL(wm_dbc_find(dbc, dbc_key(291, 0)));
}

TEST(nothing_in_it) {
  load("");
  TEST_ASSERT_EQUAL_size_t(0, dbc->message_count);
  load("VERSION \"\"\n\nBO_ 1 EMPTY: 0");
  TEST_ASSERT_EQUAL_size_t(1, dbc->message_count);
}

TEST(overlapping_signals_are_makers_wish) {
  load("BO_ 1 M: 2 X\n SG_ A : 0|16@1+ (1,0) [0|0] \"\" X\n SG_ B : 4|8@1+ (1,0) [0|0] \"\" X\n");
  TEST_ASSERT_EQUAL_size_t(2, dbc->signal_count);
}

// A factor is one whole number that a double holds.
TEST(factors_that_are_no_numbers) {
  static const char *const kFactors[] = {"1e999", "-1e999", "1-2", "1.2.3", "1e5e5", "e", "."};
  for (size_t i = 0; i < sizeof kFactors / sizeof kFactors[0]; i++) {
    char text[120];
    (void)snprintf(text, sizeof text, "BO_ 1 M: 8 X\n SG_ A : 0|8@1+ (%s,0) [0|0] \"\" X\n", kFactors[i]);
    TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, wm_dbc_parse(text, strlen(text), "car.dbc", &dbc, &err), kFactors[i]);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "car.dbc:2: SG_ A: expected (FACTOR,OFFSET)"), err.text);
  }
}

// Of two lists of a signal's names the last one holds.
TEST(names_that_are_stated_twice) {
  load(
      "BO_ 1 M: 8 X\n SG_ A : 0|8@1+ (1,0) [0|0] \"\" X\n"
      "VAL_ 1 A 0 \"off\" 1 \"on\" 2 \"error\";\nVAL_ 1 A 7 \"seven\" 8 \"eight\";\n");
  const dbc_signal *a = signal_of(1, 0, "A");
  TEST_ASSERT_EQUAL_UINT(2, a->value_count);
  TEST_ASSERT_EQUAL_INT64(7, dbc->values[a->first_value].raw);
  TEST_ASSERT_EQUAL_INT64(8, dbc->values[a->first_value + 1].raw);
}

TEST(multiplexers_in_a_ring) {
  load(
      "BO_ 1 M: 8 X\n SG_ A m1M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ B m1M : 8|8@1+ (1,0) [0|0] \"\" X\n"
      "SG_MUL_VAL_ 1 A B 1-1;\nSG_MUL_VAL_ 1 B A 1-1;\n");
  uint32_t above[DBC_SELECTORS_MAX];
  TEST_ASSERT_EQUAL(-1, wm_dbc_selectors(dbc, signal_of(1, 0, "A"), above));
}

TEST(not_text) {
  const char utf16[] = "V\0E\0R\0S\0";
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_dbc_parse(utf16, sizeof utf16, "car.dbc", &dbc, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "car.dbc: holds zero bytes"));
  TEST_ASSERT_NULL(dbc);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_dbc_load("no/such/car.dbc", &dbc, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "no/such/car.dbc: cannot be opened"));
}

// Cut anywhere, in a block of its own, the text is read or refused with a line in it, and nothing behind its end is
// touched (the sanitizers look).
TEST(every_prefix) {
  size_t whole = strlen(kOdd);
  for (size_t n = 0; n <= whole; n++) {
    tearDown();
    char *part = malloc(n + 1);
    memcpy(part, kOdd, n);
    wm_status status = wm_dbc_parse(part, n, "car.dbc", &dbc, &err);
    free(part);
    TEST_ASSERT_TRUE(status == WM_OK || status == WM_BAD_CONFIG);
    TEST_ASSERT_EQUAL(status == WM_OK, dbc != NULL);
    if (status != WM_OK) TEST_ASSERT_EQUAL(0, strncmp(err.text, "car.dbc:", 8));
  }
}

// How many letters two names differ by, from both sides alike; names that are too long to compare are beyond any limit.
TEST(distances_of_names_are_the_same_from_both_sides) {
  char name[80];
  memset(name, 'n', sizeof name);
  for (size_t n = 2; n < sizeof name; n++) {
    const wm_text whole = {name, n}, shorter = {name + 1, n - 1};
    const size_t apart = wm_text_distance(whole, shorter, 5);
    TEST_ASSERT_EQUAL_size_t(apart, wm_text_distance(shorter, whole, 5));
    if (n <= 32) TEST_ASSERT_EQUAL_size_t(1, apart);  // a DBC's names have 32 letters at most
  }
  TEST_ASSERT_EQUAL_size_t(2, wm_text_distance(text_of("speed_lf"), text_of("SPEED_FL"), 5));
  TEST_ASSERT_EQUAL_size_t(2, wm_text_distance(text_of("SPEED_FL"), text_of("speed_lf"), 1));  // one beyond the limit
}
