// SPDX-License-Identifier: Apache-2.0
// PNG by libpng's simplified interface.
#include <png.h>

#include <cmath>
#include <cstring>

#include "images/picture.h"
#include "images/pictures.h"

namespace wm::images {

namespace {

float from_srgb(float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); }

}  // namespace

bool read_png(const std::string &path, bool linear, Picture &out, std::string &error) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, path.c_str())) {
    error = path + ": " + image.message;
    return false;
  }
  const bool colour = (image.format & PNG_FORMAT_FLAG_COLOR) != 0;
  if (image.width > 16384 || image.height > 16384) {
    png_image_free(&image);
    error = path + ": larger than 16384 pixels a side";
    return false;
  }
  image.format = colour ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  std::vector<uint8_t> bytes(PNG_IMAGE_SIZE(image));
  const png_color white{255, 255, 255};
  if (!png_image_finish_read(&image, &white, bytes.data(), 0, nullptr)) {
    error = path + ": " + image.message;
    return false;
  }
  float table[256];
  for (int i = 0; i < 256; i++) {
    const float v = static_cast<float>(i) / 255.0f;
    table[i] = linear ? v : from_srgb(v);
  }
  out = Picture(static_cast<int>(image.width), static_cast<int>(image.height), colour ? 3 : 1);
  for (size_t i = 0; i < out.values.size(); i++) out.values[i] = table[bytes[i]];
  return true;
}

bool write_png(const std::string &path, const Picture8 &picture, std::string &error) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = picture.channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  if (picture.bytes.size() != PNG_IMAGE_SIZE(image) || picture.bytes.empty()) {
    error = path + ": the picture is empty or its size doesn't fit its bytes";
    return false;
  }
  if (!png_image_write_to_file(&image, path.c_str(), 0, picture.bytes.data(), 0, nullptr)) {
    error = path + ": " + image.message;
    return false;
  }
  return true;
}

}  // namespace wm::images
