// SPDX-License-Identifier: Apache-2.0
// Every parameter of every estimator, moved from its default, changes the output of some scenario or is refused with
// the reason; so does every parameter of the shared sections that it reads, and none that it does not. What an
// estimator gives out counts: pose, covariance, state, innovations, landmarks, particles, other places; not its list of
// calibration states, where a state that nothing uses would show.
//
// An estimator without stages of its own below is run on those of all.
#include <deque>
#include <memory>
#include <string>

#include "common/block.hpp"
#include "common/suite.h"
#include "drives.hpp"
#include "parameter_sweep.hpp"

namespace {

using drives::motion;
using parameters::setting;
using parameters::stage;
using parameters::trace;
using parameters::values;

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

// An estimator's table and those of the shared sections as one, whose struct is theirs one behind another.
class whole_table {
 public:
  explicit whole_table(const wm_estimator &of) {
    append("", of.params);
    motion_at_ = append("motion.", wm_motion_params_table);
    sightings_at_ = append("sightings.", wm_sighting_params_table);
    positions_at_ = append("positions.", wm_position_params_table);
    markers_at_ = append("markers.", wm_marker_params_table);
  }
  wm_param_table table() const { return {rows_.data(), rows_.size(), bytes_, nullptr}; }
  const wm_motion_params *motion(const values &v) const { return at<wm_motion_params>(v, motion_at_); }
  wm_setup setup(const values &v) const {
    wm_setup out{};
    out.motion = motion(v);
    out.sightings = at<wm_sighting_params>(v, sightings_at_);
    out.positions = at<wm_position_params>(v, positions_at_);
    out.markers = at<wm_marker_params>(v, markers_at_);
    return out;
  }

 private:
  template <class T>
  static const T *at(const values &v, size_t offset) {
    return reinterpret_cast<const T *>(static_cast<const char *>(v.data()) + offset);
  }
  size_t append(const char *prefix, const wm_param_table &table) {
    const size_t at = bytes_;
    for (size_t i = 0; i < table.count; i++) {
      keys_.push_back(std::string(prefix) + table.params[i].key);
      rows_.push_back(table.params[i]);
      rows_.back().key = keys_.back().c_str();
      rows_.back().offset += static_cast<uint32_t>(at);
    }
    bytes_ = at + (table.bytes + 7) / 8 * 8;
    return at;
  }

