// SPDX-License-Identifier: Apache-2.0
// From a sighting to a correction or to a new landmark.
#include "filters/slam/slam.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOneNumber = 6.635 / 9.210;  // 99 % of chi2 with one degree of freedom against two

}  // namespace

// Each picture's stamp has an error of its own, alike for all that is seen in it.
void slam::begin_picture(int sensor, wm_time_ns t_ns) {
  if (stamp_state_[sensor] < 0 || picture_ns_[sensor] == t_ns) return;
  picture_ns_[sensor] = t_ns;
  joint_.forget(stamp_state_[sensor], 0.0, square(params_.sensor_stamp_sigma_s));
}

past_pose slam::look_back(int sensor) const {
  const int slot = slots_.at(sensor, kTimeOffset), stamp = stamp_state_[sensor];
  const double offset_s = slot < 0 ? 0.0 : joint_.value(slot), stamp_error_s = stamp < 0 ? 0.0 : joint_.value(stamp);
  past_pose out = pose_before(joint_, offset_s + stamp_error_s);
  out.stamp_slot = stamp;
  return out;
}

sensor_errors slam::errors_of(int sensor) const {
  return slots_.errors(sensor, [this](int slot) { return joint_.value(slot); });
}

wm_pose2 slam::sensor_pose(int sensor, const past_pose &past) const {
  const mounted_sensor &m = sensor_[sensor];
  const sensor_errors e = errors_of(sensor);
  return compose(past.pose, {m.x_m + e[kMountX], m.y_m + e[kMountY], m.yaw_rad + e[kYaw]});
}

// The error of this sensor on this landmark that lasts: a slot of states, faded to now. -1 where none is carried.
int slam::lend(int sensor, int32_t id, wm_time_ns t_ns) {
  const int64_t key = static_cast<int64_t>(id) * kSlamSensors + sensor;
  return lasting_.lend(&joint_, key, lasting_width_, params_.lasting_tau_s, t_ns);
}

void slam::see(const wm_sighting &s, const reading &r, const past_pose &past, const double place[2], int lasting,
               view *out) const {
  const int sensor = s.sensor;
  const double at[3] = {place[0], place[1], std::nan("")};
  const unsigned components = (r.bearing ? kBearing : 0u) | (r.range ? kRange : 0u) | components_;
  const expected_sighting e = expect(sensor_[sensor], errors_of(sensor), past.pose, at, components);
  out->count = 0;
  out->possible = e.possible;
  out->distance_m = e.distance_m;
  if (!e.possible) return;
  const auto add = [&](wm_residual kind, double observed, double expected, const double by[kCauses], double variance,
                       int lasting_offset, double lasting_size) {
    const int i = out->count++;
    joint_row &row = out->row[i];
    row.count = row.missing = 0;
    add_past_pose(&row, by, past, slots_.at(sensor, kTimeOffset));
    slots_.add_to(&row, sensor, by);
    if (lasting >= 0 && lasting_offset >= 0) {
      row.add(lasting + lasting_offset, lasting_size);
      expected += lasting_size * joint_.value(lasting + lasting_offset);
    } else {
      variance += square(lasting_size);
    }
    out->by_landmark[i][0] = -by[0];
    out->by_landmark[i][1] = -by[1];
    out->kind[i] = kind;
    out->observed[i] = observed;
    out->expected[i] = expected;
    out->innovation[i] = kind == WM_RESIDUAL_BEARING ? wrap(observed - expected) : observed - expected;
    out->noise[i] = variance;
  };
  const double distance = e.distance_m > 0.1 ? e.distance_m : 0.1;
  if (r.bearing)
    add(WM_RESIDUAL_BEARING, s.bearing_rad, e.bearing_rad, e.bearing_by,
        square(r.bearing_sigma_rad) + square(params_.lateral_sigma_m / distance), lasting_bearing_offset_,
        std::sqrt(square(params_.lasting_bearing_rad) + square(params_.lasting_lateral_m / distance)));
  if (r.range) {
    add(WM_RESIDUAL_RANGE, s.range_m, e.range_m, e.range_by,
        square(r.range_sigma_m) + square(params_.range_sigma_rel * e.range_m), lasting_range_offset_,
        std::sqrt(square(params_.lasting_range_m) + square(params_.lasting_range_rel * e.range_m)));
  }
}

