// SPDX-License-Identifier: Apache-2.0
// What a run against a raster map of edges has to show: the map's edges, the edges that the cameras saw, the particles.
#pragma once

#include <filesystem>

namespace wm::tools {

struct ReportData;

// Fills `edge_layer`, `cloud` and, in each of `frames`, `edges_seen` and `edges_mapped`: what the run's own pose says
// that the picture should show. Does nothing without map/map.yaml, and where the run fused no edge points. What can't
// be read leaves its part empty and a line in `notes`. Cameras are taken as calibration.yaml has them. Reads the run's
// whole event log, about 0.1 s for ten minutes.
void load_edges(const std::filesystem::path &run, const std::filesystem::path &recording, ReportData *data);

}  // namespace wm::tools
