// SPDX-License-Identifier: Apache-2.0
// Layout of a state in one block of memory: the struct, then its arrays. One function per state counts the bytes
// (without memory) and places the arrays, so size and layout cannot differ.
#ifndef WAYMARK_INTERNAL_MEMORY_LAYOUT_HPP
#define WAYMARK_INTERNAL_MEMORY_LAYOUT_HPP

#include <cstddef>
#include <cstdint>

namespace wm {

class memory_layout {
 public:
  // `state` is the block, or NULL to count only; its first `struct_bytes` hold the struct.
  memory_layout(void *state, size_t struct_bytes) : base_(static_cast<uint8_t *>(state)) {
    take<uint8_t>(struct_bytes);
  }

  // The next array, at a multiple of 64 bytes from the beginning of the block (a cache line); NULL when counting.
  template <typename item>
  item *take(size_t count) {
    uint8_t *at = base_ ? base_ + used_ : nullptr;
    used_ += (count * sizeof(item) + kLine_bytes - 1) / kLine_bytes * kLine_bytes;
    return reinterpret_cast<item *>(at);
  }

  size_t bytes() const { return used_; }

 private:
  static constexpr size_t kLine_bytes = 64;
  uint8_t *base_;
  size_t used_ = 0;
};

// A pointer into the block of memory that holds it, kept as a distance from itself: a copy of the whole block is
// complete, wherever it lies.
template <typename item>
class relative_array {
 public:
  void set(item *at) { offset_ = reinterpret_cast<char *>(at) - reinterpret_cast<char *>(this); }
  item *get() { return reinterpret_cast<item *>(reinterpret_cast<char *>(this) + offset_); }
  const item *get() const { return reinterpret_cast<const item *>(reinterpret_cast<const char *>(this) + offset_); }
  item &operator[](size_t i) { return get()[i]; }
  const item &operator[](size_t i) const { return get()[i]; }

 private:
  std::ptrdiff_t offset_;
};

}  // namespace wm

#endif
