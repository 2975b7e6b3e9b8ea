// SPDX-License-Identifier: Apache-2.0
#include <float.h>

#include "common/suite.h"
#include "waymark/yaml.h"

static wm_yaml *doc;
static wm_error err;

void setUp(void) { doc = NULL; }
void tearDown(void) { wm_yaml_free(doc); }

static wm_yaml_node parse(const char *text) {
  wm_status status = wm_yaml_parse(text, strlen(text), "x.yaml", &doc, &err);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
  return wm_yaml_root(doc);
}

static void refused(const char *text, const char *message) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, wm_yaml_parse(text, strlen(text), "x.yaml", &doc, &err), text);
  TEST_ASSERT_NULL(doc);
  TEST_ASSERT_EQUAL_STRING(message, err.text);
}

TEST(walks) {
  wm_yaml_node root = parse("a: 1\nb:\n  c: [1, 2.5, 3]\n  d: ~\n  'e f': \"7\"\n");
  TEST_ASSERT_TRUE(wm_yaml_is_map(&root));
  TEST_ASSERT_EQUAL(2, wm_yaml_count(&root));
  wm_yaml_node c = wm_yaml_get(&root, "b.c");
  TEST_ASSERT_EQUAL(3, wm_yaml_line(&c));
  TEST_ASSERT_EQUAL_STRING("b.c", c.path);
  TEST_ASSERT_EQUAL(3, wm_yaml_count(&c));
  wm_yaml_node second = wm_yaml_item(&c, 1), none = wm_yaml_item(&c, 3);
  double value;
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_f64(&second, 0, 10, &value, &err));
  TEST_ASSERT_EQUAL_DOUBLE(2.5, value);
  TEST_ASSERT_EQUAL_STRING("b.c[1]", second.path);
  TEST_ASSERT_FALSE(wm_yaml_there(&none));
  wm_yaml_node d = wm_yaml_get(&root, "b.d"), x = wm_yaml_get(&root, "b.x"), deep = wm_yaml_get(&root, "a.b.c");
  TEST_ASSERT_FALSE(wm_yaml_there(&d) || wm_yaml_there(&x) || wm_yaml_there(&deep));
  const char *key;
  int line;
  wm_yaml_node b = wm_yaml_get(&root, "b"), last = wm_yaml_value(&b, 2, &key, &line);
  TEST_ASSERT_EQUAL_STRING("e f", key);
  TEST_ASSERT_EQUAL(5, line);
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_yaml_f64(&last, 0, 10, &value, &err));
  TEST_ASSERT_EQUAL_STRING("x.yaml:5: b.e f: the text '7' is not a number; a number from 0 to 10 is needed", err.text);
}

static void is_written(const char *text, const wm_yaml_change *changes, size_t count, const char *expected) {
  char *out = NULL;
  size_t length = 0;
  (void)parse(text);
  FILE *f = open_memstream(&out, &length);
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_write(doc, changes, count, f, &err));
  (void)fclose(f);
  wm_yaml_free(doc);
  TEST_ASSERT_EQUAL_STRING(expected, out);
  // And means the same.
  (void)parse(out);
  free(out);
  f = open_memstream(&out, &length);
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_write(doc, NULL, 0, f, &err));
  (void)fclose(f);
  TEST_ASSERT_EQUAL_STRING(expected, out);
  free(out);
}

TEST(is_written_again_with_changes) {
  is_written("a: 1.5  # of course\nb:\n  - c: [x, 'y, z', ~]\n    d: \"7\"\n  - usb-1.0:1\ne f: |\n  two\n  lines\n",
             NULL, 0, "a: 1.5\nb: [{c: [x, \"y, z\", null], d: \"7\"}, usb-1.0:1]\n\"e f\": \"two\\x0Alines\\x0A\"\n");
  wm_yaml_free(doc);
  const wm_yaml_change changes[] = {
      {"b[0].d", "new"}, {"a", NULL}, {"b[0].added", "too: this"}, {"g", "last"}, {"nowhere.h", "none"}};
  is_written("{a: 1, b: [{c: 2, d: 3}, {c: 4}]}\n", changes, 5,
             "b: [{c: 2, d: new, added: \"too: this\"}, {c: 4}]\ng: last\n");
}

