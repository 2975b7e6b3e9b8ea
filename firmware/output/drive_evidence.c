// SPDX-License-Identifier: Apache-2.0
// Whether the observations of a drive agree with its poses. Limits: on 29 drives with good configurations (real and
// simulated, docs/estimators.md) at most 14 % of the updates are refused where the map is known, the mean square of the
// innovations over their sigma is at most 1.34, and the pose is lost for at most 0.5 % of the time.
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "output/drive_evidence.h"
#include "output/likelihood.h"
#include "waymark/motion.h"

#define OBSERVATIONS_MIN 20
#define REFUSED_BAD 0.20  // as in health_findings.c
#define LOST_BAD 0.05
#define SQUARES_BAD 3.0  // mean square of innovations over their sigma; 1 is expected, correlated errors make it less
#define DEGRADED_NOTE 0.01  // good drives are degraded for less
#define DEGRADED_BAD 0.10
#define UNSUPPORTED_MIN 20   // observations or pictures: with fewer the robot may have seen nothing yet
#define UNSUPPORTED_BAD 0.5  // share of the time in dead reckoning, where no observation was ever fused
// The same where some were: of the time, and of the observations that were used.
#define HARDLY_SUPPORTED_BAD 0.9
#define HARDLY_USED 0.1
#define SQUARES_LEAST 0.01  // mean square of innovations over their sigma: a tenth of what is stated
// Motion data that no robot can do, of all: single ones are slips and disturbances.
#define OUTLIERS_MIN 20
#define OUTLIERS_NOTE 0.001
#define OUTLIERS_BAD 0.02
#define BIASED_LOST_MAX 0.3  // share of the time lost beyond which a bias may come from wrong poses
#define MAP_SCALE 0.03       // beyond this neither a tyre nor a sensor is off, where the two agree
#define EXPLAINED_MIN 0.6    // of the edge points of the last metre; of good drives 0.85 and more
#define EXPLAINED_SCANS 50   // with fewer scans one place that is crowded is all of the drive
#define FACTOR_BAD 3.0       // of a sensor's stated sigma
// Mean of the innovations over their sigma. Errors that last are correlated, so a tenth of a sigma is usual.
#define BIAS_NOTE 0.5
// Ranges of radio and ultrasound are some per cent long; a tape measure and a map are not off by 2 %.
#define RANGE_RATIO_NOTE 0.02
#define RANGE_MIN_M 0.5       // of a ratio: below, a range is mostly noise and mounting
#define RANGE_RATIO_MAX 0.25  // of a ratio: beyond, it is an outlier
#define DRIVES_MPS 0.1        // slower, it stands
#define START_S 15.0          // a new pose this soon after the start contradicts the start
// Of a start: what a tape measure and a look along the robot's side give.
#define START_JUMP_M 0.5
#define START_JUMP_RAD 0.35

static landmark_evidence *landmark(drive_evidence *self, int32_t id) {
  for (size_t i = 0; i < self->landmark_count; i++)
    if (self->landmarks[i].id == id) return &self->landmarks[i];
  if (self->landmark_count == EVIDENCE_LANDMARKS_MAX) return NULL;
  landmark_evidence *new = &self->landmarks[self->landmark_count++];
  *new = (landmark_evidence){.id = id};
  return new;
}

static void take_ratio(residual_evidence *r, const wm_innovation *in) {
  if (in->residual != WM_RESIDUAL_RANGE || !(in->expected > RANGE_MIN_M)) return;
  if (in->verdict != WM_FUSED && in->verdict != WM_REJECTED_GATE) return;
  const double ratio = in->observed / in->expected - 1;
  if (!(fabs(ratio) < RANGE_RATIO_MAX)) return;
  r->ratio += ratio;
  r->ratio_squares += ratio * ratio;
  r->ratios++;
}

