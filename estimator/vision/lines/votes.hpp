// SPDX-License-Identifier: Apache-2.0
// Votes for upright lines: for each column of the polar picture and each sign of an edge, the run of rows with the
// largest sum of votes. A row's vote is its brightness difference over the column, limited, minus a noise threshold.
#ifndef WAYMARK_ESTIMATOR_VISION_VOTES_HPP
#define WAYMARK_ESTIMATOR_VISION_VOTES_HPP

#include "vision/lines/polar.hpp"

namespace wm {

inline constexpr int kVoteScale = 4;  // units of a vote per grey level
inline constexpr int kVoteLimit = 5;  // largest vote, in thresholds: one strong row is no line. Not swept

// The best run of each column, rows first .. last; sum 0: none. Arrays of `columns`, 16-byte aligned.
struct votes {
  int16_t *sum, *first, *last;
};

// The current run of each column: its votes, its first row, the rows since the last vote for it.
struct running_votes {
  int16_t *sum, *first, *against;
};

struct vote_side {
  votes best;
  running_votes now;
};

struct vote_work {
  int16_t *slope;        // `columns` differences of a row
  vote_side rise, fall;  // brighter towards larger azimuths (to the left); darker
};

inline constexpr int kVoteArrays = 13;  // arrays of `columns` numbers in vote_work

// `threshold`: half of the least contrast, in 1/kVoteScale of a grey level. In vectors of eight numbers; the scalar
// twin gives the same bits.
void count_votes(const polar_view &view, int threshold, vote_work *work);
void count_votes_scalar(const polar_view &view, int threshold, vote_work *work);

}  // namespace wm

#endif