static void says(wm_status status, const char *message) {
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, status);
  TEST_ASSERT_EQUAL_STRING(message, err.text);
}

TEST(typed_reads) {
  wm_yaml_node root = parse(
      "f: abc\nbig: 5000\ni: 1.5\nb: 'true'\nc: mpas\nl: [1, x]\ninf: .inf\nnan: .nan\nyes: true\nhuge: 1e999\nt: "
      "9007199254740993\n");
  static const char *const kNames[] = {"maps", "none", NULL};
  double f = 7;
  int64_t i = 7;
  int b = 7;
  int32_t c = 7;
  char s[4];
  wm_yaml_node n = wm_yaml_get(&root, "f");
  says(wm_yaml_f64(&n, 0, 1000, &f, &err), "x.yaml:1: f: 'abc' is not a number; a number from 0 to 1000 is needed");
  says(wm_yaml_string(&n, s, 3, &err), "x.yaml:1: f: 'abc' is longer than the 2 bytes that are allowed");
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_string(&n, s, 4, &err));
  n = wm_yaml_get(&root, "big");
  says(wm_yaml_f64(&n, DBL_MIN, 1000, &f, &err),
       "x.yaml:2: big: '5000' is out of range; a number above 0 and up to 1000 is needed");
  says(wm_yaml_i64(&n, 0, 10, &i, &err),
       "x.yaml:2: big: '5000' is out of range; a whole number from 0 to 10 is needed");
  n = wm_yaml_get(&root, "i");
  says(wm_yaml_i64(&n, 0, 10, &i, &err),
       "x.yaml:3: i: '1.5' is not a whole number; a whole number from 0 to 10 is needed");
  n = wm_yaml_get(&root, "b");
  says(wm_yaml_bool(&n, &b, &err), "x.yaml:4: b: the text 'true' is neither true nor false");
  n = wm_yaml_get(&root, "c");
  says(wm_yaml_choice(&n, kNames, &c, &err),
       "x.yaml:5: c: 'mpas' is unknown; did you mean 'maps'? (one of: maps, none)");
  n = wm_yaml_get(&root, "l");
  double list[2];
  says(wm_yaml_f64_list(&n, 2, 2, list, NULL, &err), "x.yaml:6: l[1]: 'x' is not a number; a number is needed");
  says(wm_yaml_f64_list(&n, 3, 4, list, NULL, &err), "x.yaml:6: l: has 2 values; a list of 3 to 4 numbers is needed");
  n = wm_yaml_get(&root, "inf");
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_f64(&n, 0, HUGE_VAL, &f, &err));
  says(wm_yaml_f64(&n, 0, 10, &f, &err),
       "x.yaml:7: inf: '.inf' is not a finite number; a number from 0 to 10 is needed");
  n = wm_yaml_get(&root, "nan");
  says(wm_yaml_f64(&n, -HUGE_VAL, HUGE_VAL, &f, &err),
       "x.yaml:8: nan: '.nan' is not a finite number; a number is needed");
  n = wm_yaml_get(&root, "yes");
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_bool(&n, &b, &err));
  TEST_ASSERT_EQUAL(1, b);
  n = wm_yaml_get(&root, "huge");
  says(wm_yaml_f64(&n, 0, HUGE_VAL, &f, &err),
       "x.yaml:10: huge: '1e999' is out of range; a number of at least 0 is needed");
  n = wm_yaml_get(&root, "t");
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_i64(&n, INT64_MIN, INT64_MAX, &i, &err));
  TEST_ASSERT_EQUAL_INT64(INT64_C(9007199254740993), i);
}

