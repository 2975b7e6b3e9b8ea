// SPDX-License-Identifier: Apache-2.0
#include "fusion/pipeline.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "rt/clock.h"
#include "waymark/keeper.h"
#include "waymark/motion.h"

static wm_time_ns ns_from_ms(double ms) { return wm_ns_from_seconds(ms * 1e-3); }

static size_t queue_events(const wm_assembly *assembly) { return (size_t)assembly->config->runtime.merge_queue_events; }

void wm_pipeline_needs(wm_pipeline *self, const wm_assembly *assembly, wm_arena_need needs[WM_PIPELINE_NEEDS]) {
  memset(self, 0, sizeof *self);
  self->assembly = assembly;
  const wm_config *config = assembly->config;
  const char *why;
  size_t slot_bytes = wm_merge_slot_bytes(assembly->kinds);
  needs[0] = (wm_arena_need){"merge", wm_merge_bytes(assembly->source_count, queue_events(assembly), slot_bytes),
                             &self->merge_memory};
  needs[1] = (wm_arena_need){
      "estimator", wm_assembly_estimator(assembly)->state_bytes(config->estimator_params, &assembly->setup, &why),
      &self->state_memory};
  needs[2] = (wm_arena_need){"odometry", wm_odometry_bytes(), &self->odometry_memory};
}

wm_status wm_pipeline_start(wm_pipeline *self, wm_output output, wm_error *err) {
  const wm_assembly *assembly = self->assembly;
  const wm_config *config = assembly->config;
  self->output = output;

  wm_merge_source sources[WM_SOURCES_MAX];
  for (size_t i = 0; i < assembly->source_count; i++) sources[i] = assembly->sources[i].merge;
  self->merge = wm_merge_init(self->merge_memory, sources, assembly->source_count, queue_events(assembly),
                              wm_merge_slot_bytes(assembly->kinds), ns_from_ms(config->runtime.merge_horizon_ms));

  const wm_estimator *estimator = wm_assembly_estimator(assembly);
  wm_status status = estimator->init(self->state_memory, config->estimator_params, &assembly->setup);
  if (status != WM_OK)
    return wm_fail(err, status, "%s: estimator '%s' can't start: %s", config->path, config->estimator->name,
                   wm_status_text(status));
  status = wm_odometry_init(self->odometry_memory, assembly->setup.motion, &assembly->setup.wheels);
  if (status != WM_OK)
    return wm_fail(err, status, "%s: motion: odometry can't start: %s", config->path, wm_status_text(status));

  wm_fuser_init(&self->fuser, estimator, self->state_memory, assembly->driving, output);
  wm_fuser_watch(&self->fuser, &assembly->setup, wm_assembly_observers(assembly));
  wm_predictor_params params = {.jump_m = config->runtime.publish_jump_m,
                                .jump_rad = config->runtime.publish_jump_deg * M_PI / 180,
                                .motion_stale_ns = ns_from_ms(config->runtime.publish_motion_stale_ms),
                                .fusion_stale_ns = ns_from_ms(config->runtime.merge_horizon_ms)};
  wm_predictor_init(&self->predictor, &params, self->odometry_memory);
  wm_budget_init(&self->budget, config->runtime.publish_useless_m);
  self->integrity = (wm_integrity){.risk = config->runtime.integrity_risk_per_pose,
                                   .limit_m = config->runtime.integrity_alert_limit_m,
                                   .limit_rad = config->runtime.integrity_alert_limit_heading_deg * M_PI / 180,
                                   .without_motion = wm_motion_is_unmeasured(assembly->setup.motion)};
  return WM_OK;
}

void wm_pipeline_take_kept(wm_pipeline *self, const void *image, size_t bytes) {
  const wm_keeper *keeper = wm_keeper_of(self->fuser.estimator);
  if (keeper && image) keeper->take(self->fuser.state, image, bytes);
}

size_t wm_pipeline_keep(const wm_pipeline *self, void *out, size_t capacity) {
  const wm_keeper *keeper = wm_keeper_of(self->fuser.estimator);
  return keeper && !wm_monitor_doubts(&self->fuser.monitor) ? keeper->keep(self->fuser.state, out, capacity) : 0;
}

wm_merge_verdict wm_pipeline_arrive(wm_pipeline *self, const wm_event *event) {
  wm_time_ns begin_ns = wm_monotonic_ns();
  wm_merge_verdict verdict = wm_merge_push(self->merge, event);
  if (wm_event_is_motion(event) && verdict != WM_MERGE_DUPLICATE && verdict != WM_MERGE_FUTURE)
    wm_predictor_motion(&self->predictor, event);
  wm_histogram_add(&self->arrive_ns, wm_monotonic_ns() - begin_ns);
  return verdict;
}

// Hands the newest fused pose and the calibration of the motion sensors to the predictor.
static void tell_predictor(wm_pipeline *self) {
  wm_estimate fused;
  wm_motion_calibration calibration;
  wm_fuser_estimate(&self->fuser, &fused);
  self->fuser.estimator->motion(self->fuser.state, &calibration);
  self->predictor.floor_flags = wm_fuser_floor_flags(&self->fuser);
  wm_predictor_fused(&self->predictor, &fused, &calibration);
}

