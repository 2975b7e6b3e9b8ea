// SPDX-License-Identifier: Apache-2.0
// One panel of a chart: data over time (or another axis) in a box that takes any width. The picture is SVG stretched to
// the box, lines keep their width; all text is HTML placed over it, so that it is as large on a phone as on a desk.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace wm::tools {

// Round steps (1, 2 or 5 times a power of ten; for time 1, 2, 5, 10, 15, 30) that part [low, high] into at most `most`.
std::vector<double> round_ticks(double low, double high, int most);
std::vector<double> time_ticks(double low_s, double high_s, int most);

struct Range {
  double low, high;
};

class Panel {
 public:
  enum class Scale { kLinear, kLog };

  Panel(Range x, Range y, Scale scale = Scale::kLinear) : x_(x), y_(y), scale_(scale) {}

  // A line through the points. It is broken where neighbours are more than `gap` apart in x or a value is NaN. Many
  // points are drawn by the smallest and the largest of each of the box's columns: no peak is lost.
  void line(const std::vector<double> &x, const std::vector<double> &v, std::string_view css, double gap);
  // The area between -v and v (or low and high), for bounds. Within one column the outermost is drawn pale.
  void band(const std::vector<double> &x, const std::vector<double> &low, const std::vector<double> &high,
            std::string_view css, double gap);
  // A dot each; beyond some thousands the range of each column.
  void dots(const std::vector<double> &x, const std::vector<double> &v, std::string_view css);
  // A line over the whole width, with a label above (or under) its right end ("" for none).
  void level(double y, std::string_view css, const std::string &label, bool under = false);
  // A box from x0 to x1 over [y0, y1].
  void box(double x0, double x1, double y0, double y1, std::string_view css);
  // A step line: value v[i] from edges[i] to edges[i+1].
  void steps(const std::vector<double> &edges, const std::vector<double> &v, std::string_view css);

  struct Labels {
    std::string title{};      // above the panel: what, in which unit
    std::string describes{};  // for those who can't see it
    bool x_time = true;       // x is seconds: ticks as s or min
    bool x_text = true;       // ticks are labelled (the last of a stack)
    int height_px = 150;
    std::vector<std::pair<double, std::string>> x_ticks{}, y_ticks{};  // instead of round ones where not empty
  };
  [[nodiscard]] std::string html(const Labels &labels) const;

 private:
  [[nodiscard]] double across(double x) const;  // 0 to 1000 from left to right
  [[nodiscard]] double down(double y) const;    // 0 to 1000 from top to bottom
  void add_path(const std::string &d, std::string_view css);

  Range x_, y_;
  Scale scale_;
  std::string svg_, text_;
};

}  // namespace wm::tools
