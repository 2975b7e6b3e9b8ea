// SPDX-License-Identifier: Apache-2.0
// What all detectors share.
#ifndef WAYMARK_ESTIMATOR_VISION_DETECTOR_HPP
#define WAYMARK_ESTIMATOR_VISION_DETECTOR_HPP

#include <cstring>

#include "waymark/detector.h"

namespace wm {

// The first camera of a view; NULL and the reason where the calibration has none of this index.
inline const wm_camera *first_camera(const wm_view *view, const char **why) {
  const int32_t index = view->cameras[0];
  const bool exists = view->rig && index >= 0 && index < static_cast<int32_t>(view->rig->camera_count);
  *why = exists ? nullptr : "there is no such camera";
  return exists ? &view->rig->cameras[index] : nullptr;
}

// Sorts events of small kinds (WM_EVENT_SMALL_BYTES) by time, in place and stable. Insertion: nearly in order already.
inline void sort_events(wm_event *events, size_t count) {
  alignas(wm_event) uint8_t moved[WM_EVENT_SMALL_BYTES];
  for (size_t i = 1; i < count; i++) {
    const wm_time_ns t_ns = events[i].t_ns;
    std::memcpy(moved, &events[i], sizeof moved);
    size_t at = i;
    for (; at > 0 && events[at - 1].t_ns > t_ns; at--) std::memcpy(&events[at], &events[at - 1], sizeof moved);
    std::memcpy(&events[at], moved, sizeof moved);
  }
}

}  // namespace wm

#endif
