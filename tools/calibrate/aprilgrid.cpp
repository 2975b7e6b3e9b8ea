// SPDX-License-Identifier: Apache-2.0
// Kalibr's AprilGrid by AprilTag's C library.
extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

#include <memory>

#include "calibrate/corners.h"

namespace wm::calibrate {

std::vector<BoardCorner> find_aprilgrid(const tools::GreyPicture &picture, int columns, int rows, double tag_m,
                                        double gap_m) {
  const std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(), tag36h11_destroy);
  const std::unique_ptr<apriltag_detector_t, decltype(&apriltag_detector_destroy)> detector(apriltag_detector_create(),
                                                                                            apriltag_detector_destroy);
  apriltag_detector_add_family_bits(detector.get(), family.get(), 2);
  detector->quad_decimate = 1;
  detector->nthreads = 1;
  tools::GreyPicture copy = picture;
  image_u8_t image = {copy.width, copy.height, copy.width, copy.pixels.data()};
  const std::unique_ptr<zarray_t, decltype(&apriltag_detections_destroy)> found(
      apriltag_detector_detect(detector.get(), &image), apriltag_detections_destroy);

  std::vector<BoardCorner> out;
  for (int i = 0; i < zarray_size(found.get()); i++) {
    apriltag_detection_t *tag = nullptr;
    zarray_get(found.get(), i, &tag);
    if (tag->id < 0 || tag->id >= columns * rows || tag->decision_margin < 25) continue;
    // Corners from the lower left against the clock, as the library gives them.
    const int column = tag->id % columns, row = tag->id / columns;
    const Vec2 foot(column * (tag_m + gap_m), row * (tag_m + gap_m));
    const Vec2 place[4] = {{0, 0}, {tag_m, 0}, {tag_m, tag_m}, {0, tag_m}};
    for (int k = 0; k < 4; k++) {
      Vec2 pixel(tag->p[k][0] - 0.5, tag->p[k][1] - 0.5);  // its pixels' centres lie at one half
      const Vec2 rough = pixel;
      if (!refine_corner(picture, 3, pixel) || (pixel - rough).norm() > 2) pixel = rough;
      out.push_back({pixel, foot + place[k]});
    }
  }
  return out;
}

}  // namespace wm::calibrate
