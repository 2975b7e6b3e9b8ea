// SPDX-License-Identifier: Apache-2.0
// Detector `stereo`: world points in both pictures of a stereo pair, tracked from picture to picture.
#include <cstring>

#include "vision/detector.hpp"
#include "vision/registry.h"
#include "vision/stereo/corners.hpp"
#include "vision/stereo/describe.hpp"
#include "vision/stereo/rectify.hpp"
#include "vision/stereo/track.hpp"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

namespace {

constexpr int32_t kFirstId = 1 << 30;  // landmarks of maps have smaller ids
constexpr int32_t kCell_px = 40;       // side of a cell, each with a track: points are spread over the picture
constexpr double kAgree_px = 1.0;      // from the common motion, each coordinate. Not swept
// Pictures in which a point follows the common motion before it is published: suspended particles do not.
constexpr int32_t kConfirmSeen = 2;
constexpr double kMemory_s = 1.0;       // after a longer gap all tracks end
constexpr int32_t kMargin_px = 12;      // of the full picture: half a patch
constexpr double kCrowded_cells = 0.6;  // smallest distance of two tracks, in cells
constexpr double kMountingError = 0.1;  // largest difference of the mountings from the baseline, in baselines
constexpr int32_t kSideMin_px = 64;     // of a picture: two patches
constexpr int kLevelsKnown = 1, kLevelsUnknown = kLevels - 1;  // of the pyramid, with and without predicted motion

struct stereo_state {
  wm_stereo_params params;
  pair_geometry pair;
  rectification cameras[2];
  pyramid pictures[3];  // left, right, the left one before
  uint16_t *row;
  void *corner_work;
  uint8_t *taken;
  corner *corners;
  track *tracks;
  int32_t cell, cell_count;  // of the picture of half the size

  int32_t track_count, next_id;
  wm_time_ns before_ns;  // of the previous pictures; WM_TIME_NONE: none
  bool has_motion;
  vec3 turn_radps, move_mps;  // of the newest motion: previous camera to current camera
  rigid world_camera;
  uint64_t number;  // of pictures: seed of the random choices
};

const char *cameras_of(const wm_view *view, rectification out[2]) {
  if (!view->rig) return "there is no calibration";
  for (int i = 0; i < 2; i++)
    if (view->cameras[i] < 0 || view->cameras[i] >= static_cast<int32_t>(view->rig->camera_count))
      return "there is no such camera";
  const wm_camera &left = view->rig->cameras[view->cameras[0]], &right = view->rig->cameras[view->cameras[1]];
  const wm_stereo_pair &pair = view->rig->stereo;
  for (int i = 0; i < 2; i++) {
    const char *why = rectification_init(&out[i], i == 0 ? left : right, left, pair.rectified_px);
    if (why) return why;
  }
  if (out[0].width < kSideMin_px || out[0].height < kSideMin_px) return "the pictures are smaller than 64 pixels";
  if (!(pair.baseline_m > 0.0) || !finite(pair.baseline_m)) return "calibration.yaml: stereo needs baseline_m";
  const vec3 beside = transposed_times(out[0].R_base_rectified, out[1].camera.centre_m - out[0].camera.centre_m);
  const vec3 off = beside - vec3{pair.baseline_m, 0, 0};
  if (!(length(off) < kMountingError * pair.baseline_m))
    return "the right camera isn't baseline_m to the right of the left one, by their mountings: are they swapped?";
  return nullptr;
}

// Lays out the state; returns its bytes.
size_t lay_out(stereo_state *state, const rectification cameras[2], const wm_stereo_params &params) {
  const int32_t width = cameras[0].width, height = cameras[0].height, cell = kCell_px / 2;
  const int32_t cells = cells_across(width / 2, cell) * cells_across(height / 2, cell);
  const size_t area = static_cast<size_t>(width) * static_cast<size_t>(height);
  memory_layout memory(state, sizeof *state);
  uint8_t *pictures[3];
  for (uint8_t *&picture : pictures) picture = memory.take<uint8_t>(pyramid_bytes(width, height));
  picture_sample *tables[2];
  for (int i = 0; i < 2; i++) tables[i] = memory.take<picture_sample>(cameras[i].is_rectified ? 0 : area);
  auto *row = memory.take<uint16_t>(static_cast<size_t>(width));
  auto *work = memory.take<uint8_t>(corners_bytes(width / 2)),
       *taken = memory.take<uint8_t>(static_cast<size_t>(cells));
  auto *corners = memory.take<corner>(static_cast<size_t>(cells));
  auto *tracks = memory.take<track>(static_cast<size_t>(params.tracks));
  if (!state) return memory.bytes();
  for (int i = 0; i < 3; i++) pyramid_lay(&state->pictures[i], width, height, pictures[i]);
  for (int i = 0; i < 2; i++) {
    state->cameras[i] = cameras[i];
    state->cameras[i].table = tables[i];
  }
  state->row = row;
  state->corner_work = work;
  state->taken = taken;
  state->corners = corners;
  state->tracks = tracks;
  state->cell = cell;
  state->cell_count = cells;
  return memory.bytes();
}

size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  rectification cameras[2];
  *why = cameras_of(view, cameras);
  return *why ? 0 : lay_out(nullptr, cameras, *static_cast<const wm_stereo_params *>(params));
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  rectification cameras[2];
  if (cameras_of(view, cameras)) return WM_BAD_CONFIG;
  auto *state = static_cast<stereo_state *>(memory);
  const auto &wanted = *static_cast<const wm_stereo_params *>(params);
  std::memset(memory, 0, lay_out(nullptr, cameras, wanted));
  lay_out(state, cameras, wanted);
  state->params = wanted;
  const double *px = view->rig->stereo.rectified_px;
  state->pair = {px[0], px[1], px[2], px[3], view->rig->stereo.baseline_m};
  for (rectification &camera : state->cameras) rectification_table(&camera);
  state->before_ns = WM_TIME_NONE;
  state->next_id = kFirstId;
  state->world_camera = kIdentityMotion;
  return WM_OK;
}

