// SPDX-License-Identifier: Apache-2.0
// Rotations, kernels on a triangle, and the filter core in space against slow and plain references.
#include <memory>

#include "common/suite.h"
#include "filters/relocalize/pose_consensus.hpp"
#include "filters/stereo_ekf/space_filter.hpp"
#include "motion/spatial.hpp"
#include "waymark/random.h"

using namespace wm;

namespace {

double normal(int i) { return wm_random_normal(7, 1, static_cast<uint64_t>(i)); }
vec3 random_vec(int i) { return {normal(3 * i), normal(3 * i + 1), normal(3 * i + 2)}; }

void assert_near(const vec3 &want, const vec3 &got, double within) {
  for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(within, want[i], got[i]);
}

// A filter with its memory behind it.
struct machine {
  char *memory;
  space_filter *filter;
  explicit machine(const head_model *models, int points) {
    const size_t own = (sizeof(space_filter) + 15) / 16 * 16;
    const size_t bytes = own + sizeof(double) * space_filter::doubles(models, points);
    memory = static_cast<char *>(aligned_alloc(16, (bytes + 15) / 16 * 16));
    std::memset(memory, 0, bytes);
    filter = reinterpret_cast<space_filter *>(memory);
    filter->init(reinterpret_cast<double *>(memory + own), models, points);
  }
  ~machine() { free(memory); }
  machine(const machine &) = delete;
  machine &operator=(const machine &) = delete;
};

const head_model kNone[kHeadStates] = {};

}  // namespace

TEST(test_turns_there_and_back) {
  for (int i = 0; i < 200; i++) {
    vec3 r = (i % 2 ? 1e-5 : 0.8) * random_vec(i);
    if (length(r) > 3.1) r = (3.1 / length(r)) * r;
    const quat q = turn_by(r);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1.0, q.w * q.w + dot(q.v, q.v));
    assert_near(r, turn_of(q), 1e-13);
    const quat again = quat_of(matrix_of(q));
    const double sign = again.w * q.w + dot(again.v, q.v) < 0 ? -1 : 1;
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, q.w, sign * again.w);
    assert_near(q.v, sign * again.v, 1e-14);
    const vec3 x = random_vec(1000 + i);
    assert_near(matrix_of(turn_by(0.5 * r)) * (matrix_of(turn_by(0.5 * r)) * x), matrix_of(q) * x, 1e-13);
  }
}

// The mean rotation against the sum of many small ones; and across the seam between series and closed form.
TEST(test_the_mean_turn_is_the_mean) {
  for (int i = 0; i < 40; i++) {
    vec3 r = random_vec(i);
    r = ((i % 2 ? 0.0999 : 0.1001) * (i < 20 ? 1.0 : 20.0) / length(r)) * r;
    const vec3 v = random_vec(500 + i);
    vec3 sum = {0, 0, 0};
    const int steps = 2000;
    for (int k = 0; k < steps; k++) sum = sum + (1.0 / steps) * (matrix_of(turn_by((k + 0.5) / steps * r)) * v);
    assert_near(sum, mean_turn(r) * v, 1e-6);
  }
}

