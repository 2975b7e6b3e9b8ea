// SPDX-License-Identifier: Apache-2.0
// Tracks of lines from picture to picture. All azimuths move by the robot's rotation, each also by its own parallax.
// The rotation is found by a vote over all pairs; a line is associated by prediction and the brightness of its sides.
#ifndef WAYMARK_ESTIMATOR_VISION_LINE_TRACKS_HPP
#define WAYMARK_ESTIMATOR_VISION_LINE_TRACKS_HPP

#include "vision/lines/radial_edges.hpp"
#include "waymark/time.h"

namespace wm {

inline constexpr int kLineTracksMax = 192;  // bounds the memory and the time of association

struct line_track {
  int32_t id;  // 0: free; never used twice
  int32_t seen, unseen;
  double azimuth_rad, rate_radps;  // of the last picture that showed it; by parallax, without the rotation
  double left_grey, right_grey;
  int edge;  // index in the newest picture; -1: missed
};

struct line_tracks {
  line_track track[kLineTracksMax];
  int32_t next_id;
  wm_time_ns last_ns;
  double turn_radps;  // rotation rate of the robot between the last two pictures
  uint64_t dropped;   // lines that had no free track

  void clear();
  // Continues, begins and ends tracks by the lines of a picture.
  void follow(const radial_edge *edges, int count, wm_time_ns t_ns);

 private:
  void begin(const radial_edge *edges, int count, const bool *taken);
};

}  // namespace wm

#endif
