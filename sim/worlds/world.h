// SPDX-License-Identifier: Apache-2.0
// The five worlds that the simulator renders, each drawn anew by its seed: what there is to see, where one drives, what
// the map says, and what is really in each picture. The renderer makes pictures of `scene`, the sensors measure along
// `route` or `path`; this says nothing about errors of sensors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/render.h"
#include "render/scene.h"
#include "simulate/scenario.h"
#include "worlds/path6.h"
#include "worlds/plan.h"
#include "worlds/raster.h"

namespace wm::sim {

struct WorldRequest {
  std::string name;  // crossing, corridor, office, hall, seabed
  bool hard = false;
  uint64_t seed = 1;
  double rounds = 1.05;             // seabed: of the vehicle's way, each of about a minute
  bool markers_on_walls = false;    // office: markers on walls and a camera that looks ahead
  Markers markers = Markers::tags;  // office
  std::optional<Plan> plan;    // corridor, office, hall: this building instead of a drawn one; then give `route`, too
  std::optional<Route> route;  // instead of the drawn one (not for seabed); clutter and people keep out of its way
  std::optional<Footprint> footprint;  // corridor, office, hall: the robot's body instead of the world's usual one
  std::vector<wm_landmark> landmarks;  // corridor: those with a yaw hang as upright tags, the others are not seen
  double tag_m = 0.2;                  // edge of the tags' black square
};

struct WorldCamera {
  std::string name;
  images::Camera camera;  // as in calibration.yaml; errors of the mounting are the sensors' matter
  double rate_hz = 10;
  double exposure_s = 0.008;
  bool colour = false;
};

struct WorldLandmark {
  int32_t id = 0;
  images::Vec3 p{0, 0, 0};  // map
  double yaw_rad = NAN;     // markers: of the print's edge from upper left to upper right
  std::string what;
  double sigma_m = 0;  // of its place on the map; 0: as the scenario's errors say
};

enum class Vehicle { car, differential, six };  // six: six degrees of freedom, `path` instead of `route`

struct World {
  std::string name, about;
  bool hard = false;
  uint64_t seed = 1;

  render::Scene scene;  // committed
  Plan plan;            // buildings; empty for seabed
  Vehicle vehicle = Vehicle::car;
  Footprint footprint;
  double wheelbase_m = 0;  // car
  Route route;
  Path6 path;
  std::vector<WorldCamera> cameras;
  std::optional<RasterMap> map;           // corridor
  std::vector<WorldLandmark> truth;       // true places: landmarks, markers, vertical lines, beacons
  bool landmarks_known = false;           // landmarks.csv says where they are; else that is what SLAM has to find
  std::string marker_family;              // office; of `both` the AprilTags'
  double marker_size_m = 0;               // likewise
  std::string stereo_left, stereo_right;  // seabed: names of the cameras of the rectified pair

  // What label() looks for; filled by the maker. Each is a file of the recording.
  enum class Labels { edges, markers, lines, landmarks, beacons };
  std::vector<Labels> labels;
  bool has(Labels what) const { return std::find(labels.begin(), labels.end(), what) != labels.end(); }

  // Appends the true features of a picture to the rows of `label_file(what)`. `shot` is the one that the picture was
  // rendered with, `camera` the TRUE camera (with its mounting's error) at this place in `cameras`. Any thread, some
  // ms.
  void label(Labels what, size_t camera_index, const images::Camera &camera, const render::Shot &shot,
             std::string &rows) const;

  struct Line {  // an upright edge
    int32_t id;
    images::Vec3 foot, head;
    images::Vec2 side;  // unit vector to where it is seen from
  };
  std::vector<Line> lines;
  struct Panel {  // a marker (its black square) or a sign
    int32_t id;
    // Upper left, upper right, lower right, lower left as a viewer reads it; of an MR code its 8 x 8 modules'.
    images::Vec3 corners[4];
    images::Vec3 normal;
    images::Vec3 middle() const { return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]); }
  };
  std::vector<Panel> panels;
  double label_reach_m = 15;
  double beacon_radius_m = 0.14;  // the largest one
};

const char *label_file(World::Labels what);    // "labels/edges.csv"
const char *label_header(World::Labels what);  // "frame,polyline,u_px,v_px"

// Whether a panel is whole in a picture with nothing before it, and where its corners are there.
bool panel_in_view(const World &world, const images::Camera &camera, const render::Shot &shot,
                   const World::Panel &panel, images::Vec2 pixels[4]);

// nullptr and a text in `err` for an unknown name or a plan without a route. 1 to 5 s (light). The same request gives
// the same bytes.
std::unique_ptr<World> make_world(const WorldRequest &request, wm_error *err);
// Names of the worlds, NULL-terminated.
extern const char *const kWorldNames[];

}  // namespace wm::sim
