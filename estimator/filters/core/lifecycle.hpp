// SPDX-License-Identifier: Apache-2.0
// The life cycle of every estimator with a pose in a map:
//
//              start known                    lose()                      relocalized()
//   SEARCHING ────────────► TRACKING ───────────────────────────► LOST ────────────────► TRACKING
//       ▲  relocalized()     │    ▲ fused()                        │ fits_again() ──────► TRACKING
//       └── begin(false)     ▼    │                                └ not found for kInflateAfter_s: inflation_due()
//                        DEAD_RECKONING (nothing fused for dead_reckoning_after_s)
//
// The filter owns the evidence (core/evidence.hpp) and the relocalizer; this class owns the state, its times, the
// counter of resets and the rates of searching and inflating.
#ifndef WAYMARK_ESTIMATOR_CORE_LIFECYCLE_HPP
#define WAYMARK_ESTIMATOR_CORE_LIFECYCLE_HPP

#include <cstdint>

#include "waymark/pose.h"
#include "waymark/time.h"

namespace wm {

class lifecycle {
 public:
  // Seconds. LOST lasts at least kAnnounce_s, so that a subscriber at 10 Hz sees it. A relocalizer runs at most every
  // kSearchEvery_s: one search costs about 0.5 ms. Lost for kInflateAfter_s, the covariance is inflated every
  // kInflateEvery_s, so that observations near the pose can pass the gate again.
  static constexpr double kAnnounce_s = 0.2, kSearchEvery_s = 0.25, kInflateAfter_s = 3.0, kInflateEvery_s = 1.0;

  // Start, reset, or a pose from outside.
  void begin(bool pose_known) {
    state_ = pose_known ? WM_STATE_TRACKING : WM_STATE_SEARCHING;
    resets_++;
  }

  void fused(wm_time_ns t_ns) { fused_ns_ = t_ns; }
  void lose(wm_time_ns t_ns) {
    state_ = WM_STATE_LOST;
    lost_ns_ = inflated_ns_ = t_ns;
  }
  void fits_again() { state_ = WM_STATE_TRACKING; }
  // The pose was corrected from outside of the update, without having been lost.
  void corrected(wm_time_ns t_ns) {
    resets_++;
    fused_ns_ = t_ns;
  }
  void relocalized(wm_time_ns t_ns) {
    corrected(t_ns);
    state_ = WM_STATE_TRACKING;
    found_ns_ = t_ns;
    relocalizations_++;
  }

  // In two steps: the published pose jumps to one that a search found; later observations confirm it.
  void jumped() { resets_++; }
  void confirmed() {
    state_ = WM_STATE_TRACKING;
    relocalizations_++;
  }

  bool searching() const { return state_ == WM_STATE_SEARCHING; }
  bool tracking() const { return state_ == WM_STATE_TRACKING; }
  bool lost() const { return state_ == WM_STATE_LOST; }
  bool announced(wm_time_ns t_ns) const { return wm_seconds_between(lost_ns_, t_ns) >= kAnnounce_s; }
  // At most one search each kSearchEvery_s; call searched() when one runs.
  bool search_due(wm_time_ns t_ns) const {
    return searched_ns_ == WM_TIME_NONE || wm_seconds_between(searched_ns_, t_ns) >= kSearchEvery_s;
  }
  void searched(wm_time_ns t_ns) { searched_ns_ = t_ns; }
  bool inflation_due(wm_time_ns t_ns) const {
    return lost() && wm_seconds_between(lost_ns_, t_ns) >= kInflateAfter_s &&
           wm_seconds_between(inflated_ns_, t_ns) >= kInflateEvery_s;
  }
  void inflated(wm_time_ns t_ns) { inflated_ns_ = t_ns; }

  // As published: tracking without a fused observation for so long is dead reckoning.
  uint8_t state(wm_time_ns now_ns, double dead_reckoning_after_s) const {
    const bool fresh = fused_ns_ != WM_TIME_NONE && wm_seconds_between(fused_ns_, now_ns) <= dead_reckoning_after_s;
    return tracking() && !fresh ? static_cast<uint8_t>(WM_STATE_DEAD_RECKONING) : static_cast<uint8_t>(state_);
  }
  wm_time_ns fused_ns() const { return fused_ns_; }  // WM_TIME_NONE: never
  wm_time_ns lost_ns() const { return lost_ns_; }
  wm_time_ns found_ns() const { return found_ns_; }
  uint32_t resets() const { return resets_; }
  uint32_t relocalizations() const { return relocalizations_; }  // poses that a search found

 private:
  // No padding: the same events must give the same bytes.
  uint64_t state_ = WM_STATE_SEARCHING;
  uint32_t resets_ = 0, relocalizations_ = 0;
  wm_time_ns fused_ns_ = WM_TIME_NONE, lost_ns_ = WM_TIME_NONE, found_ns_ = WM_TIME_NONE;
  wm_time_ns searched_ns_ = WM_TIME_NONE, inflated_ns_ = WM_TIME_NONE;
};

}  // namespace wm

#endif
