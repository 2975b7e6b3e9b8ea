// SPDX-License-Identifier: Apache-2.0
// Which frames are of a message: J1939 by its PGN, one sender of several, and what is said of messages that never come.
#include "common/suite.h"

#include "can_fixture.h"

static fixture f;
static wm_can_survey *survey;
static char text[512];

void setUp(void) { survey = calloc(1, sizeof *survey); }
void tearDown(void) {
  free(survey);
  close_it(&f);
}

#define TWIN "BO_ 1 CCVS1: 8 X\n SG_ V : 0|16@1+ (1,0) [0|0] \"m/s\" X\n"

TEST(of_two_messages_of_one_id_the_first_is_taken_and_named) {
  static const struct {
    const char *more, *note;
  } cases[] = {
      {TWIN, ""},  // the same again
      {"BO_ 1 CCVS1: 8 X\n SG_ V : 16|16@1+ (1,0) [0|0] \"m/s\" X\n",
       "car.dbc:3: BO_ CCVS1 has the id 0x1 of CCVS1 in line 1, which is taken; remove one of them"},
      {"BO_ 1 OTHER: 8 X\n SG_ V : 0|16@1+ (1,0) [0|0] \"m/s\" X\n",
       "car.dbc:3: BO_ OTHER has the id 0x1 of CCVS1 in line 1, which is taken; remove one of them"},
      {"BO_ 2 OTHER: 8 X\nBO_ 2 ELSE: 8 X\n", ""},  // not bound
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char dbc[400];
    (void)snprintf(dbc, sizeof dbc, "%s%s", TWIN, cases[i].more);
    const wm_can_binding bound = binding(WM_Q_VEHICLE_SPEED, "CCVS1", "V");
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, open_with(&f, dbc, &bound, 1), f.err.text);
    TEST_ASSERT_EQUAL_STRING(cases[i].note, wm_can_decoder_twins(f.decoder));
    TEST_ASSERT_EQUAL_DOUBLE(3.0, value_of(&f, "can0 001#0300000000000000"));
  }
  const wm_can_binding other = binding(WM_Q_VEHICLE_SPEED, "OTHER", "V");
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, open_with(&f, TWIN "BO_ 1 OTHER: 8 X\n", &other, 1));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f.err.text, "message 'OTHER' (car.dbc:3) has the id of CCVS1 in line 1"),
                               f.err.text);
}

#define SPEED " SG_ V : 8|16@1+ (0.00390625,0) [0|250.996] \"km/h\" X\n"

static const wm_can_binding *speed_of(const char *bus) {
  static wm_can_binding b;
  b = binding(WM_Q_VEHICLE_SPEED, "CCVS1", "V");
  (void)snprintf(b.bus, sizeof b.bus, "%s", bus);
  return &b;
}

static void open_speed(const char *dbc, const char *bus) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, open_with(&f, dbc, speed_of(bus), 1), f.err.text);
}

// Feeds frames to the decoder and to the survey; returns how many gave a value.
static int feed_all(const char *const *frames, size_t count) {
  int taken = 0;
  for (size_t i = 0; i < count; i++) {
    char line[128];
    wm_can_frame frame;
    (void)snprintf(line, sizeof line, "(%zu.0) %s", i / 4, frames[i]);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_candump_parse(line, strlen(line), &frame, &f.err), line);
    (void)wm_can_survey_take(survey, &frame);
    taken += wm_can_decode(f.decoder, &frame, &f.got, &f.counts, &f.err) == WM_OK;
  }
  return taken;
}

typedef struct pgn_row {
  const char *about, *dbc, *frame;
  int is_taken;
} pgn_row;

