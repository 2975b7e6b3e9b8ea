// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/line_tracks.hpp"

#include <cstring>

namespace wm {

namespace {

constexpr double kBin_rad = 0.004;       // of the histogram of rotations: about a pixel of a 160 degree fisheye
constexpr double kTurnMax_rad = 0.3;     // largest rotation of the robot between pictures
constexpr int kBinsMax = 1024;           // half of them: 2 rad, above the largest rotation
constexpr int kSmoothing_bins = 3;       // half width of the triangular kernel: parallax spreads the votes. Not swept
constexpr double kGate_rad = 0.02;       // of the azimuth about its prediction: parallax of a picture. Not swept
constexpr double kAppearance_grey = 20;  // sigma of a side's brightness from picture to picture: exposure, backgrounds
constexpr int32_t kKeepUnseen = 10;      // pictures without the line after which its track ends: a person in front
constexpr double kStale_s = 1.0;         // after a longer gap no azimuth can be predicted
constexpr double kRateGain = 0.4;        // of the filter of a line's own rate (alpha-beta). Not swept
constexpr double kGreyGain = 0.5;        // of the filter of the sides' brightness. Not swept
constexpr double kFirstGate = 3;         // gate scale of a track seen once, whose rate is unknown
constexpr double kFirstVote = 0.3;       // weight of such a track in the vote
constexpr double kGatePerMiss = 0.5;     // the gate grows by this share for each picture in which the line was missed
constexpr double kRatioMin = 2.0;        // second best cost over the best: below, the association is ambiguous
constexpr double kInertia = 0.3;         // penalty in the vote of the largest change of the rotation rate
constexpr double kLooksMax = 4;          // squared sigmas of brightness beyond which a line is another one
constexpr double kLooksWeight = 0.25;    // of that in the cost, beside the squared gate fraction
constexpr double kCostFloor = 0.01;      // keeps the ratio test meaningful where both costs vanish
constexpr double kNever = 1e9;           // cost

bool same_sign(const line_track &t, const radial_edge &e) {
  return (t.left_grey > t.right_grey) == (e.left_grey > e.right_grey);
}

// Squared difference of the sides' brightness in sigmas, mean of both.
double appearance(const line_track &t, const radial_edge &e) {
  return (square(t.left_grey - e.left_grey) + square(t.right_grey - e.right_grey)) / (2 * square(kAppearance_grey));
}

// Rotation (about the expected one) of every pair of track and line of one sign, with its weight.
template <class Take>
void each_pair(const line_tracks &self, const radial_edge *edges, int count, double dt_s, double expected, Take take) {
  for (const line_track &t : self.track) {
    if (t.id == 0) continue;
    for (int i = 0; i < count; i++) {
      if (!same_sign(t, edges[i])) continue;
      const double moved = wrap(edges[i].azimuth_rad - t.azimuth_rad - t.rate_radps * dt_s * (t.unseen + 1)) - expected;
      const double weight = 1 / (1 + 4 * appearance(t, edges[i]));
      take(wrap(moved), t.seen > 1 ? weight : kFirstVote * weight);
    }
  }
}

// The bin with the most smoothed votes, within `half` bins; small changes of the rotation rate are preferred.
int best_bin(const double *votes, int half) {
  double best = 0;
  int at = 0;
  for (int b = -half; b <= half; b++) {
    double sum = 0;
    for (int k = -kSmoothing_bins; k <= kSmoothing_bins; k++)
      sum += votes[b + k + kBinsMax / 2] * (kSmoothing_bins + 1 - (k < 0 ? -k : k));
    sum *= 1 - kInertia * std::fabs(b) / (half + 1.0);
    if (sum > best) {
      best = sum;
      at = b;
    }
  }
  return at;
}

// Common rotation of the azimuths since the last picture, rad: the mode of a histogram over all pairs, refined to the
// weighted mean about it.
double find_turn(const line_tracks &self, const radial_edge *edges, int count, double dt_s) {
  double votes[kBinsMax] = {};
  constexpr int kHalfMax = kBinsMax / 2 - kSmoothing_bins - 1;
  const int wanted = static_cast<int>(kTurnMax_rad / kBin_rad), half = wanted < kHalfMax ? wanted : kHalfMax;
  const double expected = -self.turn_radps * dt_s;
  each_pair(self, edges, count, dt_s, expected, [&](double moved, double weight) {
    const int bin = static_cast<int>(std::floor(moved / kBin_rad + 0.5));
    if (bin >= -half && bin <= half) votes[bin + kBinsMax / 2] += weight;
  });
  const int at = best_bin(votes, half);
  double sum = 0, weights = 0;
  each_pair(self, edges, count, dt_s, expected, [&](double moved, double weight) {
    if (std::fabs(moved - at * kBin_rad) > (kSmoothing_bins + 0.5) * kBin_rad) return;
    sum += weight * moved;
    weights += weight;
  });
  return expected + (weights > 0 ? sum / weights : 0);
}

// Cost of associating an edge with a track; negative: outside of the gate.
double cost_of(const line_track &t, const radial_edge &e, double predicted) {
  if (!same_sign(t, e)) return -1;
  const double gate = kGate_rad * (t.seen < 2 ? kFirstGate : 1) * (1 + kGatePerMiss * t.unseen);
  const double off = wrap(e.azimuth_rad - predicted) / gate;
  const double looks = appearance(t, e);
  return off > 1 || off < -1 || looks > kLooksMax ? -1 : square(off) + kLooksWeight * looks + kCostFloor;
}

// Association of tracks and edges: mutual nearest neighbours with a ratio test, repeated among those left.
struct association {
  line_track *track;
  const radial_edge *edges;
  int count;
  const double *predicted;  // azimuth of each track
  bool taken[kRadialEdgesMax];
  int best_of_edge[kRadialEdgesMax];  // track; -1: none

