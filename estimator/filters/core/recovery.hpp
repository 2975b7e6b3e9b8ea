// SPDX-License-Identifier: Apache-2.0
// What every filter with a pose does once it is lost, beside its own search.
#ifndef WAYMARK_ESTIMATOR_CORE_RECOVERY_HPP
#define WAYMARK_ESTIMATOR_CORE_RECOVERY_HPP

#include "filters/core/landmark_evidence.hpp"
#include "filters/core/lifecycle.hpp"
#include "math/elementary.hpp"

namespace wm {

// Log odds that a stated or a found pose is wrong: one in twelve. Chosen on drawn crossings with wrong starts
// (waymark-montecarlo --trials); not swept.
inline constexpr double kStartWrong = -2.5, kFoundWrong = -2.5;
// Sigmas added at each inflation while lost, on each axis: a second of unmeasured driving. Up to kInflateUpTo_m, beyond
// which an update is far from linear. Not swept.
inline constexpr double kInflate_m = 0.5, kInflate_rad = 0.2, kInflateUpTo_m = 30.0;

// Lost and not found for a while, the covariance is inflated. State 0 of the filter is a coordinate of the pose.
template <class Filter>
void inflate_lost_pose(lifecycle *life, Filter *filter, wm_time_ns t_ns) {
  if (!life->inflation_due(t_ns) || !(filter->variance(0) < square(kInflateUpTo_m))) return;
  filter->inflate_pose(square(kInflate_m), square(kInflate_rad));
  life->inflated(t_ns);
}

// The observations fit again; or search(since_ns) looks for the pose, by the observations of the last `window_s` and of
// the present doubt; or the covariance is inflated in the end.
template <class Filter, class Search>
void recover_pose(lifecycle *life, const landmark_evidence &evidence, Filter *filter, wm_time_ns t_ns, double window_s,
                  Search search) {
  if (evidence.fits()) return life->fits_again();
  if (!life->announced(t_ns)) return;
  const wm_time_ns window = t_ns - wm_ns_from_seconds(window_s), doubted = evidence.doubted_since_ns();
  search(doubted > window ? doubted : window);
  inflate_lost_pose(life, filter, t_ns);
}

}  // namespace wm

#endif
