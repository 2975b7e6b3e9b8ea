// SPDX-License-Identifier: Apache-2.0
// Pictures of what hangs in streets. Each number gives another one.
#pragma once

#include "simulate/render/texture.h"

namespace wm::sim {

render::Picture house_number(uint64_t seed, int number);
// `aspect`: width by height.
render::Picture shop_board(uint64_t seed, double aspect);
// A square board with a ring, a bar, a triangle or an arrow in strong colours.
render::Picture street_sign(uint64_t seed);

}  // namespace wm::sim
