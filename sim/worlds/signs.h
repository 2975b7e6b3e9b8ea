// SPDX-License-Identifier: Apache-2.0
// Pictures of what hangs in streets. Each number gives another one.
#pragma once

#include "render/texture.h"

namespace wm::sim {

images::Picture house_number(uint64_t seed, int number);
// `aspect`: width by height.
images::Picture shop_board(uint64_t seed, double aspect);
// A square board with a ring, a bar, a triangle or an arrow in strong colours.
images::Picture street_sign(uint64_t seed);

}  // namespace wm::sim
