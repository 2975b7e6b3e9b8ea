// SPDX-License-Identifier: Apache-2.0
// Detector `landmarks`: known signs, house numbers and windows, found by their appearance: around their expected
// places, and in the whole picture while there is no pose or the pose leads to none.
#include <cstring>
#include <initializer_list>
#include <limits>

#include "vision/detector.hpp"
#include "vision/landmarks/recognise.hpp"
#include "vision/registry.h"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/internal/sensors/bearing.hpp"

namespace wm {

namespace {

constexpr size_t kFoundMax = 128;      // sightings of a picture: bounds the memory
constexpr double kWindowSigmas = 3.5;  // half width of the search window: 1 in 2000 landmarks outside
constexpr double kWindowMax_px = 64;   // a landmark with a larger window is not searched: cost, look-alikes
constexpr int kTries = 8;        // hypotheses verified at full resolution per picture at kRate_hz: bounds the cost
constexpr size_t kAgreeing = 3;  // landmarks that one pose must explain where the first one is not alike enough alone
constexpr double kSearchAfter_s = 0.5;   // without a landmark that the pose led to: the whole picture is searched, too
constexpr double kRate_hz = 30.0;        // of pictures, for which search_places is given
constexpr double kBudgetMax = 8.0;       // times that budget at lower rates
constexpr size_t kExpectedPerFound = 5;  // a pose that finds less than 1 in 5 expected landmarks is doubtful. Not swept
constexpr double kStep_px = 0.5;         // of the numerical derivative of a bearing
constexpr size_t kOutlierMin = 4;        // landmarks from which the median shift can expose an outlier
constexpr double kSigmas = 4, kLens_px = 2.5;  // gate about the median shift; residuals of the lens model
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The camera's pose by landmarks recognised in a picture, and the robot's twist then.
struct recognised_pose {
  wm_time_ns t_ns;  // WM_TIME_NONE: none
  camera_guess guess;
  vec3 v_mps, w_radps;
};

struct landmarks_state {
  matcher eye;
  global_search search;
  bool is_steep;
  wm_time_ns readout_ns;
  wm_time_ns found_ns;   // when the pose last led to a landmark
  wm_time_ns before_ns;  // of the previous picture
  recognised_pose place;
  uint16_t *row;
  int count;
  appearance *known;
  wm_looked_for *looks;
};

// Roll and pitch of the camera against its mounting that a search allows for.
double tilt_of(const wm_landmarks_params &params) { return 3 * params.mounting_sigma_rad; }

const wm_landmark *landmark_of(const wm_view &view, int32_t id) {
  for (size_t i = 0; i < view.landmark_count; i++)
    if (view.landmarks[i].id == id) return &view.landmarks[i];
  return nullptr;
}

bool is_usable(const wm_view &view, const wm_appearance &a) {
  return landmark_of(view, a.landmark_id) && a.grey && a.width_px >= 4 && a.height_px >= 4 && a.width_m > 0 &&
         a.height_m > 0 && finite(a.yaw_rad);
}

// Lays out the state; returns its bytes.
size_t lay_out(landmarks_state *state, const wm_landmarks_params &params, const wm_view &view,
               const mounted_camera &camera) {
  memory_layout memory(state, sizeof(landmarks_state));
  const auto width = static_cast<int32_t>(camera.width_px), height = static_cast<int32_t>(camera.height_px);
  auto *rays = memory.take<uint8_t>(ray_table::bytes(camera.width_px, camera.height_px));
  const size_t level_bytes = pyramid_bytes(width, height) + kReadBehind;
  auto *levels = memory.take<uint8_t>(level_bytes);
  auto *row = memory.take<uint16_t>(camera.width_px);
  auto *scores = memory.take<float>(static_cast<size_t>(kReachSide) * kReachSide);
  size_t count = 0;
  global_search search{};
  for (size_t i = 0; i < view.appearance_count; i++) {
    const wm_appearance &a = view.appearances[i];
    if (!is_usable(view, a)) continue;
    count++;
    search.need(camera, a.width_m, a.height_m, landmark_of(view, a.landmark_id)->p_m[2]);
  }
  auto *known = memory.take<appearance>(count);
  auto *looks = memory.take<wm_looked_for>(count);
  search.around.plan(camera, tilt_of(params));
  auto *around = memory.take<uint8_t>(search.around.bytes());
  if (state) {
    state->eye.rays.make(camera.optics, camera.width_px, camera.height_px, rays);
    std::memset(levels, 0, level_bytes);
    pyramid_lay(&state->eye.picture, width, height, levels);
    state->eye.scores = scores;
    state->row = row;
    state->known = known;
    state->looks = looks;
    state->count = 0;
    search.around.make(camera, around);
    state->search = search;
  }
  for (size_t i = 0; i < view.appearance_count; i++) {
    const wm_appearance &a = view.appearances[i];
    if (!is_usable(view, a)) continue;
    auto *pictures = memory.take<uint8_t>(appearance::bytes(a.width_px, a.height_px));
    if (state) state->known[state->count++].make(a, *landmark_of(view, a.landmark_id), pictures);
  }
  return memory.bytes();
}

size_t state_bytes(const void *params, const wm_view *view, const char **why) {
  const wm_camera *camera = first_camera(view, why);
  if (!camera) return 0;
  mounted_camera mounted;
  *why = mounted_camera_init(&mounted, *camera);
  if (!*why && view->appearance_count == 0)
    *why =
        "no landmark has an appearance: landmarks/appearance.csv beside landmarks.csv is needed (waymark map "
        "add-landmark makes it)";
  bool usable = false;
  for (size_t i = 0; i < view->appearance_count; i++) usable |= is_usable(*view, view->appearances[i]);
  if (!*why && !usable) *why = "no landmark of landmarks/appearance.csv stands in landmarks.csv: are they of one map?";
  return *why ? 0 : lay_out(nullptr, *static_cast<const wm_landmarks_params *>(params), *view, mounted);
}

wm_status init(void *memory, const void *params, const wm_view *view) {
  const char *why;
  const wm_camera *camera = first_camera(view, &why);
  if (!camera) return WM_BAD_CONFIG;
  auto *state = static_cast<landmarks_state *>(memory);
  std::memset(static_cast<void *>(state), 0, sizeof *state);
  state->eye.params = *static_cast<const wm_landmarks_params *>(params);
  if (mounted_camera_init(&state->eye.camera, *camera)) return WM_BAD_CONFIG;
  state->is_steep = is_steep(*camera);
  state->readout_ns = camera->readout_ns;
  state->found_ns = state->before_ns = state->place.t_ns = WM_TIME_NONE;
  lay_out(state, state->eye.params, *view, state->eye.camera);
  return WM_OK;
}

double bearing_of(const landmarks_state &self, const vec3 &ray) {
  return sensor_bearing(self.eye.camera, self.is_steep, ray);
}

double elevation_of(const landmarks_state &self, const vec3 &ray) {
  return sensor_elevation(self.eye.camera, self.is_steep, ray);
}

bool emit(const landmarks_state &self, const wm_frame &frame, const camera_guess &guess, const expected_view &one,
          const landmark_match &seen, wm_event *out) {
  vec3 ray, right, left, below, above;
  if (!unproject(self.eye.camera.optics, seen.at, &ray) ||
      !unproject(self.eye.camera.optics, {seen.at.u + kStep_px, seen.at.v}, &right) ||
      !unproject(self.eye.camera.optics, {seen.at.u - kStep_px, seen.at.v}, &left) ||
      !unproject(self.eye.camera.optics, {seen.at.u, seen.at.v + kStep_px}, &below) ||
      !unproject(self.eye.camera.optics, {seen.at.u, seen.at.v - kStep_px}, &above))
    return false;
  const double by_u = wrap(bearing_of(self, right) - bearing_of(self, left)) / (2 * kStep_px),
               by_v = wrap(bearing_of(self, below) - bearing_of(self, above)) / (2 * kStep_px);
  const double up_by_u = (elevation_of(self, right) - elevation_of(self, left)) / (2 * kStep_px),
               up_by_v = (elevation_of(self, below) - elevation_of(self, above)) / (2 * kStep_px);
  // A wrong heading distorts the drawn perspective, which moves the fitted middle.
  const double bent = square(0.5 * one.what->width_m / one.view.distance);
  const auto variance_by = [&seen](double u, double v) {
    return u * u * seen.uu + 2 * u * v * seen.uv + v * v * seen.vv;
  };
  const double variance = variance_by(by_u, by_v) + bent * bent * guess.cov[2][2],
               up_variance = variance_by(up_by_u, up_by_v);
  if (!(variance > 0) || !(up_variance > 0)) return false;
  std::memset(static_cast<void *>(out), 0, WM_EVENT_SMALL_BYTES);
  out->t_ns = time_of_row(frame.t_ns, seen.at.v, frame.height_px, self.readout_ns);
  out->kind = WM_EVENT_SIGHTING;
  wm_sighting &s = out->as.sighting = wm_sighting_without_numbers();
  s.landmark_id = one.what->id;
  s.bearing_rad = bearing_of(self, ray);
  s.bearing_sigma_rad = std::sqrt(variance);
  s.elevation_rad = elevation_of(self, ray);
  s.elevation_sigma_rad = std::sqrt(up_variance);
  return true;
}

// Keeps one event per landmark, the one of the largest likeness, and sorts them by the times of their rows.
size_t best_in_order(wm_event *events, double *likeness, size_t count) {
  const auto is_same = [&](size_t a, size_t b) {
    return events[a].as.sighting.landmark_id == events[b].as.sighting.landmark_id;
  };
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    bool is_best = true;
    for (size_t k = 0; k < kept && is_best; k++) is_best = !(is_same(k, i) && likeness[k] >= likeness[i]);
    for (size_t k = i + 1; k < count && is_best; k++) is_best = !(is_same(k, i) && likeness[k] > likeness[i]);
    if (!is_best) continue;
    if (kept != i) std::memcpy(static_cast<void *>(&events[kept]), &events[i], WM_EVENT_SMALL_BYTES);
    likeness[kept++] = likeness[i];
  }
  sort_events(events, kept);
  return kept;
}

double median_of(double *values, size_t count) {
  for (size_t i = 1; i < count; i++)
    for (size_t k = i; k > 0 && values[k - 1] > values[k]; k--) {
      const double swapped = values[k];
      values[k] = values[k - 1];
      values[k - 1] = swapped;
    }
  return values[count / 2];
}

// A rotated camera shifts all landmarks of a picture alike, a wrong position each by its distance. A landmark whose
// shift is far from the median is a false match. Returns the number kept.
size_t reject_outliers(landmarks_state *self, camera_guess guess, const int *which, wm_event *events, double *likeness,
                       size_t count) {
  if (count < kOutlierMin) return count;
  double common[2], values[kFoundMax];
  const auto moved = [&](size_t i, int axis) {
    const wm_looked_for &look = self->looks[which[i]];
    return look.found_px[axis] - look.expected_px[axis];
  };
  for (int axis = 0; axis < 2; axis++) {
    for (size_t i = 0; i < count; i++) values[i] = moved(i, axis);
    common[axis] = median_of(values, count);
  }
  for (double *row : {guess.cov[0], guess.cov[1], guess.cov[2]}) row[2] = 0;
  guess.cov[2][0] = guess.cov[2][1] = 0;
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    double allowed[2];
    expected_spread(self->eye.camera, guess, self->known[which[i]], 0, &allowed[0], &allowed[1]);
    // A rolled camera shifts them differently, in proportion to their distance from the principal point.
    const wm_looked_for &look = self->looks[which[i]];
    const double u = look.expected_px[0] - self->eye.camera.optics.cx,
                 v = look.expected_px[1] - self->eye.camera.optics.cy;
    const double tolerance = larger(kLens_px, 2 * self->eye.params.mounting_sigma_rad * std::sqrt(u * u + v * v));
    if (std::fabs(moved(i, 0) - common[0]) < kSigmas * allowed[0] + tolerance &&
        std::fabs(moved(i, 1) - common[1]) < kSigmas * allowed[1] + tolerance) {
      if (kept != i) std::memcpy(static_cast<void *>(&events[kept]), &events[i], WM_EVENT_SMALL_BYTES);
      likeness[kept++] = likeness[i];
    } else {
      wm_looked_for &outlier = self->looks[which[i]];
      outlier.look = WM_LOOK_UNLIKE;
      outlier.found_px[0] = outlier.found_px[1] = kNan;
    }
  }
  return kept;
}

