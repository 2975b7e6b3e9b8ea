// SPDX-License-Identifier: Apache-2.0
// Which signals of a DBC are which quantities: by name, unit and range, and by how they move in a log of a drive.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "init/dbc_signals.h"

namespace wm::init {

struct Dbc {
  std::filesystem::path path;
  std::unique_ptr<wm_dbc, void (*)(wm_dbc *)> file{nullptr, wm_dbc_free};
  std::vector<init_signal> signals;
};
// Throws tools::Failure with file and line.
Dbc read_dbc(const std::filesystem::path &path);
Dbc parse_dbc(const std::string &text, const std::string &name);

// A signal that may be a quantity. `score` orders those of one quantity.
struct Candidate {
  unsigned quantity = 0;  // wm_quantity, WM_CAN_LATITUDE ...
  size_t signal = 0;      // index into Dbc::signals
  double score = 0;
  double scale = 1;
  std::string unit;                  // to be written; "": the DBC's
  std::vector<std::string> reasons;  // for people
  std::string refused;               // why it is not taken; "": it may be
};

// All candidates by name, unit and range, the best of each quantity first.
std::vector<Candidate> name_candidates(const Dbc &dbc);

// What is bound: the best candidate of each quantity that is not refused.
std::vector<Candidate> choose(const std::vector<Candidate> &candidates);

// "a; b; c".
std::string joined(const std::vector<std::string> &texts);

// The words of a name in capitals: "WheelSpeed_FL2" is WHEEL, SPEED, FL, 2.
std::vector<std::string> words_of(const std::string &name);

// can-signals.yaml with a comment for each line. `log`: the log's name, "" without one.
std::string can_signals_yaml(const Dbc &dbc, const std::vector<Candidate> &all, const std::vector<Candidate> &chosen,
                             const std::string &log);

}  // namespace wm::init
