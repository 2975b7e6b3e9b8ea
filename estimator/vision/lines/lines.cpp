// SPDX-License-Identifier: Apache-2.0
// Detector `lines`: azimuths of upright lines, each with an identity that it keeps while it is tracked.
#include <cmath>
#include <cstring>
#include <initializer_list>

#include "vision/detector.hpp"
#include "vision/lines/line_tracks.hpp"
#include "vision/registry.h"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/internal/sensors/mounting.hpp"

namespace wm {

namespace {

struct lines_state {
  wm_lines_params params;
  mounted_camera camera;
  sin_cos yaw;        // of the mounting
  bool is_steep;      // bearings are azimuths about the mounting's yaw; else directions in the camera's own axes
  double tilt[2][3];  // rows of the body's x and y axes in base_link
  polar_view polar;
  vote_work work;
  zenith up;
  line_tracks tracks;
  radial_edge edges[kRadialEdgesMax];
};

constexpr double kZenithWalk_rad = 2e-5;  // random walk a picture: springs and load. Not swept
constexpr int32_t kConfirmSeen = 3;       // pictures that must show a line before it is published
constexpr int kLeanSeen = 3;              // pictures that must show a line before it corrects the zenith: no false ones
constexpr double kTiltMin_rad = 1e-6;     // floor of tilt_sigma_rad, so that its variance is positive

// Lays out the state; returns its bytes.
size_t lay_out(lines_state *state, const polar_view &polar) {
  memory_layout memory(state, sizeof *state);
  const size_t columns = static_cast<size_t>(polar.columns), rows = static_cast<size_t>(polar.rows);
  polar_view view = polar;
  view.row = memory.take<polar_row>(rows);
  view.table = memory.take<picture_sample>(rows * columns);
  view.grey = memory.take<int16_t>(rows * static_cast<size_t>(polar.stride()));
  auto *next = memory.take<int16_t>(kVoteArrays * columns);
  if (!state) return memory.bytes();
  state->polar = view;
  const auto take = [&] {
    int16_t *at = next;
    next += columns;
    return at;
  };
  state->work.slope = take();
  for (vote_side *side : {&state->work.rise, &state->work.fall})
    *side = {{take(), take(), take()}, {take(), take(), take()}};
  return memory.bytes();
}

size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  const wm_camera *camera = first_camera(view, why);
  if (!camera) return 0;
  mounted_camera mounted;
  polar_view polar;
  *why = mounted_camera_init(&mounted, *camera);
  if (!*why) *why = polar_size(mounted, *static_cast<const wm_lines_params *>(params), &polar);
  return *why ? 0 : lay_out(nullptr, polar);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<lines_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->params = *static_cast<const wm_lines_params *>(params);
  polar_view polar;
  if (mounted_camera_init(&state->camera, *camera) || polar_size(state->camera, state->params, &polar))
    return WM_BAD_CONFIG;
  lay_out(state, polar);
  polar_make(state->camera, state->params, &state->polar);
  const mat3 body = matrix_of_rpy(camera->mounting.rpy_rad);
  state->is_steep = is_steep_axis(body.m[2][0]);
  state->yaw = sincos(camera->mounting.rpy_rad[2]);
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 3; k++) state->tilt[i][k] = body.m[k][i];
  const double variance = square(larger(state->params.tilt_sigma_rad, kTiltMin_rad));
  state->up = {0, 0, variance, 0, variance};
  state->tracks.clear();
  return WM_OK;
}

// Bearing of an azimuth, positive to the left of the sensor's x axis (sensors/mounting.hpp: of a steep camera about its
// mounting's yaw).
double bearing_of(const lines_state &self, double azimuth_rad) {
  const sin_cos a = sincos(azimuth_rad);
  if (self.is_steep)
    return atan2(self.yaw.cos * a.sin - self.yaw.sin * a.cos, self.yaw.cos * a.cos + self.yaw.sin * a.sin);
  return atan2(self.tilt[1][0] * a.cos + self.tilt[1][1] * a.sin, self.tilt[0][0] * a.cos + self.tilt[0][1] * a.sin);
}

void emit(const lines_state &self, const line_track &track, wm_time_ns t_ns, wm_event *out) {
  const radial_edge &edge = self.edges[track.edge];
  std::memset(static_cast<void *>(out), 0, WM_EVENT_SMALL_BYTES);
  out->t_ns = t_ns;
  out->kind = WM_EVENT_SIGHTING;
  out->as.sighting = wm_sighting_without_numbers();
  out->as.sighting.landmark_id = track.id;
  out->as.sighting.bearing_rad = bearing_of(self, edge.azimuth_rad);
  out->as.sighting.bearing_sigma_rad = edge.sigma_rad;
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *state = static_cast<lines_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != state->camera.width_px || frame.height_px != state->camera.height_px) return WM_BAD_DATA;
  polar_fill(&state->polar, frame);
  const int found = find_radial_edges(state->polar, state->params, state->up, &state->work, state->edges);
  state->tracks.follow(state->edges, found, frame.t_ns);
  if (state->params.tilt_sigma_rad > 0) {
    state->up.xx += square(kZenithWalk_rad);
    state->up.yy += square(kZenithWalk_rad);
  }
  for (const line_track &track : state->tracks.track) {
    if (track.id == 0 || track.edge < 0 || track.seen < kConfirmSeen) continue;
    if (state->params.tilt_sigma_rad > 0 && track.seen >= kLeanSeen)
      correct_zenith(state->edges[track.edge], &state->up);
    if (*count == capacity) return WM_FULL;
    emit(*state, track, frame.t_ns, &out[(*count)++]);
  }
  return WM_OK;
}

}  // namespace

}  // namespace wm

extern "C" const wm_detector wm_lines_detector = {
    .name = "lines",
    .about = "upright lines (corners, door frames, pillars), tracked from picture to picture: azimuths with identities",
    .gives = WM_EVENT_BIT(WM_EVENT_SIGHTING),
    .pictures = 1,
    .params = wm_lines_params_table,
    .state_bytes = wm::state_bytes,
    .init = wm::init,
    .detect = wm::detect,
    .is_guided = 0,
    .looked_for = nullptr,
};