TEST(unknown_keys) {
  static const char *const kKnown[] = {"gate", "window_s", NULL};
  wm_yaml_node root = parse("gaet: 1\n");
  says(wm_yaml_check_keys(&root, kKnown, WM_YAML_NEAR, NULL, &err),
       "x.yaml:1: gaet: unknown key; did you mean 'gate'?");
  wm_yaml_free(doc);
  root = parse("gate: 1\nx_mine: 2\nlaser: 3\nlidar: 4\n");
  size_t unknown;
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_check_keys(&root, kKnown, WM_YAML_NEAR, &unknown, &err));
  TEST_ASSERT_EQUAL(2, unknown);
  TEST_ASSERT_EQUAL_STRING("x.yaml:3: laser: unknown key, ignored\nx.yaml:4: lidar: unknown key, ignored", err.text);
  says(wm_yaml_check_keys(&root, kKnown, WM_YAML_STRICT, &unknown, &err),
       "x.yaml:2: x_mine: unknown key; known are: gate, window_s");
  wm_yaml_free(doc);
  root = parse("[1]\n");
  says(wm_yaml_check_keys(&root, kKnown, WM_YAML_NEAR, &unknown, &err), "x.yaml:1: a list is not a map (KEY: VALUE)");
}

TEST(bad_documents) {
  refused("a: 1\nb: 2\na: 3\n", "x.yaml:3: a: the key appears twice (first in line 1)");
  refused("a: [1, 2\nb: 3\n",
          "x.yaml:2: not valid YAML: did not find expected ',' or ']', while parsing a flow sequence that begins in "
          "line 1");
  refused("a: 1\n\tb: 2\n",
          "x.yaml:2: not valid YAML: found a tab character that violates indentation, while scanning a plain scalar "
          "that begins in line 1");
  refused("a: 1\n\n\xFF\n", "x.yaml:3: not valid YAML: invalid leading UTF-8 octet");
  refused("a: *b\n", "x.yaml:1: an alias whose anchor (&NAME) doesn't stand before it");
  refused("a: &b [1, *b]\n", "x.yaml:1: an alias is inside its own anchor, which has no end");
  refused("a: 1\n---\nb: 2\n", "x.yaml:2: a second document (---) in the file; one is needed");
  refused("? [1, 2]\n: 3\n", "x.yaml:1: a key must be plain text");
  refused("&a &b c: 1\n", "x.yaml:1: not valid YAML: did not find expected key, while parsing a block mapping");
}

// As editors of Windows and of old Macs save it: a byte order mark, CRLF, CR alone.
TEST(encodings) {
  static const char *const kTexts[] = {
      "\xEF\xBB\xBF"
      "a: 1\nb: x\n",
      "\xEF\xBB\xBF"
      "a: 1\r\nb: x\r\n",
      "a: 1\rb: x\r", "\xEF\xBB\xBF---\na: 1\nb: x\n", "\xEF\xBB\xBF# c\na: 1\nb: x"};
  for (size_t i = 0; i < sizeof kTexts / sizeof *kTexts; i++) {
    wm_yaml_node root = parse(kTexts[i]), a = wm_yaml_get(&root, "a"), b = wm_yaml_get(&root, "b");
    int64_t one;
    TEST_ASSERT_EQUAL(WM_OK, wm_yaml_i64(&a, 0, 9, &one, &err));
    TEST_ASSERT_EQUAL(i < 3 ? 2 : 3, wm_yaml_line(&b));
    wm_yaml_free(doc);
  }
  doc = NULL;
  refused(
      "\xEF\xBB\xBF"
      "a: 1\n\n\xFF\n",
      "x.yaml:3: not valid YAML: invalid leading UTF-8 octet");
  refused(
      "\xFF\xFE"
      "a",
      "x.yaml:1: the file is in UTF-16; save it as UTF-8");
  refused(
      "\xFE\xFF"
      "a",
      "x.yaml:1: the file is in UTF-16; save it as UTF-8");
}

