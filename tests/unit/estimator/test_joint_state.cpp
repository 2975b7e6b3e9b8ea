// SPDX-License-Identifier: Apache-2.0
// SLAM's core against the textbook: the half matrix and its kernels, prediction, correction, landmarks that come and
// go, and what the invariant form promises. The reference keeps the whole matrix and knows nothing of sparsity.
#include <new>
#include <vector>

#include "common/suite.h"
#include "events.hpp"
#include "filters/slam/joint_state.hpp"
#include "math/arc.hpp"
#include "waymark/random.h"

namespace {

using wm::joint_row;
using wm::joint_state;
using matrix = std::vector<std::vector<double>>;

wm_random dice;
double gauss() { return wm_random_next_normal(&dice); }

struct made {
  std::vector<char> motion, memory;
  wm_setup setup{};
  joint_state *state;

  explicit made(bool invariant, int width = 2, int landmarks = 8, const joint_state::wheel_slip &slip = {},
                int capacity = 0)
      : motion(wm_motion_params_table.bytes) {
    wm_params_defaults(&wm_motion_params_table, motion.data());
    setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
    setup.wheels = make::no_wheels();
    setup.start.t_ns = WM_TIME_NONE;
    const int more = slip.sigma > 0.0 ? 4 : 0;
    const wm::joint_layout layout = {10 + more, 7 + more, 1, width, landmarks, invariant, capacity};
    const size_t head = (sizeof(joint_state) + 15) / 16 * 16;
    memory.resize(head + joint_state::doubles(layout) * sizeof(double) + 16);
    char *at = memory.data() + (16 - reinterpret_cast<uintptr_t>(memory.data()) % 16) % 16;
    state = new (at) joint_state;
    state->init(setup, layout, reinterpret_cast<double *>(at + head));
    wm_motion_states states{};
    states.sigma[wm::kSpeedScale] = 0.05;
    states.sigma[wm::kYawRateScale] = 0.05;
    states.sigma[wm::kYawRateBias] = 0.01;
    states.sigma[wm::kLag] = 0.02;
    state->set_motion_states(states, WM_MOTION_AUTO, slip, wm::kPoseStates);
    const double start[3][3] = {{0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}};
    state->set_pose({1, 2, 0.3}, start);
  }

  int add(double x, double y) {
    joint_row rows[3];
    rows[0].add(wm::kX, 1.0);
    rows[0].add(wm::kHeading, state->value(wm::kY) - y);
    rows[1].add(wm::kY, 1.0);
    rows[1].add(wm::kHeading, x - state->value(wm::kX));
    const double noise[3][3] = {{0.02, 0.001, 0}, {0.001, 0.03, 0}, {0, 0, 0.1}}, place[3] = {x, y, 0.1};
    return state->add_landmark(rows, noise, place);
  }

  matrix covariance() const {
    matrix p((size_t)state->states(), std::vector<double>((size_t)state->states()));
    for (int i = 0; i < state->states(); i++)
      for (int j = 0; j < state->states(); j++) p[(size_t)i][(size_t)j] = state->covariance(i, j);
    return p;
  }
};

void assert_near(const matrix &want, const matrix &got) {
  TEST_ASSERT_EQUAL(want.size(), got.size());
  for (size_t i = 0; i < want.size(); i++)
    for (size_t j = 0; j < want.size(); j++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, want[i][j], got[i][j]);
}

matrix times(const matrix &a, const matrix &b, bool transposed) {
  const size_t n = a.size();
  matrix out(n, std::vector<double>(n));
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k < n; k++) out[i][j] += a[i][k] * (transposed ? b[j][k] : b[k][j]);
  return out;
}

