// SPDX-License-Identifier: Apache-2.0
// A square matrix as numpy's .npy, version 1.0: numpy.load reads it.
#pragma once

#include <cstring>
#include <string>

#include "common/text.h"

namespace wm::tools {

template <typename Element>
std::string npy_of(size_t size, const Element &element) {
  constexpr size_t kAlign = 64;  // of the numbers, as the format demands
  std::string head = text("{'descr': '<f8', 'fortran_order': False, 'shape': (%zu, %zu), }", size, size);
  head += std::string(kAlign - (10 + head.size() + 1) % kAlign, ' ') + "\n";
  std::string out("\x93NUMPY\x01\x00", 8);
  out += static_cast<char>(head.size() & 0xff);
  out += static_cast<char>(head.size() >> 8);
  out += head;
  out.reserve(out.size() + size * size * sizeof(double));
  for (size_t i = 0; i < size; i++)
    for (size_t j = 0; j < size; j++) {
      const double value = element(i, j);
      char bytes[sizeof value];
      std::memcpy(bytes, &value, sizeof value);
      out.append(bytes, sizeof bytes);
    }
  return out;
}

}  // namespace wm::tools