// Events of one picture with their landmarks.
struct found_list {
  wm_event *events;
  size_t capacity, count;
  double likeness[kFoundMax];
  int which[kFoundMax];
};

void clear_looks(landmarks_state *self) {
  for (int i = 0; i < self->count; i++)
    self->looks[i] = {self->known[i].id, WM_LOOK_UNCERTAIN, {kNan, kNan}, {kNan, kNan}, kNan};
}

// Matches all landmarks of at least `area_px2` that are visible from a pose. `is_final` as of match_landmark.
void match_by(landmarks_state *self, const wm_frame &frame, const camera_guess &guess, bool is_final, double area_px2,
              found_list *out) {
  const wm_landmarks_params &params = self->eye.params;
  out->count = 0;
  for (int i = 0; i < self->count; i++) {
    const appearance &what = self->known[i];
    wm_looked_for &look = self->looks[i];
    look = {what.id, WM_LOOK_UNCERTAIN, {kNan, kNan}, {kNan, kNan}, kNan};
    expected_view one;
    look.look = static_cast<uint8_t>(expect_landmark(self->eye, guess, what, kAreaMax_px2, &one));
    if (look.look == WM_LOOK_FOUND && one.area_px2 < area_px2) look.look = WM_LOOK_TOO_SMALL;
    if (look.look != WM_LOOK_FOUND) continue;
    look.expected_px[0] = one.middle.u;
    look.expected_px[1] = one.middle.v;
    double across_px, down_px;
    expected_spread(self->eye.camera, guess, what, params.mounting_sigma_rad, &across_px, &down_px);
    landmark_match seen;
    look.look = static_cast<uint8_t>(
        larger(across_px, down_px) * kWindowSigmas > kWindowMax_px
            ? WM_LOOK_UNCERTAIN
            : match_landmark(&self->eye, one, kWindowSigmas * across_px, kWindowSigmas * down_px, is_final, &seen));
    if (look.look != WM_LOOK_UNCERTAIN) look.likeness = seen.likeness;
    if (look.look != WM_LOOK_FOUND || out->count == out->capacity || out->count == kFoundMax) continue;
    if (!emit(*self, frame, guess, one, seen, &out->events[out->count])) continue;
    look.found_px[0] = seen.at.u;
    look.found_px[1] = seen.at.v;
    out->which[out->count] = i;
    out->likeness[out->count++] = seen.likeness;
  }
  out->count = reject_outliers(self, guess, out->which, out->events, out->likeness, out->count);
}

