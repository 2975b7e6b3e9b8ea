// SPDX-License-Identifier: Apache-2.0
#include "simulate/render/jpeg.h"

#include <turbojpeg.h>

#include <algorithm>

namespace wm::render {

Jpeg::~Jpeg() {
  if (bytes_) tjFree(bytes_);
  if (handle_) tjDestroy(handle_);
}

bool Jpeg::compress(const Picture8 &picture, int quality, std::string &error) {
  const size_t wanted =
      static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height) * static_cast<size_t>(picture.channels);
  if (picture.width < 1 || picture.height < 1 || picture.bytes.size() != wanted)
    return error = "the picture is empty or its size doesn't fit its bytes", false;
  if (!handle_) handle_ = tjInitCompress();
  if (!handle_) return error = "no JPEG compressor", false;
  const bool colour = picture.channels == 3;
  if (tjCompress2(handle_, picture.bytes.data(), picture.width, 0, picture.height, colour ? TJPF_RGB : TJPF_GRAY,
                  &bytes_, &size_, colour ? TJSAMP_420 : TJSAMP_GRAY, std::clamp(quality, 1, 100), 0) != 0)
    return error = tjGetErrorStr2(handle_), false;
  return true;
}

}  // namespace wm::render