// A small error in pose or sensor states, carried by the motion itself, against its covariance carried by the filter.
TEST(test_propagation_carries_errors_as_the_motion_does) {
  head_model models[kHeadStates] = {};
  models[kRateBias] = {0.01, 0, 0};
  models[kVelocityScale] = {0.02, 0, 0};
  const body_stretch s = {0.3, {0.8, -0.2, 0.4}, {0.3, 1.1, -0.7}, {}, {}};
  for (int wrong = 0; wrong < 6; wrong++) {
    const double epsilon = 1e-5;
    const pose3 start = {{3, -2, 5}, turn_by({0.4, -1.0, 2.0})};
    pose3 off = start;
    vec3 e = {0, 0, 0};
    e[wrong % 3] = epsilon;
    if (wrong < 3)
      off.p = off.p + e;
    else
      off.q = normalized(turn_by(e) * off.q);
    machine a(models, 0), b(models, 0);
    double covariance[6][6] = {};
    covariance[wrong][wrong] = square(epsilon);
    const double none[6][6] = {};
    a.filter->set_pose(start, covariance);
    b.filter->set_pose(off, none);
    const double before_bias = a.filter->variance(6);
    a.filter->propagate(s);
    b.filter->propagate(s);
    TEST_ASSERT_EQUAL_DOUBLE(before_bias, a.filter->variance(6));
    const vec3 place = b.filter->pose().p - a.filter->pose().p;
    const vec3 turn = turn_of(b.filter->pose().q * conjugate(a.filter->pose().q));
    double got[6][6], want[6];
    for (int i = 0; i < 3; i++) {
      want[i] = place[i];
      want[3 + i] = turn[i];
    }
    // What the sensors' states add is there in both; the difference to a filter without start error is the error's.
    machine c(models, 0);
    c.filter->set_pose(start, none);
    c.filter->propagate(s);
    for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++) {
        got[i][j] = a.filter->covariance(i, j) - c.filter->covariance(i, j);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * square(epsilon), want[i] * want[j], got[i][j]);
      }
  }
}

TEST(test_sensor_states_swing_the_way_as_they_should) {
  head_model models[kHeadStates] = {};
  models[kRateBias] = {1e-4, 0, 0};
  models[kVelocityScale] = {1e-4, 0, 0};
  models[kRateScale] = {1e-4, 0, 0};
  models[kTwistAxes] = {1e-4, 0, 0};
  models[kVelocityDirection] = {1e-4, 0, 0};
  const double none[6][6] = {};
  machine a(models, 0);
  a.filter->set_pose({{0, 0, 0}, turn_by({0.2, 0.3, -0.4})}, none);
  double covariance[6][6] = {};
  for (int k = 0; k < 11; k++) {
    machine b(models, 0), zero(models, 0);
    for (machine *m : {&b, &zero}) m->filter->set_pose({{0, 0, 0}, turn_by({0.2, 0.3, -0.4})}, none);
    body_stretch s = {0.02, {0.8, -0.2, 0.4}, {0.3, 1.1, -0.7}, {}, {}};
    body_stretch wrong = s;
    if (k < 3)
      wrong.w_radps[k] -= 1e-4;
    else if (k == 3)
      wrong.v_mps = (1 + 1e-4) * s.v_mps;
    else if (k == 10)
      wrong.w_radps = (1 + 1e-4) * s.w_radps;
    else {
      vec3 axes = {0, 0, 0};
      axes[(k - 4) % 3] = 1e-4;
      wrong.v_mps = s.v_mps + cross(axes, s.v_mps);
      if (k < 7) wrong.w_radps = s.w_radps + cross(axes, s.w_radps);
    }
    for (int i = 0; i < 50; i++) {
      b.filter->propagate(wrong);
      zero.filter->propagate(s);
      if (k == 0) a.filter->propagate(s);
    }
    const vec3 place = b.filter->pose().p - zero.filter->pose().p;
    const vec3 turn = turn_of(b.filter->pose().q * conjugate(zero.filter->pose().q));
    for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++)
        covariance[i][j] += (i < 3 ? place[i] : turn[i - 3]) * (j < 3 ? place[j] : turn[j - 3]);
  }
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++)
      TEST_ASSERT_DOUBLE_WITHIN(2e-3 * std::sqrt(covariance[i][i] * covariance[j][j]) + 1e-12, covariance[i][j],
                                a.filter->covariance(i, j));
}

// A camera that is turned by 0.4 rad about one axis where 0.01 is stated, a constant and a process: given up within the
// next test, and in doubt until it is known better.
TEST(test_a_turn_of_the_camera_that_is_stated_wrongly_is_found) {
  for (const double tau_s : {0.0, 20.0}) {
    head_model models[kHeadStates] = {};
    models[kCameraRotation] = {0.01, 0, tau_s};
    const machine m(models, 0);
    const int state = m.filter->at(kCameraRotation);
    const auto see = [&](double variance) {
      row_block block;
      const int column = block.add_columns(state, 3),
                row = block.add_row(WM_RESIDUAL_BEARING, 0.4, 0.4 - m.filter->head(state + 2), variance);
      block.by[row][column + 2] = 1.0;
      TEST_ASSERT_TRUE(m.filter->fuse(block, {1e6, 1e6}).fused);
      m.filter->propagate({0.6, {}, {}, {}, {}});
    };
    see(0.03 * 0.03);
    m.filter->propagate({0.1, {}, {}, {}, {}});
    TEST_ASSERT_TRUE(m.filter->is_stated_wrongly(kCameraRotation));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.4, m.filter->head(state + 2));
    if (tau_s > 0) continue;  // it wanders as widely from now on
    see(1e-6);
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.4, m.filter->head(state + 2));
  }
}