// Whether the matches confirm the pose: a wrong pose matches a few landmarks by chance.
bool confirms(const landmarks_state &self, const found_list &found) {
  size_t expected = 0;
  for (int i = 0; i < self.count; i++) expected += wm_look_is_expected(self.looks[i].look) != 0;
  return found.count > 0 && kExpectedPerFound * found.count >= expected;
}

// Budget of a search relative to that at kRate_hz: longer periods allow more.
double budget_of(const landmarks_state &self, wm_time_ns t_ns) {
  if (self.before_ns == WM_TIME_NONE) return 1.0;
  const double periods = kRate_hz * wm_seconds_between(self.before_ns, t_ns);
  return periods > kBudgetMax ? kBudgetMax : larger(periods, 1.0);
}

// The camera's pose by landmarks recognised in a previous picture, predicted by the robot's twist.
bool carry_recognised(const landmarks_state &self, const wm_estimate *prediction, wm_time_ns t_ns, camera_guess *out) {
  const recognised_pose &before = self.place;
  if (!prediction || before.t_ns == WM_TIME_NONE) return false;
  const double dt_s = wm_seconds_between(before.t_ns, t_ns);
  if (!(std::fabs(dt_s) < kCarry_s)) return false;
  *out = before.guess;
  carry_guess(self.eye.camera, 0.5 * (before.v_mps + vec_of(prediction->v_mps)),
              0.5 * (before.w_radps + vec_of(prediction->w_radps)), dt_s, out);
  return finite(out->eye_m) && finite(out->cov[0][0]) && finite(out->cov[2][2]);
}

