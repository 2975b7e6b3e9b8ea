// SPDX-License-Identifier: Apache-2.0
// Bad candump lines, DBC files and bindings, and the exact message that each one gives. `wm_errors_can --markdown`
// prints the table for docs/errors.md; without arguments this is a test of it.
#include "common/suite.h"
#include "waymark/can.h"

typedef enum kind { CANDUMP, DBC, BINDING } kind;

typedef struct bad_input {
  const char *name;
  kind kind;
  const char *input;
  const char *message;
} bad_input;

// The DBC that the bindings below are held against.
static const char kCar[] =
    "BO_ 170 WHEELS: 8 ESP\n"                               // 1
    " SG_ SPEED_FL : 7|16@0+ (0.01,0) [0|0] \"km/h\" X\n"   // 2
    " SG_ SPEED_FR : 23|16@0+ (0.01,0) [0|0] \"\" X\n"      // 3
    " SG_ TURNS : 39|16@0+ (1,0) [0|0] \"rpm\" X\n"         // 4
    " SG_ WARP : 55|8@0+ (1,0) [0|0] \"furlong/week\" X\n"  // 5
    " SG_ BIT : 56|1@1+ (1,0) [0|0] \"\" X\n"               // 6
    "BO_ 36 YAW: 4 ESP\n"                                   // 7
    " SG_ YAW_RATE : 0|16@1- (0.1,0) [0|0] \"deg/s\" X\n"   // 8
    " SG_ TOO_FAR : 24|16@1+ (1,0) [0|0] \"deg/s\" X\n"     // 9
    " SG_ LOST m1 : 16|8@1+ (1,0) [0|0] \"deg/s\" X\n"      // 10
    "BO_ 956 GEARBOX: 8 ECU\n"                              // 11
    " SG_ GEAR : 0|8@1+ (1,0) [0|0] \"\" X\n"               // 12
    " SG_ LEVER : 8|8@1+ (1,0) [0|0] \"\" X\n"              // 13
    " SG_ POWER : 32|32@1- (1,0) [0|0] \"\" X\n"            // 14
    " SG_ ZERO : 16|8@1+ (0,0) [0|0] \"m/s\" X\n"           // 15
    "BO_ 2364540158 LONG_ONE: 100 ECU\n"                    // 16
    "SIG_VALTYPE_ 956 POWER : 1;\n"                         // 17
    "VAL_ 956 LEVER 0 \"open\" 1 \"closed\" ;\n";

