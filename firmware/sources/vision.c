// SPDX-License-Identifier: Apache-2.0
#include "sources/vision.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sources/videos.h"
#include "sources/vision_source.h"

struct wm_vision {
  vision_source sources[WM_VISION_SOURCES_MAX];
  size_t count;
  newest_pose newest;
  videos videos;
  char need_names[WM_VISION_NEEDS][40];
};

// Most events of a picture: one with many points, or many small ones.
#define EVENTS_WITH_POINTS 2
#define EVENTS_SMALL 256
#define NO_SENSOR UINT16_MAX
// What an estimator needs of a sensor's mounting.
static const uint32_t kSaidOfSensors = WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER);

static wm_status next(wm_source *base, wm_event *out, wm_error *err) {
  vision_source *self = (vision_source *)base;
  if (self->prefetch.started) return vision_prefetch_next(self, out, err);
  wm_status status = vision_next(self, out, err);
  base->counts = self->counts;
  return status;
}

static void skip_to(wm_source *base, wm_time_ns now_ns) {
  vision_source *self = (vision_source *)base;
  if (self->prefetch.started) return;
  vision_skip_to(self, now_ns);
  base->counts = self->counts;
}

static void close_nothing(wm_source *base) { (void)base; }  // wm_vision_close closes it

static const wm_source_ops kOps = {.next = next, .close = close_nothing};

// ── opening ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static uint16_t sensor_of(wm_recording *recording, const char *camera) {
  size_t count;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(recording), &count);
  for (size_t i = 0; i < count; i++)
    if (strcmp(sensors[i].name, camera) == 0) return (uint16_t)i;
  return NO_SENSOR;
}

// A detector takes the newest picture only.
static const wm_frame_wishes kDetector = {.waiting_max = 1, .wait_ms = WM_DEVICE_WAIT_MS};

static wm_status open_pictures(vision_source *self, wm_pictures *pictures, wm_error *err) {
  wm_status status = WM_OK;
  for (uint32_t i = 0; status == WM_OK && i < self->detector->pictures; i++)
    status = pictures->ops->open(pictures, &self->view.rig->cameras[self->cameras[i]], self->cameras[i], &kDetector,
                                 &self->pictures[i], err);
  if (status != WM_OK) return status;
  self->base.is_live = self->pictures[0]->is_live;
  self->base.skip_to = self->pictures[0]->ops->skip_to ? skip_to : NULL;
  return WM_OK;
}

// A source of this detector on as many of `cameras` as it takes at once.
static wm_status add(wm_vision *self, const wm_config *config, const wm_vision_config *wanted, wm_recording *recording,
                     const int32_t cameras[PICTURES_MAX], wm_pictures *pictures, wm_error *err) {
  const wm_rig *rig = wm_site_rig(wm_recording_site(recording));
  const wm_camera *first = &rig->cameras[cameras[0]];
  if (self->count == WM_VISION_SOURCES_MAX)
    return wm_fail(err, WM_FULL, "%s: vision: more than %d detectors and cameras", config->path, WM_VISION_SOURCES_MAX);
  vision_source *s = &self->sources[self->count++];
  onlooker_open(&s->shown);
  s->detector = wanted->detector;
  s->params = wanted->params;
  s->newest_ns = s->busy_until_ns = WM_TIME_NONE;
  memcpy(s->cameras, cameras, sizeof s->cameras);
  s->view = (wm_view){.rig = rig, .cameras = s->cameras};
  s->view.landmarks = wm_site_landmarks(wm_recording_site(recording), &s->view.landmark_count);
  s->view.cascades = wanted->cascades;
  s->view.cascade_count = wanted->cascade_count;
  if (s->detector->is_guided) {
    wm_status status =
        wm_site_appearances(wm_recording_site(recording), &s->view.appearances, &s->view.appearance_count, err);
    if (status != WM_OK) return status;
    s->newest = &self->newest;
    s->looks_at_arrival = 1;
  }
  if (!search_outcomes_open(&s->outcomes, s->view.appearance_count))
    return wm_fail(err, WM_IO, "no memory for detectors");
  s->base = (wm_source){.ops = &kOps, .in_order = 1};
  (void)snprintf(s->base.name, sizeof s->base.name, "%s:%s", s->detector->name, first->name);
  s->gives_looked = (config->estimator->takes & WM_EVENT_BIT(WM_EVENT_LOOKED)) != 0;
  s->base.kinds = s->detector->gives | (s->gives_looked ? WM_EVENT_BIT(WM_EVENT_LOOKED) : 0);
  s->sensor = sensor_of(recording, first->name);
  if (s->sensor == NO_SENSOR && (s->detector->gives & kSaidOfSensors)) {
    wm_status status = wm_site_camera_sensor(wm_recording_site(recording), first->name, &s->sensor, err);
    if (status != WM_OK) return status;
  }
  s->capacity = s->detector->gives & WM_EVENT_BIT(WM_EVENT_POINTS) ? EVENTS_WITH_POINTS : EVENTS_SMALL;
  const char *why = NULL;
  s->state_bytes = s->detector->state_bytes(s->params, &s->view, &why);
  if (s->state_bytes == 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s:%d: vision.%s: can't work with the camera '%s': %s", config->path,
                   wanted->line, s->detector->name, first->name, why ? why : "no reason given");
  return open_pictures(s, pictures, err);
}

