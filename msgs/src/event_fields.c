// SPDX-License-Identifier: Apache-2.0
#include "waymark/event_fields.h"

#define FIELD_FROM(body, member, kind, n, since, zero_until) \
  { #member, (uint16_t)offsetof(wm_event, as.body.member), WM_FIELD_##kind, n, since, zero_until }
#define FIELD(body, member, kind) FIELD_FROM(body, member, kind, 1, 0, 0)
#define FIELDS(body, member, kind, n) FIELD_FROM(body, member, kind, n, 0, 0)
#define SIGHTING_NUMBER(member, need, least, most, limits, since, zero_until, message) \
  FIELD_FROM(sighting, member, F64, 1, since, zero_until),

static const wm_event_field kTwist2[] = {FIELD(twist2, v_mps, F64), FIELD(twist2, w_radps, F64)};
static const wm_event_field kTwist6[] = {FIELDS(twist6, v_mps, F64, 3), FIELDS(twist6, w_radps, F64, 3)};
static const wm_event_field kIncrement[] = {FIELD(increment, from_ns, I64), FIELD(increment, dx_m, F64),
                                            FIELD(increment, dy_m, F64), FIELD(increment, dheading_rad, F64),
                                            FIELDS(increment, covariance, F64, 6)};
static const wm_event_field kSighting[] = {FIELD(sighting, sensor, U16), FIELD(sighting, landmark_id, I32),
                                           WM_SIGHTING_NUMBERS(SIGHTING_NUMBER)};
static const wm_event_field kPosition[] = {FIELDS(position, p_m, F64, 3), FIELD(position, sigma_xy_m, F64),
                                           FIELD(position, sigma_z_m, F64)};
static const wm_event_field kHeading[] = {FIELD(heading, heading_rad, F64), FIELD(heading, sigma_rad, F64)};
static const wm_event_field kMarker[] = {FIELD(marker, sensor, U16),
                                         FIELD(marker, poses, U16),
                                         FIELD(marker, id, I32),
                                         FIELDS(marker, p_m, F64, 3),
                                         FIELD(marker, yaw_rad, F64),
                                         FIELDS(marker, other_p_m, F64, 3),
                                         FIELD(marker, other_yaw_rad, F64),
                                         FIELD_FROM(marker, along_sigma_m, F64, 1, 0, 4),
                                         FIELD_FROM(marker, yaw_sigma_rad, F64, 1, 0, 4),
                                         FIELD_FROM(marker, bloom_px, F64, 1, 0, 4)};
static const wm_event_field kStereo[] = {FIELD(stereo, id, I32), FIELDS(stereo, left_px, F64, 2),
                                         FIELDS(stereo, right_px, F64, 2),
                                         FIELD_FROM(stereo, appearance, U64, 4, 6, 0)};
static const wm_event_field kLooked[] = {FIELD(looked, sensor, U16)};
static const wm_event_field kSetPose[] = {FIELDS(set_pose, pose_map_base.p_m, F64, 3),
                                          FIELDS(set_pose, pose_map_base.q_xyzw, F64, 4),
                                          FIELD(set_pose, sigma_xy_m, F64), FIELD(set_pose, sigma_heading_rad, F64)};

#define HOLDS(rows) rows, sizeof(rows) / sizeof((rows)[0])
#define HOLDS_NO_FIELDS NULL, 0

static const struct {
  const char *name;
  const wm_event_field *rows;
  size_t count;
} kKinds[] = {
    [WM_EVENT_NONE] = {"none", HOLDS_NO_FIELDS},          [WM_EVENT_QUANTITIES] = {"quantities", HOLDS_NO_FIELDS},
    [WM_EVENT_TWIST2] = {"twist2", HOLDS(kTwist2)},       [WM_EVENT_TWIST6] = {"twist6", HOLDS(kTwist6)},
    [WM_EVENT_SIGHTING] = {"sighting", HOLDS(kSighting)}, [WM_EVENT_POSITION] = {"position", HOLDS(kPosition)},
    [WM_EVENT_HEADING] = {"heading", HOLDS(kHeading)},    [WM_EVENT_MARKER] = {"marker", HOLDS(kMarker)},
    [WM_EVENT_STEREO] = {"stereo", HOLDS(kStereo)},       [WM_EVENT_POINTS] = {"points", HOLDS_NO_FIELDS},
    [WM_EVENT_LOOKED] = {"looked", HOLDS(kLooked)},       [WM_EVENT_SET_POSE] = {"set_pose", HOLDS(kSetPose)},
    [WM_EVENT_RESET] = {"reset", HOLDS_NO_FIELDS},        [WM_EVENT_INCREMENT] = {"increment", HOLDS(kIncrement)},
};
_Static_assert(sizeof kKinds / sizeof kKinds[0] == WM_EVENT_KIND_COUNT, "a row for each kind");

const wm_event_field *wm_event_fields(unsigned kind, size_t *count) {
  *count = kind < WM_EVENT_KIND_COUNT ? kKinds[kind].count : 0;
  return *count > 0 ? kKinds[kind].rows : NULL;
}

const char *wm_event_kind_name(unsigned kind) { return kind < WM_EVENT_KIND_COUNT ? kKinds[kind].name : "?"; }
