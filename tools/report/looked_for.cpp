// SPDX-License-Identifier: Apache-2.0
// What became of the landmarks that it looked for: found, or why not.
#include <algorithm>
#include <map>

#include "common/csv.h"
#include "report/page.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr size_t kRowsAtMost = 40;

// In the table's order; the last four weren't to be seen at all.
constexpr wm_look kReasons[] = {WM_LOOK_UNLIKE,    WM_LOOK_AMBIGUOUS, WM_LOOK_LOW_CONTRAST, WM_LOOK_BLURRED,
                                WM_LOOK_UNCERTAIN, WM_LOOK_TOO_SMALL, WM_LOOK_FACES_AWAY,   WM_LOOK_NOT_IN_VIEW};

using Counts = std::array<int64_t, WM_LOOK_COUNT>;

int64_t expected(const Counts &counts) {
  int64_t sum = 0;
  for (unsigned i = 0; i < WM_LOOK_COUNT; ++i) sum += wm_look_is_expected(i) ? counts[i] : 0;
  return sum;
}

void add(const Counts &more, Counts *to) {
  for (size_t i = 0; i < more.size(); ++i) (*to)[i] += more[i];
}

std::string row(const std::string &name, const Counts &counts) {
  const int64_t all = expected(counts), found = counts[WM_LOOK_FOUND];
  const double share = all > 0 ? static_cast<double>(found) / static_cast<double>(all) : 0;
  std::string out = "<tr><td>" + name + "<span class=\"share\"><i class=\"f\" style=\"width:" + fixed(100 * share, 1) +
                    "%\"></i>" +
                    (all > 0 ? "<i class=\"d\" style=\"width:" + fixed(100 * (1 - share), 1) + "%\"></i>" : "") +
                    "</span></td><td>" + count_text(all) + "</td><td>" + count_text(found) + "</td>";
  for (const wm_look reason : kReasons) {
    const bool is_miss = wm_look_is_expected(reason) && counts[reason] > 0;
    out += std::string(is_miss ? "<td class=\"some\">" : "<td>") + count_text(counts[reason]) + "</td>";
  }
  return out + "</tr>";
}

}  // namespace

std::vector<LandmarkLooks> load_looked_for(const std::filesystem::path &file) {
  std::vector<LandmarkLooks> out;
  if (!std::filesystem::exists(file)) return out;
  const Csv csv = Csv::load(file);
  const size_t source = csv.need("source"), landmark = csv.need("landmark");
  std::array<size_t, WM_LOOK_COUNT> columns{};
  for (unsigned i = 0; i < WM_LOOK_COUNT; ++i) columns[i] = csv.need(wm_look_name(i));
  for (size_t r = 0; r < csv.rows(); ++r) {
    LandmarkLooks looks{std::string(csv.text(r, source)), csv.integer(r, landmark), {}};
    for (size_t i = 0; i < columns.size(); ++i) looks.counts[i] = csv.integer(r, columns[i]);
    out.push_back(std::move(looks));
  }
  return out;
}

std::string looked_for_section(const ReportData &data) {
  std::map<std::string, Counts> by_source;
  std::map<int64_t, Counts> by_landmark;
  for (const LandmarkLooks &looks : data.looked_for) {
    add(looks.counts, &by_source[looks.source]);
    add(looks.counts, &by_landmark[looks.landmark]);
  }
  std::vector<std::pair<int64_t, Counts>> seen;
  for (const auto &[landmark, counts] : by_landmark)
    if (expected(counts) > 0) seen.emplace_back(landmark, counts);
  if (by_source.empty()) return "";
  std::stable_sort(seen.begin(), seen.end(),
                   [](const auto &a, const auto &b) { return expected(a.second) > expected(b.second); });
  std::string rows;
  for (const auto &[source, counts] : by_source) rows += row("<b>" + escape(plain(source)) + "</b>", counts);
  for (size_t i = 0; i < std::min(seen.size(), kRowsAtMost); ++i)
    rows += row(std::to_string(seen[i].first), seen[i].second);
  std::string note = count_text(static_cast<int64_t>(by_landmark.size() - seen.size())) +
                     " of the map’s landmarks were never expected in a picture.";
  if (seen.size() > kRowsAtMost)
    note += " " + count_text(static_cast<int64_t>(seen.size() - kRowsAtMost)) +
            " that were seldom expected are not listed.";
  std::string head;
  for (const wm_look reason : kReasons) head += "<th>" + plain(wm_look_name(reason)) + "</th>";
  return section(
      "Landmarks looked for",
      "Each landmark of the map once for each picture. Expected: in the picture, large enough, seen from its front, "
      "and its place known well enough to look there. Unlike: something else is there, the landmark is hidden, moved "
      "or replaced. A landmark that is often unlike needs a new picture or a new place. The last four columns count "
      "pictures in which it could not be seen, or its place was too uncertain.",
      "<div class=\"wide\"><table><tr><th>landmark</th><th>expected</th><th>found</th>" + head + "</tr>" + rows +
          "</table></div><p class=\"note\">" + note + "</p>" +
          legend({{"<i class=\"key\" style=\"background:var(--blue)\"></i>", "found"},
                  {"<i class=\"key\" style=\"background:var(--amber)\"></i>", "expected and not found"}}));
}

}  // namespace wm::tools
