// SPDX-License-Identifier: Apache-2.0
// Is a probability right? Of all times at which the filter's lost_probability was p, the share in which it was.
#pragma once

#include <array>
#include <string>

#include "montecarlo/trial.h"

namespace wm::montecarlo {

class Reliability {
 public:
  // Lost: off by more than 0.5 m or 15 degrees.
  void take(const Outcome &outcome);
  void print() const;
  // A diagram as SVG. Throws tools::Failure where it can't be written.
  void draw(const std::string &file) const;
  // Mean square of probability less what was (Brier's score); 0.25 is what "don't know" gets.
  [[nodiscard]] double brier() const { return count_ > 0 ? squares_ / count_ : 0; }

 private:
  static constexpr int kBins = 10;
  struct Bin {
    double count = 0, stated = 0, was = 0;
  };
  std::array<Bin, kBins> bins_;
  double squares_ = 0, count_ = 0;
};

}  // namespace wm::montecarlo
