// SPDX-License-Identifier: Apache-2.0
// The kind of the motion's source: by its model, and of twists, whether they are commands or measured. From it follow
// the calibration states that a default turns on, and the default noise.
#ifndef WAYMARK_ESTIMATOR_MOTION_KIND_HPP
#define WAYMARK_ESTIMATOR_MOTION_KIND_HPP

#include "motion/motion_params.h"
#include "waymark/repeated_rows.h"

namespace wm {

enum motion_kind : uint8_t {
  kKindUnknown,
  kKindTicks,
  kKindGyro,      // a speed and a yaw rate
  kKindSteering,  // a speed and a steering angle
  kKindTwist,     // of which the kind is not yet known
  kKindMeasured,
  kKindCommands,
  kKindCalibrated  // increments with covariances: who states these has calibrated the source
};

// Sigma and value of a term's state at the start, by its parameter and the drive.
double start_sigma(const wm_motion_states &states, int term);
double start_value(const wm_motion_states &states, int term);

// Whether a term of the calibration is a state: always, where its sigma is above 0; by the kind, where it is below.
bool is_state(double sigma, int term, motion_kind kind);
// Whether it may become one with this model (wm_motion_model) and this drive.
bool may_be_state(const wm_motion_states &states, int term, int model);

// Relative noise of the speed, and noise of the turn rate; parameters below 0 by the kind.
struct rate_noise {
  double speed_rel, yaw_rate_radps, yaw_rate_rel;
};
rate_noise rate_noise_of(const wm_motion_params &params, motion_kind kind);

// Commands repeat until they change, whereas a measurement has noise (waymark/repeated_rows.h).
class command_detector {
 public:
  void note(double v_mps, double w_radps, bool moving) { wm_rows_note(&rows_, v_mps, w_radps, moving); }
  motion_kind kind() const {
    return rows_.kind == WM_ROWS_COMMANDS   ? kKindCommands
           : rows_.kind == WM_ROWS_MEASURED ? kKindMeasured
                                            : kKindUnknown;
  }

 private:
  wm_repeated_rows rows_;
};

}  // namespace wm

#endif