// F by differences of the mean: what the prediction's derivatives are, landmarks included.
TEST(test_prediction_is_that_of_the_whole_matrix) {
  made a(true);
  a.add(4, 3);
  a.add(-2, 5);
  a.state->move(make::twist(0.0, 0.8, 0.4));
  a.state->move(make::twist(0.1, 0.8, 0.4));
  const size_t n = (size_t)a.state->states();
  matrix f(n, std::vector<double>(n));
  const auto end = [&](int changed, double by) {
    made b(true);
    b.memory = a.memory;
    const std::ptrdiff_t at = reinterpret_cast<char *>(a.state) - a.memory.data();
    joint_state *copy = reinterpret_cast<joint_state *>(b.memory.data() + at);
    if (changed >= 0) {
      copy->set_value(changed, copy->value(changed) + by);
      const double exact = copy->value(changed);
      copy->forget(changed, exact, 1.0);  // the calibration takes the new value
    }
    copy->move(make::twist(0.3, 0.8, 0.4));
    std::vector<double> x;
    for (int i = 0; i < copy->states(); i++) x.push_back(copy->value(i));
    return x;
  };
  const std::vector<double> middle = end(-1, 0.0);
  for (size_t j = 0; j < n; j++) {
    if (j == 6) {  // the lag moves both ends of the interval, where it is not smooth: taken as the filter's own
      f[j][j] = 1.0;
      continue;
    }
    const std::vector<double> plus = end((int)j, 1e-6), minus = end((int)j, -1e-6);
    for (size_t i = 0; i < n; i++) f[i][j] = (plus[i] - minus[i]) / 2e-6;
  }
  const matrix before = a.covariance();
  a.state->move(make::twist(0.3, 0.8, 0.4));
  const matrix after = a.covariance(), want = times(times(f, before, false), f, true);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 3; j < n; j++)  // the pose's own block has noise and lag besides
      if (i != 6 && j != 6) TEST_ASSERT_DOUBLE_WITHIN(1e-8, want[i][j], after[i][j]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(want[0][0], after[0][0]);
}

// The plain form is the textbook's P - K S K'; the invariant one carries it over by T besides, and by another T with
// the scale. The scale itself lies where the speed's start says, which alone tells it.
TEST(test_correction_is_that_of_the_whole_matrix) {
  enum { kPlain, kInvariant, kScaled };
  std::vector<double> unscaled;  // the invariant form's mean
  for (int form : {kPlain, kInvariant, kScaled}) {
    dice = {7, 1, 0};
    const bool invariant = form != kPlain;
    made a(invariant, 3);
    if (form == kScaled) TEST_ASSERT_TRUE(a.state->find_scale(true));
    a.add(4, 3);
    a.add(-2, 5);
    a.state->move(make::twist(0.0, 0.8, 0.4));
    a.state->move(make::twist(0.5, 0.8, 0.4));
    const int s = a.state->landmark_state(1);
    joint_row rows[3];
    matrix h(3, std::vector<double>((size_t)a.state->states()));
    for (int k = 0; k < 3; k++)
      for (int state : {0, 1, 2, 3, 5, s, s + 1, s + 2}) {
        const double by = gauss();
        rows[k].add(state, by);
        h[(size_t)k][(size_t)state] += by;
      }
    const double innovation[3] = {0.02, -0.01, 0.03}, noise[3] = {0.01, 0.02, 0.03}, none[3] = {};
    const matrix p = a.covariance();
    std::vector<double> x;
    for (int i = 0; i < a.state->states(); i++) x.push_back(a.state->value(i));
    wm::innovation block = a.state->prepare(rows, innovation, noise, 3);
    TEST_ASSERT_TRUE(a.state->fuse(std::move(block), none, wm::joint_state::scope::all));

    const size_t n = p.size();
    matrix want = p;
    std::vector<double> mean = x, left(innovation, innovation + 3);
    for (size_t k = 0; k < 3; k++) {  // one number after the other is the same as all at once
      std::vector<double> g(n);
      for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) g[i] += want[i][j] * h[k][j];
      double variance = noise[k], moved = 0.0;
      for (size_t j = 0; j < n; j++) {
        variance += h[k][j] * g[j];
        moved += h[k][j] * (mean[j] - x[j]);
      }
      for (size_t i = 0; i < n; i++) mean[i] += g[i] / variance * (left[k] - moved);
      for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) want[i][j] -= g[i] * g[j] / variance;
    }
    if (!invariant) {
      for (size_t i = 0; i < n; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, mean[i], a.state->value((int)i));
      assert_near(want, a.covariance());
      continue;
    }
    matrix t(n, std::vector<double>(n));
    for (size_t i = 0; i < n; i++) t[i][i] = 1.0;
    for (size_t place : {size_t{0}, (size_t)a.state->landmark_state(0), (size_t)s}) {
      t[place][2] -= a.state->value((int)place + 1) - x[place + 1];
      t[place + 1][2] += a.state->value((int)place) - x[place];
      if (form == kInvariant)
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, mean[place], a.state->value((int)place));  // apart by the turn's square
    }
    want = times(times(t, want, false), t, true);
    if (form == kInvariant)
      for (size_t i = 0; i < n; i++) unscaled.push_back(a.state->value((int)i));
    if (form == kScaled) {
      const size_t speed = (size_t)a.state->motion_state(wm::kSpeedScale);
      TEST_ASSERT_GREATER_THAN_DOUBLE(1e-4, std::fabs(mean[speed] - 1.0));
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, a.state->value((int)speed));
      const double larger = a.state->value((int)speed) / mean[speed];
      for (size_t i : {size_t{0}, (size_t)s}) {  // seen from the start, 1, 2
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0 + larger * (unscaled[i] - 1.0), a.state->value((int)i));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0 + larger * (unscaled[i + 1] - 2.0), a.state->value((int)i + 1));
      }
      matrix grown(n, std::vector<double>(n));
      for (size_t i = 0; i < n; i++) grown[i][i] = 1.0;
      for (size_t i : {size_t{0}, size_t{1}, speed, (size_t)s, (size_t)s + 1, (size_t)a.state->landmark_state(0),
                       (size_t)a.state->landmark_state(0) + 1})
        grown[i][speed] += (a.state->value((int)i) - x[i]) / x[speed];
      want = times(times(grown, want, false), grown, true);
    }
    assert_near(want, a.covariance());
  }
}

