// SPDX-License-Identifier: Apache-2.0
#include "waymark/detectors.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <stdlib.h>
#include <string.h>

#include "aruco_codes.h"

typedef struct april_family {
  const char *name;
  apriltag_family_t *(*create)(void);
  void (*destroy)(apriltag_family_t *);
  int32_t half_turned;  // the four oldest families are read upside down against AprilTag's own pictures, as ArUco does
} april_family;

static const april_family kApril[] = {
    {"tag16h5", tag16h5_create, tag16h5_destroy, 1},
    {"tag25h9", tag25h9_create, tag25h9_destroy, 1},
    {"tag36h10", tag36h10_create, tag36h10_destroy, 1},
    {"tag36h11", tag36h11_create, tag36h11_destroy, 1},
    {"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy, 0},
    {"tagCircle49h12", tagCircle49h12_create, tagCircle49h12_destroy, 0},
    {"tagCustom48h12", tagCustom48h12_create, tagCustom48h12_destroy, 0},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy, 0},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy, 0},
};

typedef struct aruco_family {
  const char *name;
  int32_t across;    // modules of the code
  uint32_t count;    // 0: the original ones
  int32_t distance;  // twice OpenCV's maxCorrectionBits and one
} aruco_family;

static const aruco_family kAruco[] = {
    {"aruco_4x4_50", 4, 50, 3},      {"aruco_4x4_100", 4, 100, 3},   {"aruco_4x4_250", 4, 250, 3},
    {"aruco_4x4_1000", 4, 1000, 1},  {"aruco_5x5_50", 5, 50, 7},     {"aruco_5x5_100", 5, 100, 7},
    {"aruco_5x5_250", 5, 250, 5},    {"aruco_5x5_1000", 5, 1000, 5}, {"aruco_6x6_50", 6, 50, 13},
    {"aruco_6x6_100", 6, 100, 11},   {"aruco_6x6_250", 6, 250, 11},  {"aruco_6x6_1000", 6, 1000, 9},
    {"aruco_7x7_50", 7, 50, 19},     {"aruco_7x7_100", 7, 100, 17},  {"aruco_7x7_250", 7, 250, 17},
    {"aruco_7x7_1000", 7, 1000, 13}, {"aruco_original", 5, 0, 1},
};

const char *const wm_marker_family_names[] = {
    "calibration",      "tag16h5",          "tag25h9",        "tag36h10",
    "tag36h11",         "tagCircle21h7",    "tagCircle49h12", "tagCustom48h12",
    "tagStandard41h12", "tagStandard52h13", "aruco_4x4_50",   "aruco_4x4_100",
    "aruco_4x4_250",    "aruco_4x4_1000",   "aruco_5x5_50",   "aruco_5x5_100",
    "aruco_5x5_250",    "aruco_5x5_1000",   "aruco_6x6_50",   "aruco_6x6_100",
    "aruco_6x6_250",    "aruco_6x6_1000",   "aruco_7x7_50",   "aruco_7x7_100",
    "aruco_7x7_250",    "aruco_7x7_1000",   "aruco_original", NULL};

static uint64_t *make_april(const april_family *from, uint32_t codes_max, wm_square_family *out) {
  apriltag_family_t *family = from->create();
  if (!family) return NULL;
  out->border = family->width_at_border;
  out->is_white_inside = family->reversed_border;
  out->across = family->reversed_border ? family->total_width : family->width_at_border;
  out->bits = (int32_t)family->nbits;
  for (uint32_t i = 0; i < family->nbits; i++) {
    out->x[i] = (int32_t)family->bit_x[i];
    out->y[i] = (int32_t)family->bit_y[i];
  }
  out->count = family->ncodes < codes_max ? family->ncodes : codes_max;
  out->distance = (int32_t)family->h;
  out->half_turned = from->half_turned;
  uint64_t *codes = malloc(out->count * sizeof *codes);
  if (codes) memcpy(codes, family->codes, out->count * sizeof *codes);
  from->destroy(family);
  return codes;
}

static uint64_t *make_aruco(const aruco_family *from, uint32_t codes_max, wm_square_family *out) {
  out->border = out->across = from->across + 2;
  out->bits = from->across * from->across;
  for (int32_t i = 0; i < out->bits; i++) {
    out->x[i] = i % from->across + 1;
    out->y[i] = i / from->across + 1;
  }
  const uint32_t all = from->count ? from->count : ARUCO_ORIGINAL_CODES;
  out->count = all < codes_max ? all : codes_max;
  out->distance = from->distance;
  uint64_t *codes = malloc(out->count * sizeof *codes);
  for (uint32_t i = 0; codes && i < out->count; i++)
    codes[i] = from->count ? aruco_codes[from->across - 4][i] : aruco_original_code(i);
  return codes;
}

int wm_marker_family_make(const char *name, uint32_t codes_max, wm_square_family *out, uint64_t **memory) {
  memset(out, 0, sizeof *out);
  *memory = NULL;
  for (size_t i = 0; i < sizeof kApril / sizeof kApril[0]; i++)
    if (strcmp(kApril[i].name, name) == 0) *memory = make_april(&kApril[i], codes_max, out);
  for (size_t i = 0; i < sizeof kAruco / sizeof kAruco[0]; i++)
    if (strcmp(kAruco[i].name, name) == 0) *memory = make_aruco(&kAruco[i], codes_max, out);
  out->codes = *memory;
  return *memory != NULL;
}
