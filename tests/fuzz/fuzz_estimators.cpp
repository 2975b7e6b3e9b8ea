// SPDX-License-Identifier: Apache-2.0
// Every estimator, by its contract (waymark/estimator.h), given any order of events of valid kinds: ordinary values,
// extreme ones, any bits, gaps of time from nothing to years. After each event the estimate is finite, its covariance
// symmetric and positive; a refused event changes nothing; no list is longer than its capacity. The first byte chooses
// the estimator, the second what the robot has; then come events of a byte for the kind, one for the gap, one for the
// style of the values, and the values.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "waymark/estimator.h"
#include "waymark/health.h"

namespace {

const double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr int kSide = 120;  // pixels of 0.1 m: a room of 10 m in a map of 12 m

void check(bool good, const char *what) {
  if (good) return;
  (void)std::fprintf(stderr, "fuzz_estimators: %s\n", what);
  std::abort();
}

// Bytes of the input; zeros where it has ended.
class Input {
 public:
  Input(const uint8_t *data, size_t size) : data_(data), size_(size) {}
  bool more() const { return size_ > 0; }
  uint8_t byte() {
    if (size_ == 0) return 0;
    size_--;
    return *data_++;
  }
  template <typename T>
  T bits() {
    T out{};
    uint8_t raw[sizeof out];
    for (uint8_t &b : raw) b = byte();
    std::memcpy(&out, raw, sizeof out);
    return out;
  }