static void take(drive_evidence *self, const wm_innovation *in) {
  double log_likelihood = wm_outlier_log_density(in->residual, in->variance);
  self->updates += in->residual != WM_RESIDUAL_STANDSTILL;
  residual_evidence *r = &self->residuals[in->source][in->residual];
  landmark_evidence *l = in->landmark_id >= 0 ? landmark(self, in->landmark_id) : NULL;
  take_ratio(r, in);
  if (in->verdict == WM_FUSED) {
    const double scaled = in->variance > 0 ? wm_innovation_difference(in) / sqrt(in->variance) : 0;
    r->fused++;
    r->sum += scaled;
    r->squares += scaled * scaled;
    if (in->variance > 0 && in->residual != WM_RESIDUAL_STANDSTILL) {
      log_likelihood = fmax(log_likelihood, wm_innovation_log_density(in));
      self->fused++;
    }
    if (l) l->fused++;
  } else if (in->verdict == WM_REJECTED_GATE || in->verdict == WM_REJECTED_SEARCHING) {
    r->refused++;
    if (l) l->refused++;
  } else if (in->verdict == WM_REJECTED_UNKNOWN_ID && l) {
    l->unknown++;
  }
  self->log_likelihood += log_likelihood;
}

double evidence_score(const drive_evidence *self) {
  return self->updates > 0 ? self->log_likelihood / (double)self->updates : -(double)INFINITY;
}

static void take_event(drive_evidence *self, const wm_event *event) {
  if (!self->has_events) self->first_ns = event->t_ns;
  if (self->has_events && event->t_ns / 2 - self->last_ns / 2 > WM_LONGEST_SILENCE_NS / 2)
    self->silent_s += wm_seconds_between(self->last_ns, event->t_ns);
  self->has_events = 1;
  self->last_ns = event->t_ns;
}

static void take_published(drive_evidence *self, const wm_published *p) {
  if (p->now.state < WM_STATE_COUNT) self->states[p->now.state]++;
  const int has_source = p->now.cause_source >= 0 && p->now.cause_source < WM_SOURCES_MAX;
  const int is_lost = p->now.state == WM_STATE_LOST;
  if ((p->now.state == WM_STATE_DEGRADED || is_lost) && p->now.cause < WM_CAUSE_COUNT)
    self->causes[is_lost][has_source ? p->now.cause_source : WM_SOURCES_MAX][p->now.cause]++;
  const double speed_mps = hypot(p->now.v_mps[0], p->now.v_mps[1]);
  if (speed_mps > DRIVES_MPS) {
    self->speed_squares += speed_mps * speed_mps;
    self->driven++;
  }
  if (self->published++ == 0) self->begun = *p;
  const double after_s = wm_seconds_between(self->begun.now.t_ns, p->now.t_ns);
  if (self->start_moved_s > 0 || after_s > START_S || p->now.resets == self->begun.now.resets) return;
  self->start_moved_s = after_s;
  self->start_moved_m = p->last_jump_m;
  self->start_turned_rad = p->last_jump_rad;
}

void evidence_put(drive_evidence *self, wm_output_kind kind, const void *record) {
  if (kind == WM_OUTPUT_INNOVATION) take(self, record);
  if (kind == WM_OUTPUT_PUBLISHED) take_published(self, record);
  if (kind == WM_OUTPUT_BOUND) self->unusable[((const wm_bound *)record)->why]++;
  if (kind == WM_OUTPUT_EVENT) take_event(self, record);
  self->poses += kind == WM_OUTPUT_POSE;
}

uint64_t evidence_due(const drive_evidence *self, double publish_rate_hz) {
  const double driven_s = wm_seconds_between(self->first_ns, self->last_ns) - self->silent_s;
  return self->has_events && driven_s > 0 ? (uint64_t)(driven_s * publish_rate_hz) : 0;
}

double evidence_share(const drive_evidence *self, wm_state state, uint64_t total) {
  uint64_t count = self->states[state];
  if (state == WM_STATE_SEARCHING && total > self->published) count += total - self->published;
  return total > 0 ? (double)count / (double)total : 0;
}

// ── findings ────────────────────────────────────────────────────────────────────────────────────────────────────────

// All innovations of a source are far smaller than stated: it has hardly any weight.
static void weightless(const drive_evidence *self, const wm_assembly *assembly, size_t i, wm_findings *out) {
  double squares = 0;
  uint64_t fused = 0;
  // Of a picture's edges one innovation stands for hundreds of points, along their best axis: it is small.
  if (assembly->sources[i].kinds & WM_EVENT_BIT(WM_EVENT_POINTS)) return;
  for (unsigned k = 0; k < WM_RESIDUAL_COUNT; k++) {
    if (k == WM_RESIDUAL_STANDSTILL) continue;
    squares += self->residuals[i][k].squares;
    fused += self->residuals[i][k].fused;
  }
  if (fused < 5 * OBSERVATIONS_MIN || squares > SQUARES_LEAST * (double)fused) return;
  wm_find(out, WM_FOUND_NOISE_TOO_LARGE, WM_SEVERITY_BAD, wm_assembly_source_name(assembly, i), NULL,
          "its innovations are %.2g of what is stated: it has hardly any weight", sqrt(squares / (double)fused))
      ->size = sqrt(squares / (double)fused);
}

