// SPDX-License-Identifier: Apache-2.0
// Which of an IMU's axes is up, by gravity, and the unit of its accelerations.
#include <math.h>
#include <string.h>

#include "cli/check/comparisons.h"

#define DEGREES (180 / M_PI)
#define G_MPS2 9.80665
#define NEAR 0.1  // of gravity in a unit: biases and scales of cheap accelerometers

// Whether the accelerometer of this source shows that it hangs upside down.
int gravity_is_below(const channels *all, uint16_t source) {
  const double *a = all->acceleration[source];
  const double n = (double)all->accelerations[source];
  return n > 0 && a[2] / n < -0.7 * sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) / n && a[2] / n < -2;
}

static void matrix_of(const double rpy[3], double out[3][3]) {
  const double sr = sin(rpy[0]), cr = cos(rpy[0]), sp = sin(rpy[1]), cp = cos(rpy[1]), sy = sin(rpy[2]),
               cy = cos(rpy[2]);
  const double m[3][3] = {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                          {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                          {-sp, cp * sr, cp * cr}};
  memcpy(out, m, sizeof m);
}

// The line that mounts an IMU which, on the axes of base_link as they are stated, has to be turned by rpy_deg more.
const char *gravity_mounting(const wm_assembly *assembly, double roll_deg, double pitch_deg, char *out,
                             size_t capacity) {
  static const double kNone[3] = {0, 0, 0};
  const double more[3] = {roll_deg / DEGREES, pitch_deg / DEGREES, 0};
  double by[3][3], old[3][3], m[3][3];
  matrix_of(more, by);
  matrix_of(assembly->imu ? assembly->imu->rpy_rad : kNone, old);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) m[i][k] = by[i][0] * old[0][k] + by[i][1] * old[1][k] + by[i][2] * old[2][k];
  const int is_upright = fabs(m[2][0]) < 1 - 1e-9;  // else roll and yaw are one
  const double rpy[3] = {is_upright ? atan2(m[2][1], m[2][2]) : 0, asin(fmax(-1, fmin(1, -m[2][0]))),
                         is_upright ? atan2(m[1][0], m[0][0]) : atan2(-m[0][1], m[1][1])};
  double deg[3];
  for (int i = 0; i < 3; i++) {
    deg[i] = round(rpy[i] * DEGREES * 10) / 10 + 0.0;
    if (deg[i] == -180) deg[i] = 180;
  }
  (void)snprintf(out, capacity, "`imu: {mounting: {rpy_deg: [%g, %g, %g]}}`", deg[0], deg[1], deg[2]);
  return out;
}

// An accelerometer at rest, or on the average of a drive, measures 9.8 m/s2 upwards.
static void judge(const channels *all, uint16_t source, const wm_assembly *assembly, wm_findings *out) {
  static const struct {
    double size;
    const char *unit;
  } kUnits[] = {{1, "g"}, {1000, "thousandths of g"}, {100 * G_MPS2, "cm/s2"}};
  const double n = (double)all->accelerations[source];
  double a[3], size = 0;
  if (n < 100) return;
  int axis = 0;
  for (int k = 0; k < 3; k++) {
    a[k] = all->acceleration[source][k] / n;
    size += a[k] * a[k];
    if (fabs(a[k]) > fabs(a[axis])) axis = k;
  }
  size = sqrt(size);
  const char *about = wm_assembly_source_name(assembly, source);
  char fix[WM_FINDING_FIX_MAX];
  const char *unit = NULL;
  double off = NEAR;
  for (size_t i = 0; i < sizeof kUnits / sizeof kUnits[0]; i++) {
    if (!(fabs(size / kUnits[i].size - 1) < off)) continue;
    off = fabs(size / kUnits[i].size - 1);
    unit = kUnits[i].unit;
  }
  if (unit || size > 3 * G_MPS2) {
    (void)snprintf(fix, sizeof fix, "its accelerations are in %s: times %.6g (ax_mps2, ay_mps2, az_mps2)",
                   unit ? unit : "another unit", G_MPS2 / size);
    wm_find(out, WM_FOUND_VALUE_IMPLAUSIBLE, WM_SEVERITY_BAD, about, fix,
            "the mean of its acceleration is %.2f m/s2, gravity is 9.8", size);
    return;
  }
  // Within 45 degrees of up, or no gravity in it: a tilt is the mounting's own business.
  if (wm_findings_has(out, WM_FOUND_SENSORS_DISAGREE, about)) return;
  if (size < 8 || size > 11.5 || (axis == 2 && a[2] > 0) || fabs(a[axis]) < 0.9 * size) return;
  const double by_deg = axis == 2 ? 180 : a[axis] > 0 ? 90 : -90;
  char line[96];
  (void)snprintf(fix, sizeof fix, "calibration.yaml: %s, with the last number by its direction%s",
                 gravity_mounting(assembly, axis == 0 ? 0 : by_deg, axis == 0 ? -by_deg : 0, line, sizeof line),
                 axis == 2 ? "; or all accelerations have the other sign" : "");
  wm_find(out, WM_FOUND_SENSORS_DISAGREE, WM_SEVERITY_BAD, about, fix,
          "its accelerometer shows gravity on %s%c: that axis is up, not z", a[axis] < 0 ? "-" : "", "xyz"[axis])
      ->size = a[axis];
}

void gravity_judge(const channels *self, const wm_assembly *assembly, wm_findings *out) {
  for (uint16_t source = 0; source < assembly->source_count && source < WM_SOURCES_MAX; source++)
    judge(self, source, assembly, out);
}
