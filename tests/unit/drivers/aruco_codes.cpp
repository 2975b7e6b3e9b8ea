// SPDX-License-Identifier: Apache-2.0
// The ArUco codes are OpenCV's: by a checksum, and code by code where OpenCV is (libopencv-contrib-dev). The table is
// made by it, too: aruco_codes write > drivers/detectors/aruco_codes.c.
#ifdef WM_HAS_ARUCO
#include <opencv2/aruco.hpp>
#include <string>
#endif

#include <algorithm>
#include <bit>

extern "C" {
#include "aruco_codes.h"
}
#include "common/suite.h"
#include "waymark/detectors.h"

namespace {

// FNV-1a over the codes' bytes, the lowest first.
uint64_t checksum() {
  uint64_t sum = 0xcbf29ce484222325;
  for (const auto &dictionary : aruco_codes)
    for (const uint64_t code : dictionary)
      for (int i = 0; i < 8; i++) sum = (sum ^ (code >> 8 * i & 255)) * 0x100000001b3;
  return sum;
}

TEST(the_table_is_what_was_made) { TEST_ASSERT_EQUAL_HEX64(UINT64_C(0xC5DB3C93F958064A), checksum()); }

// Codes of one family, in all rotations, have the stated least distance. It bounds the correctable modules.
TEST(distances_are_as_said) {
  for (const char *const *name = wm_marker_family_names + 1; *name; name++) {
    wm_square_family family;
    uint64_t *codes;
    TEST_ASSERT_TRUE(wm_marker_family_make(*name, 600, &family, &codes));
    int least = 64;
    for (int turns = 0; turns < 4; turns++) {
      uint8_t place[WM_SQUARE_BITS_MAX] = {};  // of bit i in the turned code
      for (int i = 0; i < family.bits; i++) {
        int x = family.x[i], y = family.y[i];
        for (int k = 0; k < turns; k++) {
          const int right = x;
          x = family.border - 1 - y;
          y = right;
        }
        for (int j = 0; j < family.bits; j++)
          if (family.x[j] == x && family.y[j] == y) place[i] = static_cast<uint8_t>(j);
      }
      for (uint32_t a = 0; a < family.count; a++) {
        uint64_t turned = 0;
        for (int i = 0; i < family.bits; i++)
          turned |= (codes[a] >> (family.bits - 1 - i) & 1) << (family.bits - 1 - place[i]);
        for (uint32_t b = 0; b <= a; b++)
          if (a != b) least = std::min(least, std::popcount(turned ^ codes[b]));
      }
    }
    std::free(codes);
    if (least < family.distance) std::printf("%s: %d, not %d\n", *name, least, family.distance);
    TEST_ASSERT_GREATER_OR_EQUAL(family.distance, least);
    TEST_ASSERT_LESS_THAN(family.distance, 2 * wm_square_corrected(&family));
  }
}

#ifdef WM_HAS_ARUCO
uint64_t code_of(const cv::aruco::Dictionary &dictionary, int id) {
  const cv::Mat bits =
      cv::aruco::Dictionary::getBitsFromByteList(dictionary.bytesList.rowRange(id, id + 1), dictionary.markerSize);
  uint64_t code = 0;
  for (int y = 0; y < bits.rows; y++)
    for (int x = 0; x < bits.cols; x++) code = code << 1 | bits.at<uint8_t>(y, x);
  return code;
}

TEST(each_code_is_opencvs) {
  for (int across = 4; across <= 7; across++)
    for (int size = 0; size < 4; size++) {
      const auto dictionary = cv::aruco::getPredefinedDictionary(4 * (across - 4) + size);
      for (int id = 0; id < dictionary->bytesList.rows; id++)
        TEST_ASSERT_EQUAL_HEX64(code_of(*dictionary, id), aruco_codes[across - 4][id]);
    }
  const auto original = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_ARUCO_ORIGINAL);
  TEST_ASSERT_EQUAL(ARUCO_ORIGINAL_CODES, original->bytesList.rows);
  for (int id = 0; id < ARUCO_ORIGINAL_CODES; id++)
    TEST_ASSERT_EQUAL_HEX64(code_of(*original, id), aruco_original_code(static_cast<uint32_t>(id)));
}

// The generated file.
void write() {
  std::puts(
      "// SPDX-License-Identifier: Apache-2.0\n"
      "// Made by tests/unit/drivers/aruco_codes.cpp from OpenCV " CV_VERSION
      "'s predefined dictionaries (Apache-2.0); not to be edited.\n"
      "#include \"aruco_codes.h\"\n\n"
      "// clang-format off\n"
      "const uint64_t aruco_codes[4][ARUCO_CODES_MAX] = {");
  for (int across = 4; across <= 7; across++) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(4 * (across - 4) + 3);
    std::string line = "  {";
    for (int id = 0; id < ARUCO_CODES_MAX; id++) {
      char text[32];
      (void)std::snprintf(text, sizeof text, "0x%llx", static_cast<unsigned long long>(code_of(*dictionary, id)));
      if (line.size() + std::strlen(text) + 1 > 118) std::puts(line.c_str()), line = "   ";
      line += text;
      line += id + 1 < ARUCO_CODES_MAX ? "," : "},";
    }
    std::puts(line.c_str());
  }
  std::puts(
      "};\n"
      "// clang-format on\n\n"
      "uint64_t aruco_original_code(uint32_t id) {\n"
      "  static const uint64_t kRows[4] = {0x10, 0x17, 0x09, 0x0e};  // a Hamming code of two bits\n"
      "  uint64_t code = 0;\n"
      "  for (int shift = 8; shift >= 0; shift -= 2) code = code << 5 | kRows[id >> shift & 3];\n"
      "  return code;\n"
      "}");
}
#else
TEST(each_code_is_opencvs) { TEST_IGNORE_MESSAGE("libopencv-contrib-dev wasn't there when this was built"); }
void write() {}
#endif

}  // namespace

int suite_begin(int argc, char **argv) {
  if (argc > 1 && std::strcmp(argv[1], "write") == 0) {
    write();
    return 0;
  }
  return SUITE_RUNS;
}
