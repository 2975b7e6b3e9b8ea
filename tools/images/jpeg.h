// SPDX-License-Identifier: Apache-2.0
// JPEG by libjpeg-turbo. The same picture and quality give the same bytes.
#pragma once

#include <string>

#include "images/pictures.h"

namespace wm::images {

class Jpeg {
 public:
  Jpeg() = default;
  ~Jpeg();
  Jpeg(const Jpeg &) = delete;
  Jpeg &operator=(const Jpeg &) = delete;

  // Quality 1 to 100; colour with 4:2:0, grey as grey. The bytes stay until the next call.
  bool compress(const Picture8 &picture, int quality, std::string &error);
  const uint8_t *data() const { return bytes_; }
  size_t size() const { return size_; }

 private:
  void *handle_ = nullptr;
  uint8_t *bytes_ = nullptr;
  unsigned long size_ = 0;
};

// To grey. A damaged picture is decoded as far as possible. False and a text: not a JPEG that can be read.
bool decode_jpeg(const std::vector<uint8_t> &bytes, Picture8 &grey, std::string &error);

}  // namespace wm::images
