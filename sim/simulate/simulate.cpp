// SPDX-License-Identifier: Apache-2.0
#include "simulate/simulate.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "simulate/angle.h"
#include "simulate/bus.h"
#include "simulate/faults.h"
#include "simulate/measured.h"
#include "simulate/motion.h"
#include "simulate/random.h"
#include "simulate/scatter.h"
#include "simulate/wheels.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

constexpr wm_time_ns kFrame_ns = 250000;  // what a frame takes on a bus of 500 kbit/s

// candump writes microseconds.
wm_time_ns to_us(double s) { return static_cast<wm_time_ns>(std::llround(s * 1e6)) * WM_NS_PER_US; }

Drawn draw_constants(const Scenario &sc, const Random &random) {
  Drawn d{};
  for (uint64_t i = 0; i < 2; i++) d.wheel_radius[i] = sc.errors.wheel_radius * random.normal(Stream::wheel_radius, i);
  d.track = sc.errors.track * random.normal(Stream::track, 0);
  d.yaw_rate_bias_radps = sc.errors.yaw_rate_bias_radps * random.normal(Stream::yaw_rate_bias, 0);
  d.rotation_center_m = sc.errors.rotation_center_m * random.normal(Stream::rotation_center, 0);
  d.steering_offset_rad = sc.errors.steering_offset_rad * random.normal(Stream::steering_offset, 0);
  for (uint64_t i = 0; i < sc.cameras.size(); i++)
    d.camera_yaw_rad.push_back(sc.errors.camera_yaw_rad * random.normal(Stream::camera_yaw, i));
  return d;
}

// A message of the bus, sent at a fixed rate from the recording's start to its end.
class Sender {
 public:
  Sender(const Scenario &sc, const Random &random, Bus_message which, Recording &out)
      : scenario_(sc), random_(random), which_(which), message_(message(which)), out_(out) {}

  // fill(k, t_s, frame) packs sample k, taken t_s after the start.
  template <class Fill>
  void run(double rate_hz, double phase_s, Fill fill) {
    wm_time_ns last_ns = out_.clock_start_ns - kFrame_ns;
    for (uint64_t k = 0;; k++) {
      const double t_s = phase_s + static_cast<double>(k) / rate_hz;
      if (t_s > out_.drive.duration_s()) return;
      wm_can_frame frame{};
      std::strcpy(frame.iface, "can0");
      frame.id = message_.id;
      frame.length = static_cast<uint8_t>(message_.length);
      const double jitter = scenario_.bus.stamp_jitter_s *
                            std::clamp(random_.normal(Stream::can_jitter, k, static_cast<uint64_t>(which_)), -3.0, 3.0);
      // Frames of one message never overtake one another, however their stamps jitter.
      frame.t_ns = std::max(last_ns + kFrame_ns, out_.clock_start_ns + std::max<wm_time_ns>(0, to_us(t_s + jitter)));
      last_ns = frame.t_ns;
      fill(k, t_s, frame);
      pack_count(message_.signals[message_.counter()], static_cast<int64_t>(k), frame);
      out_.can.push_back(frame);
    }
  }

 private:
  const Scenario &scenario_;
  const Random &random_;
  Bus_message which_;
  const Message &message_;
  Recording &out_;
};

bool dead(const Scenario &sc, int side, double t_s) {
  return sc.faults.dead_encoder == side && t_s >= sc.faults.dead_encoder_from_s;
}

void send_wheel_counts(const Scenario &sc, const Random &random, const Wheels &wheels, Recording &out) {
  const Message &m = message(Bus_message::wheels);
  Sender(sc, random, Bus_message::wheels, out).run(sc.bus.wheels_hz, 0, [&](uint64_t, double t_s, wm_can_frame &frame) {
    for (int side = 0; side < 2; side++) {
      const double at_s = dead(sc, side, t_s) ? sc.faults.dead_encoder_from_s : t_s;
      const double phase = random.uniform(Stream::encoder_phase, static_cast<uint64_t>(side)) * 65536;
      const double turned = wheels.turns(static_cast<size_t>(side), at_s);
      pack_count(m.signals[static_cast<size_t>(side)],
                 static_cast<int64_t>(std::floor(turned * sc.robot.wheels.ticks_per_turn + phase)), frame);
    }
  });
}

// Mean speeds of the intervals that they hold for, by the nominal radius, without sign. What rounding leaves over goes
// into the next value, as in a control unit that counts ticks: the sum of the speeds is the way.
void send_wheel_speeds(const Scenario &sc, const Random &random, const Wheels &wheels, Recording &out) {
  const Message &m = message(Bus_message::wheel_speeds);
  const double step_s = 1 / sc.bus.wheels_hz, rim_m = 2 * kPi * sc.robot.wheels.radius_m;
  double left_over[2] = {0, 0};
  Sender(sc, random, Bus_message::wheel_speeds, out)
      .run(sc.bus.wheels_hz, 0, [&](uint64_t, double t_s, wm_can_frame &frame) {
        for (int side = 0; side < 2; side++) {
          if (dead(sc, side, t_s)) continue;
          const auto i = static_cast<size_t>(side);
          const Signal &signal = m.signals[i];
          const double speed = (wheels.turns(i, t_s + step_s) - wheels.turns(i, t_s)) * rim_m / step_s;
          if (speed == 0) left_over[i] = 0;
          const double wanted = std::fabs(speed) + left_over[i];
          const double sent = signal.factor * static_cast<double>(std::llround(std::max(wanted, 0.0) / signal.factor));
          left_over[i] = wanted - sent;
          pack(signal, sent, frame);
        }
      });
}