// A number of a table of parameters; NaN where it has none of this name.
static double number_of(const wm_param_table *table, const void *params, const char *key) {
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, key) == 0 && table->params[i].type == WM_PARAM_F64) {
      double value;
      memcpy(&value, (const char *)params + table->params[i].offset, sizeof value);
      return value;
    }
  return (double)NAN;
}

// Of a stated sigma, what an innovation's variance has as new each time (positions.noise.factor): the rest is a lasting
// error, a state, so that a receiver whose errors are all new has innovations of 1 over this.
static double new_share(const wm_assembly *assembly, size_t residual) {
  const int is_place = residual == WM_RESIDUAL_X || residual == WM_RESIDUAL_Y || residual == WM_RESIDUAL_Z;
  if (!is_place || !assembly->config->positions) return 1;
  return fmin(number_of(&wm_position_params_table, assembly->config->positions, "noise.factor"), 1);
}

static void refused(const drive_evidence *self, const wm_assembly *assembly, size_t i, wm_findings *out) {
  uint64_t fused = 0, refused = 0, worst = 0;
  double squares = 0;
  for (size_t k = 0; k < WM_RESIDUAL_COUNT; k++) {
    const residual_evidence *r = &self->residuals[i][k];
    fused += r->fused;
    refused += r->refused;
    const double share = new_share(assembly, k), mean = share * share * r->squares / (double)r->fused;
    if (r->fused < OBSERVATIONS_MIN || mean <= squares) continue;
    squares = mean;
    worst = k;
  }
  const char *name = wm_assembly_source_name(assembly, i);
  const double share = fused + refused > 0 ? (double)refused / (double)(fused + refused) : 0;
  const wm_severity severity = wm_refused_severity(refused, fused + refused);
  if (fused + refused >= OBSERVATIONS_MIN && severity != WM_SEVERITY_GOOD)
    wm_find(out, WM_FOUND_OBSERVATIONS_REFUSED, severity, name, NULL,
            "%.0f of 100 of its updates contradict the pose and are refused", 100 * share)
        ->size = share;
  if (squares > SQUARES_BAD)
    wm_find(out, WM_FOUND_NOISE_TOO_SMALL, WM_SEVERITY_BAD, name, NULL,
            "its innovations (%s) are %.1f times as large as stated", wm_residual_name((unsigned)worst), sqrt(squares))
        ->size = sqrt(squares);
}

// Innovations with a mean: a scale or an offset that no state takes up.
static void biased(const drive_evidence *self, const wm_assembly *assembly, size_t i, int is_lost, wm_findings *out) {
  const residual_evidence *ranges = &self->residuals[i][WM_RESIDUAL_RANGE];
  const double ratio = ranges->ratios > 0 ? ranges->ratio / (double)ranges->ratios : 0;
  const char *name = wm_assembly_source_name(assembly, i);
  if (is_lost) return;  // the poses are wrong as well
  for (unsigned k = 0; k < WM_RESIDUAL_COUNT; k++) {
    const residual_evidence *r = &self->residuals[i][k];
    const double mean = r->fused >= 5 * OBSERVATIONS_MIN ? r->sum / (double)r->fused : 0;
    if (k == WM_RESIDUAL_STANDSTILL || fabs(mean) < BIAS_NOTE) continue;
    if (k == WM_RESIDUAL_RANGE && fabs(ratio) > RANGE_RATIO_NOTE) continue;  // the finding below
    wm_find(out, WM_FOUND_OBSERVATIONS_BIASED, WM_SEVERITY_NOTE, name, NULL,
            "its innovations (%s) have a mean of %.1f sigma: what is observed is too %s", wm_residual_name(k), mean,
            mean > 0 ? "large" : "small")
        ->size = mean;
  }
  // A scale is common to all ranges: most of the deviation is the mean's.
  if (ranges->ratios < 5 * OBSERVATIONS_MIN || fabs(ratio) < RANGE_RATIO_NOTE ||
      ratio * ratio * (double)ranges->ratios < 0.5 * ranges->ratio_squares)
    return;
  char fix[WM_FINDING_FIX_MAX];
  (void)snprintf(fix, sizeof fix,
                 "multiply range_m by %.3f, or let the scale be estimated (sightings: {states: {range_scale_sigma: "
                 "0.1}}); is the map in the right unit?",
                 1 / (1 + ratio));
  wm_find(out, WM_FOUND_OBSERVATIONS_BIASED, WM_SEVERITY_NOTE, name, fix,
          "its ranges are %.1f %% %s than the map has them, on average", 100 * fabs(ratio),
          ratio > 0 ? "longer" : "shorter")
      ->size = ratio;
}

