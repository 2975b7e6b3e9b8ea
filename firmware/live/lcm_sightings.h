// SPDX-License-Identifier: Apache-2.0
// Landmark sightings of another program on the robot (a detector of its own, a laser's driver) as a source of events:
// observations_t on <prefix>SIGHTINGS, in the format of a run's own <prefix>OBSERVATIONS.
#ifndef WAYMARK_LIVE_LCM_SIGHTINGS_H
#define WAYMARK_LIVE_LCM_SIGHTINGS_H

#include <lcm/lcm.h>

#include "waymark/setup.h"
#include "waymark/source.h"

// `sensors` (of calibration.yaml) outlive the source: a message names one of them. `lent` may be NULL: then connecting
// is tried again and again. Allocates.
wm_status lcm_sightings_open(const char *url, const char *channel_prefix, const wm_sensor *sensors, size_t sensor_count,
                             lcm_t *lent, wm_source **out, wm_error *err);

#endif