  bool is_open(int k) const { return track[k].id != 0 && track[k].edge < 0; }
  double cost(int k, int i) const { return cost_of(track[k], edges[i], predicted[k]); }

  void find_best_tracks() {
    for (int i = 0; i < count; i++) {
      best_of_edge[i] = -1;
      double least = kNever;
      for (int k = 0; k < kLineTracksMax && !taken[i]; k++) {
        if (!is_open(k)) continue;
        const double here = cost(k, i);
        if (here < 0 || here >= least) continue;
        least = here;
        best_of_edge[i] = k;
      }
    }
  }
  // The edge of least cost for a track, if it is unambiguous and this track is the best of that edge; else -1.
  int choose(int k) const {
    int best = -1;
    double least = kNever, second = kNever;
    for (int i = 0; i < count; i++) {
      const double here = taken[i] ? -1 : cost(k, i);
      if (here < 0) continue;
      if (here < least) {
        second = least;
        least = here;
        best = i;
      } else if (here < second) {
        second = here;
      }
    }
    return best < 0 || best_of_edge[best] != k || second < kRatioMin * least ? -1 : best;
  }
  void run() {
    for (bool again = true; again;) {
      again = false;
      find_best_tracks();
      for (int k = 0; k < kLineTracksMax; k++) {
        const int best = is_open(k) ? choose(k) : -1;
        if (best < 0) continue;
        taken[best] = true;
        track[k].edge = best;
        again = true;
      }
    }
  }
};

// Carries a track on by its associated edge, or by prediction; too many misses end it.
void update(line_track *t, const radial_edge *edges, double turn, double dt_s) {
  if (t->edge < 0) {
    t->azimuth_rad = wrap(t->azimuth_rad + turn + t->rate_radps * dt_s);
    if (++t->unseen > kKeepUnseen) t->id = 0;
    return;
  }
  const radial_edge &e = edges[t->edge];
  const double own = wrap(e.azimuth_rad - t->azimuth_rad - turn) / dt_s;
  t->rate_radps = t->seen < 2 ? own : t->rate_radps + kRateGain * (own - t->rate_radps);
  t->azimuth_rad = e.azimuth_rad;
  t->left_grey += kGreyGain * (e.left_grey - t->left_grey);
  t->right_grey += kGreyGain * (e.right_grey - t->right_grey);
  t->seen++;
  t->unseen = 0;
}

}  // namespace

void line_tracks::clear() {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  next_id = 1;
  last_ns = WM_TIME_NONE;
}

void line_tracks::follow(const radial_edge *edges, int count, wm_time_ns t_ns) {
  const double dt_s = last_ns == WM_TIME_NONE ? kStale_s : wm_seconds_between(last_ns, t_ns);
  const bool is_stale = !(dt_s > 0 && dt_s < kStale_s);
  if (is_stale)
    for (line_track &t : track) t.id = 0;
  const double turn = is_stale ? 0 : find_turn(*this, edges, count, dt_s);
  last_ns = t_ns;
  turn_radps = is_stale ? 0 : -turn / dt_s;

  double predicted[kLineTracksMax];
  for (int k = 0; k < kLineTracksMax; k++) {
    line_track &t = track[k];
    t.edge = -1;
    predicted[k] = wrap(t.azimuth_rad + turn + t.rate_radps * dt_s);
  }
  association matched{track, edges, count, predicted, {}, {}};
  matched.run();
  for (line_track &t : track)
    if (t.id != 0) update(&t, edges, turn, dt_s);
  begin(edges, count, matched.taken);
}

void line_tracks::begin(const radial_edge *edges, int count, const bool *taken) {
  int at = 0;
  for (int i = 0; i < count; i++) {
    if (taken[i]) continue;
    while (at < kLineTracksMax && track[at].id != 0) at++;
    if (at == kLineTracksMax) {
      dropped++;
      continue;
    }
    track[at] = {next_id++, 1, 0, edges[i].azimuth_rad, 0, edges[i].left_grey, edges[i].right_grey, i};
    if (next_id == INT32_MAX / 16) next_id = 1;
  }
}

}  // namespace wm