static double parameter(const wm_config *config, const char *key) {
  return number_of(&config->estimator->params, config->estimator_params, key);
}

static void not_found(const wm_assembly *assembly, double share, wm_findings *out) {
  char fix[WM_FINDING_FIX_MAX];
  const wm_start *given = &assembly->setup.start;
  if (!isnan(given->p_m[0]) && !isnan(given->heading_rad)) {
    wm_find(out, WM_FOUND_POSE_NOT_FOUND, WM_SEVERITY_BAD, "drive",
            "a start is given: see the other findings, and whether its t_ns is within the drive",
            "there is no pose for %.0f %% of the drive", 100 * share)
        ->size = share;
    return;
  }
  const double limit_m = parameter(assembly->config, "recover.sigma_xy_m");
  // A limit in metres is not reached where the positions or ranges have a larger sigma.
  const int is_limited =
      limit_m > 0 && (assembly->kinds & (WM_EVENT_BIT(WM_EVENT_POSITION) | WM_EVENT_BIT(WM_EVENT_SIGHTING)));
  if (is_limited)
    (void)snprintf(fix, sizeof fix,
                   "leave %s.recover.sigma_xy_m out (it is %g m: a pose with a larger sigma is not accepted), or give "
                   "vehicle.initial_pose in recording.yaml",
                   assembly->config->estimator->name, limit_m);
  wm_find(out, WM_FOUND_POSE_NOT_FOUND, WM_SEVERITY_BAD, "drive", is_limited ? fix : NULL,
          share < 1 ? "no pose is found for %.0f %% of the drive" : "no pose was ever found (%.0f %% of the drive)",
          100 * share)
      ->size = share;
}

// The most frequent cause of a degraded or lost state: its text, and the source or `otherwise`.
static const char *cause_of(const drive_evidence *self, const wm_assembly *assembly, int is_lost, const char *otherwise,
                            const char **about) {
  size_t source = WM_SOURCES_MAX, cause = 0;
  for (size_t i = 0; i <= WM_SOURCES_MAX; i++)
    for (size_t k = 1; k < WM_CAUSE_COUNT; k++)
      if (self->causes[is_lost][i][k] > self->causes[is_lost][source][cause]) {
        source = i;
        cause = k;
      }
  *about = source < assembly->source_count ? assembly->sources[source].name
           : cause == WM_CAUSE_OFF_MAP     ? "map"
                                           : otherwise;
  return wm_cause_text((unsigned)cause);
}

static void doubtful(const drive_evidence *self, const wm_assembly *assembly, uint64_t total, wm_findings *out) {
  const double share = evidence_share(self, WM_STATE_DEGRADED, total);
  if (share < DEGRADED_NOTE) return;
  const char *about, *cause = cause_of(self, assembly, 0, "observations", &about);
  wm_find(out, WM_FOUND_POSE_DOUBTFUL, share > DEGRADED_BAD ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, about, NULL,
          "%s: the pose is degraded for %.0f %% of the drive", cause, 100 * share)
      ->size = share;
}

static void is_lost(const drive_evidence *self, const wm_assembly *assembly, double share, wm_findings *out) {
  const char *about, *cause = cause_of(self, assembly, 1, "what is observed", &about);
  wm_find(out, WM_FOUND_POSE_LOST, WM_SEVERITY_BAD, "drive", NULL, "the pose is lost for %.0f %% of the drive: %s %s",
          100 * share, about, cause[0] ? cause : "contradicts it")
      ->size = share;
}