// The error of the motion since a picture is the pose's own, in that picture's axes, where the pose was exact then.
// Considered states keep their covariance while what they correlate with is learnt.
TEST(test_motion_since_a_picture_and_considered_states) {
  head_model models[kHeadStates] = {};
  for (const int which : {kMovedPlace, kMovedTurn}) models[which] = {1, 0, 0};
  for (const int which : {kRateBias, kTwistAxes, kPictureDirection}) models[which] = {0.02, 0, 0};
  models[kVelocityScale] = models[kPictureScale] = {0.02, 0, 0};
  machine a(models, 0);
  const double none[6][6] = {};
  const pose3 start = {{3, -2, 5}, turn_by({0.4, -1.0, 2.0})};
  a.filter->set_pose(start, none);
  a.filter->begin_increment();
  for (int i = 0; i < 5; i++)
    a.filter->propagate({0.1, {0.8, -0.2, 0.4}, {0.3, 1.1, -0.7}, {1e-4, 2e-4, 3e-4}, {1e-5, 2e-5, 3e-5}});
  const mat3 R = matrix_of(start.q);
  assert_near(start.p + R * a.filter->moved().p, a.filter->pose().p, 1e-12);
  const int moved = a.filter->at(kMovedPlace);
  const auto block = [&](int row, int column) {
    mat3 out;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) out.m[i][j] = a.filter->covariance(row + i, column + j);
    return out;
  };
  for (int row = 0; row < 6; row += 3)
    for (int column = 0; column < 6; column += 3) {
      const mat3 own = R * (block(moved + row, moved + column) * transposed(R)),
                 crossed = block(row, moved + column) * transposed(R);
      const mat3 pose = block(row, column);
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
          TEST_ASSERT_DOUBLE_WITHIN(1e-14, pose.m[i][j], own.m[i][j]);
          TEST_ASSERT_DOUBLE_WITHIN(1e-14, pose.m[i][j], crossed.m[i][j]);
        }
    }
  const double scale = a.filter->variance(a.filter->at(kVelocityScale));
  for (int i = 0; i < 50; i++) {
    row_block seen;
    const int way = seen.add_columns(moved, 1), error = seen.add_columns(a.filter->at(kPictureScale), 1);
    const int row = seen.add_row(WM_RESIDUAL_X, 0.05, 0.05, 1e-6);
    seen.by[row][way] = 1;
    seen.by[row][error] = a.filter->moved().p.x;
    TEST_ASSERT_TRUE(a.filter->fuse(seen, {1e9, 1e9}).fused);
  }
  a.filter->settle();
  TEST_ASSERT_EQUAL_DOUBLE(square(0.02), a.filter->variance(a.filter->at(kPictureScale)));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, a.filter->head1(kPictureScale, 1));
  const double left = a.filter->variance(a.filter->at(kVelocityScale));
  TEST_ASSERT_TRUE(left < scale);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.4 * scale, left);
}

