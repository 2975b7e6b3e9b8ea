// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/line_tracks.hpp"

#include <cstring>

namespace wm {

namespace {

constexpr double kBin_rad = 0.004;  // of the turn's histogram
constexpr int kBinsMax = 1024;
constexpr int kBlur = 3;            // bins to each side that are taken together
constexpr double kStale_s = 1.0;    // after such a gap nothing is predicted
constexpr double kRateShare = 0.4;  // of what a new picture says of a line's own rate
constexpr double kFirstGate = 3;    // a track seen once: its own rate is unknown
constexpr double kRival = 2.0;      // a second choice nearer than so many times the first one makes both unsure

bool same_sign(const line_track &t, const radial_edge &e) {
  return (t.left_grey > t.right_grey) == (e.left_grey > e.right_grey);
}

double appearance(const line_track &t, const radial_edge &e, const wm_lines_params &params) {
  return (square(t.left_grey - e.left_grey) + square(t.right_grey - e.right_grey)) /
         (2 * square(params.appearance_grey));
}

// The turn that most pairs of track and line agree on, about what is expected.
double find_turn(const line_tracks &self, const radial_edge *edges, int count, double dt_s,
                 const wm_lines_params &params) {
  double votes[kBinsMax] = {};
  const int half = static_cast<int>(params.turn_max_rad / kBin_rad) < kBinsMax / 2 - kBlur - 1
                       ? static_cast<int>(params.turn_max_rad / kBin_rad)
                       : kBinsMax / 2 - kBlur - 1;
  const double expected = -self.turn_radps * dt_s;
  const auto each_pair = [&](auto take) {
    for (const line_track &t : self.track) {
      if (t.id == 0) continue;
      for (int i = 0; i < count; i++) {
        if (!same_sign(t, edges[i])) continue;
        const double moved =
            wrap(edges[i].azimuth_rad - t.azimuth_rad - t.rate_radps * dt_s * (t.unseen + 1)) - expected;
        const double weight = 1 / (1 + 4 * appearance(t, edges[i], params));
        take(wrap(moved), t.seen > 1 ? weight : 0.3 * weight);
      }
    }
  };
  each_pair([&](double moved, double weight) {
    const int bin = static_cast<int>(std::floor(moved / kBin_rad + 0.5));
    if (bin >= -half && bin <= half) votes[bin + kBinsMax / 2] += weight;
  });
  double best = 0;
  int at = 0;
  for (int b = -half; b <= half; b++) {
    double sum = 0;
    for (int k = -kBlur; k <= kBlur; k++) sum += votes[b + k + kBinsMax / 2] * (kBlur + 1 - (k < 0 ? -k : k));
    // Among equals the one that continues the motion.
    sum *= 1 - 0.3 * std::fabs(b) / (half + 1.0);
    if (sum > best) {
      best = sum;
      at = b;
    }
  }
  double sum = 0, weights = 0;
  each_pair([&](double moved, double weight) {
    if (std::fabs(moved - at * kBin_rad) > (kBlur + 0.5) * kBin_rad) return;
    sum += weight * moved;
    weights += weight;
  });
  return expected + (weights > 0 ? sum / weights : 0);
}

// Cost of taking an edge for a track; negative: out of the question.
double cost_of(const line_track &t, const radial_edge &e, double predicted, const wm_lines_params &params) {
  if (!same_sign(t, e)) return -1;
  const double gate = params.gate_rad * (t.seen < 2 ? kFirstGate : 1) * (1 + 0.5 * t.unseen);
  const double off = wrap(e.azimuth_rad - predicted) / gate;
  const double looks = appearance(t, e, params);
  return off > 1 || off < -1 || looks > 4 ? -1 : square(off) + 0.25 * looks + 0.01;
}

}  // namespace

void line_tracks::clear() {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  next_id = 1;
  last_ns = WM_TIME_NONE;
}

void line_tracks::follow(const radial_edge *edges, int count, wm_time_ns t_ns, const wm_lines_params &params) {
  const double dt = last_ns == WM_TIME_NONE ? kStale_s : wm_seconds_between(last_ns, t_ns);
  const bool stale = !(dt > 0 && dt < kStale_s);
  if (stale)
    for (line_track &t : track) t.id = 0;
  const double turn = stale ? 0 : find_turn(*this, edges, count, dt, params);
  last_ns = t_ns;
  turn_radps = stale ? 0 : -turn / dt;

  bool taken[kRadialEdgesMax] = {};
  double predicted[kLineTracksMax];
  for (int k = 0; k < kLineTracksMax; k++) {
    line_track &t = track[k];
    t.edge = -1;
    predicted[k] = wrap(t.azimuth_rad + turn + t.rate_radps * dt);
  }
  // Mutual best first, until none is left.
  for (bool again = true; again;) {
    again = false;
    int best_of_edge[kRadialEdgesMax];
    for (int i = 0; i < count; i++) {
      best_of_edge[i] = -1;
      double least = 1e9;
      for (int k = 0; k < kLineTracksMax && !taken[i]; k++) {
        if (track[k].id == 0 || track[k].edge >= 0) continue;
        const double cost = cost_of(track[k], edges[i], predicted[k], params);
        if (cost >= 0 && cost < least) {
          least = cost;
          best_of_edge[i] = k;
        }
      }
    }
    for (int k = 0; k < kLineTracksMax; k++) {
      line_track &t = track[k];
      if (t.id == 0 || t.edge >= 0) continue;
      int best = -1;
      double least = 1e9, second = 1e9;
      for (int i = 0; i < count; i++) {
        if (taken[i]) continue;
        const double cost = cost_of(t, edges[i], predicted[k], params);
        if (cost < 0) continue;
        if (cost < least) {
          second = least;
          least = cost;
          best = i;
        } else if (cost < second) {
          second = cost;
        }
      }
      if (best < 0 || best_of_edge[best] != k || second < kRival * least) continue;
      taken[best] = true;
      t.edge = best;
      again = true;
    }
  }
  for (line_track &t : track) {
    if (t.id == 0) continue;
    if (t.edge < 0) {
      t.azimuth_rad = wrap(t.azimuth_rad + turn + t.rate_radps * dt);
      if (++t.unseen > params.keep_unseen) t.id = 0;
      continue;
    }
    const radial_edge &e = edges[t.edge];
    const double own = wrap(e.azimuth_rad - t.azimuth_rad - turn) / dt;
    t.rate_radps = t.seen < 2 ? own : t.rate_radps + kRateShare * (own - t.rate_radps);
    t.azimuth_rad = e.azimuth_rad;
    t.left_grey += 0.5 * (e.left_grey - t.left_grey);
    t.right_grey += 0.5 * (e.right_grey - t.right_grey);
    t.seen++;
    t.unseen = 0;
  }
  int at = 0;
  for (int i = 0; i < count; i++) {
    if (taken[i]) continue;
    while (at < kLineTracksMax && track[at].id != 0) at++;
    if (at == kLineTracksMax) {
      no_room++;
      continue;
    }
    track[at] = {next_id++, 1, 0, edges[i].azimuth_rad, 0, edges[i].left_grey, edges[i].right_grey, i};
    if (next_id == INT32_MAX / 16) next_id = 1;
  }
}

}  // namespace wm