wm_status slam::fuse_sighting(const wm_event &event, record_list records) {
  const wm_sighting &s = event.as.sighting;
  wm_innovation blank{};
  blank.t_ns = event.t_ns;
  blank.source = event.source;
  blank.sensor = s.sensor;
  blank.landmark_id = s.landmark_id;
  blank.residual = (uint8_t)(std::isnan(s.bearing_rad) ? WM_RESIDUAL_RANGE : WM_RESIDUAL_BEARING);
  blank.observed = std::isnan(s.bearing_rad) ? s.range_m : s.bearing_rad;
  const auto drop = [&](wm_verdict verdict) {
    blank.verdict = (uint8_t)verdict;
    records.add(blank);
    return WM_OK;
  };
  wm_status status = check_sighting(s, setup_->sensor_count);
  if (status != WM_OK) {
    drop(status == WM_NOT_FINITE ? WM_REJECTED_NOT_FINITE : WM_REJECTED_OUT_OF_RANGE);
    return status;
  }
  status = joint_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  joint_.move_to(event.t_ns);
  begin_look(event.t_ns);
  look_after(event.t_ns);

  const mounted_sensor &sensor = sensor_[s.sensor];
  const reading r = read_sighting(s, sensor, params_);
  if (!r.bearing && !r.range) return drop(WM_REJECTED_BY_CONFIG);
  if (!std::isnan(s.range_m) && s.range_m > sensor.max_range_m) return drop(WM_REJECTED_OUT_OF_RANGE);

  begin_picture(s.sensor, event.t_ns);
  const past_pose past = look_back(s.sensor);
  int32_t id = s.landmark_id;
  int landmark = id >= 0 ? find_landmark(id) : -1;
  if (id < 0) {
    bool fresh = false;
    if (params_.associate_unknown && r.bearing && r.range && s.range_m <= params_.associate_max_range_m)
      landmark = associate(s, r, past, &fresh);
    if (landmark < 0 && !fresh) return drop(WM_REJECTED_NO_ASSOCIATION);
    id = landmark < 0 ? own_id() : notes()[landmark].id;
    blank.landmark_id = id;
  } else if (doubled(id, landmark, s.sensor)) {
    return drop(WM_REJECTED_NO_ASSOCIATION);
  }
  if (landmark >= 0 && s.landmark_id >= 0 && map_is_held()) {
    keep_observation(landmark, s.sensor, past, sighted_of(s, r));
    if (relocalize()) return drop(WM_REJECTED_SEARCHING);
  }
  if (params_.line_rejoin && r.bearing && !r.range) collect_bearing(s, past);
  if (state_ == WM_STATE_SEARCHING || (state_ == WM_STATE_LOST && params_.line_rejoin))
    return drop(WM_REJECTED_SEARCHING);
  const bool may_join = params_.map != WM_SLAM_MAP_FROZEN && r.bearing && (r.range || params_.line_clones > 0);
  if (landmark >= 0)
    fuse_known(landmark, s, r, past, blank, records);
  else if (may_join && map_is_held())
    drop(WM_REJECTED_SEARCHING);
  else if (!may_join)
    drop(WM_REJECTED_UNKNOWN_ID);
  else if (r.range)
    join_seen(id, s, r, past, blank, records);
  else if (params_.line_method == WM_SLAM_LINE_INVERSE_DISTANCE)
    follow_ray(id, s, r, past, blank, records);
  else
    track_bearing(id, s, r, past, blank, records);
  return WM_OK;
}

