// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/landmark_ekf.hpp"

#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/core/lasting_error.hpp"
#include "filters/core/recovery.hpp"
#include "filters/planar/arm.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"

namespace wm {
namespace {

// Probability of a wrong start below which the filter's covariance is published alone. Not swept.
constexpr double kDoubtedStart = 0.1;

const char *const kReads[] = {"!markers.stamp", "!markers.correlated", "motion.", "sightings.", "positions.",
                              "markers.",       "localizer.",          nullptr};

int count_states(const wm_setup &setup) {
  return kPoseStates + planar_filter::count_motion_states(setup.motion->states, setup.motion->model) +
         sighting_aid::count_states(setup) + position_aid::count_states(setup) + localizer_aid::count_states(setup);
}

// Without motion data the velocity is one of the map's axes, and positions and ranges have no heading either.
bool is_point(const wm_setup &setup) {
  if (setup.motion->model != WM_MOTION_CONSTANT_VELOCITY) return false;
  for (size_t i = 0; i < setup.sensor_count; i++)
    if (!sensor_slots::gives_ranges_alone(setup.sensors[i])) return false;
  return true;
}

}  // namespace

landmark_box::landmark_box(const wm_setup &setup) {
  for (size_t i = 0; i < setup.landmark_count; i++) widen_to(setup.landmarks[i].p_m);
}

void landmark_box::widen_to(const double place_m[2]) {
  for (int k = 0; k < 2; k++) {
    if (place_m[k] < low_m_[k]) low_m_[k] = place_m[k];
    if (place_m[k] > high_m_[k]) high_m_[k] = place_m[k];
  }
}

double landmark_box::anywhere_m2(const wm_pose2 &pose) const {
  constexpr double kAround_m = 5.0;  // sigma of a lost robot's distance from the landmarks; not swept
  const double place_m[2] = {pose.x_m, pose.y_m};
  landmark_box with = *this;
  with.widen_to(place_m);
  return square(kAround_m) +
         (square(with.high_m_[0] - with.low_m_[0]) + square(with.high_m_[1] - with.low_m_[1])) / 12.0;
}

landmark_ekf::arrays landmark_ekf::place(memory_layout *layout, const wm_setup &setup) {
  return {layout->take<double>(planar_filter::doubles(count_states(setup))),
          layout->take<landmark_record>(setup.landmark_count), sighting_aid::place(layout, setup)};
}

size_t landmark_ekf::bytes(const wm_landmark_ekf_params &, const wm_setup &setup, const char **why) {
  if (setup.sensor_count > kMaxSensors) {
    *why = "landmark_ekf takes at most 16 sensors";
    return 0;
  }
  memory_layout layout(nullptr, sizeof(landmark_ekf));
  place(&layout, setup);
  return layout.bytes();
}

void landmark_ekf::init(const wm_landmark_ekf_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  memory_layout layout(this, sizeof *this);
  const arrays behind = place(&layout, setup);
  filter_.init(setup, setup.motion->states, count_states(setup), behind.filter);
  if (setup.motion->model != WM_MOTION_CONSTANT_VELOCITY) filter_.noise().init(setup.motion->noise_adapt_log_sigma);
  const auto add = [this](double value, double sigma) { return sigma > 0.0 ? filter_.add_state(value, sigma) : -1; };
  is_point_ = is_point(setup);
  aid_.init(setup, behind.aid, is_point_);
  aid_.add_calibration(&filter_);
  positions_.init(setup, &filter_, add, is_point_);
  filter_.set_correlated_position(positions_.error_state());
  calibration_states_ = filter_.states();
  localizer_.init(setup, &filter_, add);
  aid_.add_lent(&filter_);
  records_.set(behind.records);
  std::memset(behind.records, 0, setup.landmark_count * sizeof(landmark_record));
  box_ = landmark_box(setup);
  moved_id_ = -1;
  rollback_.begin(filter_, kPoseStates, calibration_states_);
  start_tested_ns_ = inflated_ns_ = vague_ns_ = WM_TIME_NONE;
  life_ = {};
  start_again();
}

// A pose that was stated, or none: earlier observations no longer count.
void landmark_ekf::begin_life(bool pose_known) {
  life_.begin(pose_known);
  evidence_.begin(kStartWrong);
  observations_.clear();
  prior_count_ = 0;
  vague_ns_ = WM_TIME_NONE;
  start_.close();
  if (pose_known) begin_start_test();
}

// Known start: track from it. Unknown: the known part of it becomes an observation for the search.
void landmark_ekf::start_again() {
  const wm_start &start = setup_->start;
  if (place_is_known(start) && !finite(start.heading_rad) && is_point_) {
    const double xy = square(given_or_default(start.sigma_xy_m));
    return begin_at({start.p_m[0], start.p_m[1], 0.0}, xy);
  }
  begin_life(start_is_known(start));
  if (life_.tracking()) return;
  observation seen = observation_now(filter_, -1);
  const bool place = finite(start.p_m[0]) && finite(start.p_m[1]), heading = finite(start.heading_rad);
  const double sigma_xy = given_or_default(start.sigma_xy_m);
  const double sigma_heading = given_or_default(start.sigma_heading_rad);
  if (place) {
    seen.kind = kObservedPosition;
    seen.place_m[0] = start.p_m[0];
    seen.place_m[1] = start.p_m[1];
    seen.sigma_length_m = sigma_xy;
    prior_[prior_count_++] = seen;
  }
  if (heading) {
    seen.kind = kObservedHeading;
    seen.bearing_rad = start.heading_rad;
    seen.sigma_angle_rad = sigma_heading;
    prior_[prior_count_++] = seen;
  }
  const double xy = square(place ? sigma_xy : kUnknownPosition_m);
  const double covariance[3][3] = {
      {xy, 0, 0}, {0, xy, 0}, {0, 0, square(heading ? sigma_heading : kUnknownHeading_rad)}};
  filter_.set_pose(filter_.pose(), covariance);
}

// A place with any heading, where none is needed.
void landmark_ekf::begin_at(const wm_pose2 &pose, double variance_m2) {
  const double covariance[3][3] = {{variance_m2, 0, 0}, {0, variance_m2, 0}, {0, 0, kAnyHeading_rad2}};
  filter_.set_pose(pose, covariance);
  begin_life(true);
  start_.close();  // another heading is no other start
}

// Another localizer's pose is a whole one.
void landmark_ekf::begin_at(const localizer_aid::view &at) {
  const double xy = localizer_.variance(0, at);
  const double covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, localizer_.variance(2, at)}};
  filter_.set_pose(at.there, covariance);
  begin_life(true);
}

