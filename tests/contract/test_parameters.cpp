// SPDX-License-Identifier: Apache-2.0
// Every parameter of every estimator and of the motion, moved from its default, changes the output of some scenario or
// is refused with the reason. What an estimator gives out counts: pose, covariance, state, innovations, landmarks,
// particles, other places; not its list of calibration states, where a state that nothing uses would show.
//
// An estimator without stages of its own below is run on those of all.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "drives.hpp"
#include "parameter_sweep.hpp"

namespace {

using drives::motion;
using parameters::setting;
using parameters::stage;
using parameters::trace;
using parameters::values;

// No parameter may be without effect.
const std::vector<std::string> kKnown = {};

struct freed {
  void operator()(void *memory) const { std::free(memory); }
};
using block = std::unique_ptr<void, freed>;

void add_estimate(const wm_estimate &e, trace *out) {
  out->add(e.pose_map_base.p_m, 3);
  out->add(e.pose_map_base.q_xyzw, 4);
  out->add(e.heading_rad);
  out->add(e.covariance, 36);
  out->add(e.v_mps, 3);
  out->add(e.w_radps, 3);
  out->add(e.resets);
  out->add(e.state);
  out->add(e.lost_probability);
}

void add_record(const wm_innovation &r, trace *out) {
  for (const double number :
       {static_cast<double>(r.sensor), static_cast<double>(r.landmark_id), static_cast<double>(r.residual),
        static_cast<double>(r.verdict), r.observed, r.expected, r.variance, r.nis, r.gate})
    out->add(number);
}

void add_lists(const wm_estimator &of, const void *state, trace *out) {
  static wm_landmark landmarks[256];
  static double covariance[256][4];
  const size_t count = of.landmarks ? of.landmarks(state, landmarks, covariance, 256) : 0;
  for (size_t i = 0; i < count && i < 256; i++) {
    out->add(landmarks[i].id);
    out->add(landmarks[i].p_m, 2);
    out->add(covariance[i], 4);
  }
  static wm_particle particles[256];
  const size_t cloud = of.particles ? of.particles(state, particles, 256) : 0;
  for (size_t i = 0; i < cloud && i < 256; i++) out->add(particles[i].x_m), out->add(particles[i].weight);
  static wm_hypothesis places[256];
  const size_t others = of.hypotheses ? of.hypotheses(state, places, 256) : 0;
  for (size_t i = 0; i < others && i < 256; i++) out->add(places[i].x_m), out->add(places[i].weight);
}

bool run(const wm_estimator &of, drives::scene &scene, const values &motion_values, const values &params, trace *out) {
  const auto *moving = static_cast<const wm_motion_params *>(motion_values.data());
  const char *why = "", *key = "";
  if (wm_motion_params_clash(moving, &key)) return false;
  const wm_setup &setup = scene.setup(moving);
  const size_t bytes = of.state_bytes(params.data(), &setup, &why);
  if (bytes == 0) return false;
  const block state(std::aligned_alloc(64, (bytes + 63) / 64 * 64));
  if (!state || of.init(state.get(), params.data(), &setup) != WM_OK) return false;
  wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
  wm_estimate estimate;
  size_t number = 0;
  for (const wm_event &e : scene.events()) {
    size_t count = 0;
    if (wm_event_is_motion(&e))
      (void)of.predict(state.get(), &e);
    else if (of.takes & WM_EVENT_BIT(e.kind))
      (void)of.correct(state.get(), &e, records, WM_INNOVATIONS_PER_EVENT_MAX, &count);
    else
      continue;
    of.estimate(state.get(), &estimate);
    add_estimate(estimate, out);
    for (size_t i = 0; i < count; i++) add_record(records[i], out);
    if (number++ % 64 == 63) add_lists(of, state.get(), out);
    if (!out->step()) return true;
  }
  add_lists(of, state.get(), out);
  out->step();
  return true;
}

// A scenario: how the robot moves, what it sees and what happens to it; what is switched on for it.
struct scenario {
  const char *estimator, *name;
  motion by;
  unsigned sees, happens;
  double seconds;
  std::vector<setting> params, moving;
  std::vector<const char *> first_for = {};
};

const std::vector<setting> kMotionStates = {
    {"states.speed_scale_sigma", 0.05},         {"states.yaw_rate_scale_sigma", 0.05},
    {"states.yaw_rate_bias_sigma_radps", 0.02}, {"states.left_scale_sigma", 0.02},
    {"states.right_scale_sigma", 0.02},         {"states.track_scale_sigma", 0.02},
    {"states.steering_offset_sigma_rad", 0.02}, {"states.lag_sigma_s", 0.05},
    {"states.turn_slowdown_sigma_mps", 0.02},   {"states.wheel_difference_sigma", 0.01},
};
const std::vector<setting> kSensorStates = {
    {"states.sensor_yaw_sigma_rad", 0.05},       {"states.sensor_xy_sigma_m", 0.05},
    {"states.sensor_time_offset_sigma_s", 0.05}, {"states.range_bias_sigma_m", 0.1},
    {"states.range_scale_sigma", 0.05},          {"states.sensor_angle_scale_sigma", 0.02},
};
const std::vector<setting> kLasting = {
    {"lasting.slots", 6},      {"lasting.bearing_rad", 0.01}, {"lasting.lateral_m", 0.03},
    {"lasting.range_m", 0.05}, {"lasting.range_rel", 0.01},   {"lasting.gnss_m", 0.5},
};

std::vector<setting> all(std::initializer_list<std::vector<setting>> lists) {
  std::vector<setting> out;
  for (const std::vector<setting> &list : lists) out.insert(out.end(), list.begin(), list.end());
  return out;
}

using drives::kBearings, drives::kRanges, drives::kElevations, drives::kNameless, drives::kPositions, drives::kHeadings,
    drives::kMarkers, drives::kPoints, drives::kRenamed;
using drives::kCarriedOff, drives::kNoStart, drives::kSilence, drives::kOutliers, drives::kOneMoved, drives::kDepth,
    drives::kNoMap, drives::kBlind, drives::kReflections, drives::kFewBeacons, drives::kWrongStart, drives::kGlitches;

std::vector<scenario> scenarios() {
  const unsigned kAll = kBearings | kRanges | kPositions | kHeadings;
  std::vector<scenario> out = {
      {"", "twist", motion::twist, 0, kSilence, 14, kMotionStates, {}},
      {"", "ticks", motion::ticks, 0, kSilence, 14, kMotionStates, {}},
      {"", "ticks and gyro", motion::ticks_and_gyro, 0, kSilence, 14, kMotionStates, {}},
      {"", "speed and gyro", motion::speed_and_gyro, 0, kSilence, 14, kMotionStates, {}},
      {"",
       "speed by ticks, turn by gyro",
       motion::ticks_and_gyro,
       0,
       kSilence,
       14,
       kMotionStates,
       {{"model", 2}},
       {"states.wheel_difference"}},
      {"", "steering", motion::steering, 0, kSilence, 14, kMotionStates, {}, {"states.steering"}},
      {"motion", "samples that no robot can follow", motion::speed_and_gyro, 0, kGlitches, 10, {}, {}},
      {"motion",
       "commands of a drive with a largest radius",
       motion::twist,
       0,
       0,
       10,
       {},
       {{"commands.radius_max_m", 2}, {"commands.radius_overflow_m", 10}}},

      {"landmark_ekf",
       "all sensors",
       motion::twist,
       kAll,
       kOutliers | kBlind,
       25,
       all({kMotionStates,
            kSensorStates,
            kLasting,
            {{"states.map_slots", 4}, {"states.gnss_time_offset_sigma_s", 0.1}}}),
       {},
       {"states.gnss", "noise.gnss", "lasting.", "use."}},
      {"landmark_ekf",
       "fixed errors",
       motion::twist,
       kAll | kNameless,
       kOutliers,
       15,
       {{"gate.associate_unknown", 1}, {"noise.lateral_m", 0.03}, {"noise.range_rel", 0.02}},
       {},
       {"gate."}},
      {"landmark_ekf",
       "depths",
       motion::twist,
       kBearings | kRanges,
       kDepth,
       15,
       {{"states.depth_axis_sigma_rad", 0.02}, {"states.sensor_yaw_sigma_rad", 0.02}},
       {},
       {"states.depth_axis"}},
      {"landmark_ekf",
       "elevations",
       motion::twist,
       kBearings | kElevations,
       kSilence,
       15,
       all({kSensorStates,
            {{"use.elevation", 1},
             {"states.map_slots", 4},
             {"states.sensor_tilt_sigma_rad", 0.02},
             {"states.sensor_angle_scale_sigma", 0.02}}}),
       {},
       {"states.tilt", "states.sensor_tilt", "states.sensor_angle"}},
      {"landmark_ekf",
       "carried off",
       motion::ticks_and_gyro,
       kBearings | kRanges,
       kCarriedOff,
       20,
       kSensorStates,
       {},
       {"recover."}},
      {"landmark_ekf", "no start", motion::twist, kBearings, kNoStart | kOneMoved, 25, {}, {}},
      {"landmark_ekf",
       "no start, two landmarks",
       motion::twist,
       kBearings,
       kNoStart | kFewBeacons,
       20,
       {},
       {},
       {"recover."}},
      {"landmark_ekf", "wrong start", motion::twist, kBearings, kWrongStart | kSilence, 20, {}, {}},

      {"slam",
       "ranges",
       motion::twist,
       kBearings | kRanges,
       kNoMap | kOutliers | kBlind | kOneMoved,
       25,
       all({kMotionStates, kSensorStates, kLasting}),
       {}},
      {"slam",
       "ranges, wheels",
       motion::ticks,
       kBearings | kRanges,
       kNoMap | kDepth,
       20,
       all({kMotionStates,
            {{"states.wheel_slip_sigma", 0.02},
             {"states.depth_axis_sigma_rad", 0.02},
             {"states.sensor_stamp_sigma_s", 0.01},
             {"states.sensor_yaw_sigma_rad", 0.02}}}),
       {}},
      {"slam", "ranges, wheels and gyro", motion::ticks_and_gyro, kBearings | kRanges, kNoMap, 20, kMotionStates, {}},
      {"slam",
       "fixed errors",
       motion::twist,
       kBearings | kRanges | kNameless,
       kNoMap | kOutliers,
       20,
       {{"association.unknown", 1}, {"noise.lateral_m", 0.03}, {"noise.range_rel", 0.02}},
       {}},
      {"slam",
       "markers",
       motion::ticks,
       kMarkers,
       kNoMap | kOutliers | kOneMoved,
       25,
       all({kLasting,
            {{"markers.on", 1},
             {"markers.lasting", 0.5},
             {"states.sensor_tilt_sigma_rad", 0.05},
             {"states.sensor_time_offset_sigma_s", 0.05},
             {"markers.heading_most_rad", 0.014}}}),
       {}},
      {"slam",
       "markers on a map",
       motion::ticks,
       kMarkers,
       kNoStart | kOneMoved,
       20,
       {{"markers.on", 1}, {"landmarks.map", 2}},
       {}},
      {"slam", "a map that grows", motion::twist, kBearings | kRanges, kOneMoved, 15, {{"landmarks.map", 1}}, {}},
      {"slam",
       "lines, unscented",
       motion::twist,
       kBearings,
       kNoMap | kOutliers,
       25,
       {{"lines.clones", 16}, {"lasting.slots", 6}, {"lasting.bearing_rad", 0.004}},
       {}},
      {"slam",
       "lines, inverse distance",
       motion::twist,
       kBearings,
       kNoMap | kBlind | kSilence,
       25,
       {{"lines.clones", 16}, {"lines.method", 2}, {"lasting.slots", 6}, {"lasting.bearing_rad", 0.004}},
       {}},
      {"slam",
       "lines that come back",
       motion::twist,
       kBearings | kRenamed,
       kNoMap,
       40,
       {{"lines.clones", 16}, {"lines.method", 2}},
       {}},

      {"edge_mcl", "tracking", motion::twist, kPoints, kSilence, 10, kMotionStates, {}},
      {"edge_mcl", "reflections", motion::ticks, kPoints, kReflections, 15, {}, {}},
      {"edge_mcl", "carried off", motion::twist, kPoints, kCarriedOff, 14, {}, {}, {"lost."}},
      {"edge_mcl", "no start", motion::twist, kPoints, kNoStart, 14, {}, {}, {"search."}},
      {"pf_edges", "tracking", motion::twist, kPoints, kSilence, 10, {}, {}},
  };
  return out;
}

struct dive_scenario {
  const char *name;
  unsigned happens;
  double seconds;
  std::vector<setting> params;
};

std::vector<dive_scenario> dive_scenarios() {
  const std::vector<setting> states = {
      {"states.rate_bias_sigma_radps", 0.01},     {"states.velocity_scale_sigma", 0.05},
      {"states.camera_rotation_sigma_rad", 0.02}, {"states.camera_place_sigma_m", 0.05},
      {"states.time_offset_sigma_s", 0.05},       {"states.range_bias_sigma_m", 0.2},
      {"states.bearing_bias_sigma_rad", 0.05},    {"states.twist_lag_sigma_s", 0.05},
  };
  return {
      {"known points", kSilence | kOutliers, 10, states},
      {"constant velocity", kSilence, 10, all({states, {{"prediction", 1}}})},
      {"points found on the way", kNoMap | kOutliers, 12, {{"slam.points", 60}}},
      {"a map's points as states", kBlind, 12, {{"slam.points", 60}}},
      {"carried off", kCarriedOff, 10, {}},
      {"no start", kNoStart, 8, {}},
  };
}

// Scenes by what they are made of, so that equal ones are made once.
std::vector<stage> stages_of(const wm_estimator &of, std::vector<std::unique_ptr<drives::scene>> *kept) {
  std::vector<stage> out;
  const auto add = [&](const char *name, const std::vector<setting> &params, const std::vector<setting> &moving,
                       const std::vector<const char *> &first_for, std::unique_ptr<drives::scene> made) {
    drives::scene *scene = made.get();
    kept->push_back(std::move(made));
    out.push_back({name, params, first_for, [&of, scene, moving](const values &v, trace *t) {
                     return run(of, *scene, values(wm_motion_params_table, moving), v, t);
                   }});
  };
  const std::vector<scenario> list = scenarios();
  bool has_own = false;
  for (const scenario &s : list) has_own = has_own || std::strcmp(s.estimator, of.name) == 0;
  const bool in_space = std::strcmp(of.name, "stereo_ekf") == 0;
  for (const scenario &s : list) {
    const bool own = std::strcmp(s.estimator, of.name) == 0, general = s.estimator[0] == '\0';
    if (in_space || !(own || (!has_own && std::strcmp(s.estimator, "motion") != 0) || general)) continue;
    // Where nothing is seen the general ones test the motion alone: they are given something to see.
    const unsigned takes = of.takes;
    unsigned sees = s.sees;
    if (general && (takes & WM_EVENT_BIT(WM_EVENT_SIGHTING))) sees |= kBearings | kRanges;
    if (general && (takes & WM_EVENT_BIT(WM_EVENT_POINTS))) sees |= kPoints;
    add(s.name, s.params, s.moving, s.first_for, std::make_unique<drives::scene>(s.by, sees, s.happens, s.seconds));
  }
  if (!in_space && (has_own || !(of.takes & WM_EVENT_BIT(WM_EVENT_STEREO)))) return out;
  for (const dive_scenario &s : dive_scenarios())
    add(s.name, s.params, {}, {}, std::make_unique<drives::dive>(s.happens, s.seconds));
  return out;
}

// The motion's own table, by dead reckoning.
std::vector<stage> motion_stages(std::vector<std::unique_ptr<drives::scene>> *kept) {
  std::vector<stage> out;
  const wm_estimator &of = *wm_estimator_find("odometry");
  for (const scenario &s : scenarios()) {
    if (s.estimator[0] != '\0' && std::strcmp(s.estimator, "motion") != 0) continue;
    kept->push_back(std::make_unique<drives::scene>(s.by, 0, s.happens, s.seconds));
    drives::scene *scene = kept->back().get();
    const std::vector<setting> params = s.params;
    out.push_back({s.name, s.moving, {}, [&of, scene, params](const values &v, trace *t) {
                     return run(of, *scene, v, values(of.params, params), t);
                   }});
  }
  return out;
}

}  // namespace

void setUp() {}
void tearDown() {}

int main(int argc, char **argv) {
  std::vector<std::unique_ptr<drives::scene>> scenes;
  std::vector<parameters::owner> owners;
  size_t count = 0;
  const wm_estimator *const *estimators = wm_estimators(&count);
  owners.push_back({"motion", wm_motion_params_table, motion_stages(&scenes)});
  for (size_t i = 0; i < count; i++)
    owners.push_back({estimators[i]->name, estimators[i]->params, stages_of(*estimators[i], &scenes)});
  return parameters::report(owners, kKnown, argc > 1 ? argv[1] : nullptr);
}
