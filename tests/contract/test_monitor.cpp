// SPDX-License-Identifier: Apache-2.0
// The life cycle of each estimator with the monitor of innovations (waymark/monitor.h), as a run has it: observations
// that contradict the pose make it degraded and then lost, with a cause; good ones do neither.
#include <memory>
#include <string>
#include <vector>

#include "common/block.hpp"
#include "common/suite.h"
#include "drives.hpp"
#include "filters/core/calibration_list.hpp"
#include "lone_monitor.hpp"
#include "parameter_sweep.hpp"

namespace {

constexpr double kContradicted_s = 20.0, kEnd_s = 50.0;
constexpr double kDegradedWithin_s = 6.0, kLostWithin_s = 25.0;

struct seen {
  double doubted_s = INFINITY, lost_s = INFINITY;  // the first time
  double turn_s = INFINITY;                        // the first time that the turn is the cause
  double confident_s = 0.0;                        // tracking, since the observations contradict
  bool has_cause = true;
  bool is_lasting = false;        // there was an alarm about the lasting error of positions
  uint8_t cause = WM_CAUSE_NONE;  // at the first doubt
  double sigma_m = 0.0;           // at the end
};

// From a time on, observations of a world that is turned and scaled against the map, differently each second.
void contradict(wm_event *e) {
  if (wm_seconds_between(0, e->t_ns) <= kContradicted_s) return;
  const double second = std::floor(wm_seconds_between(0, e->t_ns));
  const double turn = 0.9 + 0.4 * std::sin(7.0 * second), scale = 1.5 + 0.2 * std::sin(3.0 * second);
  if (e->kind == WM_EVENT_SIGHTING) {
    e->as.sighting.bearing_rad = -e->as.sighting.bearing_rad + turn;
    e->as.sighting.range_m *= scale;
  } else if (e->kind == WM_EVENT_POINTS) {
    wm_points &p = e->as.points;
    for (uint32_t i = 0; i < p.count; i++) {
      const double x = scale * static_cast<double>(p.x_m[i]), y = -scale * static_cast<double>(p.y_m[i]);
      p.x_m[i] = static_cast<float>(std::cos(turn) * x - std::sin(turn) * y);
      p.y_m[i] = static_cast<float>(std::sin(turn) * x + std::cos(turn) * y);
      p.normal_rad[i] = NAN;
    }
  } else if (e->kind == WM_EVENT_STEREO) {
    for (double *px : {e->as.stereo.left_px, e->as.stereo.right_px}) px[1] += 60.0 * std::sin(second + e->as.stereo.id);
  }
}

void note(const wm_estimate &e, double t_s, double dt_s, seen *out) {
  if (e.state == WM_STATE_DEGRADED || e.state == WM_STATE_LOST) {
    if (t_s < out->doubted_s) {
      out->doubted_s = t_s;
      out->cause = e.cause;
    }
    if (e.cause == WM_CAUSE_TURN && t_s < out->turn_s) out->turn_s = t_s;
    out->has_cause = out->has_cause && e.cause != WM_CAUSE_NONE;
  }
  if (e.state == WM_STATE_LOST && t_s < out->lost_s) out->lost_s = t_s;
  if (e.state == WM_STATE_TRACKING && t_s > kContradicted_s) out->confident_s += dt_s;
  out->sigma_m = std::sqrt(e.covariance[0]);
}

// `spoil`: changes an event; null: a good drive.
seen drive(const char *name, drives::scene &scene, const std::vector<parameters::setting> &settings,
           void (*spoil)(wm_event *), const std::vector<parameters::setting> &receiver = {}) {
  const wm_estimator &of = *wm_estimator_find(name);
  const parameters::values params(of.params, settings), motion(wm_motion_params_table, {}),
      sightings(wm_sighting_params_table, {}), positions(wm_position_params_table, receiver);
  wm_setup shared{};
  shared.motion = static_cast<const wm_motion_params *>(static_cast<const void *>(motion.data()));
  shared.sightings = reinterpret_cast<const wm_sighting_params *>(sightings.data());
  shared.positions = reinterpret_cast<const wm_position_params *>(positions.data());
  const wm_setup &setup = scene.setup(shared);
  const char *why = "";
  const size_t bytes = of.state_bytes(params.data(), &setup, &why);
  TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
  const block state = allocate(bytes);
  TEST_ASSERT_EQUAL(WM_OK, of.init(state.get(), params.data(), &setup));
  static wm_monitor monitor;
  wm_monitor_init(&monitor, &setup, 1);
  seen out;
  double last_s = 0.0;
  for (wm_event e : scene.events()) {
    const double t_s = wm_seconds_between(0, e.t_ns);
    if (spoil) spoil(&e);
    wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t count = 0;
    const bool is_motion = wm_event_is_motion(&e) != 0;
    if (!is_motion && !(of.takes & WM_EVENT_BIT(e.kind))) continue;
    const wm_status status = is_motion ? of.predict(state.get(), &e)
                                       : of.correct(state.get(), &e, records, WM_INNOVATIONS_PER_EVENT_MAX, &count);
    if (status != WM_OK && count == 0) continue;
    wm_estimate estimate;
    of.estimate(state.get(), &estimate);
    wm_alarm alarms[WM_ALARMS_MAX];
    const size_t known = of.alarms(state.get(), alarms, WM_ALARMS_MAX);
    TEST_ASSERT_TRUE(known <= WM_ALARMS_MAX);
    for (size_t i = 0; i < known; i++) out.is_lasting = out.is_lasting || alarms[i].kind == WM_ALARM_LASTING_ERROR;
    if (wm_monitor_take(&monitor, &e, records, count)) wm_monitor_step(&monitor, &estimate, alarms, known);
    wm_monitor_judge(&monitor, &estimate);
    note(estimate, t_s, t_s - last_s, &out);
    last_s = t_s;
  }
  return out;
}

void check(const char *name, drives::scene &scene, const std::vector<parameters::setting> &settings = {}) {
  const seen good = drive(name, scene, settings, nullptr), bad = drive(name, scene, settings, contradict);
  char text[300];
  (void)snprintf(text, sizeof text,
                 "%s: good doubted %.1f; bad doubted %.1f lost %.1f cause %s confident %.1f s sigma %.2f m", name,
                 good.doubted_s, bad.doubted_s, bad.lost_s, wm_cause_name(bad.cause), bad.confident_s, bad.sigma_m);
  TEST_ASSERT_TRUE_MESSAGE(std::isinf(good.doubted_s), text);
  TEST_ASSERT_TRUE_MESSAGE(bad.doubted_s < kContradicted_s + kDegradedWithin_s, text);
  TEST_ASSERT_TRUE_MESSAGE(bad.lost_s < kContradicted_s + kLostWithin_s, text);
  TEST_ASSERT_TRUE_MESSAGE(bad.confident_s < kDegradedWithin_s && bad.has_cause, text);
  TEST_ASSERT_TRUE_MESSAGE(bad.sigma_m > good.sigma_m && bad.sigma_m > 0.5, text);
}

using drives::motion;
constexpr unsigned kSightings = drives::kBearings | drives::kRanges;

TEST(each_estimator_is_degraded_then_lost) {
  drives::scene sightings(motion::ticks_and_gyro, kSightings, 0, kEnd_s),
      mapless(motion::ticks_and_gyro, kSightings, drives::kNoMap, kEnd_s),
      points(motion::ticks_and_gyro, drives::kPoints, 0, kEnd_s);
  drives::dive dive(0, kEnd_s);
  check("landmark_ekf", sightings);
  check("slam", mapless);
  check("edge_mcl", points);
  check("pf_edges", points, {{"particles", 500}});
  check("stereo_ekf", dive);
}

void turn_to_the_right(wm_event *e) {
  if (e->kind == WM_EVENT_TWIST2) e->as.twist2.w_radps *= -1.0;
}
TEST(a_turn_with_the_wrong_sign_is_named) {
  drives::scene scene(motion::twist, kSightings, 0, kEnd_s);
  const seen good = drive("landmark_ekf", scene, {}, nullptr);
  const seen bad = drive("landmark_ekf", scene, {}, turn_to_the_right);
  TEST_ASSERT_DOUBLE_IS_INF(good.doubted_s);
  TEST_ASSERT_DOUBLE_IS_INF(good.turn_s);
  TEST_ASSERT_TRUE_MESSAGE(bad.turn_s < kContradicted_s, "the turn is not the cause");
}

// ── causes, one at a time, by the monitor alone ─────────────────────────────────────────────────────────────────────

// A car's turns: ten seconds straight and a turn by 90 degrees, in turns to the left and to the right.
double turn_at(double t_s) { return std::fmod(t_s, 15.0) < 10.0 ? 0.0 : std::fmod(t_s, 45.0) < 30.0 ? 0.314 : -0.314; }

// What the filter makes of a position; it may take a contradiction for a lasting error of them.
wm_innovation fused_position(double variance) {
  wm_innovation out = record_of(WM_FUSED, 0.0);
  out.landmark_id = -1;
  out.residual = WM_RESIDUAL_X;
  out.variance = variance;
  return out;
}

struct plane {
  double x_m = 0.0, y_m = 0.0, heading_rad = 0.0;
  void move(double v_mps, double w_radps) {  // for 0.1 s
    heading_rad += w_radps * 0.1;
    x_m += v_mps * std::cos(heading_rad) * 0.1;
    y_m += v_mps * std::sin(heading_rad) * 0.1;
  }
  // An estimate that is here and moves so.
  wm_estimate estimate(const lone &robot, double heading, double v_mps, double w_radps) const {
    wm_estimate out = robot.estimate;
    out.pose_map_base.p_m[0] = x_m;
    out.pose_map_base.p_m[1] = y_m;
    out.heading_rad = heading;
    out.v_mps[0] = v_mps;
    out.w_radps[2] = w_radps;
    return out;
  }
};

// A car with a receiver. `side` -1: the positions are mirrored. One comes at each `every`th of ten steps a second.
wm_estimate drive_by_positions(double seconds, double side, double v_mps, int every = 1) {
  lone robot(false);
  plane way;
  wm_estimate out{};
  for (int step = 0; 0.1 * step < seconds; step++) {
    const double t_s = 0.1 * step, w_radps = turn_at(t_s);
    wm_event e{};
    e.kind = step % every == 0 ? WM_EVENT_POSITION : WM_EVENT_TWIST2;
    e.t_ns = wm_ns_from_seconds(t_s);
    e.as.position = {{way.x_m + 5.0 * std::sin(7.0 * t_s), side * way.y_m + 5.0 * std::cos(11.0 * t_s), 0.0}, 5.0, 0.0};
    out = robot.see(e, way.estimate(robot, way.heading_rad, v_mps, w_radps), fused_position(100.0), step % every == 0);
    way.move(v_mps, w_radps);
  }
  return out;
}

TEST(positions_that_turn_to_the_other_side_are_degraded) {
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, drive_by_positions(60, 1, 10).state);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, drive_by_positions(600, 1, 10).state);
  const wm_estimate mirrored = drive_by_positions(60, -1, 10);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, mirrored.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_TURN, mirrored.cause);
}

