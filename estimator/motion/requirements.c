// SPDX-License-Identifier: Apache-2.0
// The data that each motion model needs, checked before the drive: without them the pose would stand still silently.
#include <math.h>
#include <stddef.h>

#include "motion/motion_params.h"

#define BIT(quantity) (UINT32_C(1) << (quantity))
#define BOTH_TICKS (BIT(WM_Q_WHEEL_TICKS_LEFT) | BIT(WM_Q_WHEEL_TICKS_RIGHT))
#define SPEEDS                                                                                              \
  (BIT(WM_Q_WHEEL_SPEED_FRONT_LEFT) | BIT(WM_Q_WHEEL_SPEED_FRONT_RIGHT) | BIT(WM_Q_WHEEL_SPEED_REAR_LEFT) | \
   BIT(WM_Q_WHEEL_SPEED_REAR_RIGHT) | BIT(WM_Q_VEHICLE_SPEED))
#define STEERING (BIT(WM_Q_STEERING_WHEEL) | BIT(WM_Q_ROAD_WHEEL) | BIT(WM_Q_STEERING_ACTUATOR))

static int counts_ticks(const wm_wheels *wheels, uint32_t quantities) {
  return (quantities & BOTH_TICKS) == BOTH_TICKS && isfinite(wheels->radius_m) && wheels->ticks_per_turn > 0;
}

static const char *ticks_lack(const wm_wheels *wheels, uint32_t quantities) {
  if ((quantities & BOTH_TICKS) != BOTH_TICKS)
    return "both wheels' ticks (ticks.csv; over CAN wheel_ticks_left and wheel_ticks_right)";
  if (!counts_ticks(wheels, quantities)) return "wheels.radius_m and wheels.ticks_per_turn in calibration.yaml";
  return isfinite(wheels->track_m) ? NULL : "wheels.track_m in calibration.yaml";
}

static const char *speed_lacks(const wm_wheels *wheels, uint32_t kinds, uint32_t quantities) {
  if ((kinds & WM_TWIST_EVENTS) && (quantities & BIT(WM_Q_YAW_RATE))) return NULL;
  if ((quantities & SPEEDS) || counts_ticks(wheels, quantities)) return NULL;
  if ((quantities & BOTH_TICKS) == BOTH_TICKS) return "wheels.radius_m and wheels.ticks_per_turn in calibration.yaml";
  return "a speed (motion.csv, speeds.csv, ticks.csv; over CAN wheel_speed_..., vehicle_speed or both wheels' ticks)";
}

static const char *steering_lacks(const wm_wheels *wheels, uint32_t quantities) {
  if (!(quantities & STEERING))
    return "steering (steering.csv; over CAN road_wheel, steering_wheel or steering_actuator)";
  if (!isfinite(wheels->wheelbase_m)) return "wheels.wheelbase_m in calibration.yaml";
  if (quantities & BIT(WM_Q_ROAD_WHEEL)) return NULL;
  if ((quantities & BIT(WM_Q_STEERING_ACTUATOR)) && wheels->steering_table_count >= 2) return NULL;
  if ((quantities & BIT(WM_Q_STEERING_WHEEL)) && isfinite(wheels->steering_ratio)) return NULL;
  return quantities & BIT(WM_Q_STEERING_ACTUATOR) ? "wheels.steering_table in calibration.yaml"
                                                  : "wheels.steering_ratio in calibration.yaml";
}

static const char *model_lacks(int model, const wm_wheels *wheels, uint32_t kinds, uint32_t quantities) {
  const char *lacks = NULL;
  switch (model) {
    case WM_MOTION_TICKS: return ticks_lack(wheels, quantities);
    case WM_MOTION_SPEED_YAW_RATE:
      lacks = speed_lacks(wheels, kinds, quantities);
      return lacks || quantities & BIT(WM_Q_YAW_RATE) ? lacks : "a turn rate (imu.csv; over CAN yaw_rate)";
    case WM_MOTION_ACKERMANN:
      lacks = speed_lacks(wheels, kinds, quantities);
      return lacks ? lacks : steering_lacks(wheels, quantities);
    case WM_MOTION_INCREMENTS: return kinds & WM_EVENT_BIT(WM_EVENT_INCREMENT) ? NULL : "increments.csv";
    case WM_MOTION_CONSTANT_VELOCITY: return NULL;
    default: break;
  }
  return kinds & WM_TWIST_EVENTS ? NULL : "motion.csv or motion6.csv";
}

void wm_motion_choose(wm_motion_params *params, uint32_t kinds) {
  if (params->model == WM_MOTION_AUTO && !(kinds & WM_MOTION_EVENTS)) params->model = WM_MOTION_CONSTANT_VELOCITY;
}

int wm_motion_is_unmeasured(const wm_motion_params *params) { return params->model == WM_MOTION_CONSTANT_VELOCITY; }

const char *wm_motion_lacks(const wm_motion_params *params, const wm_wheels *wheels, uint32_t kinds,
                            uint32_t quantities) {
  if (!(kinds & WM_EVENT_BIT(WM_EVENT_QUANTITIES))) quantities = 0;
  if (params->model != WM_MOTION_AUTO) return model_lacks(params->model, wheels, kinds, quantities);
  for (int model = WM_MOTION_TICKS; model <= WM_MOTION_INCREMENTS; model++)
    if (!model_lacks(model, wheels, kinds, quantities)) return NULL;
  if (quantities & BOTH_TICKS) return ticks_lack(wheels, quantities);
  return quantities & STEERING ? model_lacks(WM_MOTION_ACKERMANN, wheels, kinds, quantities)
                               : model_lacks(WM_MOTION_SPEED_YAW_RATE, wheels, kinds, quantities);
}
