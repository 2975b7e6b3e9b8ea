// SPDX-License-Identifier: Apache-2.0
// What the drive cannot show, by the sigmas with which the estimator's states of calibration end: a value that is still
// as uncertain as it was stated, or of which a sum alone is known.
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

#define OPEN_SHARE 0.7  // of the stated sigma, with which a state ends of which the drive showed nothing
// Of two states of which a sum alone is known: they end equally uncertain, in metres. Below OPEN_M both are known.
#define SUM_SHARE 0.25
#define OPEN_M 0.05
#define FUSED_MIN 50

static const wm_calibration_value *value_of(const wm_health *health, const char *name) {
  for (uint32_t i = 0; i < wm_health_calibration_count(health); i++)
    if (strcmp(wm_health_calibration(health, i)->name, name) == 0) return wm_health_calibration(health, i);
  return NULL;
}

// The receiver's delay t and its antenna's place x along the way: at the speed v a position shows x - v t alone.
static void delay_and_antenna(const drive_evidence *drive, const wm_health *health, wm_findings *out) {
  const wm_calibration_value *delay = value_of(health, "gnss.time_offset_s"),
                             *antenna = value_of(health, "gnss.antenna_x_m");
  if (!delay || !antenna || drive->driven == 0) return;
  const double v = sqrt(drive->speed_squares / (double)drive->driven);
  const double delay_m = v * delay->sigma, antenna_m = antenna->sigma;
  if (fmin(delay_m, antenna_m) < OPEN_M || fabs(delay_m - antenna_m) > SUM_SHARE * fmax(delay_m, antenna_m)) return;
  wm_find(
      out, WM_FOUND_NOT_OBSERVABLE, WM_SEVERITY_NOTE, "gnss",
      "measure the antenna's place (gnss: {mounting: {xyz_m}} in calibration.yaml), or drive with several speeds",
      "the receiver's delay (%.2g +- %.2g s) and its antenna's place ahead (%.2g +- %.2g m) are not observable apart "
      "in this drive, at %.2g m/s: only their sum is",
      delay->value, delay->sigma, antenna->value, antenna->sigma, v)
      ->size = delay_m;
}

static double stated(const wm_assembly *assembly, const char *key) {
  const wm_param_table *table = &wm_motion_params_table;
  for (size_t i = 0; i < table->count; i++) {
    double value = (double)NAN;
    if (strcmp(table->params[i].key, key) != 0) continue;
    memcpy(&value, (const char *)assembly->setup.motion + table->params[i].offset, sizeof value);
    return fabs(value);  // below 0: of that size, where the data have it
  }
  return (double)NAN;
}

// A run that makes its own map has no standard of length but the wheels' and the sensors' own.
static void scale(const drive_evidence *drive, const wm_assembly *assembly, const wm_health *health, wm_findings *out) {
  const wm_calibration_value *way = value_of(health, "motion.speed_scale");
  if (!way || drive->fused < FUSED_MIN || assembly->setup.landmark_count > 0 || value_of(health, "gnss.time_offset_s"))
    return;
  const double before = stated(assembly, "states.speed_scale_sigma");
  if (!(way->sigma > OPEN_SHARE * before)) return;
  wm_find(out, WM_FOUND_NOT_OBSERVABLE, WM_SEVERITY_NOTE, "motion",
          "give a length that is measured: landmarks.csv with two of them, or markers' size_m",
          "the scale of the way (motion.speed_scale) is not observable in this drive: its sigma is %.2g, %.2g was "
          "stated; the map is as large as the wheels say",
          way->sigma, before)
      ->size = way->sigma;
}

void check_observable(const drive_evidence *drive, const wm_assembly *assembly, const wm_health *health,
                      wm_findings *out) {
  delay_and_antenna(drive, health, out);
  scale(drive, assembly, health, out);
}