// A minute of turns proves the sign. On the straight behind it the wheels slip: what is reckoned bends to the left, the
// way to the right, and the mirror image fits better.
TEST(a_sign_that_is_proven_stays) {
  lone robot(false);
  plane way, place;
  for (int step = 0; step < 1100; step++) {
    const double t_s = 0.1 * step, v_mps = 10.0;
    const double w_radps = t_s < 60.0 ? turn_at(t_s) : 0.006, true_w_radps = t_s < 60.0 ? turn_at(t_s) : -0.006;
    wm_event e{};
    e.kind = WM_EVENT_POSITION;
    e.t_ns = wm_ns_from_seconds(t_s);
    e.as.position = {{place.x_m, place.y_m, NAN}, 0.05, NAN};
    const wm_estimate out = robot.see(e, place.estimate(robot, way.heading_rad, v_mps, w_radps), fused_position(1.0));
    TEST_ASSERT_EQUAL_MESSAGE(WM_STATE_TRACKING, out.state, std::to_string(t_s).c_str());
    way.move(v_mps, w_radps);
    place.move(v_mps, true_w_radps);
  }
}

// Before it is certain that positions are mirrored, the covariance is that of the mixture with the mirror image of the
// drive: about its first straight, the same x, the other side, the other heading. Place and heading have one chance.
TEST(positions_that_may_be_mirrored_widen_the_covariance) {
  for (double seconds = 17.0; seconds < 25.0; seconds += 1.0) {
    const wm_estimate out = drive_by_positions(seconds, -1, 10);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, out.state);
    const double more_m2 = out.covariance[wm_cov_index(0, 0)] - 0.01;
    const double more_rad2 = out.covariance[wm_cov_index(5, 5)] - 0.01;
    const double apart_m = 2.0 * out.pose_map_base.p_m[1], apart_rad = 2.0 * out.heading_rad;
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, more_m2 / more_rad2 * std::pow(apart_rad / apart_m, 2));
    const double chance = more_rad2 / (apart_rad * apart_rad);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.05, chance);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.0, chance);
  }
}