void store_recognised(landmarks_state *self, const wm_estimate *prediction, wm_time_ns t_ns,
                      const camera_guess &guess) {
  self->place.t_ns = prediction ? t_ns : WM_TIME_NONE;
  if (!prediction) return;
  self->place.guess = guess;
  self->place.v_mps = vec_of(prediction->v_mps);
  self->place.w_radps = vec_of(prediction->w_radps);
}

// Verifies a hypothesis of the search from both sides. Keeps the pose that explains the most landmarks.
void verify(landmarks_state *self, const wm_frame &frame, const place_hypothesis &where, found_list *out, size_t *most,
            camera_guess *best) {
  const wm_landmarks_params &params = self->eye.params;
  recognised seen;
  for (const int side : {1, -1}) {
    if (!recognise(&self->eye, self->known[where.landmark], where, side, &seen)) continue;
    match_by(self, frame, seen.guess, false, params.search_area_px2, out);
    if (out->count < (seen.likeness >= params.likeness_alone ? 1 : kAgreeing) || out->count <= *most) continue;
    *most = out->count;
    *best = seen.guess;
    correct_guess(self->eye, self->known, self->looks, self->count, best);
  }
}

// Searches the picture for the next landmarks in turn. A recognised one predicts the others, in this picture and the
// next.
void search_all(landmarks_state *self, const wm_frame &frame, const wm_estimate *prediction, found_list *out) {
  global_search &search = self->search;
  const wm_landmarks_params &params = self->eye.params;
  camera_guess best, carried;
  size_t most = 0;
  if (carry_recognised(*self, prediction, frame.t_ns, &carried)) {
    match_by(self, frame, carried, true, params.search_area_px2, out);
    best = carried;
    most = confirms(*self, *out) ? out->count : 0;
    if (most > 0) correct_guess(self->eye, self->known, self->looks, self->count, &best);
  }
  const double budget = budget_of(*self, frame.t_ns);
  search.around.take(self->eye.picture);
  search.search(self->eye.camera, self->known, self->count, params.range_max_m, tilt_of(params),
                static_cast<int>(budget * params.search_places));
  for (int i = 0; i < search.count && i < static_cast<int>(budget * kTries); i++) {
    const size_t before = most;
    verify(self, frame, search.places[i], out, &most, &best);
    if (most > before) break;
  }
  if (most > 0) {
    match_by(self, frame, best, true, params.search_area_px2, out);
    if (out->count == 0) return;
    correct_guess(self->eye, self->known, self->looks, self->count, &best);
    store_recognised(self, prediction, frame.t_ns, best);
    return;
  }
  out->count = 0;
  clear_looks(self);
}

