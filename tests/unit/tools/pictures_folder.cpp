// SPDX-License-Identifier: Apache-2.0
// A folder of photos as people have it: empty and broken files and other files in it, and for boards a photo that lies
// on its side. What can't be taken is named, and the others are used.
#include <algorithm>
#include <filesystem>

#include "common/failure.h"
#include "common/grey_picture.h"
#include "common/suite.h"
#include "made.h"
#ifdef WM_HAS_CALIBRATE
#include "calibrate/board_pictures.h"
#endif

namespace {

std::string pgm(int width, int height, uint8_t level) {
  return made::format("P5\n%d %d\n255\n", width, height) +
         std::string(static_cast<size_t>(width) * static_cast<size_t>(height), static_cast<char>(level));
}

bool names(const std::vector<std::string> &lines, const std::string &text) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string &l) { return l.find(text) != std::string::npos; });
}

TEST(test_files_that_cannot_be_read_are_named) {
  const made::Folder folder;
  folder.write("a.pgm", pgm(8, 6, 10));
  folder.write("b.jpg", "");
  folder.write("c.png", "\x89PNG\r\n\x1a\n cut off");
  folder.write("d.jpg", "\xFF\xD8\xFF\xE0 cut off");
  folder.write("e.JPG", "a text by another name");
  folder.write("f.pgm", pgm(6, 8, 20));
  folder.write("notes.txt", "not a picture, and not named so");
  std::vector<std::string> seen, broken;
  wm::tools::each_picture(
      folder.path(), "", 1,
      [&](const std::string &name, const wm::tools::GreyPicture &picture) {
        seen.push_back(name + (picture.pixels.empty() ? " empty" : ""));
        return true;
      },
      [&](const std::string &reason) { broken.push_back(reason); });
  const std::vector<std::string> wanted{"a.pgm", "b.jpg empty", "c.png empty", "d.jpg empty", "e.JPG empty", "f.pgm"};
  TEST_ASSERT_TRUE(seen == wanted);
  TEST_ASSERT_EQUAL(4, broken.size());
  TEST_ASSERT_TRUE(names(broken, "b.jpg: is empty"));
  TEST_ASSERT_TRUE(names(broken, "c.png: a broken PNG: it is cut off, or its bytes are damaged"));
  TEST_ASSERT_TRUE(names(broken, "d.jpg: "));
  TEST_ASSERT_TRUE(names(broken, "e.JPG: neither PNG nor PGM"));
}

TEST(test_a_folder_of_broken_files_is_refused) {
  const made::Folder folder;
  folder.write("a.jpg", "");
  folder.write("b.png", "");
  made::refused(": is empty", [&] {
    wm::tools::each_picture(folder.path(), "", 1, [](const auto &, const auto &) { return true; });
  });
}

#ifdef WM_HAS_CALIBRATE

// A board of 10 x 7 squares seen from straight ahead, its upper left corner at (x, y); pixels by their middle's share.
std::string board(int width, int height, double square, double x, double y) {
  std::string out = made::format("P5\n%d %d\n255\n", width, height);
  const auto level = [&](double u, double v) {
    const int i = static_cast<int>(std::floor((u - x) / square)), j = static_cast<int>(std::floor((v - y) / square));
    return i >= 0 && i < 10 && j >= 0 && j < 7 && (i + j) % 2 == 0 ? 30.0 : 220.0;
  };
  for (int v = 0; v < height; v++)
    for (int u = 0; u < width; u++) {
      double sum = 0;
      for (int k = 0; k < 16; k++) sum += level(u - 0.375 + 0.25 * (k % 4), v - 0.375 + 0.25 * (k / 4));
      out += static_cast<char>(static_cast<uint8_t>(std::lround(sum / 16)));
    }
  return out;
}

// One photo in portrait, whatever its place in the order.
TEST(test_a_board_in_portrait_is_left_out) {
  for (const char *odd : {"p0.pgm", "p3.pgm", "p9.pgm"}) {
    const made::Folder folder;
    for (int i = 1; i < 5; i++)
      if (const std::string name = made::format("p%d.pgm", 2 * i); true)
        folder.write(name, board(640, 480, 38.3 + i, 60.3 + 9 * i, 50.2 + 11 * i));
    folder.write(odd, board(480, 640, 36.7, 50.3, 120.6));
    folder.write("p5.jpg", "");
    wm::calibrate::Board what;
    what.columns = 9;
    what.rows = 6;
    const wm::calibrate::BoardPictures found = wm::calibrate::look_for_boards(folder.path().string(), "", 1, what);
    TEST_ASSERT_EQUAL(4, found.views.size());
    TEST_ASSERT_EQUAL(6, found.pictures);
    TEST_ASSERT_EQUAL(640, found.picture.width);
    TEST_ASSERT_TRUE_MESSAGE(names(found.notes, std::string(odd) + " is left out: it is 480x640, most are 640x480"),
                             odd);
    TEST_ASSERT_TRUE(names(found.notes, "p5.jpg: is empty; it is left out"));
  }
}

#endif

}  // namespace
