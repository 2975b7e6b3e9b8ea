// SPDX-License-Identifier: Apache-2.0
#include "map/pdf.h"

#include <cstdio>

namespace wm::tools {
namespace {

constexpr double kPoints = 72 / 25.4;  // of a mm

std::string number(double mm) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4f ", mm * kPoints);
  return text;
}

}  // namespace

std::string Pdf::place(Point at) const { return number(at.x_mm) + number(height_mm_ - at.y_mm); }

void Pdf::area(const std::vector<Point> &outline, bool black) {
  std::string &page = pages_.back();
  page += black ? "0 g " : "1 g ";
  for (size_t i = 0; i < outline.size(); i++) page += place(outline[i]) + (i == 0 ? "m " : "l ");
  page += "f\n";
}

void Pdf::line(Point a, Point b, double width_mm) {
  pages_.back() += "0 G " + number(width_mm) + "w " + place(a) + "m " + place(b) + "l S\n";
}

void Pdf::text(Point at, double height_mm, const std::string &words) {
  std::string safe;
  for (const char c : words) {
    if (c == '(' || c == ')' || c == '\\') safe += '\\';
    safe += c;
  }
  pages_.back() += "BT 0 g /F1 " + number(height_mm) + "Tf " + place(at) + "Td (" + safe + ") Tj ET\n";
}

std::string Pdf::bytes() const {
  std::string out = "%PDF-1.4\n";
  std::vector<size_t> offsets;
  const auto object = [&](const std::string &body) {
    offsets.push_back(out.size());
    out += std::to_string(offsets.size()) + " 0 obj\n" + body + "\nendobj\n";
  };
  // 1 catalog, 2 pages, 3 font, then a page and its content by turns.
  std::string kids;
  for (size_t i = 0; i < pages_.size(); i++) kids += std::to_string(4 + 2 * i) + " 0 R ";
  object("<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>");
  object("<< /Type /Pages /Kids [" + kids + "] /Count " + std::to_string(pages_.size()) + " /MediaBox [0 0 " +
         number(width_mm_) + number(height_mm_) + "] >>");
  object("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>");
  for (size_t i = 0; i < pages_.size(); i++) {
    object("<< /Type /Page /Parent 2 0 R /Resources << /Font << /F1 3 0 R >> >> /Contents " +
           std::to_string(5 + 2 * i) + " 0 R >>");
    object("<< /Length " + std::to_string(pages_[i].size()) + " >>\nstream\n" + pages_[i] + "endstream");
  }
  const size_t table = out.size();
  out += "xref\n0 " + std::to_string(offsets.size() + 1) + "\n0000000000 65535 f \n";
  for (const size_t offset : offsets) {
    char row[32];
    std::snprintf(row, sizeof row, "%010zu 00000 n \n", offset);
    out += row;
  }
  out += "trailer\n<< /Size " + std::to_string(offsets.size() + 1) + " /Root 1 0 R >>\nstartxref\n" +
         std::to_string(table) + "\n%%EOF\n";
  return out;
}

}  // namespace wm::tools