static void fuse_final(wm_pipeline *self) {
  uint64_t before = self->fuser.events;
  while (wm_merge_take(self->merge, &self->next)) wm_fuser_feed(&self->fuser, &self->next);
  if (self->fuser.events != before) tell_predictor(self);
}

void wm_pipeline_advance(wm_pipeline *self, wm_time_ns now_ns) {
  wm_merge_advance(self->merge, now_ns);
  fuse_final(self);
}

int wm_pipeline_publish(wm_pipeline *self, wm_time_ns now_ns, wm_published *out) {
  wm_time_ns begin_ns = wm_monotonic_ns();
  int there_is_one = wm_predictor_publish(&self->predictor, now_ns, out);
  wm_histogram_add(&self->publish_ns, wm_monotonic_ns() - begin_ns);
  self->published += (uint64_t)there_is_one;
  return there_is_one;
}

void wm_pipeline_bound(wm_pipeline *self, const wm_published *published, wm_bound *out) {
  wm_fuser_bound(&self->fuser, &self->integrity, &self->predictor.fused, &published->now, out);
}

int wm_pipeline_expect(const wm_pipeline *self, wm_time_ns now_ns, wm_estimate *out) {
  return wm_predictor_expect(&self->predictor, now_ns, out);
}

void wm_pipeline_finish(wm_pipeline *self) {
  wm_merge_flush(self->merge);
  fuse_final(self);
  wm_fuser_finish(&self->fuser);
}

const char *wm_pipeline_unused(const wm_pipeline *self, size_t source, char text[WM_HEALTH_REASON_MAX]) {
  const wm_unused_event *first = &self->fuser.counts[source].first_unused;
  const char *name = self->assembly->sources[source].name;
  const double t_s = wm_seconds_between(0, first->t_ns);
  if (first->status == WM_OK)
    text[0] = '\0';
  else if (first->status == WM_NOT_FOUND)
    (void)snprintf(text, WM_HEALTH_REASON_MAX,
                   "%.40s: landmark %" PRId32
                   ", seen at %.3f s, is not in the map: is it the map of this place, with "
                   "the numbers that the sensor gives?",
                   name, first->landmark_id, t_s);
  else
    (void)snprintf(
        text, WM_HEALTH_REASON_MAX,
        "%.40s: the estimator can't use the datum of %.3f s: %s: look at its numbers, their sigmas and units", name,
        t_s, wm_status_text(first->status));
  return text;
}

static void source_health(const wm_pipeline *self, size_t i, wm_time_ns now_ns, wm_source_health *out) {
  const wm_merge_counts *merged = wm_merge_source_counts(self->merge, i);
  const wm_fuser_counts *fused = &self->fuser.counts[i];
  (void)snprintf(out->name, sizeof out->name, "%s", self->assembly->sources[i].name);
  out->received = merged->received;
  out->late = merged->late;
  out->dropped = merged->dropped;
  out->duplicates = merged->duplicates;
  out->future = merged->future;
  out->fused = fused->fused;
  memcpy(out->rejected, fused->rejected, sizeof out->rejected);
  memcpy(out->refused, fused->refused, sizeof out->refused);
  out->lateness_p99_ns = wm_merge_lateness_p99(self->merge, i);
  out->lateness_worst_ns = merged->lateness_worst_ns;
  out->lateness_max_ns = wm_merge_lateness_max(self->merge, i);
  out->newest_ns = merged->newest_ns;
  out->silent_ns = wm_merge_silent_ns(self->merge, i, now_ns);
  const wm_source *source = self->assembly->sources[i].source;
  out->stale = (uint8_t)(!(source && source->event_driven) && wm_merge_is_stale(self->merge, i, now_ns));
}

// Of the fused pose; the published pose has a little less left.
static void reckoning_left(wm_pipeline *self, const wm_estimate *fused, wm_health *out) {
  wm_odom_point odom;
  out->reckoning_left_m = out->reckoning_left_s = (double)NAN;
  if (!wm_estimate_has_pose(fused)) return;
  if (wm_odometry_at(self->odometry_memory, wm_odometry_newest_ns(self->odometry_memory), &odom) != WM_OK) return;
  wm_budget_take(&self->budget, fused, &odom);
  wm_budget_left(&self->budget, fused, &out->reckoning_left_m, &out->reckoning_left_s);
}

void wm_pipeline_health(wm_pipeline *self, wm_time_ns now_ns, wm_health *out) {
  memset(out, 0, sizeof *out);
  wm_estimate estimate;
  wm_fuser_estimate(&self->fuser, &estimate);
  out->t_ns = now_ns;
  wm_fuser_health(&self->fuser, out);
  if (self->assembly->building) {
    out->floor_count = (uint32_t)self->assembly->building->plan.count;
    (void)snprintf(out->floor_name, sizeof out->floor_name, "%s",
                   wm_building_floor_name(self->assembly->building, out->floor));
  }
  out->jumps = self->predictor.jumps;
  out->published = self->published;
  reckoning_left(self, &estimate, out);
  out->source_count = (uint32_t)self->assembly->source_count;
  for (size_t i = 0; i < self->assembly->source_count; i++) {
    source_health(self, i, now_ns, &out->sources[i]);
    (void)wm_pipeline_unused(self, i, out->refused_because[i]);
  }
}