#define SG "BO_ 1 M: 8 X\n SG_ "
static const bad_input kTable[] = {
    {"no time", CANDUMP, "can0 123#00", "a line begins with its time, (SECONDS.MICROS)"},
    {"a log of another program", CANDUMP, "date Mon May 1 10:00:00.000 am 2026",
     "this is no log of candump, but a log of Vector (ASC); `python -m can.logconvert LOG can.log` makes one of it "
     "(python-can)"},
    {"a table of another program", CANDUMP, "Time Stamp,ID,Extended,Dir,Bus,LEN,D1",
     "this is no log of candump, but a table of SavvyCAN: save it there as candump's log"},
    {"a log without its date", CANDUMP, "base hex  timestamps absolute",
     "this is no log of candump, but a log of Vector (ASC); `python -m can.logconvert LOG can.log` makes one of it "
     "(python-can)"},
    {"an old trace of PEAK", CANDUMP, ";   PCAN-View",
     "this is no log of candump, but a trace of PEAK (TRC) or another program's; `python -m can.logconvert LOG "
     "can.log` "
     "makes one of it (python-can)"},
    {"a log of BUSMASTER", CANDUMP, "***BUSMASTER Ver 3.2.2***",
     "this is no log of candump, but a log of BUSMASTER: save it there as ASC, and `python -m can.logconvert LOG "
     "can.log` makes one of it (python-can)"},
    {"a pointer of Git LFS", CANDUMP, "version https://git-lfs.github.com/spec/v1",
     "this is no log of candump, but a pointer of Git LFS: `git lfs pull` fetches the file that it stands for"},
    {"a web page", CANDUMP, "<html>", "this is no log of candump, but a web page or XML: did the download go wrong?"},
    {"screen output of candump", CANDUMP, "  can0  123   [2]  11 22",
     "this is what candump shows on the screen, without a time; record with `candump -l any`, or `candump -L any > "
     "can.log`"},
    {"screen output, bytes missing", CANDUMP, "(000.000000)  can0  123   [3]  11 22",
     "id 123: [3] says 3 bytes, two hex digits each; '' is none"},
    {"screen output in bits", CANDUMP, "(000.000000)  can0  123   [1]  00010001",
     "id 123: [1] says 1 bytes, two hex digits each; '00010001' is none"},
    {"screen output, length", CANDUMP, "(000.000000)  can0  123   [65]  11", "id 123: [LENGTH] is 0 to 64 bytes"},
    {"time without its end", CANDUMP, "(1.5 can0 123#00", "the time's closing bracket is missing: (SECONDS.MICROS)"},
    {"time with too many digits", CANDUMP, "(1.0000000001) can0 123#00",
     "time (1.0000000001) needs 1 to 9 digits behind its point"},
    {"time too late", CANDUMP, "(9999999999999.0) can0 123#00",
     "time (9999999999999.0) does not fit into 64-bit nanoseconds (292 years)"},
    {"no interface", CANDUMP, "(1.5)", "behind the time comes the interface's name, 1 to 63 letters; '' is not one"},
    {"interface's name too long", CANDUMP,
     "(1.5) a_name_of_64_letters_xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx 123#00",
     "behind the time comes the interface's name, 1 to 63 letters; 'a_name_of_64_letters_xxxxxxxxxxxxxxxxxxxxxxx...' "
     "is not one"},
    {"id of four digits", CANDUMP, "(1.5) can0 1234#00", "id '1234' has 4 digits; 3 are an 11-bit id, 8 a 29-bit one"},
    {"11-bit id too large", CANDUMP, "(1.5) can0 800#00", "id 800 is above 7FF"},
    {"29-bit id too large", CANDUMP, "(1.5) can0 40000000#00", "id 40000000 is above 1FFFFFFF"},
    {"half a byte", CANDUMP, "(1.5) can0 123#001", "id 123: byte 1 has no second hex digit"},
    {"not hexadecimal", CANDUMP, "(1.5) can0 123#00XY", "id 123: unexpected 'XY' behind the data"},
    {"FD without flags", CANDUMP, "(1.5) can0 123##", "id 123: behind ## comes one hex digit of CAN FD flags"},
    {"raw DLC behind a short frame", CANDUMP, "(1.5) can0 123#0011_9",
     "id 123: a raw DLC _9 to _F is allowed after 8 bytes only"},
    {"CAN XL", CANDUMP, "(1.5) can0 45123#81:00:12345678#11223344", "id 45123: CAN XL frames are not taken"},
    {"something behind the data", CANDUMP, "(1.5) can0 123#0011 R 42", "id 123: unexpected '42' behind the data"},

    {"no colon behind the message", DBC, "BO_ 170 WHEELS 8 ESP",
     "car.dbc:1: BO_ WHEELS: expected a colon behind the message's name, found '8'"},
    {"message id in hexadecimal", DBC, "BO_ 0xAA WHEELS: 8 ESP",
     "car.dbc:1: BO_ 0xAA: expected the message's id, a decimal number, found '0xAA'"},
    {"message of 20000 bytes", DBC, "BO_ 1 M: 20000 X",
     "car.dbc:1: BO_ M: 20000 bytes; a frame has 0 to 64, and what goes over several frames at most 1785"},
    {"29-bit id without its mark", DBC, "BO_ 4096 WHEELS: 8 ESP",
     "car.dbc:1: BO_ WHEELS: id 4096 is above 11 bits; a 29-bit id is written with bit 31 set, as 2147487744"},
    {"two signals of one name", DBC, SG "A : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ A : 8|8@1+ (1,0) [0|0] \"\" X",
     "car.dbc:3: SG_ A: M has a signal of this name already, in line 2"},
    {"signal outside of a message", DBC, "SG_ A : 0|8@1+ (1,0) [0|0] \"\" X",
     "car.dbc:1: SG_ A: a signal outside of a message; its BO_ line has to stand before it"},
    {"no colon behind the signal", DBC, SG "A 0|8@1+ (1,0) [0|0] \"\" X",
     "car.dbc:2: SG_ A: expected a colon, or M, m0, m1 ... (multiplexing) and then a colon, found '0'"},
    {"byte order", DBC, SG "A : 0|8@2+ (1,0) [0|0] \"\" X",
     "car.dbc:2: SG_ A: byte order '2' is unknown; 1 is Intel (little endian), 0 is Motorola"},
    {"sign", DBC, SG "A : 0|8@1u (1,0) [0|0] \"\" X",
     "car.dbc:2: SG_ A: sign 'u' is unknown; + is unsigned, - is signed"},
    {"no bits", DBC, SG "A : 0|0@1+ (1,0) [0|0] \"\" X", "car.dbc:2: SG_ A: a length of 0 bits; 1 to 64 are possible"},
    {"too many bits", DBC, SG "A : 0|65@1+ (1,0) [0|0] \"\" X",
     "car.dbc:2: SG_ A: a length of 65 bits; 1 to 64 are possible"},
    {"decimal comma", DBC, SG "A : 0|8@1+ (0,5,0) [0|0] \"\" X",
     "car.dbc:2: SG_ A: expected (FACTOR,OFFSET), two numbers with a decimal point, found ','"},
    {"no unit", DBC, SG "A : 0|8@1+ (1,0) [0|0] X",
     "car.dbc:2: SG_ A: expected the unit in quotes (\"\" where there is none), found 'X'"},
    {"line cut off", DBC, SG "A : 0|8@1+ (1,0)\nBO_ 2 N: 8 X",
     "car.dbc:2: SG_ A: expected [MIN|MAX], two numbers ([0|0] where there is no range), found the end of the line"},
    {"float of 16 bits", DBC, SG "A : 0|16@1- (1,0) [0|0] \"\" X\nSIG_VALTYPE_ 1 A : 1;",
     "car.dbc:3: SIG_VALTYPE_ A: a float of 32 bits, but the signal (line 2) has 16"},
    {"string without its end", DBC, "BO_ 1 M: 8 X\nCM_ BO_ 1 \"the wheels;\n",
     "car.dbc:2: the string that begins here never ends; a quote (\") is missing"},
    {"misspelt keyword", DBC, "BO_ 1 M: 8 X\n SG A : 0|8@1+ (1,0) [0|0] \"\" X",
     "car.dbc:2: expected a statement, found 'SG'; did you mean SG_?"},
    {"not a DBC", DBC, "<?xml version=\"1.0\"?>",
     "car.dbc:1: this is XML or JSON, not DBC; export the database as DBC (cantools convert does it)"},
    {"multiplexer of no such name", DBC, SG "A m1 : 0|8@1+ (1,0) [0|0] \"\" X\nSG_MUL_VAL_ 1 A B 1-1;",
     "car.dbc:3: SG_MUL_VAL_ A: expected the name of a multiplexer of the same message, found 'B'"},

    {"no such message", BINDING, "{quantity: vehicle_speed, message: WHEEL, signal: SPEED_FL}",
     "can-signals.yaml:1: vehicle_speed: message 'WHEEL' is not in car.dbc; did you mean WHEELS?"},
    {"no such signal", BINDING, "{quantity: vehicle_speed, message: WHEELS, signal: SPEED_LF}",
     "can-signals.yaml:1: vehicle_speed: message WHEELS has no signal 'SPEED_LF'; did you mean SPEED_FL?"},
    {"no such signal, nor one like it", BINDING, "{quantity: yaw_rate, message: YAW, signal: rotation}",
     "can-signals.yaml:1: yaw_rate: message YAW has no signal 'rotation'; it has LOST, TOO_FAR, YAW_RATE"},
    {"message over several frames", BINDING, "{quantity: yaw_rate, message: LONG_ONE, signal: A}",
     "can-signals.yaml:1: yaw_rate: LONG_ONE has 100 bytes (car.dbc:16), which go over several frames; 64 at most can "
     "be decoded"},
    {"no unit in the DBC", BINDING, "{quantity: vehicle_speed, message: WHEELS, signal: SPEED_FR}",
     "can-signals.yaml:1: vehicle_speed: SPEED_FR has no unit in car.dbc:3; write `unit:` (m/s, km/h, mph, cm/s, "
     "mm/s)"},
    {"unknown unit", BINDING, "{quantity: vehicle_speed, message: WHEELS, signal: WARP}",
     "can-signals.yaml:1: vehicle_speed: unit 'furlong/week' of WARP is not known; write `unit:` (m/s, km/h, mph, "
     "cm/s, mm/s)"},
    {"unit of something else", BINDING, "{quantity: yaw_rate, message: WHEELS, signal: SPEED_FL}",
     "can-signals.yaml:1: yaw_rate: SPEED_FL is in 'km/h', which is not a unit of this quantity (rad/s, deg/s, rpm)"},
    {"rpm of a wheel", BINDING, "{quantity: wheel_speed_rear_left, message: WHEELS, signal: TURNS}",
     "can-signals.yaml:1: wheel_speed_rear_left: TURNS is in 'rpm', a rate of turning, and the wheel's radius is not "
     "known here; write `unit: m/s` and `scale:` metres a second for one rpm (for rpm of the wheel: 0.10472 times its "
     "radius in m)"},
    {"ticks in km/h", BINDING, "{quantity: wheel_ticks_left, message: WHEELS, signal: SPEED_FL}",
     "can-signals.yaml:1: wheel_ticks_left: SPEED_FL is in 'km/h', but this quantity is a bare number; bind the signal "
     "that counts"},
    {"ticks of one bit", BINDING, "{quantity: wheel_ticks_left, message: WHEELS, signal: BIT}",
     "can-signals.yaml:1: wheel_ticks_left: BIT has 1 bits; a counter that wraps so soon cannot be followed (4 at "
     "least)"},
    {"signal beyond its message", BINDING, "{quantity: yaw_rate, message: YAW, signal: TOO_FAR}",
     "can-signals.yaml:1: yaw_rate: TOO_FAR (car.dbc:9) needs 5 bytes, but YAW has 4; one of the two is wrong in the "
     "DBC"},
    {"multiplexed by nothing", BINDING, "{quantity: yaw_rate, message: YAW, signal: LOST}",
     "can-signals.yaml:1: yaw_rate: LOST (car.dbc:10) is multiplexed, but the file does not state by which signal: one "
     "M in the message, or SG_MUL_VAL_ lines without a ring, are needed"},
    {"gear without names", BINDING, "{quantity: gear, message: GEARBOX, signal: GEAR}",
     "can-signals.yaml:1: gear: the DBC has no VAL_ names for this signal; write `values: {forward: [1], reverse: [2], "
     "neutral: [0]}` with the signal's raw values"},
    {"names that are not gears", BINDING, "{quantity: gear, message: GEARBOX, signal: LEVER}",
     "can-signals.yaml:1: gear: none of the names in VAL_ (\"open\", \"closed\") is a gear; write `values: {forward: "
     "[1], reverse: [2], neutral: [0]}` with the signal's raw values"},
    {"gear in floating point", BINDING, "{quantity: gear, message: GEARBOX, signal: POWER}",
     "can-signals.yaml:1: gear: POWER is a floating-point number; an integer signal is needed"},
    {"factor of zero", BINDING, "{quantity: vehicle_speed, message: GEARBOX, signal: ZERO}",
     "can-signals.yaml:1: vehicle_speed: ZERO (car.dbc:15) has the factor 0 in the DBC, so its value is always the "
     "same"},
    {"scale of zero", BINDING, "{quantity: yaw_rate, message: YAW, signal: YAW_RATE, scale: 0}",
     "can-signals.yaml:1: yaw_rate: scale must be a number other than 0 (1 or -1 as a rule), offset a number"},
    {"bound twice", BINDING,
     "{quantity: yaw_rate, message: YAW, signal: YAW_RATE}\n{quantity: yaw_rate, message: YAW, signal: YAW_RATE}",
     "can-signals.yaml:2: yaw_rate: bound twice; the first time in line 1"},
};
enum { kCases = sizeof kTable / sizeof *kTable };