static wm_status add_pair(wm_vision *self, const wm_config *config, const wm_vision_config *wanted,
                          wm_recording *recording, wm_pictures *pictures, wm_error *err) {
  const wm_stereo_pair *pair = &wm_site_rig(wm_recording_site(recording))->stereo;
  if (pair->left < 0 || pair->right < 0)
    return wm_fail(err, WM_BAD_CONFIG,
                   "%s:%d: vision.%s: needs a pair of cameras: stereo: {left: ..., right: ...} in calibration.yaml",
                   config->path, wanted->line, wanted->detector->name);
  const int32_t cameras[2] = {pair->left, pair->right};
  return add(self, config, wanted, recording, cameras, pictures, err);
}

static int is_wanted(const wm_vision_config *wanted, const char *camera) {
  for (uint32_t i = 0; i < wanted->camera_count; i++)
    if (strcmp(wanted->cameras[i], camera) == 0) return 1;
  return 0;
}

// The cameras of the configuration, or else all that have pictures.
static wm_status add_singles(wm_vision *self, const wm_config *config, const wm_vision_config *wanted,
                             wm_recording *recording, wm_pictures *pictures, wm_error *err) {
  const wm_rig *rig = wm_site_rig(wm_recording_site(recording));
  for (uint32_t i = 0; i < wanted->camera_count; i++)
    if (wm_rig_find_camera(rig, wanted->cameras[i]) < 0)
      return wm_fail(err, WM_BAD_CONFIG, "%s:%d: vision.%s.cameras: '%s' is not a camera of calibration.yaml",
                     config->path, wanted->line, wanted->detector->name, wanted->cameras[i]);
  size_t before = self->count;
  for (int32_t i = 0; i < (int32_t)rig->camera_count; i++) {
    const char *name = rig->cameras[i].name;
    if (wanted->camera_count > 0 ? !is_wanted(wanted, name) : !pictures->ops->has(pictures, name)) continue;
    const int32_t cameras[2] = {i, i};
    wm_status status = add(self, config, wanted, recording, cameras, pictures, err);
    if (status != WM_OK) return status;
  }
  if (self->count > before) return WM_OK;
  return wm_fail(err, WM_BAD_CONFIG, "%s:%d: vision.%s: '%s' %s", config->path, wanted->line, wanted->detector->name,
                 wm_recording_dir(recording), pictures->lacking);
}

wm_status wm_vision_open(const wm_config *config, wm_recording *recording, wm_warn_fn warn, void *context,
                         wm_vision **out, wm_error *err) {
  *out = NULL;
  wm_vision *self = NULL;
  for (size_t i = 0; i < config->vision_count; i++) {
    const wm_vision_config *wanted = &config->vision[i];
    if (!(wanted->detector->gives & config->estimator->takes)) continue;
    if (!self) {
      self = calloc(1, sizeof *self);
      if (!self) return wm_fail(err, WM_IO, "no memory for detectors");
      videos_of(&self->videos, recording, warn, context);
    }
    wm_pictures *pictures = wm_recording_pictures(recording);
    if (!pictures) pictures = &self->videos.base;
    wm_status status = wanted->detector->pictures == 2 ? add_pair(self, config, wanted, recording, pictures, err)
                                                       : add_singles(self, config, wanted, recording, pictures, err);
    if (status != WM_OK) {
      wm_vision_close(self);
      return status;
    }
  }
  *out = self;
  return WM_OK;
}