// A rate holds from its stamp to the next one (recording-format.md), so a sample is the mean rate of that interval.
void send_yaw_rate(const Scenario &sc, const Random &random, Recording &out) {
  const Message &m = message(Bus_message::yaw_rate);
  const double step_s = 1 / sc.bus.yaw_rate_hz;
  double walk = 0;
  Sender(sc, random, Bus_message::yaw_rate, out)
      .run(sc.bus.yaw_rate_hz, 0, [&](uint64_t k, double t_s, wm_can_frame &frame) {
        const State from = out.drive.at(t_s), to = out.drive.at(t_s + step_s);
        const double turned = to.heading_rad - to.carried_heading_rad - (from.heading_rad - from.carried_heading_rad);
        const double noise = sc.errors.yaw_rate_noise_radps * random.normal(Stream::yaw_rate_noise, k);
        const double rate = turned / step_s + out.drawn.yaw_rate_bias_radps + walk + noise;
        walk += sc.errors.yaw_rate_bias_walk * std::sqrt(step_s) * random.normal(Stream::yaw_rate_walk, k);
        pack(m.signals[0], rate * 180 / kPi, frame);
      });
}

void send_steering(const Scenario &sc, const Random &random, Recording &out) {
  const wm_wheels &w = sc.robot.wheels;
  const Message &m = message(Bus_message::steering);
  const uint32_t n = w.steering_table_count;
  if (n < 2) return;
  Sender(sc, random, Bus_message::steering, out)
      .run(sc.bus.steering_hz, 0.3 / sc.bus.steering_hz, [&](uint64_t, double t_s, wm_can_frame &frame) {
        const double angle =
            wm::atan2(w.wheelbase_m * out.drive.at(t_s).curvature_1pm, 1.0) + out.drawn.steering_offset_rad;
        uint32_t i = 1;
        while (i + 1 < n && angle > w.road_wheel_rad[i]) i++;
        const double share =
            std::clamp((angle - w.road_wheel_rad[i - 1]) / (w.road_wheel_rad[i] - w.road_wheel_rad[i - 1]), 0.0, 1.0);
        const double at_m = w.actuator_m[i - 1] + share * (w.actuator_m[i] - w.actuator_m[i - 1]);
        pack(m.signals[0], 1000 * at_m, frame);
      });
}

void send_gear(const Scenario &sc, const Random &random, Recording &out) {
  const Message &m = message(Bus_message::gear);
  double gear = 1;  // stays in while standing
  Sender(sc, random, Bus_message::gear, out)
      .run(sc.bus.gear_hz, 0.6 / sc.bus.gear_hz, [&](uint64_t, double t_s, wm_can_frame &frame) {
        const double v = out.drive.at(t_s).speed_mps;
        if (v != 0) gear = v > 0 ? 1 : -1;
        pack(m.signals[0], gear, frame);
      });
}

void make_start(const Scenario &sc, const Random &random, Recording &out) {
  const State s = out.drive.at(0);
  const Errors &e = sc.errors;
  const auto draw = [&](uint64_t i) { return random.normal(Stream::start_pose, i); };
  out.start.t_ns = WM_TIME_NONE;
  out.start.p_m[0] = s.x_m + e.start_xy_m * draw(0) + sc.faults.start_x_m;
  out.start.p_m[1] = s.y_m + e.start_xy_m * draw(1) + sc.faults.start_y_m;
  out.start.p_m[2] = 0;
  out.start.heading_rad = wrap(s.heading_rad + e.start_heading_rad * draw(2) + sc.faults.start_heading_rad);
  for (double &q : out.start.q_xyzw) q = NAN;
  // A perfect start is stated as a very good one: a sigma of zero is no sigma.
  double away[3];
  start_away(e, random, 2, away);
  for (int i = 0; i < 2; i++) out.start.p_m[i] += away[i];
  out.start.sigma_xy_m = std::max({e.start_xy_m, 0.5 * e.start_within_m, 1e-3});  // of a disc, each axis
  out.start.sigma_heading_rad = std::max(e.start_heading_rad, 1e-4);
}

}  // namespace

