// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/joint_state.hpp"

#include <cstring>
#include <utility>

#include "math/arc.hpp"
#include "math/elementary.hpp"

namespace wm {

// ---- start ----

namespace {

int capacity_of(const joint_layout &layout) {
  if (layout.capacity > 0) return even(layout.capacity);
  return even(even(layout.robot_states) + layout.landmarks * layout.landmark_width);
}

}  // namespace

size_t joint_state::doubles(const joint_layout &layout) { return error_state::doubles(capacity_of(layout), kRows, 1); }

void joint_state::init(const wm_setup &setup, const joint_layout &layout, double *arrays) {
  layout_ = layout;
  layout_.robot_states = even(layout.robot_states);
  state_.init({capacity_of(layout), kRows, 1, layout_.robot_states}, arrays);
  state_.append(layout_.robot_states);
  landmarks_ = 0;
  init_motion(setup);
  slip_ = {};
  scale_state_ = -1;
  carries_scale_ = false;
  for (int j = 0; j < kMaxRobot; j++) scale_share_[j] = scale_start_[j] = scale_variance_[j] = 0.0;
}

namespace {

bool is_wheel(int i) { return i == kLeftScale || i == kRightScale; }
bool is_on(const wm_motion_states &states, int model, const joint_state::wheel_slip &slip, int i) {
  return may_be_state(states, i, model) || (is_wheel(i) && slip.sigma > 0.0);
}

}  // namespace

int joint_state::count_motion_states(const wm_motion_states &states, int model, const wheel_slip &slip) {
  int count = (slip.sigma > 0.0 ? 2 : 0) + count_velocity_states(model);
  for (int i = 0; i < kCalibrationCount; i++) count += is_on(states, model, slip, i);
  return count;
}

void joint_state::set_motion_states(const wm_motion_states &states, int model, const wheel_slip &slip, int first) {
  slip_ = slip;
  for (int i = 0; i < kCalibrationCount; i++) {
    const bool on = is_on(states, model, slip, i);
    set_motion_state(states, i, on ? first++ : -1);
    if (on) forget(own_state_[i], calibration_.value[i], start_variance_[i]);
  }
  if (count_velocity_states(model) > 0) set_velocity_states(first);
  for (int k = 0; k < count_velocity_states(model); k++) forget(first++, 0.0, square(velocity_sigma(k)));
  if (!(slip.sigma > 0.0)) return;
  for (int side = 0; side < 2; side++) {
    const int wheel = own_state_[kLeftScale + side], mean = slip_mean_[side] = first++;
    const double variance = start_variance_[kLeftScale + side];
    forget(mean, 1.0, variance);
    state_.set_covariance(mean, wheel, variance);
    state_.set_covariance(wheel, wheel, variance + square(slip.sigma));
    stated_.leave_untested(wheel);
  }
}

// ---- time and motion ----

bool joint_state::is_velocity(int state) const {
  for (int i = kVelocityX; i < kMotionStates; i++)
    if (motion_state_[i] == state) return true;
  return false;
}

void joint_state::take_kept(const double scale_origin_m[2]) {
  std::memcpy(scale_origin_m_, scale_origin_m, sizeof scale_origin_m_);
  take_calibration(state_.mean());
}

bool joint_state::move(const wm_event &motion) {
  return move_by(
      motion, [this] { anchor_scale_again(); }, [this](wm_time_ns t_ns) { move_to(t_ns); },
      [this](const sparse_row &row, double innovation, double variance) {
        (void)fuse(state_.prepare(&row, &innovation, &variance, 1), nullptr, scope::all);  // its noise is above 0
      });
}

void joint_state::move_to(wm_time_ns t_ns) {
  const wm_time_ns before_ns = now_ns();
  predict_to(t_ns, [this](int state, double variance) {
    if (scale_variance_[state] > 0.0) scale_variance_[state] += variance;
  });
  if (slip_.sigma > 0.0 && before_ns != WM_TIME_NONE && now_ns() > before_ns)
    wander(wm_seconds_between(before_ns, now_ns()));
}

void joint_state::wander(double dt_s) {
  const double left = exp(-dt_s / slip_.tau_s);
  for (int side = 0; side < 2; side++)
    draw_to(own_state_[kLeftScale + side], slip_mean_[side], left, square(slip_.sigma) * (1.0 - left * left));
  take_calibration(state_.mean());
}

void joint_state::list_motion_states(calibration_list *list) const {
  list_states(list);
  static constexpr const char *kMeans[2] = {"left_scale_mean", "right_scale_mean"};
  for (int side = 0; side < 2 && slip_.sigma > 0.0; side++)
    list->add("motion", kMeans[side], value(slip_mean_[side]), std::sqrt(variance(slip_mean_[side])));
}

// ---- the state ----

void joint_state::draw_to(int state, int mean, double factor, double added_variance) {
  joint_row row;
  row.add(state, factor);
  row.add(mean, 1.0 - factor);
  state_.assign(state, row, added_variance, error_state::dot(row, values()));
}

void joint_state::set_pose(const wm_pose2 &pose, const double covariance[3][3]) {
  put_pose(pose, covariance);
  scale_origin_m_[0] = pose.x_m;
  scale_origin_m_[1] = pose.y_m;
}

// In the invariant filter by P <- T P T', T = I + e h', e = J (to - from).
void joint_state::shift_pose(const wm_pose2 &to, const double added[3][3]) {
  const double e[3] = {value(kY) - to.y_m, to.x_m - value(kX), 0.0};
  const double values[3] = {to.x_m, to.y_m, wrap(to.heading_rad)};
  joint_row rows[3];
  for (int i = 0; i < 3; i++) {
    rows[i].add(i, 1.0);
    rows[i].add(kHeading, layout_.invariant ? e[i] : 0.0);
  }
  assign(kX, 3, rows, reinterpret_cast<const double(*)[3]>(added), values);
  twist_heading_rad_ = values[kHeading];
}

void joint_state::assign(int first, int count, const joint_row *rows, const double (*noise)[3], const double *values) {
  state_.assign_rows(first, count, rows, noise[0], 3, values);
}

// Which coordinate of a place a state is: 0 for x, 1 for y, 2 for a heading; -1: none of these.
int joint_state::axis_of(int state) const {
  if (state < kPoseStates) return state;
  return state < layout_.robot_states ? -1 : (state - layout_.robot_states) % layout_.landmark_width;
}

// A rotation of x and y by three shears, each of which changes one state.
void joint_state::turn_pair(int state, double half_tangent, double sine) {
  const auto shear = [this](int to, int from, double by) {
    joint_row row;
    row.add(to, 1.0);
    row.add(from, by);
    state_.assign(to, row, 0.0, value(to) + by * value(from));
  };
  shear(state, state + 1, -half_tangent);
  shear(state + 1, state, sine);
  shear(state, state + 1, -half_tangent);
}

// In two halves: the tangent of a quarter of a turn is bounded.
void joint_state::move_map(const wm_pose2 &by) {
  const double half_tangent = tan(0.25 * by.heading_rad), sine = sincos(0.5 * by.heading_rad).sin;
  const auto turn = [&](int state) {
    for (int half = 0; half < 2 && by.heading_rad != 0.0; half++) turn_pair(state, half_tangent, sine);
  };
  if (has_velocity()) turn(motion_state_[kVelocityX]);
  for (int j = 0; j < states(); j++)
    if (const int axis = axis_of(j); axis == 0) {
      turn(j);
      set_value(j, value(j) + by.x_m);
      set_value(j + 1, value(j + 1) + by.y_m);
    } else if (axis == 2) {
      set_value(j, wrap(value(j) + by.heading_rad));
    }
  twist_heading_rad_ = value(kHeading);
  heading_rad_ = value(kHeading);
  take_calibration(state_.mean());
}

// By how much a turn of the map about a point moves a state, per rad.
double joint_state::turned_by(const double about_m[2], int state) const {
  const int velocity = has_velocity() ? motion_state_[kVelocityX] : states();  // none
  if (state == velocity) return -value(state + 1);
  if (state == velocity + 1) return value(state - 1);
  switch (axis_of(state)) {
    case 0: return about_m[1] - value(state + 1);
    case 1: return value(state - 1) - about_m[0];
    case 2: return 1.0;
    default: return 0.0;
  }
}

void joint_state::add_frame_error(const double about_m[2], double turn_sigma_rad, double white_m, double lasting_m,
                                  int error_state) {
  state_.add_spread(square(turn_sigma_rad), [&](int j) { return turned_by(about_m, j); });
  for (int k = 0; k < 2; k++) {
    const int own = error_state < 0 ? -1 : error_state + k;
    state_.add_spread(square(white_m), [&](int j) { return axis_of(j) == k ? 1.0 : 0.0; });
    if (own >= 0) forget(own, 0.0, 0.0);
    state_.add_spread(square(lasting_m), [&](int j) { return axis_of(j) == k ? 1.0 : j == own ? -1.0 : 0.0; });
  }
}

// ---- landmarks ----

int joint_state::add_landmark(const joint_row *rows, const double (*noise)[3], const double *values) {
  assign(state_.append(layout_.landmark_width), layout_.landmark_width, rows, noise, values);
  return landmarks_++;
}

void joint_state::remove_landmark(int landmark) {
  state_.remove(landmark_state(landmark), layout_.landmark_width);
  landmarks_--;
}

void joint_state::grow(const joint_layout &to) {
  const int first = layout_.robot_states, width = layout_.landmark_width;
  const int new_first = even(to.robot_states), new_width = to.landmark_width;
  layout_ = to;
  layout_.robot_states = new_first;
  state_.spread(first, new_first + landmarks_ * new_width, new_first,
                [=](int state) { return new_first + (state - first) / width * new_width + (state - first) % width; });
  for (int i = 0; i < landmarks_; i++)
    for (int k = width; k < new_width; k++) forget(landmark_state(i) + k, 0.0, square(kPi));
}

// ---- correction ----

innovation joint_state::prepare(const joint_row *rows, const double *innovations, const double *noise, int count) {
  sparse_row views[kRows];
  for (int k = 0; k < count; k++) views[k] = rows[k];
  return state_.prepare(views, innovations, noise, count);
}

moving_states joint_state::all_but_places(int own) const {
  moving_states out;
  for (int j = kHeading; j < states(); j++) {
    const bool moves = j == kHeading || (j >= kPoseStates && j < layout_.first_clone && scale_share_[j] == 0.0);
    if (moves || j == own) out.add(j, j + 1, 0);
  }
  return out;
}

bool joint_state::fuse(innovation &&i, const double *added_noise, scope which, int own) {
  moving_states moving;
  if (which == scope::directions)
    moving = all_but_places(own);
  else
    moving.add(0, which == scope::pose ? kPoseStates : which == scope::robot ? layout_.robot_states : states(), 0);
  if (!state_.solve(&i, added_noise, moving)) return false;
  if (which == scope::pose || which == scope::robot) {
    add_step();
    state_.correct(std::move(i), moving);
    return true;
  }
  if (which == scope::all) keep_limits(i);
  double before[kMaxRobot], *e = state_.displacement(0);
  std::memcpy(before, values(), static_cast<size_t>(layout_.robot_states) * sizeof *before);
  move_mean(state_.step(), e);
  if (layout_.invariant && scale_state_ >= 0) hold_scale(e);
  joint_row heading;
  heading.add(kHeading, 1.0);
  const sparse_row turn = heading;
  if (which == scope::all) {
    state_.correct(std::move(i), &turn, layout_.invariant);
  } else {
    state_.correct(std::move(i), moving);
    if (layout_.invariant) state_.transport(&turn, 1);
  }
  if (layout_.invariant && carries_scale_) carry_scale(before);
  return true;
}

void joint_state::widen_landmark(int landmark, const double d[2], double share) {
  const int first = landmark_state(landmark);
  for (int k = 0; k < 2; k++)
    for (int l = k; l < 2; l++) state_.add_covariance(first + k, first + l, share * d[k] * d[l]);
}

// Then the covariance is transported to the new place: T = I + e h' with e of that place alone.
void joint_state::fuse_landmark(int landmark, innovation &&i) {
  const int first = landmark_state(landmark);
  moving_states moving;
  moving.add(first, first + 2, 0);
  if (!state_.solve(&i, nullptr)) return;
  const double step[2] = {state_.step()[first], state_.step()[first + 1]};
  const double place[2] = {value(first) + step[0], value(first + 1) + step[1]};
  state_.correct(std::move(i), moving);
  joint_row rows[2];
  const double none[2][3] = {};
  for (int k = 0; k < 2; k++) {
    rows[k].add(first + k, 1.0);
    if (layout_.invariant) rows[k].add(kHeading, k == 0 ? -step[1] : step[0]);
  }
  assign(first, 2, rows, none, place);
}

// The correction of the mean: on the group of turns and places for the invariant filter (the map turns as a whole with
// the heading and does not shear), by addition for the plain one. e: as in T.
void joint_state::move_mean(const double *change, double *e) {
  double *mean = state_.mean();
  for (int j = 0; j < even(states()); j++) e[j] = 0.0;
  if (layout_.invariant) {
    const double turn = change[kHeading];
    const sin_cos t = sincos(turn);
    const arc a = make_arc(1.0, turn);
    const double way[2] = {a.x_m, a.y_m};  // sin(turn)/turn, (1 - cos(turn))/turn
    move_place(kX, change, t, way, e);
    mean[kHeading] += turn;
    for (int j = kPoseStates; j < layout_.first_clone; j++) mean[j] += change[j];
    for (int c = 0; c < layout_.clones; c++) {
      const int state = layout_.first_clone + 3 * c;
      move_place(state, change, t, way, e);
      mean[state + 2] = wrap(mean[state + 2] + change[state + 2]);
    }
    for (int i = 0; i < landmarks_; i++) {
      const int state = landmark_state(i);
      move_place(state, change, t, way, e);
      if (layout_.landmark_width == 3) mean[state + 2] = wrap(mean[state + 2] + change[state + 2]);
    }
  } else {
    for (int j = 0; j < states(); j++) mean[j] += change[j];
  }
  mean[kHeading] = wrap(mean[kHeading]);
  take_calibration(mean);
}

// p <- R p + V xi, xi = change - J p turn: the group's exponential.
void joint_state::move_place(int state, const double *change, const sin_cos &turn, const double way[2], double *e) {
  double *place = state_.mean() + state;
  const double px = place[0], py = place[1];
  const double xi_x = change[state] + py * change[kHeading], xi_y = change[state + 1] - px * change[kHeading];
  place[0] = turn.cos * px - turn.sin * py + way[0] * xi_x - way[1] * xi_y;
  place[1] = turn.sin * px + turn.cos * py + way[1] * xi_x + way[0] * xi_y;
  e[state] = py - place[1];  // J (new - old)
  e[state + 1] = place[0] - px;
}

}  // namespace wm
