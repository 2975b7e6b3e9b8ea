// SPDX-License-Identifier: Apache-2.0
#include "report/axes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/words.h"

namespace wm::tools {
namespace {

constexpr int kColumns = 640;         // columns that a panel is thought to have: more than a phone's, about a page's
constexpr size_t kDotsAtMost = 2500;  // beyond these the range of each column is drawn

// A number for a path: one decimal of a thousandth of the box, nothing superfluous.
std::string coordinate(double value) {
  std::string text = fixed(value, 1);
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

std::string point(double x, double y) { return coordinate(x) + " " + coordinate(y); }

// What falls into one column of the box.
struct Column {
  double first_x, last_x;
  double low, high;  // of the lower curve's smallest, of the upper curve's largest
  double inner_low, inner_high;
  bool low_first;
  bool breaks;  // a gap before it
};

std::vector<Column> columns(const std::vector<double> &x, const std::vector<double> &low,
                            const std::vector<double> &high, Range range, double gap) {
  std::vector<Column> out;
  const double width = (range.high - range.low) / kColumns;
  int64_t current = std::numeric_limits<int64_t>::min();
  double last_x = -std::numeric_limits<double>::infinity();
  bool broken = true;
  for (size_t i = 0; i < x.size(); ++i) {
    if (x[i] < range.low || x[i] > range.high) continue;
    if (!std::isfinite(low[i]) || !std::isfinite(high[i])) {
      broken = true;
      continue;
    }
    broken = broken || x[i] - last_x > gap;
    last_x = x[i];
    const auto column = static_cast<int64_t>((x[i] - range.low) / width);
    if (broken || column != current) {
      out.push_back({x[i], x[i], low[i], high[i], low[i], high[i], true, broken});
      current = column;
      broken = false;
      continue;
    }
    Column &c = out.back();
    c.last_x = x[i];
    if (low[i] < c.low) c.low_first = false, c.low = low[i];
    if (high[i] > c.high) c.low_first = true, c.high = high[i];
    c.inner_low = std::max(c.inner_low, low[i]);
    c.inner_high = std::min(c.inner_high, high[i]);
  }
  return out;
}

std::vector<double> ticks_by(double step, double low, double high) {
  std::vector<double> out;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) out.push_back(k * step);
  return out;
}

std::string tick_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  return number_text(value, decimals);
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int most) {
  if (!(high > low)) return {low};
  double step = std::pow(10, std::floor(std::log10((high - low) / most)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
    if ((high - low) / (step * factor) > most) continue;
    step *= factor;
    break;
  }
  return ticks_by(step, low, high);
}

std::vector<double> time_ticks(double low_s, double high_s, int most) {
  const double span = high_s - low_s;
  for (const double step :
       {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0})
    if (span / step <= most) return ticks_by(step, low_s, high_s);
  return ticks_by(3600 * std::ceil(span / 3600 / most), low_s, high_s);
}

double Panel::across(double x) const { return 1000 * (x - x_.low) / (x_.high - x_.low); }

double Panel::down(double y) const {
  if (scale_ == Scale::kLinear) return 1000 * (y_.high - y) / (y_.high - y_.low);
  const double floor = std::max(y, y_.low * 1e-3);
  return 1000 * std::log(y_.high / floor) / std::log(y_.high / y_.low);
}

void Panel::add_path(const std::string &d, std::string_view css) {
  if (!d.empty()) svg_ += "<path class=\"" + std::string(css) + "\" d=\"" + d + "\"/>";
}

void Panel::line(const std::vector<double> &x, const std::vector<double> &v, std::string_view css, double gap) {
  std::string d;
  for (const Column &c : columns(x, v, v, x_, gap)) {
    d += c.breaks ? "M" : "L";
    const double middle = (c.first_x + c.last_x) / 2;
    d += point(across(middle), down(c.low_first ? c.low : c.high));
    if (c.low < c.high || c.breaks) d += "V" + coordinate(down(c.low_first ? c.high : c.low));
  }
  add_path(d, css);
}

void Panel::band(const std::vector<double> &x, const std::vector<double> &low, const std::vector<double> &high,
                 std::string_view css, double gap) {
  const auto all = columns(x, low, high, x_, gap);
  for (const bool inner : {false, true}) {
    std::string d;
    for (size_t begin = 0; begin < all.size();) {
      size_t end = begin + 1;
      while (end < all.size() && !all[end].breaks) ++end;
      std::string back;
      for (size_t i = begin; i < end; ++i) {
        const Column &c = all[i];
        const double from = across(c.first_x);
        d += (i == begin ? "M" : "L") + point(from, down(inner ? c.inner_high : c.high));
        back.insert(0, "L" + point(from, down(inner ? c.inner_low : c.low)));
      }
      const Column &last = all[end - 1];
      d += "L" + point(across(last.last_x), down(inner ? last.inner_high : last.high));
      d += "L" + point(across(last.last_x), down(inner ? last.inner_low : last.low)) + back + "Z";
      begin = end;
    }
    add_path(d, css);
  }
}

void Panel::dots(const std::vector<double> &x, const std::vector<double> &v, std::string_view css) {
  std::string d;
  if (x.size() <= kDotsAtMost) {
    for (size_t i = 0; i < x.size(); ++i)
      if (std::isfinite(v[i]) && x[i] >= x_.low && x[i] <= x_.high) d += "M" + point(across(x[i]), down(v[i])) + "h0";
    add_path(d, css);
    return;
  }
  for (const Column &c : columns(x, v, v, x_, std::numeric_limits<double>::infinity()))
    d += "M" + point(across((c.first_x + c.last_x) / 2), down(c.low)) + "V" + coordinate(down(c.high));
  add_path(d, css);
}

void Panel::level(double y, std::string_view css, const std::string &label, bool under) {
  const double at = down(y);
  if (at < 0 || at > 1000) return;
  add_path("M0 " + coordinate(at) + "H1000", css);
  if (!label.empty())
    text_ += std::string("<b class=\"") + (under ? "under" : "level") + "\" style=\"top:" + coordinate(at / 10) +
             "%\">" + escape(label) + "</b>";
}

void Panel::box(double x0, double x1, double y0, double y1, std::string_view css) {
  add_path("M" + point(across(x0), down(y0)) + "H" + coordinate(across(x1)) + "V" + coordinate(down(y1)) + "H" +
               coordinate(across(x0)) + "Z",
           css);
}

void Panel::steps(const std::vector<double> &edges, const std::vector<double> &v, std::string_view css) {
  std::string d;
  bool pen_down = false;
  for (size_t i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i])) {
      pen_down = false;
      continue;
    }
    d += pen_down ? "V" + coordinate(down(v[i])) : "M" + point(across(edges[i]), down(v[i]));
    d += "H" + coordinate(across(edges[i + 1]));
    pen_down = true;
  }
  add_path(d, css);
}