// A mirror image of fewer than three places fits as well as the way itself. A window of 30 s reaches back less than
// three times its length: of positions each 44 s it has three, of positions each 45 s two.
TEST(sparse_positions_show_no_mirror_image) {
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, drive_by_positions(200, -1, 10, 440).covariance[0]);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, drive_by_positions(200, -1, 10, 450).covariance[0]);
}

// 60 m/s at 0.3 rad/s are 19 m/s2.
TEST(a_turn_that_no_vehicle_can_drive_is_degraded) {
  const wm_estimate out = drive_by_positions(14, 1, 60);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, out.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_TURN, out.cause);
}

// A scale of the motion, or of any sensor's ranges.
struct scale_value {
  int term;  // kRange: of ranges
  double value, sigma;
};
constexpr int kRange = -1;

std::vector<wm_alarm> alarms_about(const wm_setup &setup, const scale_value &scale) {
  std::vector<wm_alarm> out(WM_ALARMS_MAX);
  wm::calibration_list list(out.data(), out.size());
  list.add("scale", scale.value, scale.sigma);
  list.add_length(scale.term == kRange ? wm::length_square(*setup.sightings, scale.value, scale.sigma)
                                       : wm::length_square(setup.motion->states, scale.term, scale.value, scale.sigma));
  out.resize(list.finish_alarms());
  return out;
}