// "{key: value, ...}" of one line, as can-signals.yaml has them; the real reader of YAML has tests of its own.
static void read_binding(const char *line, int number, wm_can_binding *out) {
  memset(out, 0, sizeof *out);
  out->scale = 1.0;
  out->signal_count = 1;
  out->line = number;
  (void)snprintf(out->file, sizeof out->file, "can-signals.yaml");
  char text[256];
  (void)snprintf(text, sizeof text, "%s", line);
  for (char *pair = strtok(text, "{},\n"); pair; pair = strtok(NULL, "{},\n")) {
    char key[32], value[64];
    if (sscanf(pair, " %31[a-z]: %63s", key, value) != 2) continue;
    if (strcmp(key, "quantity") == 0) out->quantity = wm_quantity_find(value);
    if (strcmp(key, "message") == 0) (void)snprintf(out->message, sizeof out->message, "%s", value);
    if (strcmp(key, "signal") == 0) (void)snprintf(out->signal[0], sizeof out->signal[0], "%s", value);
    if (strcmp(key, "scale") == 0) out->scale = strtod(value, NULL);
  }
}

static wm_status try_bindings(const char *input, wm_error *err) {
  wm_can_binding bindings[4];
  size_t count = 0;
  for (const char *line = input; line && count < 4; line = strchr(line, '\n')) {
    if (*line == '\n') line++;
    char one[256];
    (void)snprintf(one, sizeof one, "%.*s", (int)strcspn(line, "\n"), line);
    read_binding(one, (int)count + 1, &bindings[count]);
    count++;
  }
  wm_dbc *dbc = NULL;
  wm_can_decoder *decoder = NULL;
  wm_status status = wm_dbc_parse(kCar, strlen(kCar), "car.dbc", &dbc, err);
  if (status == WM_OK) status = wm_can_decoder_make(dbc, bindings, count, &decoder, err);
  wm_can_decoder_free(decoder);
  wm_dbc_free(dbc);
  return status;
}

