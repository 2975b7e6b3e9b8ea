// SPDX-License-Identifier: Apache-2.0
// Plausibility of successive samples of a motion sensor: bounds on the change of a speed or rate, and on the speed of a
// count. A sample beyond is refused; a run of samples that agree with each other, but not with the trusted ones,
// replaces these.
#ifndef WAYMARK_ESTIMATOR_MOTION_PLAUSIBILITY_HPP
#define WAYMARK_ESTIMATOR_MOTION_PLAUSIBILITY_HPP

#include <cstdint>

#include "waymark/event_fields.h"
#include "waymark/time.h"

namespace wm {

// Bounds of land robots' motion.
inline constexpr double kSpeedMost_mps = WM_SPEED_MOST_MPS;  // beyond is a decoding fault
inline constexpr double kRateMost_radps = WM_RATE_MOST_RADPS;
// Change from one sample to the next that needs no time: commands, coarse sensors, noise. Beyond what 15 m/s2 and 30
// rad/s2 allow, the largest in 35 recordings are 1.9 m/s (a late count) and 3.9 rad/s (a differentiated heading).
inline constexpr double kSpeedStep_mps = 3.0;
inline constexpr double kRateStep_radps = 6.0;
inline constexpr double kShowRefusal_s = 5.0;  // in the health, whose messages come each second

enum class plausibility : uint8_t { plausible, new_run, refused };

class sample_check {
 public:
  // A level (speed, turn rate): |x - last| <= step + per_s dt, since sensors and commands change in steps.
  plausibility check_level(wm_time_ns t_ns, double value, double step, double per_s);
  // A wheel's position in m by its counts: its speed since the last count is bounded like a level, with `mps2` for
  // per_s. `period_s`: usual time between counts, by which stamps may be off; `tick_m`: rounding; `bound`: this
  // fraction of step and limit.
  plausibility check_position(wm_time_ns t_ns, double position_m, double mps2, double period_s, double tick_m,
                              double bound);

 private:
  struct run {
    wm_time_ns since_ns, t_ns;  // first and last sample
    double value, rate;         // of the last sample; rate per s of a position, used from the second sample on
    uint32_t count;
  };
  template <class Follows, class Rate>
  plausibility take(wm_time_ns t_ns, double value, double takeover_s, Follows follows, Rate rate);

  run trusted_, rival_;
};

}  // namespace wm

#endif
