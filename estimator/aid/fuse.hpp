// SPDX-License-Identifier: Apache-2.0
// From the rows of an observation to its gate, its update and its records: the same way for every aid of a planar
// filter.
#ifndef WAYMARK_ESTIMATOR_AID_FUSE_HPP
#define WAYMARK_ESTIMATOR_AID_FUSE_HPP

#include "aid/residual.hpp"
#include "filters/core/gate.hpp"
#include "filters/planar/planar_filter.hpp"

namespace wm {

// What the filter holds of its pose and of the observation's source.
struct fuse_policy {
  gate_limits gates;
  bool usable = true;     // false: the source is known to be wrong
  bool unproven = false;  // the pose's covariance may be too small: the gate is at 99 %, not to falsify the calibration
  bool doubtful = false;  // several observations misfit: beyond the soft gate the pose alone is corrected
  bool widens = false;    // and its covariance grows
  bool holds = false;     // the pose alone is corrected, below the soft gate, too
  bool learns = false;    // the noise adapts to the observation
  int held_to = kPoseStates;  // the states from the pose's on up to this one are considered in doubt [Schmidt1966]
};

struct fuse_result {
  wm_verdict verdict;
  double log_bayes;  // log Bayes factor of "anywhere in the clutter's volume" against "as expected"
  bool widened;
};

// The rows of one observation are gated and fused together: if one is wrong, so are the others. Between the two gates
// the noise is inflated.
fuse_result fuse(planar_filter *filter, residual *rows, int count, double clutter_volume, const fuse_policy &policy,
                 record_list records);

// A row with a gate of its own that says nothing of the pose. It is fused after the rows of the same observation, which
// move the filter.
class later_row {
 public:
  // Made before the others are fused.
  later_row(const planar_filter &filter, residual *row);
  // `others_fused`: else it is not.
  wm_verdict fuse(planar_filter *filter, const fuse_policy &policy, bool others_fused, record_list records);

 private:
  residual *row_;
  double before_[planar_row::kMax];  // its states
};

}  // namespace wm

#endif
