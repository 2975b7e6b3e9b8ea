// SPDX-License-Identifier: Apache-2.0
// A detector under test: its parameters by key, its state, what it finds in pictures.
#pragma once

#include <memory>
#include <vector>

#include "common/suite.h"
#include "waymark/detector.h"
#include "waymark/own_program.h"

namespace wm::drawn {

inline wm_frame frame_of(const std::vector<uint8_t> &grey, uint32_t width_px, uint32_t height_px, wm_time_ns t_ns,
                         int32_t camera = 0) {
  return {t_ns, t_ns, 0, 0, camera, width_px, height_px, width_px, grey.data()};
}

struct eyes {
  const wm_detector *detector;
  std::vector<char> params;
  std::unique_ptr<void, void (*)(void *)> state{nullptr, std::free};
  std::vector<wm_event> events{256};  // of the newest look

  explicit eyes(const wm_detector *of) : detector(of), params(of->params.bytes) {
    wm_params_defaults(&of->params, params.data());
  }
  explicit eyes(const char *name) : eyes(wm_detector_find(name)) {}

  template <class P>
  P &as() {
    return *reinterpret_cast<P *>(params.data());
  }
  void set(const char *key, double value) {
    TEST_ASSERT_NULL_MESSAGE(wm_params_set(&detector->params, params.data(), key, value), key);
  }
  // In memory that is not clean: nothing may depend on it.
  void begin(const wm_view &view) {
    const char *why = "";
    const size_t bytes = detector->state_bytes(params.data(), &view, &why);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
    state.reset(std::aligned_alloc(64, (bytes + 63) / 64 * 64));
    std::memset(state.get(), 0xA5, bytes);
    TEST_ASSERT_EQUAL(WM_OK, detector->init(state.get(), params.data(), &view));
  }
  void expect_refused(const wm_view &view, const char *text) const {
    const char *why = nullptr;
    TEST_ASSERT_EQUAL(0, detector->state_bytes(params.data(), &view, &why));
    TEST_ASSERT_NOT_NULL(why);
    TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(why, text), why);
  }
  size_t look(const wm_frame *frames, const wm_estimate *prediction = nullptr) {
    size_t count = 99;
    TEST_ASSERT_EQUAL(WM_OK, detector->detect(state.get(), frames, prediction, events.data(), events.size(), &count));
    return count;
  }
};

// One with a single camera that looks for prints of a family and size.
struct marker_eyes : eyes {
  wm_rig rig;
  int32_t camera = 0;
  wm_view view{&rig, &camera, nullptr, 0, nullptr, 0, nullptr, 0};

  marker_eyes(const wm_detector *of, const wm_camera &c, const char *family, double size_m) : eyes(of) {
    wm_rig_init(&rig);
    rig.camera_count = 1;
    rig.cameras[0] = c;
    std::strcpy(rig.marker_family, family);
    rig.marker_size_m = size_m;
    begin(view);
  }
  marker_eyes(const marker_eyes &) = delete;
  marker_eyes &operator=(const marker_eyes &) = delete;
  size_t look(const std::vector<uint8_t> &grey, wm_time_ns t_ns = 0) {
    const wm_frame frame = frame_of(grey, rig.cameras[0].width_px, rig.cameras[0].height_px, t_ns);
    return eyes::look(&frame);
  }
};

}  // namespace wm::drawn
