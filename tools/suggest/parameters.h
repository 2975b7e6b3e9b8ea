// SPDX-License-Identifier: Apache-2.0
// The parameters of a configuration that a suggestion may change.
#pragma once

#include <string>
#include <vector>

#include "config/config.h"

namespace wm::suggest {

struct Parameter {
  std::string section, key;  // "motion", "noise.speed_mps"
  double *value = nullptr;   // in the configuration
  double now = 0, initial = 0, min = 0, max = 0;
  double begin = 0;          // size to begin with where the value is 0, or chosen by the program; 0: the default's
  bool is_state = false;     // start sigma of a state that may be off (0)
  bool is_multiple = false;  // below 0: a multiple of something, whose size is searched

  [[nodiscard]] std::string name() const { return section + "." + key; }
  // The values to be tried from this one: larger and smaller by a factor, off, on.
  [[nodiscard]] std::vector<double> trials(double from, double factor) const;
  // The value at this share of the way from `now` to another one, by logarithms; a state is off as long as it is
  // nearer.
  [[nodiscard]] double between(double to, double share) const;
};

// Those that the configuration's estimator reads. They point into the configuration.
std::vector<Parameter> parameters_of(wm_config &config);

}  // namespace wm::suggest
