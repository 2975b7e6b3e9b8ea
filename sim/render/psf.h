// SPDX-License-Identifier: Apache-2.0
// The lens' point spread: a Gaussian over the finished radiance, along rows and then along columns.
#pragma once

#include "render/render.h"
#include "render/workers.h"

namespace wm::render {

// `from` is used up as working memory; the result is in `out` (same size). sigma 0: the two are swapped.
void spread(double sigma_px, Workers &workers, Image &from, Image &out);

}  // namespace wm::render