// From another floor's filter. Its landmarks are not here: what of them was buffered, or is a state, stays behind.
void landmark_ekf::carry(const landmark_ekf &from, const wm_pose2 *by) {
  const wm_setup *setup = setup_;
  filter_.take_up(from.filter_, calibration_states_ + localizer_aid::count_states(*setup));
  aid_.take_up(from.aid_, &filter_);
  positions_ = from.positions_;
  localizer_ = from.localizer_;
  localizer_.release();
  rollback_ = from.rollback_;
  life_ = from.life_;
  first_ = from.first_;
  inflated_ns_ = from.inflated_ns_;
  start_tested_ns_ = vague_ns_ = WM_TIME_NONE;
  misfit_ = 0.0;
  for (int i = 0; i < 2; i++) at_m_[i] = from.at_m_[i];
  if (by) {
    filter_.change_axes(*by);
    observations_.clear();
    prior_count_ = 0;
    start_.close();
    evidence_.begin(from.evidence_.log_odds());
    return;
  }
  const double xy = square(kUnknownPosition_m);
  const double covariance[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, square(kUnknownHeading_rad)}};
  filter_.set_pose(filter_.pose(), covariance);
  begin_life(false);
}

wm_status landmark_ekf::predict(const wm_event &motion) {
  const wm_status status = filter_.check_motion(motion);
  if (status != WM_OK) return status;
  if (filter_.move(motion)) aid_.slots().begin_lag(*setup_, &filter_);
  return status;
}

wm_status landmark_ekf::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_SIGHTING:
    case WM_EVENT_MARKER: return fuse_landmark(event, records);
    case WM_EVENT_POSITION: return fuse_position(event, records);
    case WM_EVENT_HEADING: return fuse_heading(event, records);
    case WM_EVENT_LOCALIZED: return fuse_localized(event, records);
    case WM_EVENT_SET_POSE:
    case WM_EVENT_RESET: return take_pose(event);
    case WM_EVENT_LOOKED: {
      const wm_status status = filter_.check_time(event.t_ns);
      if (status == WM_OK) filter_.move_to(event.t_ns);
      return status;
    }
    default: return WM_UNSUPPORTED;
  }
}

wm_status landmark_ekf::take_pose(const wm_event &event) {
  go_to(kBase_m);
  if (event.kind == WM_EVENT_RESET) {
    const wm_status status = reset_pose(filter_, setup_->start, event.t_ns);
    if (status == WM_OK) start_again();
    return status;
  }
  const wm_status status = set_pose(filter_, event);
  if (status == WM_OK) begin_life(true);
  return status;
}

