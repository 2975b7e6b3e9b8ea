// SPDX-License-Identifier: Apache-2.0
// Detector `cascade`: objects of a class (signs, posters) by boosted cascades in OpenCV's format, on the camera's
// panorama. Bearing, and range by size, without identity: the filter associates.
#include <cstring>
#include <limits>

#include "math/arc.hpp"
#include "vision/cascade/groups.hpp"
#include "vision/cascade/params.h"
#include "vision/detector.hpp"
#include "vision/registry.h"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/internal/sensors/bearing.hpp"
#include "waymark/internal/vision/cascade/bands.hpp"
#include "waymark/internal/vision/cascade/evaluate.hpp"

namespace wm {
namespace {

constexpr double kSigma_px = 0.3;        // of a detection's middle: the mean of its windows
constexpr double kSigmaOfSize = 0.05;    // the same, in sizes: windows are coarse. From rendered streets; not swept
constexpr double kTilt_rad = 3 * 0.007;  // of the mounting, each axis: extends the searched band
constexpr double kSigmaOfRange = 0.2;    // of the distance, which follows from the window's height
constexpr int kNeighboursMin = 3;        // overlapping windows of a detection (OpenCV's minNeighbors)
constexpr size_t kCascadesMax = 8;       // each costs a pass over the panorama

struct cascade_state {
  wm_cascade_params params;
  mounted_camera camera;
  panorama around;
  pyramid picture;
  window_groups groups;
  const wm_cascade *cascades;
  window_band bands[kCascadesMax];
  size_t count;
  double pixel_rad;
  bool is_steep;
  wm_time_ns readout_ns;
  uint16_t *row;
};

// Heights of the map's landmarks above the camera.
bool heights_of(const wm_view &view, const mounted_camera &camera, double *low_m, double *high_m) {
  *low_m = std::numeric_limits<double>::infinity();
  *high_m = -*low_m;
  for (size_t i = 0; i < view.landmark_count; i++) {
    const double up = view.landmarks[i].p_m[2] - camera.centre_m.z;
    if (!finite(up)) continue;
    *low_m = up < *low_m ? up : *low_m;
    *high_m = larger(*high_m, up);
  }
  return *low_m <= *high_m;
}

const char *why_not(const wm_view &view, const mounted_camera &camera) {
  double low_m, high_m;
  if (view.cascade_count == 0)
    return "no class is given: classes: [{file: sign.xml, height_m: 0.8}], cascades in OpenCV's format";
  if (view.cascade_count > kCascadesMax) return "more than 8 classes";
  if (!heights_of(view, camera, &low_m, &high_m)) return "there is no map of landmarks: landmarks.csv";
  return nullptr;
}

// Lays out the state; returns its bytes.
size_t lay_out(cascade_state *state, const wm_cascade_params &params, const wm_view &view,
               const mounted_camera &camera) {
  memory_layout memory(state, sizeof(cascade_state));
  const auto width = static_cast<int32_t>(camera.width_px), height = static_cast<int32_t>(camera.height_px);
  auto *levels = memory.take<uint8_t>(pyramid_bytes(width, height));
  auto *row = memory.take<uint16_t>(camera.width_px);
  double low_m, high_m;
  heights_of(view, camera, &low_m, &high_m);
  panorama around{};
  double most_rows = 0;
  for (size_t i = 0; i < view.cascade_count; i++) {
    const wm_cascade &c = view.cascades[i];
    const window_band band = band_of(c, low_m, high_m);
    around.need(band.above + c.height_px, c.height_px - band.below);
    most_rows = larger(most_rows, c.height_px);
    if (state) state->bands[i] = band;
  }
  around.plan(camera, kTilt_rad, params.size_min_px / most_rows);
  auto *cylinders = memory.take<uint8_t>(around.bytes());
  if (state) {
    pyramid_lay(&state->picture, width, height, levels);
    state->row = row;
    around.make(camera, cylinders);
    state->around = around;
  }
  return memory.bytes();
}

size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  const wm_camera *camera = first_camera(view, why);
  if (!camera) return 0;
  mounted_camera mounted;
  *why = mounted_camera_init(&mounted, *camera);
  if (!*why) *why = why_not(*view, mounted);
  return *why ? 0 : lay_out(nullptr, *static_cast<const wm_cascade_params *>(params), *view, mounted);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<cascade_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->params = *static_cast<const wm_cascade_params *>(params);
  if (mounted_camera_init(&state->camera, *camera) || why_not(*view, state->camera)) return WM_BAD_CONFIG;
  state->is_steep = is_steep(*camera);
  state->readout_ns = camera->readout_ns;
  state->cascades = view->cascades;
  state->count = view->cascade_count;
  lay_out(state, state->params, *view, state->camera);
  double most_rows = 0;
  for (size_t i = 0; i < state->count; i++) most_rows = larger(most_rows, state->cascades[i].height_px);
  state->pixel_rad = state->around.cylinders[0].step_rad * most_rows / state->params.size_min_px;
  return WM_OK;
}

// All windows of a cascade in one cylinder.
void scan(cascade_state *self, size_t which, const cylinder &c) {
  const wm_cascade &cascade = self->cascades[which];
  const int width = static_cast<int>(cascade.width_px), height = static_cast<int>(cascade.height_px);
  const integral sums = {c.sums, c.squares, c.columns + 1};
  const int stages = static_cast<int>(cascade.stage_count);
  int first, last;
  rows_of(cascade, self->bands[which], c, kTilt_rad, &first, &last);
  for (int y = first; y <= last; y++)
    for (int x = 0; x + width <= c.columns; x++) {
      double surplus;
      const int passed = stages_passed(cascade, sums, x, y, &surplus);
      if (passed <= 0) x++;  // where the first stage fails, the neighbour is skipped, as in OpenCV
      if (passed < stages) continue;
      if (!c.is_seen(x, y) || !c.is_seen(x + width - 1, y) || !c.is_seen(x, y + height - 1) ||
          !c.is_seen(x + width - 1, y + height - 1))
        continue;
      self->groups.add({c.left_rad - (x + 0.5 * (width - 1)) * c.step_rad,
                        (c.horizon - y - 0.5 * (height - 1)) * c.step_rad, width * c.step_rad, height * c.step_rad,
                        static_cast<int>(which)});
    }
}

bool emit(const cascade_state &self, const wm_frame &frame, const window_hit &seen, wm_event *out) {
  const sin_cos a = sincos(seen.azimuth_rad);
  const vec3 ray = transposed_times(self.camera.R_base_optical, {a.cos, a.sin, seen.tangent});
  pixel at;
  if (!project(self.camera.optics, ray, &at)) return false;
  const double flat_m = self.cascades[seen.which].height_m / seen.height;
  const double range_m = flat_m * std::sqrt(1 + square(seen.tangent));
  std::memset(static_cast<void *>(out), 0, WM_EVENT_SMALL_BYTES);
  out->t_ns = time_of_row(frame.t_ns, at.v, frame.height_px, self.readout_ns);
  out->kind = WM_EVENT_SIGHTING;
  const auto sigma = [&](double size) {
    return std::sqrt(square(kSigma_px * self.pixel_rad) + square(kSigmaOfSize * size));
  };
  wm_sighting &s = out->as.sighting = wm_sighting_without_numbers();
  s.bearing_rad = sensor_bearing(self.camera, self.is_steep, ray);
  s.range_m = range_m;
  s.bearing_sigma_rad = sigma(seen.width);
  s.range_sigma_m = kSigmaOfRange * range_m;
  s.elevation_rad = sensor_elevation(self.camera, self.is_steep, ray);
  s.elevation_sigma_rad = sigma(seen.height);
  return true;
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *self = static_cast<cascade_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != self->camera.width_px || frame.height_px != self->camera.height_px) return WM_BAD_DATA;
  pyramid_take(&self->picture, frame, self->row);
  self->around.take(self->picture);
  self->groups.count = 0;
  for (size_t i = 0; i < self->count; i++)
    for (const cylinder &c : self->around.cylinders) scan(self, i, c);
  self->groups.finish(kNeighboursMin);
  for (size_t i = 0; i < self->groups.count && *count < capacity; i++)
    *count += emit(*self, frame, self->groups.list[i].mean, &out[*count]);
  sort_events(out, *count);
  return WM_OK;
}

}  // namespace
}  // namespace wm

extern "C" const wm_detector wm_cascade_detector = {
    .name = "cascade",
    .about =
        "objects of a class (signs, posters) by OpenCV's cascades, LBP or HAAR: bearings and distances without "
        "identities",
    .gives = WM_EVENT_BIT(WM_EVENT_SIGHTING),
    .pictures = 1,
    .params = wm_cascade_params_table,
    .state_bytes = wm::state_bytes,
    .init = wm::init,
    .detect = wm::detect,
    .is_guided = 0,
    .looked_for = nullptr,
};
