// SPDX-License-Identifier: Apache-2.0
// Whether the observations of a drive agree with its poses. Limits: on 29 drives with good configurations (real and
// simulated, docs/estimators.md) at most 14 % of the updates are refused where the map is known, the mean square of the
// innovations over their sigma is at most 1.34, and the pose is lost for at most 0.5 % of the time.
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli/check/check.h"

#define OBSERVATIONS_MIN 20
#define REFUSED_NOTE 0.07
#define REFUSED_BAD 0.20
#define LOST_BAD 0.05
#define SQUARES_BAD 3.0  // mean square of innovations over their sigma; 1 is expected, correlated errors make it less
#define FACTOR_BAD 3.0   // of a sensor's stated sigma

static landmark_evidence *landmark(drive_evidence *self, int32_t id) {
  for (size_t i = 0; i < self->landmark_count; i++)
    if (self->landmarks[i].id == id) return &self->landmarks[i];
  if (self->landmark_count == EVIDENCE_LANDMARKS_MAX) return NULL;
  landmark_evidence *new = &self->landmarks[self->landmark_count++];
  *new = (landmark_evidence){.id = id};
  return new;
}

// Log density of an outlier, which has any value: over a turn, over 50 m, over a picture of 1000 px, over half a turn.
static double outlier(unsigned residual) {
  static const double kLog[WM_RESIDUAL_COUNT] = {
      [WM_RESIDUAL_BEARING] = -1.84, [WM_RESIDUAL_RANGE] = -3.91,    [WM_RESIDUAL_X] = -3.91,
      [WM_RESIDUAL_Y] = -3.91,       [WM_RESIDUAL_Z] = -3.91,        [WM_RESIDUAL_HEADING] = -1.84,
      [WM_RESIDUAL_PIXEL] = -6.91,   [WM_RESIDUAL_ELEVATION] = -1.14};
  return kLog[residual];
}

