// SPDX-License-Identifier: Apache-2.0
// Where all radii vote for one azimuth: for each column of the polar picture and each sign of an edge the stretch of
// rows with the largest sum of votes. A row's vote is how much brighter the column's one side is than the other,
// limited, less what noise may be.
#ifndef WAYMARK_ESTIMATOR_VISION_VOTES_HPP
#define WAYMARK_ESTIMATOR_VISION_VOTES_HPP

#include "vision/lines/polar.hpp"

namespace wm {

inline constexpr int kVoteScale = 4;  // of votes, a grey level
inline constexpr int kVoteLimit = 5;  // of a vote, in thresholds: one strong row doesn't make a line

// The best stretch of each column, rows first .. last; 0 votes: none. Arrays of `columns`, 16-byte aligned.
struct votes {
  int16_t *sum, *first, *last;
};

// The stretch that goes on in each column: its votes, its first row, the rows since the last one that voted for it.
struct running_votes {
  int16_t *sum, *first, *against;
};

struct vote_side {
  votes best;
  running_votes now;
};

struct vote_work {
  int16_t *slope;        // columns: a row's differences
  vote_side rise, fall;  // brighter towards larger azimuths (to the left), darker
};

inline constexpr int kVoteArrays = 13;  // of `columns` numbers

// `threshold`: half of the least contrast, in 1/kVoteScale of a grey level. On vectors of eight numbers, and by its
// scalar twin, which gives the same.
void count_votes(const polar_view &view, int threshold, vote_work *work);
void count_votes_scalar(const polar_view &view, int threshold, vote_work *work);

}  // namespace wm

#endif
