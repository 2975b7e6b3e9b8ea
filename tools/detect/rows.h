// SPDX-License-Identifier: Apache-2.0
// Detections as CSV: columns by the kind of the detector's events.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "detect/sketch.h"
#include "waymark/event.h"
#include "waymark/frame.h"

namespace wm::tools {

//   points    frame,polyline,u_px,v_px                                       as `waymark eval --detector edges` reads
//   sightings frame,picture,t_ns,id,bearing_rad,bearing_sigma_rad,elevation_rad,elevation_sigma_rad,range_m,
//             range_sigma_m,u_px,v_px
//   markers   frame,picture,t_ns,id,x_m,y_m,z_m,yaw_rad,yaw_sigma_rad,along_sigma_m,poses,u_px,v_px
//   stereo    frame,picture,t_ns,id,ul_px,vl_px,ur_px,vr_px
// A picture without a detection has one row with its frame and empty fields. Places of markers are in the sensor's
// frame (x along the view, y left, z up); absent numbers are empty.
class DetectionRows {
 public:
  // `kinds`: the detector's, as bits. Throws Failure: can't be written.
  DetectionRows(const std::filesystem::path &file, uint32_t kinds);
  void add(const wm_frame &frame, const std::string &picture, const std::vector<wm_event> &events,
           const Sketch &sketch);
  // Throws Failure where a row could not be written.
  void finish();

 private:
  void add_points(const wm_frame &frame, const std::vector<wm_event> &events, const Sketch &sketch);
  void begin(const wm_frame &frame, const std::string &picture);
  void number(double value, int digits);
  void end();

  std::filesystem::path file_;
  std::ofstream csv_;
  bool has_points_;
  size_t columns_;
};

}  // namespace wm::tools
