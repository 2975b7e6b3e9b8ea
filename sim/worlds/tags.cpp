// SPDX-License-Identifier: Apache-2.0
#include "worlds/tags.h"

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

#include <memory>

#include "waymark/mr_code.h"

namespace wm::sim {

int tag36h11_count() {
  const std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(), tag36h11_destroy);
  return static_cast<int>(family->ncodes);
}

images::Picture tag36h11_picture(int id, int module_px) {
  const std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(), tag36h11_destroy);
  const int width = family->total_width, rim = (family->total_width - family->width_at_border) / 2;
  constexpr float kWhite = 0.85f, kBlack = 0.04f;
  images::Picture picture(width * module_px, width * module_px, 1, kWhite);
  const auto module = [&](int x, int y, float value) {
    for (int j = 0; j < module_px; j++)
      for (int i = 0; i < module_px; i++) picture.at(x * module_px + i, y * module_px + j) = value;
  };
  for (int y = rim; y < width - rim; y++)
    for (int x = rim; x < width - rim; x++) module(x, y, kBlack);
  // Bits from the most significant one on; their places are counted from the black square's corner, here from the lower
  // right one: ArUco and the recordings read this family the other way up than AprilTag's own pictures.
  const uint64_t code = family->codes[id];
  for (uint32_t bit = 0; bit < family->nbits; bit++)
    if (code >> (family->nbits - 1 - bit) & 1)
      module(width - 1 - rim - static_cast<int>(family->bit_x[bit]),
             width - 1 - rim - static_cast<int>(family->bit_y[bit]), kWhite);
  return picture;
}

images::Picture mr_picture(int id, int size_px) {
  constexpr float kWhite = 0.85f, kBlack = 0.04f;
  constexpr int kFine = 4;  // samples along each side of a pixel
  const uint64_t modules = wm_mr_encode(static_cast<uint32_t>(id));
  images::Picture picture(size_px, size_px, 1, kWhite);
  for (int y = 0; y < size_px; y++)
    for (int x = 0; x < size_px; x++) {
      int black = 0;
      for (int k = 0; k < kFine * kFine; k++) {
        const int column = k % kFine, row = k / kFine;
        black += wm_mr_ink(modules, kMrSheet * ((x + (column + 0.5) / kFine) / size_px - 0.5),
                           kMrSheet * ((y + (row + 0.5) / kFine) / size_px - 0.5)) == 1;
      }
      picture.at(x, y) = kWhite + (kBlack - kWhite) * static_cast<float>(black) / (kFine * kFine);
    }
  return picture;
}

}  // namespace wm::sim
