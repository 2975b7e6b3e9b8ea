// SPDX-License-Identifier: Apache-2.0
// Control of the observations: whether a datum is valid and should be fused, and its record. rows.cpp has the rows.
#include "filters/core/gate.hpp"
#include "filters/stereo_ekf/stereo_ekf.hpp"
#include "sensors/validation.hpp"

namespace wm {
namespace {

constexpr double kFarthest_px = 1e6;  // beyond, a pixel is an error of the sender
// A horizontal sigma from here on means that the datum is a depth alone.
constexpr double kNoHorizontal_m = 1e5;
// Rotation by pending corrections beyond which they are applied at once, rad: second-order terms are then 5e-5 rad.
constexpr double kApplyBeyond_rad = 0.01;

// Where an observation lies that is not of this pose: distances spread over kClutter_m, a disparity over a quarter of
// the picture's width, the rows of both pictures over kClutterRows_px. Orders of magnitude, not swept: a factor of 10
// is 2.3 nats.
constexpr double kClutter_m = 100.0, kClutterDisparity = 0.25, kClutterRows_px = 10.0;

wm_status check_stereo(const wm_stereo &s) {
  const double px[4] = {s.left_px[0], s.left_px[1], s.right_px[0], s.right_px[1]};
  const bool left = !std::isnan(px[0]), right = !std::isnan(px[2]);
  if ((!left && !right) || std::isnan(px[1]) == left || std::isnan(px[3]) == right) return WM_NOT_FINITE;
  for (const double value : px) {
    if (std::isinf(value)) return WM_NOT_FINITE;
    if (std::fabs(value) > kFarthest_px) return WM_OUT_OF_RANGE;
  }
  return s.id < 0 ? WM_OUT_OF_RANGE : WM_OK;
}

// Which coordinates of a position are there: [first, last).
struct coordinates {
  int first, last;
};

coordinates coordinates_of(const wm_position &p) {
  const bool horizontal = !(std::isnan(p.p_m[0]) && std::isnan(p.p_m[1])) && !(p.sigma_xy_m >= kNoHorizontal_m);
  if (finite(p.p_m[2]) && !horizontal) return {2, 3};
  return {0, finite(p.p_m[2]) && finite(p.sigma_z_m) ? 3 : 2};
}

}  // namespace

// Gates and fuses the rows of one observation, and writes a record for each.
row_verdict stereo_ekf::fuse_rows(const row_block &block, const wm_innovation &blank, record_list records) {
  const row_verdict result = filter_.fuse(block, limits());
  for (int k = 0; k < block.rows; k++) {
    wm_innovation r = blank;
    r.residual = (uint8_t)block.kind[k];
    r.observed = block.observed[k];
    r.expected = block.observed[k] - result.innovation[k];
    put_gate({result.nis[k], params_.gate_hard, 1.0, result.fused, result.doubtful}, 1, result.variance[k],
             result.verdict, &r);
    records.add(r);
  }
  if (result.fused) life_.fused(now_ns_);
  // Without points in the state a correction costs little to apply, and later rows are linearised about the better
  // estimate.
  const vec3 turned = filter_.pending(kTurn);
  if (filter_.point_count() == 0 || dot(turned, turned) > square(kApplyBeyond_rad)) filter_.settle();
  return result;
}

row_verdict stereo_ekf::fuse_point(const wm_stereo &seen, const vec3 &place, double place_sigma_m, int slot,
                                   const wm_innovation &blank, record_list records) {
  const past_pose past = state_at_picture();
  filter_.set_turn_rate(past.w_radps);
  row_block rows;
  if (point_rows(seen, place, place_sigma_m, slot, past, &rows)) return fuse_rows(rows, blank, records);
  (void)reject(records, blank, WM_REJECTED_OUT_OF_RANGE);
  row_verdict out{};
  out.verdict = WM_REJECTED_OUT_OF_RANGE;
  return out;
}

double stereo_ekf::clutter_volume_of(const wm_stereo &seen) const {
  const double picture = rig_.width_px * rig_.height_px;
  const bool both = !std::isnan(seen.left_px[0]) && !std::isnan(seen.right_px[0]);
  return both ? picture * kClutterDisparity * rig_.width_px * kClutterRows_px : picture;
}

double stereo_ekf::clutter_volume_of(const wm_sighting &seen) const {
  return (std::isnan(seen.range_m) ? 1.0 : kClutter_m) * (std::isnan(seen.bearing_rad) ? 1.0 : kTwoPi);
}

wm_status stereo_ekf::fuse_stereo(const wm_event &event, record_list records) {
  if (!rig_.there) return WM_UNSUPPORTED;
  const wm_stereo &s = event.as.stereo;
  wm_innovation blank = record_of(event, WM_RESIDUAL_PIXEL);
  blank.landmark_id = s.id;
  if (const wm_status bad = check_stereo(s); bad != WM_OK) return refuse(records, blank, bad);
  if (const wm_status bad = check_time(event.t_ns); bad != WM_OK) return bad;
  move_to(event.t_ns);
  begin_picture(event.t_ns);
  const int known = index_.find(setup_->landmarks, s.id);
  if (known >= 0) return fuse_known_point(event, known, blank, records);
  look(s);
  if (life_.searching()) return reject(records, blank, WM_REJECTED_SEARCHING);
  const int slot = find_slot(s.id);
  if (slot < 0) {
    if (is_landmark(s))
      add_point(s, blank, records);
    else
      add_track(s, blank, records);
  } else if (fuse_point(s, filter_.point(slot), 0.0, slot, blank, records).fused) {
    info_[(size_t)slot].seen_ns = event.t_ns;
    info_[(size_t)slot].unseen = 0;
    note_appearance(slot, s);
  } else {
    contradict_point(slot, s, blank, records);
  }
  return WM_OK;
}

wm_status stereo_ekf::fuse_known_point(const wm_event &event, int known, const wm_innovation &blank,
                                       record_list records) {
  const wm_stereo &s = event.as.stereo;
  const wm_landmark &landmark = setup_->landmarks[known];
  buffer_observation(s, landmark, event.t_ns);
  if (life_.searching()) {
    (void)reject(records, blank, WM_REJECTED_SEARCHING);
    search(event.t_ns - wm_ns_from_seconds(kWindow_s));
    return WM_OK;
  }
  const int slot = slot_of_known(known);
  const vec3 place = slot >= 0 ? filter_.point(slot) : vec_of(landmark.p_m);
  const row_verdict result = fuse_point(s, place, slot >= 0 ? 0.0 : map_sigma(landmark), slot, blank, records);
  note(event.t_ns, s.id, result, clutter_volume_of(s), &records_[(size_t)known]);
  return WM_OK;
}

wm_status stereo_ekf::fuse_sighting(const wm_event &event, record_list records) {
  const wm_sighting &s = event.as.sighting;
  const bool has_range = !std::isnan(s.range_m);
  wm_innovation blank = record_of(event, has_range ? WM_RESIDUAL_RANGE : WM_RESIDUAL_BEARING);
  blank.sensor = s.sensor;
  blank.landmark_id = s.landmark_id;
  if (const wm_status bad = check_sighting(s, setup_->sensor_count); bad != WM_OK) return refuse(records, blank, bad);
  if (const wm_status bad = check_time(event.t_ns); bad != WM_OK) return bad;
  move_to(event.t_ns);
  if (s.landmark_id < 0) return reject(records, blank, WM_REJECTED_NO_ASSOCIATION);
  const int known = index_.find(setup_->landmarks, s.landmark_id);
  if (known < 0) return reject(records, blank, WM_REJECTED_UNKNOWN_ID);
  if (life_.searching()) return reject(records, blank, WM_REJECTED_SEARCHING);
  if (has_range && s.range_m > setup_->sensors[s.sensor].max_range_m)
    return reject(records, blank, WM_REJECTED_OUT_OF_RANGE);
  const int slot = has_range ? slot_of_known(known) : -1;
  row_block rows;
  if (!sighting_rows(s, known, slot, &rows)) return reject(records, blank, WM_REJECTED_SINGULAR);
  note(event.t_ns, s.landmark_id, fuse_rows(rows, blank, records), clutter_volume_of(s), &records_[(size_t)known]);
  return WM_OK;
}

// A position, or (without x and y) a depth.
wm_status stereo_ekf::fuse_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  const coordinates there = coordinates_of(p);
  const bool depth = there.first == 2;
  const wm_innovation blank = record_of(event, depth ? WM_RESIDUAL_Z : WM_RESIDUAL_X);
  if (const wm_status bad = check_position(p, there.first, there.last); bad != WM_OK)
    return refuse(records, blank, bad);
  if (const wm_status bad = check_time(event.t_ns); bad != WM_OK) return bad;
  move_to(event.t_ns);
  if (life_.searching()) return reject(records, blank, WM_REJECTED_SEARCHING);
  row_block rows;
  if (depth) {
    depth_rows(p, &rows);
  } else {
    // Another solution has another error.
    if (receiver_.move_to(event.t_ns, p.sigma_xy_m, gnss_).left == 0.0) filter_.restart_receiver();
    position_rows(p, there.last, &rows);
  }
  double clutter_volume = 1.0;
  for (int i = there.first; i < there.last; i++) clutter_volume *= kClutter_m;
  note(event.t_ns, depth ? kDepthKey : kPositionKey, fuse_rows(rows, blank, records), clutter_volume, nullptr);
  return WM_OK;
}

