// SPDX-License-Identifier: Apache-2.0
// Whether the drive that `waymark init` was given can be driven with the configuration that it wrote. In C, as the
// assembly of a run.
#ifndef WM_INIT_FIRST_DRIVE_H
#define WM_INIT_FIRST_DRIVE_H

#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Reads `config` and `recording` as a run does; what they lack stands in the error.
wm_status init_first_drive(const char *config, const char *recording, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