// One block of rows against the textbook's dense update; then points added, removed and their correlations.
TEST(test_an_update_is_kalmans) {
  machine m(kNone, 8);
  double covariance[6][6];
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) {
      covariance[i][j] = i == j ? 0.02 : 0.0;
      for (int k = 0; k < 3; k++) covariance[i][j] += 0.01 * normal(10 * k + i) * normal(10 * k + j);
    }
  m.filter->set_pose({{1, 2, 3}, turn_by({0.1, 0.2, 0.3})}, covariance);
  row_block see;
  see.rows = 3;
  see.add_columns(kPlace, 3);
  see.add_columns(kTurn, 3);
  const mat3 A = transposed(m.filter->R());
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 6; j++) see.by[i][j] = j < 3 ? -A.m[i][j] : normal(100 + 6 * i + j);
  for (int k = 0; k < 3; k++) m.filter->add_point(random_vec(50 + k), see, A, 0.01 * kIdentity3);
  TEST_ASSERT_EQUAL(3, m.filter->point_count());
  const int n = m.filter->states();
  TEST_ASSERT_EQUAL(15, n);
  row_block rows;
  rows.rows = 4;
  rows.add_columns(kPlace, 3);
  rows.add_columns(kTurn, 3);
  rows.add_columns(m.filter->point_state(1), 3);
  double P[15][15], H[4][15] = {}, x[15] = {};
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) P[i][j] = m.filter->covariance(i, j);
  for (int k = 0; k < 4; k++) {
    for (int c = 0; c < rows.columns; c++) H[k][rows.index[c]] = rows.by[k][c] = normal(300 + 20 * k + c);
    rows.innovation[k] = 0.1 * normal(400 + k);
    rows.noise[k] = 0.1 + 0.05 * k;
  }
  // One number after the other: the same as all at once.
  for (int k = 0; k < 4; k++) {
    double g[15] = {};
    double s = rows.noise[k], nu = rows.innovation[k];
    for (int i = 0; i < n; i++) {
      for (int j = 0; j < n; j++) g[i] += P[i][j] * H[k][j];
      nu -= H[k][i] * x[i];
    }
    for (int i = 0; i < n; i++) s += H[k][i] * g[i];
    for (int i = 0; i < n; i++) {
      x[i] += g[i] / s * nu;
      for (int j = 0; j < n; j++) P[i][j] -= g[i] * g[j] / s;
    }
  }
  const row_verdict verdict = m.filter->fuse(rows, {1e9, 1e9});
  TEST_ASSERT_TRUE(verdict.fused);
  for (int i = 0; i < n; i++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, x[i], m.filter->pending1(i));
    for (int j = 0; j < n; j++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, P[i][j], m.filter->covariance(i, j));
  }
  // A row beyond the gate refuses all and changes nothing.
  rows.innovation[3] = 100.0;
  TEST_ASSERT_FALSE(m.filter->fuse(rows, {7, 20}).fused);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, x[0], m.filter->pending1(0));
  // The first point leaves; the last takes its place with all that it shares.
  const int last = m.filter->point_state(2);
  double shared[3], between[3];
  for (int i = 0; i < 3; i++) {
    shared[i] = m.filter->covariance(1, last + i);
    between[i] = m.filter->covariance(m.filter->point_state(1), last + i);
  }
  m.filter->remove_point(0);
  TEST_ASSERT_EQUAL(2, m.filter->point_count());
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL_DOUBLE(shared[i], m.filter->covariance(1, m.filter->point_state(0) + i));
    TEST_ASSERT_EQUAL_DOUBLE(between[i], m.filter->covariance(m.filter->point_state(1), m.filter->point_state(0) + i));
  }
}

// A block has room for kColumns columns: more are counted and the block is refused, and nothing beyond is written.
TEST(test_a_block_with_too_many_columns_is_refused) {
  machine m(kNone, 8);
  double covariance[6][6] = {};
  for (int i = 0; i < 6; i++) covariance[i][i] = 0.01;
  m.filter->set_pose({{1, 2, 3}, kNoTurn}, covariance);
  row_block block;
  block.rows = 1;
  block.innovation[0] = 0.01;
  block.noise[0] = 0.01;
  for (int k = 0; k < 40; k++) {
    const int column = block.add_columns(0, 3);
    for (int i = 0; i < 3; i++) block.by[0][column + i] = 1.0;
  }
  TEST_ASSERT_LESS_OR_EQUAL(row_block::kColumns, block.columns);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, block.innovation[0]);
  TEST_ASSERT_FALSE(m.filter->fuse(block, {7, 20}).fused);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, m.filter->variance(0));
}

