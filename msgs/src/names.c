// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/pose.h"

static const char *const kKinds[] = {"none",   "quantities", "twist2", "twist6", "sighting", "position", "heading",
                                     "marker", "stereo",     "points", "looked", "set_pose", "reset"};
static const char *const kQuantities[] = {"wheel_ticks_left",       "wheel_ticks_right",
                                          "wheel_speed_front_left", "wheel_speed_front_right",
                                          "wheel_speed_rear_left",  "wheel_speed_rear_right",
                                          "vehicle_speed",          "yaw_rate",
                                          "steering_wheel",         "road_wheel",
                                          "steering_actuator",      "gear"};
static const char *const kStates[] = {"searching", "tracking", "dead_reckoning", "lost"};
static const char *const kResiduals[] = {"bearing", "range", "x", "y", "z", "heading", "standstill", "pixel"};
static const char *const kVerdicts[] = {"fused",      "gate",     "unknown_id", "no_association", "out_of_range",
                                        "not_finite", "singular", "searching",  "by_config"};
static const char *const kDeviceStates[] = {"",        "works",   "absent", "down", "error-passive",
                                            "bus-off", "stalled", "frozen"};

#define COUNT(a) (sizeof(a) / sizeof((a)[0]))
_Static_assert(COUNT(kKinds) == WM_EVENT_KIND_COUNT, "a name for each kind");
_Static_assert(COUNT(kQuantities) == WM_Q_COUNT, "a name for each quantity");
_Static_assert(COUNT(kResiduals) == WM_RESIDUAL_COUNT, "a name for each residual");
_Static_assert(COUNT(kVerdicts) == WM_VERDICT_COUNT, "a name for each verdict");
_Static_assert(COUNT(kDeviceStates) == WM_DEVICE_STATE_COUNT, "a name for each device state");

const char *wm_event_kind_name(unsigned kind) { return kind < COUNT(kKinds) ? kKinds[kind] : "?"; }
const char *wm_quantity_name(unsigned q) { return q < COUNT(kQuantities) ? kQuantities[q] : "?"; }
const char *wm_state_name(unsigned state) { return state < COUNT(kStates) ? kStates[state] : "?"; }
const char *wm_residual_name(unsigned r) { return r < COUNT(kResiduals) ? kResiduals[r] : "?"; }
const char *wm_verdict_name(unsigned v) { return v < COUNT(kVerdicts) ? kVerdicts[v] : "?"; }
const char *wm_device_state_name(unsigned s) { return s < COUNT(kDeviceStates) ? kDeviceStates[s] : "?"; }

int wm_quantity_find(const char *name) {
  for (unsigned i = 0; i < COUNT(kQuantities); i++)
    if (strcmp(name, kQuantities[i]) == 0) return (int)i;
  return -1;
}
