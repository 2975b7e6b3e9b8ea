// SPDX-License-Identifier: Apache-2.0
#include "fusion/assembly.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static wm_time_ns ns_from_ms(double ms) { return wm_ns_from_seconds(ms * 1e-3); }

static wm_unused *leave_out(wm_assembly *self, const char *name, wm_unused_why why) {
  static wm_unused beyond;
  const int has_room = self->unused_count < sizeof self->unused / sizeof self->unused[0];
  wm_unused *out = has_room ? &self->unused[self->unused_count++] : &beyond;
  *out = (wm_unused){.why = why};
  (void)snprintf(out->name, sizeof out->name, "%s", name);
  return out;
}

// "the estimator 'slam' doesn't take its data; landmark_ekf, odometry do"
static wm_unused *leave_to_others(wm_assembly *self, const char *name, uint32_t kinds) {
  wm_unused *out = leave_out(self, name, WM_UNUSED_BY_ESTIMATOR);
  size_t count, others = 0;
  const wm_estimator *const *all = wm_estimators(&count);
  int used =
      snprintf(out->text, sizeof out->text, "the estimator '%s' doesn't take its data", self->config->estimator->name);
  for (size_t i = 0; i < count && used > 0 && (size_t)used < sizeof out->text; i++)
    if (all[i]->takes & kinds & ~(uint32_t)WM_MOTION_EVENTS)
      used += snprintf(out->text + used, sizeof out->text - (size_t)used, "%s%s",
                       others++ ? ", " : "; these do: ", all[i]->name);
  return out;
}

// A source that the estimator can't use is not opened: it would only hold the watermark back.
static int is_left_out(wm_assembly *self, const wm_source *source, const wm_source_config *wanted, int is_listed) {
  const uint32_t takes = wm_assembly_estimator(self)->takes | WM_MOTION_EVENTS;
  if (wanted->use && (source->kinds & takes)) return 0;
  if (wanted->use) {
    wm_unused *one = leave_to_others(self, source->name, source->kinds);
    one->is_device = source->is_live;
    one->is_listed = (uint8_t)is_listed;
  } else {
    (void)snprintf(leave_out(self, source->name, WM_UNUSED_WANTED)->text, sizeof self->unused[0].text, "%s",
                   "`use: false` in the configuration");
  }
  return 1;
}

// What the configuration binds to this run has a use: a device, a detector or an entry of `sources` that is for nothing
// is a mistake. A recording may hold more than an estimator takes.
static wm_status check_bound(const wm_assembly *self, wm_error *err) {
  for (size_t i = 0; i < self->unused_count; i++) {
    const wm_unused *one = &self->unused[i];
    if (one->is_detector)
      return wm_fail(err, WM_BAD_CONFIG, "%s: vision: '%s' is for nothing: %s; leave it out, or take another estimator",
                     self->config->path, one->name, one->text);
    if (one->is_device)
      return wm_fail(err, WM_BAD_CONFIG,
                     "%s: devices: '%s' is for nothing: %s; leave it out, take another estimator, or write "
                     "`sources: [{name: %s, use: false}]`",
                     self->config->path, one->name, one->text, one->name);
    if (one->is_listed && wm_assembly_observes(self))
      return wm_fail(err, WM_BAD_CONFIG,
                     "%s: sources: '%s' is for nothing: %s; leave its entry out, take another estimator, or write "
                     "`use: false` there",
                     self->config->path, one->name, one->text);
  }
  return WM_OK;
}

static void add_source(wm_assembly *self, wm_source *source) {
  wm_source_config wanted;
  int rank = 0;
  wm_config_source(self->config, source->name, &wanted, &rank);
  if ((size_t)rank == self->config->source_count && source->lateness_max_ms > 0)
    wanted.lateness_max_ms = source->lateness_max_ms, wanted.lateness_is_stated = 1;
  if (is_left_out(self, source, &wanted, (size_t)rank < self->config->source_count)) return;
  wm_time_ns lateness_ns = ns_from_ms(wanted.lateness_max_ms);
  wm_time_ns horizon_ns = ns_from_ms(self->config->runtime.merge_horizon_ms);
  wm_assembled_source *s = &self->sources[self->source_count++];
  (void)snprintf(s->name, sizeof s->name, "%s", source->name);
  s->source = source;
  source->sample_at_next = (uint8_t)wanted.sample_at_next;
  source->ready_after_ns = ns_from_ms(wanted.ready_after_ms);
  s->kinds = source->kinds;
  s->from_s = wanted.from_s;
  s->until_s = wanted.until_s;
  s->merge = (wm_merge_source){.rank = rank,
                               .is_motion = source->is_motion,
                               .in_order = source->in_order,
                               .lateness_max_ns = lateness_ns < horizon_ns ? lateness_ns : horizon_ns,
                               .lateness_most_ns = wanted.lateness_is_stated ? 0 : horizon_ns,
                               .period_ns = ns_from_ms(wanted.period_ms)};
  self->kinds |= source->kinds;
}