// A scene turned and moved as a whole looks the same: no update may make the filter surer of such a motion. Nor of how
// the camera is mounted, or when it looks, from pictures alone: the vehicle's pose makes up for either. With points
// that are seen again and again and move by many corrections, these variances must stay what they were.
TEST(test_what_cannot_be_seen_is_not_learnt) {
  const head_state nothing = kHeadStates;
  for (const head_state which : {nothing, kCameraRotation, kTimeOffset}) {
    const double sigma = which == kCameraRotation ? 0.02 : 0.05;
    head_model models[kHeadStates] = {};
    if (which != nothing) models[which] = {sigma, 0, 0};
    machine m(models, 4);
    const mat3 axes = {{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}};
    m.filter->set_camera_axes(axes);
    const vec3 v = {0.3, 0.1, 0}, w = {0.2, -0.1, 0.3};
    double covariance[6][6] = {};
    for (int i = 0; i < 6; i++) covariance[i][i] = i < 3 ? 1e-2 : 1e-3;
    m.filter->set_pose({{5, -3, 2}, turn_by({0.1, 0.2, 0.3})}, covariance);
    const vec3 truth[4] = {{8, -3, 2}, {7, -1, 2.5}, {8, -4, 1}, {6, -3, 4}};
    int draw = 9000;
    for (int step = 0; step < 60; step++) {
      const double late_s = m.filter->head1(kTimeOffset, 0.0);
      const mat3 R = m.filter->R() * matrix_of(turn_by(-late_s * w));
      const vec3 at = m.filter->nominal().p - R * (late_s * v);
      const mat3 B = axes * matrix_of(turn_by(m.filter->head3(kCameraRotation)));
      const mat3 A = transposed(B) * transposed(R);
      m.filter->set_turn_rate(w);
      for (int k = 0; k < 4; k++) {
        const bool fresh = step == 0;
        const vec3 l = fresh ? truth[k] : m.filter->point(k);
        const vec3 in_body = transposed_times(R, l - at);
        row_block rows;
        rows.rows = 3;
        rows.add_columns(kPlace, 3);
        rows.add_columns(kTurn, 3);
        const int own = which == nothing ? 0 : rows.add_columns(m.filter->at(which), which == kCameraRotation ? 3 : 1);
        const mat3 turn = A * skew(l - m.filter->nominal().p), by_camera = skew(transposed_times(B, in_body));
        const vec3 by_time = transposed_times(B, cross(w, in_body) + v);
        for (int i = 0; i < 3; i++) {
          for (int j = 0; j < 3; j++) {
            rows.by[i][j] = -A.m[i][j];
            rows.by[i][3 + j] = turn.m[i][j];
            if (which == kCameraRotation) rows.by[i][own + j] = by_camera.m[i][j];
          }
          if (which == kTimeOffset) rows.by[i][own] = by_time[i];
        }
        if (fresh) {
          m.filter->add_point(l, rows, A, 1e-4 * kIdentity3);
          continue;
        }
        const int of_point = rows.add_columns(m.filter->point_state(k), 3);
        for (int i = 0; i < 3; i++) {
          for (int j = 0; j < 3; j++) rows.by[i][of_point + j] = A.m[i][j];
          rows.innovation[i] = 0.05 * normal(draw++);
          rows.noise[i] = 1e-4;
        }
        TEST_ASSERT_TRUE(m.filter->fuse(rows, {1e9, 1e9}).fused);
      }
      m.filter->settle();
      const double walk = which == nothing ? 1e-6 : 1;  // else the motion has nearly no weight
      m.filter->propagate({0.1, v, w, {walk, walk, walk}, {walk, walk, walk}});
    }
    if (which == nothing)
      for (int i = 0; i < 3; i++) TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.999e-3, m.filter->variance(kTurn + i));
    if (which == nothing) continue;
    const int state = m.filter->at(which);
    for (int i = 0; i < kHeadSpecs[which].width; i++)
      TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.98 * sigma, std::sqrt(m.filter->variance(state + i)));
  }
}

