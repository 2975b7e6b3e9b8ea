// SPDX-License-Identifier: Apache-2.0
// The motion front end's checks of plausibility: values against those before them, message counters against stamps.
#include "math/elementary.hpp"
#include "motion/front_end.hpp"

namespace wm {
namespace {

// A message whose counter skips n frames comes after n + 1 periods. Earlier than this fraction of them, its counter
// contradicts its stamp: the message is corrupt, or its stamp is late by jitter. Halfway between one lost frame and
// none.
constexpr double kSkipFraction = 0.75;
// Of the bounds, for such a message: 3 m/s2 beyond a step of 0.6 m/s is a hard braking between two good samples.
constexpr double kDoubtedBound = 0.2;

}  // namespace

// Whether a message's values are plausible after those before them, and its counter against its stamp.
bool motion_front_end::is_plausible(const wm_quantities &q, wm_time_ns t_ns) {
  const double bound = counter_is_wrong(q, t_ns) ? kDoubtedBound : 1.0;
  bool plausible = true;
  uint32_t slots = 0;
  for (int i = 0; i < q.count; i++) {
    const int id = q.id[i];
    const bool count = is_count(id);
    note_period(id, t_ns, q.lost_before + 1);
    if (!count && !(kSpeeds & quantity_bit(id)) && id != WM_Q_YAW_RATE) continue;
    slots |= quantity_bit(id);
    plausible &=
        count ? is_plausible_count(id, t_ns, q.value[i], bound) : is_plausible_level(id, t_ns, q.value[i], bound);
  }
  note_plausibility(t_ns, slots, plausible);
  return plausible;
}

bool motion_front_end::counter_is_wrong(const wm_quantities &q, wm_time_ns t_ns) const {
  if (q.lost_before == 0) return false;
  for (int i = 0; i < q.count; i++) {
    const int id = q.id[i];
    if (message_ns_[id] == WM_TIME_NONE || !(period_s_[id] > 0.0)) continue;
    const double due_s = kSkipFraction * (q.lost_before + 1) * period_s_[id];
    if (wm_seconds_between(message_ns_[id], t_ns) < due_s) return true;
  }
  return false;
}

void motion_front_end::note_period(int id, wm_time_ns t_ns, int frames) {
  const wm_time_ns last_ns = message_ns_[id];
  message_ns_[id] = t_ns;
  if (last_ns == WM_TIME_NONE) return;
  double &period_s = period_s_[id];
  const double each_s = wm_seconds_between(last_ns, t_ns) / frames;
  const double counted_s = period_s > 0.0 && each_s > 2.0 * period_s ? 2.0 * period_s : each_s;
  period_s += period_s > 0.0 ? kPeriodGain * (counted_s - period_s) : counted_s;
}

bool motion_front_end::is_plausible_count(int side, wm_time_ns t_ns, double count, double bound) {
  const double tick_m = kTwoPi * wheels_.radius_m / wheels_.ticks_per_turn;
  if (!(params_->limits_mps2 > 0.0) || !finite(tick_m)) return true;
  const plausibility verdict =
      check_[side].check_position(t_ns, count * tick_m, params_->limits_mps2, wheel_[side].period_s, tick_m, bound);
  if (verdict == plausibility::new_run) wheel_[side].is_new_run = true;
  return verdict != plausibility::refused;
}

bool motion_front_end::is_plausible_level(int slot, wm_time_ns t_ns, double value, double bound) {
  const bool turn = slot == WM_Q_YAW_RATE || slot == kTwistRate;
  const double per_s = turn ? params_->limits_radps2 : params_->limits_mps2;
  if (!(per_s > 0.0)) return true;
  const double step = turn ? kRateStep_radps : kSpeedStep_mps;
  return check_[slot].check_level(t_ns, value, bound * step, bound * per_s) != plausibility::refused;
}

void motion_front_end::note_plausibility(wm_time_ns t_ns, uint32_t slots, bool plausible) {
  // A sensor that fell silent after a refusal is no longer refused, but silent.
  if (last_refusal_ns_ != WM_TIME_NONE && t_ns - last_refusal_ns_ > hold_max_ns_) refused_slots_ = 0;
  if (!plausible) {
    if (refused_slots_ == 0) refused_since_ns_ = newest_ns_ == WM_TIME_NONE ? t_ns : newest_ns_;
    refused_slots_ |= slots;
    last_refusal_ns_ = t_ns;
    outliers_++;
    health_ |= WM_MOTION_HEALTH_IMPLAUSIBLE;
    return;
  }
  refused_slots_ &= ~slots;
  if ((health_ & WM_MOTION_HEALTH_IMPLAUSIBLE) && wm_seconds_between(last_refusal_ns_, t_ns) > kShowRefusal_s)
    health_ &= ~WM_MOTION_HEALTH_IMPLAUSIBLE;
}

void motion_front_end::mark_refused(motion_input *input) const {
  if (refused_slots_ == 0) return;
  const uint32_t turn =
      quantity_bit(WM_Q_YAW_RATE) | quantity_bit(kTwistRate) | (model_ == WM_MOTION_TICKS ? kCounts : 0);
  const uint32_t speed = ~(quantity_bit(WM_Q_YAW_RATE) | quantity_bit(kTwistRate));
  input->refused = (uint8_t)((refused_slots_ & speed ? kRefusedSpeed : 0) | (refused_slots_ & turn ? kRefusedTurn : 0));
  input->refused_s = wm_seconds_between(refused_since_ns_, input->t_ns);
}

}  // namespace wm
