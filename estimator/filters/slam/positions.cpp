// SPDX-License-Identifier: Apache-2.0
// Positions, headings and poses of another localizer while mapping. A map that began at the start's pose lies in a
// frame of its own: the first heading turns it, and the first position, or enough of the path, puts it where it
// belongs.
#include "aid/frame_fit.hpp"
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {

// The map's frame is its own where neither a map nor a start pose states one.
void slam::begin_frame() {
  const wm_start &start = setup_->start;
  const bool given = params_.map != WM_SLAM_MAP_NONE;
  is_placed_ = given || (finite(start.p_m[0]) && finite(start.p_m[1]));
  is_turned_ = given || finite(start.heading_rad);
  frame_.clear();
}

// All of the map moves; `about`: the point about which the errors of its turn and its shift are independent.
void slam::place_map(const wm_pose2 &by, const double about_m[2], double turn_sigma_rad, double white_m,
                     double lasting_m) {
  forget_lines();
  joint_.move_map(by);
  joint_.add_frame_error(about_m, turn_sigma_rad, white_m, lasting_m, positions_.error_state());
  observations_.clear();
  slips_.begin();
  line_search_.clear();
  follow_scale();
  life_.corrected(joint_.now_ns());
}

// A position that places the map. False: the frame is known, and the position is to be fused.
bool slam::is_placing(const wm_position &p, const position_aid::view &at) {
  if (is_placed_) return false;
  const double own_m[2] = {at.past.pose.x_m + at.off_m[0], at.past.pose.y_m + at.off_m[1]};
  const double white_m = white_sigma_m(p.sigma_xy_m, positions_.params());
  const double lasting_m = correlated_sigma_m(p.sigma_xy_m, positions_.params());
  const double sigma_m = std::sqrt(square(white_m) + square(lasting_m));
  if (is_turned_) {
    is_placed_ = true;
    place_map({p.p_m[0] - own_m[0], p.p_m[1] - own_m[1], 0.0}, p.p_m, 0.0, white_m, lasting_m);
    return true;
  }
  frame_.add(own_m, p.p_m);
  if (!frame_.is_sure(sigma_m)) return true;
  is_placed_ = is_turned_ = true;
  double about_m[2];
  frame_.middle(about_m);
  place_map(frame_.motion(), about_m, frame_.turn_sigma_rad(sigma_m), white_m, lasting_m);
  return true;
}

// Numbers that are no landmark's, gated and fused like those of one.
void slam::fuse_given(const residual *rows, int count, int key, double clutter_volume, record_list records) {
  context at{0, -1, {}, rows[0].record, records};
  landmark_rows v;
  v.count = count;
  for (int k = 0; k < count; k++) {
    v.row[k].add(rows[k].row, 1.0);
    v.kind[k] = static_cast<wm_residual>(rows[k].record.residual);
    v.observed[k] = rows[k].record.observed;
    v.expected[k] = rows[k].record.expected;
    v.innovation[k] = rows[k].innovation;
    v.noise[k] = rows[k].noise;
  }
  innovation block = joint_.prepare(v.row, v.innovation, v.noise, count);
  const gate_result g = gate(block.nis, count, gates());
  const double log_bayes = g.passed ? landmark_evidence::log_bayes_factor(block.density(), clutter_volume)
                                    : landmark_evidence::max_log_bayes_factor();
  if (key != kNoKey && !weigh_source(key, nullptr, g.passed, true, log_bayes, std::nan(""), std::nan("")))
    return (void)reject(records, at.record, WM_REJECTED_SEARCHING);
  if (fuse_rows(at, v, g, &block) == WM_FUSED) life_.fused(joint_.now_ns());
}

// Lost or in doubt, it is kept for the search. True: the search has taken it.
bool slam::search_by(const observation &seen) {
  if (!params_.recover || !map_is_held()) return false;
  observations_.add(seen);
  return relocalize() || life_.searching();
}

wm_status slam::fuse_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = p.p_m[0];
  wm_status status = check_position(p, 0, 2);
  if (status != WM_OK) return refuse(records, record, status);
  status = begin_observation(event.t_ns);
  if (status != WM_OK) return status;
  if (!positions_.params().use_position) return reject(records, record, WM_REJECTED_BY_CONFIG);
  if (!positions_.is_awake()) positions_.wake(&joint_);
  const bool is_first = !positions_.has_position();
  const position_aid::view at = positions_.look(p, &joint_);
  if (is_first) follow_scale();  // positions measure the map's scale
  if (is_placing(p, at) || search_by(positions_.observe(p, at, joint_)))
    return reject(records, record, WM_REJECTED_SEARCHING);
  residual rows[2];
  positions_.put_rows(p, at, joint_, record, rows);
  fuse_given(rows, 2, kPositionKey, square(kClutterPlace_m), records);
  return WM_OK;
}