  std::vector<wm_param> rows_;
  std::deque<std::string> keys_;
  size_t bytes_ = 0, motion_at_, sightings_at_, positions_at_, markers_at_;
};

bool run(const wm_estimator &of, const whole_table &tables, drives::scene &scene, const values &params, trace *out) {
  const char *why = "", *key = "";
  if (wm_motion_params_clash(tables.motion(params), &key)) return false;
  const wm_setup &setup = scene.setup(tables.setup(params));
  const size_t bytes = of.state_bytes(params.data(), &setup, &why);
  if (bytes == 0) return false;
  const block state = allocate(bytes);
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
  std::vector<setting> params;
  std::vector<const char *> first_for = {};
};

const std::vector<setting> kMotionStates = {
    {"motion.states.speed_scale_sigma", 0.05},         {"motion.states.yaw_rate_scale_sigma", 0.05},
    {"motion.states.yaw_rate_bias_sigma_radps", 0.02}, {"motion.states.left_scale_sigma", 0.02},
    {"motion.states.right_scale_sigma", 0.02},         {"motion.states.track_scale_sigma", 0.02},
    {"motion.states.steering_offset_sigma_rad", 0.02}, {"motion.states.lag_sigma_s", 0.05},
    {"motion.states.turn_slowdown_sigma_mps", 0.02},   {"motion.states.wheel_difference_sigma", 0.01},
    {"motion.states.speed_onset_sigma_s", 0.02},       {"motion.states.turn_onset_sigma_s", 0.02},
    {"motion.states.gentle_turns_sigma", 0.1},
};
const std::vector<setting> kSensorStates = {
    {"sightings.states.sensor_yaw_sigma_rad", 0.05},
    {"sightings.states.sensor_xy_sigma_m", 0.05},
    {"sightings.states.sensor_time_offset_sigma_s", 0.05},
    {"sightings.states.range_bias_sigma_m", 0.1},
    {"sightings.states.range_scale_sigma", 0.05},
    {"sightings.states.sensor_angle_scale_sigma", 0.02},
    {"sightings.states.sensor_eccentricity_sigma_rad", 0.02},
};
const std::vector<setting> kCorrelated = {
    {"sightings.correlated.slots", 6},        {"sightings.correlated.bearing_rad", 0.01},
    {"sightings.correlated.lateral_m", 0.03}, {"sightings.correlated.range_m", 0.05},
    {"sightings.correlated.range_rel", 0.01}, {"positions.correlated.sigma_m", 0.5},
};

std::vector<setting> all(std::initializer_list<std::vector<setting>> lists) {
  std::vector<setting> out;
  for (const std::vector<setting> &list : lists) out.insert(out.end(), list.begin(), list.end());
  return out;
}

using drives::kBearings, drives::kRanges, drives::kElevations, drives::kNameless, drives::kPositions, drives::kHeadings,
    drives::kMarkers, drives::kPoints, drives::kRenamed;
using drives::kCarriedOff, drives::kNoStart, drives::kSilence, drives::kOutliers, drives::kOneMoved, drives::kDepth,
    drives::kNoMap, drives::kBlind, drives::kReflections, drives::kFewBeacons, drives::kWrongStart, drives::kGlitches,
    drives::kImu, drives::kReceiver, drives::kMarked;

scenario row(const char *estimator, const char *name, motion by, unsigned sees, unsigned happens, double seconds,
             std::vector<setting> params, std::vector<const char *> first_for = {}) {
  return {estimator, name, by, sees, happens, seconds, std::move(params), std::move(first_for)};
}

std::vector<scenario> scenarios() {
  const unsigned kAll = kBearings | kRanges | kPositions | kHeadings;
  std::vector<scenario> out = {
      row("", "twist", motion::twist, 0, kSilence, 14, kMotionStates),
      row("", "ticks", motion::ticks, 0, kSilence, 14, kMotionStates),
      row("", "ticks and gyro", motion::ticks_and_gyro, 0, kSilence, 14, kMotionStates),
      row("", "speed and gyro", motion::speed_and_gyro, 0, kSilence, 14, kMotionStates),
      row("", "speed by ticks, turn by gyro", motion::ticks_and_gyro, 0, kSilence, 14,
          all({kMotionStates, {{"motion.model", 2}}}), {"motion.states.wheel_difference"}),
      row("", "steering", motion::steering, 0, kSilence, 14, kMotionStates, {"motion.states.steering"}),
      row("", "samples that no robot can follow", motion::speed_and_gyro, 0, kGlitches, 10, {}, {"motion.limits."}),
      row("", "twists", motion::twist, 0, 0, 10, {}, {"motion.twist"}),
      row("", "a base that drives sideways", motion::sideways, 0, 0, 10, {{"motion.drive", 1}},
          {"motion.drive", "motion.noise.sideways", "motion.states.side_scale"}),
      row("", "wheels that slip in turns", motion::ticks, 0, 0, 10, {{"motion.drive", 2}},
          {"motion.states.rotation_center"}),
      row("", "commands of a drive with a largest radius", motion::twist, 0, 0, 10,
          {{"motion.commands.radius_max_m", 2}, {"motion.commands.radius_overflow_m", 10}}, {"motion.commands."}),
      row("landmark_ekf", "without motion data", motion::twist, kBearings | kRanges, 0, 10, {{"motion.model", 6}},
          {"motion.constant_velocity."}),
      row("landmark_ekf", "all sensors", motion::twist, kAll, kOutliers | kBlind, 25,
          all({kMotionStates,
               kSensorStates,
               kCorrelated,
               {{"sightings.states.map_slots", 4}, {"positions.states.time_offset_sigma_s", 0.1}}}),
          {"positions.", "sightings.correlated.", "sightings.use."}),
      row("landmark_ekf", "markers", motion::twist, kMarkers, kOutliers, 15,
          {{"markers.heading_most_rad", 0.014}, {"sightings.states.map_slots", 4}}, {"markers."}),
      row("landmark_ekf", "fixed errors", motion::twist, kAll | kNameless, kOutliers, 15,
          {{"sightings.use.unidentified", 1}, {"sightings.noise.lateral_m", 0.03}, {"sightings.noise.range_rel", 0.02}},
          {"sightings.gate."}),
      row("landmark_ekf", "depths", motion::twist, kBearings | kRanges, kDepth, 15,
          {{"sightings.states.depth_axis_sigma_rad", 0.02}, {"sightings.states.sensor_yaw_sigma_rad", 0.02}},
          {"sightings.states.depth_axis"}),
      row("landmark_ekf", "elevations", motion::twist, kBearings | kElevations, kSilence, 15,
          all({kSensorStates,
               {{"sightings.use.elevation", 1},
                {"sightings.states.map_slots", 4},
                {"sightings.states.sensor_tilt_sigma_rad", 0.02},
                {"sightings.states.sensor_angle_scale_sigma", 0.02}}}),
          {"sightings.states.tilt", "sightings.states.sensor_tilt", "sightings.states.sensor_angle"}),
      row("landmark_ekf", "carried off", motion::ticks_and_gyro, kBearings | kRanges, kCarriedOff, 20, kSensorStates,
          {"recover."}),
      row("landmark_ekf", "no start", motion::twist, kBearings, kNoStart | kOneMoved, 25, {}),
      row("landmark_ekf", "no start, two landmarks", motion::twist, kBearings, kNoStart | kFewBeacons, 20,
          {{"sightings.correlated.slots", 0}, {"recover.sigma_xy_m", 1.5}}, {"recover."}),
      row("landmark_ekf", "wrong start", motion::twist, kBearings, kWrongStart | kSilence, 20, {}),
      row("slam", "ranges", motion::twist, kBearings | kRanges, kNoMap | kOutliers | kBlind | kOneMoved, 25,
          all({kMotionStates, kSensorStates, kCorrelated})),
      row("slam", "ranges, wheels", motion::ticks, kBearings | kRanges, kNoMap | kDepth, 20,
          all({kMotionStates,
               {{"states.wheel_slip_sigma", 0.02},
                {"sightings.states.depth_axis_sigma_rad", 0.02},
                {"states.sensor_stamp_sigma_s", 0.01},
                {"sightings.states.sensor_yaw_sigma_rad", 0.02}}})),
      row("slam", "ranges, wheels and gyro", motion::ticks_and_gyro, kBearings | kRanges, kNoMap, 20, kMotionStates),
      row("slam", "without motion data", motion::twist, kBearings | kRanges, kNoMap, 10, {{"motion.model", 6}},
          {"motion.constant_velocity."}),
      row("slam", "fixed errors", motion::twist, kBearings | kRanges | kNameless, kNoMap | kOutliers, 20,
          {{"sightings.use.unidentified", 1},
           {"sightings.noise.lateral_m", 0.03},
           {"sightings.noise.range_rel", 0.02}}),
      row("slam", "markers", motion::ticks, kMarkers, kNoMap | kOutliers | kOneMoved, 25,
          all({kCorrelated,
               {{"markers.correlated", 0.5},
                {"sightings.states.sensor_tilt_sigma_rad", 0.05},
                {"sightings.states.sensor_time_offset_sigma_s", 0.05},
                {"markers.heading_most_rad", 0.014}}})),
      row("slam", "markers on a map", motion::ticks, kMarkers, kNoStart | kOneMoved, 20, {{"landmarks.map", 2}}),
      row("slam", "positions and headings", motion::twist, kAll, kNoMap | kOutliers, 20,
          {{"positions.states.time_offset_sigma_s", 0.1}, {"positions.correlated.sigma_m", 0.5}}, {"positions."}),
      row("slam", "a map that grows", motion::twist, kBearings | kRanges, kOneMoved, 15, {{"landmarks.map", 1}}),
      row("slam", "lines, unscented", motion::twist, kBearings, kNoMap | kOutliers, 25,
          {{"lines.clones", 16},
           {"lines.method", 0},
           {"lines.sigma_rel", 0.25},
           {"sightings.correlated.slots", 6},
           {"sightings.correlated.bearing_rad", 0.004}}),
      row("slam", "lines, inverse distance", motion::twist, kBearings, kNoMap | kBlind | kSilence, 25,
          {{"lines.clones", 16},
           {"lines.method", 2},
           {"sightings.correlated.slots", 6},
           {"sightings.correlated.bearing_rad", 0.004}}),
      row("slam", "lines that come back", motion::twist, kBearings | kRenamed, kNoMap, 40,
          {{"lines.clones", 16}, {"lines.method", 2}}),
      row("edge_mcl", "tracking", motion::twist, kPoints, kSilence, 10, kMotionStates),
      row("edge_mcl", "without motion data", motion::twist, kPoints, 0, 5, {{"motion.model", 6}},
          {"motion.constant_velocity."}),
      row("edge_mcl", "reflections", motion::ticks, kPoints, kReflections, 15, {}),
      row("edge_mcl", "landmarks", motion::twist, kPoints | kBearings | kRanges, kOutliers, 10,
          all({kSensorStates, kCorrelated, {{"sightings.states.map_slots", 4}}}),
          {"sightings.states.map_slots", "sightings.states.", "sightings.correlated."}),
      row("edge_mcl", "landmarks, fixed errors", motion::twist, kBearings | kRanges | kNameless, kOutliers, 10,
          {{"sightings.use.unidentified", 1}, {"sightings.noise.lateral_m", 0.03}, {"sightings.noise.range_rel", 0.02}},
          {"sightings.gate.", "sightings.use.", "sightings.noise."}),
      row("edge_mcl", "depths", motion::twist, kBearings | kRanges, kDepth, 10,
          {{"sightings.states.depth_axis_sigma_rad", 0.02}, {"sightings.states.sensor_yaw_sigma_rad", 0.02}},
          {"sightings.states.depth_axis"}),
      row("edge_mcl", "elevations", motion::twist, kBearings | kElevations, kSilence, 10,
          all({kSensorStates,
               {{"sightings.use.elevation", 1},
                {"sightings.states.map_slots", 4},
                {"sightings.states.sensor_tilt_sigma_rad", 0.02},
                {"sightings.states.sensor_angle_scale_sigma", 0.02}}}),
          {"sightings.states.tilt", "sightings.use.elevation", "sightings.states.sensor_tilt",
           "sightings.states.sensor_angle"}),
      row("edge_mcl", "markers", motion::twist, kPoints | kMarkers, kOutliers, 10,
          {{"markers.heading_most_rad", 0.014}}, {"markers."}),
      row("edge_mcl", "positions and headings", motion::twist, kPoints | kPositions | kHeadings, kOutliers, 10,
          {{"positions.states.time_offset_sigma_s", 0.1}, {"positions.correlated.sigma_m", 0.5}}, {"positions."}),
      row("edge_mcl", "carried off", motion::twist, kPoints, kCarriedOff, 14, {}, {"lost."}),
      row("edge_mcl", "no start", motion::twist, kPoints, kNoStart, 14, {}, {"search."}),
      row("pf_edges", "tracking", motion::twist, kPoints, kSilence, 10, {}),
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
      {"states.rate_bias_sigma_radps", 0.01},
      {"states.velocity_scale_sigma", 0.05},
      {"states.rate_scale_sigma", 0.05},
      {"states.twist_axes_sigma_rad", 0.05},
      {"states.velocity_direction_sigma_rad", 0.05},
      {"states.camera_rotation_sigma_rad", 0.02},
      {"states.camera_place_sigma_m", 0.05},
      {"states.camera_focal_sigma", 0.01},
      {"states.camera_centre_sigma_px", 2.0},
      {"states.time_offset_sigma_s", 0.05},
      {"states.range_bias_sigma_m", 0.2},
      {"states.bearing_bias_sigma_rad", 0.05},
      {"states.twist_lag_sigma_s", 0.05},
  };
  return {
      {"known points", kSilence | kOutliers, 10, states},
      {"constant velocity", kSilence, 10, all({states, {{"prediction", 1}}})},
      {"tracks between pictures", kNoMap, 12, {{"slam.points", 0}}},
      {"points found on the way", kNoMap | kOutliers, 12, {{"slam.points", 60}}},
      {"a map's points as states", kBlind, 12, {{"slam.points", 60}}},
      {"carried off", kCarriedOff, 10, {}},
      {"samples that no vehicle can follow", kGlitches, 10, {}},
      {"no start", kNoStart, 8, {}},
      {"a receiver", kReceiver | kNoMap, 10, {{"slam.points", 0}}},
      {"coded markers", kMarked | kNoMap, 10, {{"slam.points", 0}}},
      {"an IMU", kImu, 10, {{"states.accelerometer_bias_sigma_mps2", 0.2}}},
  };
}

std::vector<stage> stages_of(const wm_estimator &of, const whole_table &tables,
                             std::vector<std::unique_ptr<drives::scene>> *kept) {
  std::vector<stage> out;
  const auto add = [&](const char *name, const std::vector<setting> &params, const std::vector<const char *> &first_for,
                       std::unique_ptr<drives::scene> made) {
    drives::scene *scene = made.get();
    kept->push_back(std::move(made));
    out.push_back({name, params, first_for,
                   [&of, &tables, scene](const values &v, trace *t) { return run(of, tables, *scene, v, t); }});
  };
  for (const scenario &s : scenarios()) {
    const bool general = s.estimator[0] == '\0';
    if (!general && std::strcmp(s.estimator, of.name) != 0) continue;
    // The general ones test the motion: an estimator is given something to see besides, but for particles, whose
    // covariance is theirs from the first scan on.
    unsigned sees = s.sees;
    if (general && (of.takes & WM_EVENT_BIT(WM_EVENT_SIGHTING))) sees |= kBearings | kRanges;
    if (general && (of.takes & WM_EVENT_BIT(WM_EVENT_POINTS)) && !of.particles) sees |= kPoints;
    add(s.name, s.params, s.first_for, std::make_unique<drives::scene>(s.by, sees, s.happens, s.seconds));
  }
  if (!(of.takes & WM_EVENT_BIT(WM_EVENT_STEREO))) return out;
  for (const dive_scenario &s : dive_scenarios())
    add(s.name, s.params, {}, std::make_unique<drives::dive>(s.happens, s.seconds));
  return out;
}

}  // namespace

int main(int argc, char **argv) {
  std::vector<std::unique_ptr<drives::scene>> scenes;
  std::deque<whole_table> tables;
  std::vector<parameters::owner> owners;
  size_t count = 0;
  const wm_estimator *const *estimators = wm_estimators(&count);
  for (size_t i = 0; i < count; i++) {
    const wm_estimator &of = *estimators[i];
    tables.emplace_back(of);
    const auto reads = [&of](const wm_param &param) {
      bool is_own = false;
      for (size_t k = 0; k < of.params.count; k++) is_own |= std::strcmp(of.params.params[k].key, param.key) == 0;
      return is_own || wm_estimator_reads(&of, param.key);
    };
    owners.push_back({of.name, tables.back().table(), stages_of(of, tables.back(), &scenes), reads});
  }
  return parameters::test_all(owners, argc > 1 ? argv[1] : nullptr);
}
