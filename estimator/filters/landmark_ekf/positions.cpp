// SPDX-License-Identifier: Apache-2.0
// Positions (GNSS), headings and poses of another localizer, from the event to their update.
#include "filters/landmark_ekf/landmark_ekf.hpp"
#include "math/arc.hpp"
#include "sensors/validation.hpp"

namespace wm {

wm_status landmark_ekf::fuse_position(const wm_event &event, record_list records) {
  const wm_position &p = event.as.position;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = p.p_m[0];
  wm_status status = check_position(p, 0, 2);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  if (!positions_.params().use_position) return reject(records, record, WM_REJECTED_BY_CONFIG);
  go_to(antenna_of(*setup_, positions_.params()).place_m);
  const position_aid::view at = positions_.look(p, &filter_);
  const observation seen = positions_.observe(p, at, filter_);
  buffer(seen);
  if (life_.searching()) {
    if (is_point_)
      begin_at({p.p_m[0], p.p_m[1], 0.0}, square(seen.sigma_length_m));
    else
      search_now(event.t_ns);
    return reject(records, record, WM_REJECTED_SEARCHING);
  }
  residual rows[2];
  positions_.put_rows(p, at, filter_, record, rows);
  note(event.t_ns, kPositionKey, fuse(rows, 2, square(kClutterPlace_m), true, records));
  return WM_OK;
}

wm_status landmark_ekf::fuse_heading(const wm_event &event, record_list records) {
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
  buffer(positions_.observe(h, filter_));
  if (life_.searching()) {
    search_now(event.t_ns);
    return reject(records, r.record, WM_REJECTED_SEARCHING);
  }
  positions_.put_row(h, filter_, &r);
  note(event.t_ns, kHeadingKey, fuse(&r, 1, kTwoPi, true, records));
  return WM_OK;
}

wm_status landmark_ekf::fuse_localized(const wm_event &event, record_list records) {
  const wm_localized &seen = event.as.localized;
  wm_innovation record = record_of(event, WM_RESIDUAL_X);
  record.observed = seen.p_m[0];
  wm_status status = check_localized(seen);
  if (status != WM_OK) return refuse(records, record, status);
  status = filter_.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  go_to(kBase_m);
  if (life_.searching() && !localizer_.is_in_map()) return reject(records, record, WM_REJECTED_SEARCHING);
  localizer_aid::view at;
  if (!localizer_.look(seen, &filter_, &at)) return WM_OK;
  if (localizer_.is_for_search(at, life_.tracking())) {
    buffer(localizer_.observe(at, filter_));
    if (at.rows == localizer_aid::kRows) buffer(localizer_.observe_heading(at, filter_));
  }
  if (life_.searching()) {
    if (at.rows == localizer_aid::kRows)
      begin_at(at);
    else
      search_now(event.t_ns);
    return reject(records, record, WM_REJECTED_SEARCHING);
  }
  residual rows[localizer_aid::kRows];
  localizer_.put_rows(at, filter_, record, rows);
  if (!localizer_.is_trusted(at, rows, &filter_)) {
    // A pose that nothing has proven may be wrong as well.
    if (localizer_.key() != kNoKey && !evidence_.proven())
      note(event.t_ns, localizer_.key(), landmark_evidence::max_log_bayes_factor());
    return reject(records, record, WM_REJECTED_SEARCHING);
  }
  const double log_bayes = fuse(rows, at.rows, at.clutter_volume(), true, records);
  if (localizer_.key() != kNoKey) note(event.t_ns, localizer_.key(), log_bayes);
  return WM_OK;
}

}  // namespace wm