// What is stated of its sigmas here needs no cross terms: the search allows for odometry's errors besides.
slam::sighted slam::sighted_of(const wm_sighting &s, const reading &r) const {
  const sensor_errors errors = errors_of(s.sensor);
  const bool depth = sensor_[s.sensor].range_is_depth && r.bearing;
  const double range =
      (s.range_m - errors[kRangeBias]) / errors[kRangeScale] / (depth ? larger(cos(s.bearing_rad), 0.1) : 1.0);
  return {r.bearing ? s.bearing_rad : std::nan(""),
          r.range ? range : std::nan(""),
          std::nan(""),
          std::sqrt(square(r.bearing_sigma_rad) + square(params_.lasting_bearing_rad)),
          std::sqrt(square(r.range_sigma_m) + square(params_.lasting_range_m) +
                    square((params_.range_sigma_rel + params_.lasting_range_rel) * range)),
          0.0};
}

// Bearing and range are gated together: a wrong one spoils its fellow. Between the two gates a sighting counts less, as
// a Student distribution would have it; above, not at all.
void slam::fuse_known(int landmark, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                      record_list records) {
  const landmark_note &note = notes()[landmark];
  const int state = joint_.landmark_state(landmark);
  const double place[2] = {joint_.value(state), joint_.value(state + 1)};
  const wm_time_ns now = joint_.now_ns();
  view v;
  see(s, r, past, place, lend(s.sensor, note.id, now), &v);
  if (!v.possible) {
    blank.verdict = v.distance_m < 0.05 ? WM_REJECTED_SINGULAR : WM_REJECTED_OUT_OF_RANGE;
    records.add(blank);
    return;
  }
  for (int i = 0; i < v.count; i++) {
    v.row[i].add(state, v.by_landmark[i][0]);
    v.row[i].add(state + 1, v.by_landmark[i][1]);
  }
  joint_state::innovation_block block;
  joint_.prepare(v.row, v.innovation, v.noise, v.count, &block);
  const double scale = v.count == 2 ? 1.0 : kOneNumber;
  const double hard = params_.gate_hard * scale, soft = params_.gate_soft * scale;
  const bool fused = block.nis <= hard;
  if (s.landmark_id >= 0 &&
      !weigh(landmark, block, fused, clutter_volume(r.bearing, r.range), r.bearing ? v.innovation[0] : std::nan(""))) {
    blank.verdict = WM_REJECTED_SEARCHING;
    records.add(blank);
    return;
  }
  if (fused && s.landmark_id >= 0 && !believable(landmark, block, v.noise[0], scale)) {
    blank.verdict = WM_REJECTED_SEARCHING;
    records.add(blank);
    return;
  }
  double variance[2];
  for (int i = 0; i < v.count; i++) variance[i] = block.s[i][i];
  const double weaker = block.nis > soft ? block.nis / soft - 1.0 : 0.0;
  const double more[2] = {v.noise[0] * weaker, v.count == 2 ? v.noise[1] * weaker : 0.0};
  const bool failed = !(block.determinant > 0.0) || (fused && !joint_.fuse(block, more, scope_now()));
  for (int i = 0; i < v.count; i++) {
    wm_innovation record = blank;
    record.residual = (uint8_t)v.kind[i];
    record.observed = v.observed[i];
    record.expected = v.expected[i];
    record.variance = variance[i];
    record.nis = block.nis;
    record.gate = hard;
    record.gate_dof = (uint8_t)v.count;
    record.verdict = failed ? WM_REJECTED_NUMERIC : fused ? WM_FUSED : WM_REJECTED_GATE;
    records.add(record);
  }
  if (r.bearing) note_turn(fused, v.innovation[0], false, note.last_ns);
  if (!fused)
    misfit(landmark, r.range);
  else if (!failed)
    note_fused(landmark, s.sensor);
}