// Two sensors of one quantity would be taken for one, with one bias: a stream of its own is taken instead of CAN.
static void choose_quantities(wm_assembly *self) {
  for (size_t i = 0; i < self->source_count; i++)
    for (size_t k = i + 1; k < self->source_count; k++) {
      wm_assembled_source *less = &self->sources[i];
      const wm_assembled_source *taken = &self->sources[k];
      const uint32_t both = less->source->quantities & taken->source->quantities & ~less->drops;
      if (both == 0 || taken->source->is_bus) continue;
      less->drops |= both;
      (void)snprintf(leave_out(self, less->name, WM_UNUSED_QUANTITY)->text, sizeof self->unused[0].text,
                     "%s is taken from %.16s", wm_quantity_name((unsigned)__builtin_ctz(both)), taken->name);
    }
}

static wm_status check_estimator(const wm_assembly *self, wm_error *err) {
  const wm_config *config = self->config;
  const char *why = NULL;
  if (wm_assembly_estimator(self)->state_bytes(config->estimator_params, &self->setup, &why) == 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s: estimator '%s' can't work with '%s': %s", config->path,
                   config->estimator->name, self->recording, why ? why : "no reason given");
  return WM_OK;
}

// A model without its input would keep the pose where it is without any error.
static wm_status check_motion(const wm_assembly *self, uint32_t quantities, wm_error *err) {
  const char *lacks = wm_motion_lacks(self->setup.motion, &self->setup.wheels, self->kinds, quantities);
  if (!lacks) return WM_OK;
  return wm_fail(err, WM_BAD_CONFIG,
                 "%s: motion.model: with '%s' it needs %s; put that there, or take another model (auto takes the first "
                 "that is possible)",
                 self->config->path, self->recording, lacks);
}

wm_status wm_assembly_choose_motion(wm_assembly *self, wm_error *err) {
  const size_t bytes = wm_motion_params_table.bytes;
  self->own_motion = malloc(bytes);
  if (!self->own_motion) return wm_fail(err, WM_IO, "no memory for the parameters of the motion");
  memcpy(self->own_motion, self->config->motion, bytes);
  wm_motion_choose(self->own_motion, self->kinds);
  self->setup.motion = self->own_motion;
  return WM_OK;
}

// A map may be large: only an estimator that takes points gets one.
static wm_status add_map(wm_assembly *self, wm_recording *recording, wm_error *err) {
  if (!(self->config->estimator->takes & WM_EVENT_BIT(WM_EVENT_POINTS))) return WM_OK;
  self->map_path = wm_site_map_path(wm_recording_site(recording));
  return wm_site_map(wm_recording_site(recording), &self->setup.map, err);
}

// The other floors of the site, beside. An estimator without them stays on the stated one.
static wm_status add_building(wm_assembly *self, wm_error *err) {
  const wm_config *config = self->config;
  const wm_chosen_floor *chosen = &config->floor;
  if (!chosen->site || chosen->site->floor_count < 2) return WM_OK;
  self->start_floor = chosen->index;
  if (wm_carrier_of(config->estimator))
    return wm_building_open(config->estimator, chosen->site, NULL, NULL, &self->building, err);
  if (chosen->index >= 0) return WM_OK;
  return wm_fail(err, WM_BAD_CONFIG,
                 "%s: site: has %d floors, and the estimator '%s' takes one: write FOLDER/FLOOR; landmark_ekf takes "
                 "them all",
                 config->path, chosen->site->floor_count, config->estimator->name);
}

// A receiver's positions are on the axes of one floor.
static wm_status check_axes(const wm_assembly *self, wm_error *err) {
  const uint32_t on_axes =
      WM_EVENT_BIT(WM_EVENT_POSITION) | WM_EVENT_BIT(WM_EVENT_HEADING) | WM_EVENT_BIT(WM_EVENT_LOCALIZED);
  if (!self->building || !(self->kinds & on_axes) || wm_building_has_same_axes(self->building)) return WM_OK;
  return wm_fail(err, WM_BAD_CONFIG,
                 "%s: site: positions, headings and poses of others are on the axes of one floor: draw the floors on "
                 "one grid (equal ends of each connection), or leave these sources out",
                 self->config->path);
}

static wm_status add_vision(wm_assembly *self, wm_recording *recording, wm_error *err) {
  const wm_config *config = self->config;
  for (size_t i = 0; i < config->vision_count; i++)
    if (!(config->vision[i].detector->gives & config->estimator->takes))
      leave_to_others(self, config->vision[i].detector->name, config->vision[i].detector->gives)->is_detector = 1;
  wm_status status = wm_vision_open(config, recording, NULL, NULL, &self->vision, err);
  for (size_t i = 0; status == WM_OK && i < wm_vision_count(self->vision); i++) {
    if (self->source_count == WM_SOURCES_MAX)
      return wm_fail(err, WM_FULL, "%s: more than %d sources", config->path, WM_SOURCES_MAX);
    add_source(self, wm_vision_source(self->vision, i));
  }
  if (wm_vision_count(self->vision) > 0) wm_video_decoder(self->decoder, sizeof self->decoder);
  return status;
}

