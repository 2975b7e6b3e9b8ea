// SPDX-License-Identifier: Apache-2.0
// Sightings of landmarks that another program on the robot makes (a detector of its own, a laser's driver), as a source
// of events: observations_t on <prefix>SIGHTINGS, in the form in which a run sends its own on <prefix>OBSERVATIONS.
#ifndef WAYMARK_LIVE_LCM_SIGHTINGS_H
#define WAYMARK_LIVE_LCM_SIGHTINGS_H

#include <lcm/lcm.h>

#include "waymark/setup.h"
#include "waymark/source.h"

// `sensors`, calibration.yaml's, outlive the source: a message names one of them. `lent` may be NULL: then a way is
// looked for, again and again. Allocates.
wm_status lcm_sightings_open(const char *url, const char *channel_prefix, const wm_sensor *sensors, size_t sensor_count,
                             lcm_t *lent, wm_source **out, wm_error *err);

#endif
