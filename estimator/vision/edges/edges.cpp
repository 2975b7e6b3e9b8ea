// SPDX-License-Identifier: Apache-2.0
// Detector `edges`: the borders of the floor, as points on the floor.
#include <cmath>
#include <cstring>

#include "vision/detector.hpp"
#include "vision/edges/params.h"
#include "vision/edges/rays.hpp"
#include "vision/edges/support.hpp"
#include "vision/edges_hough/windows.hpp"
#include "vision/registry.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

namespace {

constexpr int32_t kSupportMin = 3;  // of the 8 neighbouring rays, with points on a line through this one. Not swept
// Widths of dark bands on the floor that are no walls. Rays meet joints along the robot's path at a flat angle; walls
// nearer than a few times this, beside the camera, are not detected.
constexpr double kJoint_m = 0.035;  // always: joints of tiles, cables
constexpr double kBand_m = 0.1;     // if the floor behind is as bright as before: floor tape, a threshold. Not swept
constexpr double kWindowSigma_m = 0.03;  // of a line's points across it, by windows; on the tables of docs/edges.md
constexpr double kSpacing_m = 0.1;       // of points on a window's line: about that of rays
constexpr int kLinesCrossed = 4;         // joints and cables that a ray crosses before its search ends: bounds the cost
constexpr double kBlur_px = 1.0;         // added to the width of a line in the picture
constexpr int kBehindBand_px = 4;        // averaged behind a band, to compare with the floor before it
constexpr double kFloorAgain = 1.5;      // off the middle, in changes, that is still the floor before (which is at 0.5)
constexpr double kSlopeMin_grey_per_px = 0.2;  // below, an edge has no direction: noise
constexpr double kNoise_grey = 2;              // of a pixel; divided by an edge's gradient it adds to sigma_px
constexpr double kAveragedPixels = 9;          // of the 5 x 5 gradient, for its noise
constexpr double kMargin_px = 2.5;             // from the edge of the picture: half of the gradient's mask
constexpr double kStepOfRange = 1e-3;          // of the numerical derivative on the floor: below a pixel

struct edges_state {
  wm_edges_params params;
  int32_t camera_index;
  mounted_camera camera;
  ray_fan fan;
  ray_work work;
  // For mode `windows`.
  bird_view bird;
  piece_graph graph;
  line_piece *pieces;
  line_vertex *vertices;
};

constexpr int32_t kPiecesMax = 512;  // lines of windows that are joined (O(n^3)); windows beyond are not searched

// Lays out the state; returns its bytes.
size_t lay_out(edges_state *state, uint32_t rays, uint32_t samples, const bird_view &bird) {
  memory_layout memory(state, sizeof *state);
  ray_fan fan{};
  fan.rays = memory.take<ray>(rays);
  fan.samples = memory.take<picture_sample>(samples);
  fan.range_m = memory.take<float>(samples);
  const size_t area = static_cast<size_t>(bird.width) * static_cast<size_t>(bird.height);
  bird_view view = bird;
  view.table = memory.take<picture_sample>(area);
  view.grey = memory.take<uint8_t>(area);
  view.edge = memory.take<uint8_t>(area);
  view.inner = memory.take<uint8_t>(area);
  view.whole = memory.take<uint8_t>(static_cast<size_t>(bird.windows));
  view.hough = memory.take<hough_work>(1);
  const int32_t pieces = bird.windows < kPiecesMax ? bird.windows : kPiecesMax;
  uint8_t *graph = memory.take<uint8_t>(piece_graph_bytes(pieces));
  line_piece *lines = memory.take<line_piece>(static_cast<size_t>(pieces));
  line_vertex *vertices = memory.take<line_vertex>(2 * static_cast<size_t>(pieces));
  if (!state) return memory.bytes();
  state->fan = fan;
  state->bird = view;
  piece_graph_place(&state->graph, pieces, graph);
  state->pieces = lines;
  state->vertices = vertices;
  return memory.bytes();
}

// Size of the bird's-eye view, empty in mode `rays`. NULL, or the reason why it is impossible.
const char *view_of(const wm_edges_params &params, bird_view *out) {
  *out = bird_view{};
  if (params.mode != EDGES_BY_WINDOWS) return nullptr;
  bird_view_size(params.hough, out);
  if (out->windows < 1) return "the bird's-eye view is smaller than a window of 50 px (bird.*)";
  return static_cast<double>(out->width) * out->height > 4e7 ? "the bird's-eye view is above 40 million pixels"
                                                             : nullptr;
}

size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  const wm_camera *camera = first_camera(view, why);
  if (!camera) return 0;
  mounted_camera mounted;
  *why = mounted_camera_init(&mounted, *camera);
  if (*why) return 0;
  uint32_t rays, samples;
  ray_fan_count(mounted, *static_cast<const wm_edges_params *>(params), &rays, &samples);
  if (rays == 0) {
    *why = "the camera sees no floor within the range: is its mounting right (height above 0, pitch down positive)?";
    return 0;
  }
  bird_view bird;
  *why = view_of(*static_cast<const wm_edges_params *>(params), &bird);
  return *why ? 0 : lay_out(nullptr, rays, samples, bird);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<edges_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->params = *static_cast<const wm_edges_params *>(params);
  state->camera_index = view->cameras[0];
  if (mounted_camera_init(&state->camera, *camera)) return WM_BAD_CONFIG;
  uint32_t rays, samples;
  ray_fan_count(state->camera, state->params, &rays, &samples);
  bird_view bird;
  if (view_of(state->params, &bird)) return WM_BAD_CONFIG;
  lay_out(state, rays, samples, bird);
  if (bird.windows > 0) bird_view_make(state->camera, &state->bird);
  ray_fan_make(state->camera, state->params, &state->fan);
  return WM_OK;
}