Messages messages_of(const Scenario &sc) {
  if (sc.robot.commanded || sc.motion.twist_hz > 0 || !sc.motion.measured) return {};
  Messages sent = {sc.robot.sends_speeds ? Bus_message::wheel_speeds : Bus_message::wheels};
  if (sc.bus.yaw_rate_hz > 0) sent.push_back(Bus_message::yaw_rate);
  if (sc.bus.steering_hz > 0 && sc.robot.wheels.steering_table_count >= 2) sent.push_back(Bus_message::steering);
  if (sc.bus.gear_hz > 0) sent.push_back(Bus_message::gear);
  return sent;
}

namespace {

// All that wheels, gyro and steering say, and the truth.
wm_status simulate_drive(const Scenario &sc, uint64_t seed, Recording &out, wm_error *err) {
  out = Recording{};
  out.seed = seed;
  out.clock_start_ns = to_us(sc.clock_start_s);
  if (const wm_status status = Drive::plan(sc.route, out.drive, err); status != WM_OK) return status;
  const Random random(seed);
  if (sc.robot.commanded) out.drive = obey(sc, random, out.drive, out.commands);
  out.drawn = draw_constants(sc, random);
  out.drive = on_base(sc.motion, out.drawn.rotation_center_m, out.drive);
  if (sc.faults.kidnap_forward_s > 0)
    if (const wm_status s = out.drive.carry(sc.faults.kidnap_at_s, sc.faults.kidnap_forward_s, err); s != WM_OK)
      return s;
  if (sc.duration_s > 0) out.drive.cut(sc.duration_s);
  out.duration_s = out.drive.duration_s();
  out.length_m = out.drive.length_m();
  make_start(sc, random, out);

  const Wheels wheels(sc, random, out.drive, out.drawn);
  const auto send = [&](Bus_message which) {
    switch (which) {
      case Bus_message::wheels: return send_wheel_counts(sc, random, wheels, out);
      case Bus_message::wheel_speeds: return send_wheel_speeds(sc, random, wheels, out);
      case Bus_message::yaw_rate: return send_yaw_rate(sc, random, out);
      case Bus_message::steering: return send_steering(sc, random, out);
      case Bus_message::gear: return send_gear(sc, random, out);
    }
  };
  for (const Bus_message which : messages_of(sc)) send(which);
  std::stable_sort(out.can.begin(), out.can.end(),
                   [](const wm_can_frame &a, const wm_can_frame &b) { return a.t_ns < b.t_ns; });
  fault_can(sc.faults, random, out.can);
  if (sc.motion.twist_hz > 0) measure_twist(sc, random, out);
  if (sc.motion.imu_hz > 0) measure_imu(sc, random, out);
  for (uint64_t k = 0; static_cast<double>(k) / kTruth_hz <= out.drive.duration_s(); k++) {
    const double t_s = static_cast<double>(k) / kTruth_hz;
    out.truth.push_back({out.clock_start_ns + to_ns(t_s), out.drive.at(t_s)});
  }
  return WM_OK;
}

// The first `landmarks` that the scenario lists and draws, and what the map says of them.
wm_status place_landmarks(const Scenario &sc, size_t landmarks, Recording &out, wm_error *err) {
  const Random random(out.seed);
  std::vector<wm_landmark> drawn;
  if (const wm_status s = scatter_landmarks(sc, out, drawn, err); s != WM_OK) return s;
  out.landmarks = sc.landmarks;
  out.landmarks.insert(out.landmarks.end(), drawn.begin(), drawn.end());
  if (landmarks < out.landmarks.size()) out.landmarks.resize(landmarks);
  const size_t mapped = sc.mapped == Mapped::none     ? 0
                        : sc.mapped == Mapped::listed ? std::min(out.landmarks.size(), sc.landmarks.size())
                                                      : out.landmarks.size();
  out.map.assign(out.landmarks.begin(), out.landmarks.begin() + static_cast<std::ptrdiff_t>(mapped));
  for (wm_landmark &l : out.landmarks) l.sigma_m = 0;
  misplace(sc, out.motion6.empty() ? 2 : 3, out);
  move_landmarks(sc, out);
  return WM_OK;
}

}  // namespace

void misplace(const Scenario &sc, uint64_t axes, Recording &out) {
  const Random random(out.seed);
  for (uint64_t i = 0; i < out.map.size(); i++) {
    double &sigma_m = out.map[i].sigma_m;
    if (sigma_m <= 0) sigma_m = sc.errors.landmark_m;
    for (uint64_t axis = 0; axis < axes; axis++)
      out.map[i].p_m[axis] += sigma_m * random.normal(Stream::landmark_map, i, axis);
  }
}

wm_status simulate(const Scenario &sc, uint64_t seed, size_t landmarks, Recording &out, wm_error *err) {
  if (sc.swims())
    simulate_six(sc, seed, sc.knots.empty() ? swum_path(sc.rounds, seed) : Path6(sc.knots), out);
  else if (const wm_status s = simulate_drive(sc, seed, out, err); s != WM_OK)
    return s;
  if (sc.world.pictured()) return WM_OK;
  if (const wm_status s = place_landmarks(sc, landmarks, out, err); s != WM_OK) return s;
  observe(sc, out);
  settle(sc, out);
  return WM_OK;
}

}  // namespace wm::sim
