// SPDX-License-Identifier: Apache-2.0
// Which pictures a run saw. A run on devices loses some, and passes over others because it is busy; a replay of the
// recording that it was fed from looks at the same ones by its log, as late as they came there, and the two can be
// compared.
#ifndef WAYMARK_REPLAY_SEEN_FRAMES_H
#define WAYMARK_REPLAY_SEEN_FRAMES_H

#include "fusion/assembly.h"

// Reads the log at `path` and lets the pictures' sources of `assembly` (of `recording`) look at nothing else. The run's
// clock is found by the motion that both hold: what was said the same way in both, by where most of it agrees.
// WM_BAD_DATA where log and recording have no motion in common, or the log has no pictures. *offset_ns: the run's clock
// minus the recording's. Reads the recording's motion a second time; allocates.
wm_status seen_frames_apply(const char *path, wm_recording *recording, wm_assembly *assembly, wm_time_ns *offset_ns,
                            wm_error *err);

#endif