// Gradient about the pixel, grey levels per pixel, by the 5 x 5 Sobel operator, which is nearly isotropic.
void slope_at(const wm_frame &frame, const pixel &at, double *gu, double *gv) {
  constexpr int32_t kSmooth[5] = {1, 4, 6, 4, 1}, kDifference[5] = {-1, -2, 0, 2, 1};
  const int u = static_cast<int>(at.u + 0.5) - 2, v = static_cast<int>(at.v + 0.5) - 2;
  int32_t across = 0, down = 0;
  for (int i = 0; i < 5; i++) {
    const uint8_t *row = frame.grey + static_cast<size_t>(v + i) * frame.stride_bytes + u;
    for (int k = 0; k < 5; k++) {
      across += kSmooth[i] * kDifference[k] * row[k];
      down += kDifference[i] * kSmooth[k] * row[k];
    }
  }
  *gu = across / 128.0;
  *gv = down / 128.0;
}

// Pixels behind an edge, across it, on the far side seen along the ray.
struct pixels_behind {
  const wm_frame &frame;
  double u, v, du, dv;

  // -1 outside of the picture.
  int grey(int k) const {
    const int column = static_cast<int>(u + k * du + 0.5), row = static_cast<int>(v + k * dv + 0.5);
    if (column < 0 || row < 0 || column >= static_cast<int>(frame.width_px) || row >= static_cast<int>(frame.height_px))
      return -1;
    return frame.grey[static_cast<size_t>(row) * frame.stride_bytes + static_cast<size_t>(column)];
  }
};

// Whether the band behind the edge is a line on the floor: it ends within `line_px` across it, or within `band_px` and
// the brightness behind it is the floor's, which that of a wall above a board hardly is.
bool is_narrow(const pixels_behind &b, const ray_edge &edge, double line_px, double band_px) {
  const double middle = static_cast<double>(edge.middle), change = static_cast<double>(edge.change);
  for (int k = 2; k < line_px || k < band_px; k++) {
    const int grey = b.grey(k);
    if (grey < 0) return false;
    if (edge.is_fall ? grey <= middle : grey >= middle) continue;
    if (k < line_px) return true;
    double sum = 0;
    for (int i = 1; i <= kBehindBand_px; i++) {
      const int further = b.grey(k + i);
      if (further < 0) return false;
      sum += further;
    }
    const double off = (edge.is_fall ? 1 : -1) * (sum / kBehindBand_px - middle);
    return off > 0 && off < kFloorAgain * change;
  }
  return false;
}

enum class found { kPoint, kLine, kNothing };

// The edge as a point on the floor with its normal and sigma. kLine: the band behind it is narrow, as a joint between
// tiles that the ray meets at a flat angle. kNothing: the edge has no direction.
found floor_point(const edges_state &state, const ray_edge &edge, const wm_frame &frame, wm_points *out) {
  const ray &r = state.fan.rays[edge.ray];
  const double range = range_at(state.fan, r, static_cast<double>(edge.sample));
  const vec3 centre = state.camera.centre_m;
  const double x = centre.x + range * r.cos, y = centre.y + range * r.sin;
  const double step = kStepOfRange * range;
  pixel at, at_x, at_y;
  if (!pixel_of(state.camera, {x, y, 0}, kMargin_px, &at) || !pixel_of(state.camera, {x + step, y, 0}, 0, &at_x) ||
      !pixel_of(state.camera, {x, y + step, 0}, 0, &at_y))
    return found::kNothing;
  double gu, gv;
  slope_at(frame, at, &gu, &gv);
  const double gx = (gu * (at_x.u - at.u) + gv * (at_x.v - at.v)) / step,
               gy = (gu * (at_y.u - at.u) + gv * (at_y.v - at.v)) / step;
  const double picture = std::sqrt(gu * gu + gv * gv), floor = std::sqrt(gx * gx + gy * gy);
  if (!(picture > kSlopeMin_grey_per_px) || !(floor > 0)) return found::kNothing;
  // kLineOfRange is a length along the ray; its width across the edge.
  const double along = gx * r.cos + gy * r.sin, board_px = kLineOfRange * range * std::fabs(along) / picture,
               line_px = kBlur_px + kJoint_m * floor / picture;
  const double sign = edge.is_fall ? -1 : 1;  // down the slope of a fall, up that of a rise
  const pixels_behind across = {frame, at.u, at.v, sign * gu / picture, sign * gv / picture};
  if (is_narrow(across, edge, board_px > line_px ? board_px : line_px, kBlur_px + kBand_m * floor / picture))
    return found::kLine;
  const double noise = kNoise_grey / picture / std::sqrt(kAveragedPixels);
  const double sigma_px = std::sqrt(square(state.params.sigma_px) + square(noise));
  const uint32_t i = out->count++;
  out->x_m[i] = static_cast<float>(x);
  out->y_m[i] = static_cast<float>(y);
  out->normal_rad[i] = static_cast<float>(atan2(-gy, -gx));
  out->sigma_m[i] = static_cast<float>(sigma_px * picture / floor);
  return found::kPoint;
}