std::string Panel::html(const Labels &labels) const {
  std::string grid;
  std::string ticks;
  auto y_ticks = labels.y_ticks;
  if (y_ticks.empty()) {
    const auto values = round_ticks(y_.low, y_.high, 4);
    const double step = values.size() > 1 ? values[1] - values[0] : 1;
    for (const double value : values) y_ticks.emplace_back(value, tick_text(value, step));
  }
  for (const auto &[value, text] : y_ticks) {
    const double at = down(value);
    grid += "M0 " + coordinate(at) + "H1000";
    ticks += "<i class=\"y\" style=\"top:" + coordinate(at / 10) + "%\">" + escape(text) + "</i>";
  }
  auto x_ticks = labels.x_ticks;
  if (x_ticks.empty() && labels.x_time) {
    const bool minutes = x_.high - x_.low > 150;
    const auto values = time_ticks(x_.low, x_.high, 8);
    const double step = (values.size() > 1 ? values[1] - values[0] : 1) / (minutes ? 60 : 1);
    for (const double value : values)
      x_ticks.emplace_back(value, tick_text(value / (minutes ? 60 : 1), step) +
                                      (value == values.back() ? (minutes ? " min" : " s") : ""));
  }
  for (size_t i = 0; i < x_ticks.size(); ++i) {
    const double at = across(x_ticks[i].first);
    grid += "M" + coordinate(at) + " 0V1000";
    // On a narrow screen every other one, the last kept.
    const bool spare = (x_ticks.size() - 1 - i) % 2 == 1;
    if (labels.x_text)
      ticks += std::string("<i class=\"x") + (spare ? " spare" : "") + "\" style=\"left:" + coordinate(at / 10) +
               "%\">" + escape(x_ticks[i].second) + "</i>";
  }
  return "<div class=\"panel" + std::string(labels.x_text ? " last" : "") + "\"><p class=\"axis\">" + labels.title +
         "</p><div class=\"plot" + (labels.x_time ? " time" : "") +
         "\" style=\"height:" + std::to_string(labels.height_px) +
         "px\"><svg viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"" +
         escape(labels.describes) + "\"><path class=\"grid\" d=\"" + grid + "\"/>" + svg_ + "</svg>" + ticks + text_ +
         "</div></div>\n";
}

}  // namespace wm::tools
