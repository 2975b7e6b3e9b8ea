// SPDX-License-Identifier: Apache-2.0
#include "images/pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "images/jpeg.h"
#include "images/picture.h"

namespace wm::images {

bool write_jpeg(const std::string &path, const Picture8 &picture, int quality, std::string &error) {
  Jpeg jpeg;
  if (!jpeg.compress(picture, quality, error)) return error = path + ": " + error, false;
  FILE *file = std::fopen(path.c_str(), "wb");
  const bool fine = file && std::fwrite(jpeg.data(), 1, jpeg.size(), file) == jpeg.size();
  if ((file && std::fclose(file) != 0) || !fine) return error = path + ": cannot be written", false;
  return true;
}

Picture8 shrunk(const Picture8 &picture, int width) {
  if (width >= picture.width || width < 1) return picture;
  const double step = static_cast<double>(picture.width) / width;
  Picture8 out{width, std::max(static_cast<int>(std::lround(picture.height / step)), 1), picture.channels, {}};
  out.bytes.resize(static_cast<size_t>(out.width) * static_cast<size_t>(out.height) *
                   static_cast<size_t>(out.channels));
  size_t to = 0;
  for (int y = 0; y < out.height; y++) {
    const int y0 = std::min(static_cast<int>(y * step), picture.height - 1);
    const int y1 = std::clamp(static_cast<int>((y + 1) * step), y0 + 1, picture.height);
    for (int x = 0; x < out.width; x++) {
      const int x0 = static_cast<int>(x * step),
                x1 = std::clamp(static_cast<int>((x + 1) * step), x0 + 1, picture.width);
      for (int c = 0; c < out.channels; c++) {
        int sum = 0;
        for (int v = y0; v < y1; v++)
          for (int u = x0; u < x1; u++)
            sum +=
                picture.bytes[(static_cast<size_t>(v) * static_cast<size_t>(picture.width) + static_cast<size_t>(u)) *
                                  static_cast<size_t>(picture.channels) +
                              static_cast<size_t>(c)];
        const int n = (y1 - y0) * (x1 - x0);
        out.bytes[to++] = static_cast<uint8_t>((sum + n / 2) / n);
      }
    }
  }
  return out;
}

Picture8 contact_sheet(const std::vector<SheetEntry> &entries, int columns, int cell_width) {
  constexpr int kGap = 4, kCaption = 14;
  const int n = static_cast<int>(entries.size());
  columns = std::clamp(columns, 1, std::max(n, 1));
  bool colour = false, captions = false;
  int cell_height = 1;
  std::vector<Picture8> cells;
  for (const SheetEntry &entry : entries) {
    cells.push_back(shrunk(entry.picture, cell_width));
    cell_height = std::max(cell_height, cells.back().height);
    colour = colour || entry.picture.channels == 3;
    captions = captions || !entry.caption.empty();
  }
  const int pitch_x = cell_width + kGap, pitch_y = cell_height + kGap + (captions ? kCaption : 0);
  const int rows = (n + columns - 1) / columns;
  Picture8 out{kGap + columns * pitch_x, kGap + std::max(rows, 1) * pitch_y, colour ? 3 : 1, {}};
  const auto channels = static_cast<size_t>(out.channels), width = static_cast<size_t>(out.width);
  out.bytes.assign(width * static_cast<size_t>(out.height) * channels, 255);
  auto put = [&](int x, int y, const uint8_t *from, int from_channels) {
    uint8_t *to = &out.bytes[(static_cast<size_t>(y) * width + static_cast<size_t>(x)) * channels];
    for (size_t c = 0; c < channels; c++) to[c] = from[from_channels == 3 ? c : 0];
  };
  for (int i = 0; i < n; i++) {
    const Picture8 &cell = cells[static_cast<size_t>(i)];
    const int left = kGap + i % columns * pitch_x, top = kGap + i / columns * pitch_y;
    for (int y = 0; y < cell.height; y++)
      for (int x = 0; x < std::min(cell.width, cell_width); x++)
        put(left + x, top + y,
            &cell.bytes[(static_cast<size_t>(y) * static_cast<size_t>(cell.width) + static_cast<size_t>(x)) *
                        static_cast<size_t>(cell.channels)],
            cell.channels);
    if (entries[static_cast<size_t>(i)].caption.empty()) continue;
    Picture text(cell_width, kCaption, 1, 1.0f);
    draw_text(entries[static_cast<size_t>(i)].caption.c_str(), 1, kCaption - 3, 8, Colour(0.0f), text);
    for (int y = 0; y < kCaption; y++) {
      for (int x = 0; x < cell_width; x++) {
        const auto grey = static_cast<uint8_t>(text.at(x, y) * 255);
        put(left + x, top + cell_height + y, &grey, 1);
      }
    }
  }
  return out;
}

}  // namespace wm::images
