// SPDX-License-Identifier: Apache-2.0
// Detector `mr`: MR codes in the raw picture. Dark regions whose undistorted outer border is a pentagon; decoding of
// their modules; edges and pose by wm_marker_fit.
#include <cstring>

#include "memory/layout.hpp"
#include "vision/detector.hpp"
#include "vision/markers/dark_regions.hpp"
#include "vision/markers/mr_read.hpp"
#include "vision/markers/params.h"
#include "vision/markers/polygon.hpp"
#include "vision/registry.h"
#include "waymark/marker_fit.h"

namespace wm {

namespace {

constexpr int kBoxMin_px = 10;       // smaller side of a region's box: a module has less than a pixel then
constexpr int kBorderMin_px = 40;    // length of a border: of the smallest box
constexpr double kRoundMin = 0.3;    // 4 pi area / border^2: a pentagon has 0.86, seen at 75 degrees 0.45
constexpr double kOff_px = 1.2;      // largest distance of a border's point from its side: pixel steps. Not swept
constexpr double kOffOfSize = 0.02;  // the same, as a fraction of the root of the doubled area: lens residuals
constexpr double kHalfPixel = 0.5;   // from a border pixel's centre to the edge

struct mr_state {
  wm_mr_params params;
  uint32_t width_px, height_px;
  lens optics;
  dark_work dark;
  tangent_point *border;  // undistorted border of the current region
  wm_marker_fit *fit;
};

// Lays out the state; returns its bytes.
size_t lay_out(mr_state *state, uint32_t width, uint32_t height) {
  memory_layout memory(state, sizeof *state);
  dark_work work;
  uint8_t *fit = memory.take<uint8_t>(wm_marker_fit_bytes());
  uint8_t *dark = memory.take<uint8_t>(dark_work_lay_out(&work, width, height, nullptr));
  tangent_point *border = memory.take<tangent_point>(static_cast<size_t>(work.border_max));
  if (!state) return memory.bytes();
  dark_work_lay_out(&state->dark, width, height, dark);
  state->fit = reinterpret_cast<wm_marker_fit *>(fit);
  state->border = border;
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
  lens optics;
  *why = lens_init(&optics, *camera);
  if (*why) return 0;
  if (camera->width_px < 16 || camera->height_px < 16 || camera->width_px > 16384 || camera->height_px > 16384) {
    *why = "the camera's size must be 16 to 16384 px";
    return 0;
  }
  if (!(p->size_m > 0) && (std::strcmp(view->rig->marker_family, "mr") != 0 || !(view->rig->marker_size_m > 0))) {
    *why = "markers: {family: mr, size_m: ...} of calibration.yaml is needed, or vision.mr.size_m";
    return 0;
  }
  return lay_out(nullptr, camera->width_px, camera->height_px);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<mr_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->params = *static_cast<const wm_mr_params *>(params);
  state->width_px = camera->width_px;
  state->height_px = camera->height_px;
  if (lens_init(&state->optics, *camera)) return WM_BAD_CONFIG;
  lay_out(state, camera->width_px, camera->height_px);
  const wm_marker_print print = print_of(state->params, *view->rig);
  return wm_marker_fit_init(state->fit, camera, &print) ? WM_BAD_CONFIG : WM_OK;
}

// Whether a border can be a pentagon's, by its area and length.
bool is_round(const border_point *border, int32_t count) {
  int64_t area = 0;
  double length_px = 0;
  for (int32_t i = 0; i < count; i++) {
    const border_point &a = border[i], &b = border[i + 1 < count ? i + 1 : 0];
    area += static_cast<int64_t>(b.u) * a.v - static_cast<int64_t>(a.u) * b.v;
    length_px += a.u != b.u && a.v != b.v ? 1.41421356 : 1.0;
  }
  return 2 * kPi * static_cast<double>(area) > kRoundMin * length_px * length_px;
}

// The undistorted border in the tangent plane of its middle.
bool undistort_border(mr_state *state, const dark_run &box, int32_t count, tangent_view *view) {
  vec3 middle;
  const pixel centre = {0.5 * (box.left + box.right), 0.5 * (box.row + box.bottom)};
  if (!unproject(state->optics, centre, &middle) || !tangent_init(view, state->optics, middle)) return false;
  for (int32_t i = 0; i < count; i++) {
    const border_point &p = state->dark.border[i];
    vec3 ray;
    if (!unproject(state->optics, {1.0 * p.u, 1.0 * p.v}, &ray) || !point_of_ray(*view, ray, &state->border[i]))
      return false;
  }
  return true;
}

// Moves the sides of a pentagon outwards.
bool move_out(const tangent_point from[5], double by, tangent_point to[5]) {
  tangent_line side[5];
  for (int i = 0; i < 5; i++) {
    const tangent_point along = from[(i + 1) % 5] - from[i];
    const tangent_point n = {along.y / length(along), -along.x / length(along)};
    side[i] = {n, dot(n, from[i]) + by};
  }
  for (int i = 0; i < 5; i++)
    if (!meet(side[(i + 4) % 5], side[i], &to[i])) return false;
  return true;
}

bool read_region(mr_state *state, const wm_frame &frame, uint32_t region, wm_marker *out) {
  const dark_run &box = state->dark.runs[region];
  if (box.right - box.left < kBoxMin_px || box.bottom - box.row < kBoxMin_px) return false;
  if (box.left == 0 || box.row == 0 || box.right + 1U >= state->width_px || box.bottom + 1U >= state->height_px)
    return false;
  const int32_t count = trace_border(&state->dark, region);
  if (count < kBorderMin_px || !is_round(state->dark.border, count)) return false;
  tangent_view view;
  if (!undistort_border(state, box, count, &view)) return false;
  tangent_point dark[5], corner[5];
  const double size = std::sqrt(std::fabs(doubled_area(state->border, count)));
  if (!polygon_of(state->border, count, 5, larger(kOff_px, kOffOfSize * size), dark)) return false;
  if (!move_out(dark, kHalfPixel, corner)) return false;
  mr_reading reading;
  if (!mr_read(view, frame, corner, static_cast<uint32_t>(state->params.id_max), state->params.contrast_min, &reading))
    return false;
  double corners_px[5][2];
  for (int i = 0; i < 5; i++) {
    pixel at;
    if (!project(state->optics, ray_of(view, corner[(reading.tip + i) % 5]), &at)) return false;
    corners_px[i][0] = at.u;
    corners_px[i][1] = at.v;
  }
  out->id = static_cast<int32_t>(reading.id) + state->params.id_offset;
  return wm_marker_fit_read(state->fit, &frame, corners_px, out);
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *state = static_cast<mr_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != state->width_px || frame.height_px != state->height_px) return WM_BAD_DATA;
  find_dark_regions(&state->dark, frame, state->params.contrast_min);
  const uint32_t runs = run_count(state->dark);
  for (uint32_t i = 0; i < runs && *count < capacity; i++) {
    if (!is_region(state->dark, i)) continue;
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
