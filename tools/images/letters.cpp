// SPDX-License-Identifier: Apache-2.0
// A plain stroke font for signs, house numbers and captions: capitals, digits and a few signs, each a few lines on a
// grid of 4 x 6.
#include <cctype>

#include "images/picture.h"

namespace wm::images {

namespace {

struct Glyph {
  char name;
  const char *strokes;  // pairs "xy" of a polyline, a blank lifts the pen; y 0 is the foot, 6 the top
};

constexpr Glyph kGlyphs[] = {{'0', "103041453616050110"},
                             {'1', "152620 1030"},
                             {'2', "05163645440040"},
                             {'3', "0516364544334241301001"},
                             {'4', "30360242"},
                             {'5', "460603334241301001"},
                             {'6', "4536160501103041423303"},
                             {'7', "064620"},
                             {'8', "13334445361605041302011030414233"},
                             {'9', "0110304145361605041343"},
                             {'A', "002640 1232"},
                             {'B', "00063645443303 3342413000"},
                             {'C', "4536160501103041"},
                             {'D', "00063645413000"},
                             {'E', "46060040 0333"},
                             {'F', "460600 0333"},
                             {'G', "45361605011030414323"},
                             {'H', "0006 4046 0343"},
                             {'I', "1030 2026 1636"},
                             {'J', "3631201001"},
                             {'K', "0006 460340"},
                             {'L', "060040"},
                             {'M', "0006234640"},
                             {'N', "00064046"},
                             {'O', "103041453616050110"},
                             {'P', "00063645443303"},
                             {'Q', "103041453616050110 2240"},
                             {'R', "00063645443303 2340"},
                             {'S', "453616050413334241301001"},
                             {'T', "2026 0646"},
                             {'U', "060110304146"},
                             {'V', "062046"},
                             {'W', "0610233046"},
                             {'X', "0046 0640"},
                             {'Y', "062346 2320"},
                             {'Z', "06460040"},
                             {'-', "1333"},
                             {'.', "2021"},
                             {':', "2122 2425"},
                             {'/', "0046"},
                             {'+', "0343 2125"},
                             {'%', "0046 0605 4041"},
                             {'(', "36141230"},
                             {')', "16343210"},
                             {'=', "0242 0444"},
                             {',', "2110"}};

const char *strokes(char c) {
  for (const Glyph &g : kGlyphs)
    if (g.name == std::toupper(static_cast<unsigned char>(c))) return g.strokes;
  return "";
}

}  // namespace

double text_width(const char *text, double height_px) {
  double width = 0;
  for (; *text; text++) width += height_px * 5.6 / 6;
  return width;
}

double draw_text(const char *text, double x_px, double y_px, double height_px, Colour ink, Picture &picture) {
  const double unit = height_px / 6;
  double x = x_px;
  for (const char *c = text; *c; c++, x += 5.6 * unit) {
    bool down = false;
    double px = 0, py = 0;
    for (const char *s = strokes(*c); s[0] && s[1];) {
      if (*s == ' ') {
        down = false, s++;
        continue;
      }
      const double nx = x + (s[0] - '0') * unit, ny = y_px - (s[1] - '0') * unit;
      if (down) line(px, py, nx, ny, 0.9 * unit, ink, picture);
      px = nx, py = ny, down = true, s += 2;
    }
  }
  return x - x_px;
}

}  // namespace wm::images
