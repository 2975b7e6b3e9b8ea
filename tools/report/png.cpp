// SPDX-License-Identifier: Apache-2.0
#include "report/png.h"

#include <png.h>

#include <csetjmp>

#include "common/failure.h"

namespace wm::tools {
namespace {

void append(png_structp png, png_bytep bytes, size_t count) {
  static_cast<std::string *>(png_get_io_ptr(png))->append(reinterpret_cast<const char *>(bytes), count);
}
void flush(png_structp) {}

struct Format {
  int bits, colour_type;
  png_color palette[2];  // of colour type PNG_COLOR_TYPE_PALETTE: see-through and opaque
};

// `pixels`: a byte each, row 0 at the top, 0 .. 2^bits - 1. libpng fails by longjmp: nothing here has a destructor.
bool write(const uint8_t *pixels, int width, int height, const Format &format, std::string *out) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, out, append, flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), format.bits,
               format.colour_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (format.colour_type == PNG_COLOR_TYPE_PALETTE) {
    png_byte alpha[2] = {0, 255};
    png_set_PLTE(png, info, format.palette, 2);
    png_set_tRNS(png, info, alpha, 2, nullptr);
  }
  png_write_info(png, info);
  png_set_packing(png);
  for (int y = 0; y < height; y++) png_write_row(png, pixels + static_cast<size_t>(y) * static_cast<size_t>(width));
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

std::string png_of(std::vector<uint8_t> pixels, int width, int height, const Format &format) {
  std::string out;
  if (!write(pixels.data(), width, height, format, &out))
    throw Failure("libpng could not make a picture of the report");
  return out;
}

}  // namespace

std::string grey_png(const std::vector<uint8_t> &grey, int width, int height) {
  std::vector<uint8_t> levels = grey;
  for (uint8_t &level : levels) level /= 64;
  return png_of(std::move(levels), width, height, {2, PNG_COLOR_TYPE_GRAY, {}});
}

std::string mask_png(const std::vector<uint8_t> &mask, int width, int height, uint32_t colour) {
  std::vector<uint8_t> bits = mask;
  for (uint8_t &bit : bits) bit = bit != 0 ? 1 : 0;
  const png_color shown{static_cast<png_byte>(colour >> 16), static_cast<png_byte>(colour >> 8),
                        static_cast<png_byte>(colour)};
  return png_of(std::move(bits), width, height, {1, PNG_COLOR_TYPE_PALETTE, {{0, 0, 0}, shown}});
}

std::string base64(const std::string &bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63u];
  }
  return out;
}

}  // namespace wm::tools