// State after five seconds with these alarms; `position`: the verdict of one that came before, or -1.
uint8_t state_with(const wm_setup &setup, const std::vector<wm_alarm> &alarms, int position = -1) {
  wm_monitor monitor;
  wm_monitor_init(&monitor, &setup, 1);
  if (position >= 0) {
    wm_event e{};
    e.kind = WM_EVENT_POSITION;
    wm_innovation record{};
    record.verdict = (uint8_t)position;
    wm_monitor_take(&monitor, &e, &record, 1);
  }
  wm_estimate out{};
  out.state = WM_STATE_TRACKING;
  for (int i = 1; i < 5; i++) {
    out.t_ns = i * WM_NS_PER_S;
    wm_monitor_step(&monitor, &out, alarms.data(), alarms.size());
  }
  wm_monitor_judge(&monitor, &out);
  return out.state;
}
uint8_t state_with(const wm_setup &setup, const scale_value &scale, int position = -1) {
  return state_with(setup, alarms_about(setup, scale), position);
}

wm_setup with_motion(const parameters::values &motion) {
  wm_setup out{};
  out.motion = static_cast<const wm_motion_params *>(static_cast<const void *>(motion.data()));
  return out;
}

// Each kind of alarm; lengths count where no map decides (below). A localizer that is not followed does no harm.
TEST(each_alarm_is_degraded) {
  const wm_setup setup{};
  for (uint32_t kind = 0; kind < WM_ALARM_KIND_COUNT; kind++)
    TEST_ASSERT_EQUAL_MESSAGE(kind == WM_ALARM_LOCALIZER ? WM_STATE_TRACKING : WM_STATE_DEGRADED,
                              state_with(setup, std::vector<wm_alarm>{{kind, -1, 5.0}}), wm_alarm_name(kind));
}

// Markers that are measured with their frame bend the scales of both wheels; a receiver's lasting error is one of a
// course that the robot does not drive.
TEST(values_far_from_what_is_stated_are_degraded) {
  const parameters::values motion(wm_motion_params_table, {{"states.left_scale_sigma", 0.02}});
  wm_setup setup = with_motion(motion);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_with(setup, scale_value{WM_LEFT_SCALE, 1.05, 0.003}));
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, state_with(setup, scale_value{WM_LEFT_SCALE, 1.25, 0.003}));
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, state_with(setup, std::vector<wm_alarm>{{WM_ALARM_LASTING_ERROR, 0, 5.0}}));
}