// Rectified pyramids of both pictures and of the previous left one. False where the picture is identical to the
// previous one: a stuck camera.
bool take_pictures(stereo_state *self, const wm_frame *frames) {
  const pyramid before = self->pictures[2];
  self->pictures[2] = self->pictures[0];
  self->pictures[0] = before;
  for (int i = 0; i < 2; i++) {
    rectify(self->cameras[i], frames[i], self->pictures[i].level[0]);
    pyramid_build(&self->pictures[i], self->row);
  }
  const grey_plane &now = self->pictures[0].level[0], &then = self->pictures[2].level[0];
  return std::memcmp(now.grey, then.grey, static_cast<size_t>(now.width) * static_cast<size_t>(now.height)) != 0;
}

void end_tracks(stereo_state *self) {
  self->track_count = 0;
  self->has_motion = false;
}

bool is_visible(const stereo_state &self, const track &one) {
  return sees(self.cameras[0], one.left, kMargin_px) && sees(self.cameras[1], one.right, kMargin_px);
}

// Whether the track has drifted from its prediction by the motion since its beginning: an occluding contour, a slow
// particle.
bool has_slipped(const stereo_state &self, const track &one) {
  pair_pixels px;
  if (!pixels_of(self.pair, inverse(self.world_camera) * (one.world_anchor * one.anchor_place), &px)) return true;
  const double limit = kAgree_px;
  return std::fabs(px.left_u - one.left.u) > limit || std::fabs(px.left_v - one.left.v) > limit ||
         std::fabs(px.right_u - one.right.u) > limit;
}

// Follows all tracks into the newest pictures. Ends those that are lost or disagree with the common motion.
void follow(stereo_state *self, double dt_s) {
  rigid expected = kIdentityMotion;
  if (self->has_motion) expected = {matrix_of(turn_by(dt_s * self->turn_radps)), dt_s * self->move_mps};
  const pair_pictures pictures = {&self->pictures[2], &self->pictures[0], &self->pictures[1]};
  const rigid camera_world = expected * inverse(self->world_camera);
  const int levels = self->has_motion ? kLevelsKnown : kLevelsUnknown;
  seen_twice points[STEREO_TRACKS_MAX];
  int32_t kept = 0;
  for (int32_t i = 0; i < self->track_count; i++) {
    track &one = self->tracks[i];
    const vec3 before = one.place;
    if (!follow_track(self->pair, pictures, self->params, expected, camera_world, levels, &one)) continue;
    if (!is_visible(*self, one)) continue;
    points[kept] = {before, {one.left.u, one.left.v, one.right.u}};
    if (kept != i) self->tracks[kept] = one;
    kept++;
  }
  self->track_count = kept;
  uint8_t agrees[STEREO_TRACKS_MAX];
  rigid moved;
  if (!find_motion(self->pair, points, kept, self->has_motion ? &expected : nullptr, kAgree_px, self->number, &moved,
                   agrees)) {
    end_tracks(self);
    return;
  }
  self->world_camera = self->world_camera * inverse(moved);
  self->track_count = 0;
  for (int32_t i = 0; i < kept; i++) {
    if (!agrees[i] || has_slipped(*self, self->tracks[i])) continue;
    if (self->track_count != i) self->tracks[self->track_count] = self->tracks[i];
    self->track_count++;
  }
  self->turn_radps = (1.0 / dt_s) * turn_of(quat_of(moved.R));
  self->move_mps = (1.0 / dt_s) * moved.t;
  self->has_motion = true;
}

