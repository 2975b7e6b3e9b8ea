// SPDX-License-Identifier: Apache-2.0
// Detectors of coded markers on any pixels (the first bytes of the input are the picture's size and the family), and
// the decoder of MR codes on any modules.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "waymark/detectors.h"
#include "waymark/mr_code.h"

namespace {

const wm_detector *apriltag() {
  size_t count;
  const wm_detector *const *library = wm_library_detectors(&count);
  for (size_t i = 0; i < count; i++)
    if (std::strcmp(library[i]->name, "apriltag") == 0) return library[i];
  std::abort();
}

void look(const wm_detector *detector, const wm_rig &rig, const std::vector<uint8_t> &grey) {
  const int32_t camera = 0;
  const wm_view view = {&rig, &camera, nullptr, 0, nullptr, 0, nullptr, 0};
  std::vector<char> params(detector->params.bytes);
  wm_params_defaults(&detector->params, params.data());
  const char *why;
  const size_t bytes = detector->state_bytes(params.data(), &view, &why);
  void *state = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
  if (!state || detector->init(state, params.data(), &view) != WM_OK) std::abort();
  wm_frame frame = {};
  frame.width_px = rig.cameras[0].width_px;
  frame.height_px = rig.cameras[0].height_px;
  frame.stride_bytes = frame.width_px;
  frame.grey = grey.data();
  wm_event events[8];
  size_t count = 0;
  if (detector->detect(state, &frame, nullptr, events, 8, &count) != WM_OK || count > 8) std::abort();
  std::free(state);
}

// The input, repeated over the picture.
std::vector<uint8_t> pixels(const uint8_t *data, size_t size, size_t count) {
  std::vector<uint8_t> grey(count);
  for (size_t i = 0; i < count; i++) grey[i] = data[i % size];
  return grey;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size < 10) return 0;
  uint64_t modules;
  std::memcpy(&modules, data, sizeof modules);
  uint32_t id;
  int wrong;
  if (wm_mr_decode(modules, &id, &wrong) && (id >= WM_MR_IDS || wrong > WM_MR_CORRECTED)) std::abort();

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
  rig.marker_size_m = 0.2;
  const std::vector<uint8_t> grey = pixels(data + 3, size - 3, static_cast<size_t>(width) * height);
  std::memcpy(rig.marker_family, "mr", 3);
  look(wm_detector_find("mr"), rig, grey);
  // Two families with small tables of codes: one with a black ring, one with a white ring and modules beyond it.
  std::strcpy(rig.marker_family, data[2] & 2 ? "aruco_4x4_50" : "tagCircle21h7");
  look(apriltag(), rig, grey);
  return 0;
}
