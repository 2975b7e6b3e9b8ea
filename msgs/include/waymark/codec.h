// SPDX-License-Identifier: Apache-2.0
// The structs of msgs/ as bytes: little-endian fields, a version first, every count and index checked when read.
// They are stored in the event log and hashed. Pure functions: any thread, no allocation, cost linear in the bytes.
//
// Encoders return the bytes written, 0 where `capacity` is too small. Decoders take bytes from anywhere (a file that
// was cut, a fuzzer) and return WM_OK, or WM_BAD_DATA with *out unspecified; `*used` is the number of bytes read.
#ifndef WAYMARK_CODEC_H
#define WAYMARK_CODEC_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/event.h"
#include "waymark/pose.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Enough for any event.
#define WM_EVENT_ENCODED_MAX (32 + 12 + 16 * WM_POINTS_MAX)
#define WM_PUBLISHED_ENCODED_MAX 640
#define WM_INNOVATION_ENCODED_MAX 80

size_t wm_event_encode(const wm_event *event, void *out, size_t capacity);
// Of stamp, kind and content: equal where the same datum is sent again, whatever its source, number and arrival.
uint64_t wm_event_hash(const wm_event *event);
wm_status wm_event_decode(const void *data, size_t size, wm_event *out, size_t *used);

size_t wm_published_encode(const wm_published *published, void *out, size_t capacity);
wm_status wm_published_decode(const void *data, size_t size, wm_published *out, size_t *used);

size_t wm_innovation_encode(const wm_innovation *innovation, void *out, size_t capacity);
wm_status wm_innovation_decode(const void *data, size_t size, wm_innovation *out, size_t *used);

size_t wm_wheels_encode(const wm_wheels *wheels, void *out, size_t capacity);
wm_status wm_wheels_decode(const void *data, size_t size, wm_wheels *out, size_t *used);

size_t wm_sensor_encode(const wm_sensor *sensor, void *out, size_t capacity);
wm_status wm_sensor_decode(const void *data, size_t size, wm_sensor *out, size_t *used);

// Enough for any rig.
#define WM_RIG_ENCODED_MAX (512 + WM_CAMERAS_MAX * 384)
size_t wm_rig_encode(const wm_rig *rig, void *out, size_t capacity);
wm_status wm_rig_decode(const void *data, size_t size, wm_rig *out, size_t *used);

size_t wm_landmark_encode(const wm_landmark *landmark, void *out, size_t capacity);
wm_status wm_landmark_decode(const void *data, size_t size, wm_landmark *out, size_t *used);

size_t wm_start_encode(const wm_start *start, void *out, size_t capacity);
wm_status wm_start_decode(const void *data, size_t size, wm_start *out, size_t *used);

// 64-bit FNV-1a over bytes; begin with WM_HASH_START. Detects a wrong map or a duplicate; not for cryptography.
#define WM_HASH_START UINT64_C(0xcbf29ce484222325)
uint64_t wm_hash(uint64_t hash, const void *bytes, size_t count);

// Hash of landmarks in their order, by which the event log identifies a map.
uint64_t wm_landmarks_hash(const wm_landmark *landmarks, size_t count);

#ifdef __cplusplus
}
#endif

#endif