wm_status slam::fuse_heading(const wm_event &event, record_list records) {
  const wm_heading &h = event.as.heading;
  residual r;
  r.record = record_of(event, WM_RESIDUAL_HEADING);
  r.record.observed = h.heading_rad;
  wm_status status = check_heading(h);
  if (status != WM_OK) return refuse(records, r.record, status);
  status = begin_observation(event.t_ns);
  if (status != WM_OK) return status;
  if (!positions_.params().use_heading) return reject(records, r.record, WM_REJECTED_BY_CONFIG);
  if (!positions_.is_awake()) positions_.wake(&joint_);
  const observation seen = positions_.observe(h, joint_);
  if (!is_turned_) {
    is_turned_ = true;
    const wm_pose2 here = joint_.pose();
    const double about_m[2] = {here.x_m, here.y_m};
    const wm_pose2 turned = {here.x_m, here.y_m, wrap(seen.bearing_rad)};
    place_map(compose(turned, between(here, wm_pose2{})), about_m, seen.sigma_angle_rad, 0.0, 0.0);
    return reject(records, r.record, WM_REJECTED_SEARCHING);
  }
  if (search_by(seen)) return reject(records, r.record, WM_REJECTED_SEARCHING);
  positions_.put_row(h, joint_, &r);
  fuse_given(&r, 1, kHeadingKey, kTwoPi, records);
  return WM_OK;
}

// A pose in the map's frame that places it, and turns it where it has a heading.
bool slam::is_placing(const localizer_aid::view &at) {
  if (!localizer_.is_in_map() || (is_placed_ && is_turned_)) return false;
  wm_pose2 there = at.there;
  if (at.rows < localizer_aid::kRows) {
    if (!is_turned_ || is_placed_) return !is_placed_;
    there.heading_rad = at.past.pose.heading_rad;
  }
  const double about_m[2] = {there.x_m, there.y_m}, lasting_m = std::sqrt(at.variance[0]);
  place_map(compose(there, between(at.past.pose, wm_pose2{})), about_m, is_turned_ ? 0.0 : std::sqrt(at.variance[2]),
            lasting_m, 0.0);
  is_placed_ = is_turned_ = true;
  return true;
}

wm_status slam::fuse_localized(const wm_event &event, record_list records) {
  const wm_localized &seen = event.as.localized;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = seen.p_m[0];
  wm_status status = check_localized(seen);
  if (status != WM_OK) return refuse(records, record, status);
  status = begin_observation(event.t_ns);
  if (status != WM_OK) return status;
  localizer_aid::view at;
  const bool is_first = !localizer_.is_used();
  if (!localizer_.look(seen, &joint_, &at)) return WM_OK;
  if (is_placing(at)) return reject(records, record, WM_REJECTED_SEARCHING);
  if (is_first) follow_scale();
  if (localizer_.is_for_search(at, life_.tracking()) && search_by(localizer_.observe(at, joint_)))
    return reject(records, record, WM_REJECTED_SEARCHING);
  residual rows[localizer_aid::kRows];
  localizer_.put_rows(at, joint_, record, rows);
  if (!localizer_.is_trusted(at, rows, &joint_)) return reject(records, record, WM_REJECTED_SEARCHING);
  fuse_given(rows, at.rows, localizer_.key(), at.clutter_volume(), records);
  return WM_OK;
}

}  // namespace wm
