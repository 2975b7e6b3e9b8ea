// SPDX-License-Identifier: Apache-2.0
// Sheets of markers: pages at true scale, and what is refused.
#include "map/print_markers.h"

#include "common/failure.h"
#include "common/suite.h"
#include "made.h"

namespace {

using namespace wm::tools;

bool has(const std::string &pdf, const char *text) { return pdf.find(text) != std::string::npos; }

TEST(a_sheet_is_a_pdf_of_true_size) {
  MarkerSheet sheet;
  sheet.ids = {3};
  sheet.size_m = 0.18;
  int pages = 0;
  const std::string pdf = marker_pdf(sheet, &pages);
  TEST_ASSERT_EQUAL(1, pages);
  TEST_ASSERT_EQUAL_STRING_LEN("%PDF-1.", pdf.c_str(), 7);
  TEST_ASSERT_TRUE(has(pdf, "/MediaBox [ 0 0 595.2755"));  // A4 in points
  TEST_ASSERT_TRUE(has(pdf, "/PrintScaling /None"));
  TEST_ASSERT_TRUE(has(pdf, "mr 3"));
  // The right vertex is half of the size to the right of the page's middle: 105 + 90 mm.
  TEST_ASSERT_TRUE(has(pdf, "552.75592"));
  // The table of objects begins where the trailer says.
  const size_t at = pdf.rfind("startxref\n");
  TEST_ASSERT_EQUAL_STRING_LEN("xref", pdf.c_str() + std::stoul(pdf.substr(at + 10)), 4);
}

TEST(many_small_ones_share_a_page_and_families_differ) {
  MarkerSheet sheet;
  sheet.ids = ids_of("1-20,25");
  TEST_ASSERT_EQUAL(21, sheet.ids.size());
  TEST_ASSERT_EQUAL(25, sheet.ids.back());
  for (const char *family : {"mr", "tag36h11", "tagStandard41h12", "aruco_4x4_50"}) {
    sheet.family = family;
    int pages = 0;
    sheet.size_m = 0.05;
    const std::string pdf = marker_pdf(sheet, &pages);
    TEST_ASSERT_TRUE(pages >= 2 && pages <= 11);
    TEST_ASSERT_TRUE(has(pdf, (std::string(family) + " 25").c_str()));
  }
}

void refused(const MarkerSheet &sheet, const char *says) {
  int pages;
  made::refused(says, [&] { (void)marker_pdf(sheet, &pages); });
}

TEST(what_cannot_be_printed_is_said) {
  MarkerSheet sheet;
  sheet.ids = {1};
  sheet.size_m = 0.28;
  refused(sheet, "does not fit onto a4");
  sheet.size_m = 0.1;
  sheet.paper = "a7";
  refused(sheet, "a4, a3, letter");
  sheet.paper = "a4";
  sheet.family = "qr";
  refused(sheet, "neither mr");
  sheet.family = "tag36h11";
  sheet.ids = {587};
  refused(sheet, "0 to 586");
  for (const char *text : {"", "x", "3-1", "1,,2", "-4", "1-99999999", "7;"})
    made::refused("", [&] { (void)ids_of(text); });
}

}  // namespace
