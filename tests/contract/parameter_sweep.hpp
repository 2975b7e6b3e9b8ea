// SPDX-License-Identifier: Apache-2.0
// Moves one parameter of a table at a time and looks for a stage on which the output changes. A stage is a small
// scenario with the settings that make the parameter matter; its run is deterministic.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "waymark/params.h"

namespace parameters {

struct setting {
  const char *key;
  double value;
};

// A table's struct, aligned for any field.
class values {
 public:
  // Defaults, then those settings whose keys the table has.
  values(const wm_param_table &table, const std::vector<setting> &settings);
  double get(const wm_param &param) const;
  void set(const wm_param &param, double value);
  const void *data() const { return memory_.data(); }

 private:
  std::vector<double> memory_;
};

// What a run gives out, as one number a step. Recorded once; a later run is compared with it and may stop at the first
// difference.
class trace {
 public:
  explicit trace(const trace *recorded = nullptr) : recorded_(recorded) {}
  // Adds to the step's output.
  void add(double number);
  void add(const double *numbers, size_t count) {
    for (size_t i = 0; i < count; i++) add(numbers[i]);
  }
  // Ends the step; false: it differs from the recorded one.
  bool step();
  bool differs() const { return differs_; }

 private:
  const trace *recorded_;
  std::vector<uint64_t> steps_;
  uint64_t hash_ = UINT64_C(14695981039346656037);
  bool differs_ = false;
};

struct stage {
  std::string name;
  std::vector<setting> settings;
  std::vector<const char *> first_for;  // beginnings of keys that this stage is tried first for: it is made for them
  // False: the parameters were refused with a reason. Stops early when trace::step() says so.
  std::function<bool(const values &, trace *)> run;
};

// A table, the stages on which its parameters are moved, and which of them must have an effect; the others must have
// none. Without `reads`: all.
struct owner {
  const char *name;
  wm_param_table table;
  std::vector<stage> stages;
  std::function<bool(const wm_param &)> reads = nullptr;
};

// Moves every parameter of a table on its stages. Returns a text for each that is wrong, and prints them.
std::vector<std::string> sweep(const owner &of);

// A test of each table, or of the named one: each parameter has an effect. The program's exit code.
int test_all(const std::vector<owner> &owners, const char *only);

}  // namespace parameters
