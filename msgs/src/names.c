// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "waymark/bound.h"
#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/look.h"
#include "waymark/pose.h"

static const char *const kQuantities[] = {"wheel_ticks_left",
                                          "wheel_ticks_right",
                                          "wheel_speed_front_left",
                                          "wheel_speed_front_right",
                                          "wheel_speed_rear_left",
                                          "wheel_speed_rear_right",
                                          "vehicle_speed",
                                          "yaw_rate",
                                          "steering_wheel",
                                          "road_wheel",
                                          "steering_actuator",
                                          "gear",
                                          "roll_rate",
                                          "pitch_rate",
                                          "acceleration_x",
                                          "acceleration_y",
                                          "acceleration_z"};
static const char *const kStates[] = {"searching", "tracking", "dead_reckoning", "lost", "degraded"};
static const char *const kCauses[] = {"",           "contradicted",       "refused", "inconsistent", "biased",
                                      "lost_again", "unknown_identities", "silent",  "off_map",      "turn",
                                      "floor"};
static const char *const kUnusable[] = {"", "no_pose", "unmonitored", "doubt", "untested", "position", "heading"};
static const char *const kResiduals[] = {"bearing", "range",      "x",     "y",        "z",
                                         "heading", "standstill", "pixel", "elevation"};
static const char *const kVerdicts[] = {"fused",      "gate",     "unknown_id", "no_association", "out_of_range",
                                        "not_finite", "singular", "searching",  "by_config",      "numeric"};
static const char *const kAlarms[] = {"noise", "scale", "lengths", "lasting_error", "turn", "stated", "localizer"};
static const char *const kCounters[] = {"landmarks",       "landmarks_added",   "landmarks_removed",
                                        "landmarks_moved", "landmarks_merged",  "identities_ambiguous",
                                        "map_full",        "rotation_outliers", "motion_outliers",
                                        "relocalizations", "aliased_poses",     "explained_permille"};
static const char *const kDeviceStates[] = {"",        "works",   "absent", "down", "error-passive",
                                            "bus-off", "stalled", "frozen"};

static const char *const kLooks[] = {"found",        "not_in_view", "faces_away", "too_small", "uncertain",
                                     "low_contrast", "blurred",     "unlike",     "ambiguous"};

#define COUNT(a) (sizeof(a) / sizeof((a)[0]))
_Static_assert(COUNT(kQuantities) == WM_Q_COUNT, "a name for each quantity");
_Static_assert(COUNT(kStates) == WM_STATE_COUNT, "a name for each state");
_Static_assert(COUNT(kCauses) == WM_CAUSE_COUNT, "a name for each cause");
_Static_assert(COUNT(kUnusable) == WM_UNUSABLE_COUNT, "a name for each reason");
_Static_assert(COUNT(kResiduals) == WM_RESIDUAL_COUNT, "a name for each residual");
_Static_assert(COUNT(kVerdicts) == WM_VERDICT_COUNT, "a name for each verdict");
_Static_assert(COUNT(kCounters) == WM_COUNTER_KIND_COUNT, "a name for each counter");
_Static_assert(COUNT(kDeviceStates) == WM_DEVICE_STATE_COUNT, "a name for each device state");
_Static_assert(COUNT(kLooks) == WM_LOOK_COUNT, "a name for each look");

const char *wm_quantity_name(unsigned q) { return q < COUNT(kQuantities) ? kQuantities[q] : "?"; }
const char *wm_state_name(unsigned state) { return state < COUNT(kStates) ? kStates[state] : "?"; }
const char *wm_cause_name(unsigned cause) { return cause < COUNT(kCauses) ? kCauses[cause] : "?"; }
const char *wm_unusable_name(unsigned why) { return why < COUNT(kUnusable) ? kUnusable[why] : "?"; }
const char *wm_residual_name(unsigned r) { return r < COUNT(kResiduals) ? kResiduals[r] : "?"; }
const char *wm_verdict_name(unsigned v) { return v < COUNT(kVerdicts) ? kVerdicts[v] : "?"; }
const char *wm_alarm_name(unsigned kind) { return kind < COUNT(kAlarms) ? kAlarms[kind] : "?"; }
const char *wm_counter_name(unsigned kind) { return kind < COUNT(kCounters) ? kCounters[kind] : "?"; }
const char *wm_device_state_name(unsigned s) { return s < COUNT(kDeviceStates) ? kDeviceStates[s] : "?"; }

const char *wm_look_name(unsigned look) { return look < COUNT(kLooks) ? kLooks[look] : "?"; }

// "12 not in view", behind `before`.
static size_t put_count(char *out, size_t used, size_t capacity, const char *before, uint64_t count, const char *name) {
  int more = used < capacity ? snprintf(out + used, capacity - used, "%s%" PRIu64 " ", before, count) : 0;
  if (more > 0) used += (size_t)more;
  for (; *name && used + 1 < capacity; name++) out[used++] = *name == '_' ? ' ' : *name;
  if (used >= capacity) used = capacity - 1;
  out[used] = '\0';
  return used;
}

size_t wm_looks_text(const uint64_t looks[WM_LOOK_COUNT], char *out, size_t capacity) {
  uint64_t expected = 0, all = 0;
  size_t used = 0;
  if (capacity == 0) return 0;
  out[0] = '\0';
  for (unsigned i = 0; i < WM_LOOK_COUNT; i++) {
    all += looks[i];
    if (wm_look_is_expected(i)) expected += looks[i];
  }
  if (all == 0) return 0;
  int head = snprintf(out, capacity, "expected %" PRIu64 ": %" PRIu64 " found", expected, looks[WM_LOOK_FOUND]);
  used = head > 0 && (size_t)head < capacity ? (size_t)head : capacity - 1;
  for (unsigned i = 1; i < WM_LOOK_COUNT; i++)
    if (looks[i] > 0 && wm_look_is_expected(i)) used = put_count(out, used, capacity, ", ", looks[i], wm_look_name(i));
  const char *before = "; else ";
  for (unsigned i = 1; i < WM_LOOK_COUNT; i++) {
    if (looks[i] == 0 || wm_look_is_expected(i)) continue;
    used = put_count(out, used, capacity, before, looks[i], wm_look_name(i));
    before = ", ";
  }
  return used;
}

int wm_quantity_find(const char *name) {
  for (unsigned i = 0; i < COUNT(kQuantities); i++)
    if (strcmp(name, kQuantities[i]) == 0) return (int)i;
  return -1;
}