// The speed's scale against its prior of 5 %. A known map or fused positions decide which length is wrong; the robot's
// own does not.
TEST(lengths_that_contradict_each_other_are_degraded) {
  const parameters::values motion(wm_motion_params_table, {});
  wm_setup setup = with_motion(motion);
  const struct {
    double value, sigma;
    int position;
    wm_state state;
  } rows[] = {{1.16, 0.005, -1, WM_STATE_TRACKING},       {1.19, 0.06, -1, WM_STATE_TRACKING},
              {1.19, 0.005, -1, WM_STATE_DEGRADED},       {0.81, 0.005, -1, WM_STATE_DEGRADED},
              {1.19, 0.005, WM_FUSED, WM_STATE_TRACKING}, {1.19, 0.005, WM_REJECTED_GATE, WM_STATE_DEGRADED}};
  for (const auto &row : rows)
    TEST_ASSERT_EQUAL(row.state, state_with(setup, scale_value{WM_SPEED_SCALE, row.value, row.sigma}, row.position));
  const wm_landmark post{};
  setup.landmarks = &post;
  setup.landmark_count = 1;
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_with(setup, scale_value{WM_SPEED_SCALE, 1.19, 0.005}));
}

// Of any sensor, against the prior of all of them.
TEST(a_scale_of_ranges_is_held_against_the_sensors_prior) {
  parameters::values sightings(wm_sighting_params_table, {{"states.range_scale_sigma", 0.02}});
  wm_setup setup{};
  setup.sightings = reinterpret_cast<const wm_sighting_params *>(sightings.data());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_with(setup, scale_value{kRange, 1.06, 0.003}));
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, state_with(setup, scale_value{kRange, 1.08, 0.003}));
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, state_with(setup, scale_value{kRange, 0.92, 0.003}));
}

// A track and a gyro's scale are no lengths.
TEST(scales_of_turns_are_no_standards_of_length) {
  const parameters::values motion(wm_motion_params_table, {});
  wm_setup setup = with_motion(motion);
  for (const int term : {WM_TRACK_SCALE, WM_YAW_RATE_SCALE})
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_with(setup, scale_value{term, 1.7, 0.01}));
}

// Contradicted for 10 s: any heading, whose variance is pi^2 / 3.
TEST(a_contradicted_pose_may_head_anywhere) {
  lone robot(true);
  (void)robot.drive(20, WM_FUSED);
  const wm_estimate lost = robot.drive(30, WM_REJECTED_GATE);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, lost.state);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, M_PI * M_PI / 3.0, lost.covariance[wm_cov_index(5, 5)]);
}

// A map with a fault fits by chance now and then: after a minute of contradiction it does not count like a found pose.
TEST(a_run_that_was_contradicted_for_long_has_to_fit_for_longer) {
  lone once(true), again(true);
  (void)once.drive(20, WM_FUSED);
  (void)again.drive(20, WM_FUSED);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, once.drive(8, WM_REJECTED_GATE).state);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, again.drive(60, WM_REJECTED_GATE).state);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, once.drive(60, WM_FUSED).state);
  TEST_ASSERT_NOT_EQUAL(WM_STATE_TRACKING, again.drive(100, WM_FUSED).state);
}

// Four landmarks seen ten times a second; `off`: of their ranges, in sigma, beside an error of 0.8.
wm_estimate drive_by_landmarks(const double off[4], wm_verdict of_last) {
  lone robot(true);
  wm_estimate out{};
  for (wm_time_ns t_ns = 0; t_ns < 20 * WM_NS_PER_S; t_ns += 100 * WM_NS_PER_MS) {
    for (int k = 0; k < 4; k++) {
      wm_event e{};
      e.kind = WM_EVENT_SIGHTING;
      e.t_ns = t_ns;
      wm_innovation record =
          record_of(k == 3 ? of_last : WM_FUSED, off[k] + ((t_ns / (100 * WM_NS_PER_MS) + k) % 2 ? 0.8 : -0.8));
      record.t_ns = t_ns;
      record.landmark_id = k;
      out = robot.see(e, robot.estimate, record);
    }
  }
  return out;
}

