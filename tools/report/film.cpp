// SPDX-License-Identifier: Apache-2.0
#include "report/film.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "report/data.h"
#include "report/words.h"

namespace wm::tools {
namespace {

// A camera begins and ends a little apart from the other sensors, and a slow one by up to its period. What is more than
// these is a camera that didn't film.
constexpr double kApart_s = 5, kApartOfDrive = 0.05, kApartPeriods = 3;

struct Span {
  int64_t from_ns, to_ns;
};

Span span_of(const std::vector<Taken> &film) {
  const auto [first, last] =
      std::minmax_element(film.begin(), film.end(), [](const Taken &a, const Taken &b) { return a.t_ns < b.t_ns; });
  return {first->t_ns, last->t_ns};
}

// As below the pictures.
std::string time_text(double s) { return number_text(s, 1) + " s"; }

}  // namespace

std::vector<Taken> during(const ReportData &data, const std::vector<Taken> &film) {
  const int64_t end_ns = data.trajectory.poses.back().t_ns;
  std::vector<Taken> out;
  std::copy_if(film.begin(), film.end(), std::back_inserter(out),
               [&](const Taken &one) { return one.t_ns >= data.start_ns && one.t_ns <= end_ns; });
  return out;
}

std::vector<Taken> spread_over(const std::vector<Taken> &film, size_t each) {
  std::vector<Taken> out;
  if (film.empty()) return out;
  const Span span = span_of(film);
  for (size_t i = 0; i < each; i++) {
    const double part = (static_cast<double>(i) + 0.5) / static_cast<double>(each);
    const int64_t wanted_ns = span.from_ns + std::llround(part * static_cast<double>(span.to_ns - span.from_ns));
    out.push_back(*std::min_element(film.begin(), film.end(), [wanted_ns](const Taken &a, const Taken &b) {
      return std::abs(a.t_ns - wanted_ns) < std::abs(b.t_ns - wanted_ns);
    }));
  }
  std::sort(out.begin(), out.end(), [](const Taken &a, const Taken &b) { return a.number < b.number; });
  out.erase(std::unique(out.begin(), out.end(), [](const Taken &a, const Taken &b) { return a.number == b.number; }),
            out.end());
  return out;
}

std::string when_filmed(const ReportData &data, const std::string &camera, const std::vector<Taken> &film) {
  const std::vector<Taken> seen = during(data, film);
  const Span span = span_of(seen.empty() ? film : seen);
  const double from_s = data.seconds(span.from_ns), to_s = data.seconds(span.to_ns), end_s = data.end_s();
  const std::string who = "Camera " + camera, times = "from " + time_text(from_s) + " to " + time_text(to_s),
                    drive = "; the drive lasted " + time_text(end_s) + ".";
  if (seen.empty()) return who + " has no pictures of the drive: its own are " + times + drive;
  if (seen.size() == 1) return who + " has one picture only, at " + time_text(from_s) + drive;
  const double period_s = (to_s - from_s) / static_cast<double>(seen.size() - 1);
  const double apart_s = std::max(std::min(kApart_s, kApartOfDrive * end_s), kApartPeriods * period_s);
  if (from_s <= apart_s && end_s - to_s <= apart_s) return "";
  return who + " has pictures only " + times + drive;
}

}  // namespace wm::tools
