// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/reliability.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "common/failure.h"

namespace wm::montecarlo {

void Reliability::take(const Outcome &outcome) {
  for (const Sample &s : outcome.samples) {
    const double p = s.lost_probability;
    if (!(p >= 0 && p <= 1)) continue;
    const double was = s.error_m > 0.5 || s.error_rad > 0.2618 ? 1 : 0;
    Bin &bin = bins_[static_cast<size_t>(std::min(kBins - 1, static_cast<int>(p * kBins)))];
    bin.count++;
    bin.stated += p;
    bin.was += was;
    squares_ += (p - was) * (p - was);
    count_++;
  }
}

void Reliability::print() const {
  if (count_ == 0) return;
  std::printf("probability of being lost: stated, observed share, looks (score %.4f)\n", brier());
  for (const Bin &bin : bins_)
    if (bin.count > 0) std::printf("  %5.3f  %5.3f  %8.0f\n", bin.stated / bin.count, bin.was / bin.count, bin.count);
}

void Reliability::draw(const std::string &file) const {
  constexpr double kSide = 360, kLeft = 60, kTop = 30;
  const auto x = [](double p) { return kLeft + kSide * p; };
  const auto y = [](double p) { return kTop + kSide * (1 - p); };
  std::ofstream out(file);
  const auto print = [&out](const char *format, auto... values) {
    char line[400];
    std::snprintf(line, sizeof line, format, values...);
    out << line;
  };
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 460 450\" font-family=\"sans-serif\" "
         "font-size=\"13\">\n<rect width=\"460\" height=\"450\" fill=\"#fff\"/>\n";
  for (int k = 0; k <= 5; k++) {
    const double p = 0.2 * k;
    print("<path d=\"M%.1f %.1fV%.1fM%.1f %.1fH%.1f\" stroke=\"#ddd\" fill=\"none\"/>\n", x(p), y(0), y(1), x(0), y(p),
          x(1));
    print("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%.1f</text>\n", x(p), y(0) + 18, p);
    print("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%.1f</text>\n", x(0) - 8, y(p) + 4, p);
  }
  print("<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"#888\" stroke-dasharray=\"5 4\"/>\n", x(0), y(0), x(1), y(1));
  std::string way;
  for (const Bin &bin : bins_) {
    if (bin.count == 0) continue;
    const double stated = bin.stated / bin.count, was = bin.was / bin.count;
    char point[60];
    std::snprintf(point, sizeof point, "%c%.1f %.1f", way.empty() ? 'M' : 'L', x(stated), y(was));
    way += point;
    print(
        "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" fill=\"#0072b2\" fill-opacity=\".7\"><title>%.0f "
        "looks</title></circle>\n",
        x(stated), y(was), 2 + 1.5 * std::log10(bin.count), bin.count);
  }
  print("<path d=\"%s\" stroke=\"#0072b2\" stroke-width=\"2\" fill=\"none\"/>\n", way.c_str());
  print("<text x=\"%.1f\" y=\"440\" text-anchor=\"middle\">probability of being lost, as stated</text>\n", x(0.5));
  print("<text transform=\"translate(16 %.1f) rotate(-90)\" text-anchor=\"middle\">share in which it was</text>\n",
        y(0.5));
  print("<text x=\"%.1f\" y=\"20\">%.0f looks, a tenth of a second each; score %.4f</text>\n</svg>\n", x(0), count_,
        brier());
  if (!out) throw tools::Failure(file + ": could not be written");
}

}  // namespace wm::montecarlo
