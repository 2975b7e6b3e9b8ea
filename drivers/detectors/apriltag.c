// SPDX-License-Identifier: Apache-2.0
// Detector `apriltag`: square coded markers, AprilTags and ArUco's, of one family. waymark/square_marker.h finds and
// reads them; the codes of AprilTags are its library's (E. Olson 2011).
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "detectors.h"
#include "waymark/detectors.h"

#define CONTRAST_MIN_GREY 20  // smallest difference of a print's white and black

typedef struct apriltag_params {
  int32_t family;
  int32_t id_max, id_offset, unused;
  double size_m;
} apriltag_params;

static const wm_param kParams[] = {
    {"family", WM_PARAM_ENUM, offsetof(apriltag_params, family), 0, 0, 26, wm_marker_family_names,
     "The markers' family; calibration: markers.family of calibration.yaml."},
    {"size_m", WM_PARAM_F64, offsetof(apriltag_params, size_m), 0, 0, 10, NULL,
     "m. Outer edge of the black square (tag16h5 to tag36h11, ArUco), or of the white one inside of the black ring "
     "(tagCircle, tagCustom, tagStandard). 0: markers.size_m of calibration.yaml."},
    {"id_max", WM_PARAM_I32, offsetof(apriltag_params, id_max), 4095, 0, 65535, NULL,
     "Largest accepted identity. Fewer identities make false detections rarer and more wrong modules correctable."},
    {"id_offset", WM_PARAM_I32, offsetof(apriltag_params, id_offset), 0, 0, 1000000000, NULL,
     "Added to each identity, so that markers of different families have different ids."},
};

static const wm_param_old kOld[] = {
    {"decimate", NULL, "pictures are searched at full resolution now"},
    {"margin_min", NULL, "a least contrast of 20 grey levels is the limit now"},
    {"bits_corrected", NULL, "follows from the family's distance and its number of identities now"},
    {"contrast_min", NULL, "a constant now: 20 grey levels"},
    {NULL, NULL, NULL},
};

typedef struct apriltag_state {
  int32_t id_offset;
} apriltag_state;

#define STATE_BYTES 64  // before the reader, which is aligned by 64

static wm_square_reader *reader_of(void *state) { return (wm_square_reader *)(void *)((char *)state + STATE_BYTES); }

static const wm_camera *camera_of(const wm_view *view) { return &view->rig->cameras[view->cameras[0]]; }

static double size_of(const apriltag_params *params, const wm_rig *rig) {
  return params->size_m > 0.0 ? params->size_m : rig->marker_size_m;
}

static int family_of(const apriltag_params *params, const wm_rig *rig, wm_square_family *out, uint64_t **codes) {
  const char *name = params->family > 0 ? wm_marker_family_names[params->family] : rig->marker_family;
  return wm_marker_family_make(name, (uint32_t)params->id_max + 1, out, codes);
}

static size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  wm_square_family family;
  uint64_t *codes;
  if (!family_of(params, view->rig, &family, &codes)) {
    *why =
        "markers.family of calibration.yaml must be tag36h11, aruco_4x4_50 or another of vision.apriltag.family, "
        "which may name it, too";
    return 0;
  }
  if (!(size_of(params, view->rig) > 0.0)) {
    *why = "markers.size_m of calibration.yaml is needed: the outer edge of the black square";
    free(codes);
    return 0;
  }
  const size_t bytes = wm_square_reader_bytes(camera_of(view), &family, why);
  free(codes);
  return bytes ? STATE_BYTES + bytes : 0;
}

static wm_status init(void *state, const void *params, const wm_view *view) {
  const apriltag_params *p = params;
  wm_square_family family;
  uint64_t *codes;
  if (!family_of(p, view->rig, &family, &codes)) return WM_BAD_CONFIG;
  memset(state, 0, STATE_BYTES);
  ((apriltag_state *)state)->id_offset = p->id_offset;
  const char *why =
      wm_square_reader_init(reader_of(state), camera_of(view), &family, size_of(p, view->rig), CONTRAST_MIN_GREY);
  free(codes);
  return why ? WM_BAD_CONFIG : WM_OK;
}

static wm_status detect(void *state, const wm_frame *frames, const wm_estimate *prediction, wm_event *out,
                        size_t capacity, size_t *count) {
  (void)prediction;
  return wm_square_reader_read(reader_of(state), frames, ((const apriltag_state *)state)->id_offset, out, capacity,
                               count);
}

const wm_detector wm_apriltag_detector = {
    "apriltag",
    "Square coded markers (AprilTag and ArUco, one family) on ceilings and walls, in the picture's full resolution; "
    "all "
    "edges of the print measured again, with the camera's growing of white taken out.",
    WM_EVENT_BIT(WM_EVENT_MARKER),
    1,
    {kParams, sizeof kParams / sizeof kParams[0], sizeof(apriltag_params), kOld},
    state_bytes,
    init,
    detect,
    0,
    NULL};
