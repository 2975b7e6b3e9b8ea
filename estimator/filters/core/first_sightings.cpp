// SPDX-License-Identifier: Apache-2.0
#include "filters/core/first_sightings.hpp"

#include "filters/core/chi_square.hpp"
#include "math/cholesky.hpp"

namespace wm {

void first_sightings::refused(int sensor, int landmark, const row *rows, int count) {
  sensor_record &s = sensor_[sensor];
  s.refused++;
  if (s.kept == kSightings) {
    s.kept--;
    std::memmove(s.of, s.of + 2, sizeof(row) * (kRows - 2));
    std::memmove(s.rows, s.rows + 1, sizeof(s.rows[0]) * (kSightings - 1));
    std::memmove(s.landmark, s.landmark + 1, sizeof(s.landmark[0]) * (kSightings - 1));
  }
  for (int i = 0; i < count; i++) s.of[2 * s.kept + i] = rows[i];
  s.rows[s.kept] = count;
  s.landmark[s.kept] = landmark;
  s.kept++;
}

bool first_sightings::contradict(int sensor, const double pose[kPose][kPose], const double prior[kSensorStates]) const {
  const sensor_record &s = sensor_[sensor];
  if (s.kept < kSightings || s.fused >= s.refused) return false;
  const row *taken[kRows];
  int n = 0;
  bool several = false;
  for (int i = 0; i < kSightings; i++) {
    several = several || s.landmark[i] != s.landmark[0];
    for (int k = 0; k < s.rows[i]; k++) taken[n++] = &s.of[2 * i + k];
  }
  if (!several) return false;
  double variance[kRows * kRows], left[kRows];
  for (int i = 0; i < n; i++) {
    const row &a = *taken[i];
    left[i] = a.innovation;
    for (int j = 0; j <= i; j++) {
      const row &b = *taken[j];
      double sum = i == j ? a.noise : 0.0;
      for (int k = 0; k < kSensorStates; k++) sum += a.by_own[k] * b.by_own[k] * prior[k];
      for (int k = 0; k < kPose; k++)
        for (int l = 0; l < kPose; l++) sum += a.by_pose[k] * b.by_pose[l] * pose[k][l];
      variance[i * kRows + j] = sum;
    }
  }
  if (!factorize(n, variance, kRows)) return false;
  substitute_forward(n, variance, kRows, left);
  double nis = 0.0;
  for (int i = 0; i < n; i++) nis += square(left[i]);
  return nis < chi_square_limit(n);
}

}  // namespace wm
