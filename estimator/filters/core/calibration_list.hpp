// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_CALIBRATION_LIST_HPP
#define WAYMARK_ESTIMATOR_CALIBRATION_LIST_HPP

#include <cstring>

#include "waymark/pose.h"

namespace wm {

// Calibration values with their sigmas, in the caller's memory: counted beyond its end, written up to it.
class calibration_list {
 public:
  calibration_list(wm_calibration_value *out, size_t capacity) : out_(out), capacity_(capacity) {}

  void add(const char *name, double value, double sigma) {
    if (count_ < capacity_) put(nullptr, name, value, sigma);
    count_++;
  }
  // "owner.name"; an owner that is too long is cut.
  void add(const char *owner, const char *name, double value, double sigma) {
    if (count_ < capacity_) put(owner, name, value, sigma);
    count_++;
  }
  size_t count() const { return count_; }

 private:
  void put(const char *owner, const char *name, double value, double sigma) {
    wm_calibration_value &v = out_[count_];
    std::memset(&v, 0, sizeof v);
    char *end = v.name;
    if (owner) {
      const char *const cut = v.name + sizeof v.name - 2 - std::strlen(name);
      while (*owner && end < cut) *end++ = *owner++;
      *end++ = '.';
    }
    while (*name) *end++ = *name++;
    v.value = value;
    v.sigma = sigma;
  }

  wm_calibration_value *out_;
  size_t capacity_, count_ = 0;
};

}  // namespace wm

#endif