// VFrameFormat with its values in another order, by number, by name and by default.
#define FORMATS "BA_DEF_ BO_ \"VFrameFormat\" ENUM \"J1939PG\",\"StandardCAN\",\"ExtendedCAN\";\n"
static const pgn_row kPgns[] = {
    {"the DBC's own id", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 18FEF1FE#F39A03FFFFFFFFFF", 1},
    {"source address open", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 18FEF100#F39A03FFFFFFFFFF", 1},
    {"another priority", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 0CFEF117#F39A03FFFFFFFFFF", 1},
    {"another PGN", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 18FEF200#F39A03FFFFFFFFFF", 0},
    {"another data page", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 19FEF100#F39A03FFFFFFFFFF", 0},
    {"11 bits", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 1FE#F39A03FFFFFFFFFF", 0},
    {"remote frame", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 18FEF1FE#R8", 0},
    {"error frame", "BO_ 2566844926 CCVS1: 8 X\n" SPEED, "can0 38FEF1FE#F39A03FFFFFFFFFF", 0},
    {"stated address, no format", "BO_ 2566844672 CCVS1: 8 X\n" SPEED, "can0 18FEF10B#F39A03FFFFFFFFFF", 0},
    {"J1939PG by number", "BO_ 2566844672 CCVS1: 8 X\n" SPEED "BA_ \"VFrameFormat\" BO_ 2566844672 3;\n",
     "can0 18FEF10B#F39A03FFFFFFFFFF", 1},
    {"J1939PG by the file's own number",
     "BO_ 2566844672 CCVS1: 8 X\n" SPEED FORMATS "BA_ \"VFrameFormat\" BO_ 2566844672 0;\n",
     "can0 18FEF10B#F39A03FFFFFFFFFF", 1},
    {"J1939PG by name", "BO_ 2566844672 CCVS1: 8 X\n" SPEED "BA_ \"VFrameFormat\" BO_ 2566844672 \"J1939PG\";\n",
     "can0 18FEF10B#F39A03FFFFFFFFFF", 1},
    {"J1939PG by default", "BO_ 2566844672 CCVS1: 8 X\n" SPEED FORMATS "BA_DEF_DEF_ \"VFrameFormat\" \"J1939PG\";\n",
     "can0 18FEF10B#F39A03FFFFFFFFFF", 1},
    {"another format by number", "BO_ 2566844926 CCVS1: 8 X\n" SPEED "BA_ \"VFrameFormat\" BO_ 2566844926 1;\n",
     "can0 18FEF100#F39A03FFFFFFFFFF", 0},
    // PF 0xEF is below 0xF0: the second byte is the destination.
    {"another destination", "BO_ 2565865470 CCVS1: 8 X\n" SPEED, "can0 18EF2100#F39A03FFFFFFFFFF", 1},
    {"another PF", "BO_ 2565865470 CCVS1: 8 X\n" SPEED, "can0 18EE2100#F39A03FFFFFFFFFF", 0},
};

TEST(j1939_is_matched_by_its_pgn) {
  for (size_t i = 0; i < sizeof kPgns / sizeof *kPgns; i++) {
    const pgn_row *row = &kPgns[i];
    open_speed(row->dbc, "");
    TEST_ASSERT_EQUAL_MESSAGE(row->is_taken, feed_all(&row->frame, 1), row->about);
    // 0x039A / 256 km/h
    if (row->is_taken) TEST_ASSERT_DOUBLE_WITHIN(1e-12, 922 / 256.0 / 3.6, f.got.value[0]);
  }
}

TEST(a_file_that_has_a_pgn_twice_tells_its_senders_apart) {
  open_speed("BO_ 2566844672 CCVS1: 8 X\n" SPEED "BO_ 2566844683 CCVS1_B: 8 X\n" SPEED
             "BA_DEF_DEF_ \"VFrameFormat\" \"J1939PG\";\n",
             "");
  const char *const frames[] = {"can0 18FEF10B#F39A03FFFFFFFFFF", "can0 0CFEF100#F39A03FFFFFFFFFF"};
  TEST_ASSERT_EQUAL(1, feed_all(frames, 2));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.ignored);
}

TEST(one_of_several_senders_is_taken) {
  open_speed("BO_ 2566844926 CCVS1: 8 X\n" SPEED, "");
  const char *const frames[] = {"can0 18FEF10B#F30001FFFFFFFFFF", "can0 18FEF100#F30002FFFFFFFFFF",
                                "can0 0CFEF10B#F30001FFFFFFFFFF", "can1 18FEF10B#F30003FFFFFFFFFF"};
  TEST_ASSERT_EQUAL(2, feed_all(frames, 4));
  TEST_ASSERT_EQUAL_UINT64(2, f.counts.ignored);
  TEST_ASSERT_GREATER_THAN(0, wm_can_decoder_senders(f.decoder, survey, text, sizeof text));
  TEST_ASSERT_EQUAL_STRING(
      "CCVS1 is sent by 3: 18FEF10B on can0, 18FEF100 on can0, 18FEF10B on can1. Taken is 18FEF10B on can0; for "
      "another one write `bus:` in can-signals.yaml",
      text);
  // A sender that is silent for more than 3 s has gone.
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed_at(&f, 3.0, "can0 18FEF100#F30002FFFFFFFFFF"));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.malformed);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f.err.text, "another unit's, while the one that is taken is silent"), f.err.text);
  TEST_ASSERT_EQUAL(WM_OK, feed_at(&f, 3.1, "can0 18FEF100#F30002FFFFFFFFFF"));
  TEST_ASSERT_EQUAL(WM_AGAIN, feed_at(&f, 3.2, "can0 18FEF10B#F30001FFFFFFFFFF"));
}

TEST(the_dbcs_own_address_goes_before_others) {
  open_speed("BO_ 2566844672 CCVS1: 8 X\n" SPEED "BA_ \"VFrameFormat\" BO_ 2566844672 3;\n", "");
  const char *const frames[] = {"can0 18FEF10B#F30001FFFFFFFFFF", "can0 18FEF100#F30002FFFFFFFFFF",
                                "can0 18FEF10B#F30001FFFFFFFFFF"};
  TEST_ASSERT_EQUAL(2, feed_all(frames, 3));
  (void)wm_can_decoder_senders(f.decoder, survey, text, sizeof text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "Taken is 18FEF100 on can0; for another one write its whole id"), text);
}

// Who sends a message each 100 ms: addresses by their letters, '.' none. `taken`: whose frame has to be taken then.
typedef struct turn_row {
  const char *about, *sends[2], *taken;
  unsigned changes, awaited;
} turn_row;
static const turn_row kTurns[] = {
    {"one unit", {"aaaaaaaa", ""}, "aaaaaaaa", 0, 0},
    {"another address at once", {"aaaabbbb", ""}, "aaaa.bbb", 1, 0},
    {"another address after its claim", {"aaaa...bbbb", ""}, "aaaa...bbbb", 1, 0},
    {"and back, much later",
     {"aaaabbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbaaaa", ""},
     "aaaa.bbbbbbbbbbbbbbbbbbbbbbbbbbbbbbb.aaa",
     2,
     0},
    {"two units", {"aaaaaaaa", "bbbbbbbb"}, "aaaaaaaa", 0, 0},
    {"two units, the first begins later", {".aaaaaaa", "bbbbbbbb"}, "bbbbbbbb", 0, 0},
    {"two units, the first misses one", {"aaaa.aaaa", "bbbbbbbbb"}, "aaaa.aaaa", 0, 0},
    {"two units, a pause of the first", {"aaaa....aaaa", "bbbbbbbbbbbb"}, "aaaa....aaaa", 0, 2},
    {"the second begins in a pause", {"aaaa....aaaa", ".....bbbbbbb"}, "aaaa.bbbaaaa", 2, 0},
    {"the first of two falls silent",
     {"aaaa................................", "bbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbb"},
     "aaaa.............................bb",
     1,
     27},
};

TEST(a_unit_that_claims_another_address_is_followed) {
  for (size_t i = 0; i < sizeof kTurns / sizeof *kTurns; i++) {
    const turn_row *row = &kTurns[i];
    open_speed("BO_ 2566844926 CCVS1: 8 X\n" SPEED, "");
    char taken[64] = "";
    for (size_t k = 0; row->sends[0][k]; k++) {
      taken[k] = '.';
      for (size_t who = 0; who < 2; who++) {
        const char sender = strlen(row->sends[who]) > k ? row->sends[who][k] : '.';
        char frame[64];
        (void)snprintf(frame, sizeof frame, "can0 18FEF1%02X#F30001FFFFFFFFFF", sender == 'a' ? 0x00 : 0x25);
        if (sender != '.' && feed_at(&f, 1.0 + 0.1 * (double)k + 0.03 * (double)who, frame) == WM_OK) taken[k] = sender;
      }
    }
    TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE(row->taken, taken, strlen(row->taken), row->about);
    TEST_ASSERT_EQUAL_MESSAGE(row->changes, f.counts.news, row->about);
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(row->awaited, f.counts.malformed, row->about);
  }
  TEST_ASSERT_EQUAL_STRING(
      "CCVS1 is taken from 18FEF125 on can0 since 4.330 s, 3.03 s after the last one of 18FEF100 on can0",
      f.counts.device_note);
}

TEST(addresses_in_turn_are_not_told_as_two_units) {
  open_speed("BO_ 2566844926 CCVS1: 8 X\n" SPEED, "");
  const char *const frames[] = {
      "can0 18FEF100#F30001FFFFFFFFFF", "can0 18FEF100#F30002FFFFFFFFFF", "can0 101#00", "can0 101#00",
      "can0 18FEF125#F30001FFFFFFFFFF", "can0 18FEF125#F30003FFFFFFFFFF"};
  (void)feed_all(frames, 6);
  TEST_ASSERT_EQUAL(0, wm_can_decoder_senders(f.decoder, survey, text, sizeof text));
}

TEST(a_message_on_two_buses) {
  open_speed("BO_ 256 CCVS1: 8 X\n" SPEED, "");
  const char *const frames[] = {"can1 100#F30001", "can0 100#F30002", "can1 100#F30001"};
  TEST_ASSERT_EQUAL(2, feed_all(frames, 3));
  (void)wm_can_decoder_senders(f.decoder, survey, text, sizeof text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "Taken is 100 on can1; for another one write `bus:`"), text);
  open_speed("BO_ 256 CCVS1: 8 X\n" SPEED, "can0");
  TEST_ASSERT_EQUAL(1, feed_all(frames, 3));
  TEST_ASSERT_EQUAL(0, wm_can_decoder_senders(f.decoder, survey, text, sizeof text));
}

