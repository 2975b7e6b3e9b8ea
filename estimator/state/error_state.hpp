// SPDX-License-Identifier: Apache-2.0
// The error state of a Kalman filter, and all that filters do with it: the mean, one covariance (the upper half) and
// scratch memory, in one block. What a state means, how it moves and how a correction moves the mean on its manifold
// is the filter's.
//
// Three operations change the covariance.
//  - assign(): states become linear functions of the state plus noise, x_M <- F x + w. That is prediction (F has a row
//    for each state that moves), a step of a Gauss-Markov process, a clone, a new landmark or point.
//  - correct(): P - W W' with W = P H' L'^-1, S = L L'; of states that are considered and not corrected [Schmidt1966]
//    the covariance stays, which is Joseph's form for the gain without their rows.
//  - the transport of an invariant filter [Barrau2015], P <- T P T' with T = I + sum of e h', in the same pass.
//
// A state with variance 0 is known: its row and column are 0 and no operation passes over them. So states that wait for
// their use cost nothing.
#ifndef WAYMARK_ESTIMATOR_STATE_ERROR_STATE_HPP
#define WAYMARK_ESTIMATOR_STATE_ERROR_STATE_HPP

#include <cstddef>
#include <cstdint>

#include "math/half_covariance.hpp"
#include "state/innovation.hpp"
#include "state/row.hpp"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

struct state_shape {
  int capacity;     // of states
  int rows, turns;  // vectors of scratch memory: a gain for each row, e and r for each turn of a transport
  int dense_from;   // states from here on always have a variance: landmarks
  static constexpr int vectors(int rows, int turns) { return 1 + rows + 2 * turns; }  // the mean, too
};

// The states that an update corrects, in ascending order; others are considered.
using moving_states = span_list<100>;

class error_state {
 public:
  static constexpr size_t doubles(int capacity, int rows, int turns) {
    return half_covariance::doubles(even(capacity)) +
           static_cast<size_t>(even(capacity)) * static_cast<size_t>(state_shape::vectors(rows, turns));
  }
  // `memory` is 16-byte aligned and lies in the same block of memory as *this, at a distance that copies keep; its
  // doubles(): at least one turn's, of which updates take the vectors.
  void init(const state_shape &shape, double *memory);

  // ---- read ----
  int states() const { return n_; }
  double value(int state) const { return mean()[state]; }
  const double *mean() const { return memory_.get(); }
  double covariance(int i, int j) const { return p().at(i, j); }
  double variance(int state) const { return p().row(state)[state]; }
  const double *covariance_row(int state) const { return p().row(state); }  // from column `state` on
  double covariance_of(const sparse_row &a, const sparse_row &b) const;     // a P b', without a pass over the state
  double variance_of(const sparse_row &row) const { return covariance_of(row, row); }
  static double dot(const sparse_row &row, const double *vector);

  // ---- change ----
  // Between solve() and correct() the mean alone may change.
  double *mean() { return generation_++, memory_.get(); }
  void set_value(int state, double value) { mean()[state] = value; }
  void set_covariance(int i, int j, double value) {
    touch();
    if (i == j) filled_.count = 0;
    p().set(i, j, value);
  }
  void add_variance(int state, double added) {
    touch();
    if (variance(state) == 0.0) filled_.count = 0;
    p().row(state)[state] += added;
  }
  void add_covariance(int i, int j, double value) { set_covariance(i, j, covariance(i, j) + value); }
  // `count` states behind the others, with variance 0; returns the first. There must be room.
  int append(int count);
  // The last `count` states take the place of those from `first` on, and leave theirs.
  void remove(int first, int count);
  void truncate(int states);  // those behind leave
  // State i from `first` on goes to to(i), which ascends and is not below i. There are `states` states behind it; those
  // that none has gone to have variance 0. From `dense_from` on each has a variance.
  template <class To>
  void spread(int first, int states, int dense_from, To to);
  // The states from `first` on become independent of all others, with this variance.
  void forget(int first, int count, double variance);
  // The up to kAssigned states from `first` on become rows[k] of the state plus noise, upper triangle
  // noise[k * stride + l], with those values. A row's entry of its own state comes first; of the others of the block it
  // has those behind its own alone.
  static constexpr int kAssigned = 12;
  void assign(int first, int count, const sparse_row *rows, const double *noise, int stride, const double *values);
  template <class Row>
  void assign_rows(int first, int count, const Row *rows, const double *noise, int stride, const double *values) {
    sparse_row views[kAssigned];
    for (int k = 0; k < count; k++) views[k] = rows[k];
    assign(first, count, views, noise, stride, values);
  }
  void assign(int state, const sparse_row &row, double variance, double value) {
    assign(state, 1, &row, &variance, 0, &value);
  }
  // x := factor x + noise, for a state that no other one's motion depends on.
  void fade(int state, double factor, double added_variance);
  // The first `count` states are those of `from`, independent of the others, which stay.
  void take_up(const error_state &from, int count);
  // Scales the sigmas of these states; correlations remain.
  void scale(int first, int count, double factor);
  // P += share d d', d = of(state).
  template <class Of>
  void add_spread(double share, Of of);
  // Takes back an observation of the row's value that was fused with this variance; `off`: the value now less what was
  // observed. Nothing changes where the state is less certain than the observation.
  void take_back(const sparse_row &row, double off, double variance);
  // Covariance of a mixture: with this probability, the states differ by `off`, `states()` doubles.
  void add_chance(double probability, const double *off);

