// SPDX-License-Identifier: Apache-2.0
// Detector `landmarks`: known signs, house numbers, windows, found by how they look where the pose says they should be.
#include <cstring>
#include <initializer_list>
#include <limits>

#include "vision/landmarks/align.hpp"
#include "vision/landmarks/guess.hpp"
#include "vision/landmarks/match.hpp"
#include "vision/landmarks/params.h"
#include "vision/parts.hpp"
#include "vision/registry.h"

namespace wm {

namespace {

constexpr double kSteep = 0.7071;  // as in the filters' sensor model
constexpr double kAreaMax = 2000;  // px of a level: larger landmarks are measured in a smaller picture
constexpr double kBlurred = 0.35;  // share of the contrast that a landmark should have
constexpr double kSmall_px = 30;   // a landmark of n pixels needs a likeness of 1 - (1 - min) n / (n + this)
constexpr double kEdge_px = 2;     // of the picture
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct landmarks_state {
  wm_landmarks_params params;
  mounted_camera camera;
  bool steep;
  wm_time_ns readout_ns;
  ray_table rays;
  pyramid picture;
  uint16_t *row;
  int count;
  appearance *known;
  wm_looked_for *looks;
  float *scores;
  raster drawn;
  align_work work;
};

const wm_landmark *landmark_of(const wm_view &view, int32_t id) {
  for (size_t i = 0; i < view.landmark_count; i++)
    if (view.landmarks[i].id == id) return &view.landmarks[i];
  return nullptr;
}

bool is_usable(const wm_view &view, const wm_appearance &a) {
  return landmark_of(view, a.landmark_id) && a.grey && a.width_px >= 4 && a.height_px >= 4 && a.width_m > 0 &&
         a.height_m > 0 && finite(a.yaw_rad);
}

// Puts the state's parts one behind the other; returns the bytes of all.
size_t lay_out(landmarks_state *state, const wm_view &view, const wm_camera &camera) {
  parts memory(state, sizeof(landmarks_state));
  const auto width = static_cast<int32_t>(camera.width_px), height = static_cast<int32_t>(camera.height_px);
  auto *rays = memory.take<uint8_t>(ray_table::bytes(camera.width_px, camera.height_px));
  const size_t level_bytes = pyramid_bytes(width, height) + kReadBehind;
  auto *levels = memory.take<uint8_t>(level_bytes);
  auto *row = memory.take<uint16_t>(camera.width_px);
  auto *scores = memory.take<float>(static_cast<size_t>(kReachSide) * kReachSide);
  size_t count = 0;
  for (size_t i = 0; i < view.appearance_count; i++) count += is_usable(view, view.appearances[i]);
  auto *known = memory.take<appearance>(count);
  auto *looks = memory.take<wm_looked_for>(count);
  if (state) {
    state->rays.make(state->camera.optics, camera.width_px, camera.height_px, rays);
    std::memset(levels, 0, level_bytes);
    pyramid_lay(&state->picture, width, height, levels);
    state->row = row;
    state->scores = scores;
    state->known = known;
    state->looks = looks;
    state->count = 0;
  }
  for (size_t i = 0; i < view.appearance_count; i++) {
    const wm_appearance &a = view.appearances[i];
    if (!is_usable(view, a)) continue;
    auto *pictures = memory.take<uint8_t>(appearance::bytes(a.width_px, a.height_px));
    if (state) state->known[state->count++].make(a, *landmark_of(view, a.landmark_id), pictures);
  }
  return memory.bytes();
}

size_t state_bytes(const void *, const wm_view *view, const char **why) {
  const wm_camera *camera = first_camera(view, why);
  if (!camera) return 0;
  mounted_camera mounted;
  *why = mounted_camera_init(&mounted, *camera);
  if (!*why && view->appearance_count == 0)
    *why =
        "nothing says how a landmark looks: landmarks/appearance.csv beside landmarks.csv (waymark map "
        "add-landmark makes it)";
  bool usable = false;
  for (size_t i = 0; i < view->appearance_count; i++) usable |= is_usable(*view, view->appearances[i]);
  if (!*why && !usable) *why = "no landmark of landmarks/appearance.csv stands in landmarks.csv: are they of one map?";
  return *why ? 0 : lay_out(nullptr, *view, *camera);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<landmarks_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->params = *static_cast<const wm_landmarks_params *>(params);
  if (mounted_camera_init(&state->camera, *camera)) return WM_BAD_CONFIG;
  state->steep = std::fabs(matrix_of_rpy(camera->mounting.rpy_rad).m[2][0]) > kSteep;
  state->readout_ns = camera->readout_ns;
  lay_out(state, *view, *camera);
  return WM_OK;
}

// A pixel as the filters' sensor model has it: the angle from the camera's axis to the left, in the camera's own axes;
// of a camera that looks up or down the azimuth about its mounting's yaw.
double bearing_of(const landmarks_state &self, const vec3 &ray) {
  if (!self.steep) return atan2(-ray.x, ray.z);
  const vec3 r = self.camera.R_base_optical * ray;
  // The body's x and y axes in base_link are the optical z and minus x axes.
  const auto &m = self.camera.R_base_optical.m;
  const double yaw = atan2(m[0][1] * m[2][2] < 0 ? m[1][1] : m[1][2], m[0][1] * m[2][2] < 0 ? m[0][1] : m[0][2]);
  return wrap(atan2(r.y, r.x) - yaw);
}

struct candidate {
  const appearance *what;
  panel_view view;
  pixel middle, corners[4];
  double shorter_px;
  int level;
};

// Whether the landmark should be in this picture, and how.
wm_look expect_landmark(const landmarks_state &self, const camera_guess &guess, const appearance &what,
                        candidate *out) {
  out->what = &what;
  if (!view_panel(what, guess.R_map_optical, guess.eye_m, &out->view)) return WM_LOOK_FACES_AWAY;
  if (!(out->view.distance < self.params.range_max_m)) return WM_LOOK_NOT_IN_VIEW;
  const auto in_picture = [&](const vec3 &point, pixel *at) {
    return project(self.camera.optics, point, at) && at->u >= kEdge_px && at->v >= kEdge_px &&
           at->u <= self.camera.width_px - 1 - kEdge_px && at->v <= self.camera.height_px - 1 - kEdge_px;
  };
  if (!in_picture(out->view.middle, &out->middle)) return WM_LOOK_NOT_IN_VIEW;
  if (!(out->view.facing >= self.params.facing_min)) return WM_LOOK_FACES_AWAY;
  const sin_cos yaw = sincos(what.yaw_rad);
  const vec3 right =
                 transposed_times(guess.R_map_optical, {0.5 * what.width_m * yaw.cos, 0.5 * what.width_m * yaw.sin, 0}),
             up = transposed_times(guess.R_map_optical, {0, 0, 0.5 * what.height_m}), m = out->view.middle;
  const vec3 corners[4] = {m - right + up, m + right + up, m + right - up, m - right - up};
  for (int i = 0; i < 4; i++)
    if (!in_picture(corners[i], &out->corners[i])) return WM_LOOK_NOT_IN_VIEW;
  const auto side = [&](int a, int b) {
    return std::sqrt(square(out->corners[a].u - out->corners[b].u) + square(out->corners[a].v - out->corners[b].v));
  };
  const double wide = 0.5 * (side(0, 1) + side(2, 3)), high = 0.5 * (side(1, 2) + side(3, 0));
  out->shorter_px = wide < high ? wide : high;
  if (!(out->shorter_px >= self.params.size_min_px)) return WM_LOOK_TOO_SMALL;
  out->level = 0;
  const double longer = wide < high ? high : wide;
  while (out->level + 1 < kLevels &&
         (wide * high > kAreaMax * (1 << (2 * out->level)) || 1.1 * longer + 4 > (raster::kSide << out->level)))
    out->level++;
  return WM_LOOK_FOUND;
}

double likeness_needed(const landmarks_state &self, int pixels) {
  return 1 - (1 - self.params.likeness_min) * pixels / (pixels + kSmall_px);
}

struct sight {
  pixel at;
  double uu, uv, vv, likeness;
};

// Looks for it about where it is expected.
wm_look look_for(landmarks_state *self, const candidate &one, double across_px, double down_px, sight *out) {
  out->likeness = kNan;
  if (!draw(*one.what, one.view, self->rays, one.corners, one.level, self->params.blur_px, &self->drawn))
    return WM_LOOK_NOT_IN_VIEW;
  const double step = 1 << one.level;
  const double across = across_px / step + 1, down = down_px / step + 1;
  if (!(across < kReachMax) || !(down < kReachMax)) return WM_LOOK_UNCERTAIN;
  const grey_plane &picture = self->picture.level[one.level];
  best_place best;
  if (!search_window(picture, self->drawn, static_cast<int>(across), static_cast<int>(down), self->scores, &best))
    return WM_LOOK_NOT_IN_VIEW;
  out->likeness = best.likeness;
  if (best.spread_grey < self->params.contrast_grey) return WM_LOOK_LOW_CONTRAST;
  const double needed = likeness_needed(*self, self->drawn.count);
  if (best.likeness < needed - 0.1)
    return best.spread_grey < kBlurred * self->drawn.spread_grey ? WM_LOOK_BLURRED : WM_LOOK_UNLIKE;
  aligned fine;
  const pixel middle = {one.middle.u / step, one.middle.v / step};
  if (!align_landmark(picture, self->drawn, middle, best.right, best.down, &self->work, &fine)) return WM_LOOK_UNLIKE;
  out->likeness = fine.likeness;
  if (fine.likeness < needed) return WM_LOOK_UNLIKE;
  if (best.second > larger(fine.likeness, best.likeness) - self->params.apart_min) return WM_LOOK_AMBIGUOUS;
  const double scale = square(step * self->params.sigma_factor),
               floor = square(self->params.sigma_px) + square(self->params.sigma_size * step) * self->drawn.count;
  out->at = {fine.middle.u * step, fine.middle.v * step};
  out->uu = scale * fine.uu + floor;
  out->uv = scale * fine.uv;
  out->vv = scale * fine.vv + floor;
  return WM_LOOK_FOUND;
}

bool put(const landmarks_state &self, const wm_frame &frame, int32_t id, const sight &seen, wm_event *out) {
  constexpr double kStep_px = 0.5;
  vec3 ray, right, left, below, above;
  if (!unproject(self.camera.optics, seen.at, &ray) ||
      !unproject(self.camera.optics, {seen.at.u + kStep_px, seen.at.v}, &right) ||
      !unproject(self.camera.optics, {seen.at.u - kStep_px, seen.at.v}, &left) ||
      !unproject(self.camera.optics, {seen.at.u, seen.at.v + kStep_px}, &below) ||
      !unproject(self.camera.optics, {seen.at.u, seen.at.v - kStep_px}, &above))
    return false;
  const double by_u = wrap(bearing_of(self, right) - bearing_of(self, left)) / (2 * kStep_px),
               by_v = wrap(bearing_of(self, below) - bearing_of(self, above)) / (2 * kStep_px);
  const double variance = by_u * by_u * seen.uu + 2 * by_u * by_v * seen.uv + by_v * by_v * seen.vv;
  if (!(variance > 0)) return false;
  std::memset(static_cast<void *>(out), 0, WM_EVENT_SMALL_BYTES);
  const double row = (seen.at.v - 0.5 * (frame.height_px - 1)) / (frame.height_px - 1);
  out->t_ns = frame.t_ns + static_cast<wm_time_ns>(std::floor(row * static_cast<double>(self.readout_ns) + 0.5));
  out->kind = WM_EVENT_SIGHTING;
  out->as.sighting = {0, id, bearing_of(self, ray), kNan, std::sqrt(variance), kNan};
  return true;
}

void take_picture(landmarks_state *self, const wm_frame &frame) {
  const grey_plane &whole = self->picture.level[0];
  for (int32_t y = 0; y < whole.height; y++)
    std::memcpy(whole.grey + static_cast<size_t>(y) * static_cast<size_t>(whole.width),
                frame.grey + static_cast<size_t>(y) * frame.stride_bytes, frame.width_px);
  pyramid_build(&self->picture, self->row);
}

// In the order of their rows' times, one for each landmark: the one that is most like it.
size_t in_order(wm_event *events, double *likeness, size_t count) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    const wm_event event = events[i];
    const double like = likeness[i];
    size_t same = 0;
    while (same < kept && events[same].as.sighting.landmark_id != event.as.sighting.landmark_id) same++;
    if (same < kept) {
      if (likeness[same] >= like) continue;
      for (size_t k = same + 1; k < kept; k++) events[k - 1] = events[k], likeness[k - 1] = likeness[k];
      kept--;
    }
    size_t at = kept++;
    for (; at > 0 && events[at - 1].t_ns > event.t_ns; at--)
      events[at] = events[at - 1], likeness[at] = likeness[at - 1];
    events[at] = event;
    likeness[at] = like;
  }
  return kept;
}

