// SPDX-License-Identifier: Apache-2.0
// Grey pictures at the desk: JPEG, PNG and PGM files, folders of them, and the cameras of recordings, one after
// another.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace wm::tools {

struct GreyPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;  // row 0 is the top

  [[nodiscard]] uint8_t at(int x, int y) const {
    return pixels[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
};

// A JPEG, PNG or PGM by what its bytes say. Throws Failure.
GreyPicture load_picture(const std::filesystem::path &file);

// The pictures of a folder in the order of their names, or the one picture itself. Throws Failure: none there.
std::vector<std::filesystem::path> picture_files(const std::filesystem::path &from);

// Calls `look(name, picture)` for each picture of `from` until it returns false: a folder of pictures in the order of
// their names, one picture, or a recording's folder (with `camera`, "" for the only one). `every` above 1 passes over
// the others. A file of a folder that can't be read is handed on as a picture without pixels, and given to `broken`
// with the reason. Throws Failure: nothing there, or nothing of what is there can be read.
using PictureTaker = std::function<bool(const std::string &name, const GreyPicture &picture)>;
using BrokenTaker = std::function<void(const std::string &reason)>;
void each_picture(const std::filesystem::path &from, const std::string &camera, int every, const PictureTaker &look,
                  const BrokenTaker &broken = nullptr);

}  // namespace wm::tools
