// SPDX-License-Identifier: Apache-2.0
#include "worlds/prints.h"

#include "render/shapes.h"
#include "waymark/internal/math/elementary.hpp"
#include "waymark/mr_code.h"
#include "worlds/tags.h"

namespace wm::sim {

using images::Vec3;

double Print::whole_m() const { return mr ? size_m * kMrSheet : size_m * 10 / 8; }
double Print::module_m() const { return mr ? size_m * WM_MR_MODULE : size_m / 8; }

World::Panel Print::square(double left_m, double top_m, double edge_m) const {
  const Vec3 r = right.normalized(), u = up.normalized(), corner = middle + left_m * r + top_m * u;
  World::Panel panel;
  panel.id = id;
  panel.corners[0] = corner;
  panel.corners[1] = corner + edge_m * r;
  panel.corners[2] = corner + edge_m * r - edge_m * u;
  panel.corners[3] = corner - edge_m * u;
  panel.normal = right.cross(up).normalized();
  return panel;
}

void hang(const Print &print, World &world) {
  render::Material m;
  m.albedo = images::Colour(1.f);
  m.texture =
      render::Texture::make(print.mr ? mr_picture(print.id, 512) : tag36h11_picture(print.id, 16), render::Wrap::clamp);
  const double whole = print.whole_m();
  m.texture_size_m = {whole, whole};
  world.scene.add(render::picture(print.middle, print.right, print.up, whole, whole, world.scene.add(m)));
  const double left = print.mr ? print.size_m * WM_MR_CODE_LEFT : -0.5 * print.size_m;
  world.panels.push_back(print.square(left, print.mr ? -print.size_m * WM_MR_CODE_TOP : -left, -2 * left));
  world.truth.push_back(
      {print.id, print.middle, wm::atan2(print.right.y(), print.right.x()), print.mr ? "mr" : "marker"});
}

wm_status hang_listed(const WorldRequest &request, World &world, wm_error *err) {
  constexpr double kPaper_m = 0.004, kFront_m = 0.05;  // before the wall: the paper; what has to be free
  bool tags = false;
  for (const wm_landmark &l : request.landmarks) {
    const Vec3 place(l.p_m[0], l.p_m[1], l.p_m[2]);
    if (std::isnan(l.yaw_rad)) {
      world.truth.push_back({l.id, place, NAN, "landmark"});
    } else {
      const auto yaw = wm::sincos(l.yaw_rad);
      const Vec3 right(yaw.cos, yaw.sin, 0), up(0, 0, 1), normal = right.cross(up);
      if (l.id >= tag36h11_count())
        return wm_fail(err, WM_BAD_CONFIG, "world.landmarks: tag %d: tag36h11 has the ids 0 to %d", l.id,
                       tag36h11_count() - 1);
      const Vec3 front = place + kFront_m * normal;
      if (!world.plan.free({front.x(), front.y()}, false))
        return wm_fail(err, WM_BAD_CONFIG,
                       "world.landmarks: tag %d at (%.2f, %.2f) looks into a wall; yaw_deg is the direction from its "
                       "left edge to its right one, as who stands before it reads it",
                       l.id, place.x(), place.y());
      hang({l.id, false, place + kPaper_m * normal, right, up, request.tag_m}, world);
      tags = true;
    }
    world.truth.back().sigma_m = l.sigma_m;
  }
  if (!tags) return WM_OK;
  world.labels.push_back(World::Labels::markers);
  world.marker_family = "tag36h11";
  world.marker_size_m = request.tag_m;
  return WM_OK;
}

}  // namespace wm::sim
