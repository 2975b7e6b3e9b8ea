// SPDX-License-Identifier: Apache-2.0
// Coded markers of all families found and read in rendered views: mr_views [VIEWS]. Prints a table and holds the bars:
// recall at least 0.95 where a module has 3 px or more, no false identity.
#include <algorithm>
#include <memory>

#include "common/eyes.hpp"
#include "common/marker_views.hpp"
#include "common/suite.h"
#include "common/trials.h"
#include "waymark/detectors.h"
#include "waymark/mr_code.h"

namespace {

using namespace wm::views;

uint64_t views = 500;

using Machine = wm::drawn::marker_eyes;

// A family of square markers; its print with the rim is 1 wide.
class Family {
 public:
  explicit Family(const char *name) {
    TEST_ASSERT_TRUE(wm_marker_family_make(name, 4096, &family_, &codes_));
    across_ = family_.is_white_inside ? family_.across : family_.border + 2;
  }
  ~Family() { std::free(codes_); }
  Family(const Family &) = delete;
  Family &operator=(const Family &) = delete;
  int across() const { return across_; }
  uint32_t count() const { return family_.count; }
  double size_of(double whole_m) const { return whole_m * family_.border / across_; }
  Ink ink(uint32_t id) const {
    const int beside = (across_ - family_.border) / 2, last = family_.border - 1;
    // White, but for the rings; modules that are neither are what is behind (beside a circle).
    std::vector<int> kind(static_cast<size_t>(across_ * across_), family_.is_white_inside ? -1 : 0);
    const auto at = [&](int x, int y) -> int & {
      return kind[static_cast<size_t>((y + beside) * across_ + x + beside)];
    };
    for (int y = 0; y <= last; y++)
      for (int x = 0; x <= last; x++) at(x, y) = family_.is_white_inside ? 0 : 1;
    for (int i = -1; family_.is_white_inside && i <= last + 1; i++)
      at(i, -1) = at(i, last + 1) = at(-1, i) = at(last + 1, i) = 1;
    for (int i = 0; i < family_.bits; i++)
      at(family_.x[i], family_.y[i]) = family_.codes[id] >> (family_.bits - 1 - i) & 1 ? 0 : 1;
    const int across = across_, sign = family_.half_turned ? -1 : 1;
    return [=](double x, double y) {
      const int u = static_cast<int>(std::floor((0.5 + sign * x) * across)),
                v = static_cast<int>(std::floor((0.5 + sign * y) * across));
      return u < 0 || v < 0 || u >= across || v >= across ? -1 : kind[static_cast<size_t>(v * across + u)];
    };
  }

 private:
  wm_square_family family_;
  uint64_t *codes_ = nullptr;
  int across_;
};

// Cameras take turns with each view, sizes with each second one.
double size_of(uint64_t i) { return i % 4 < 2 ? 0.2 : 0.4; }

struct Row {
  const char *name;
  double from_px, to_px;
  int there = 0, found = 0;
};

struct Tally {
  Row rows[5] = {
      {"below 2", 0, 2}, {"2 to 2.5", 2, 2.5}, {"2.5 to 3", 2.5, 3}, {"3 to 5", 3, 5}, {"from 5 on", 5, 1e9}};
  int false_ids = 0, doubled = 0;
  std::vector<double> aside_errors;

