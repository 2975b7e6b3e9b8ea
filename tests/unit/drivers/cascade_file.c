// SPDX-License-Identifier: Apache-2.0
// Cascades in OpenCV's format: what a file says, and what is said when it is wrong.
#include "waymark/cascade_file.h"
#include "common/suite.h"

#define HEAD                                                                                                       \
  "<?xml version=\"1.0\"?>\n<!-- < one > -->\n<opencv_storage>\n<cascade type_id=\"opencv-cascade-classifier\">\n" \
  "<stageType>BOOST</stageType>\n<featureType>LBP</featureType>\n<height>12</height>\n<width>9</width>\n"
#define TREE \
  "<_>\n<internalNodes>0 -1 0 1 -1 0 0 0 0 0 -2147483648</internalNodes>\n<leafValues>-1. 0.5</leafValues></_>\n"
#define STAGE                                                                                      \
  "<_><maxWeakCount>1</maxWeakCount><stageThreshold>0.25</stageThreshold>\n<weakClassifiers>" TREE \
  "</weakClassifiers></_>\n"
#define TAIL "</stages>\n<features><_><rect>\n0 3 3 3</rect></_></features></cascade>\n</opencv_storage>\n"
#define GOOD HEAD "<stages>" STAGE STAGE TAIL

#define HAAR                                                                                                          \
  "<opencv_storage><cascade type_id=\"opencv-cascade-classifier\"><stageType>BOOST</stageType>"                       \
  "<featureType>HAAR</featureType><height>20</height><width>20</width><stages><_><stageThreshold>-1</stageThreshold>" \
  "<weakClassifiers><_><internalNodes>1 0 0 0.5 -1 -2 0 -0.5</internalNodes><leafValues>1 2 3</leafValues></_>"       \
  "</weakClassifiers></_></stages><features><_><rects><_>0 0 20 20 -1.</_><_>0 0 10 20 2.</_></rects>"                \
  "<tilted>0</tilted></_></features></cascade></opencv_storage>"

static wm_cascade cascade;
static wm_error err;

void setUp(void) {
  memset(&cascade, 0, sizeof cascade);
  memset(&err, 0, sizeof err);
}
void tearDown(void) { wm_cascade_free(&cascade); }

static wm_status parse(const char *text) {
  wm_cascade_free(&cascade);
  return wm_cascade_parse(text, strlen(text), "sign.xml", &cascade, &err);
}

// `from` of a good file becomes `to`.
static void refused(const char *text, const char *from, const char *to, const char *what) {
  char changed[4096];
  const char *at = strstr(text, from);
  TEST_ASSERT_NOT_NULL(at);
  snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, parse(changed), to);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "sign.xml"), err.text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, what), err.text);
  TEST_ASSERT_NULL(cascade.nodes);
}

TEST(lbp) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse(GOOD), err.text);
  TEST_ASSERT_EQUAL(1, cascade.is_lbp);
  TEST_ASSERT_EQUAL(9, cascade.width_px);
  TEST_ASSERT_EQUAL(12, cascade.height_px);
  TEST_ASSERT_EQUAL(2, cascade.stage_count);
  TEST_ASSERT_EQUAL(1, cascade.stages[1].first_tree);
  TEST_ASSERT_EQUAL(1, cascade.stages[1].trees);
  TEST_ASSERT_EQUAL_FLOAT(0.25f - 1e-5f, cascade.stages[0].threshold);
  TEST_ASSERT_EQUAL_HEX32(0xffffffff, cascade.nodes[0].codes[1]);
  TEST_ASSERT_EQUAL_HEX32(0x80000000, cascade.nodes[1].codes[7]);
  TEST_ASSERT_EQUAL_INT16(-1, cascade.nodes[0].next[1]);
  TEST_ASSERT_EQUAL_FLOAT(-1.0f, cascade.leaves[2]);
  TEST_ASSERT_EQUAL(3, cascade.features[0].y[0]);
}

TEST(haar) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, parse(HAAR), err.text);
  TEST_ASSERT_EQUAL(0, cascade.is_lbp);
  TEST_ASSERT_EQUAL(2, cascade.node_count);
  TEST_ASSERT_EQUAL(3, cascade.leaf_count);
  TEST_ASSERT_EQUAL_FLOAT(-0.5f, cascade.nodes[1].threshold);
  TEST_ASSERT_EQUAL_FLOAT(2.0f, cascade.features[0].weight[1]);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, cascade.features[0].weight[2]);
}

TEST(mistakes) {
  refused(GOOD, "BOOST", "FOREST", "BOOST is needed");
  refused(GOOD, ">LBP", ">HOG", "'HOG' is unknown");
  refused(GOOD, "<height>12", "<height>-3", "height: one number from 3 to 200");
  refused(GOOD, "<height>12", "<height>12.5", "whole pixels");
  refused(GOOD, "0 3 3 3", "0 4 3 3", "outside of the window");
  refused(GOOD, "0 3 3 3", "0 3 3 nan", "'nan' is not a number");
  refused(GOOD, "0 -1 0 1", "0 -1 7 1", "feature 7 of 1");
  refused(GOOD, "0 -1 0 1", "0 -2 0 1", "a later one of its tree");
  refused(GOOD, "0 -1 0 1", "0 -1 1", "has 11 numbers");
  refused(GOOD, "-1. 0.5", "-1.", "one leaf more");
  refused(GOOD, "-1. 0.5", "-1. 1e300", "too large");
  refused(HAAR, "1 0 0 0.5", "1 0 0 1e300", "internalNodes: a number is too large");
  refused(GOOD, "<stageThreshold>0.25</stageThreshold>", "", "stage");
  refused(GOOD, "<featureType>LBP</featureType>", "", "featureType must stand before");
  refused(GOOD, "opencv-cascade-classifier", "opencv-haar-classifier", "OpenCV 1");
  refused(GOOD, "</cascade>", "", "hasn't begun");
  refused(HAAR, "1 0 0 0.5", "5 0 0 0.5", "a later one");
  refused(HAAR, "-1 -2 0", "1 -2 0", "a later one");
  refused(HAAR, "<tilted>0", "<tilted>1", "tilted");
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, parse(""));
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, parse("id,x_m,y_m\n1,2,3\n"));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "this is not a cascade"), err.text);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_cascade_load("not-there.xml", &cascade, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "not-there.xml"));
}

// Cut anywhere, or any byte of it changed: read or refused, and nothing is left behind.
TEST(damage) {
  const char good[] = GOOD;
  for (size_t n = 0; n + 20 < sizeof good; n++) {
    wm_cascade_free(&cascade);
    TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_cascade_parse(good, n, "cut.xml", &cascade, &err));
    TEST_ASSERT_GREATER_THAN(10, strlen(err.text));
  }
  static const char kBytes[] = {'<', '>', '/', '9', '-', ' ', '\0', '\xff'};
  for (size_t n = 0; n + 1 < sizeof good; n++)
    for (size_t k = 0; k < sizeof kBytes; k++) {
      char changed[sizeof good];
      memcpy(changed, good, sizeof good);
      changed[n] = kBytes[k];
      wm_cascade_free(&cascade);
      (void)wm_cascade_parse(changed, sizeof good - 1, "changed.xml", &cascade, &err);
    }
}
