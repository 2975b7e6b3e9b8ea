// SPDX-License-Identifier: Apache-2.0
#include "waymark/event_fields.h"

#define NO_LIMITS 0.0, 0.0
// Identities and stamps.
#define WHOLE(body, member, kind) \
  { #member, (uint16_t)offsetof(wm_event, as.body.member), WM_FIELD_##kind, 1, 0, 0, 0, NO_LIMITS }
// Numbers that came with a version of the codec.
#define NUMBERS_SINCE(version, body, member, n, ...) \
  { #member, (uint16_t)offsetof(wm_event, as.body.member), WM_FIELD_F64, n, version, 0, 0, __VA_ARGS__ }
// Numbers: n elements, of which `needed` are never absent.
#define NUMBERS_FROM(body, member, n, needed, zero_until, ...) \
  { #member, (uint16_t)offsetof(wm_event, as.body.member), WM_FIELD_F64, n, 0, zero_until, needed, __VA_ARGS__ }
#define NUMBERS(body, member, n, needed, ...) NUMBERS_FROM(body, member, n, needed, 0, __VA_ARGS__)
#define SIGHTING_NUMBER(member, need, least, most, limits, since, zero_until, message) \
  {#member, (uint16_t)offsetof(wm_event, as.sighting.member), WM_FIELD_F64, 1, since, zero_until, 0, least, most},

static const wm_event_field kTwist2[] = {NUMBERS(twist2, v_mps, 1, 1, WM_SPEED_LIMITS),
                                         NUMBERS(twist2, w_radps, 1, 1, WM_RATE_LIMITS)};
static const wm_event_field kTwist6[] = {
    NUMBERS(twist6, v_mps, 3, 3, WM_SPEED_LIMITS), NUMBERS(twist6, w_radps, 3, 0, WM_RATE_LIMITS),
    NUMBERS_SINCE(7, twist6, v_sigma_mps, 1, WM_SIGMA_LIMITS), NUMBERS_SINCE(7, twist6, arm_m, 3, WM_PLACE_LIMITS)};
static const wm_event_field kIncrement[] = {
    WHOLE(increment, from_ns, I64), NUMBERS(increment, dx_m, 1, 1, WM_PLACE_LIMITS),
    NUMBERS(increment, dy_m, 1, 1, WM_PLACE_LIMITS), NUMBERS(increment, dheading_rad, 1, 1, WM_ANGLE_LIMITS),
    NUMBERS(increment, covariance, 6, 0, WM_COVARIANCE_LIMITS)};
static const wm_event_field kSighting[] = {WHOLE(sighting, sensor, U16), WHOLE(sighting, landmark_id, I32),
                                           WM_SIGHTING_NUMBERS(SIGHTING_NUMBER)};
static const wm_event_field kPosition[] = {NUMBERS(position, p_m, 3, 0, WM_PLACE_LIMITS),
                                           NUMBERS(position, sigma_xy_m, 1, 0, WM_SIGMA_LIMITS),
                                           NUMBERS(position, sigma_z_m, 1, 0, WM_SIGMA_LIMITS)};
static const wm_event_field kHeading[] = {NUMBERS(heading, heading_rad, 1, 1, WM_ANGLE_LIMITS),
                                          NUMBERS(heading, sigma_rad, 1, 1, WM_SIGMA_LIMITS)};
static const wm_event_field kLocalized[] = {
    NUMBERS(localized, p_m, 2, 2, WM_PLACE_LIMITS), NUMBERS(localized, heading_rad, 1, 0, WM_ANGLE_LIMITS),
    NUMBERS(localized, covariance, 6, 0, WM_COVARIANCE_LIMITS), NUMBERS(localized, reset, 1, 0, WM_PLACE_LIMITS)};
static const wm_event_field kMarker[] = {WHOLE(marker, sensor, U16),
                                         WHOLE(marker, poses, U16),
                                         WHOLE(marker, id, I32),
                                         NUMBERS(marker, p_m, 3, 2, WM_MARKER_LIMITS),
                                         NUMBERS(marker, yaw_rad, 1, 0, WM_ANGLE_LIMITS),
                                         NUMBERS(marker, other_p_m, 3, 0, WM_MARKER_LIMITS),
                                         NUMBERS(marker, other_yaw_rad, 1, 0, WM_ANGLE_LIMITS),
                                         NUMBERS_FROM(marker, along_sigma_m, 1, 0, 4, WM_SIGMA_LIMITS),
                                         NUMBERS_FROM(marker, yaw_sigma_rad, 1, 0, 4, WM_SIGMA_LIMITS),
                                         NUMBERS_FROM(marker, bloom_px, 1, 0, 4, WM_PIXEL_LIMITS)};
static const wm_event_field kStereo[] = {
    WHOLE(stereo, id, I32),
    NUMBERS(stereo, left_px, 2, 0, WM_PIXEL_LIMITS),
    NUMBERS(stereo, right_px, 2, 0, WM_PIXEL_LIMITS),
    {"appearance", (uint16_t)offsetof(wm_event, as.stereo.appearance), WM_FIELD_U64, 4, 6, 0, 0, NO_LIMITS}};
static const wm_event_field kLooked[] = {WHOLE(looked, sensor, U16)};
static const wm_event_field kSetPose[] = {
    NUMBERS(set_pose, pose_map_base.p_m, 3, 2, WM_PLACE_LIMITS),
    NUMBERS(set_pose, pose_map_base.q_xyzw, 4, 4, -1.001, 1.001), NUMBERS(set_pose, sigma_xy_m, 1, 1, WM_SIGMA_LIMITS),
    NUMBERS(set_pose, sigma_heading_rad, 1, 1, WM_SIGMA_LEAST, WM_HEADING_SIGMA_MOST_RAD)};

static const wm_event_field kSetFloor[] = {WHOLE(set_floor, floor, I32)};

#define HOLDS(rows) rows, sizeof(rows) / sizeof((rows)[0])
#define HOLDS_NO_FIELDS NULL, 0

static const struct {
  const char *name;
  const wm_event_field *rows;
  size_t count;
} kKinds[] = {
    [WM_EVENT_NONE] = {"none", HOLDS_NO_FIELDS},
    [WM_EVENT_QUANTITIES] = {"quantities", HOLDS_NO_FIELDS},
    [WM_EVENT_TWIST2] = {"twist2", HOLDS(kTwist2)},
    [WM_EVENT_TWIST6] = {"twist6", HOLDS(kTwist6)},
    [WM_EVENT_SIGHTING] = {"sighting", HOLDS(kSighting)},
    [WM_EVENT_POSITION] = {"position", HOLDS(kPosition)},
    [WM_EVENT_HEADING] = {"heading", HOLDS(kHeading)},
    [WM_EVENT_MARKER] = {"marker", HOLDS(kMarker)},
    [WM_EVENT_STEREO] = {"stereo", HOLDS(kStereo)},
    [WM_EVENT_POINTS] = {"points", HOLDS_NO_FIELDS},
    [WM_EVENT_LOOKED] = {"looked", HOLDS(kLooked)},
    [WM_EVENT_SET_POSE] = {"set_pose", HOLDS(kSetPose)},
    [WM_EVENT_RESET] = {"reset", HOLDS_NO_FIELDS},
    [WM_EVENT_INCREMENT] = {"increment", HOLDS(kIncrement)},
    [WM_EVENT_LOCALIZED] = {"localized", HOLDS(kLocalized)},
    [WM_EVENT_SET_FLOOR] = {"set_floor", HOLDS(kSetFloor)},
};
_Static_assert(sizeof kKinds / sizeof kKinds[0] == WM_EVENT_KIND_COUNT, "a row for each kind");

const wm_event_field *wm_event_fields(unsigned kind, size_t *count) {
  *count = kind < WM_EVENT_KIND_COUNT ? kKinds[kind].count : 0;
  return *count > 0 ? kKinds[kind].rows : NULL;
}

const char *wm_event_kind_name(unsigned kind) { return kind < WM_EVENT_KIND_COUNT ? kKinds[kind].name : "?"; }