void points_of_rays(edges_state *state, const wm_frame &frame, wm_points *points) {
  int32_t rays[WM_POINTS_MAX];
  const double usual = usual_floor(state->fan, frame);
  for (uint32_t i = 0; i < state->fan.ray_count; i++) {
    int from = 0;
    ray_edge edge;
    for (int lines = 0; lines <= kLinesCrossed; lines++, from = static_cast<int>(edge.sample) + 2) {
      if (!find_first_edge(state->fan, i, frame, usual, state->params, from, &state->work, &edge)) break;
      const uint32_t place = points->count;
      if (place == WM_POINTS_MAX) {
        points->dropped++;
        break;
      }
      const found what = floor_point(*state, edge, frame, points);
      if (what == found::kLine) continue;
      if (what == found::kPoint) rays[place] = edge.ray;
      break;
    }
  }
  keep_supported(points, rays, state->camera.centre_m.x, state->camera.centre_m.y, kSupportMin);
}

// Points along a segment of a polyline; the normals point from the bright side to the dark one.
void points_of_segment(const edges_state &state, const line_vertex &from, const line_vertex &to, wm_points *points) {
  const bird_view &bird = state.bird;
  const double dx = static_cast<double>(to.x - from.x), dy = static_cast<double>(to.y - from.y);
  const double size = std::sqrt(dx * dx + dy * dy);
  const int steps = 1 + static_cast<int>(size / (kSpacing_m * bird.px_per_m));
  const double normal = size > 0 ? atan2(dx, -dy) : 0;
  const sin_cos n = sincos(normal);
  for (int k = 0; k < steps; k++) {
    const double x = static_cast<double>(from.x) + (k + 0.5) / steps * dx,
                 y = static_cast<double>(from.y) + (k + 0.5) / steps * dy;
    const auto grey_at = [&](double off) {
      const int u = static_cast<int>(x + off * n.cos + 0.5), v = static_cast<int>(y + off * n.sin + 0.5);
      if (u < 0 || v < 0 || u >= bird.width || v >= bird.height) return 0;
      return static_cast<int>(bird.grey[v * bird.width + u]);
    };
    if (points->count == WM_POINTS_MAX) {
      points->dropped++;
      continue;
    }
    const uint32_t i = points->count++;
    points->x_m[i] = static_cast<float>(bird.x_min_m + x / bird.px_per_m);
    points->y_m[i] = static_cast<float>(bird.y_min_m + y / bird.px_per_m);
    points->normal_rad[i] = static_cast<float>(grey_at(-2) >= grey_at(2) ? wrap(normal) : wrap(normal + kPi));
    points->sigma_m[i] = static_cast<float>(kWindowSigma_m);
  }
}

void points_of_windows(edges_state *state, const wm_frame &frame, wm_points *points) {
  const int pieces = find_pieces(state->bird, frame, state->pieces, state->graph.capacity);
  const int vertices = make_polylines(state->pieces, pieces, {}, &state->graph, state->vertices);
  for (int i = 1; i < vertices; i++) {
    const line_vertex &from = state->vertices[i - 1], &to = state->vertices[i];
    if (from.line == to.line) points_of_segment(*state, from, to, points);
  }
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *state = static_cast<edges_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != state->camera.width_px || frame.height_px != state->camera.height_px) return WM_BAD_DATA;
  if (capacity == 0) return WM_FULL;
  wm_points *points = &out->as.points;
  std::memset(static_cast<void *>(out), 0, WM_EVENT_HEADER_BYTES);
  points->count = points->dropped = 0;
  points->camera = state->camera_index;
  if (state->params.mode == EDGES_BY_WINDOWS) {
    points_of_windows(state, frame, points);
  } else {
    points_of_rays(state, frame, points);
  }
  if (points->count == 0) return WM_OK;
  out->t_ns = frame.t_ns;
  out->kind = WM_EVENT_POINTS;
  *count = 1;
  return WM_OK;
}

}  // namespace

}  // namespace wm

extern "C" const wm_detector wm_edges_detector = {
    .name = "edges",
    .about = "borders of the floor: feet of walls, doors and pillars",
    .gives = WM_EVENT_BIT(WM_EVENT_POINTS),
    .pictures = 1,
    .params = wm_edges_params_table,
    .state_bytes = wm::state_bytes,
    .init = wm::init,
    .detect = wm::detect,
    .is_guided = 0,
    .looked_for = nullptr,
};
