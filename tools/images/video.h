// SPDX-License-Identifier: Apache-2.0
// Videos as AVI files of our own writing (RIFF: hdrl, movi, idx1): MJPEG, or grey without loss. Players, OpenCV and
// ffmpeg read them. At most 4 GB: the format's sizes are 32 bits.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "images/jpeg.h"
#include "images/pictures.h"

namespace wm::images {

class AviWriter {
 public:
  enum class Coding { mjpeg, grey };  // grey: FOURCC "Y800", a byte a pixel, rows from the top

  AviWriter() = default;
  ~AviWriter();  // closes; an error is lost then: call close()
  AviWriter(const AviWriter &) = delete;
  AviWriter &operator=(const AviWriter &) = delete;

  // `rate_hz` is only for players: true stamps are in the CSV beside it.
  bool open(const std::string &path, Coding coding, int width, int height, double rate_hz, std::string &error);
  // MJPEG: of `quality` 1 to 100. Grey: colour pictures are refused. The picture must have the size of the video.
  bool add(const Picture8 &picture, int quality, std::string &error);
  // A JPEG that is there already.
  bool add_jpeg(const uint8_t *data, size_t size, std::string &error);
  // Writes the index and the sizes.
  bool close(std::string &error);

  uint32_t frames() const { return static_cast<uint32_t>(index_.size()); }
  uint64_t bytes() const { return position_; }

 private:
  struct Chunk {
    uint32_t offset, size;
  };
  bool put(const void *data, size_t size);
  bool add_chunk(const uint8_t *data, size_t size, std::string &error);
  std::vector<uint8_t> header(uint32_t movi_bytes) const;

  FILE *file_ = nullptr;
  std::string path_;
  Coding coding_ = Coding::mjpeg;
  int width_ = 0, height_ = 0;
  double rate_hz_ = 0;
  uint64_t position_ = 0;
  uint32_t largest_ = 0;
  std::vector<Chunk> index_;
  Jpeg jpeg_;
};

// JPEG quality that keeps the mean size of frames near a wish: a step after each frame, within [low, high].
class QualityControl {
 public:
  QualityControl(double bytes_a_frame, int low, int high);
  int quality() const { return static_cast<int>(quality_ + 0.5); }
  void wrote(size_t bytes);

 private:
  double wanted_, low_, high_, quality_;
};

}  // namespace wm::images
