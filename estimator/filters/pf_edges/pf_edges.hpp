// SPDX-License-Identifier: Apache-2.0
// Monte Carlo localization by edges on the floor against a raster map: the particle filter of M. P. Abramov et al.,
// "Edge detection based mobile robot indoor localization", Sensornye sistemy, 2019. Propagate by odometry, weigh by the
// blurred edge layer, normalise, resample. It corrects no calibration and does not detect that it is lost; edge_mcl
// does.
#ifndef WAYMARK_ESTIMATOR_PF_EDGES_HPP
#define WAYMARK_ESTIMATOR_PF_EDGES_HPP

#include "filters/core/lifecycle.hpp"
#include "filters/core/record_list.hpp"
#include "filters/pf_edges/params.h"
#include "filters/pf_edges/particles.hpp"
#include "filters/planar/planar_filter.hpp"
#include "waymark/estimator.h"

namespace wm {

class pf_edges {
 public:
  static size_t bytes(const wm_pf_edges_params &params, const wm_setup &setup, const char **why);
  void init(const wm_pf_edges_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  void list_calibration(calibration_list *) const {}
  size_t list_counters(wm_counter *out, size_t capacity) const;
  size_t list_particles(wm_particle *out, size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return odometry_.calibration(); }
  uint32_t motion_health() const { return odometry_.motion_health(); }

 private:
  struct blocks {
    uint8_t *cloud, *map, *field;
  };
  static blocks lay_out(memory_layout *layout, const wm_pf_edges_params &params, const wm_setup &setup);
  void start_again(bool known);
  wm_status take_pose(const wm_event &event);
  wm_status take_points(const wm_event &event, record_list records);
  void propagate();
  bool weigh(const wm_points &points);
  double unexplained() const;
  void resample();
  void select_points(const wm_points &points);

  const wm_setup *setup_;
  wm_pf_edges_params params_;
  planar_filter_of<kPoseStates + 1> odometry_;  // motion alone: pose increments, twist
  particles particles_;
  edge_map map_;
  score_table table_;
  score_field field_;
  scan_points scan_;
  // Odometry at the last scan.
  wm_pose2 odom_;
  double travelled_m_, turned_rad_;
  wm_time_ns scan_ns_;
  lifecycle life_;
};

}  // namespace wm

#endif
