// SPDX-License-Identifier: Apache-2.0
// Which filters the library has.
#include <waymark/estimator.h>

#include <cstdio>

int main() {
  size_t count = 0;
  const wm_estimator *const *filters = wm_estimators(&count);
  for (size_t i = 0; i < count; i++) std::printf("%s: %s\n", filters[i]->name, filters[i]->about);
  return wm_estimator_find("landmark_ekf") ? 0 : 1;
}
