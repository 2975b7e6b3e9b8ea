// SPDX-License-Identifier: Apache-2.0
#include "init/first_drive.h"

#include "config/config.h"
#include "fusion/assembly.h"

wm_status init_first_drive(const char *config, const char *recording, wm_error *err) {
  static wm_config read;
  static wm_assembly assembly;
  wm_recording *drive;
  wm_status status = wm_config_load(config, &read, err);
  if (status != WM_OK) return status;
  status = wm_recording_open(recording, &read.overrides, NULL, NULL, &drive, err);
  if (status == WM_OK) {
    status = wm_assemble(&read, drive, 1, &assembly, err);
    wm_assembly_close(&assembly);
    wm_recording_close(drive);
  }
  wm_config_free(&read);
  return status;
}
