// SPDX-License-Identifier: Apache-2.0
// The inner loop for any machine, and the choice between the two.
#include "render/kernel.h"
#include "render/lanes.h"

namespace wm::render {
namespace plain {
#include "render/kernel_body.h"

const Kernel kKernel = {[](const Frame<1> &frame, const Row<1> &row) { render_row(frame, row); },
                        [](const Frame<3> &frame, const Row<3> &row) { render_row(frame, row); }};
}  // namespace plain

#ifdef WM_KERNEL_AVX2
namespace avx2 {
extern const Kernel kKernel;  // kernel_avx2.cpp
}

const Kernel &kernel(bool plain) { return !plain && __builtin_cpu_supports("avx2") ? avx2::kKernel : plain::kKernel; }
#else
const Kernel &kernel(bool) { return plain::kKernel; }
#endif

}  // namespace wm::render
