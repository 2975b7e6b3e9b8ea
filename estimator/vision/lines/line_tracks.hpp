// SPDX-License-Identifier: Apache-2.0
// Lines from picture to picture: which one is which. All azimuths move by the robot's turn, each besides by its own
// parallax; the turn is found by vote, the line by prediction and by the brightness of its two sides.
#ifndef WAYMARK_ESTIMATOR_VISION_LINE_TRACKS_HPP
#define WAYMARK_ESTIMATOR_VISION_LINE_TRACKS_HPP

#include "vision/lines/radial_edges.hpp"
#include "waymark/time.h"

namespace wm {

inline constexpr int kLineTracksMax = 192;

struct line_track {
  int32_t id;  // 0: free; never used twice
  int32_t seen, unseen;
  double azimuth_rad, rate_radps;  // as seen last; its own motion, without the turn
  double left_grey, right_grey;
  int edge;  // index in the newest picture, -1: not seen
};

struct line_tracks {
  line_track track[kLineTracksMax];
  int32_t next_id;
  wm_time_ns last_ns;
  double turn_radps;  // of the robot, as the lines had it last
  uint64_t no_room;

  void clear();
  // Takes in the picture's lines: tracks are continued, begun and ended.
  void follow(const radial_edge *edges, int count, wm_time_ns t_ns, const wm_lines_params &params);
};

}  // namespace wm

#endif