typedef struct missing_row {
  const char *dbc, *bus, *frames[4], *says;
} missing_row;

static const missing_row kMissing[] = {
    {"BO_ 256 CCVS1: 8 X\n" SPEED,
     "",
     {"can0 00000100#E803", "can0 00000100#E803", "can0 101#00"},
     "no frame of CCVS1 (100, 11 bits) came, but 2 of 00000100 (29 bits); write BO_ 2147483904 in the DBC"},
    {"BO_ 2147483904 CCVS1: 8 X\n" SPEED,
     "",
     {"can0 100#E803"},
     "no frame of CCVS1 (00000100, 29 bits) came, but 1 of 100 (11 bits); write BO_ 256 in the DBC"},
    {"BO_ 2566844672 CCVS1: 8 X\n" SPEED,
     "",
     {"can0 18FEF10B#F3", "can0 18FEF10C#F3", "can0 18FEF10C#F3"},
     "no frame of CCVS1 (18FEF100, 29 bits) came, but 2 of 18FEF10C (29 bits, the same PGN); write BO_ 2566844684 in "
     "the DBC"},
    {"BO_ 256 CCVS1: 8 X\n" SPEED,
     "",
     {"can0 200#00", "can0 00000300#00", "can0 00000300#00", "can0 100#R"},
     "no frame of CCVS1 (100, 11 bits) came; the bus has 00000300, 200"},
    {"BO_ 256 CCVS1: 8 X\n" SPEED,
     "can1",
     {"can0 100#00"},
     "no frame of CCVS1 (100, 11 bits) came on bus can1, but on can0; correct `bus:`"},
    {"BO_ 256 CCVS1: 8 X\n" SPEED,
     "",
     {"can0 20000100#00"},
     "no frame of CCVS1 (100, 11 bits) came; no data frame came at all"},
    {"BO_ 256 CCVS1: 8 X\n" SPEED, "", {"can0 100#000001"}, ""},
};