void landmark_ekf::estimate(wm_estimate *out) const {
  filter_.estimate(out);
  if (is_point_) put_base(out);
  out->resets = life_.resets();
  out->state = life_.state(filter_.now_ns(), params_.dead_reckoning_after_s);
  out->lost_probability = lost_probability();
  if (life_.lost()) widen(out);
  if (life_.tracking()) add_start_mixture(out);
}

void landmark_ekf::go_to(const double arm_m[2]) {
  const double by_m[2] = {arm_m[0] - at_m_[0], arm_m[1] - at_m_[1]};
  if (!is_point_ || (by_m[0] == 0.0 && by_m[1] == 0.0)) return;
  filter_.move_place(by_m);
  at_m_[0] = arm_m[0], at_m_[1] = arm_m[1];
}

void landmark_ekf::put_base(wm_estimate *out) const {
  const double back_m[2] = {-at_m_[0], -at_m_[1]};
  const arm_moments arm = arm_of(back_m, out->heading_rad, filter_.variance(kHeading));
  double *p = out->covariance;
  const double heading_rad2 = filter_.variance(kHeading);
  for (int r = 0; r < 2; r++) {
    out->pose_map_base.p_m[r] += arm.off_m[r];
    for (int c = 0; c < 2; c++)
      p[wm_cov_index(r, c)] += arm.noise_m2[r][c] + arm.by_heading[r] * filter_.covariance(c, kHeading) +
                               arm.by_heading[c] * filter_.covariance(r, kHeading) +
                               arm.by_heading[r] * arm.by_heading[c] * heading_rad2;
    p[wm_cov_index(r, 5)] += arm.by_heading[r] * heading_rad2;
    p[wm_cov_index(5, r)] = p[wm_cov_index(r, 5)];
  }
  out->v_mps[0] -= out->w_radps[2] * back_m[1];
  out->v_mps[1] += out->w_radps[2] * back_m[0];
}

// Lost, the pose is anywhere among the landmarks with the probability of being lost.
void landmark_ekf::widen(wm_estimate *out) const {
  const double p = evidence_.probability(), anywhere_m2 = box_.anywhere_m2(filter_.pose());
  out->covariance[wm_cov_index(0, 0)] += p * anywhere_m2;
  out->covariance[wm_cov_index(1, 1)] += p * anywhere_m2;
  out->covariance[wm_cov_index(5, 5)] += p * square(kPi) / 3.0;
}

// While a stated start is in doubt, the covariance of the mixture of both hypotheses about the published pose. Gates
// keep the filter's own.
void landmark_ekf::add_start_mixture(wm_estimate *out) const {
  const double p = start_.wrong_probability();
  if (p < kDoubtedStart) return;
  const wm_pose2 &there = start_.pose();
  const wm_pose2 here = filter_.pose();
  const double off[3] = {there.x_m - here.x_m, there.y_m - here.y_m, wrap(there.heading_rad - here.heading_rad)};
  constexpr int kOf[3] = {0, 1, 5};  // x, y, heading among six
  for (int r = 0; r < 3; r++)
    for (int c = r; c < 3; c++) {
      double &both = out->covariance[wm_cov_index(kOf[r], kOf[c])];
      both = (1.0 - p) * both + p * (start_.covariance()[r][c] + off[r] * off[c]);
      out->covariance[wm_cov_index(kOf[c], kOf[r])] = both;
    }
}

void landmark_ekf::list_calibration(calibration_list *list) const {
  filter_.list_motion_states(list);
  aid_.slots().list(*setup_, filter_, list);
  positions_.list(filter_, list);
  localizer_.list(list);
  filter_.noise().list(list);
  filter_.turn_test().list(list);
  list_lasting_error(positions_.lasting_error(filter_), list);
}

size_t landmark_ekf::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_LANDMARKS_MOVED, moved_, moved_id_);
  list.add(WM_COUNTER_MOTION_OUTLIERS, filter_.motion_outliers());
  list.add(WM_COUNTER_RELOCALIZATIONS, life_.relocalizations());
  return list.count();
}

}  // namespace wm

const wm_estimator wm_landmark_ekf_estimator = wm::estimator_of<wm::landmark_ekf, wm_landmark_ekf_params>(
    "landmark_ekf",
    "Extended Kalman filter over the pose and the sensors' own errors: "
    "bearings and ranges to known landmarks, positions, "
    "headings. Finds the pose when lost.",
    WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER) | WM_EVENT_BIT(WM_EVENT_POSITION) |
        WM_EVENT_BIT(WM_EVENT_HEADING) | WM_EVENT_BIT(WM_EVENT_LOCALIZED) | WM_EVENT_BIT(WM_EVENT_LOOKED) |
        WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    wm_landmark_ekf_params_table, wm::kReads);
const wm_carrier wm_landmark_ekf_carrier = wm::carrier_of<wm::landmark_ekf>();
