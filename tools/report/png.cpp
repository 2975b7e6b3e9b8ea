// SPDX-License-Identifier: Apache-2.0
#include "report/png.h"

#include <algorithm>

namespace wm::tools {
namespace {

std::string big_endian(uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

uint32_t crc32(const std::string &bytes) {  // PNG specification, annex D
  uint32_t crc = 0xffffffffu;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0xedb88320u : 0u);
  }
  return ~crc;
}

uint32_t adler32(const std::string &bytes) {  // RFC 1950
  uint32_t a = 1;
  uint32_t b = 0;
  for (const char byte : bytes) {
    a = (a + static_cast<unsigned char>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  return b << 16 | a;
}

std::string chunk(const std::string &type, const std::string &data) {
  return big_endian(static_cast<uint32_t>(data.size())) + type + data + big_endian(crc32(type + data));
}

// Rows of packed pixels, the first of each byte in its high bits; `level` gives a pixel of the picture by its index.
template <class Level>
std::string packed_rows(int width, int height, int bits, const Level &level) {
  const int each = 8 / bits;
  std::string rows;
  for (int y = 0; y < height; ++y) {
    rows += '\0';  // filter type: none
    for (int x = 0; x < width; x += each) {
      unsigned packed = 0;
      for (int k = 0; k < each; ++k) {
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x + k);
        packed = packed << bits | (x + k < width ? level(at) : 0u);
      }
      rows += static_cast<char>(packed);
    }
  }
  return rows;
}

std::string file(const std::string &rows, int width, int height, int bits, int colour_type,
                 const std::string &palette) {
  std::string deflated = "\x78\x01";
  for (size_t at = 0; at < rows.size(); at += 65535) {
    const size_t size = std::min<size_t>(65535, rows.size() - at);
    const auto low = [](size_t value) { return static_cast<char>(value & 0xff); };
    deflated += static_cast<char>(at + size == rows.size() ? 1 : 0);
    deflated += {low(size), low(size >> 8), low(~size), low(~size >> 8)};
    deflated += rows.substr(at, size);
  }
  deflated += big_endian(adler32(rows));
  const std::string kind = {static_cast<char>(bits), static_cast<char>(colour_type), 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", big_endian(static_cast<uint32_t>(width)) + big_endian(static_cast<uint32_t>(height)) + kind) +
         palette + chunk("IDAT", deflated) + chunk("IEND", "");
}

}  // namespace

std::string grey_png(const std::vector<uint8_t> &grey, int width, int height) {
  return file(packed_rows(width, height, 2, [&grey](size_t at) { return grey[at] / 64u; }), width, height, 2, 0, "");
}

std::string mask_png(const std::vector<uint8_t> &mask, int width, int height, uint32_t colour) {
  const std::string rgb = big_endian(colour << 8).substr(0, 3);
  return file(packed_rows(width, height, 1, [&mask](size_t at) { return mask[at] != 0 ? 1u : 0u; }), width, height, 1,
              3, chunk("PLTE", std::string(3, '\0') + rgb) + chunk("tRNS", std::string("\0\xff", 2)));
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