  void take(const View &view, double module_px, int32_t id, const wm_event *events, size_t count) {
    int found = 0;
    for (size_t i = 0; i < count; i++) {
      const wm_marker &m = events[i].as.marker;
      if (m.id != id) {
        false_ids++;
        continue;
      }
      found++;
      const wm::vec3 p = {-m.p_m[1], -m.p_m[2], m.p_m[0]}, off = p - view.centre_m;
      const double along = wm::dot(off, view.centre_m) / view.distance_m;
      aside_errors.push_back(std::sqrt(std::max(0.0, wm::dot(off, off) - along * along)) / view.distance_m);
    }
    if (found > 1) doubled++;
    for (Row &row : rows)
      if (module_px >= row.from_px && module_px < row.to_px) row.there++, row.found += found > 0;
  }
  double recall_from(double px) const {
    int there = 0, found = 0;
    for (const Row &row : rows)
      if (row.from_px >= px) there += row.there, found += row.found;
    return there ? static_cast<double>(found) / there : 1;
  }
  static double median(std::vector<double> values) {
    if (values.empty()) return NAN;
    std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  }
  void print(const char *name) const {
    std::printf("%-16s", name);
    for (const Row &row : rows) std::printf("  %s px: %d/%d", row.name, row.found, row.there);
    std::printf("\n%-16s  recall from 3 px on %.3f, false identities %d, median error of direction %.2f mrad\n", "",
                recall_from(3), false_ids, 1000 * median(aside_errors));
  }
};

using Machines = std::vector<std::unique_ptr<Machine>>;

// One a camera and size.
Machines machines_of(const wm_detector *detector, const char *family, double part) {
  Machines out;
  for (uint64_t i = 0; i < 4; i++)
    out.push_back(std::make_unique<Machine>(detector, draw_view(i, size_of(i)).camera, family, part * size_of(i)));
  return out;
}

TEST(mr_codes_are_found_and_none_is_false) {
  const Machines mr = machines_of(wm_detector_find("mr"), "mr", 1);
  Tally tally;
  for (uint64_t i = 0; i < views; i++) {
    const View view = draw_view(i, size_of(i));
    const auto id = static_cast<uint32_t>(i * 37 % 587);
    const std::vector<uint8_t> print = take_picture(view, mr_ink(id));
    const size_t count = mr[i % 4]->look(print);
    tally.take(view, view.scale_px * WM_MR_MODULE, static_cast<int32_t>(id), mr[i % 4]->events.data(), count);
  }
  std::printf("%d views of 0.5 to 4 m, up to 60 degrees; prints 0.2 and 0.4 m wide; a module's smaller side:\n",
              static_cast<int>(views));
  tally.print("mr");
  TEST_ASSERT_EQUAL(0, tally.false_ids);
  TEST_ASSERT_EQUAL(0, tally.doubled);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.95, tally.recall_from(3));
}

// The picture of each print is shown to the next family's detector, and to mr, too: it has none of their identities.
TEST(all_families_are_found) {
  size_t library_count;
  const wm_detector *squares = wm_library_detectors(&library_count)[0];
  const Machines mr = machines_of(wm_detector_find("mr"), "mr", 1);
  std::vector<const char *> names;
  for (const char *const *name = wm_marker_family_names + 1; *name; name++) names.push_back(*name);
  int false_ids = 0, there = 0, found = 0;
  for (size_t k = 0; k < names.size(); k++) {
    const Family family(names[k]), next(names[(k + 1) % names.size()]);
    const Machines own = machines_of(squares, names[k], family.size_of(1)),
                   others = machines_of(squares, names[(k + 1) % names.size()], next.size_of(1));
    // Few bits, or codes that are a bit apart: a misread one is another identity.
    const bool is_short = std::strcmp(names[k], "tag16h5") == 0 || std::strncmp(names[k], "aruco_4x4", 9) == 0 ||
                          std::strcmp(names[k], "aruco_original") == 0;
    const bool next_overlaps = std::strncmp(names[k], "aruco", 5) == 0;  // a dictionary is in the next larger one
    Tally tally;
    int foreign = 0;
    for (uint64_t i = 0; i < (views + 4) / 5; i++) {
      const View view = draw_view(5 * i + k, size_of(5 * i + k));
      const uint32_t id = static_cast<uint32_t>(i * 37 + k) % family.count();
      const std::vector<uint8_t> picture = take_picture(view, family.ink(id));
      Machine &reader = *own[(5 * i + k) % 4];
      const size_t count = reader.look(picture);
      tally.take(view, view.scale_px / family.across(), static_cast<int32_t>(id), reader.events.data(), count);
      if (!next_overlaps) foreign += static_cast<int>(others[(5 * i + k) % 4]->look(picture));
      foreign += static_cast<int>(mr[(5 * i + k) % 4]->look(picture));
    }
    tally.print(names[k]);
    if (foreign) std::printf("%d in other families' pictures\n", foreign);
    TEST_ASSERT_EQUAL(0, tally.doubled);
    if (!is_short) false_ids += tally.false_ids + foreign;
    for (const Row &row : tally.rows)
      if (row.from_px >= 3) there += row.there, found += row.found;
  }
  std::printf("all families: recall from 3 px on %d of %d\n", found, there);
  TEST_ASSERT_EQUAL(0, false_ids);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.95 * there, found);
}

}  // namespace

int suite_begin(int argc, char **argv) {
  if (argc > 1) views = std::strtoull(argv[1], nullptr, 10);
  views = wm_trials(views, 12);
  return SUITE_RUNS;
}
