// SPDX-License-Identifier: Apache-2.0
// Pages of areas, lines and words at true scale, as PDF 1.4.
#pragma once

#include <string>
#include <vector>

namespace wm::tools {

class Pdf {
 public:
  Pdf(double width_mm, double height_mm) : width_mm_(width_mm), height_mm_(height_mm) {}

  // All places are mm from the upper left corner of the newest page; there must be one.
  void page() { pages_.emplace_back(); }
  struct Point {
    double x_mm, y_mm;
  };
  void area(const std::vector<Point> &outline, bool black);
  void line(Point a, Point b, double width_mm);
  void text(Point at, double height_mm, const std::string &words);  // from `at` to the right, Helvetica, ASCII

  // The whole file.
  std::string bytes() const;

 private:
  std::string place(Point at) const;
  double width_mm_, height_mm_;
  std::vector<std::string> pages_;
};

}  // namespace wm::tools