 private:
  const uint8_t *data_;
  size_t size_;
};

// A number: of ordinary size, at a limit, or any bits.
double number(Input &in, unsigned style, double usual) {
  static const double kLimits[] = {0,      -0.0,    1e-300,   1e-12,     1e6,    -1e6, 1e9,  1e300,
                                   -1e300, kAbsent, HUGE_VAL, -HUGE_VAL, 5e-324, kPi,  -kPi, 1};
  if (style % 8 < 5) return usual * (in.bits<int16_t>() / 32768.0);
  if (style % 8 < 7) return kLimits[in.byte() % (sizeof kLimits / sizeof kLimits[0])];
  return in.bits<double>();
}

// The smallest sigma that the robot was told: an estimate may be as sure.
double least_stated = 1;

double positive(Input &in, unsigned style, double usual) {
  const double x = style % 8 < 5 ? std::fabs(number(in, style, usual)) + 1e-3 : number(in, style, usual);
  if (x < least_stated) least_stated = x;
  return x;
}

// ns from the event before.
int64_t gap_ns(Input &in, uint8_t kind) {
  if (kind < 180) return kind * INT64_C(500'000);
  if (kind < 220) return (kind - 179) * INT64_C(1'000'000'000);
  if (kind < 235) return 0;
  if (kind < 240) return -(kind - 234) * INT64_C(10'000'000);
  if (kind < 245) return INT64_C(1) << (in.byte() % 63);
  if (kind < 250) return INT64_C(86'400'000'000'000) * in.byte();
  return kind;
}

class Robot {
 public:
  explicit Robot(uint8_t what) {
    motion_.resize(wm_motion_params_table.bytes);
    wm_params_defaults(&wm_motion_params_table, motion_.data());
    sighting_.resize(wm_sighting_params_table.bytes);
    wm_params_defaults(&wm_sighting_params_table, sighting_.data());
    for (int i = 0; i < 2; i++) {
      sensors_[i] = {};
      (void)std::snprintf(sensors_[i].name, sizeof sensors_[i].name, "s%d", i);
      sensors_[i].mounting.xyz_m[0] = 0.3 * i;
      sensors_[i].bearing_sigma_rad = i ? kAbsent : 0.02;
      sensors_[i].range_sigma_m = i ? kAbsent : 0.05;
      sensors_[i].max_range_m = i ? HUGE_VAL : 8;
    }
    for (int i = 0; i < 6; i++)
      landmarks_[i] = {i, {4 * std::cos(i), 4 * std::sin(i), 0.2 * i}, 0.02, i % 2 ? kAbsent : 0.1, {}, 0};
    draw_room();
    wm_rig_init(&rig_);
    rig_.camera_count = 2;
    rig_.stereo = {0, 1, 0.2, {400, 400, 320, 240}, {1, 1, 1, 1}};
    for (uint32_t i = 0; i < 2; i++) {
      rig_.cameras[i] = wm_camera{};
      rig_.cameras[i].model = WM_CAMERA_PINHOLE_RADTAN;
      rig_.cameras[i].width_px = 640;
      rig_.cameras[i].height_px = 480;
      const double intrinsics[4] = {400, 400, 320, 240};
      std::memcpy(rig_.cameras[i].intrinsics, intrinsics, sizeof intrinsics);
      rig_.cameras[i].intrinsics_count = 4;
    }
    setup.motion = reinterpret_cast<const wm_motion_params *>(motion_.data());
    setup.sightings = reinterpret_cast<const wm_sighting_params *>(sighting_.data());
    setup.wheels = {0.1, 1000, 0.4, 1.0, 15, 0, 0, {}, {}};
    setup.sensors = sensors_;
    setup.sensor_count = 2;
    setup.landmarks = landmarks_;
    setup.landmark_count = what & 1 ? 0 : 6;
    setup.rig = &rig_;
    setup.map = &map_;
    setup.start = what & 2 ? wm_start{WM_TIME_NONE,
                                      {kAbsent, kAbsent, kAbsent},
                                      {kAbsent, kAbsent, kAbsent, kAbsent},
                                      kAbsent,
                                      kAbsent,
                                      kAbsent}
                           : wm_start{WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0, 0.05, 0.05};
    setup.seed = 1;
    if (what & 4) learn();
  }
  Robot(const Robot &) = delete;
  Robot &operator=(const Robot &) = delete;

  wm_setup setup{};

 private:
  void draw_room() {
    for (int row = 0; row < kSide; row++)
      for (int column = 0; column < kSide; column++) {
        const bool in = row >= 10 && row < kSide - 10 && column >= 10 && column < kSide - 10;
        const bool deep = row >= 11 && row < kSide - 11 && column >= 11 && column < kSide - 11;
        edges_[row * kSide + column] = in && !deep ? 255 : 0;
        drivable_[row * kSide + column] = deep ? 255 : 0;
      }
    map_ = {kSide, kSide, 0.1, -6, -6, 0, edges_, drivable_, 1};
  }
  // States of the calibration are estimated, too.
  void learn() {
    for (const char *key : {"states.speed_scale_sigma", "states.yaw_rate_scale_sigma",
                            "states.yaw_rate_bias_sigma_radps", "states.lag_sigma_s", "states.sensor_yaw_sigma_rad",
                            "states.sensor_time_offset_sigma_s", "states.range_bias_sigma_m", "states.left_scale_sigma",
                            "states.right_scale_sigma", "states.track_scale_sigma"}) {
      set(wm_motion_params_table, motion_, key);
      set(wm_sighting_params_table, sighting_, key);
    }
  }
  static void set(const wm_param_table &table, std::vector<char> &out, const char *key) {
    const double sigma = 0.1;
    for (size_t i = 0; i < table.count; i++)
      if (std::strcmp(table.params[i].key, key) == 0 && table.params[i].type == WM_PARAM_F64)
        std::memcpy(&out[table.params[i].offset], &sigma, sizeof sigma);
  }

  std::vector<char> motion_, sighting_;
  wm_sensor sensors_[2];
  wm_landmark landmarks_[6];
  uint8_t edges_[kSide * kSide], drivable_[kSide * kSide];
  wm_raster map_{};
  wm_rig rig_{};
};

void fill_motion(Input &in, unsigned style, wm_event &e) {
  switch (e.kind) {
    case WM_EVENT_QUANTITIES:
      e.as.quantities.count = style % 8 < 5 ? 1 + in.byte() % WM_QUANTITIES_MAX : in.byte();
      for (int i = 0; i < WM_QUANTITIES_MAX; i++) {
        e.as.quantities.id[i] = style % 8 < 7 ? in.byte() % WM_Q_COUNT : in.byte();
        e.as.quantities.value[i] = number(in, style, e.as.quantities.id[i] < 2 ? 1e4 : 2);
      }
      e.as.quantities.doubt = in.byte() & 1;
      e.as.quantities.lost_before = in.byte();
      break;
    case WM_EVENT_TWIST2: e.as.twist2 = {number(in, style, 3), number(in, style, 2)}; break;
    case WM_EVENT_TWIST6:
      for (int i = 0; i < 3; i++)
        e.as.twist6.v_mps[i] = number(in, style, 2), e.as.twist6.w_radps[i] = number(in, style, 1);
      break;
    default:
      e.as.increment.from_ns = e.t_ns - gap_ns(in, in.byte()) % INT64_C(1'000'000'000);
      e.as.increment.dx_m = number(in, style, 0.2);
      e.as.increment.dy_m = number(in, style, 0.05);
      e.as.increment.dheading_rad = number(in, style, 0.1);
      for (double &c : e.as.increment.covariance) c = style & 32 ? kAbsent : number(in, style, 0.01);
      if (style & 64)
        for (int i : {0, 2, 5}) e.as.increment.covariance[i] = positive(in, style, 0.01);
  }
}

void fill_points(Input &in, unsigned style, wm_points &out) {
  out.count = style % 8 < 7 ? in.byte() : in.bits<uint32_t>();
  out.camera = style % 8 < 7 ? in.byte() % 3 - 1 : in.bits<int32_t>();
  const double x = number(in, style, 5), y = number(in, style, 5), step = number(in, style, 0.2);
  for (uint32_t i = 0; i < WM_POINTS_MAX && i < out.count; i++) {
    out.x_m[i] = static_cast<float>(x + step * i);
    out.y_m[i] = static_cast<float>(i % 2 ? y : -y);
    out.normal_rad[i] = i % 3 ? NAN : static_cast<float>(x);
    out.sigma_m[i] = i % 4 ? NAN : static_cast<float>(std::fabs(y) * 0.01 + 0.001);
  }
}

void fill_seen(Input &in, unsigned style, wm_event &e) {
  const int32_t id = style % 8 < 7 ? in.byte() % 9 - 1 : in.bits<int32_t>();
  const uint16_t sensor = style % 8 < 7 ? in.byte() % 2 : in.byte();
  if (e.kind == WM_EVENT_SIGHTING) {
    wm_sighting &s = e.as.sighting;
    s.sensor = sensor, s.landmark_id = id;
    s.bearing_rad = style & 32 ? kAbsent : number(in, style, kPi);
    s.range_m = style & 64 ? kAbsent : positive(in, style, 6);
    s.bearing_sigma_rad = style & 16 ? positive(in, style, 0.05) : kAbsent;
    s.range_sigma_m = style & 16 ? positive(in, style, 0.1) : kAbsent;
    s.elevation_rad = style & 128 ? number(in, style, 1) : kAbsent;
    s.elevation_sigma_rad = style & 128 ? positive(in, style, 0.05) : kAbsent;
  } else if (e.kind == WM_EVENT_MARKER) {
    wm_marker &m = e.as.marker;
    m.sensor = sensor, m.id = id, m.poses = style & 16 ? 2 : 1;
    for (int i = 0; i < 3; i++) m.p_m[i] = number(in, style, 4), m.other_p_m[i] = number(in, style, 4);
    m.yaw_rad = style & 32 ? kAbsent : number(in, style, kPi);
    m.other_yaw_rad = number(in, style, kPi);
    m.along_sigma_m = style & 64 ? positive(in, style, 0.1) : kAbsent;
    m.yaw_sigma_rad = style & 64 ? positive(in, style, 0.1) : kAbsent;
    m.bloom_px = kAbsent;
  } else {
    wm_stereo &s = e.as.stereo;
    s.id = id;
    for (int i = 0; i < 2; i++) {
      s.left_px[i] = style & 32 ? kAbsent : 320 + number(in, style, 320);
      s.right_px[i] = style & 64 ? kAbsent : 320 + number(in, style, 320);
    }
  }
}

void fill_observation(Input &in, unsigned style, wm_event &e) {
  switch (e.kind) {
    case WM_EVENT_POSITION:
      e.as.position = {{number(in, style, 5), number(in, style, 5), style & 32 ? kAbsent : number(in, style, 2)},
                       positive(in, style, 2),
                       style & 32 ? kAbsent : positive(in, style, 3)};
      break;
    case WM_EVENT_HEADING: e.as.heading = {number(in, style, kPi), positive(in, style, 0.5)}; break;
    case WM_EVENT_POINTS: fill_points(in, style, e.as.points); break;
    case WM_EVENT_LOOKED: e.as.looked.sensor = style % 8 < 7 ? in.byte() % 2 : in.byte(); break;
    case WM_EVENT_SET_POSE: {
      const double half = number(in, style, kPi / 2);
      wm_set_pose &s = e.as.set_pose;
      s.pose_map_base = {{number(in, style, 5), number(in, style, 5), 0}, {0, 0, std::sin(half), std::cos(half)}};
      if (style % 8 == 7)
        for (double &q : s.pose_map_base.q_xyzw) q = number(in, style, 1);
      s.sigma_xy_m = positive(in, style, 1);
      s.sigma_heading_rad = positive(in, style, 0.5);
      break;
    }
    case WM_EVENT_RESET: break;
    default: fill_seen(in, style, e);
  }
}

// Factors P = L D L' of the covariance of the degrees of freedom; each pivot is positive beyond rounding.
bool is_positive(const wm_estimate &e) {
  const int plane[] = {0, 1, 5}, space[] = {0, 1, 2, 3, 4, 5};
  const int *at = e.dof == 3 ? plane : space, n = e.dof == 3 ? 3 : 6;
  double s[6][6], scale[6];
  for (int i = 0; i < n; i++) {
    scale[i] = std::sqrt(e.covariance[wm_cov_index(at[i], at[i])]);
    if (!(scale[i] > 0)) return least_stated < 1e-6 && scale[i] >= 0;
  }
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) s[i][j] = e.covariance[wm_cov_index(at[i], at[j])] / scale[i] / scale[j];
  for (int k = 0; k < n; k++) {
    if (s[k][k] < -1e-6) return false;
    if (s[k][k] < 1e-6) continue;  // all but singular: rounding decides
    for (int i = k + 1; i < n; i++)
      for (int j = k + 1; j < n; j++) s[i][j] -= s[i][k] * s[k][j] / s[k][k];
  }
  return true;
}

void check_estimate(const wm_estimate &e) {
  check(e.dof == 3 || e.dof == 6, "degrees of freedom");
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) {
      const double p = e.covariance[wm_cov_index(i, j)], mirrored = e.covariance[wm_cov_index(j, i)];
      check(std::isfinite(p), "a covariance is not finite");
      check(std::memcmp(&p, &mirrored, sizeof p) == 0, "the covariance is not symmetric");
    }
  check(is_positive(e), "the covariance is not positive");
  double length = 0;
  for (double q : e.pose_map_base.q_xyzw) length += q * q;
  check(std::fabs(length - 1) < 1e-9, "the rotation is none");
  for (int i = 0; i < 3; i++) {
    check(std::isfinite(e.pose_map_base.p_m[i]), "a coordinate is not finite");
    check(std::isfinite(e.v_mps[i]) && std::isfinite(e.w_radps[i]), "a speed is not finite");
  }
  check(std::isfinite(e.heading_rad) && std::fabs(e.heading_rad) <= kPi + 1e-12, "the heading is not in its range");
  check(e.state < WM_STATE_COUNT && e.cause < WM_CAUSE_COUNT, "no such state");
  check(std::isnan(e.lost_probability) || (e.lost_probability >= 0 && e.lost_probability <= 1),
        "the probability is none");
}

void check_lists(const wm_estimator &estimator, const void *state) {
  static wm_calibration_value values[256];
  const size_t count = estimator.calibration(state, values, 256);
  check(count <= 256, "too many calibration values");
  for (size_t i = 0; i < count; i++) {
    check(std::memchr(values[i].name, 0, sizeof values[i].name) != nullptr, "a name without an end");
    check(std::isfinite(values[i].value), "a calibration value is not finite");
    check(std::isnan(values[i].sigma) || (values[i].sigma >= 0 && std::isfinite(values[i].sigma)), "a sigma is none");
  }
  wm_motion_calibration motion;
  estimator.motion(state, &motion);
  for (double v : motion.value) check(std::isfinite(v), "the motion's calibration is not finite");
  (void)estimator.motion_health(state);
  if (estimator.counters) {
    wm_counter counters[WM_HEALTH_COUNTERS_MAX];
    check(estimator.counters(state, counters, WM_HEALTH_COUNTERS_MAX) <= WM_HEALTH_COUNTERS_MAX, "too many counters");
  }
  if (estimator.landmarks) {
    static wm_landmark landmarks[64];
    static double covariance[64][4];
    const size_t found = estimator.landmarks(state, landmarks, covariance, 64);
    for (size_t i = 0; i < found && i < 64; i++)
      check(std::isfinite(landmarks[i].p_m[0]) && std::isfinite(landmarks[i].p_m[1]), "a landmark is nowhere");
  }
  if (estimator.particles) {
    static wm_particle particles[64];
    const size_t found = estimator.particles(state, particles, 64);
    for (size_t i = 0; i < found && i < 64; i++)
      check(std::isfinite(particles[i].x_m) && particles[i].weight >= 0 && particles[i].weight <= 1 + 1e-9,
            "a particle is none");
  }
  if (estimator.hypotheses) {
    static wm_hypothesis hypotheses[64];
    const size_t found = estimator.hypotheses(state, hypotheses, 64);
    for (size_t i = 0; i < found && i < 64; i++) check(std::isfinite(hypotheses[i].x_m), "a hypothesis is nowhere");
  }
}

void feed(const wm_estimator &estimator, void *state, size_t bytes, const wm_event &event) {
  static std::vector<char> before;
  before.assign(static_cast<char *>(state), static_cast<char *>(state) + bytes);
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX + 1];
  std::memset(out, 0x5a, sizeof out);
  const wm_innovation guard = out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  const wm_status status = wm_event_is_motion(&event)
                               ? estimator.predict(state, &event)
                               : estimator.correct(state, &event, out, WM_INNOVATIONS_PER_EVENT_MAX, &count);
  check(count <= WM_INNOVATIONS_PER_EVENT_MAX, "more innovations than their capacity");
  check(std::memcmp(&guard, &out[WM_INNOVATIONS_PER_EVENT_MAX], sizeof guard) == 0,
        "an innovation beyond the capacity");
  if (status == WM_TIME_RAN_BACK || status == WM_NOT_FINITE || status == WM_OUT_OF_RANGE || status == WM_UNSUPPORTED)
    check(!wm_event_is_motion(&event) || std::memcmp(before.data(), state, bytes) == 0,
          "a refused motion changed the state");
  wm_estimate e;
  estimator.estimate(state, &e);
  check_estimate(e);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size < 4) return 0;
  Input in(data, size);
  least_stated = 1;
  size_t estimators;
  const wm_estimator *const *all = wm_estimators(&estimators);
  const wm_estimator &estimator = *all[in.byte() % estimators];
  Robot robot(in.byte());
  std::vector<char> params(estimator.params.bytes + 1);
  wm_params_defaults(&estimator.params, params.data());
  const char *why = nullptr;
  const size_t bytes = estimator.state_bytes(params.data(), &robot.setup, &why);
  if (bytes == 0) {
    check(why != nullptr && *why != '\0', "a refusal without a word");
    return 0;
  }
  void *state = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
  check(state != nullptr, "no memory");
  std::memset(state, 0xa5, bytes);
  if (estimator.init(state, params.data(), &robot.setup) == WM_OK) {
    static wm_event event;
    wm_time_ns t_ns = INT64_C(1'000'000'000);
    for (int i = 0; i < 400 && in.more(); i++) {
      event = wm_event{};
      event.kind = static_cast<uint8_t>(1 + in.byte() % (WM_EVENT_KIND_COUNT - 1));
      int64_t next = 0;
      const uint8_t gap = in.byte();
      if (__builtin_add_overflow(t_ns, gap_ns(in, gap), &next)) next = INT64_MAX;
      event.t_ns = event.arrival_ns = next;
      event.seq = static_cast<uint32_t>(i);
      const unsigned style = in.byte();
      if (wm_event_is_motion(&event))
        fill_motion(in, style, event);
      else
        fill_observation(in, style, event);
      feed(estimator, state, bytes, event);
      wm_estimate now;
      estimator.estimate(state, &now);
      if (now.t_ns > t_ns) t_ns = now.t_ns;
    }
    check_lists(estimator, state);
  }
  std::free(state);
  return 0;
}