// Observations come, and none reaches the pose: it is the motion's sum, whose error grows without a bound.
static void unsupported(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health,
                        uint64_t total, wm_findings *out) {
  const double share = evidence_share(self, WM_STATE_DEAD_RECKONING, total);
  if (share < (self->fused == 0 ? UNSUPPORTED_BAD : HARDLY_SUPPORTED_BAD)) return;
  const uint64_t observers = wm_assembly_observers(assembly);
  uint64_t received = 0, fused = 0;
  for (uint32_t i = 0; i < health->source_count && i < 64; i++)
    if ((observers >> i) & 1u) {
      received += health->sources[i].received;
      fused += health->sources[i].fused;
    }
  const int is_hardly = (double)fused < HARDLY_USED * (double)received && received >= 5 * UNSUPPORTED_MIN;
  if (received < UNSUPPORTED_MIN || (self->fused > 0 && !is_hardly)) return;
  wm_find(out, WM_FOUND_POSE_DOUBTFUL, WM_SEVERITY_BAD, "observations",
          "is the map given, are the sensors' names, their mountings, the markers' family and the identities those of "
          "this place?",
          "%" PRIu64 " of %" PRIu64 " reach the pose, which is dead reckoning for %.0f %% of the drive", fused,
          received, 100 * share)
      ->size = share;
}

static void outliers(const wm_assembly *assembly, const wm_health *health, wm_findings *out) {
  const wm_counter *counter = wm_health_counter(health, WM_COUNTER_MOTION_OUTLIERS);
  uint64_t received = 0;
  for (uint32_t i = 0; i < health->source_count && i < assembly->source_count; i++)
    if (assembly->sources[i].kinds & WM_MOTION_EVENTS) received += health->sources[i].received;
  const double share = counter && received > 0 ? (double)counter->count / (double)received : 0;
  if (!counter || counter->count < OUTLIERS_MIN || share < OUTLIERS_NOTE) return;
  wm_find(out, WM_FOUND_MOTION_SENSOR, share > OUTLIERS_BAD ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, "motion",
          "look at the sender: a counter that starts anew, bits that are lost, two senders of one message; "
          "motion.limits has the plausible accelerations",
          "%" PRIu64 " of %" PRIu64 " motion data are nothing that a robot can do, and are refused", counter->count,
          received)
      ->size = share;
}

// For how long the wheels did not turn as the robot moved.
static void wheels(const wm_health *health, wm_findings *out) {
  static const struct {
    const char *name, *text;
  } kLies[] = {{"motion.wheels_spin_s", "the wheels turned and the robot stood for %.1f s: a hole, a wall"},
               {"motion.one_wheel_spins_s", "one wheel span for %.1f s, by the gyro"},
               {"motion.pushed_s", "the robot moved and its wheels stood for %.1f s: pushed, or carried"},
               {"motion.lifted_s", "the robot moved otherwise than its wheels turned for %.1f s: lifted, or sliding"}};
  for (uint32_t i = 0; i < wm_health_calibration_count(health); i++)
    for (size_t k = 0; k < sizeof kLies / sizeof kLies[0]; k++)
      if (strcmp(wm_health_calibration(health, i)->name, kLies[k].name) == 0)
        wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_NOTE, "wheels", "", kLies[k].text,
                wm_health_calibration(health, i)->value)
            ->size = wm_health_calibration(health, i)->value;
}

static void states(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health, uint64_t total,
                   wm_findings *out) {
  if (self->published == 0 && self->poses > 0) return;  // a log: it holds no messages
  const double lost = evidence_share(self, WM_STATE_LOST, total);
  const double searching = evidence_share(self, WM_STATE_SEARCHING, total);
  if (lost > LOST_BAD) is_lost(self, assembly, lost, out);
  doubtful(self, assembly, total, out);
  unsupported(self, assembly, health, total, out);
  if (searching > 0.5) not_found(assembly, searching, out);
}

static void start(const drive_evidence *self, const wm_assembly *assembly, wm_findings *out) {
  const wm_start *given = &assembly->setup.start;
  if (isnan(given->p_m[0]) || isnan(given->heading_rad) || !(self->start_moved_s > 0)) return;
  if (self->start_moved_m < START_JUMP_M && self->start_turned_rad < START_JUMP_RAD) return;
  wm_find(
      out, WM_FOUND_START_CONTRADICTED, WM_SEVERITY_NOTE, "start", NULL,
      "initial_pose is contradicted: after %.1f s the pose was found %.2f m from where it was, turned by %.0f degrees",
      self->start_moved_s, self->start_moved_m, self->start_turned_rad * 180 / M_PI)
      ->size = self->start_moved_m;
}