static void take(drive_evidence *self, const wm_innovation *in) {
  double log_likelihood = outlier(in->residual);
  self->updates += in->residual != WM_RESIDUAL_STANDSTILL;
  residual_evidence *r = &self->residuals[in->source][in->residual];
  landmark_evidence *l = in->landmark_id >= 0 ? landmark(self, in->landmark_id) : NULL;
  if (in->verdict == WM_FUSED) {
    double difference = in->observed - in->expected;
    if (in->residual == WM_RESIDUAL_BEARING || in->residual == WM_RESIDUAL_HEADING)
      difference = remainder(difference, 2 * M_PI);
    const double scaled = in->variance > 0 ? difference / sqrt(in->variance) : 0;
    r->fused++;
    r->sum += scaled;
    r->squares += scaled * scaled;
    if (in->variance > 0 && in->residual != WM_RESIDUAL_STANDSTILL) {
      log_likelihood = fmax(log_likelihood, -0.5 * scaled * scaled - 0.5 * log(2 * M_PI * in->variance));
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

void evidence_put(drive_evidence *self, wm_output_kind kind, const void *record) {
  if (kind == WM_OUTPUT_INNOVATION) take(self, record);
  if (kind != WM_OUTPUT_PUBLISHED) return;
  const wm_published *published = record;
  self->published++;
  if (published->now.state < sizeof self->states / sizeof self->states[0]) self->states[published->now.state]++;
}

double evidence_share(const drive_evidence *self, wm_state state, uint64_t total) {
  uint64_t count = self->states[state];
  if (state == WM_STATE_SEARCHING && total > self->published) count += total - self->published;
  return total > 0 ? (double)count / (double)total : 0;
}

// ── findings ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void refused(const drive_evidence *self, const wm_assembly *assembly, size_t i, findings *out) {
  uint64_t fused = 0, refused = 0, worst = 0;
  double squares = 0;
  for (size_t k = 0; k < WM_RESIDUAL_COUNT; k++) {
    const residual_evidence *r = &self->residuals[i][k];
    fused += r->fused;
    refused += r->refused;
    if (r->fused >= OBSERVATIONS_MIN && r->squares / (double)r->fused > squares) {
      squares = r->squares / (double)r->fused;
      worst = k;
    }
  }
  const char *name = assembly->sources[i].name;
  const double share = fused + refused > 0 ? (double)refused / (double)(fused + refused) : 0;
  if (fused + refused >= OBSERVATIONS_MIN && share > REFUSED_NOTE)
    find(out, share > REFUSED_BAD ? FINDING_BAD : FINDING_NOTE, name,
         "see what is found below; else compare what the sensor gives with what the files say of it",
         "%.0f of 100 of its updates contradict the pose and are refused", 100 * share);
  if (squares > SQUARES_BAD)
    find(out, FINDING_BAD, name, "raise the sensor's sigma if it is as noisy; else look at clock, mounting and map",
         "its innovations (%s) are %.1f times as large as stated", wm_residual_name((unsigned)worst), sqrt(squares));
}

static void states(const drive_evidence *self, uint64_t total, findings *out) {
  const double lost = evidence_share(self, WM_STATE_LOST, total);
  const double searching = evidence_share(self, WM_STATE_SEARCHING, total);
  if (lost > LOST_BAD)
    find(out, FINDING_BAD, "drive", "the findings about the sources and the calibration name the likely causes",
         "the pose is lost for %.0f %% of the drive: what is observed contradicts it", 100 * lost);
  if (searching > 0.5)
    find(out, FINDING_BAD, "drive", "give `vehicle.initial_pose` in recording.yaml, or sightings that tell where it is",
         "no pose is found for %.0f %% of the drive", 100 * searching);
}

// Landmarks of which most sightings are refused while most of the others fit.
static void landmarks(const drive_evidence *self, findings *out) {
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
      find(out, FINDING_NOTE, "landmarks", "is it where the map has it, and is its id not another one's?",
           "landmark %" PRId32 ": %" PRIu64 " of %" PRIu64 " updates contradict the pose", l->id, l->refused, all);
  }
}

// Landmarks that are seen, but are not on the map, in one line.
static void unknown(const drive_evidence *self, findings *out) {
  char ids[160];
  size_t used = 0, count = 0;
  for (size_t i = 0; i < self->landmark_count; i++) {
    if (self->landmarks[i].unknown < OBSERVATIONS_MIN) continue;
    count++;
    const int n = snprintf(ids + used, sizeof ids - used, "%s%" PRId32, used ? ", " : "", self->landmarks[i].id);
    if (n > 0 && used + (size_t)n < sizeof ids) used += (size_t)n;
  }
  if (count > 0)
    find(out, FINDING_NOTE, "landmarks",
         "add them to landmarks.csv, leave them if they are not of this place, or map them (estimator: slam)",
         "%zu landmarks are seen that are not on the map: %.*s", count, (int)used, ids);
}

// A state of calibration that ended where no tape measure and no data sheet would put it.
static void calibration(const wm_health *health, findings *out) {
  static const struct {
    const char *ending;
    double expected, least, most;  // a note beyond
    double bad_least, bad_most;
    const char *mend;
  } kLimits[] = {
      // Tyres, ranges and gyros are off by some per cent; beyond a factor of 1.8 it is another radius, track or unit.
      {"_scale", 1, 1 / 1.2, 1.2, 1 / 1.8, 1.8, "multiply the value that it scales by this factor"},
      {"noise.", 1, 0, FACTOR_BAD, 0, FACTOR_BAD, "the stated sigma is too small, or what is observed does not fit"},
      // A tenth of a second is more than cameras and lasers need; 0.17 rad of yaw are seen with the naked eye.
      {".time_offset_s", 0, -0.1, 0.1, -0.25, 0.25, "correct the stamps of this sensor by this time"},
      {".yaw_rad", 0, -0.17, 0.17, -0.8, 0.8, "turn the sensor's mounting (rpy_deg, the last number) by this angle"},
  };
  for (uint32_t i = 0; i < health->calibration_count; i++) {
    const wm_calibration_value *c = &health->calibration[i];
    for (size_t k = 0; k < sizeof kLimits / sizeof kLimits[0]; k++) {
      if (!strstr(c->name, kLimits[k].ending) || (c->value >= kLimits[k].least && c->value <= kLimits[k].most))
        continue;
      if (fabs(c->value - kLimits[k].expected) < 3 * c->sigma) continue;
      const int is_bad = c->value < kLimits[k].bad_least || c->value > kLimits[k].bad_most;
      find(out, is_bad ? FINDING_BAD : FINDING_NOTE, "calibration", kLimits[k].mend,
           "%s is %.4g +- %.2g at the end; %g was expected", c->name, c->value, c->sigma, kLimits[k].expected);
    }
  }
}

void evidence_judge(const drive_evidence *self, const wm_assembly *assembly, const wm_health *health, uint64_t total,
                    findings *out) {
  for (size_t i = 0; i < assembly->source_count; i++) refused(self, assembly, i, out);
  states(self, total, out);
  landmarks(self, out);
  unknown(self, out);
  calibration(health, out);
}
