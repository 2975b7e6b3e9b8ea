// SPDX-License-Identifier: Apache-2.0
#include "cli/opened.h"

#include <string.h>

#include "cli/commands.h"
#include "fusion/assembly.h"
#include "fusion/choice.h"
#include "live/robot.h"

void opened_close(opened *self) {
  wm_recording_close(self->recording);
  wm_config_free(&self->config);
  self->recording = NULL;
}

// A played recording replaces the robot's devices; the robot's saved state is not used, except with --resume.
static void without_robot(wm_config *config, int resumes) {
  if (!resumes) config->saved_pose[0] = config->saved_map[0] = config->black_box[0] = '\0';
  config->devices.sightings_by_lcm = 0;
}

wm_status opened_open(const opened_choice *choice, opened *out, wm_error *err) {
  wm_config *config = &out->config;
  memset(out, 0, sizeof *out);
  wm_status status = wm_config_load_undecided(choice->config, config, err);
  if (status != WM_OK) return err->status = WM_BAD_CONFIG;  // also for a missing file
  if (config->estimator) wm_config_each_warning(config, print_note, NULL);
  if (choice->recording) without_robot(config, choice->resumes);
  status = override_path(config->overrides.landmarks, choice->landmarks, err);
  if (status == WM_OK) status = override_path(config->overrides.calibration, choice->calibration, err);
  if (status == WM_OK) status = override_path(config->overrides.map, choice->map, err);
  if (status == WM_OK)
    status = choice->recording
                 ? wm_recording_open(choice->recording, &config->overrides, print_warning, NULL, &out->recording, err)
                 : wm_robot_open(config, print_warning, NULL, &out->recording, err);
  if (status == WM_OK) status = wm_choose_estimator(config, out->recording, print_note, NULL, err);
  if (status != WM_OK) opened_close(out);
  return status;
}

wm_status opened_open_to_run(const opened_choice *choice, uint64_t seed, opened *out, wm_error *err) {
  static wm_assembly assembly;
  wm_status status = opened_open(choice, out, err);
  if (status != WM_OK) return status;
  status = wm_assemble(&out->config, out->recording, seed, &assembly, err);
  wm_assembly_close(&assembly);
  if (status != WM_OK) opened_close(out);
  return status;
}