// Landmarks of which most sightings are refused while most of the others fit.
static void landmarks(const drive_evidence *self, wm_findings *out) {
  uint64_t fused = 0, contradict = 0;
  for (size_t i = 0; i < self->landmark_count; i++) {
    fused += self->landmarks[i].fused;
    contradict += self->landmarks[i].refused;
  }
  if ((double)contradict > REFUSED_BAD * (double)(fused + contradict)) return;  // then it isn't one landmark
  for (size_t i = 0; i < self->landmark_count; i++) {
    const landmark_evidence *l = &self->landmarks[i];
    const uint64_t all = l->fused + l->refused;
    if (all >= OBSERVATIONS_MIN && (double)l->refused > 0.5 * (double)all)
      wm_find(out, WM_FOUND_LANDMARK_CONTRADICTED, WM_SEVERITY_NOTE, "landmarks", NULL,
              "landmark %" PRId32 ": %" PRIu64 " of %" PRIu64 " updates contradict the pose", l->id, l->refused, all)
          ->size = (double)l->refused / (double)all;
  }
}

// Landmarks that are seen, but are not on the map, in one line.
static void unknown(const drive_evidence *self, wm_findings *out) {
  char ids[160];
  size_t used = 0, count = 0;
  for (size_t i = 0; i < self->landmark_count; i++) {
    if (self->landmarks[i].unknown < OBSERVATIONS_MIN) continue;
    count++;
    const int n = snprintf(ids + used, sizeof ids - used, "%s%" PRId32, used ? ", " : "", self->landmarks[i].id);
    if (n > 0 && used + (size_t)n < sizeof ids) used += (size_t)n;
  }
  if (count > 0)
    wm_find(out, WM_FOUND_LANDMARK_NOT_ON_MAP, WM_SEVERITY_NOTE, "landmarks",
            "add them to landmarks.csv, leave them if they are not of this place, or map them (estimator: slam)",
            "%zu landmarks are seen that are not on the map: %.*s", count, (int)used, ids)
        ->size = (double)count;
}

// A map that was asked for by name, and that the estimator is configured not to read.
static void map_unused(const wm_assembly *assembly, wm_findings *out) {
  const wm_config *config = assembly->config;
  if (!config->overrides.landmarks[0] || !config->estimator) return;
  const wm_param_table *table = &config->estimator->params;
  for (size_t i = 0; i < table->count; i++) {
    int32_t use;
    if (strcmp(table->params[i].key, "landmarks.map") != 0) continue;
    memcpy(&use, (const char *)config->estimator_params + table->params[i].offset, sizeof use);
    if (use == 0)  // none
      wm_find(
          out, WM_FOUND_DATA_UNUSED, WM_SEVERITY_NOTE, "landmarks",
          "`slam: {landmarks: {map: extend}}` begins with it, `frozen` locates on it alone; or leave `landmarks` out",
          "is not used: slam.landmarks.map is none, so that the run makes a map of its own");
  }
}

static int is_skid_track(const wm_assembly *assembly, const wm_calibration_value *c) {
  const wm_param_table *table = &wm_motion_params_table;
  if (strcmp(c->name, "motion.track_scale") != 0) return 0;
  for (size_t i = 0; i < table->count; i++) {
    int32_t drive = 0;
    if (strcmp(table->params[i].key, "drive") != 0) continue;
    memcpy(&drive, (const char *)assembly->setup.motion + table->params[i].offset, sizeof drive);
    return strcmp(table->params[i].names[drive], "skid_steer") == 0;
  }
  return 0;
}

// A factor of noise against the stated sigma. Of an antenna the way from where calibration.yaml has it; 0 where it has
// none.
static double judged_value(const wm_assembly *assembly, const wm_calibration_value *c) {
  if (strstr(c->name, ".antenna_")) {
    const double stated_m = assembly->setup.rig->antenna_m[strcmp(c->name, "gnss.antenna_y_m") == 0];
    return isfinite(stated_m) ? c->value - stated_m : 0;
  }
  if (strcmp(c->name, "noise.place_factor") != 0) return c->value;
  return c->value * new_share(assembly, WM_RESIDUAL_X);
}

