// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/bearing_tracks.hpp"

#include "math/elementary.hpp"

namespace wm {
namespace {

// A track observed within this time keeps its place. If each new line replaced one, with more lines in view than
// places none would reach its distance, and the heading would drift. 0.5 s: five pictures, of which some may miss the
// line. hall-hard 1 to 5; not swept.
constexpr double kInView_s = 0.5;

}  // namespace

void bearing_tracks::clear(int clones, int tracks) {
  for (track &t : track_) t.id = -1;
  clones_ = clones;
  tracks_ = tracks < kTracks ? tracks : kTracks;
  for (int i = 0; i < kClones; i++) clone_ns_[i] = WM_TIME_NONE;
}

bearing_tracks::track *bearing_tracks::find(int32_t id, int sensor) {
  for (track &t : track_)
    if (t.id == id && t.sensor == sensor) return &t;
  return nullptr;
}

bearing_tracks::track *bearing_tracks::begin(int32_t id, int sensor, wm_time_ns t_ns) {
  track *best = &track_[0];
  for (int i = 0; i < tracks_; i++) {
    if (track_[i].id < 0) {
      best = &track_[i];
      break;
    }
    if (track_[i].last_ns < best->last_ns) best = &track_[i];
  }
  if (best->id >= 0 && wm_seconds_between(best->last_ns, t_ns) < kInView_s) return nullptr;
  best->id = id;
  best->sensor = sensor;
  best->count = best->misfits = 0;
  best->first_ns = best->last_ns = t_ns;
  return best;
}

void bearing_tracks::remove(track *t, int which) {
  t->count--;
  for (int i = which; i < t->count; i++) {
    t->clone[i] = t->clone[i + 1];
    t->azimuth_rad[i] = t->azimuth_rad[i + 1];
    t->sigma_rad[i] = t->sigma_rad[i + 1];
  }
}

double bearing_tracks::apart2(int a, int b) const {
  return square(clone_m_[a][0] - clone_m_[b][0]) + square(clone_m_[a][1] - clone_m_[b][1]);
}

void bearing_tracks::add(track *t, int clone, double azimuth_rad, double sigma_rad, int most) {
  if (t->count == most) {
    int nearest = 0;
    double least = 1e300;
    for (int i = 0; i + 1 < t->count; i++) {
      const double apart = apart2(t->clone[i], t->clone[i + 1]);
      if (apart < least) {
        least = apart;
        nearest = i;
      }
    }
    remove(t, nearest);
  }
  t->clone[t->count] = clone;
  t->azimuth_rad[t->count] = azimuth_rad;
  t->sigma_rad[t->count] = sigma_rad;
  t->count++;
}

int bearing_tracks::find_clone(int sensor, wm_time_ns t_ns) const {
  for (int i = 0; i < clones_; i++)
    if (clone_ns_[i] == t_ns && clone_sensor_[i] == sensor) return i;
  return -1;
}

int bearing_tracks::newest_clone(int sensor) const {
  int newest = -1;
  for (int i = 0; i < clones_; i++)
    if (clone_ns_[i] != WM_TIME_NONE && clone_sensor_[i] == sensor && (newest < 0 || clone_ns_[i] > clone_ns_[newest]))
      newest = i;
  return newest;
}

int bearing_tracks::take_clone(int sensor, wm_time_ns t_ns, double x_m, double y_m) {
  bool used[kClones] = {};
  for (const track &t : track_)
    for (int i = 0; t.id >= 0 && i < t.count; i++) used[t.clone[i]] = true;
  int best = 0;
  double least = 1e300;
  for (int i = 0; i < clones_ && used[best]; i++) {
    if (!used[i]) {
      best = i;
      break;
    }
    for (int j = 0; j < clones_; j++) {
      if (j == i || apart2(i, j) >= least) continue;
      least = apart2(i, j);
      best = clone_ns_[i] < clone_ns_[j] ? i : j;
    }
  }
  if (used[best])
    for (track &t : track_)
      for (int i = t.count - 1; t.id >= 0 && i >= 0; i--)
        if (t.clone[i] == best) remove(&t, i);
  clone_ns_[best] = t_ns;
  clone_sensor_[best] = sensor;
  clone_m_[best][0] = x_m;
  clone_m_[best][1] = y_m;
  return best;
}

}  // namespace wm