// Another sensor tells the speed, whose scale is another: what the rest of the map's scale has come to counts from then
// on, not what it began with. (The turn's scale stands in for a range's here.)
TEST(test_a_new_sensor_of_the_speed_does_not_take_the_map_s_scale_back) {
  made a(true);
  const int s = a.state->landmark_state(a.add(4, 3)), range = a.state->motion_state(wm::kYawRateScale);
  TEST_ASSERT_TRUE(a.state->find_scale(false));
  a.state->follow_scale(range, -1.0, true);
  for (double t : {0.0, 0.1})
    a.state->move(make::quantities(
        t, {{WM_Q_WHEEL_SPEED_REAR_LEFT, 1.0}, {WM_Q_WHEEL_SPEED_REAR_RIGHT, 1.0}, {WM_Q_YAW_RATE, 0.0}}));
  a.state->set_value(range, 1.04);
  for (double t : {0.2, 1.2, 2.2, 3.2})
    a.state->move(make::quantities(t, {{WM_Q_VEHICLE_SPEED, 1.0}, {WM_Q_YAW_RATE, 0.0}}));
  joint_row row;
  row.add(s, 1.0);
  const double nothing = 0.0, noise = 1.0;
  wm::innovation block = a.state->prepare(&row, &nothing, &noise, 1);
  TEST_ASSERT_TRUE(a.state->fuse(std::move(block), &nothing, wm::joint_state::scope::all));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.04, a.state->value(range));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4.0, a.state->value(s));
}

TEST(test_a_landmark_that_leaves_takes_its_part_of_the_matrix_and_nothing_else) {
  made a(true), b(true);
  a.add(4, 3);
  a.add(-2, 5);
  a.add(1, 1);
  b.add(4, 3);
  b.add(1, 1);
  a.state->remove_landmark(1);
  assert_near(b.covariance(), a.covariance());
  a.add(7, 7);
  b.add(7, 7);
  assert_near(b.covariance(), a.covariance());
}

TEST(test_frozen_landmarks_stay_and_the_robot_is_corrected) {
  made a(true);
  const int s = a.state->landmark_state(a.add(4, 3));
  const matrix before = a.covariance();
  joint_row row;
  row.add(s, 1.0);
  const double innovation = 0.1, noise = 0.01, none = 0.0;
  wm::innovation block = a.state->prepare(&row, &innovation, &noise, 1);
  TEST_ASSERT_TRUE(a.state->fuse(std::move(block), &none, wm::joint_state::scope::robot));
  TEST_ASSERT_EQUAL_DOUBLE(4.0, a.state->value(s));
  TEST_ASSERT_EQUAL_DOUBLE(before[(size_t)s][(size_t)s], a.state->variance(s));
  TEST_ASSERT_LESS_THAN_DOUBLE(before[0][0], a.state->variance(wm::kX));
  TEST_ASSERT_NOT_EQUAL_DOUBLE(1.0, a.state->value(wm::kX));
}

