// SPDX-License-Identifier: Apache-2.0
// Clocks and medians of the benchmarks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace bench {

// With WM_BENCH_SHORT in the environment, as the tests run a benchmark: does it work at all? Times say nothing then,
// and none is judged.
inline bool is_short() { return std::getenv("WM_BENCH_SHORT") != nullptr; }

// How often something is measured: `whole` times, or a twentieth of that.
inline int rounds(int whole) { return is_short() ? std::max(1, whole / 20) : whole; }

inline double clock_ns(clockid_t clock) {
  timespec now;
  (void)clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e9 + static_cast<double>(now.tv_nsec);
}

// Time of this thread alone, in microseconds: other work on the machine is not counted.
inline double thread_us() { return clock_ns(CLOCK_THREAD_CPUTIME_ID) * 1e-3; }

inline int64_t now_ns() {
  timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

// The upper one of two in the middle; what is given is not empty.
inline double median(std::vector<double> of) {
  const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
  std::nth_element(of.begin(), middle, of.end());
  return *middle;
}

// Median of rounds(calls) single calls, on this thread's own clock.
template <class Work>
double median_us(int calls, Work work) {
  std::vector<double> each;
  for (int i = 0; i < rounds(calls); i++) {
    const double begin = thread_us();
    work();
    each.push_back(thread_us() - begin);
  }
  return median(each);
}

}  // namespace bench
