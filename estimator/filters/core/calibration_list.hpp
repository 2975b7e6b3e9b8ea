// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_CALIBRATION_LIST_HPP
#define WAYMARK_ESTIMATOR_CALIBRATION_LIST_HPP

#include <cmath>
#include <cstring>

#include "filters/core/length_test.hpp"
#include "waymark/pose.h"

namespace wm {

// Calibration values with their sigmas, or the alarms about them, in the caller's memory: counted beyond its end,
// written up to it.
class calibration_list {
 public:
  calibration_list(wm_calibration_value *out, size_t capacity) : out_(out), capacity_(capacity) {}
  calibration_list(wm_alarm *alarms, size_t capacity) : alarms_(alarms), alarm_capacity_(capacity) {}

  void add(const char *name, double value, double sigma) {
    if (count_ < capacity_) put(nullptr, name, value, sigma);
    count_++;
  }
  // "owner.name"; an owner that is too long is cut.
  void add(const char *owner, const char *name, double value, double sigma) {
    if (count_ < capacity_) put(owner, name, value, sigma);
    count_++;
  }
  // About the value added last.
  void alarm(wm_alarm_kind kind, double value) { put_alarm(kind, static_cast<int32_t>(count_) - 1, value); }
  void add_length(double square) { length_squares_ += square; }

  size_t count() const { return count_; }
  // Behind the last value.
  size_t finish_alarms() {
    if (lengths_contradict(length_squares_)) put_alarm(WM_ALARM_LENGTHS, -1, std::sqrt(length_squares_));
    return alarm_count_;
  }

 private:
  void put_alarm(wm_alarm_kind kind, int32_t calibration, double value) {
    if (alarm_count_ < alarm_capacity_) alarms_[alarm_count_] = {static_cast<uint32_t>(kind), calibration, value};
    alarm_count_++;
  }

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

  wm_calibration_value *out_ = nullptr;
  size_t capacity_ = 0, count_ = 0;
  wm_alarm *alarms_ = nullptr;
  size_t alarm_capacity_ = 0, alarm_count_ = 0;
  double length_squares_ = 0.0;
};

}  // namespace wm

#endif