static wm_status try_input(const bad_input *bad, wm_error *err) {
  wm_can_frame frame;
  wm_dbc *dbc = NULL;
  wm_status status = WM_OK;
  err->text[0] = '\0';
  switch (bad->kind) {
    case CANDUMP: return wm_candump_parse(bad->input, strlen(bad->input), &frame, err);
    case DBC:
      status = wm_dbc_parse(bad->input, strlen(bad->input), "car.dbc", &dbc, err);
      wm_dbc_free(dbc);
      return status;
    case BINDING: return try_bindings(bad->input, err);
  }
  return WM_INTERNAL;
}

TEST(each_gives_its_message) {
  for (int i = 0; i < kCases; i++) {
    wm_error err = {WM_OK, ""};
    wm_status status = try_input(&kTable[i], &err);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(kTable[i].message, err.text, kTable[i].name);
    TEST_ASSERT_EQUAL_MESSAGE(status, err.status, kTable[i].name);
    TEST_ASSERT_TRUE_MESSAGE(status != WM_OK && status != WM_AGAIN && status != WM_INTERNAL, kTable[i].name);
  }
}

// What is printed in a table's cell: no line ends, no column marks.
static void print_cell(const char *text) {
  for (; *text; text++) {
    if (*text == '|') {
      printf("\\|");
    } else if (*text == '\n') {
      printf(" ⏎ ");
    } else {
      putchar(*text);
    }
  }
}

static int print_markdown(void) {
  static const char *const kKinds[] = {"candump line", "DBC", "CAN binding"};
  for (int i = 0; i < kCases; i++) {
    wm_error err = {WM_OK, ""};
    (void)try_input(&kTable[i], &err);
    printf("| %s: %s | `", kKinds[kTable[i].kind], kTable[i].name);
    print_cell(kTable[i].input);
    printf("` | ");
    print_cell(err.text);
    printf(" |\n");
  }
  return 0;
}

int suite_begin(int argc, char **argv) {
  if (argc > 1 && strcmp(argv[1], "--markdown") == 0) return print_markdown();
  return SUITE_RUNS;
}