// Paper, system 2, new marker: P_aa = G_x P G_x' + G_z R G_z' with all cross terms. G by the sighting's own
// derivatives: 0 = H_x dx + H_l dl + v, so dl = -H_l^-1 (H_x dx + v).
void slam::join_seen(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                     record_list records) {
  const sensor_errors errors = errors_of(s.sensor);
  double range = (s.range_m - errors[kRangeBias]) / errors[kRangeScale];
  if (sensor_[s.sensor].range_is_depth) range /= larger(cos(s.bearing_rad), 0.1);
  const wm_pose2 from = sensor_pose(s.sensor, past);
  const sin_cos ray = sincos(from.heading_rad + s.bearing_rad);
  double place[3] = {from.x_m + range * ray.cos, from.y_m + range * ray.sin, 0.0};
  const int lasting = lend(s.sensor, id, joint_.now_ns());
  view v;
  double inverse[2][2];
  for (int step = 0;; step++) {  // a sensor that isn't level sees another place than the first guess
    see(s, r, past, place, lasting, &v);
    const double(*h)[2] = v.by_landmark;
    const double determinant = v.possible ? h[0][0] * h[1][1] - h[0][1] * h[1][0] : 0.0;
    if (!(std::fabs(determinant) > 1e-9) || !(range > 0.05)) {
      blank.verdict = WM_REJECTED_SINGULAR;
      records.add(blank);
      return;
    }
    inverse[0][0] = h[1][1] / determinant;
    inverse[0][1] = -h[0][1] / determinant;
    inverse[1][0] = -h[1][0] / determinant;
    inverse[1][1] = h[0][0] / determinant;
    if (step == 3) break;
    for (int k = 0; k < 2; k++) place[k] += inverse[k][0] * v.innovation[0] + inverse[k][1] * v.innovation[1];
  }
  if (!finite(place[0]) || !finite(place[1]) || !make_room()) {
    blank.verdict = WM_REJECTED_NO_ASSOCIATION;
    records.add(blank);
    return;
  }
  joint_row rows[3];
  double noise[3][3] = {};
  for (int k = 0; k < 2; k++)
    for (int i = 0; i < 2; i++) {
      rows[k].add(v.row[i], -inverse[k][i]);
      for (int l = 0; l < 2; l++) noise[k][l] += inverse[k][i] * v.noise[i] * inverse[l][i];
    }
  noise[2][2] = square(kPi);  // a heading, where landmarks have one, is unknown
  note_landmark(id, joint_.add_landmark(rows, noise, place), s.sensor, joint_.now_ns());
  fused_ns_ = joint_.now_ns();
  blank.verdict = WM_FUSED;
  blank.expected = blank.observed;  // it defines the landmark; there was nothing to hold it against
  records.add(blank);
}

// The sensor's pose in map when a sighting was true, as a clone in the state.
int slam::keep_clone(int sensor, const past_pose &past, wm_time_ns t_ns) {
  const int there = tracks_.find_clone(sensor, t_ns);
  if (there >= 0) return there;
  const wm_pose2 pose = sensor_pose(sensor, past);
  const int clone = tracks_.take_clone(sensor, t_ns, pose.x_m, pose.y_m);
  const double lever_x = pose.x_m - past.pose.x_m, lever_y = pose.y_m - past.pose.y_m;
  const sin_cos h = sincos(past.pose.heading_rad);
  const double by[3][6] = {{1, 0, -lever_y, 0, h.cos, -h.sin}, {0, 1, lever_x, 0, h.sin, h.cos}, {0, 0, 1, 1, 0, 0}};
  joint_row rows[3];
  for (int k = 0; k < 3; k++) {
    add_past_pose(&rows[k], by[k], past, slots_.at(sensor, kTimeOffset));
    rows[k].add(slots_.at(sensor, kYaw), by[k][3]);
    rows[k].add(slots_.at(sensor, kMountX), by[k][4]);
    rows[k].add(slots_.at(sensor, kMountY), by[k][5]);
  }
  const double none[3][3] = {}, values[3] = {pose.x_m, pose.y_m, pose.heading_rad};
  joint_.assign(clone_state(clone), 3, rows, none, values);
  return clone;
}