  // ---- correct ----
  // P H' of up to innovation::kRows rows, S and NIS.
  innovation prepare(const sparse_row *rows, const double *innovations, const double *noise, int count);
  // By how much the update by a first row will change a state.
  double change_of(int state, const innovation &i) const {
    return i.generation_ == generation_ ? gain(0)[state] * i.value[0] / i.s[0][0] : 0.0;
  }
  // The states but those from `from` up to `to`.
  moving_states all_but(int from, int to) const;
  // First half of an update: W in place of the gains, and step() = W L^-1 innovation of the states that move.
  // `added_noise` of each row, on top of what was prepared; null: none. False: it is stale, or S is not positive
  // definite; the update is refused.
  [[nodiscard]] bool solve(innovation *i, const double *added_noise);
  [[nodiscard]] bool solve(innovation *i, const double *added_noise, const moving_states &moving);
  double *step() { return vector(rows_ + turns_); }               // what the mean is to be corrected by
  double gain_of(int state, const innovation &i, int row) const;  // Kalman gain of one row after the other
  // Column `state` of the covariance that this update will leave, into displacement(0).
  const double *column_left(const innovation &i, int state);
  // Second half: the covariance. With `turns`, T = I + sum of displacement(k) turns[k]; null: without.
  void correct(innovation &&i, const sparse_row *turns = nullptr, int turn_count = 0);
  void correct(innovation &&i, const moving_states &moving);
  double *displacement(int turn) { return vector(rows_ + turn); }
  // The transport alone.
  void transport(const sparse_row *turns, int count) { pass(0, filled(), turns, count); }

 private:
  half_covariance p() { return {memory_.get() + vectors_end(), capacity_}; }
  half_view p() const { return {memory_.get() + vectors_end(), capacity_}; }
  size_t vectors_end() const {
    return static_cast<size_t>(capacity_) * static_cast<size_t>(state_shape::vectors(rows_, turns_));
  }
  double *vector(int k) { return memory_.get() + static_cast<size_t>(1 + k) * static_cast<size_t>(capacity_); }
  const double *gain(int k) const {
    return memory_.get() + static_cast<size_t>(1 + k) * static_cast<size_t>(capacity_);
  }
  void touch() { generation_++, solved_ = 0; }
  void correct_moving(const innovation &i, const moving_states &moving);
  bool is_solved(const innovation &i) const { return i.generation_ != 0 && i.generation_ == solved_; }
  const filled_states &filled();
  filled_states reached(const filled_states &of, int rows) const;
  half_view cov_view() const { return p(); }
  double covariance_with(const sparse_row &row, int state) const;
  void project(const sparse_row &row, const filled_states &of, double *out) const;
  void pass(int rows, const filled_states &of, const sparse_row *turns, int turn_count);
  void apply_spread();
  void scale_one(int state, double factor, double added_variance);
  struct around;
  void assign_outside(const sparse_row &by, int state, int begin, const around &others);
  double assigned(const sparse_row &by, int first, int count, int k, const double block[kAssigned][kAssigned]) const;

  relative_array<double> memory_;                     // the mean; gains, displacements e, vectors r; the covariance
  uint64_t generation_;                               // of the state, counted from 1
  uint64_t solved_;                                   // of the innovation whose W the gains are; 0: none
  int32_t n_, capacity_, dense_from_, rows_, turns_;  // no padding: the same events must give the same bytes
  filled_states filled_;                              // none: to be found anew
};

template <class Of>
void error_state::add_spread(double share, Of of) {
  double *e = displacement(0), *r = step();
  for (int j = 0; j < even(n_); j++) {
    r[j] = j < n_ ? of(j) : 0.0;
    e[j] = 0.5 * share * r[j];
  }
  apply_spread();
}

// The last one goes first, so that no element is overwritten unread.
template <class To>
void error_state::spread(int first, int states, int dense_from, To to) {
  const int old = n_;
  touch();
  n_ = states;
  filled_.count = 0;
  dense_from_ = even(dense_from);
  half_covariance cov = p();
  for (int i = old - 1; i >= 0; i--)
    for (int j = old - 1; j >= i && j >= first; j--) cov.set(i < first ? i : to(i), to(j), cov.at(i, j));
  for (int i = old - 1; i >= first; i--) mean()[to(i)] = value(i);
  int next = first;
  for (int i = first; i < old; i++) {
    for (; next < to(i); next++) forget(next, 1, 0.0), mean()[next] = 0.0;
    next++;
  }
  for (; next < states; next++) forget(next, 1, 0.0), mean()[next] = 0.0;
}

}  // namespace wm

#endif