TEST(bounded) {
  char text[4096] = "a: &a [x, x, x, x, x, x, x, x, x, x]\n";
  for (int c = 'b'; c < 'j'; c++) {
    char line[128];
    snprintf(line, sizeof line, "%c: &%c [*%c, *%c, *%c, *%c, *%c, *%c, *%c, *%c, *%c, *%c]\n", c, c, c - 1, c - 1,
             c - 1, c - 1, c - 1, c - 1, c - 1, c - 1, c - 1, c - 1);
    strcat(text, line);
  }
  refused(text, "x.yaml:6: aliases written out make more than 1000000 values");
  char *many = malloc(1100 * 16);
  size_t n = 0;
  for (int i = 0; i < 1100; i++) n += (size_t)sprintf(many + n, "k%d: &a%d b\n", i, i);
  refused(many, "x.yaml:1001: more than 1000 anchors");
  free(many);
  memset(text, '[', 200);
  text[200] = '\0';
  refused(text, "x.yaml:1: nested deeper than 64 levels");
  wm_yaml_node root = parse("a: &a {x: 1}\nb: *a\n");
  wm_yaml_node x = wm_yaml_get(&root, "b.x");
  TEST_ASSERT_TRUE(wm_yaml_there(&x));
}

TEST(empty_documents) {
  wm_yaml_node root = parse("");
  TEST_ASSERT_FALSE(wm_yaml_there(&root) || wm_yaml_is_map(&root));
  wm_yaml_node a = wm_yaml_get(&root, "a");
  TEST_ASSERT_FALSE(wm_yaml_there(&a));
  double f;
  says(wm_yaml_f64(&a, 0, 1, &f, &err), "x.yaml:1: a: has no value; a number from 0 to 1 is needed");
  wm_yaml_free(doc);
  root = parse("{}");
  TEST_ASSERT_TRUE(wm_yaml_is_map(&root) && wm_yaml_count(&root) == 0);
  wm_yaml_free(doc);
  root = parse("# nothing\n");
  TEST_ASSERT_EQUAL(0, wm_yaml_count(&root));
}

static void edited(const char *text, const char *path, const char *value, const char *comment, const char *expected) {
  char *out;
  size_t length;
  TEST_ASSERT_EQUAL(WM_OK, wm_yaml_edit(text, strlen(text), path, value, comment, &out, &length, &err));
  TEST_ASSERT_EQUAL(strlen(expected), length);
  TEST_ASSERT_EQUAL_STRING_LEN(expected, out, length);
  free(out);
}

TEST(is_edited_in_place) {
  edited("# é\na: {b: [1, 2], c: x}  # ok\nd: 1\n", "a.b", "[3, 4]", "was 1",
         "# é\na: {b: [3, 4], c: x}  # ok  # was 1\nd: 1\n");
  edited("- {q: a}\n- q: b\n  s: c\n", "[1].s", "d", "", "- {q: a}\n- q: b\n  s: d\n");
  edited("- {q: a}\n- q: b\n", "[0].scale", "-1", "", "- {scale: -1, q: a}\n- q: b\n");
  edited("- {q: a}\n- q: b\n", "[1].scale", "-1", "", "- {q: a}\n- scale: -1\n  q: b\n");
  edited("s:\n  front:\n    x: 1\n", "s.front.mounting.rpy", "[0, 0, 1]", "",
         "s:\n  front:\n    mounting: {rpy: [0, 0, 1]}\n    x: 1\n");
  edited("a:\n  - 1\n  - 2\nb: 3\n", "a", "[4, 5]", "", "a:\n  [4, 5]\nb: 3\n");
  char *out;
  size_t length;
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_yaml_edit("a: 1\n", 5, "a.b", "2", "", &out, &length, &err));
  TEST_ASSERT_NULL(out);
}

TEST(missing_file) {
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_yaml_load("no/such.yaml", &doc, &err));
  TEST_ASSERT_EQUAL_STRING("no/such.yaml: there is no such file", err.text);
}
