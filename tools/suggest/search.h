// SPDX-License-Identifier: Apache-2.0
// Which changes of parameters make the observations of a drive more likely, also in parts of it that the search did not
// see.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "suggest/drive.h"
#include "suggest/parameters.h"

namespace wm::suggest {

// Of a mean, with its standard error over the blocks.
struct Figure {
  double value = 0, sigma = 0;
};

// Gain of mean log likelihood, nats an update; over the given splits.
struct Gain {
  Figure both;           // mean of the channels
  Figure of[kChannels];  // each
  bool has_gap = false;  // updates after gaps were counted
};
using Splits = std::array<bool, kSplits>;
Gain gain_of(const Score &before, const Score &after, const Splits &splits);

// Root mean square of the innovations (SI), share refused and mean NIS of a source's residual, over the given splits.
struct Residual {
  uint16_t source;
  uint8_t residual;
  double count, rms, refused, nis;
};
std::vector<Residual> residuals_of(const Score &score, Channel channel, const Splits &splits);

struct Change {
  size_t parameter;
  double value;
  Gain gain;  // of it alone, with all others; on the promise's blocks
};

struct Suggestion {
  std::vector<double> values;
  std::vector<Change> changes;  // none: nothing to gain
  Score before, after;
  Gain promise;           // on blocks that neither search nor choice has seen
  std::string withdrawn;  // why a change that the search found is not suggested; "": none was
  double share = 1;       // of the way to the largest likelihood, as far as the poses stay consistent
  double halves_before = 0, halves_after = 0;  // mean normalised difference squared, three degrees of freedom
  size_t drives = 0;
  bool is_cut = false;  // the time was over before the search had ended
};

struct SearchOptions {
  double minutes = 10;
  std::function<void(double done, const std::string &what)> progress;  // may be empty
};

// Throws tools::Failure where the estimator can't work with the drive.
Suggestion search(const Drive &drive, const std::vector<Parameter> &parameters, const SearchOptions &options);

// Scores of sets of values, each in a process of its own.
std::vector<Score> scores_of(const Drive &drive, const std::vector<Parameter> &parameters,
                             const std::vector<std::vector<double>> &sets, bool with_halves,
                             const std::function<void()> &done);

}  // namespace wm::suggest
