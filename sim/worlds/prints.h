// SPDX-License-Identifier: Apache-2.0
// Coded markers that hang in a world: what one sees of each, and what truth and labels say.
#pragma once

#include "worlds/world.h"

namespace wm::sim {

// A marker in its place. `right` and `up` are the directions of its edges as a viewer reads it.
struct Print {
  int id;
  bool mr;  // an MR code; else an AprilTag of 36h11
  images::Vec3 middle, right, up;
  double size_m;  // of the tag's black square, of the MR code

  double whole_m() const;   // edge of its paper
  double module_m() const;  // of its smallest square
  // A square on it: the distances of its upper left corner from the middle, to the right and up, and its edge.
  World::Panel square(double left_m, double top_m, double edge_m) const;
};

// Adds a marker to the scene, to the panels that are labelled and to the true places.
void hang(const Print &print, World &world);

// Adds the request's landmarks: those with a yaw as upright tags, 4 mm before the place that is stated; the others to
// the true places alone. WM_BAD_CONFIG for an id that the family doesn't have, and for a tag whose front is in a wall.
wm_status hang_listed(const WorldRequest &request, World &world, wm_error *err);

}  // namespace wm::sim
