// SPDX-License-Identifier: Apache-2.0
// Pages of areas, lines and words at true scale, by libharu.
#pragma once

#include <hpdf.h>

#include <string>
#include <vector>

namespace wm::tools {

class Pdf {
 public:
  Pdf(double width_mm, double height_mm);
  ~Pdf();
  Pdf(const Pdf &) = delete;
  Pdf &operator=(const Pdf &) = delete;

  // All places are mm from the upper left corner of the newest page; there must be one.
  void page();
  struct Point {
    double x_mm, y_mm;
  };
  void area(const std::vector<Point> &outline, bool black);
  void line(Point a, Point b, double width_mm);
  void text(Point at, double height_mm, const std::string &words);  // from `at` to the right, Helvetica, ASCII

  // The whole file. Throws Failure where libharu could not make it.
  std::string bytes();

 private:
  HPDF_Doc document_;
  HPDF_Page page_ = nullptr;
  double width_mm_, height_mm_;
};

}  // namespace wm::tools