wm_status detect(void *memory, const wm_frame *frames, const wm_estimate *prediction, wm_event *out, size_t capacity,
                 size_t *count) {
  auto *self = static_cast<landmarks_state *>(memory);
  const wm_frame &frame = frames[0];
  *count = 0;
  if (frame.width_px != self->eye.camera.width_px || frame.height_px != self->eye.camera.height_px) return WM_BAD_DATA;
  camera_guess guess;
  const bool guessed = guess_camera(self->eye.camera, prediction, frame.t_ns, &guess);
  pyramid_take(&self->eye.picture, frame, self->row);
  found_list found;
  found.events = out;
  found.capacity = capacity;
  found.count = 0;
  clear_looks(self);
  if (guessed) match_by(self, frame, guess, true, 0, &found);
  if (confirms(*self, found) || self->found_ns == WM_TIME_NONE) self->found_ns = frame.t_ns;
  const bool blind = wm_seconds_between(self->found_ns, frame.t_ns) > kSearchAfter_s;
  if ((!guessed || blind) && self->eye.params.search_places > 0) {
    const size_t by_pose = found.count;
    search_all(self, frame, prediction, &found);
    if (guessed && by_pose > 0 && found.count <= by_pose) match_by(self, frame, guess, true, 0, &found);
  }
  self->before_ns = frame.t_ns;
  *count = best_in_order(out, found.likeness, found.count);
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
    .name = "landmarks",
    .about = "known landmarks (signs, house numbers, windows) by their appearance: bearings with identities and sigmas",
    .gives = WM_EVENT_BIT(WM_EVENT_SIGHTING),
    .pictures = 1,
    .params = wm_landmarks_params_table,
    .state_bytes = wm::state_bytes,
    .init = wm::init,
    .detect = wm::detect,
    .is_guided = 1,
    .looked_for = wm::looked_for,
};
