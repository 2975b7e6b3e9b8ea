// SPDX-License-Identifier: Apache-2.0
#include "images/jpeg.h"

#include <turbojpeg.h>

#include <algorithm>
#include <memory>

namespace wm::images {

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

bool decode_jpeg(const std::vector<uint8_t> &bytes, Picture8 &grey, std::string &error) {
  const std::unique_ptr<void, int (*)(tjhandle)> handle(tjInitDecompress(), tjDestroy);
  int subsampling = 0, space = 0;
  if (tjDecompressHeader3(handle.get(), bytes.data(), bytes.size(), &grey.width, &grey.height, &subsampling, &space) !=
          0 ||
      grey.width < 1 || grey.height < 1 || grey.width > 32768 || grey.height > 32768)
    return error = "not a JPEG that can be read", false;
  grey.channels = 1;
  grey.bytes.resize(static_cast<size_t>(grey.width) * static_cast<size_t>(grey.height));
  if (tjDecompress2(handle.get(), bytes.data(), bytes.size(), grey.bytes.data(), grey.width, 0, grey.height, TJPF_GRAY,
                    0) != 0 &&
      tjGetErrorCode(handle.get()) == TJERR_FATAL)
    return error = tjGetErrorStr2(handle.get()), false;
  return true;
}

}  // namespace wm::images
