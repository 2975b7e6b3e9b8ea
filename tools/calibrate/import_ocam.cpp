// SPDX-License-Identifier: Apache-2.0
// OCamCalib's calib_results.txt (D. Scaramuzza et al., "A toolbox for easily calibrating omnidirectional cameras", IROS
// 2006): polynomial of the ray, its inverse, centre (row, column), affine c d e, size (height, width), each after a
// line that begins with '#'.
#include <cmath>
#include <sstream>

#include "calibrate/foreign.h"
#include "common/failure.h"
#include "common/number.h"

namespace wm::calibrate {
namespace {

struct Line {
  std::vector<double> values;
  int number = 0;
};

// MATLAB on Windows writes exponents of three digits ("-5.5e+002"), which is a number all the same.
std::vector<Line> read_lines(const std::string &text, const std::string &path) {
  std::vector<Line> out;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); number++) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[line.find_first_not_of(" \t")] == '#') continue;
    Line row{{}, number};
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      const std::optional<double> value = tools::number_of<double>(word);
      if (!value) throw tools::Failure(path + ":" + std::to_string(number) + ": '" + word + "' is not a number");
      row.values.push_back(*value);
    }
    out.push_back(row);
  }
  return out;
}

void need(const Line &line, size_t count, const char *what, const std::string &path) {
  if (line.values.size() != count)
    throw tools::Failure(path + ":" + std::to_string(line.number) + ": " + what + ": " + std::to_string(count) +
                         " numbers are needed, here are " + std::to_string(line.values.size()));
}

}  // namespace

std::vector<ForeignCamera> read_ocamcalib(const std::string &text, const std::string &path, const ImportHints &hints) {
  const std::vector<Line> lines = read_lines(text, path);
  if (lines.size() < 5)
    throw tools::Failure(path + ": " + std::to_string(lines.size()) +
                         " lines of numbers; OCamCalib writes 5: polynomial, inverse, centre, affine, size");
  std::vector<double> polynomial = lines[0].values;
  need(lines[0], static_cast<size_t>(std::max(1.0, polynomial.front())) + 1, "polynomial, its length first", path);
  polynomial.erase(polynomial.begin());
  need(lines[2], 2, "centre (row, column)", path);
  need(lines[3], 3, "affine c d e", path);
  need(lines[4], 2, "size (height, width)", path);
  const double row0 = lines[2].values[0], column0 = lines[2].values[1];
  const double c = lines[3].values[0], d = lines[3].values[1], e = lines[3].values[2];
  if (!(std::fabs(c - d * e) > 1e-6)) throw tools::Failure(path + ": affine c d e: c - d e must not be 0");

  ForeignCamera out;
  out.model = "OCamCalib, polynomial of degree " + std::to_string(polynomial.size() - 1);
  out.width = hints.width > 0 ? hints.width : static_cast<int>(lines[4].values[1]);
  out.height = hints.height > 0 ? hints.height : static_cast<int>(lines[4].values[0]);
  out.centre = {column0, row0};
  // Its x runs down the rows, its y along the columns, and it looks along -z.
  out.unproject = [=](const Vec2 &pixel, Vec3 &direction) {
    const double a = pixel.y() - row0, b = pixel.x() - column0, det = c - d * e;
    const double x = (a - d * b) / det, y = (c * b - e * a) / det, r = std::sqrt(x * x + y * y);
    double z = 0;
    for (size_t i = polynomial.size(); i-- > 0;) z = z * r + polynomial[i];
    direction = Vec3(y, x, -z).normalized();
    return direction.allFinite();
  };
  return {out};
}

}  // namespace wm::calibrate