wm_status wm_assemble(const wm_config *config, wm_recording *recording, uint64_t seed, wm_assembly *out,
                      wm_error *err) {
  memset(out, 0, sizeof *out);
  out->config = config;
  (void)snprintf(out->recording, sizeof out->recording, "%s", wm_recording_name(recording));
  out->calibration_text = wm_site_calibration_text(wm_recording_site(recording), &out->calibration_length);

  wm_setup *setup = &out->setup;
  wm_config_give_params(config, setup);
  setup->wheels = *wm_site_wheels(wm_recording_site(recording));
  out->imu = &wm_site_row_mountings(wm_recording_site(recording))->imu;
  setup->sensors = wm_site_sensors(wm_recording_site(recording), &setup->sensor_count);
  setup->landmarks = wm_site_landmarks(wm_recording_site(recording), &setup->landmark_count);
  setup->rig = wm_site_rig(wm_recording_site(recording));
  setup->start = config->has_initial_pose ? config->initial_pose : *wm_site_start(wm_recording_site(recording));
  setup->seed = seed;

  wm_status status = add_map(out, recording, err);
  if (status == WM_OK) status = add_building(out, err);
  if (status != WM_OK) return status;
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  for (size_t i = 0; i < count && i < WM_SOURCES_MAX; i++) add_source(out, sources[i]);
  choose_quantities(out);
  status = add_vision(out, recording, err);
  if (status == WM_OK) status = check_bound(out, err);
  if (status != WM_OK) return status;
  setup->sensors =
      wm_site_sensors(wm_recording_site(recording), &setup->sensor_count);  // the cameras' sensors have been added
  if (!(out->kinds & out->config->estimator->takes) && !(out->kinds & WM_MOTION_EVENTS))
    return wm_fail(err, WM_BAD_CONFIG, "%s: no motion and no observation is there or used",
                   wm_recording_dir(recording));
  status = wm_assembly_choose_motion(out, err);
  if (status == WM_OK) status = check_axes(out, err);
  if (status != WM_OK) return status;
  wm_assembly_follow(out);
  out->driving = wm_driving_choose(out->kinds, wm_recording_quantities(recording));
  status = check_motion(out, wm_recording_quantities(recording), err);
  return status == WM_OK ? check_estimator(out, err) : status;
}

const wm_estimator *wm_assembly_estimator(const wm_assembly *self) {
  return self->building ? &self->building->estimator : self->config->estimator;
}

void wm_assembly_follow(wm_assembly *self) {
  if (self->building) wm_building_follow(self->building, &self->setup, self->start_floor);
}

void wm_assembly_close(wm_assembly *self) {
  wm_building_close(self->building);
  self->building = NULL;
  free(self->own_motion);
  self->own_motion = NULL;
  wm_vision_close(self->vision);
  self->vision = NULL;
}

int wm_assembly_observes(const wm_assembly *self) {
  const uint32_t observations = WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_POSITION) |
                                WM_EVENT_BIT(WM_EVENT_HEADING) | WM_EVENT_BIT(WM_EVENT_MARKER) |
                                WM_EVENT_BIT(WM_EVENT_STEREO) | WM_EVENT_BIT(WM_EVENT_POINTS);
  return (self->config->estimator->takes & observations) != 0;
}

const char *wm_assembly_lacks_start(const wm_assembly *self) {
  const wm_start *start = &self->setup.start;
  if (wm_assembly_observes(self) || (!isnan(start->p_m[0]) && !isnan(start->p_m[1]) && !isnan(start->heading_rad)))
    return NULL;
  return "no start is known, and this estimator finds none: there is no pose before a set_pose; fix: write "
         "`initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}` into the configuration, and the map begins where the robot "
         "starts";
}

uint64_t wm_assembly_observers(const wm_assembly *self) {
  const uint32_t observed = self->config->estimator->takes & ~(uint32_t)WM_MOTION_EVENTS;
  uint64_t bits = 0;
  for (size_t i = 0; i < self->source_count && i < 64; i++)
    if (self->sources[i].kinds & observed) bits |= UINT64_C(1) << i;
  return bits;
}

const char *wm_assembly_source_name(const wm_assembly *self, size_t source) {
  return source < self->source_count ? self->sources[source].name : "?";
}

const char *wm_assembly_sensor_name(const wm_assembly *self, size_t sensor) {
  return sensor < self->setup.sensor_count ? self->setup.sensors[sensor].name : "";
}
