// SPDX-License-Identifier: Apache-2.0
#include "waymark/event.h"

_Static_assert(sizeof(wm_quantities) <= 96 && sizeof(wm_twist6) <= 96 && sizeof(wm_increment) <= 96 &&
                   sizeof(wm_set_pose) <= 96 && sizeof(wm_sighting) <= 96 && sizeof(wm_marker) <= 96,
               "all but points fit into a small event");

size_t wm_event_bytes(const wm_event *event) {
  if (event->kind != WM_EVENT_POINTS) return WM_EVENT_SMALL_BYTES;
  return sizeof(wm_event);
}
