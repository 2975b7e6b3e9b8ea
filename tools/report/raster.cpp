// SPDX-License-Identifier: Apache-2.0
// The raster map as a PNG that a page can carry.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "common/failure.h"
#include "common/yaml.h"
#include "report/data.h"
#include "report/png.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr size_t kImageAtMost = 1'200'000;  // bytes

std::string read_all(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw Failure(file.string() + ": can't be opened; map.yaml names it");
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

size_t index(int x, int y, int width) {
  return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
}

// A binary PGM, made smaller to at most 1600 px a side: each pixel the darkest of those that it stands for, so that
// thin walls stay.
Raster pgm_to_png(const std::string &pgm, const fs::path &file, Raster raster) {
  std::istringstream in(pgm);
  std::string magic;
  const auto number = [&in] {
    int value = 0;
    while ((in >> std::ws).peek() == '#') in.ignore(4096, '\n');
    in >> value;
    return value;
  };
  in >> magic;
  const int width = number();
  const int height = number();
  const int white = number();
  in.get();
  const auto offset = static_cast<size_t>(in.tellg());
  if (magic != "P5" || width <= 0 || height <= 0 || width > 30000 || height > 30000 || white != 255 ||
      pgm.size() < offset + static_cast<size_t>(width) * static_cast<size_t>(height))
    throw Failure(file.string() + ": is not a binary PGM (P5) of 8 bits, or is cut short");
  const int times = (std::max(width, height) + 1599) / 1600;
  const int w = (width + times - 1) / times;
  const int h = (height + times - 1) / times;
  std::vector<uint8_t> grey(index(0, h, w), 255);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      uint8_t &cell = grey[index(x / times, y / times, w)];
      cell = std::min(cell, static_cast<uint8_t>(pgm[offset + index(x, y, width)]));
    }
  // The last cells may reach beyond the picture: to the right, and below its lowest row.
  raster.width = w * times;
  raster.height = h * times;
  const double below_m = (h * times - height) * raster.resolution_m;
  raster.origin.x() += std::sin(raster.origin.z()) * below_m;
  raster.origin.y() -= std::cos(raster.origin.z()) * below_m;
  raster.png = grey_png(grey, w, h);
  return raster;
}

}  // namespace

std::optional<Raster> load_raster(const fs::path &recording, std::vector<std::string> *notes) {
  const fs::path folder = recording / "map";
  if (!fs::exists(folder / "map.yaml")) return std::nullopt;
  const Yaml map(folder / "map.yaml");
  const auto origin = map.numbers("origin");
  Raster out{"", 0, 0, std::atof(map.text("resolution").c_str()), Eigen::Vector3d::Zero()};
  if (origin.size() != 3 || !(out.resolution_m > 0))
    throw Failure((folder / "map.yaml").string() + ": resolution (m/px, above 0) and origin [x, y, yaw] are needed");
  out.origin = {origin[0], origin[1], origin[2]};
  const fs::path image = folder / map.text("image");
  const std::string bytes = read_all(image);
  if (bytes.size() > 24 && bytes.starts_with("\x89PNG")) {
    const auto size = [&bytes](size_t at) {
      int value = 0;
      for (size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
      return value;
    };
    out.width = size(16);
    out.height = size(20);
    out.png = bytes;
  } else {
    out = pgm_to_png(bytes, image, out);
  }
  if (out.png.size() <= kImageAtMost) return out;
  notes->push_back("The map's image is larger than 1.2 MB and was left out, so that this page stays light.");
  return std::nullopt;
}

}  // namespace wm::tools
