// SPDX-License-Identifier: Apache-2.0
// Memory for what takes its memory from outside, aligned as an arena does it.
#pragma once

#include <cstdlib>
#include <memory>

struct freed {
  void operator()(void *memory) const { std::free(memory); }
};
using block = std::unique_ptr<void, freed>;
inline block allocate(size_t bytes) { return block(std::aligned_alloc(64, (bytes + 63) / 64 * 64)); }