// Their means cancel in the mean of the source: a mirrored map. One landmark alone has been moved.
TEST(landmarks_that_are_off_to_both_sides_are_degraded) {
  const double none[4] = {0, 0, 0, 0}, both[4] = {0.9, -0.9, 0.9, -0.9}, one[4] = {0, 0, 0, 9};
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, drive_by_landmarks(none, WM_FUSED).state);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, drive_by_landmarks(one, WM_REJECTED_GATE).state);
  const wm_estimate mirrored = drive_by_landmarks(both, WM_FUSED);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, mirrored.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_BIASED, mirrored.cause);
}

// Positions that drift away from the way: a lasting error of the receiver is a state, which follows.
void drift(wm_event *e) {
  if (e->kind == WM_EVENT_POSITION) e->as.position.p_m[0] += 0.5 * wm_seconds_between(0, e->t_ns);
}
TEST(positions_far_from_the_way_are_doubt) {
  drives::scene scene(motion::twist, drives::kPositions, 0, kEnd_s);
  const std::vector<parameters::setting> receiver = {{"correlated.sigma_m", 1.0}, {"correlated.tau_s", 20.0}};
  const seen good = drive("landmark_ekf", scene, {}, nullptr, receiver);
  const seen bad = drive("landmark_ekf", scene, {}, drift, receiver);
  TEST_ASSERT_TRUE(!good.is_lasting);
  TEST_ASSERT_DOUBLE_IS_INF(good.doubted_s);
  TEST_ASSERT_TRUE(bad.is_lasting);
}

TEST(a_pose_off_the_map_is_degraded) {
  lone robot(false, true);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, robot.drive(3, WM_FUSED).state);
  robot.estimate.pose_map_base.p_m[0] = 20.0;  // the map ends at 10 m
  const wm_estimate off = robot.drive(3, WM_FUSED);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, off.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_OFF_MAP, off.cause);
  TEST_ASSERT_EQUAL(-1, off.cause_source);
  robot.estimate.covariance[0] = 25.0;  // it may be on it
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, robot.drive(3, WM_FUSED).state);
}

TEST(identities_that_the_map_lacks_are_doubt) {
  lone robot(true);
  robot.estimate.state = WM_STATE_DEAD_RECKONING;
  const wm_estimate unknown = robot.drive(12, WM_REJECTED_UNKNOWN_ID);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, unknown.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_UNKNOWN, unknown.cause);
  TEST_ASSERT_EQUAL(0, unknown.cause_source);
  lone known(true), mapless(false);
  TEST_ASSERT_EQUAL(WM_CAUSE_NONE, known.drive(12, WM_FUSED).cause);
  mapless.estimate.state = WM_STATE_DEAD_RECKONING;
  TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, mapless.drive(12, WM_REJECTED_UNKNOWN_ID).state);
}

// A search finds a pose for a robot that was lost before its start had been proven by driving, and for one that had
// driven well for long. A start that fits at rest proves nothing.
TEST(a_found_pose_is_degraded_unless_the_one_before_was_proven) {
  lone robot(true), proven(true);
  (void)robot.drive(60, WM_FUSED);
  for (lone *one : {&robot, &proven}) one->estimate.v_mps[0] = 0.5;
  (void)robot.drive(10, WM_FUSED);
  (void)proven.drive(45, WM_FUSED);
  for (lone *one : {&robot, &proven}) {
    one->estimate.state = WM_STATE_LOST;
    (void)one->drive(1, WM_REJECTED_GATE);
    one->estimate.state = WM_STATE_TRACKING;
    one->estimate.resets++;
  }
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, proven.drive(1, WM_FUSED).state);
  const wm_estimate found = robot.drive(35, WM_FUSED);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, found.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_LOST_AGAIN, found.cause);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, robot.drive(20, WM_FUSED).state);
}

// Lost for long, a filter inflates its covariance, and another pose fits: that is a found one, though not by a search.
TEST(a_pose_that_fits_after_long_is_a_found_one) {
  for (const double lost_s : {1.0, 6.0}) {
    lone robot(true);
    robot.estimate.v_mps[0] = 0.5;
    (void)robot.drive(10, WM_FUSED);
    robot.estimate.state = WM_STATE_LOST;
    (void)robot.drive(lost_s, WM_FUSED);
    robot.estimate.state = WM_STATE_TRACKING;
    TEST_ASSERT_EQUAL(lost_s > 3.0 ? WM_STATE_DEGRADED : WM_STATE_TRACKING, robot.drive(20, WM_FUSED).state);
  }
}

}  // namespace