TEST(a_message_that_never_comes_is_named_with_what_came) {
  for (size_t i = 0; i < sizeof kMissing / sizeof *kMissing; i++) {
    const missing_row *row = &kMissing[i];
    size_t count = 0;
    while (count < 4 && row->frames[count]) count++;
    open_speed(row->dbc, row->bus);
    memset(survey, 0, sizeof *survey);
    (void)feed_all(row->frames, count);
    TEST_ASSERT_EQUAL_size_t(strlen(row->says), wm_can_decoder_missing(f.decoder, survey, text, sizeof text));
    TEST_ASSERT_EQUAL_STRING(row->says, text);
  }
}

// Integers of 32 bits whose bits are floats, in both byte orders, and ones that are integers.
TEST(floats_without_their_type) {
  static const struct {
    const char *bits, *frames[2], *says;
  } rows[] = {
      {"0|32@1-",
       {"can0 100#0000803F00000000", "can0 100#CDCC4CBF00000000"},
       "the 32 bits of all 24 values of CCVS1.V are floating-point numbers (the first is 1); write in the DBC "
       "`SIG_VALTYPE_ 256 V : 1;`"},
      {"7|32@0+", {"can0 100#3F80000000000000", "can0 100#BF4CCCCD00000000"}, "SIG_VALTYPE_ 256 V : 1;"},
      {"0|64@1-", {"can0 100#000000000000F03F", "can0 100#000000000000E0BF"}, "SIG_VALTYPE_ 256 V : 2;"},
      {"0|32@1-", {"can0 100#E803000000000000", "can0 100#18FCFFFF00000000"}, ""},
      {"0|32@1-", {"can0 100#0000803F00000000", "can0 100#0100000000000000"}, ""},
  };
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    char dbc[160];
    (void)snprintf(dbc, sizeof dbc, "BO_ 256 CCVS1: 8 X\n SG_ V : %s (1,0) [0|0] \"m/s\" X\n", rows[i].bits);
    open_speed(dbc, "");
    for (int k = 0; k < 12; k++) (void)feed_all(rows[i].frames, 2);
    (void)wm_can_decoder_floats(f.decoder, text, sizeof text);
    if (rows[i].says[0])
      TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, rows[i].says), text);
    else
      TEST_ASSERT_EQUAL_STRING("", text);
  }
}

