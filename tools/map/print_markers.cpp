// SPDX-License-Identifier: Apache-2.0
#include "map/print_markers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <vector>

#include "common/failure.h"
#include "map/pdf.h"
#include "waymark/detectors.h"
#include "waymark/mr_code.h"

namespace wm::tools {
namespace {

constexpr double kMargin_mm = 6, kCaption_mm = 9, kFoot_mm = 16, kCut_mm = 4;
constexpr uint32_t kCodesMax = 65536;  // of a family: all
constexpr double kOverlap_mm = 0.01;   // so that no viewer shows a gap between two black modules

struct Paper {
  const char *name;
  double width_mm, height_mm;
};
constexpr Paper kPapers[] = {{"a4", 210, 297}, {"a3", 297, 420}, {"letter", 215.9, 279.4}};

// A print about its centre, in mm: the box of its black, the rim, and how it is drawn.
struct Print {
  double left_mm, top_mm, right_mm, bottom_mm, rim_mm;
  std::string measure;  // what its size is
  std::function<void(Pdf &pdf, Pdf::Point centre, int id)> draw;
  int count;
};

void rectangle(Pdf &pdf, Pdf::Point upper_left, double width_mm, double height_mm, bool black) {
  const double x = upper_left.x_mm, y = upper_left.y_mm;
  pdf.area({{x, y}, {x + width_mm, y}, {x + width_mm, y + height_mm}, {x, y + height_mm}}, black);
}

// Black modules of a grid, joined along rows.
void modules(Pdf &pdf, Pdf::Point corner, double module_mm, int across, const std::function<bool(int, int)> &black) {
  for (int row = 0; row < across; row++)
    for (int begin = 0; begin < across; begin++) {
      if (!black(begin, row)) continue;
      int end = begin;
      while (end < across && black(end, row)) end++;
      rectangle(pdf, {corner.x_mm + begin * module_mm - kOverlap_mm, corner.y_mm + row * module_mm - kOverlap_mm},
                (end - begin) * module_mm + 2 * kOverlap_mm, module_mm + 2 * kOverlap_mm, true);
      begin = end;
    }
}

Print mr_print(double size_mm) {
  double right[2], bottom[2];
  wm_mr_vertex(1, right);
  wm_mr_vertex(2, bottom);
  Print print;
  print.left_mm = -right[0] * size_mm, print.right_mm = right[0] * size_mm;
  print.top_mm = -WM_MR_CIRCUMRADIUS * size_mm, print.bottom_mm = bottom[1] * size_mm;
  print.rim_mm = WM_MR_MODULE * size_mm;
  print.measure = "black, from the left to the right vertex";
  print.count = WM_MR_IDS;
  print.draw = [size_mm](Pdf &pdf, Pdf::Point c, int id) {
    std::vector<Pdf::Point> outer, inner;
    for (int i = 0; i < 5; i++) {
      double v[2];
      wm_mr_vertex(i, v);
      outer.push_back({c.x_mm + v[0] * size_mm, c.y_mm + v[1] * size_mm});
      inner.push_back({c.x_mm + WM_MR_INNER * v[0] * size_mm, c.y_mm + WM_MR_INNER * v[1] * size_mm});
    }
    pdf.area(outer, true);
    pdf.area(inner, false);
    const double module_mm = WM_MR_MODULE * size_mm;
    rectangle(pdf, {c.x_mm - 0.5 * module_mm, c.y_mm + WM_MR_TIP_Y * size_mm - 0.5 * module_mm}, module_mm, module_mm,
              true);
    const uint64_t code = wm_mr_encode(static_cast<uint32_t>(id));
    modules(pdf, {c.x_mm + WM_MR_CODE_LEFT * size_mm, c.y_mm + WM_MR_CODE_TOP * size_mm}, module_mm, 8,
            [code](int x, int y) { return (code >> (8 * y + x) & 1) != 0; });
  };
  return print;
}

// Upright as its reader sees it.
Print square_print(const MarkerSheet &sheet, double size_mm) {
  std::shared_ptr<wm_square_family> family = std::make_shared<wm_square_family>();
  uint64_t *memory = nullptr;
  if (!wm_marker_family_make(sheet.family.c_str(), kCodesMax, family.get(), &memory))
    throw Failure("--family: '" + sheet.family + "' is neither mr nor one of vision.apriltag.family (docs/config.md)",
                  kUsage);
  const std::shared_ptr<uint64_t> codes(memory, std::free);
  const int across = family->across, beside = (across - family->border) / 2;
  const double module_mm = size_mm / family->border, half = 0.5 * across * module_mm;
  Print print;
  print.left_mm = print.top_mm = -half;
  print.right_mm = print.bottom_mm = half;
  print.rim_mm = module_mm;
  print.measure =
      family->is_white_inside ? "edge of the white square inside the black ring" : "edge of the black square";
  print.count = static_cast<int>(family->count);
  print.draw = [=](Pdf &pdf, Pdf::Point c, int id) {
    std::vector<char> black(static_cast<size_t>(across * across));
    const auto at = [&](int x, int y) -> char & {
      const int u = x + beside, v = y + beside;
      const int module = family->half_turned ? across * across - 1 - v * across - u : v * across + u;
      return black[static_cast<size_t>(module)];
    };
    const int from = family->is_white_inside ? -1 : 0, to = family->border - 1 - from;  // of the black ring
    for (int i = from; i <= to; i++) at(i, from) = at(i, to) = at(from, i) = at(to, i) = 1;
    for (int i = 0; i < family->bits; i++)
      at(family->x[i], family->y[i]) = (codes.get()[id] >> (family->bits - 1 - i) & 1) == 0;
    modules(pdf, {c.x_mm - half, c.y_mm - half}, module_mm, across, [&](int x, int y) {
      const int module = y * across + x;
      return black[static_cast<size_t>(module)] != 0;
    });
  };
  return print;
}

Print print_of(const MarkerSheet &sheet) {
  const double size_mm = 1000 * sheet.size_m;
  return sheet.family == "mr" ? mr_print(size_mm) : square_print(sheet, size_mm);
}

std::string text(const char *format, double value) {
  char out[160];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

// Along a page's foot; whoever measures something else than 100 mm has a printer that scales.
void ruler(Pdf &pdf, const Paper &paper, const std::string &size) {
  const double y = paper.height_mm - kMargin_mm - 4, x = 0.5 * paper.width_mm - 50;
  pdf.line({x, y}, {x + 100, y}, 0.2);
  for (int mm = 0; mm <= 100; mm++) pdf.line({x + mm, y}, {x + mm, y - (mm % 10 == 0 ? 3 : mm % 5 == 0 ? 2 : 1)}, 0.1);
  pdf.text({x, y + 4}, 3, "100 mm. If it measures otherwise, the printer scales: print at 100 %.");
  pdf.text({x, y - 6}, 3, size);
}

// Short lines outside of the corners of the box that is to be cut out.
void cut_marks(Pdf &pdf, double left, double top, double right, double bottom) {
  for (const double x : {left, right})
    for (const double y : {top, bottom}) {
      const double out_x = x == left ? -1 : 1, out_y = y == top ? -1 : 1;
      pdf.line({x + out_x, y}, {x + out_x * kCut_mm, y}, 0.1);
      pdf.line({x, y + out_y}, {x, y + out_y * kCut_mm}, 0.1);
    }
}

}  // namespace

std::vector<int> ids_of(const std::string &text) {
  std::vector<int> ids;
  const char *at = text.c_str();
  while (true) {
    char *end = nullptr;
    const long first = std::strtol(at, &end, 10);
    bool good = end != at && first >= 0;
    at = end;
    long last = first;
    if (good && *at == '-') {
      last = std::strtol(at + 1, &end, 10);
      good = end != at + 1 && last >= first;
      at = end;
    }
    if (!good || last > 1000000 || last - first > 9999 || (*at != '\0' && *at != ','))
      throw Failure("--ids: '" + text + "' is not identities such as 1-20,25", kUsage);
    for (long id = first; id <= last; id++) ids.push_back(static_cast<int>(id));
    if (*at++ == '\0') return ids;
  }
}

std::string marker_pdf(const MarkerSheet &sheet, int *pages) {
  const Paper *paper =
      std::find_if(std::begin(kPapers), std::end(kPapers), [&](const Paper &p) { return sheet.paper == p.name; });
  if (paper == std::end(kPapers)) throw Failure("--paper: '" + sheet.paper + "' is none of a4, a3, letter", kUsage);
  const Print print = print_of(sheet);
  for (const int id : sheet.ids)
    if (id >= print.count)
      throw Failure("--ids: " + sheet.family + " has the identities 0 to " + std::to_string(print.count - 1) +
                        ", not " + std::to_string(id),
                    kUsage);
  const double black_w = print.right_mm - print.left_mm, black_h = print.bottom_mm - print.top_mm;
  const double room_h = paper->height_mm - kMargin_mm - kFoot_mm - kCaption_mm;
  // The paper's own edge may be the rim's, down to half of its width.
  if (black_w + print.rim_mm > paper->width_mm || black_h + print.rim_mm > room_h)
    throw Failure("--size: " + text("a marker of %.3f m", sheet.size_m) + text(" is %.0f mm wide", black_w) +
                      text(" and %.0f mm high without its rim", black_h) + text(" of %.0f mm", print.rim_mm) +
                      ": it does not fit onto " + sheet.paper + "; a smaller --size, or --paper a3",
                  kUsage);
  const double cell_w = std::min(paper->width_mm, black_w + 2 * print.rim_mm),
               cell_h = std::min(room_h, black_h + 2 * print.rim_mm);
  const double step_w = cell_w + 2 * kCut_mm, step_h = cell_h + kCaption_mm + kCut_mm;
  const int columns = std::max(1, static_cast<int>((paper->width_mm - 2 * kMargin_mm) / step_w)),
            rows = std::max(1, static_cast<int>((paper->height_mm - kMargin_mm - kFoot_mm) / step_h));
  Pdf pdf(paper->width_mm, paper->height_mm);
  *pages = 0;
  for (size_t i = 0; i < sheet.ids.size(); i++) {
    const int place = static_cast<int>(i % static_cast<size_t>(columns * rows));
    if (place == 0) {
      pdf.page();
      ruler(pdf, *paper, text("%.1f mm: ", 1000 * sheet.size_m) + print.measure + ".");
      ++*pages;
    }
    const int column = place % columns, row = place / columns;
    const double left = 0.5 * paper->width_mm + (column - 0.5 * columns) * step_w + 0.5 * (step_w - cell_w);
    const double top = kMargin_mm + row * step_h;
    cut_marks(pdf, left, top, left + cell_w, top + cell_h);
    print.draw(pdf,
               {left + 0.5 * cell_w - 0.5 * (print.left_mm + print.right_mm),
                top + 0.5 * cell_h - 0.5 * (print.top_mm + print.bottom_mm)},
               sheet.ids[i]);
    pdf.text({left + kMargin_mm, top + cell_h + 5}, std::min(4.0, 0.06 * cell_w),
             sheet.family + " " + std::to_string(sheet.ids[i]) + text("   %.0f mm   this way up", 1000 * sheet.size_m));
  }
  return pdf.bytes();
}

}  // namespace wm::tools
