// SPDX-License-Identifier: Apache-2.0
// The inner loop with AVX2's instructions (compiled with -mavx2, without fused multiply-add). It must not instantiate
// anything that another translation unit could be linked to: hence no header with code but lanes.h.
#include "render/kernel.h"
#include "render/lanes.h"

namespace wm::render::avx2 {
#include "render/kernel_body.h"

extern const Kernel kKernel;
const Kernel kKernel = {[](const Frame<1> &frame, const Row<1> &row) { render_row(frame, row); },
                        [](const Frame<3> &frame, const Row<3> &row) { render_row(frame, row); }};

}  // namespace wm::render::avx2