bool is_crowded(const stereo_state &self, const pixel &at) {
  const double apart = kCrowded_cells * kCell_px;
  for (int32_t i = 0; i < self.track_count; i++)
    if (std::fabs(self.tracks[i].left.u - at.u) < apart && std::fabs(self.tracks[i].left.v - at.v) < apart) return true;
  return false;
}

// Begins tracks where there are none, the strongest corners first.
void begin(stereo_state *self) {
  const int32_t wanted = self->params.tracks;
  if (self->track_count == wanted) return;
  const grey_plane &half = self->pictures[0].level[1];
  const int32_t columns = cells_across(half.width, self->cell);
  std::memset(self->taken, 0, static_cast<size_t>(self->cell_count));
  for (int32_t i = 0; i < self->track_count; i++) {
    const pixel &at = self->tracks[i].left;
    const auto column = static_cast<int32_t>(at.u / 2) / self->cell, row = static_cast<int32_t>(at.v / 2) / self->cell;
    const int32_t cell = row * columns + column;
    if (cell >= 0 && cell < self->cell_count) self->taken[cell] = 1;
  }
  find_corners(half, self->cell, kMargin_px / 2, self->taken, self->corner_work, self->corners);
  const pair_pictures pictures = {&self->pictures[2], &self->pictures[0], &self->pictures[1]};
  const double weakest = square(self->params.noise_grey / kSigmaMax_px);
  while (self->track_count < wanted) {
    corner *best = nullptr;
    for (int32_t i = 0; i < self->cell_count; i++)
      if (self->corners[i].strength > (best ? best->strength : 0.0F)) best = &self->corners[i];
    if (!best || static_cast<double>(best->strength) < weakest) return;
    best->strength = 0.0F;
    const pixel at = {2.0 * best->u, 2.0 * best->v};
    track &one = self->tracks[self->track_count];
    if (is_crowded(*self, at)) continue;
    if (!begin_track(self->pair, pictures, self->params, at, self->world_camera, &one) || !is_visible(*self, one))
      continue;
    one.id = self->next_id;
    self->next_id = self->next_id == INT32_MAX ? kFirstId : self->next_id + 1;
    self->track_count++;
  }
}

size_t emit(const stereo_state &self, wm_time_ns t_ns, wm_event *out, size_t capacity) {
  size_t count = 0;
  for (int32_t i = 0; i < self.track_count && count < capacity; i++) {
    const track &one = self.tracks[i];
    if (one.seen < kConfirmSeen) continue;
    wm_event &event = out[count++];
    std::memset(static_cast<void *>(&event), 0, WM_EVENT_SMALL_BYTES);
    event.t_ns = t_ns;
    event.kind = WM_EVENT_STEREO;
    event.as.stereo = {one.id, {one.left.u, one.left.v}, {one.right.u, one.right.v}, {}};
    describe(self.pictures[0], one.left, self.pair.fu / one.place.z, event.as.stereo.appearance);
  }
  return count;
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *self = static_cast<stereo_state *>(memory);
  *count = 0;
  for (int i = 0; i < 2; i++)
    if (frames[i].width_px != self->cameras[i].camera.width_px ||
        frames[i].height_px != self->cameras[i].camera.height_px)
      return WM_BAD_DATA;
  const wm_time_ns t_ns = frames[0].t_ns;
  const double dt_s = self->before_ns == WM_TIME_NONE ? -1.0 : wm_seconds_between(self->before_ns, t_ns);
  self->number++;
  const bool is_new = take_pictures(self, frames);
  if (!(dt_s > 0.0) || dt_s > kMemory_s) end_tracks(self);
  if (!is_new && dt_s > 0.0) return WM_OK;
  self->before_ns = t_ns;
  if (self->track_count > 0) follow(self, dt_s);
  begin(self);
  *count = emit(*self, t_ns, out, capacity);
  return WM_OK;
}

}  // namespace

}  // namespace wm

extern "C" const wm_detector wm_stereo_detector = {
    .name = "stereo",
    .about = "World points in both pictures of a stereo pair, tracked from picture to picture: for stereo_ekf",
    .gives = WM_EVENT_BIT(WM_EVENT_STEREO),
    .pictures = 2,
    .params = wm_stereo_params_table,
    .state_bytes = wm::state_bytes,
    .init = wm::init,
    .detect = wm::detect,
    .is_guided = 0,
    .looked_for = nullptr,
};