// A state of calibration that ended where no tape measure and no data sheet would put it.
static void calibration(const wm_assembly *assembly, const wm_health *health, wm_findings *out) {
  static const struct {
    const char *ending;
    double expected, least, most;  // a note beyond
    double bad_least, bad_most;
    const char *fix;
  } kLimits[] = {
      // A scale of ranges has no tyre and no temperature: beyond 3 % a unit, a map or a marker's size is off.
      {"range_scale", 1, 0.97, 1.03, 1 / 1.8, 1.8,
       "ranges are too long (above 1) or too short: divide range_m by this"},
      {".angle_scale", 0, -0.03, 0.03, -0.3, 0.3, "the lens is of another resolution or zoom: calibrate it again"},
      // Tyres, ranges and gyros are off by some per cent; beyond a factor of 1.8 it is another radius, track or unit.
      {"_scale", 1, 1 / 1.2, 1.2, 1 / 1.8, 1.8,
       "multiply the value that it scales by this factor; where the robot makes its own map, markers or ranges of a "
       "wrong size look the same"},
      // Nobody states the noise of the turn: a default that is too small for a robot is no mistake in its files.
      {"noise.turn", 1, 0, FACTOR_BAD, 0, INFINITY, "set motion.noise for this robot: `waymark suggest` finds it"},
      {"noise.", 1, 0, FACTOR_BAD, 0, FACTOR_BAD, "the stated sigma is too small, or what is observed does not fit"},
      // A tenth of a second is more than cameras and lasers need; 0.17 rad of yaw are seen with the naked eye.
      {".time_offset_s", 0, -0.1, 0.1, -0.25, 0.25, "correct the stamps of this sensor by this time"},
      {"localizer.distrusted_s", 0, 0, 2, 0, INFINITY,
       "it contradicts the other sources: compare its map and its clock, or write `localizer: {frame: own}`"},
      {"localizer.jumps", 0, 0, 0, 0, INFINITY, "its frame began anew without a word: its `reset` should say so"},
      {".antenna_", 0, -0.05, 0.05, -0.1, 0.1,
       "measure gnss.mounting of calibration.yaml again: this is where the drive shows the antenna"},
      {".yaw_rad", 0, -0.17, 0.17, -0.8, 0.8, "turn the sensor's mounting (rpy_deg, the last number) by this angle"},
  };
  for (uint32_t i = 0; i < wm_health_calibration_count(health); i++) {
    const wm_calibration_value *c = wm_health_calibration(health, i);
    const int skids = is_skid_track(assembly, c);
    const int is_antenna = strstr(c->name, ".antenna_") != NULL;
    const double value = judged_value(assembly, c);
    for (size_t k = 0; k < sizeof kLimits / sizeof kLimits[0]; k++) {
      if (!strstr(c->name, kLimits[k].ending)) continue;
      if (value >= kLimits[k].least && value <= kLimits[k].most) break;
      if (fabs(value - kLimits[k].expected) < 3 * c->sigma) break;
      // Within two sigmas of skid steer's prior it is its base's; beyond, `track_m` is wrong.
      if (skids && fabs(c->value - WM_SKID_TRACK) <= 2 * WM_SKID_TRACK_SIGMA) break;
      const int is_bad = !skids && (value < kLimits[k].bad_least || value > kLimits[k].bad_most ||
                                    wm_health_has_alarm(health, WM_ALARM_STATED, i));
      wm_find(out, WM_FOUND_CALIBRATION_OFF, is_bad ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, "calibration", kLimits[k].fix,
              "%s is %.4g +- %.2g at the end; %g was expected", c->name, c->value, c->sigma,
              skids        ? WM_SKID_TRACK
              : is_antenna ? c->value - value
                           : kLimits[k].expected)
          ->size = c->value;
      break;
    }
  }
}

