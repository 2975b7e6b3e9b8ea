// SPDX-License-Identifier: Apache-2.0
// The slots of a table's states in a filter's state vector, of each owner (a sensor, a camera) one a row.
#ifndef WAYMARK_ESTIMATOR_CORE_STATE_SLOTS_HPP
#define WAYMARK_ESTIMATOR_CORE_STATE_SLOTS_HPP

#include <cmath>

#include "filters/core/calibration_list.hpp"

namespace wm {

template <int kOwners, int kRows>
class state_slots {
 public:
  // add(owner, row) appends a state to the filter and returns its index, or -1 where the row is off.
  template <class Add>
  void init(int owners, Add add) {
    for (int i = 0; i < kOwners; i++)
      for (int k = 0; k < kRows; k++) slot_[i][k] = i < owners ? add(i, k) : -1;
  }

  int at(int owner, int row) const { return slot_[owner][row]; }  // -1: off

  // The owner's values and sigmas; name(row) is what stands behind `whose` in the list.
  template <class Filter, class Name>
  void list(int owner, const char *whose, const Filter &filter, Name name, calibration_list *out) const {
    for (int k = 0; k < kRows; k++)
      if (const int slot = slot_[owner][k]; slot >= 0)
        out->add(whose, name(k), filter.value(slot), std::sqrt(filter.variance(slot)));
  }

 private:
  int slot_[kOwners][kRows];
};

}  // namespace wm

#endif
