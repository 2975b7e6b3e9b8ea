// SPDX-License-Identifier: Apache-2.0
// A video becomes what the robot's own reader reads: MJPEG in AVI, and a CSV of stamps.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace wm::tools {

struct ImportWish {
  std::filesystem::path video, stamps, out;  // stamps: empty: beside the video, or the container's own
  std::string camera;
  int64_t begin_ns = 0;  // of the first picture, where the stamps are the container's
  int quality = 90;
};

struct Imported {
  uint64_t pictures = 0, damaged = 0, interlaced = 0;
  int turned_deg = 0;  // clockwise, by which viewers turn the pictures, which are as stored
  std::string codec;
  int width = 0, height = 0;
  double seconds = 0;       // from the first to the last stamp
  bool own_stamps = false;  // a CSV's; else the container's
  std::filesystem::path made;
};

// Writes OUT/video/CAMERA.avi and .csv, whole or not at all. Throws Failure: unreadable, rows and pictures that don't
// agree in number, stamps that don't rise, something there already.
Imported import_video(const ImportWish &wish);

}  // namespace wm::tools
