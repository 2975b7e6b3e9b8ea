// SPDX-License-Identifier: Apache-2.0
#include "map/pdf.h"

#include "common/failure.h"

namespace wm::tools {
namespace {

float points(double mm) { return static_cast<float>(mm * 72 / 25.4); }

}  // namespace

Pdf::Pdf(double width_mm, double height_mm)
    : document_(HPDF_New(nullptr, nullptr)), width_mm_(width_mm), height_mm_(height_mm) {
  if (document_ == nullptr) throw Failure("libharu could not begin a PDF: no memory");
  HPDF_SetViewerPreference(document_, HPDF_PRINT_SCALING_NONE);
}

Pdf::~Pdf() { HPDF_Free(document_); }

void Pdf::page() {
  page_ = HPDF_AddPage(document_);
  HPDF_Page_SetWidth(page_, points(width_mm_));
  HPDF_Page_SetHeight(page_, points(height_mm_));
}

void Pdf::area(const std::vector<Point> &outline, bool black) {
  HPDF_Page_SetGrayFill(page_, black ? 0 : 1);
  for (size_t i = 0; i < outline.size(); i++)
    (i == 0 ? HPDF_Page_MoveTo : HPDF_Page_LineTo)(page_, points(outline[i].x_mm),
                                                   points(height_mm_ - outline[i].y_mm));
  HPDF_Page_Fill(page_);
}

void Pdf::line(Point a, Point b, double width_mm) {
  HPDF_Page_SetGrayStroke(page_, 0);
  HPDF_Page_SetLineWidth(page_, points(width_mm));
  HPDF_Page_MoveTo(page_, points(a.x_mm), points(height_mm_ - a.y_mm));
  HPDF_Page_LineTo(page_, points(b.x_mm), points(height_mm_ - b.y_mm));
  HPDF_Page_Stroke(page_);
}

void Pdf::text(Point at, double height_mm, const std::string &words) {
  HPDF_Page_BeginText(page_);
  HPDF_Page_SetGrayFill(page_, 0);
  HPDF_Page_SetFontAndSize(page_, HPDF_GetFont(document_, "Helvetica", nullptr), points(height_mm));
  HPDF_Page_TextOut(page_, points(at.x_mm), points(height_mm_ - at.y_mm), words.c_str());
  HPDF_Page_EndText(page_);
}

std::string Pdf::bytes() {
  // An error stays in the document: later calls do nothing.
  HPDF_SaveToStream(document_);
  HPDF_UINT32 size = HPDF_GetStreamSize(document_);
  std::string out(size, '\0');
  if (HPDF_GetError(document_) == HPDF_OK)
    HPDF_ReadFromStream(document_, reinterpret_cast<HPDF_BYTE *>(out.data()), &size);
  if (const auto error = HPDF_GetError(document_); error != HPDF_OK || size != out.size())
    throw Failure("libharu could not make the PDF: error " + std::to_string(error));
  return out;
}

}  // namespace wm::tools
