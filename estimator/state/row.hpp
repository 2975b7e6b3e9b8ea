// SPDX-License-Identifier: Apache-2.0
// A row of a Jacobian, of which few entries are not zero.
#ifndef WAYMARK_ESTIMATOR_STATE_ROW_HPP
#define WAYMARK_ESTIMATOR_STATE_ROW_HPP

namespace wm {

// A view of such a row. An entry of 0 counts nothing; a state may stand in a row twice, and the entries add up.
struct sparse_row {
  const int *index;  // states
  const double *by;  // derivatives
  int count;
  int missing = 0;  // entries that had no room: a row with missing entries must not be fused (WM_REJECTED_NUMERIC)
  int delay = -1;   // the state of how much older the observation is than its stamp; -1: none
};

// `kCapacity` entries: the filter derives it from its table of states and asserts it. An entry beyond it is counted in
// `missing` rather than written.
template <int kCapacity>
struct jacobian_row {
  static constexpr int kMax = kCapacity;
  int count = 0, missing = 0, delay = -1;
  int index[kCapacity];
  double by[kCapacity];

  // `state` < 0: the cause is not a state, or its state is off.
  void add(int state, double derivative) {
    if (state < 0 || derivative == 0.0) return;
    if (count == kCapacity) {
      missing++;
      return;
    }
    index[count] = state;
    by[count] = derivative;
    count++;
  }
  template <int kOther>
  void add(const jacobian_row<kOther> &other, double factor) {
    missing += other.missing;
    if (other.delay >= 0) delay = other.delay;
    for (int i = 0; i < other.count; i++) add(other.index[i], factor * other.by[i]);
  }
  operator sparse_row() const { return {index, by, count, missing, delay}; }
};

}  // namespace wm

#endif
