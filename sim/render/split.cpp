// SPDX-License-Identifier: Apache-2.0
// Triangles small enough that light at their corners says what it is in between.
#include "render/scene_data.h"

namespace wm::render {

namespace {

Corner middle(const Corner &a, const Corner &b) {
  Corner m{(a.position + b.position) / 2, a.normal + b.normal, (a.uv + b.uv) / 2};
  m.normal.normalize();
  return m;
}

// Longest-edge bisection (M.-C. Rivara, 1984): angles stay away from zero however long the triangle was.
void cut(const Triangle &whole, double cell_m, uint32_t material, std::vector<Triangle> &triangles,
         std::vector<uint32_t> &materials) {
  std::vector<Triangle> open{whole};
  while (!open.empty()) {
    const Triangle t = open.back();
    open.pop_back();
    size_t longest = 0;
    double length2 = 0;
    for (size_t i = 0; i < 3; i++) {
      const double l2 = (t[(i + 1) % 3].position - t[i].position).squaredNorm();
      if (l2 > length2) longest = i, length2 = l2;
    }
    if (cell_m <= 0 || length2 <= cell_m * cell_m) {
      triangles.push_back(t);
      materials.push_back(material);
      continue;
    }
    const Corner &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
    const Corner m = middle(a, b);
    open.push_back({a, m, c});
    open.push_back({m, b, c});
  }
}

}  // namespace

void split(const Mesh &mesh, double cell_m, std::vector<Triangle> &triangles, std::vector<uint32_t> &materials) {
  for (size_t i = 0; i < mesh.triangles.size(); i++) {
    Triangle t;
    for (size_t k = 0; k < 3; k++) {
      const uint32_t v = mesh.triangles[i][k];
      t[k] = {mesh.positions[v], mesh.normals.empty() ? Vec3(0, 0, 0) : mesh.normals[v],
              mesh.uv.empty() ? Vec2(0, 0) : mesh.uv[v]};
    }
    const Vec3 flat = (t[1].position - t[0].position).cross(t[2].position - t[0].position);
    if (!(flat.squaredNorm() > 0)) continue;  // no area: nothing to see
    for (Corner &c : t)
      if (c.normal.squaredNorm() < 0.25) c.normal = flat.normalized();
    cut(t, cell_m, mesh.materials[i], triangles, materials);
  }
}

}  // namespace wm::render