constexpr size_t kFoundMax = 128;

double middle_of(double *values, size_t count) {
  for (size_t i = 1; i < count; i++)
    for (size_t k = i; k > 0 && values[k - 1] > values[k]; k--) {
      const double swapped = values[k];
      values[k] = values[k - 1];
      values[k - 1] = swapped;
    }
  return values[count / 2];
}

// A turned camera moves all landmarks of a picture alike, a wrong place each by its distance: who is elsewhere than the
// others say was taken for something else. Returns how many stay.
size_t drop_strays(landmarks_state *self, camera_guess guess, const int *which, wm_event *events, double *likeness,
                   size_t count) {
  constexpr size_t kOpinions = 4;
  constexpr double kSigmas = 4, kLens_px = 2.5;  // a lens and a roll that aren't as calibrated move them unlike
  if (count < kOpinions) return count;
  double common[2], values[kFoundMax];
  const auto moved = [&](size_t i, int axis) {
    const wm_looked_for &look = self->looks[which[i]];
    return look.found_px[axis] - look.expected_px[axis];
  };
  for (int axis = 0; axis < 2; axis++) {
    for (size_t i = 0; i < count; i++) values[i] = moved(i, axis);
    common[axis] = middle_of(values, count);
  }
  for (double *row : {guess.cov[0], guess.cov[1], guess.cov[2]}) row[2] = 0;
  guess.cov[2][0] = guess.cov[2][1] = 0;
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    double allowed[2];
    expected_spread(self->camera, guess, self->known[which[i]], 0, &allowed[0], &allowed[1]);
    if (std::fabs(moved(i, 0) - common[0]) < kSigmas * allowed[0] + kLens_px &&
        std::fabs(moved(i, 1) - common[1]) < kSigmas * allowed[1] + kLens_px) {
      events[kept] = events[i];
      likeness[kept++] = likeness[i];
    } else {
      wm_looked_for &look = self->looks[which[i]];
      look.look = WM_LOOK_UNLIKE;
      look.found_px[0] = look.found_px[1] = kNan;
    }
  }
  return kept;
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *prediction, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *self = static_cast<landmarks_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != self->camera.width_px || frame.height_px != self->camera.height_px) return WM_BAD_DATA;
  camera_guess guess;
  const bool guessed = guess_camera(self->camera, prediction, frame.t_ns, &guess);
  if (guessed) take_picture(self, frame);
  double likeness[kFoundMax];
  int which[kFoundMax];
  size_t found = 0;
  for (int i = 0; i < self->count; i++) {
    const appearance &what = self->known[i];
    wm_looked_for &look = self->looks[i];
    look = {what.id, WM_LOOK_UNCERTAIN, {kNan, kNan}, {kNan, kNan}, kNan};
    candidate one;
    if (!guessed) continue;
    look.look = static_cast<uint8_t>(expect_landmark(*self, guess, what, &one));
    if (look.look != WM_LOOK_FOUND) continue;
    look.expected_px[0] = one.middle.u;
    look.expected_px[1] = one.middle.v;
    double across_px, down_px;
    expected_spread(self->camera, guess, what, self->params.mounting_sigma_rad, &across_px, &down_px);
    const double sigmas = self->params.window_sigmas;
    sight seen;
    look.look = static_cast<uint8_t>(larger(across_px, down_px) * sigmas > self->params.window_max_px
                                         ? WM_LOOK_UNCERTAIN
                                         : look_for(self, one, sigmas * across_px, sigmas * down_px, &seen));
    if (look.look != WM_LOOK_UNCERTAIN) look.likeness = seen.likeness;
    if (look.look != WM_LOOK_FOUND || found == capacity || found == kFoundMax) continue;
    if (!put(*self, frame, what.id, seen, &out[found])) continue;
    look.found_px[0] = seen.at.u;
    look.found_px[1] = seen.at.v;
    which[found] = i;
    likeness[found++] = seen.likeness;
  }
  found = drop_strays(self, guess, which, out, likeness, found);
  *count = in_order(out, likeness, found);
  return WM_OK;
}

size_t looked_for(const void *memory, wm_looked_for *out, size_t capacity) {
  const auto *self = static_cast<const landmarks_state *>(memory);
  for (int i = 0; i < self->count && static_cast<size_t>(i) < capacity; i++) out[i] = self->looks[i];
  return static_cast<size_t>(self->count);
}

}  // namespace

}  // namespace wm

extern "C" const wm_detector wm_landmarks_detector = {
    "landmarks",
    "known landmarks (signs, house numbers, windows) by how they look: bearings with identities and sigmas",
    WM_EVENT_BIT(WM_EVENT_SIGHTING),
    1,
    wm_landmarks_params_table,
    wm::state_bytes,
    wm::init,
    wm::detect,
    1,
    wm::looked_for,
};
