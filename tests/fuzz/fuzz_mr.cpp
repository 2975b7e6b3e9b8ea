// SPDX-License-Identifier: Apache-2.0
// Detector `mr` on any pixels (the first bytes of the input are the picture's size), and its decoder on any modules.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "waymark/detector.h"
#include "waymark/mr_code.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size < 10) return 0;
  uint64_t modules;
  std::memcpy(&modules, data, sizeof modules);
  uint32_t id;
  int wrong;
  if (wm_mr_decode(modules, &id, &wrong) && (id >= WM_MR_IDS || wrong > WM_MR_CORRECTED)) std::abort();

  static const wm_detector *mr = wm_detector_find("mr");
  const uint32_t width = 16 + data[0] % 112, height = 16 + data[1] % 112;
  wm_rig rig;
  wm_rig_init(&rig);
  rig.camera_count = 1;
  wm_camera &c = rig.cameras[0];
  c = wm_camera{};
  c.model = data[2] % 2 ? WM_CAMERA_EQUIDISTANT : WM_CAMERA_PINHOLE_RADTAN;
  c.width_px = width;
  c.height_px = height;
  const double intrinsics[4] = {60, 60, 0.5 * width, 0.5 * height};
  std::memcpy(c.intrinsics, intrinsics, sizeof intrinsics);
  std::memcpy(rig.marker_family, "mr", 3);
  rig.marker_size_m = 0.2;
  const int32_t camera = 0;
  const wm_view view = {&rig, &camera, nullptr, 0, nullptr, 0, nullptr, 0};
  std::vector<char> params(mr->params.bytes);
  wm_params_defaults(&mr->params, params.data());
  const char *why;
  const size_t bytes = mr->state_bytes(params.data(), &view, &why);
  void *state = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
  if (!state || mr->init(state, params.data(), &view) != WM_OK) std::abort();
  std::vector<uint8_t> grey(static_cast<size_t>(width) * height);
  for (size_t i = 0; i < grey.size(); i++) grey[i] = data[3 + i % (size - 3)];
  wm_frame frame = {};
  frame.width_px = width;
  frame.height_px = height;
  frame.stride_bytes = width;
  frame.grey = grey.data();
  wm_event events[8];
  size_t count = 0;
  if (mr->detect(state, &frame, nullptr, events, 8, &count) != WM_OK || count > 8) std::abort();
  std::free(state);
  return 0;
}
