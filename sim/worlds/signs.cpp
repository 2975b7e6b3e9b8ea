// SPDX-License-Identifier: Apache-2.0
#include "worlds/signs.h"

#include <algorithm>
#include <string>

#include "render/patterns.h"
#include "worlds/dice.h"

namespace wm::sim {
namespace {

using images::Colour;
using images::Picture;

constexpr Colour kWhite(0.8f), kBlack(0.02f);

Colour strong(Dice &dice) {
  static const Colour colours[] = {{0.55f, 0.04f, 0.04f}, {0.03f, 0.12f, 0.5f},  {0.02f, 0.3f, 0.1f},
                                   {0.7f, 0.5f, 0.03f},   {0.05f, 0.05f, 0.06f}, {0.4f, 0.08f, 0.3f}};
  return colours[dice.integer(0, 5)];
}

}  // namespace

Picture house_number(uint64_t seed, int number) {
  Dice dice(seed, Part::houses);
  Picture p(160, 160, 3);
  const bool dark = dice.chance(0.6);
  const Colour board = dark ? strong(dice) : kWhite, ink = dark ? kWhite : kBlack;
  images::fill_rect(0, 0, 160, 160, ink, p);
  images::fill_rect(6, 6, 154, 154, board, p);
  const std::string text = std::to_string(number);
  const double high = std::min(100.0, 100.0 * 130 / images::text_width(text.c_str(), 100));
  images::draw_text(text.c_str(), 80 - 0.5 * images::text_width(text.c_str(), high), 80 + 0.5 * high, high, ink, p);
  return p;
}

Picture shop_board(uint64_t seed, double aspect) {
  static const char *const names[] = {"BAKERY",    "BOOKS", "CAFE LUNA", "FLOWERS",  "PIZZA", "OPTIK",
                                      "TEA HOUSE", "SHOES", "BIKES",     "PHARMACY", "HOTEL", "MARKET",
                                      "MUSIC",     "RADIO", "BARBER",    "TOYS"};
  Dice dice(seed, Part::houses);
  const int h = 96, w = static_cast<int>(h * aspect);
  Picture p(w, h, 3);
  const Colour board = strong(dice);
  images::fill_rect(0, 0, w, h, kWhite, p);
  images::fill_rect(4, 4, w - 4, h - 4, board, p);
  const char *name = names[dice.integer(0, 15)];
  const double high = std::min(56.0, 56.0 * (w - 90) / images::text_width(name, 56));
  const double wide = images::text_width(name, high);
  images::draw_text(name, 0.5 * (w - wide) + 22, 0.5 * (h + high), high, kWhite, p);
  images::fill_disc(0.5 * (w - wide) - 18, 0.5 * h, 0.25 * h, dice.chance(0.5) ? Colour(0.75f, 0.55f, 0.05f) : kWhite,
                    p);
  return p;
}

Picture street_sign(uint64_t seed) {
  Dice dice(seed, Part::houses);
  Picture p(160, 160, 3);
  const Colour colour = strong(dice);
  images::fill_rect(0, 0, 160, 160, kWhite, p);
  images::fill_rect(5, 5, 155, 155, dice.chance(0.5) ? Colour(0.03f, 0.1f, 0.45f) : kWhite, p);
  switch (dice.integer(0, 3)) {
    case 0:
      images::fill_disc(80, 80, 66, colour, p);
      images::fill_disc(80, 80, 48, kWhite, p);
      images::draw_text(std::to_string(10 * dice.integer(2, 6)).c_str(), 45, 104, 48, kBlack, p);
      break;
    case 1:
      images::fill_disc(80, 80, 68, Colour(0.6f, 0.03f, 0.03f), p);
      images::fill_rect(30, 66, 130, 94, kWhite, p);
      break;
    case 2:
      for (int y = 0; y < 110; y++)
        images::line(80 - 0.55 * y, 25 + y, 80 + 0.55 * y, 25 + y, 2,
                     y < 12 || y > 96 ? kBlack : Colour(0.75f, 0.6f, 0.04f), p);
      break;
    default:
      images::line(80, 135, 80, 60, 16, kWhite, p);
      for (int y = 0; y < 40; y++) images::line(80 - 0.8 * y, 25 + y, 80 + 0.8 * y, 25 + y, 2, colour, p);
      break;
  }
  return p;
}

}  // namespace wm::sim