// A robot that sees the same landmark again and again while its estimates move learns nothing of the map's heading: it
// can't be seen. The plain form believes that it does.
double heading_sigma_after_many_views(bool invariant) {
  made a(invariant);
  a.state->move(make::twist(0.0, 0.0, 0.0));
  const int s = a.state->landmark_state(a.add(1.6, 2.1));
  for (int i = 0; i < 400; i++) {
    const double dx = a.state->value(s) - a.state->value(0), dy = a.state->value(s + 1) - a.state->value(1);
    const wm::sin_cos h = wm::sincos(a.state->value(2));
    joint_row rows[2];
    rows[0].add(0, -h.cos), rows[0].add(1, -h.sin), rows[0].add(s, h.cos), rows[0].add(s + 1, h.sin);
    rows[0].add(2, h.cos * dy - h.sin * dx);
    rows[1].add(0, h.sin), rows[1].add(1, -h.cos), rows[1].add(s, -h.sin), rows[1].add(s + 1, h.cos);
    rows[1].add(2, -h.cos * dx - h.sin * dy);
    const double innovation[2] = {0.3 * gauss(), 0.3 * gauss()}, noise[2] = {0.09, 0.09}, none[2] = {};
    wm::innovation block = a.state->prepare(rows, innovation, noise, 2);
    TEST_ASSERT_TRUE(a.state->fuse(std::move(block), none, wm::joint_state::scope::all));
  }
  return std::sqrt(a.state->variance(wm::kHeading));
}

TEST(test_the_map_s_heading_is_not_learnt_from_looking) {
  const double invariant = heading_sigma_after_many_views(true);
  dice.next = 0;
  const double plain = heading_sigma_after_many_views(false);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, invariant);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.099, plain);
}

// A wheel's scale forgets what it slipped, and never its mean; both stay as unsure as they are.
TEST(test_a_wheel_that_slips_comes_back_to_its_mean) {
  made m(true, 2, 8, {0.005, 5.0});
  const int left = m.state->motion_state(wm::kLeftScale), mean = left + 3;  // behind both wheels and the lag
  m.state->move(make::twist(1.0, 0, 0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, m.state->variance(mean));
  m.state->set_value(left, 1.02);
  for (int i = 1; i <= 50; i++) m.state->move(make::twist(1.0 + 0.1 * i, 0, 0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0 + 0.02 * wm::exp(-1.0), m.state->value(left));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.005 * 0.005, m.state->variance(left));
}

// A row that has no room for all its derivatives is not fused.
TEST(test_a_row_with_missing_entries_is_refused) {
  made a(true);
  joint_row row;
  for (int i = 0; i <= joint_row::kMax; i++) row.add(0, 0.01);
  const double innovation = 1.0, noise = 0.1, none = 0.0, before = a.state->value(0);
  wm::innovation block = a.state->prepare(&row, &innovation, &noise, 1);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1e6, block.nis);
  TEST_ASSERT_FALSE(a.state->fuse(std::move(block), &none, wm::joint_state::scope::all));
  TEST_ASSERT_EQUAL_DOUBLE(before, a.state->value(0));
}

// One row of a landmark seen from the robot.
static wm::innovation see_landmark(made *m, int first, double innovation, double noise, joint_row *row) {
  row->add(wm::kX, -0.6);
  row->add(wm::kY, 0.8);
  row->add(first, 0.6);
  row->add(first + 1, -0.8);
  return m->state->prepare(row, &innovation, &noise, 1);
}

