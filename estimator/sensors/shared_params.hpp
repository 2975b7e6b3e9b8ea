// SPDX-License-Identifier: Apache-2.0
// Parameters of the sections `positions`, `markers` and `localizer`: those of the setup, or where it states none the
// defaults.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SHARED_PARAMS_HPP
#define WAYMARK_ESTIMATOR_SENSORS_SHARED_PARAMS_HPP

#include "sensors/localizer_params.h"
#include "sensors/marker_params.h"
#include "sensors/position_params.h"

namespace wm {

template <class T>
T stated_or_default(const T *stated, const wm_param_table &table) {
  if (stated != nullptr) return *stated;
  T out;
  wm_params_defaults(&table, &out);
  return out;
}
inline wm_position_params position_params_of(const wm_setup &setup) {
  return stated_or_default(setup.positions, wm_position_params_table);
}
inline wm_localizer_params localizer_params_of(const wm_setup &setup) {
  return stated_or_default(setup.localizer, wm_localizer_params_table);
}
inline wm_marker_params marker_params_of(const wm_setup &setup) {
  return stated_or_default(setup.markers, wm_marker_params_table);
}

}  // namespace wm

#endif
