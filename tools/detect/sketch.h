// SPDX-License-Identifier: Apache-2.0
// What a detector found, in pixels and drawn into its picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "images/picture.h"
#include "images/pictures.h"
#include "waymark/event.h"
#include "waymark/frame.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/setup.h"

namespace wm::tools {

// A camera's picture, with its model's rays and pixels.
class Sketch {
 public:
  // Throws Failure: a camera that no picture can be drawn with. `marker_m`: edge of markers, for their rings.
  Sketch(const wm_rig &rig, int32_t camera, double marker_m);

  // Pixel of an event's content; nothing where it has none in this picture, or is no single point.
  [[nodiscard]] std::optional<pixel> pixel_of_event(const wm_event &event) const;
  // The picture with what was found drawn in: points of edges and their polylines, sightings, rings around markers,
  // points of a stereo pair with their disparities.
  [[nodiscard]] images::Picture8 draw(const wm_frame &frame, const std::vector<wm_event> &events,
                                      const std::string &caption) const;
  // Edge points joined to polylines (detect/polylines.h).
  [[nodiscard]] std::vector<std::vector<pixel>> polylines(const wm_event &event) const;

 private:
  [[nodiscard]] std::optional<pixel> along(double bearing_rad, double elevation_rad) const;
  [[nodiscard]] std::optional<pixel> of_sensor(const vec3 &point_m) const;
  [[nodiscard]] std::optional<pixel> of_rectified(const double px[2]) const;
  void draw_points(const wm_event &event, images::Picture *out) const;
  void draw_sighting(const wm_sighting &sighting, images::Picture *out) const;
  void draw_marker(const wm_marker &marker, images::Picture *out) const;
  void draw_stereo(const wm_stereo &point, images::Picture *out) const;

  mounted_camera camera_{};
  mat3 R_base_body_{};
  double yaw_rad_ = 0, marker_m_ = 0;
  bool steep_ = false;
  double rectified_px_[4] = {};  // fu, fv, cu, cv; 0: the picture's own pixels
};

}  // namespace wm::tools
