// SPDX-License-Identifier: Apache-2.0
// What detector `stereo` costs: a pair of 640x480 pictures to followed points, while a vehicle swims over a sea floor.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "../unit/estimator/sea_floor.hpp"
#include "detector_at_work.h"
#include "timing.h"

namespace {

void measure(const char *what, bool fisheye, int32_t tracks) {
  const int pictures_a_round = bench::is_short() ? 3 : 40, rounds = bench::is_short() ? 1 : 3;
  wm_rig rig;
  sea::make_rig(&rig, fisheye);
  const int32_t cameras[2] = {0, 1};
  const wm_view view = {&rig, cameras, nullptr, 0, nullptr, 0, nullptr, 0};
  bench::detector_at_work stereo(wm_detector_find("stereo"), view,
                                 [=](void *params) { static_cast<wm_stereo_params *>(params)->tracks = tracks; });
  const sea::floor_grain grain(1);
  wm::mounted_camera eyes[2];
  for (int i = 0; i < 2; i++) wm::mounted_camera_init(&eyes[i], rig.cameras[i]);
  std::vector<std::vector<uint8_t>> pictures(2 * static_cast<size_t>(pictures_a_round));
  for (int k = 0; k < pictures_a_round; k++) {
    sea::view_of_floor seen(grain);
    seen.map_base = sea::swim(0.125 * k);
    for (int i = 0; i < 2; i++)
      sea::render(seen, eyes[i], static_cast<uint64_t>(2 * k + i), &pictures[static_cast<size_t>(2 * k + i)]);
  }
  std::vector<double> times, first;
  size_t told = 0;
  for (int round = 0; round < rounds; round++) {
    stereo.again();
    for (int k = 0; k < pictures_a_round; k++) {
      wm_frame frames[2];
      for (int i = 0; i < 2; i++)
        frames[i] = bench::frame_of(pictures[static_cast<size_t>(2 * k + i)], 640, 480, i, INT64_C(125000000) * k);
      const double begin = bench::thread_us();
      told += stereo.look(frames);
      (k == 0 ? first : times).push_back(bench::thread_us() - begin);
    }
  }
  std::sort(times.begin(), times.end());
  std::sort(first.begin(), first.end());
  std::printf("stereo_640x480_%s_ms median %.2f, 99 of 100 %.2f, first picture %.2f (%.0f points a picture; %.1f MB)\n",
              what, times[times.size() / 2] * 1e-3, times[times.size() * 99 / 100] * 1e-3,
              first[first.size() / 2] * 1e-3, static_cast<double>(told) / static_cast<double>(times.size()),
              static_cast<double>(stereo.bytes()) * 1e-6);
}

}  // namespace

int main() {
  measure("rectified", false, 100);
  measure("rectified_200_points", false, 200);
  measure("fisheye", true, 100);
}
