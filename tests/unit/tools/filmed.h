// SPDX-License-Identifier: Apache-2.0
// Drives that are filmed.
#pragma once

#include "shipped.h"
#include "simulate/film.h"

namespace wm::sim {

inline Film filmed(const Scenario &scenario, uint64_t seed) {
  Film out;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, prepare(scenario, seed, out, &err), err.text);
  return out;
}

// A second, in a few small pictures, coarse: what this is about is all around them.
inline void shrink(Scenario &scenario, std::initializer_list<const char *> cameras, int width, int height) {
  scenario.duration_s = 1.05;
  scenario.pictures.samples = 1;
  for (const char *name : cameras) {
    PixelCamera camera;
    camera.name = name;
    camera.width = width;
    camera.height = height;
    scenario.pixel_cameras.push_back(camera);
  }
}

}  // namespace wm::sim