TEST(test_orientation_is_found_with_a_third_wrong) {
  for (int trial = 0; trial < 50; trial++) {
    auto consensus = std::make_unique<pose_consensus>();
    consensus->clear();
    const pose3 map_odom = {10.0 * random_vec(10 + trial), turn_by(random_vec(900 + trial))};
    const mat3 R = matrix_of(map_odom.q);
    for (int i = 0; i < 12; i++) {
      const vec3 seen = 3.0 * random_vec(2000 + 50 * trial + i);
      vec3 place = map_odom.p + R * seen + 0.01 * random_vec(40000 + 50 * trial + i);
      if (i % 3 == 0) place = place + 5.0 * random_vec(70000 + 50 * trial + i);
      consensus->add({i, i, seen, place, 0.02, 0, 0});
    }
    const pose3 odom = {{1, 2, 3}, turn_by({0.3, 0.2, 0.1})};
    const pose_found found = consensus->find(0, {odom, 0, 0}, 0.5, 0.25, static_cast<uint64_t>(trial));
    TEST_ASSERT_TRUE(found.found);
    assert_near(map_odom.p + R * odom.p, found.pose.p, 0.05);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, length(turn_of(found.pose.q * conjugate(map_odom.q * odom.q))));
  }
}

TEST(test_no_orientation_of_a_line_or_of_contradictions) {
  auto consensus = std::make_unique<pose_consensus>();
  consensus->clear();
  for (int i = 0; i < 12; i++) consensus->add({i, i, {1.0 * i, 0, 0}, {0, 1.0 * i, 0}, 0.02, 0, 0});
  TEST_ASSERT_FALSE(consensus->find(0, {{{0, 0, 0}, kNoTurn}, 0, 0}, 0.5, 0.25, 1).found);
  consensus->clear();
  for (int i = 0; i < 12; i++) consensus->add({i, i, random_vec(i), 5.0 * random_vec(100 + i), 0.02, 0, 0});
  TEST_ASSERT_FALSE(consensus->find(0, {{{0, 0, 0}, kNoTurn}, 0, 0}, 0.5, 0.25, 1).found);
}

// A leap that no body makes is refused where a limit is stated; 0 states none.
TEST(test_leaps_of_a_twist_are_refused_by_their_limit) {
  static wm::spatial_history history;
  for (const double mps2 : {0.0, 20.0})
    for (const double radps2 : {0.0, 30.0}) {
      history.init({0.25, 2.0, 1, mps2, radps2});
      wm_time_ns t_ns = 0;
      const auto feed = [&](double v_mps, double w_radps) {
        t_ns += 100 * WM_NS_PER_MS;
        return history.feed(t_ns, {{v_mps, 0, 0}, {0, 0, w_radps}});
      };
      for (int i = 0; i < 10; i++) TEST_ASSERT_TRUE(feed(1.0 + 0.01 * (i % 3), 0.1 + 0.01 * (i % 2)));
      TEST_ASSERT_EQUAL(mps2 == 0.0, feed(200.0, 0.1));
      for (int i = 0; i < 10; i++) (void)feed(1.0 + 0.01 * (i % 3), 0.1 + 0.01 * (i % 2));
      TEST_ASSERT_EQUAL(radps2 == 0.0, feed(1.0, 200.0));
      TEST_ASSERT_EQUAL(mps2 == 0.0 && radps2 == 0.0, history.outliers() == 0);
    }
}

// What was in the memory before is of no effect: the same events give the same bytes.
TEST(test_motion_in_space_begins_the_same_in_any_memory) {
  wm_motion_params params;
  wm_wheels wheels{};
  wm_params_defaults(&wm_motion_params_table, &params);
  alignas(64) static unsigned char memory[2][sizeof(wm::spatial_motion)];
  for (int i = 0; i < 2; i++) {
    std::memset(memory[i], i == 0 ? 0x00 : 0xa5, sizeof memory[i]);
    auto *motion = new (memory[i]) wm::spatial_motion;
    motion->init(&params, &wheels, {{0.1, 0.1, 0.1}, {0.01, 0.01, 0.01}, 0.05, 0.05});
  }
  TEST_ASSERT_EQUAL_MEMORY(memory[0], memory[1], sizeof memory[0]);
}
