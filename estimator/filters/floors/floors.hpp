// SPDX-License-Identifier: Apache-2.0
// An estimator over floors (waymark/carrier.h): a state of one estimator for each floor, of which those run that may be
// the robot's. docs/building.md has the model.
#ifndef WAYMARK_ESTIMATOR_FLOORS_FLOORS_HPP
#define WAYMARK_ESTIMATOR_FLOORS_FLOORS_HPP

#include "filters/floors/floor_belief.hpp"
#include "waymark/carrier.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

class floors {
 public:
  static size_t bytes(const void *params, const wm_setup &setup, const char **why);
  wm_status init(const void *params, const wm_setup &setup);
  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, wm_innovation *out, size_t capacity, size_t *count);
  void estimate(wm_estimate *out) const;
  int here() const { return static_cast<int>(here_); }
  double probability() const { return belief_.probability(here()); }
  const wm_estimator &inner() const { return *plan_->estimator; }
  const void *state() const { return state_[here_].get(); }  // of the most probable floor

 private:
  // The floors to which a robot may change where it is now.
  struct ways {
    uint64_t floors;  // bits; with the present one. 0: none
    double rate_per_s;
  };
  int count() const { return static_cast<int>(plan_->count); }
  void *state(int floor) { return state_[floor].get(); }
  void carry(int to, const wm_pose2 *by);
  void carry_along(int to, const wm_estimate &e);
  wm_status set_floor(const wm_event &event);
  wm_status take_pose(const wm_event &event);
  void look_around(wm_time_ns t_ns);
  ways ways_from(const wm_estimate &e, bool rides) const;
  void open_ways(const ways &from, const wm_estimate &e, wm_time_ns t_ns);
  void open_where_known(const wm_event &event, int32_t id);
  void weigh(const wm_event &event);
  void choose();

  const wm_floor_plan *plan_;
  const wm_carrier *carrier_;
  relative_array<uint8_t> state_[WM_FLOORS_MAX];
  floor_belief belief_;
  int64_t here_;  // 64 bits: no padding
  wm_time_ns looked_ns_, lost_ns_, stood_ns_, refreshed_ns_;
};

}  // namespace wm

#endif