void wm_vision_close(wm_vision *self) {
  if (!self) return;
  for (size_t i = 0; i < self->count; i++) {
    vision_prefetch_stop(&self->sources[i]);
    for (size_t k = 0; k < PICTURES_MAX; k++) {
      wm_frame_source *pictures = self->sources[i].pictures[k];
      if (pictures) pictures->ops->close(pictures);
    }
    search_outcomes_close(&self->sources[i].outcomes);
    onlooker_close(&self->sources[i].shown);
    free(self->sources[i].only);
  }
  free(self);
}

size_t wm_vision_count(const wm_vision *self) { return self ? self->count : 0; }
wm_source *wm_vision_source(wm_vision *self, size_t i) { return &self->sources[i].base; }
const char *wm_vision_name(const wm_vision *self, size_t i) { return self->sources[i].base.name; }

void wm_vision_look_only_at(wm_vision *self, size_t i, wm_seen *seen, size_t count) {
  vision_look_only_at(&self->sources[i], seen, count);
}

// ── memory, start ───────────────────────────────────────────────────────────────────────────────────────────────────

size_t wm_vision_needs(wm_vision *self, wm_arena_need *needs) {
  size_t used = 0;
  for (size_t i = 0; i < wm_vision_count(self); i++) {
    vision_source *s = &self->sources[i];
    (void)snprintf(self->need_names[used], sizeof self->need_names[0], "%.36s", s->base.name);
    (void)snprintf(self->need_names[used + 1], sizeof self->need_names[0], "%.28s events", s->base.name);
    needs[used] = (wm_arena_need){self->need_names[used], s->state_bytes, &s->state};
    needs[used + 1] = (wm_arena_need){self->need_names[used + 1], (s->capacity + PREFETCH_EVENTS) * sizeof(wm_event),
                                      &s->events_memory};
    used += 2;
  }
  return used;
}

wm_status wm_vision_start(wm_vision *self, wm_error *err) {
  for (size_t i = 0; i < wm_vision_count(self); i++) {
    vision_source *s = &self->sources[i];
    s->events = s->events_memory;
    s->prefetch.events = s->events + s->capacity;
    wm_status status = s->detector->init(s->state, s->params, &s->view);
    if (status != WM_OK)
      return wm_fail(err, status, "vision: detector '%s' can't start: %s", s->detector->name, wm_status_text(status));
  }
  return WM_OK;
}

wm_status wm_vision_start_prefetch(wm_vision *self, wm_error *err) {
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < wm_vision_count(self); i++)
    if (!self->sources[i].newest) status = vision_prefetch_start(&self->sources[i], err);
  return status;
}

void wm_vision_look_at_arrival(wm_vision *self) {
  for (size_t i = 0; i < wm_vision_count(self); i++) self->sources[i].looks_at_arrival = 1;
}

void wm_vision_set_prediction(wm_vision *self, const wm_estimate *newest) {
  if (self) newest_pose_put(&self->newest, newest);
}

size_t wm_vision_looks(const wm_vision *self, size_t i, const wm_landmark_looks **rows) {
  *rows = self->sources[i].outcomes.rows;
  return self->sources[i].outcomes.count;
}

onlooker *wm_vision_onlooker(wm_vision *self, size_t i, const wm_camera **camera) {
  vision_source *s = &self->sources[i];
  *camera = &s->view.rig->cameras[s->cameras[0]];
  return &s->shown;
}

const wm_histogram *wm_vision_look_ns(const wm_vision *self, size_t i) { return &self->sources[i].look_ns; }

void wm_vision_times(const wm_vision *self, wm_histogram *decode_ns, wm_histogram *detect_ns) {
  memset(decode_ns, 0, sizeof *decode_ns);
  memset(detect_ns, 0, sizeof *detect_ns);
  for (size_t i = 0; i < wm_vision_count(self); i++) {
    wm_histogram_merge(decode_ns, &self->sources[i].decode_ns);
    wm_histogram_merge(detect_ns, &self->sources[i].detect_ns);
  }
}
