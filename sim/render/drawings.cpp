// SPDX-License-Identifier: Apache-2.0
// Things drawn on pictures: posters, doors, windows, shelves.
#include <algorithm>
#include <cmath>

#include "render/dice.h"
#include "render/patterns.h"

namespace wm::render {

namespace {

// A run of dice for drawings that are made one thing after another.
class Draw {
 public:
  explicit Draw(uint64_t seed) : key_(dice(seed)) {}
  double uniform(double low = 0, double high = 1) {
    return low + (high - low) * (static_cast<double>(dice(key_ + count_++) >> 11) * 0x1p-53);
  }
  int number(int n) { return std::min(static_cast<int>(uniform() * n), n - 1); }
  Colour colour() {
    static constexpr Colour kInks[] = {{0.60f, 0.05f, 0.05f}, {0.05f, 0.15f, 0.50f}, {0.80f, 0.60f, 0.05f},
                                       {0.05f, 0.35f, 0.12f}, {0.70f, 0.25f, 0.03f}, {0.30f, 0.08f, 0.35f},
                                       {0.05f, 0.40f, 0.45f}, {0.03f, 0.03f, 0.03f}, {0.75f, 0.72f, 0.65f}};
    return kInks[number(9)];
  }

 private:
  uint64_t key_;
  uint64_t count_ = 0;
};

void frame(double x0, double y0, double x1, double y1, double width, Colour colour, Picture &picture) {
  fill_rect(x0, y0, x1, y0 + width, colour, picture);
  fill_rect(x0, y1 - width, x1, y1, colour, picture);
  fill_rect(x0, y0, x0 + width, y1, colour, picture);
  fill_rect(x1 - width, y0, x1, y1, colour, picture);
}

}  // namespace

Picture poster(uint64_t seed, int width_px, int height_px) {
  Draw draw(seed);
  const double w = width_px, h = height_px, unit = std::min(w, h);
  Picture out(width_px, height_px, 3);
  const Colour paper = draw.number(3) ? Colour(0.78f, 0.76f, 0.70f) : draw.colour();
  fill_rect(0, 0, w, h, paper, out);
  // A large form, a row of bars as if it were text, small forms, a border.
  if (draw.number(2)) {
    fill_disc(w * draw.uniform(0.3, 0.7), h * draw.uniform(0.3, 0.5), unit * draw.uniform(0.2, 0.32), draw.colour(),
              out);
  } else {
    const double x = w * draw.uniform(0.1, 0.3), y = h * draw.uniform(0.1, 0.3);
    fill_rect(x, y, x + w * draw.uniform(0.4, 0.6), y + h * draw.uniform(0.25, 0.4), draw.colour(), out);
  }
  for (int i = 0; i < 4; i++) {
    const double x = w * draw.uniform(0.1, 0.8), y = h * draw.uniform(0.1, 0.65), s = unit * draw.uniform(0.06, 0.16);
    const Colour ink = draw.colour();
    switch (draw.number(3)) {
      case 0: fill_disc(x, y, s, ink, out); break;
      case 1: fill_rect(x - s, y - s * 0.5, x + s, y + s * 0.5, ink, out); break;
      default: line(x - s, y - s, x + s, y + s, s * 0.5, ink, out); break;
    }
  }
  const Colour ink = paper.grey() > 0.2f ? Colour(0.03f) : Colour(0.8f);
  double y = h * 0.72;
  for (int row = 0; row < 5 && y < h * 0.93; row++) {
    const double thick = h * (row == 0 ? 0.045 : 0.02);
    double x = w * 0.1;
    const double end = w * draw.uniform(0.6, 0.9);
    while (x < end) {
      const double word = w * draw.uniform(0.04, 0.14);
      fill_rect(x, y, std::min(x + word, end), y + thick, ink, out);
      x += word + w * 0.02;
    }
    y += thick + h * 0.022;
  }
  frame(0, 0, w, h, unit * 0.03, draw.number(2) ? Colour(0.05f) : Colour(0.85f), out);
  return out;
}

Picture door(uint64_t seed, int width_px, int height_px, Colour leaf, Colour casing) {
  Draw draw(seed);
  const double w = width_px, h = height_px, rim = 0.07 * w;
  Picture out(width_px, height_px, 3);
  fill_rect(0, 0, w, h, casing, out);
  fill_rect(rim, rim, w - rim, h, leaf, out);
  frame(rim, rim, w - rim, h + rim, 0.008 * w, leaf * 0.35f, out);  // the gap around the leaf
  const int kind = draw.number(3);
  if (kind == 0) {  // a pane of glass
    fill_rect(0.30 * w, 0.10 * h, 0.70 * w, 0.42 * h, leaf * 0.5f, out);
    fill_rect(0.32 * w, 0.11 * h, 0.68 * w, 0.41 * h, Colour(0.10f, 0.13f, 0.14f), out);
  } else if (kind == 1) {  // two panels
    for (double top : {0.1, 0.55}) {
      frame(0.2 * w, top * h, 0.8 * w, (top + 0.35) * h, 0.012 * w, leaf * 0.6f, out);
      frame(0.212 * w, (top + 0.006) * h, 0.812 * w, (top + 0.356) * h, 0.008 * w, leaf * 1.2f, out);
    }
  }
  const bool left = draw.number(2) == 0;
  const double x = left ? 0.16 * w : 0.84 * w, y = 0.52 * h;
  fill_rect(x - 0.02 * w, y - 0.03 * h, x + 0.02 * w, y + 0.05 * h, Colour(0.25f), out);
  line(x, y, x + (left ? 0.1 : -0.1) * w, y, 0.025 * w, Colour(0.6f), out);
  fill_rect(rim, h * 0.95, w - rim, h, leaf * 0.45f, out);  // kick plate
  return out;
}

Picture window(uint64_t seed, int width_px, int height_px, Colour glass, Colour casing) {
  Draw draw(seed);
  const double w = width_px, h = height_px, rim = 0.06 * std::min(w, h);
  Picture out(width_px, height_px, 3);
  fill_rect(0, 0, w, h, casing, out);
  const int columns = 1 + draw.number(3), rows = 1 + draw.number(2);
  for (int i = 0; i < columns; i++) {
    for (int j = 0; j < rows; j++) {
      const double x0 = rim + i * (w - rim) / columns, x1 = (i + 1) * (w - rim) / columns;
      const double y0 = rim + j * (h - rim) / rows, y1 = (j + 1) * (h - rim) / rows;
      fill_rect(x0, y0, x1, y1, glass * static_cast<float>(draw.uniform(0.7, 1.2)), out);
      // A reflection, and a curtain in some.
      if (draw.number(3) == 0)
        fill_rect(x0, y0, x0 + (x1 - x0) * draw.uniform(0.2, 0.9), y1, Colour(0.45f, 0.43f, 0.38f), out);
      line(x0 + 0.7 * (x1 - x0), y0 + 0.1 * (y1 - y0), x0 + 0.9 * (x1 - x0), y0 + 0.35 * (y1 - y0), 0.02 * w,
           glass * 1.6f, out);
    }
  }
  frame(0, 0, w, h, 0.012 * w, casing * 0.5f, out);
  return out;
}

Picture goods(uint64_t seed, int width_px, int height_px, int shelves) {
  Draw draw(seed);
  const double w = width_px, h = height_px;
  Picture out(width_px, height_px, 3);
  fill_rect(0, 0, w, h, Colour(0.03f), out);
  for (int s = 0; s < shelves; s++) {
    const double floor = h * (s + 1) / shelves, tall = h / shelves;
    double x = 0.02 * w;
    while (x < 0.97 * w) {
      const double wide = std::min(tall * draw.uniform(0.15, 0.7), 0.98 * w - x), high = tall * draw.uniform(0.4, 0.85);
      const Colour ink = draw.number(3) ? draw.colour() : Colour(0.32f, 0.22f, 0.12f);  // a third are cartons
      if (draw.number(6)) {
        fill_rect(x, floor - 0.05 * h / shelves - high, x + wide * 0.97, floor, ink, out);
        if (draw.number(2))
          fill_rect(x + wide * 0.2, floor - high * 0.7, x + wide * 0.75, floor - high * 0.45, Colour(0.75f), out);
      }
      x += wide;
    }
    fill_rect(0, floor - 0.05 * tall, w, floor, Colour(0.25f, 0.27f, 0.30f), out);
  }
  for (double x : {0.0, 0.975}) fill_rect(x * w, 0, (x + 0.025) * w, h, Colour(0.05f, 0.10f, 0.30f), out);
  return out;
}

}  // namespace wm::render
