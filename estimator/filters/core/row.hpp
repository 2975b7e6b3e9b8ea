// SPDX-License-Identifier: Apache-2.0
// A row of a measurement's Jacobian, of which few entries are not zero.
#ifndef WAYMARK_ESTIMATOR_CORE_ROW_HPP
#define WAYMARK_ESTIMATOR_CORE_ROW_HPP

namespace wm {

// `kCapacity` entries: the filter derives it from its table of states and asserts it. An entry beyond it is counted in
// `missing` rather than written; a row with missing entries must not be fused (WM_REJECTED_NUMERIC). A state may stand
// in a row twice; the entries add up.
template <int kCapacity>
struct jacobian_row {
  static constexpr int kMax = kCapacity;
  int count = 0, missing = 0;
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
    for (int i = 0; i < other.count; i++) add(other.index[i], factor * other.by[i]);
  }
};

}  // namespace wm

#endif
