// SPDX-License-Identifier: Apache-2.0
#include "common/line_sightings.h"

#include <Eigen/Geometry>
#include <cmath>
#include <memory>

#include "common/event_log.h"
#include "common/failure.h"

namespace wm::tools {
namespace {

using Eigen::Vector3d;

// A bearing in the sensor's own axes as an azimuth in base_link's. A sensor that looks up or down has azimuths already,
// about its mounting's yaw.
double azimuth_of(double bearing_rad, const wm_mounting &mounting) {
  const double *rpy = mounting.rpy_rad;
  const Eigen::Matrix3d axes =
      (Eigen::AngleAxisd(rpy[2], Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3d::UnitY()) *
       Eigen::AngleAxisd(rpy[0], Vector3d::UnitX()))
          .toRotationMatrix();
  if (std::fabs(axes(2, 0)) > M_SQRT1_2) return std::remainder(bearing_rad + rpy[2], 2 * M_PI);
  const Vector3d x = axes.col(0), y = axes.col(1), across = std::sin(bearing_rad) * x - std::cos(bearing_rad) * y;
  Eigen::Vector2d along(-across.y(), across.x());
  if (along.dot((std::cos(bearing_rad) * x + std::sin(bearing_rad) * y).head<2>()) < 0) along = -along;
  return std::atan2(along.y(), along.x());
}

}  // namespace

LineSightings load_line_sightings(const std::filesystem::path &run, const std::string &name, wm_camera *camera) {
  const std::filesystem::path file = run / "events.wmlog";
  EventLog log(run);
  const wm_log_head &head = log.head();
  const int index = wm_rig_find_camera(&head.rig, name.c_str());
  size_t sensor = 0;
  while (sensor < head.sensor_count && name != head.sensors[sensor].name) sensor++;
  if (index < 0 || sensor == head.sensor_count)
    throw Failure(file.string() + ": the camera '" + name + "' saw no upright lines (`vision: {lines: {}}`)");
  *camera = head.rig.cameras[index];
  LineSightings out;
  while (const wm_event *next = log.next()) {
    const wm_event &event = *next;
    if (event.kind == WM_EVENT_LOOKED && event.as.looked.sensor == sensor) (void)out[event.t_ns];
    if (event.kind != WM_EVENT_SIGHTING || event.as.sighting.sensor != sensor ||
        !std::isfinite(event.as.sighting.bearing_rad) || std::isfinite(event.as.sighting.range_m))
      continue;
    const wm_sighting &s = event.as.sighting;
    out[event.t_ns].push_back(
        {s.landmark_id, azimuth_of(s.bearing_rad, head.sensors[sensor].mounting), s.bearing_sigma_rad});
  }
  return out;
}

}  // namespace wm::tools