wm_status stereo_ekf::fuse_heading(const wm_event &event, record_list records) {
  const wm_heading &h = event.as.heading;
  wm_innovation blank = record_of(event, WM_RESIDUAL_HEADING);
  blank.observed = h.heading_rad;
  if (const wm_status bad = check_heading(h); bad != WM_OK) return refuse(records, blank, bad);
  if (const wm_status bad = check_time(event.t_ns); bad != WM_OK) return bad;
  move_to(event.t_ns);
  if (life_.searching()) return reject(records, blank, WM_REJECTED_SEARCHING);
  row_block rows;
  if (!heading_rows(h, &rows)) return reject(records, blank, WM_REJECTED_SINGULAR);
  note(event.t_ns, kHeadingKey, fuse_rows(rows, blank, records), kTwoPi, nullptr);
  return WM_OK;
}

// With velocity and rates as states a measured twist is six rows like any other.
void stereo_ekf::fuse_twist(const wm_event &motion) {
  vec3 v_var, w_var;
  spatial_twist now, per_s;
  motion_.sample_noise(&v_var, &w_var);
  if (!motion_.sample_now(&now, &per_s)) return;
  const spatial_source &source = motion_.source();
  const uint32_t all = spatial_source::kAxes, lost = source.lost_rates();
  const bool planar = motion.kind == WM_EVENT_TWIST2, quantities = motion.kind == WM_EVENT_QUANTITIES;
  if (!quantities) (void)filter_.fuse(twist_rows(kVelocity, now.v, per_s.v, v_var, planar ? 1u : all), limits());
  // A twist beside a gyro gives the rates that the gyro has lost.
  const uint32_t by_twist = (source.by_gyro() ? lost : planar ? 4u : all) & ~source.unmeasured_rates(motion.t_ns);
  const uint32_t axes = quantities ? all & ~lost : by_twist;
  if (axes != 0) (void)filter_.fuse(twist_rows(kRates, now.w, per_s.w, w_var, axes), limits());
}

