// SPDX-License-Identifier: Apache-2.0
// Detector `mr`: MR codes in the raw picture. Dark regions whose undistorted outer border is a pentagon; decoding of
// their modules; edges and pose by wm_marker_fit.
#include <cstring>

#include "vision/detector.hpp"
#include "vision/markers/mr_read.hpp"
#include "vision/markers/outline.hpp"
#include "vision/markers/params.h"
#include "vision/registry.h"
#include "waymark/marker_fit.h"

namespace wm {

namespace {

constexpr int kContrastMin_grey = 20;  // smallest difference of a print's white and black

struct mr_state {
  wm_mr_params params;
  outline_work outlines;
  wm_marker_fit *fit;
};

// Lays out the state, whose camera is known; returns its bytes.
size_t lay_out(mr_state *state, bool is_counting) {
  memory_layout memory(is_counting ? nullptr : state, sizeof *state);
  uint8_t *fit = memory.take<uint8_t>(wm_marker_fit_bytes());
  outline_place(&state->outlines, &memory, is_counting);
  if (!is_counting) state->fit = reinterpret_cast<wm_marker_fit *>(fit);
  return memory.bytes();
}

wm_marker_print print_of(const wm_mr_params &params, const wm_rig &rig) {
  wm_marker_print print = {};
  print.size_m = params.size_m > 0 ? params.size_m : rig.marker_size_m;
  print.corners = 5;
  for (int i = 0; i < 5; i++) wm_mr_vertex(i, print.corner[i]);
  print.other = WM_MR_INNER;
  print.overlap = 1.0;
  return print;
}

size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  const auto *p = static_cast<const wm_mr_params *>(params);
  const wm_camera *camera = first_camera(view, why);
  if (!camera) return 0;
  mr_state state;
  *why = outline_init(&state.outlines, *camera);
  if (*why) return 0;
  if (!(p->size_m > 0) && (std::strcmp(view->rig->marker_family, "mr") != 0 || !(view->rig->marker_size_m > 0))) {
    *why = "markers: {family: mr, size_m: ...} of calibration.yaml is needed, or vision.mr.size_m";
    return 0;
  }
  return lay_out(&state, true);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<mr_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->params = *static_cast<const wm_mr_params *>(params);
  if (outline_init(&state->outlines, *camera)) return WM_BAD_CONFIG;
  lay_out(state, false);
  const wm_marker_print print = print_of(state->params, *view->rig);
  return wm_marker_fit_init(state->fit, camera, &print) ? WM_BAD_CONFIG : WM_OK;
}

bool read_region(mr_state *state, const wm_frame &frame, uint32_t region, wm_marker *out) {
  tangent_view view;
  tangent_point corner[5];
  mr_reading reading;
  double corners_px[5][2];
  if (!find_outline(&state->outlines, region, 5, &view, corner) ||
      !mr_read(view, frame, corner, static_cast<uint32_t>(state->params.id_max), kContrastMin_grey, &reading) ||
      !outline_in_picture(state->outlines, view, corner, 5, reading.tip, corners_px))
    return false;
  out->id = static_cast<int32_t>(reading.id) + state->params.id_offset;
  return wm_marker_fit_read(state->fit, &frame, corners_px, out);
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *state = static_cast<mr_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != state->outlines.width_px || frame.height_px != state->outlines.height_px) return WM_BAD_DATA;
  const dark_work &regions = state->outlines.regions;
  find_regions(&state->outlines.regions, frame, kContrastMin_grey, false);
  const uint32_t runs = run_count(regions);
  for (uint32_t i = 0; i < runs && *count < capacity; i++) {
    if (!is_region(regions, i)) continue;
    wm_event *event = &out[*count];
    std::memset(static_cast<void *>(event), 0, WM_EVENT_SMALL_BYTES);
    if (!read_region(state, frame, i, &event->as.marker)) continue;
    event->t_ns = frame.t_ns;
    event->kind = WM_EVENT_MARKER;
    ++*count;
  }
  return WM_OK;
}

}  // namespace

}  // namespace wm

extern "C" const wm_detector wm_mr_detector = {
    .name = "mr",
    .about = "Coded markers (MR code: a pentagon with 8 x 8 modules) on ceilings and walls",
    .gives = WM_EVENT_BIT(WM_EVENT_MARKER),
    .pictures = 1,
    .params = wm_mr_params_table,
    .state_bytes = wm::state_bytes,
    .init = wm::init,
    .detect = wm::detect,
    .is_guided = 0,
    .looked_for = nullptr,
};
