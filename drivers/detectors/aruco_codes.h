// SPDX-License-Identifier: Apache-2.0
// Codes of the ArUco dictionaries: bits row by row from the upper left one, the highest first, 1: white.
#ifndef WAYMARK_DRIVERS_ARUCO_CODES_H
#define WAYMARK_DRIVERS_ARUCO_CODES_H

#include <stdint.h>

#define ARUCO_CODES_MAX 1000       // of the largest predefined dictionaries
#define ARUCO_ORIGINAL_CODES 1024  // 10 bits of identity

// OpenCV's DICT_4X4_1000, ... DICT_7X7_1000; the smaller dictionaries are the first 50, 100, 250 of these.
extern const uint64_t aruco_codes[4][ARUCO_CODES_MAX];
// DICT_ARUCO_ORIGINAL: two bits of the identity a row.
uint64_t aruco_original_code(uint32_t id);

#endif
