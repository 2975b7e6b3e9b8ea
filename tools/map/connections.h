// SPDX-License-Identifier: Apache-2.0
// The connections of a site's floors: each gives the transform from one floor's axes to another's.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "waymark/floors.h"

namespace wm::tools {

const char *kind_name(wm_connection_kind kind);
// NULL where it has none on that floor.
const wm_connection_end *end_on(const wm_connection &connection, int floor);
// A place in the axes of `from`'s floor, in those of `to`'s.
Eigen::Vector2d carry(const wm_connection_end &from, const wm_connection_end &to, const Eigen::Vector2d &place_m);
// Connections that contradict each other or the floors' origins, each with file, line and what to do.
std::vector<std::string> connections_that_do_not_meet(const wm_floors &site);

}  // namespace wm::tools