static int differences_in(const double *stamps, size_t count) {
  wm_can_survey *s = calloc(1, sizeof *s);
  for (size_t i = 0; i < count; i++) {
    const wm_can_frame frame = {.t_ns = (wm_time_ns)(stamps[i] * 1e9)};
    (void)wm_can_survey_take(s, &frame);
  }
  const int out = wm_can_survey_has_differences(s);
  free(s);
  return out;
}

TEST(times_that_are_differences) {
  static const double kEven[] = {0, .01, .01, .01, .01, .01, .01, .01, .01};
  static const double kUneven[] = {0, .001, .009, .0005, .0095, .0007, .0093, .001, .009};
  static const double kFromStart[] = {3.2, .01, .01, .02, .01, .01, .01, .02, .01};  // after candump was started
  static const double kZeroBased[] = {0, .01, .02, .03, .04, .05, .06, .07, .08};
  static const double kBursts[] = {0, .010, .010, .020, .021, .022, .030, .031, .032};  // of an adapter
  static const double kTogether[] = {0, 0, .01, .02, .02, .02, .03, .03, .04};  // several messages at once, from 0
  static const double kSteady[] = {3.2, .010, .011, .010, .009, .010, .011, .010, .010};
  static const double kWall[] = {1.7e9, 1.7e9, 1.7e9, 1.7e9, 1.7e9, 1.7e9, 1.7e9, 1.7e9, 1.7e9};
  TEST_ASSERT_TRUE(differences_in(kEven, 9));
  TEST_ASSERT_TRUE(differences_in(kUneven, 9));
  TEST_ASSERT_TRUE(differences_in(kFromStart, 9));
  TEST_ASSERT_FALSE(differences_in(kZeroBased, 9));
  TEST_ASSERT_TRUE(differences_in(kSteady, 9));
  TEST_ASSERT_FALSE(differences_in(kBursts, 9));
  TEST_ASSERT_FALSE(differences_in(kTogether, 9));
  TEST_ASSERT_FALSE(differences_in(kWall, 9));
  TEST_ASSERT_FALSE(differences_in(kEven, 4));  // too few to tell
}
