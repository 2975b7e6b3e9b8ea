// SPDX-License-Identifier: Apache-2.0
// The pictures that a run processed. A run on devices loses some and skips others; a replay of the recording that it
// was fed from processes the same ones, with the same arrivals, so that the two can be compared.
#ifndef WAYMARK_REPLAY_SEEN_FRAMES_H
#define WAYMARK_REPLAY_SEEN_FRAMES_H

#include "fusion/assembly.h"

// Reads the log at `path` and restricts the picture sources of `assembly` (of `recording`) to its pictures. The offset
// between the clocks is found from the motion that log and recording have in common. WM_BAD_DATA where they have none,
// or the log has no pictures. *offset_ns: the run's clock minus the recording's. Reads the recording's motion a second
// time; allocates.
wm_status seen_frames_apply(const char *path, wm_recording *recording, wm_assembly *assembly, wm_time_ns *offset_ns,
                            wm_error *err);

#endif
