// SPDX-License-Identifier: Apache-2.0
#include "web/map_view.h"

#include <nlohmann/json.hpp>

#include "common/map_edges.h"
#include "report/png.h"

namespace wm::tools {
namespace {

constexpr int kSide = 2000;  // cells a side: half a megabyte each

}  // namespace

MapView view_map(const wm_raster *raster) {
  nlohmann::json out = nlohmann::json::object();
  MapView made;
  const auto layer = [&](const char *name, const uint8_t *cells) -> std::shared_ptr<const std::string> {
    if (cells == nullptr) return nullptr;
    const MapMask mask = MapEdges(*raster).reduced(cells, kSide);
    out[name] = {{"width", mask.width},
                 {"height", mask.height},
                 {"cell_m", raster->resolution_m * mask.times},
                 {"origin", {raster->origin_x_m, raster->origin_y_m, raster->origin_yaw_rad}}};
    return std::make_shared<const std::string>(mask_png(mask.cells, mask.width, mask.height, 0x000000));
  };
  if (raster != nullptr) {
    made.floor_png = layer("floor", raster->drivable);
    made.edges_png = layer("edges", raster->edges);
  }
  made.json = std::make_shared<const std::string>(out.dump());
  return made;
}

}  // namespace wm::tools
