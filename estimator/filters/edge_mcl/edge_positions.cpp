// SPDX-License-Identifier: Apache-2.0
// Positions (GNSS), headings and poses of another localizer beside the floor plan: as landmarks, they correct the pose
// between the scans, are evidence for or against it, and help to find it.
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"
#include "sensors/validation.hpp"

namespace wm {

wm_status edge_mcl::take_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = p.p_m[0];
  wm_status status = check_position(p, 0, 2);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!positions_.params().use_position) return reject(records, record, WM_REJECTED_BY_CONFIG);
  if (!positions_.is_awake()) positions_.wake(&filter_);
  const position_aid::view at = positions_.look(p, &filter_);
  if (is_found_by(positions_.observe(p, at, filter_))) return reject(records, record, WM_REJECTED_SEARCHING);
  residual rows[2];
  positions_.put_rows(p, at, filter_, record, rows);
  fuse_given(rows, 2, kPositionKey, square(kClutterPlace_m), records);
  return WM_OK;
}

wm_status edge_mcl::take_heading(const wm_event &event, record_list records) {
  const wm_heading &h = event.as.heading;
  residual r;
  r.record = record_of(event, WM_RESIDUAL_HEADING);
  r.record.observed = h.heading_rad;
  wm_status status = check_heading(h);
  if (status != WM_OK) return refuse(records, r.record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!positions_.params().use_heading) return reject(records, r.record, WM_REJECTED_BY_CONFIG);
  if (!positions_.is_awake()) positions_.wake(&filter_);
  if (is_found_by(positions_.observe(h, filter_))) return reject(records, r.record, WM_REJECTED_SEARCHING);
  positions_.put_row(h, filter_, &r);
  fuse_given(&r, 1, kHeadingKey, kTwoPi, records);
  return WM_OK;
}

wm_status edge_mcl::take_localized(const wm_event &event, record_list records) {
  const wm_localized &seen = event.as.localized;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = seen.p_m[0];
  wm_status status = check_localized(seen);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  const bool is_known = !life_.searching() || tentative_;
  if (!is_known && !localizer_.is_in_map()) return reject(records, record, WM_REJECTED_SEARCHING);
  localizer_aid::view at;
  if (!localizer_.look(seen, &filter_, &at)) return WM_OK;
  if (localizer_.is_for_search(at, life_.tracking())) {
    if (at.rows == localizer_aid::kRows) landmarks_seen_.add(localizer_.observe_heading(at, filter_));
    if (is_found_by(localizer_.observe(at, filter_))) return reject(records, record, WM_REJECTED_SEARCHING);
  } else if (!is_known) {
    return reject(records, record, WM_REJECTED_SEARCHING);
  }
  residual rows[localizer_aid::kRows];
  localizer_.put_rows(at, filter_, record, rows);
  if (!localizer_.is_trusted(at, rows, &filter_)) return reject(records, record, WM_REJECTED_SEARCHING);
  fuse_given(rows, at.rows, localizer_.key(), at.clutter_volume(), records);
  return WM_OK;
}

// Keeps it for the search. True: the pose was just found by it, or is not known yet.
bool edge_mcl::is_found_by(const observation &seen) {
  landmarks_seen_.add(seen);
  return search_by_landmarks() || (life_.searching() && !tentative_);
}

void edge_mcl::fuse_given(residual *rows, int count, int key, double clutter_volume, record_list records) {
  const fuse_result done = fuse(&filter_, rows, count, clutter_volume, landmark_policy(true), records);
  const wm_time_ns now = filter_.now_ns();
  if (done.verdict == WM_FUSED) life_.fused(now);
  if (key != kNoKey) landmark_fit_.note(now, key, done.log_bayes, std::nan(""), std::nan(""), nullptr);
  update_state(0.0);
  update_suspicion();
}

}  // namespace wm
