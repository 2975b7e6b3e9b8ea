// SPDX-License-Identifier: Apache-2.0
// An estimator over the floors of a building. Each floor has a state of the same estimator, with the floor's map. One
// runs; where the floor is in doubt, those of all floors that may be the robot's do.
#ifndef WAYMARK_CARRIER_H
#define WAYMARK_CARRIER_H

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

// What an estimator needs to change between floors.
typedef struct wm_carrier {
  // `to` takes up all that `from`, of another floor, knows of robot, motion and sensors. `by`: the axes of from's map,
  // in those of to's, by which the pose and its covariance go along; NULL: the robot may be anywhere on to's map. No
  // longer than a few corrections.
  void (*carry)(void *to, const void *from, const wm_pose2 *by);
  // Log Bayes factor of the newest sighting or marker, "anywhere" against "as expected of this pose on this map", nats.
  // 0: no evidence of the floor. NaN: the fit is unknown, and the observation is not compared.
  double (*misfit)(const void *state);
} wm_carrier;

// NULL: the estimator has one floor.
const wm_carrier *wm_carrier_of(const wm_estimator *estimator);

// Makes *out the estimator over floors that runs `inner`, of which there is a carrier, for each: setup->floors has
// them. It takes WM_EVENT_SET_FLOOR, too. docs/building.md has how it finds the floor.
void wm_estimator_over_floors(const wm_estimator *inner, wm_estimator *out);

// The axes of floor `from`, in those of floor `to`, by the connection with an end nearest to (x_m, y_m) on `from`. 0:
// none has an end on both.
int wm_floor_way(const wm_floor_plan *plan, int from, int to, double x_m, double y_m, wm_pose2 *out);

#ifdef __cplusplus
}
#endif

#endif