// Wheels and ranges agree that the map has other lengths than theirs.
static void map_scale(const wm_assembly *assembly, const wm_health *health, wm_findings *out) {
  double way = 0;
  const wm_calibration_value *ranges = NULL;
  for (uint32_t i = 0; i < wm_health_calibration_count(health); i++) {
    const wm_calibration_value *c = wm_health_calibration(health, i);
    if (strcmp(c->name, "motion.speed_scale") == 0) way = log(c->value);
    if (strstr(c->name, ".range_scale") && c->sigma < MAP_SCALE / 3) ranges = c;
  }
  if (!ranges || assembly->setup.landmark_count == 0) return;
  const double range = log(ranges->value);
  if (fabs(way) < MAP_SCALE || fabs(range) < MAP_SCALE || fabs(way + range) > MAP_SCALE / 2) return;
  char fix[WM_FINDING_FIX_MAX];
  const double factor = exp(0.5 * (range - way));
  (void)snprintf(fix, sizeof fix, "landmarks.csv: x_m, y_m and z_m times %.4g, if wheels and ranges are right", factor);
  wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map", fix,
          "by the wheels and by the ranges of %.*s it is %.1f %% too %s", (int)strcspn(ranges->name, "."), ranges->name,
          100 * fabs(1 / factor - 1), factor < 1 ? "large" : "small")
      ->size = factor;
}

// The height above the floor that is stated of a camera, m; 0: there is no such camera.
static double height_of(const wm_assembly *assembly, const char *state) {
  const wm_rig *rig = assembly->setup.rig;
  for (uint32_t i = 0; rig && i < rig->camera_count; i++)
    if (strncmp(rig->cameras[i].name, state, strcspn(state, ".")) == 0) return rig->cameras[i].mounting.xyz_m[2];
  return 0;
}

// Wheels and the height of a camera that sees the floor agree that the plan has other lengths than theirs. And how much
// of what was seen last is on the plan.
static void plan_scale(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health,
                       wm_findings *out) {
  const wm_raster *plan = assembly->setup.map;
  const wm_counter *explained = wm_health_counter(health, WM_COUNTER_EXPLAINED_PERMILLE);
  double way = 0, height = 0;
  for (uint32_t i = 0; i < wm_health_calibration_count(health); i++) {
    const wm_calibration_value *c = wm_health_calibration(health, i);
    if (strcmp(c->name, "motion.speed_scale") == 0) way = log(c->value);
    const double stated = strstr(c->name, ".height_m") ? height_of(assembly, c->name) : 0;
    if (stated > 0 && c->sigma < MAP_SCALE / 2 * stated) height = log(fmax(0.1, 1 + c->value / stated));
  }
  if (plan && fmin(fabs(way), fabs(height)) >= MAP_SCALE && way / height > 0.5 && way / height < 2) {
    char fix[WM_FINDING_FIX_MAX];
    (void)snprintf(
        fix, sizeof fix,
        "map/map.yaml: `resolution: %.5g`, if wheels and camera are right, with origin and initial_pose by it",
        plan->resolution_m / exp(way));
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map", fix,
            "by the wheels (%.1f %%) and by the height of the camera (%.1f %%) the floor plan is too %s",
            100 * fabs(way), 100 * fabs(height), way > 0 ? "large" : "small")
        ->size = exp(way);
  }
  uint64_t scans = 0;
  for (size_t i = 0; i < assembly->source_count; i++)
    if (assembly->sources[i].kinds & WM_EVENT_BIT(WM_EVENT_POINTS))
      scans += self->residuals[i][WM_RESIDUAL_RANGE].fused;
  if (plan && explained && scans >= EXPLAINED_SCANS && (double)explained->count < 1e3 * EXPLAINED_MIN)
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map",
            "look at its scale, at the camera's mounting, and at what stands there that it doesn't have",
            "at the end %" PRIu64 " of 100 edge points are on its edges", explained->count / 10)
        ->size = (double)explained->count * 1e-3;
}

void evidence_judge(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health, uint64_t total,
                    wm_findings *out) {
  for (size_t i = 0; i < assembly->source_count; i++) refused(self, assembly, i, out);
  for (size_t i = 0; i < assembly->source_count; i++) weightless(self, assembly, i, out);
  outliers(assembly, health, out);
  wheels(health, out);
  const int is_lost = evidence_share(self, WM_STATE_LOST, total) > BIASED_LOST_MAX;
  for (size_t i = 0; i < assembly->source_count; i++) biased(self, assembly, i, is_lost, out);
  states(self, assembly, health, total, out);
  start(self, assembly, out);
  landmarks(self, out);
  unknown(self, out);
  calibration(assembly, health, out);
  map_scale(assembly, health, out);
  plan_scale(self, assembly, health, out);
  map_unused(assembly, out);
}
