// SPDX-License-Identifier: Apache-2.0
// AprilTags: found and decoded by AprilTag's own library (E. Olson 2011) in the raw picture; their edges are then
// measured and their pose found by wm_marker_fit. One thread a detector.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <stddef.h>
#include <string.h>

#include "detectors.h"
#include "waymark/detectors.h"
#include "waymark/marker_fit.h"

typedef struct apriltag_params {
  double decimate;
  double margin_min;
  int32_t bits_corrected;
  int32_t family;
  double size_m;
} apriltag_params;

static const char *const kFamilyNames[] = {"calibration", "tag36h11", "tagStandard41h12", NULL};

static const wm_param kParams[] = {
    {"decimate", WM_PARAM_F64, offsetof(apriltag_params, decimate), 2, 1, 8, NULL,
     "Squares are looked for in the picture reduced so much; codes are read and edges measured at full resolution."},
    {"margin_min", WM_PARAM_F64, offsetof(apriltag_params, margin_min), 25, 0, 255, NULL,
     "Grey levels by which a code's bits must differ from its threshold, on average: less is blur or no marker."},
    {"bits_corrected", WM_PARAM_I32, offsetof(apriltag_params, bits_corrected), 1, 0, 2, NULL,
     "Wrong bits of a code that are corrected. More make false markers."},
    {"family", WM_PARAM_ENUM, offsetof(apriltag_params, family), 0, 0, 2, kFamilyNames,
     "The markers' family; calibration: markers.family of calibration.yaml."},
    {"size_m", WM_PARAM_F64, offsetof(apriltag_params, size_m), 0, 0, 10, NULL,
     "m. Edge of the square that the library finds: the black square's outer edge (tag36h11), the white one's in it "
     "(tagStandard41h12). 0: markers.size_m of calibration.yaml."},
};

// The library's detectors live as long as the program: there is no end in the contract, and a run has few cameras.
#define MADE_MAX 8
static apriltag_detector_t *made[MADE_MAX];
static size_t made_count;

typedef struct family {
  const char *name;
  apriltag_family_t *(*create)(void);
  int32_t is_white_inside;
  double other;      // scale of the print's second border
  int first_corner;  // of the library's, which go against the clock: the upper left one
} family;

// tag36h11 is read the other way up than in AprilTag's own pictures, as ArUco does and the recordings have it.
static const family kFamilies[] = {{"tag36h11", tag36h11_create, 0, 6.0 / 8, 1},
                                   {"tagStandard41h12", tagStandard41h12_create, 1, 7.0 / 5, 3}};

typedef struct apriltag_state {
  apriltag_detector_t *library;
  const family *family;
  double margin_min;
  uint32_t width_px, height_px;
} apriltag_state;

static wm_marker_fit *fit_of(apriltag_state *self) {
  return (wm_marker_fit *)(void *)((char *)self + (sizeof *self + 15) / 16 * 16);
}

static const family *family_of(const apriltag_params *params, const wm_rig *rig) {
  const char *name = params->family > 0 ? kFamilyNames[params->family] : rig->marker_family;
  for (size_t i = 0; i < sizeof kFamilies / sizeof kFamilies[0]; i++)
    if (strcmp(kFamilies[i].name, name) == 0) return &kFamilies[i];
  return NULL;
}

static double size_of(const apriltag_params *params, const wm_rig *rig) {
  return params->size_m > 0.0 ? params->size_m : rig->marker_size_m;
}

static size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  if (!family_of(params, view->rig)) {
    *why = "markers.family of calibration.yaml must be tag36h11 or tagStandard41h12; or vision.apriltag.family says it";
    return 0;
  }
  if (!(size_of(params, view->rig) > 0.0)) {
    *why = "markers.size_m of calibration.yaml is needed: the outer edge of the black square";
    return 0;
  }
  return (sizeof(apriltag_state) + 15) / 16 * 16 + wm_marker_fit_bytes();
}

static wm_status init(void *state, const void *params, const wm_view *view) {
  const apriltag_params *p = params;
  apriltag_state *self = state;
  memset(self, 0, sizeof *self);
  self->family = family_of(p, view->rig);
  const wm_camera *camera = &view->rig->cameras[view->cameras[0]];
  const wm_marker_print print = {
      size_of(p, view->rig), 4,  {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}, self->family->is_white_inside,
      self->family->other,   0.5};  // of a code's modules half are white
  if (wm_marker_fit_init(fit_of(self), camera, &print) != NULL) return WM_BAD_CONFIG;
  if (made_count == MADE_MAX) return WM_FULL;
  self->library = apriltag_detector_create();
  if (!self->library) return WM_IO;
  made[made_count++] = self->library;
  apriltag_detector_add_family_bits(self->library, self->family->create(), p->bits_corrected);
  self->library->nthreads = 1;
  self->library->quad_decimate = (float)p->decimate;
  // A code's black and white differ by twice the margin: where grey differs by less than 0.8 of it, noise and faint
  // clutter, the library needn't look for squares.
  const int least = (int)(0.8 * p->margin_min);
  if (least > self->library->qtp.min_white_black_diff) self->library->qtp.min_white_black_diff = least;
  self->margin_min = p->margin_min;
  self->width_px = camera->width_px;
  self->height_px = camera->height_px;
  return WM_OK;
}

static int put(apriltag_state *self, const wm_frame *frame, const apriltag_detection_t *found, wm_event *out) {
  // The library's corners go against the clock, and its pixels' centres are at 0.5.
  double corners[4][2];
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 2; k++) corners[i][k] = found->p[(self->family->first_corner + 4 - i) % 4][k] - 0.5;
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->t_ns = frame->t_ns;
  out->kind = WM_EVENT_MARKER;
  out->as.marker.id = found->id;
  return wm_marker_fit_read(fit_of(self), frame, (const double(*)[2])corners, &out->as.marker);
}

static wm_status detect(void *state, const wm_frame *frames, const wm_estimate *prediction, wm_event *out,
                        size_t capacity, size_t *count) {
  (void)prediction;
  apriltag_state *self = state;
  *count = 0;
  if ((self->width_px && frames->width_px != self->width_px) ||
      (self->height_px && frames->height_px != self->height_px))
    return WM_BAD_DATA;
  image_u8_t picture = {(int32_t)frames->width_px, (int32_t)frames->height_px, (int32_t)frames->stride_bytes,
                        (uint8_t *)(uintptr_t)frames->grey};  // the library only reads it
  zarray_t *found = apriltag_detector_detect(self->library, &picture);
  for (int i = 0; i < zarray_size(found) && *count < capacity; i++) {
    apriltag_detection_t *one;
    zarray_get(found, i, &one);
    if ((double)one->decision_margin < self->margin_min) continue;
    *count += (size_t)put(self, frames, one, &out[*count]);
  }
  apriltag_detections_destroy(found);
  return WM_OK;
}

const wm_detector wm_apriltag_detector = {
    "apriltag",
    "Coded markers (AprilTag 36h11, Standard41h12) on ceilings and walls: found by AprilTag's "
    "library, all edges of the print measured "
    "again, with the camera's growing of white taken out.",
    WM_EVENT_BIT(WM_EVENT_MARKER),
    1,
    {kParams, sizeof kParams / sizeof kParams[0], sizeof(apriltag_params), NULL},
    state_bytes,
    init,
    detect,
    0,
    NULL};
