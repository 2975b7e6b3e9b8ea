// SPDX-License-Identifier: Apache-2.0
// Others' libraries at the same work as a row of bench.cpp: the AprilTag library; MRPT and OpenCV where their packages
// were there at the build. One thread each.
#pragma once

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "drawn_map.h"
#include "drawn_window.h"
#ifdef WM_HAS_MRPT
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#endif
#ifdef WM_HAS_OPENCV
#include <opencv2/imgproc.hpp>
#endif

namespace bench {

// The search for tag36h11 in a grey picture, at full resolution (1) or at half of it (2, the library's default),
// without poses. True: it found one.
inline std::function<bool()> library_search(std::vector<uint8_t> grey, int width, int height, int decimate) {
  const std::shared_ptr<apriltag_family_t> family(tag36h11_create(), tag36h11_destroy);
  const std::shared_ptr<apriltag_detector_t> detector(apriltag_detector_create(), apriltag_detector_destroy);
  apriltag_detector_add_family(detector.get(), family.get());
  detector->quad_decimate = static_cast<float>(decimate);
  return [=, pixels = std::make_shared<std::vector<uint8_t>>(std::move(grey))] {
    image_u8_t image = {width, height, width, pixels->data()};
    zarray_t *seen = apriltag_detector_detect(detector.get(), &image);
    const int found = zarray_size(seen);
    apriltag_detections_destroy(seen);
    return family && found > 0;
  };
}

#ifdef WM_HAS_MRPT
// Weights of particles by a scan, on the map of cloud_at_work: MRPT's likelihood field with its cache.
inline std::function<bool()> mrpt_weights(int particles) {
  using mrpt::maps::COccupancyGridMap2D;
  const auto edges = drawn_edges();
  const auto grid = std::make_shared<COccupancyGridMap2D>(0.0f, static_cast<float>(kMapWidth * kMapPixel_m), 0.0f,
                                                          static_cast<float>(kMapHeight * kMapPixel_m),
                                                          static_cast<float>(kMapPixel_m));
  grid->fill(0.9f);
  for (int y = 0; y < kMapHeight; y++)
    for (int x = 0; x < kMapWidth; x++)
      if (edges[static_cast<size_t>(y) * kMapWidth + static_cast<size_t>(x)])
        grid->setCell(x, kMapHeight - 1 - y, 0.0f);
  auto &options = grid->likelihoodOptions;
  options.likelihoodMethod = COccupancyGridMap2D::lmLikelihoodField_Thrun;
  options.LF_decimation = 1;
  options.LF_stdHit = 0.05f;
  options.LF_maxCorrsDistance = 0.3f;
  options.LF_maxRange = 80.0f;
  options.enableLikelihoodCache = true;
  const auto scan = std::make_shared<mrpt::obs::CObservation2DRangeScan>();
  scan->aperture = static_cast<float>(kScanAperture_rad);
  scan->maxRange = 80.0f;
  scan->resizeScan(kScanPoints);
  for (int i = 0; i < kScanPoints; i++) {
    scan->setScanRange(static_cast<size_t>(i), static_cast<float>(scan_range_m(i)));
    scan->setScanRangeValidity(static_cast<size_t>(i), true);
  }
  return [=] {
    double sum = 0;
    for (uint64_t i = 0; i < static_cast<uint64_t>(particles); i++) {
      const auto draw = [i](uint64_t k) { return wm_random_normal(2, k, i); };
      const mrpt::poses::CPose3D pose(kCloudMean.x_m + 0.05 * draw(1), kCloudMean.y_m + 0.05 * draw(2), 0,
                                      0.02 * draw(3), 0, 0);
      sum += grid->computeObservationLikelihood(*scan, pose);
    }
    return sum != 0;
  };
}
#endif

#ifdef WM_HAS_OPENCV
// HoughLines of a window with a line in noise, 200 angles.
inline std::function<bool()> opencv_lines() {
  cv::setNumThreads(1);
  const window_at_work window;
  auto edge = std::make_shared<cv::Mat>(50, 50, CV_8UC1);
  for (int i = 0; i < 2500; i++) edge->data[i] = window.pixels[i] > 230 ? 255 : 0;
  return [=, lines = std::vector<cv::Vec2f>()]() mutable {
    cv::HoughLines(*edge, lines, 1, CV_PI / 200, 25);
    return true;
  };
}
#endif

}  // namespace bench
