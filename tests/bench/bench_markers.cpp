// SPDX-License-Identifier: Apache-2.0
// Time of a 640 x 480 picture with coded markers, edges and pose included, and of the AprilTag library's search in the
// same pictures, at full resolution and at half of it (its default), with one thread and without poses. Three rendered
// views of each (tests/common/marker_views.hpp), with an office's worth of clutter.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "common/marker_views.hpp"
#include "detector_at_work.h"
#include "timing.h"
#include "vision/markers/dark_regions.hpp"
#include "waymark/detectors.h"
#include "waymark/mr_code.h"

namespace {

using namespace wm::views;

Ink tag_ink(const image_u8_t *image) {
  return [image](double x, double y) {
    const int i = static_cast<int>(std::floor((0.5 - x) * 8 + 1)), j = static_cast<int>(std::floor((0.5 - y) * 8 + 1));
    if (i < 0 || j < 0 || i >= image->width || j >= image->height) return -1;
    return image->buf[j * image->stride + i] ? 0 : 1;
  };
}

constexpr int kViews = 3, kRounds = 31;

View view_of(int i) { return draw_view(2 * static_cast<uint64_t>(i), 0.4); }

// Mean over the views of each one's median, us.
double whole(const char *name, const wm_detector *detector, const char *family, const Ink &ink) {
  double sum = 0;
  size_t found = 0;
  for (int i = 0; i < kViews; i++) {
    const View view = view_of(i);
    const std::vector<uint8_t> grey = take_picture(view, ink);
    wm_rig rig;
    wm_rig_init(&rig);
    rig.camera_count = 1;
    rig.cameras[0] = view.camera;
    (void)std::snprintf(rig.marker_family, sizeof rig.marker_family, "%s", family);
    rig.marker_size_m = view.size_m;
    const int32_t camera = 0;
    bench::detector_at_work work(detector, {&rig, &camera, nullptr, 0, nullptr, 0, nullptr, 0});
    size_t count = 0;
    const wm_frame frame = frame_of(grey, view.camera);
    sum += bench::median_us(kRounds, [&] { count = work.look(&frame); });
    found += count;
  }
  std::printf("markers_640x480_%s_us %.0f (%zu markers in %d pictures)\n", name, sum / kViews, found, kViews);
  return sum / kViews;
}

// The AprilTag library's search; `ours_us` is compared with it.
void whole_by_library(apriltag_family_t *family, int decimate, const Ink &ink, double ours_us) {
  apriltag_detector_t *detector = apriltag_detector_create();
  apriltag_detector_add_family(detector, family);
  detector->quad_decimate = static_cast<float>(decimate);
  double sum = 0;
  int found = 0;
  for (int i = 0; i < kViews; i++) {
    const View view = view_of(i);
    std::vector<uint8_t> grey = take_picture(view, ink);
    const auto width = static_cast<int32_t>(view.camera.width_px), height = static_cast<int32_t>(view.camera.height_px);
    image_u8_t image = {width, height, width, grey.data()};
    int count = 0;
    sum += bench::median_us(kRounds, [&] {
      zarray_t *seen = apriltag_detector_detect(detector, &image);
      count = zarray_size(seen);
      apriltag_detections_destroy(seen);
    });
    found += count;
  }
  apriltag_detector_remove_family(detector, family);
  apriltag_detector_destroy(detector);
  std::printf("markers_640x480_tag36h11_library_decimate_%d_us %.0f (%d markers in %d pictures)\n", decimate,
              sum / kViews, found, kViews);
  std::printf("markers_640x480_tag36h11_over_library_decimate_%d %.2f\n", decimate, ours_us * kViews / sum);
}

}  // namespace

int main() {
  size_t count;
  const wm_detector *const *library = wm_library_detectors(&count);
  const wm_detector *tags = library[0];
  for (size_t i = 0; i < count; i++)
    if (std::strcmp(library[i]->name, "apriltag") == 0) tags = library[i];
  whole("mr", wm_detector_find("mr"), "mr", mr_ink(7));
  apriltag_family_t *family = tag36h11_create();
  image_u8_t *image = apriltag_to_image(family, 7);
  const double ours_us = whole("tag36h11", tags, "tag36h11", tag_ink(image));
  for (const int decimate : {1, 2}) whole_by_library(family, decimate, tag_ink(image), ours_us);
  // Its first part: threshold, mask, regions.
  const View view = draw_view(0, 0.4);
  const std::vector<uint8_t> grey = take_picture(view, mr_ink(7));
  const wm_frame frame = frame_of(grey, view.camera);
  wm::dark_work work;
  const size_t bytes = wm::dark_work_lay_out(&work, frame.width_px, frame.height_px, nullptr);
  auto *memory = static_cast<uint8_t *>(std::aligned_alloc(64, bytes));
  if (!memory) return 1;
  wm::dark_work_lay_out(&work, frame.width_px, frame.height_px, memory);
  std::printf("dark_regions_640x480_us %.0f\n",
              bench::median_us(31, [&] { wm::find_regions(&work, frame, 20, false); }));
  uint32_t id = 0;
  int wrong = 0;
  uint64_t modules = wm_mr_encode(77) ^ 0x1001001;
  std::printf("mr_decode_us %.2f\n", bench::median_us(31, [&] {
                                       for (int i = 0; i < 100; i++) (void)wm_mr_decode(modules, &id, &wrong);
                                     }) / 100);
  std::free(memory);
  std::free(image->buf);
  std::free(image);
  tag36h11_destroy(family);
}