void slam::track_bearing(int32_t id, const wm_sighting &s, const reading &r, const past_pose &past, wm_innovation blank,
                         record_list records) {
  const wm_time_ns now = joint_.now_ns();
  blank.verdict = WM_REJECTED_SEARCHING;  // kept until the parallax suffices
  bearing_tracks::track *track = tracks_.find(id, s.sensor);
  if (!track) {
    track = tracks_.begin(id, s.sensor);
    track->first_ns = now;
  }
  track->last_ns = now;
  // All lines of a picture share a clone, and pictures that are too near to the last one have none.
  const wm_pose2 here = sensor_pose(s.sensor, past);
  const int newest = tracks_.newest_clone(s.sensor);
  if (newest >= 0 && tracks_.find_clone(s.sensor, now) < 0) {
    const int state = clone_state(newest);
    const double dx = here.x_m - joint_.value(state), dy = here.y_m - joint_.value(state + 1);
    if (dx * dx + dy * dy < square(params_.line_step_m)) {
      records.add(blank);
      return;
    }
  }
  const double sigma = std::sqrt(square(r.bearing_sigma_rad) + square(params_.lasting_bearing_rad));
  const int clone = keep_clone(s.sensor, past, now);
  tracks_.add(track, clone, s.bearing_rad, sigma, params_.line_poses);
  if (track->count >= 3 && join_line(*track)) {
    bearing_tracks::end(track);
    fused_ns_ = now;
    blank.verdict = WM_FUSED;
    blank.expected = blank.observed;
  }
  records.add(blank);
}

bool slam::join_line(const bearing_tracks::track &track) {
  line_bundle bundle;
  bundle.count = track.count;
  for (int i = 0; i < track.count; i++) {
    const int state = clone_state(track.clone[i]);
    bundle.pose[i] = {joint_.value(state), joint_.value(state + 1), joint_.value(state + 2)};
    bundle.azimuth_rad[i] = track.azimuth_rad[i];
    bundle.sigma_rad[i] = track.sigma_rad[i];
    for (int j = 0; j < track.count; j++)
      for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++)
          bundle.pose_covariance[3 * i + k][3 * j + l] = joint_.covariance(state + k, clone_state(track.clone[j]) + l);
  }
  const line_landmark line = find_line(bundle, params_.line_method == WM_SLAM_LINE_UNSCENTED);
  if (!line.solved || line.parallax_rad < params_.line_parallax_rad || line.misfit > params_.gate_soft) return false;
  joint_row rows[3];
  double noise[3][3] = {};
  for (int r = 0; r < 2; r++) {
    for (int j = 0; j < 3 * track.count; j++) rows[r].add(clone_state(track.clone[j / 3]) + j % 3, line.by_pose[r][j]);
    for (int c = 0; c < 2; c++) noise[r][c] = line.noise[r][c];
  }
  // How well it is known from the last pose: the poses' own common error is not the landmark's.
  joint_row relative[2] = {rows[0], rows[1]};
  const int last = clone_state(track.clone[track.count - 1]);
  for (int r = 0; r < 2; r++) relative[r].add(last + r, -1.0);
  const double variance = joint_.variance_of(relative[0]) + joint_.variance_of(relative[1]) + noise[0][0] + noise[1][1];
  if (variance > square(params_.line_sigma_rel * line.distance_m) || !make_room()) return false;
  noise[2][2] = square(kPi);
  const double place[3] = {line.place_m[0], line.place_m[1], 0.0};
  note_line(track, joint_.add_landmark(rows, noise, place));
  return true;
}

}  // namespace wm