// [Schmidt1966] with the gain of one landmark alone, on the whole matrix: P <- (I - K H) P (I - K H)' + K R K'.
TEST(test_a_landmark_alone_is_corrected) {
  made m(false);
  for (int i = 0; i < 3; i++) m.add(3.0 + i, 1.0 - 0.5 * i);
  const matrix before = m.covariance();
  const size_t n = before.size();
  const int landmark = 1, first = m.state->landmark_state(landmark);
  const double noise = 0.02, innovation = 0.3;
  joint_row row;
  wm::innovation block = see_landmark(&m, first, innovation, noise, &row);
  std::vector<double> h(n), gain(n), value;
  for (int k = 0; k < row.count; k++) h[(size_t)row.index[k]] += row.by[k];
  for (size_t i = (size_t)first; i < (size_t)first + 2; i++)
    for (size_t j = 0; j < n; j++) gain[i] += before[i][j] * h[j] / block.s[0][0];
  matrix a(n, std::vector<double>(n));
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) a[i][j] = (i == j) - gain[i] * h[j];
  matrix want = times(times(a, before, false), a, true);
  for (size_t i = 0; i < n; i++) {
    value.push_back(m.state->value((int)i) + gain[i] * innovation);
    for (size_t j = 0; j < n; j++) want[i][j] += gain[i] * noise * gain[j];
  }
  m.state->fuse_landmark(landmark, std::move(block));
  assert_near(want, m.covariance());
  for (size_t i = 0; i < n; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, value[i], m.state->value((int)i));
}

// The invariant filter's is the plain one's, transported by T = I + e h', e = J (new place - old place).
TEST(test_a_landmark_alone_is_transported_to_its_new_place) {
  matrix covariance[2];
  double moved[2];
  int first = 0;
  for (const bool invariant : {false, true}) {
    made m(invariant);
    for (int i = 0; i < 3; i++) m.add(3.0 + i, 1.0 - 0.5 * i);
    first = m.state->landmark_state(1);
    joint_row row;
    wm::innovation block = see_landmark(&m, first, 0.3, 0.02, &row);
    for (int k = 0; k < 2; k++) moved[k] = -m.state->value(first + k);
    m.state->fuse_landmark(1, std::move(block));
    for (int k = 0; k < 2; k++) moved[k] += m.state->value(first + k);
    covariance[invariant] = m.covariance();
  }
  const size_t n = covariance[0].size();
  matrix t(n, std::vector<double>(n));
  for (size_t i = 0; i < n; i++) t[i][i] = 1.0;
  t[(size_t)first][wm::kHeading] = -moved[1];
  t[(size_t)first + 1][wm::kHeading] = moved[0];
  assert_near(times(times(t, covariance[0], false), t, true), covariance[1]);
}

TEST(test_states_that_join_in_front_of_landmarks_leave_the_others_as_they_were) {
  const int robot = 10, more = 15, landmarks = 4, wide = 3;
  made m(true, 2, landmarks, {}, wm::even(robot + more) + landmarks * wide);
  for (int i = 0; i < landmarks; i++) m.add(3.0 + i, 1.0 - 0.5 * i);
  const matrix before = m.covariance();
  std::vector<double> value;
  for (int i = 0; i < m.state->states(); i++) value.push_back(m.state->value(i));
  wm::joint_layout to = m.state->layout();
  to.robot_states = robot + more;
  to.first_clone = robot + 3;
  to.clones = 4;
  to.landmark_width = wide;
  m.state->grow(to);
  const int first = wm::even(robot + more);
  TEST_ASSERT_EQUAL(first + landmarks * wide, m.state->states());
  matrix want((size_t)m.state->states(), std::vector<double>((size_t)m.state->states()));
  const auto place = [&](int i) { return (size_t)(i < robot ? i : first + (i - robot) / 2 * wide + (i - robot) % 2); };
  for (size_t i = 0; i < before.size(); i++) {
    TEST_ASSERT_EQUAL_DOUBLE(value[i], m.state->value((int)place((int)i)));
    for (size_t j = 0; j < before.size(); j++) want[place((int)i)][place((int)j)] = before[i][j];
  }
  for (int i = 0; i < landmarks; i++) {
    const size_t heading = (size_t)(first + i * wide + 2);
    want[heading][heading] = wm::kPi * wm::kPi;
    TEST_ASSERT_EQUAL_DOUBLE(0.0, m.state->value((int)heading));
  }
  assert_near(want, m.covariance());
}

}  // namespace

void setUp(void) { dice = {7, 1, 0}; }
