// SPDX-License-Identifier: Apache-2.0
// MR codes found and read in rendered views, AprilTag's own detector beside them on the same views: mr_views [VIEWS].
// Prints the table and holds the bars: recall at least 0.95 where a module has 3 px or more, no false identity.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "common/marker_views.hpp"
#include "common/trials.h"
#include "unity.h"
#include "waymark/detectors.h"
#include "waymark/mr_code.h"

namespace {

using namespace wm::views;

uint64_t views = 500;

// A detector on a camera.
class Machine {
 public:
  Machine(const wm_detector *detector, const char *family, const wm_camera &camera, double size_m)
      : detector_(detector) {
    wm_rig_init(&rig_);
    rig_.camera_count = 1;
    rig_.cameras[0] = camera;
    std::strcpy(rig_.marker_family, family);
    rig_.marker_size_m = size_m;
    std::vector<char> params(detector->params.bytes);
    wm_params_defaults(&detector->params, params.data());
    const wm_view view = {&rig_, &index_, nullptr, 0, nullptr, 0, nullptr, 0};
    const char *why = "";
    const size_t bytes = detector->state_bytes(params.data(), &view, &why);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
    state_.reset(std::aligned_alloc(64, (bytes + 63) / 64 * 64));
    TEST_ASSERT_EQUAL(WM_OK, detector->init(state_.get(), params.data(), &view));
  }
  size_t look(const wm_frame &frame, wm_event *events, size_t capacity) {
    size_t count = 0;
    TEST_ASSERT_EQUAL(WM_OK, detector_->detect(state_.get(), &frame, nullptr, events, capacity, &count));
    return count;
  }

 private:
  struct Freer {
    void operator()(void *p) const { std::free(p); }
  };
  const wm_detector *detector_;
  wm_rig rig_;
  int32_t index_ = 0;
  std::unique_ptr<void, Freer> state_;
};

// tag36h11, its black square 1 wide, upright as ArUco reads it.
class Tags {
 public:
  Tags() : family_(tag36h11_create()) {}
  ~Tags() { tag36h11_destroy(family_); }
  Ink ink(uint32_t id) {
    const std::shared_ptr<image_u8_t> image(apriltag_to_image(family_, id % family_->ncodes), [](image_u8_t *i) {
      std::free(i->buf);
      std::free(i);
    });
    return [image](double x, double y) {
      const int i = static_cast<int>(std::floor((0.5 - x) * 8 + 1)),
                j = static_cast<int>(std::floor((0.5 - y) * 8 + 1));
      if (i < 0 || j < 0 || i >= image->width || j >= image->height) return -1;
      return image->buf[j * image->stride + i] ? 0 : 1;
    };
  }

 private:
  apriltag_family_t *family_;
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
    std::printf("%-9s", name);
    for (const Row &row : rows) std::printf("  %s px: %d/%d", row.name, row.found, row.there);
    std::printf("\n%-9s  recall from 3 px on %.3f, false identities %d, median error of direction %.2f mrad\n", "",
                recall_from(3), false_ids, 1000 * median(aside_errors));
  }
};

void codes_are_found_and_none_is_false() {
  size_t library_count;
  const wm_detector *tag_detector = wm_library_detectors(&library_count)[0], *mr = wm_detector_find("mr");
  const auto machines = [](const wm_detector *detector, const char *family) {
    std::vector<std::unique_ptr<Machine>> out;
    for (uint64_t i = 0; i < 4; i++)
      out.push_back(std::make_unique<Machine>(detector, family, draw_view(i, size_of(i)).camera, size_of(i)));
    return out;
  };
  const auto mr_machine = machines(mr, "mr"), tag_machine = machines(tag_detector, "tag36h11");
  Tags tags;
  Tally of_mr, of_tags;
  wm_event events[16];
  for (uint64_t i = 0; i < views; i++) {
    const View view = draw_view(i, size_of(i));
    const auto id = static_cast<uint32_t>(i * 37 % 587);
    const std::vector<uint8_t> print = take_picture(view, mr_ink(id)), tag = take_picture(view, tags.ink(id));
    size_t count = mr_machine[i % 4]->look(frame_of(print, view.camera), events, 16);
    of_mr.take(view, view.scale_px * WM_MR_MODULE, static_cast<int32_t>(id), events, count);
    count = tag_machine[i % 4]->look(frame_of(tag, view.camera), events, 16);
    of_tags.take(view, view.scale_px / 8, static_cast<int32_t>(id), events, count);
    // An MR code in the picture is no AprilTag, and the other way round.
    count = tag_machine[i % 4]->look(frame_of(print, view.camera), events, 16);
    of_tags.false_ids += static_cast<int>(count);
    count = mr_machine[i % 4]->look(frame_of(tag, view.camera), events, 16);
    of_mr.false_ids += static_cast<int>(count);
  }
  std::printf("%d views of 0.5 to 4 m, up to 60 degrees; prints 0.2 and 0.4 m wide; a module's smaller side:\n",
              static_cast<int>(views));
  of_mr.print("mr");
  of_tags.print("tag36h11");
  TEST_ASSERT_EQUAL(0, of_mr.false_ids);
  TEST_ASSERT_EQUAL(0, of_mr.doubled);
  TEST_ASSERT_TRUE(of_mr.recall_from(3) >= 0.95);
}

}  // namespace

void setUp() {}
void tearDown() {}

int main(int argc, char **argv) {
  if (argc > 1) views = std::strtoull(argv[1], nullptr, 10);
  views = wm_trials(views, 6);
  UNITY_BEGIN();
  RUN_TEST(codes_are_found_and_none_is_false);
  return UNITY_END();
}