// Rates of another source have another bias: its state begins anew, and has the gyro's again when the gyro is back.
void stereo_ekf::follow_rates() {
  const uint32_t lost = motion_.source().lost_rates(), changed = lost ^ lost_rates_;
  if (changed == 0) return;
  lost_rates_ = lost;
  gravity_.restart();
  const int first = filter_.at(kRateBias);
  for (int i = 0; i < 3 && first >= 0; i++) {
    if (!(changed & (1u << i))) continue;
    filter_.settle();
    kept_bias &kept = gyro_bias_[i];
    if (lost & (1u << i)) {
      kept = {now_ns_, filter_.value(first + i), filter_.variance(first + i)};
      filter_.forget(first + i, 0.0, square(params_.rate_bias_sigma));
    } else {
      const double since_s = wm_seconds_between(kept.t_ns, now_ns_);
      filter_.forget(first + i, kept.radps, kept.variance + square(params_.rate_bias_walk) * since_s);
    }
  }
}

// The direction of gravity, once a second: a second of specific force less the acceleration by the velocity.
void stereo_ekf::fuse_gravity() {
  const bool rates = constant_velocity();
  const vec3 v = rates ? filter_.head3(kVelocity) : filter_.velocity_of(motion_.v_mps());
  const vec3 w = rates ? filter_.head3(kRates) : filter_.rates_of(motion_.w_radps());
  vec3 v_var, w_var, force;
  double variance[3];
  motion_.sample_noise(&v_var, &w_var);
  const bool known = rates || motion_.source().velocity_is_known(now_ns_);
  const double turn_rad2ps = motion_.unmeasured_turn_rad2ps(now_ns_);
  if (!gravity_.add(now_ns_, motion_.source().force_mps2(), v, w, known ? &v_var : nullptr, turn_rad2ps, &force,
                    variance))
    return;
  if (life_.searching()) return;
  (void)filter_.fuse(gravity_rows(force, variance), limits());
}

}  // namespace wm
