// SPDX-License-Identifier: Apache-2.0
// Ours and others' at the same work, one thread, in one run: weights of 200 and 2000 particles by 180 points on a map
// of 4676 x 1372 pixels (MRPT's likelihood field), and the lines of a window of 50 x 50 (OpenCV's HoughLines). Others
// are measured where their Debian packages were there at the build.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "drawn_map.h"
#include "drawn_window.h"
#include "timing.h"
#include "waymark/random.h"
#ifdef WM_HAS_MRPT
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#endif
#ifdef WM_HAS_OPENCV
#include <opencv2/imgproc.hpp>
#endif

namespace {

struct pose {
  double x, y, heading;
};
std::vector<pose> cloud_of(int count) {
  std::vector<pose> out;
  for (uint64_t i = 0; i < static_cast<uint64_t>(count); i++) {
    const auto draw = [i](uint64_t k) { return wm_random_normal(2, k, i); };
    out.push_back({bench::kCloudMean.x_m + 0.05 * draw(1), bench::kCloudMean.y_m + 0.05 * draw(2), 0.02 * draw(3)});
  }
  return out;
}

void ours() {
  for (int particles : {200, 2000}) {
    bench::cloud_at_work work(particles);
    std::printf("%5d particles x %d points: ours %9.1f us\n", particles, bench::kScanPoints,
                bench::median_us(1001, [&] { work.weigh(); }));
  }
}

void mrpt_field() {
#ifdef WM_HAS_MRPT
  const std::vector<uint8_t> edges = bench::drawn_edges();
  using namespace mrpt::maps;
  COccupancyGridMap2D grid(0.0f, static_cast<float>(bench::kMapWidth * bench::kMapPixel_m), 0.0f,
                           static_cast<float>(bench::kMapHeight * bench::kMapPixel_m),
                           static_cast<float>(bench::kMapPixel_m));
  grid.fill(0.9f);
  for (int y = 0; y < bench::kMapHeight; y++)
    for (int x = 0; x < bench::kMapWidth; x++)
      if (edges[static_cast<size_t>(y) * bench::kMapWidth + static_cast<size_t>(x)])
        grid.setCell(x, bench::kMapHeight - 1 - y, 0.0f);
  grid.likelihoodOptions.likelihoodMethod = COccupancyGridMap2D::lmLikelihoodField_Thrun;
  grid.likelihoodOptions.LF_decimation = 1;
  grid.likelihoodOptions.LF_stdHit = 0.05f;
  grid.likelihoodOptions.LF_maxCorrsDistance = 0.3f;
  grid.likelihoodOptions.LF_maxRange = 80.0f;
  grid.likelihoodOptions.enableLikelihoodCache = true;
  mrpt::obs::CObservation2DRangeScan scan;
  scan.aperture = static_cast<float>(bench::kScanAperture_rad);
  scan.maxRange = 80.0f;
  scan.resizeScan(bench::kScanPoints);
  for (int i = 0; i < bench::kScanPoints; i++) {
    scan.setScanRange(static_cast<size_t>(i), static_cast<float>(bench::scan_range_m(i)));
    scan.setScanRangeValidity(static_cast<size_t>(i), true);
  }
  for (int particles : {200, 2000}) {
    const std::vector<pose> cloud = cloud_of(particles);
    volatile double kept = 0;
    const auto weigh = [&] {
      for (const pose &p : cloud)
        kept = kept + grid.computeObservationLikelihood(scan, mrpt::poses::CPose3D(p.x, p.y, 0, p.heading, 0, 0));
    };
    for (int i = 0; i < 3; i++) weigh();  // fills its cache
    std::printf("%5d particles x %d points: MRPT's likelihood field %9.1f us\n", particles, bench::kScanPoints,
                bench::median_us(particles > 1000 ? 15 : 51, weigh));
  }
#else
  (void)cloud_of;
  std::printf("MRPT: not measured, it was not there at the build (Debian: libmrpt-maps-dev libmrpt-obs-dev)\n");
#endif
}

void windows() {
  bench::window_at_work window([](int i) {  // a line in noise, as a gradient's magnitude has it
    return (std::abs(i % 50 - 10 - i / 100) < 2 ? 180 : 0) + 40 * wm_random_uniform(1, 2, static_cast<uint64_t>(i));
  });
  volatile int kept = 0;
  const double us = bench::median_us(1001, [&] { kept = kept + window.all_slopes(wm::hough_transform); });
  std::printf("window of 50 x 50: ours, all slopes of four quadrants %9.1f us\n", us);
#ifdef WM_HAS_OPENCV
  cv::setNumThreads(1);
  cv::Mat edge(50, 50, CV_8UC1);
  for (int i = 0; i < 2500; i++) edge.data[i] = window.pixels[i] > 30 ? 255 : 0;
  std::vector<cv::Vec2f> lines;
  const double theirs = bench::median_us(201, [&] { cv::HoughLines(edge, lines, 1, CV_PI / 200, 25); });
  std::printf("window of 50 x 50: OpenCV's HoughLines, 200 angles %9.1f us (%zu lines)\n", theirs, lines.size());
#else
  std::printf("OpenCV: not measured, it was not there at the build (Debian: libopencv-imgproc-dev)\n");
#endif
}

}  // namespace

int main() {
  ours();
  mrpt_field();
  windows();
  return 0;
}
