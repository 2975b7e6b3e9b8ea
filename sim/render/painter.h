// SPDX-License-Identifier: Apache-2.0
// One camera's view of a scene, made ready for the inner loop (kernel.h) frame by frame.
#pragma once

#include <memory>

#include "render/render.h"

namespace wm::render {

class Painter {
 public:
  // `workers`: how many threads call row(). Grey where that says all: under water light is coloured on its way.
  static std::unique_ptr<Painter> make(const Scene &scene, const Camera &camera, const Quality &quality, uint64_t seed,
                                       bool colour, int workers);
  virtual ~Painter() = default;

  // Where robot and movers are, and what is lit, for the rows that follow.
  virtual void begin(const Shot &shot) = 0;
  // One row into `out`, which has its size; `worker` in [0, workers).
  virtual void row(int y, int worker, Image &out) = 0;
  // After all rows: what drifts in the water.
  virtual void end(const Shot &shot, Image &out) = 0;
};

}  // namespace wm::render
